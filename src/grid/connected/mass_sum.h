#pragma once

// Sums of mass, of mass times position and of mass times products of positions. Positions are relative to an origin in
// the body, so that the sums of ordinary bodies are exact.

#include <cstdint>
#include <limits>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/mass.h>

namespace quoin {

/// The densities of types, each asked for once.
class DensityTable {
 public:
  explicit DensityTable(DensityOfType density) : density_(density) {}
  [[nodiscard]] double operator[](VoxelType type);

 private:
  DensityOfType density_;
  std::vector<double> known_;  // by type; NaN: not asked for yet
};

/// The moments of a body.
struct MassMoments {
  double mass = 0.0;
  DVec3 first{0.0};    ///< mass * position
  DVec3 squares{0.0};  ///< mass * x^2, y^2, z^2
  DVec3 mixed{0.0};    ///< mass * yz, xz, xy

  /// Adds moments about another origin, which is at `offset` from the own one.
  void add(const MassMoments& other, const DVec3& offset);
  /// Returns the properties of a body of cubes with edges of `edge`, whose centres have these moments about `origin`.
  [[nodiscard]] MassProperties properties(const DVec3& origin, double edge) const;
};

/// Adds up voxels, chunk by chunk. Moments are exact integers within a chunk.
class VoxelMass {
 public:
  explicit VoxelMass(DensityOfType density) : densities_(density) {}

  /// Begins a chunk. Each chunk may come once. Lifetime: the chunk must outlive its additions.
  void begin(IVec3 at, const Chunk& chunk);
  /// Adds the voxels of row (y, z) of the chunk whose bits are set in `voxels`; air has no mass.
  void add_row(int y, int z, std::uint64_t voxels);
  /// Adds all voxels of the chunk.
  void add_chunk();
  [[nodiscard]] MassProperties properties();

 private:
  // Coordinates are those of the voxels' lowest corners in the chunk: at most 2^18 voxels and 63^2, below 2^30.
  struct Counts {
    VoxelType type = kAir;
    std::int64_t voxels = 0;
    std::int64_t x = 0, y = 0, z = 0;
    std::int64_t xx = 0, yy = 0, zz = 0;
    std::int64_t yz = 0, xz = 0, xy = 0;
  };
  Counts& counts_of(VoxelType type);
  void add_run(VoxelType type, int begin, int end, int y, int z);
  void add_runs(VoxelType type, std::uint64_t voxels, int y, int z);
  void finish_chunk();

  DensityTable densities_;
  std::vector<Counts> counts_;        // of the present chunk
  std::vector<std::uint32_t> slots_;  // by type: its index in `counts_` plus 1; 0: none
  MassMoments moments_;
  IVec3 origin_{0};  // of the first chunk
  IVec3 at_{0};
  const Chunk* chunk_ = nullptr;
  std::vector<VoxelType> types_;  // of the chunk, except air
  bool has_origin_ = false;
};

}  // namespace quoin
