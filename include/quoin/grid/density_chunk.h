#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <quoin/core/half.h>
#include <quoin/core/ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

/// Rounds a density to its stored half. The result is never NaN and never -0, and its magnitude is at most `band`.
///
/// Sign:     the sign is kept, however small the density. Only 0 is stored as 0. Other magnitudes are at least 2^-14
///           (or `band`, if less), because smaller halves are slow on many processors.
/// NaN:      counts as far outside and gives `band`.
/// Band:     a band that is not a half is rounded down to a half, but to at least 2^-24.
/// Requires: 0 < band.
[[nodiscard]] Half stored_density(float density, float band);

struct [[gnu::visibility("hidden")]] DensityStorage;

/// A chunk of 64^3 density samples with a material each. Densities are halves: negative is solid, 0 and above is air.
///
/// Values:   every density must be the result of `stored_density`. Other halves are errors of the caller: -0 would
///           count as solid, and infinities and NaN are invalid.
/// Layout:   samples lie in rows of 64 along x. A slab is 4x4 rows, as in Chunk. The grid clamps densities far from the
///           surface to one value, and a slab of one value stores no samples. The signs of each row are also stored as
///           one word, so that the surface search reads 1/16 of the bytes.
/// Sharing:  copies share their storage. The first write to a copy copies its tables (34 KB), and the first write to a
///           slab that slab (2 KB).
class DensityChunk {
 public:
  /// Creates a chunk with one density and material. Requires: the density is a `stored_density`.
  explicit DensityChunk(Half density, VoxelType material = kAir);
  DensityChunk(const DensityChunk& other);
  DensityChunk(DensityChunk&& other) noexcept;
  DensityChunk& operator=(const DensityChunk& other);
  DensityChunk& operator=(DensityChunk&& other) noexcept;
  ~DensityChunk();

  /// Returns the density of a sample. Requires: 0 <= x, y, z < 64.
  [[nodiscard]] Half get(int x, int y, int z) const;
  [[nodiscard]] Half get(IVec3 local) const { return get(local.x, local.y, local.z); }
  /// Returns a mask of the solid samples (below 0) of a row. Requires: 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t solid_row(int y, int z) const;
  /// Returns the 64 samples of a row, or null if its slab or the chunk is uniform; `get` then returns the value.
  /// Requires: 0 <= y, z < 64. Lifetime: until the chunk is written, assigned or destroyed.
  [[nodiscard]] const Half* row(int y, int z) const;
  /// Copies the densities of one row to `out`. Requires: 0 <= y, z < 64.
  void read_row(int y, int z, std::span<Half, kChunkEdge> out) const;

  /// Writes the densities of a row. Returns a mask of the samples that changed. Slabs stay expanded until
  /// `unite_slabs`.
  /// Requires: 0 <= y, z < 64; every density is a `stored_density`.
  std::uint64_t write_row(int y, int z, std::span<const Half, kChunkEdge> densities);
  /// As above, for densities that are not rounded yet (`stored_density`). Requires: 0 < band.
  std::uint64_t write_row(int y, int z, std::span<const float, kChunkEdge> densities, float band);
  /// Sets all densities to one value and keeps the materials. Requires: the density is a `stored_density`.
  void fill(Half density);
  /// Returns the density of all samples if the chunk is stored as uniform, nullopt otherwise.
  [[nodiscard]] std::optional<Half> uniform() const {
    return storage_ == nullptr ? std::optional(uniform_) : std::nullopt;
  }
  /// Detects slabs that became uniform, and a chunk that became uniform. Stores each as one value and reuses its
  /// memory.
  /// Cost: reads one row of most slabs.
  void unite_slabs();
  /// Calls `unite_slabs`, then frees unused memory of densities and materials.
  void compact();

  /// Returns true if all samples are solid. Cost: O(4096).
  [[nodiscard]] bool is_full() const;
  /// Returns true if both chunks share their densities and materials; see Chunk::shares_storage_with.
  [[nodiscard]] bool shares_storage_with(const DensityChunk& other) const {
    return storage_ == other.storage_ && (storage_ != nullptr || uniform_ == other.uniform_) &&
           materials_.shares_storage_with(other.materials_);
  }
  /// Returns true if all densities and materials are equal, however they are stored. Cost: same as for Chunk.
  [[nodiscard]] bool operator==(const DensityChunk& other) const;
  /// Returns a hash of densities and materials; see Chunk::content_hash. Cost: up to 0.2 ms.
  [[nodiscard]] std::uint64_t content_hash() const;

  /// Returns the materials of the samples. A write to the materials counts as a write to this chunk.
  [[nodiscard]] const Chunk& materials() const { return materials_; }
  [[nodiscard]] Chunk& materials() { return materials_; }
  /// Returns the memory in use, in bytes, including this object and its materials.
  [[nodiscard]] std::size_t bytes() const;

  /// Returns true if a stored density is below 0.
  [[nodiscard]] static constexpr bool is_solid(Half density) { return (density & 0x8000U) != 0; }

 private:
  friend struct DensityStorage;
  void make_mixed();

  Half uniform_;
  Chunk materials_;
  Ref<DensityStorage> storage_;
};

/// A density chunk and its 26 neighbours: all the input for meshing one chunk. Lifetime: same as Neighbourhood.
struct DensityNeighbourhood {
  /// Chunks by Neighbourhood::index; a null chunk reads as `outside`.
  std::array<const DensityChunk*, 27> chunks{};
  Half outside = 0x4800;  ///< 8.0

  /// Returns the chunk at an offset, or null. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] const DensityChunk* at(int dx, int dy, int dz) const {
    return chunks[Neighbourhood::index(dx, dy, dz)];
  }
  [[nodiscard]] const DensityChunk* centre() const { return chunks[13]; }
  /// Returns the density at a position relative to the centre chunk. Requires: -64 <= local.x, local.y, local.z < 128.
  [[nodiscard]] Half get(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const DensityChunk* found = at(chunk.x, chunk.y, chunk.z);
    const IVec3 p = local_of(local);
    return found == nullptr ? outside : found->get(p.x, p.y, p.z);
  }
  /// Returns the material at a position relative to the centre chunk. Requires: as `get`.
  [[nodiscard]] VoxelType material(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const DensityChunk* found = at(chunk.x, chunk.y, chunk.z);
    return found == nullptr ? kAir : found->materials().get(local_of(local));
  }
};

}  // namespace quoin
