#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/downsample.h>

namespace quoin {

/// A chunk of a halved field and the counts kept for updates.
struct HalvedDensityChunk {
  DensityChunk samples{Half{0}};
  DownsampledDensityCounts counts;
};

/// Makes one chunk of a halved field.
///
/// Space: fine, samples from the chunk's least corner, -2 to 129 on each axis; coarse, -1 to 64. Reads no other
/// samples: an edit elsewhere does not change the chunk.
class DensityHalver {
 public:
  /// `chunk`: coordinates in the halved field.
  DensityHalver(const DensityGrid& field, IVec3 chunk);

  [[nodiscard]] HalvedDensityChunk make() const;

 private:
  static constexpr int kRows = kChunkEdge + 2;

  /// The solid samples of a coarse row as bits, plus the sample before and the one after.
  struct Signs {
    std::uint64_t bits = 0;
    bool before = false;
    bool after = false;
    [[nodiscard]] std::uint64_t lower() const { return bits << 1 | std::uint64_t{before}; }
    [[nodiscard]] std::uint64_t upper() const { return bits >> 1 | std::uint64_t{after} << 63; }
    [[nodiscard]] std::uint64_t all_three() const { return bits & lower() & upper(); }
  };

  [[nodiscard]] const DensityChunk* chunk_at(IVec3 fine) const {
    const IVec3 at = (fine >> kChunkShift) + 1;
    QUOIN_ASSERT((IBox{IVec3(0), IVec3(4)}.contains(at)), "-64 <= x, y, z < 192");
    return chunks_[static_cast<std::size_t>(at.x + 4 * at.y + 16 * at.z)];
  }
  [[nodiscard]] Half density(IVec3 fine) const {
    const DensityChunk* const chunk = chunk_at(fine);
    const IVec3 p = fine & (kChunkEdge - 1);
    return chunk == nullptr ? far_ : chunk->get(p.x, p.y, p.z);
  }
  [[nodiscard]] const Signs& signs(int y, int z) const {
    QUOIN_ASSERT(std::min(y, z) >= -1 && std::max(y, z) <= kChunkEdge, "-1 <= y, z <= 64");
    return signs_[static_cast<std::size_t>((z + 1) * kRows + y + 1)];
  }
  void read_signs(int y, int z);
  void halve_densities(DensityChunk& made) const;
  void copy_materials(Chunk& made) const;
  void choose_materials(Chunk& made) const;
  /// The densities of the 3x3 rows around coarse row (y, z), from the sample before the chunk's first on.
  using NearRows = std::array<std::array<Half, 2 * kChunkEdge + 1>, 9>;
  void read_rows(int y, int z, NearRows& rows) const;
  [[nodiscard]] VoxelType outermost(const NearRows& rows, IVec3 fine) const;
  [[nodiscard]] std::uint64_t beside_air(int y, int z) const;
  [[nodiscard]] bool is_of_one_material() const;
  [[nodiscard]] DownsampledDensityCounts counts() const;

  Half far_;         // of the field
  Half coarse_far_;  // of the result
  std::array<const DensityChunk*, 64> chunks_{};
  std::vector<Signs> signs_;
};

}  // namespace quoin
