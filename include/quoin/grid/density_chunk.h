#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/half.h>
#include <quoin/core/ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

namespace quoin {

/// The stored form of a density: never NaN, never -0, at most `band` from 0, and of the sign that was given, however
/// small: 0 alone is stored as 0, the rest as 2^-14 at least, since smaller halves are slow on many processors. NaN
/// counts as far outside (`band`). A band between two halves counts as the lesser, but as 2^-24 at least.
/// Requires: 0 < band.
[[nodiscard]] Half stored_density(float density, float band);

/// 64^3 samples of a density (half floats, negative is solid, 0 is air) with a material each.
///
/// Samples lie in rows of 64 along x; 4x4 rows are a slab, the unit of uniformity, as in Chunk: what is far from the
/// surface is clamped to one value by the grid, and a slab of one value holds no samples. The signs of a row are also
/// kept as one word, so that finding the surface reads 1/16 of the bytes. Copies share their storage as those of Chunk
/// do.
class DensityChunk {
 public:
  /// All samples of one density and material.
  explicit DensityChunk(Half density, VoxelType material = kAir);

  /// Requires: 0 <= x, y, z < 64.
  [[nodiscard]] Half get(int x, int y, int z) const {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
    if (mixed_ == nullptr) return uniform_;
    const std::uint32_t slab = mixed_->slabs[Chunk::slab_index(y, z)];
    if ((slab & kUniformSlab) != 0) return static_cast<Half>(slab);
    return mixed_->row(slab, Chunk::row_in_slab(y, z))[x];
  }
  /// Which samples of a row are solid (below 0).
  [[nodiscard]] std::uint64_t solid_row(int y, int z) const {
    if (mixed_ == nullptr) return is_solid(uniform_) ? ~std::uint64_t{0} : 0;
    return mixed_->solid[static_cast<std::size_t>(z * kChunkEdge + y)];
  }
  /// The 64 samples of a row, or null where its slab, or the chunk, is of one value: `get` of any of them.
  [[nodiscard]] const Half* row(int y, int z) const {
    if (mixed_ == nullptr) return nullptr;
    const std::uint32_t slab = mixed_->slabs[Chunk::slab_index(y, z)];
    return (slab & kUniformSlab) != 0 ? nullptr : mixed_->row(slab, Chunk::row_in_slab(y, z));
  }
  void read_row(int y, int z, std::span<Half, kChunkEdge> out) const;

  /// Answers which samples of the row had another density before. Slabs stay expanded until `unite_slabs`.
  std::uint64_t write_row(int y, int z, std::span<const Half, kChunkEdge> densities);
  /// Makes the whole chunk one density; materials stay.
  void fill(Half density);
  /// The density of all samples, if the chunk is stored as such.
  [[nodiscard]] std::optional<Half> uniform() const {
    return mixed_ == nullptr ? std::optional(uniform_) : std::nullopt;
  }
  /// Finds the slabs, and the chunk, that came to hold one density: they read as such then, and their room is reused.
  /// Cost: reads one row of most slabs.
  void unite_slabs();
  /// `unite_slabs`, and gives back the memory that this and the materials no longer need.
  void compact();

  /// Whether every sample is solid. Cost: O(4096).
  [[nodiscard]] bool is_full() const;
  /// Whether a copy of the other has not been written since, nor this: equal without a look. False says nothing.
  [[nodiscard]] bool shares_storage_with(const DensityChunk& other) const {
    return mixed_ == other.mixed_ && (mixed_ != nullptr || uniform_ == other.uniform_) &&
           materials_.shares_storage_with(other.materials_);
  }
  /// As Chunk::content_hash, of densities and materials. Cost: up to 0.2 ms.
  [[nodiscard]] std::uint64_t content_hash() const;

  [[nodiscard]] const Chunk& materials() const { return materials_; }
  [[nodiscard]] Chunk& materials() { return materials_; }
  /// Bytes held, this object and its materials included.
  [[nodiscard]] std::size_t bytes() const;

  [[nodiscard]] static constexpr bool is_solid(Half density) { return (density & 0x8000U) != 0; }

  /// The storage itself, for meshing.
  struct Mixed : RefCounted {
    std::array<std::uint32_t, 256> slabs{};  ///< [z / 4][y / 4]: kUniformSlab | half, or a slot in `values`
    std::vector<Half> values;                ///< [slot][z % 4][y % 4][x]
    std::vector<std::uint32_t> free_slots;
    std::array<std::uint64_t, kChunkEdge * kChunkEdge> solid{};  ///< [z][y]: the signs of a row

    [[nodiscard]] const Half* row(std::uint32_t slot, int row_in_slab) const {
      return values.data() + (std::size_t{slot} * 16 + static_cast<std::size_t>(row_in_slab)) * kChunkEdge;
    }
  };
  static constexpr std::uint32_t kUniformSlab = 0x8000'0000U;
  /// Null when the chunk is uniform.
  [[nodiscard]] const Mixed* mixed() const { return mixed_.get(); }

 private:
  void make_mixed();
  std::uint32_t slot_for_writing(std::size_t slab);

  Half uniform_;
  Chunk materials_;
  Ref<Mixed> mixed_;
};

/// A density chunk and its 26 neighbours: all that meshing a chunk may read.
struct DensityNeighbourhood {
  /// [(dz + 1) * 9 + (dy + 1) * 3 + (dx + 1)]; null reads as `outside`. Borrowed until the grid is edited.
  std::array<const DensityChunk*, 27> chunks{};
  Half outside = 0x4800;  ///< 8.0

  [[nodiscard]] const DensityChunk* at(int dx, int dy, int dz) const {
    return chunks[static_cast<std::size_t>((dz + 1) * 9 + (dy + 1) * 3 + (dx + 1))];
  }
  [[nodiscard]] const DensityChunk* centre() const { return chunks[13]; }
  /// The sample at a position relative to the centre chunk, -64..127 on each axis.
  [[nodiscard]] Half get(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const DensityChunk* found = at(chunk.x, chunk.y, chunk.z);
    const IVec3 p = local_of(local);
    return found == nullptr ? outside : found->get(p.x, p.y, p.z);
  }
};

}  // namespace quoin
