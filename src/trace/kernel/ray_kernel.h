#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/grid/density_grid.h>
#include <quoin/trace/packet.h>

#include "core/instruction_set.h"
#include "trace/tree_view.h"

namespace quoin {
struct DensityStorage;
}

namespace quoin::trace {

/// The part of a field that kernels read.
struct FieldView {
  const TreeView* cells;  ///< cells with a solid corner
  const DensityGrid* grid;
  /// Returns the densities of a chunk; null if the chunk is missing or uniform.
  const DensityStorage* (*find)(const DensityGrid& grid, int x, int y, int z);
  /// Reads the densities of any cell's corners, by x + 2 y + 4 z.
  void (*read)(const DensityGrid& grid, int x, int y, int z, float* corners);
};

/// The point where a field becomes negative along a ray: the cell, its corner densities by x + 2 y + 4 z, and t.
struct FieldHit {
  double t;
  int x, y, z;
  float corners[8];
};

/// The most packets in one call of Kernel::any_hits.
inline constexpr std::size_t kMostPackets = 256;

// All kernels return the same results as a walk over lattice planes. The walk crosses plane P of an axis at t = (P -
// origin) * (1 / direction), in single precision, rounded after each operation. Crossings are ordered by t, and by axis
// at ties. The origin is relative to a multiple of 64 voxels near the ray's start.
struct Kernel {
  /// Traces one ray; does not set `face` if the ray starts inside.
  bool (*first_hit)(const TreeView& tree, const Ray& ray, double max_t, RayHit& hit, bool& unfinished);
  /// Returns true if the ray is blocked.
  bool (*any_hit)(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished);
  /// Fills in `PacketHits`. The caller must trace the lanes of `unfinished` with other code.
  void (*first_hits)(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished);
  /// Writes the blocked lanes of `size` packets. The caller must trace the lanes of `unfinished` with other code.
  /// Requires: size <= kMostPackets.
  void (*any_hits)(const TreeView& tree, const RayPacket* packets, std::size_t size, std::uint32_t* blocked,
                   std::uint32_t* unfinished);
};

/// Kernels for density fields, in separate files: in one file with the voxel kernels, compilers turn shared functions
/// into calls, and rays among voxels take 10 % more instructions (docs/decisions/archive/052).
struct FieldKernel {
  /// Traces one ray in a field. The caller walks `unfinished` rays with other code, and all rays if the pointer is
  /// null. `any_in_field` does not set `t`.
  bool (*first_in_field)(const FieldView& field, const Ray& ray, double max_t, FieldHit& hit, bool& unfinished);
  bool (*any_in_field)(const FieldView& field, const Ray& ray, double max_t, FieldHit& hit, bool& unfinished);
  /// Traces packets, lane by lane; null if the caller must trace the rays one by one.
  std::uint32_t (*first_hits_in_field)(const FieldView& field, const RayPacket& rays, FieldHit* hits,
                                       std::uint32_t& unfinished);
  std::uint32_t (*any_hits_in_field)(const FieldView& field, const RayPacket& rays, std::uint32_t& unfinished);
};

/// Traces any ray on any processor, in a world of any size; `field.cells` may be null.
bool walk_in_field(const OccupancyTree& cells, const FieldView& field, const Ray& ray, double max_t, bool asks_where,
                   FieldHit& hit);

// Kernels for wider instructions are defined only where they are compiled. The tables list the available ones.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const FieldKernel kPlainFieldKernel;
extern const FieldKernel kAvx2FieldKernel;
extern const FieldKernel kAvx512FieldKernel;
extern const KernelTable<Kernel> kKernels;
extern const KernelTable<FieldKernel> kFieldKernels;

/// Returns the kernel with the widest instructions that this machine supports.
[[nodiscard]] inline const Kernel& kernel() {
  return kKernels.widest();
}
[[nodiscard]] inline const FieldKernel& field_kernel() {
  return kFieldKernels.widest();
}

}  // namespace quoin::trace
