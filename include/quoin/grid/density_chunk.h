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

namespace quoin {

/// The stored form of a density: never NaN, never -0, at most `band` from 0, and of the sign that was given, however
/// small: 0 alone is stored as 0, the rest as 2^-14 at least (or `band`, if that is less), since smaller halves are
/// slow on many processors. NaN counts as far outside (`band`). A band between two halves counts as the lesser, but as
/// 2^-24 at least.
/// Requires: 0 < band.
[[nodiscard]] Half stored_density(float density, float band);

struct DensityStorage;

/// 64^3 samples of a density (half floats, negative is solid, 0 is air) with a material each.
///
/// Densities are as `stored_density` gives them: whoever writes a half here makes it by that. A half that it never
/// gives, such as -0 (which would count as solid), an infinity or NaN, is a mistake.
/// Samples lie in rows of 64 along x; 4x4 rows are a slab, the unit of uniformity, as in Chunk: what is far from the
/// surface is clamped to one value by the grid, and a slab of one value holds no samples. The signs of a row are also
/// kept as one word, so that finding the surface reads 1/16 of the bytes. Copies share their storage as those of Chunk
/// do.
class DensityChunk {
 public:
  /// All samples of one density and material. Requires: a `stored_density`.
  explicit DensityChunk(Half density, VoxelType material = kAir);
  DensityChunk(const DensityChunk& other);
  DensityChunk(DensityChunk&& other) noexcept;
  DensityChunk& operator=(const DensityChunk& other);
  DensityChunk& operator=(DensityChunk&& other) noexcept;
  ~DensityChunk();

  /// Requires: 0 <= x, y, z < 64.
  [[nodiscard]] Half get(int x, int y, int z) const;
  [[nodiscard]] Half get(IVec3 local) const { return get(local.x, local.y, local.z); }
  /// Which samples of a row are solid (below 0). Requires: 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t solid_row(int y, int z) const;
  /// The 64 samples of a row, or null where its slab, or the chunk, is of one value: `get` of any of them.
  /// Requires: 0 <= y, z < 64. Lifetime: until the chunk is written, assigned or destroyed.
  [[nodiscard]] const Half* row(int y, int z) const;
  /// Copies the densities of one row to `out`. Requires: 0 <= y, z < 64.
  void read_row(int y, int z, std::span<Half, kChunkEdge> out) const;

  /// Writes the densities of one row. Returns which samples had another one before. Slabs stay expanded until
  /// `unite_slabs`. Requires: 0 <= y, z < 64; every density is a `stored_density`.
  std::uint64_t write_row(int y, int z, std::span<const Half, kChunkEdge> densities);
  /// Makes the whole chunk one density; materials stay. Requires: a `stored_density`.
  void fill(Half density);
  /// The density of all samples, if the chunk is stored as such.
  [[nodiscard]] std::optional<Half> uniform() const {
    return storage_ == nullptr ? std::optional(uniform_) : std::nullopt;
  }
  /// Finds the slabs, and the chunk, that came to hold one density: they read as such then, and their room is reused.
  /// Cost: reads one row of most slabs.
  void unite_slabs();
  /// `unite_slabs`, and gives back the memory that this and the materials no longer need.
  void compact();

  /// Whether every sample is solid. Cost: O(4096).
  [[nodiscard]] bool is_full() const;
  /// As Chunk::shares_storage_with, of densities and materials.
  [[nodiscard]] bool shares_storage_with(const DensityChunk& other) const {
    return storage_ == other.storage_ && (storage_ != nullptr || uniform_ == other.uniform_) &&
           materials_.shares_storage_with(other.materials_);
  }
  /// The same densities and materials everywhere, however they are stored. Cost: as that of Chunk.
  [[nodiscard]] bool operator==(const DensityChunk& other) const;
  /// As Chunk::content_hash, of densities and materials. Cost: up to 0.2 ms.
  [[nodiscard]] std::uint64_t content_hash() const;

  /// The samples' materials; what is written into them counts as a write to this chunk.
  [[nodiscard]] const Chunk& materials() const { return materials_; }
  [[nodiscard]] Chunk& materials() { return materials_; }
  /// Bytes held, this object and its materials included.
  [[nodiscard]] std::size_t bytes() const;

  /// Whether a stored density is below 0.
  [[nodiscard]] static constexpr bool is_solid(Half density) { return (density & 0x8000U) != 0; }

 private:
  friend struct DensityStorage;
  void make_mixed();
  std::uint32_t slot_for_writing(std::size_t slab);

  Half uniform_;
  Chunk materials_;
  Ref<DensityStorage> storage_;
};

/// A density chunk and its 26 neighbours: all that meshing a chunk may read. Lifetime: as Neighbourhood.
struct DensityNeighbourhood {
  /// By Neighbourhood::index; null reads as `outside`.
  std::array<const DensityChunk*, 27> chunks{};
  Half outside = 0x4800;  ///< 8.0

  /// The chunk at an offset. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] const DensityChunk* at(int dx, int dy, int dz) const {
    return chunks[Neighbourhood::index(dx, dy, dz)];
  }
  [[nodiscard]] const DensityChunk* centre() const { return chunks[13]; }
  /// The sample at a position relative to the centre chunk. Requires: -64 <= local.x, local.y, local.z < 128.
  [[nodiscard]] Half get(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const DensityChunk* found = at(chunk.x, chunk.y, chunk.z);
    const IVec3 p = local_of(local);
    return found == nullptr ? outside : found->get(p.x, p.y, p.z);
  }
};

}  // namespace quoin
