#pragma once

#include <cstdint>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin::smooth {

/// Which body a material is part of: all opaque ones are one, 0, each transparent one is its own.
[[nodiscard]] inline std::uint32_t body_of(const VoxelRegistry& types, VoxelType material) {
  return types.is_transparent(material) ? std::uint32_t{material} + 1U : 0U;
}

/// The bodies of some materials, sorted, each once.
[[nodiscard]] std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const std::vector<VoxelType>& materials);

/// The bodies of a field, sorted. What is solid without a material is opaque. Cost: O(chunks), unless nothing is
/// transparent.
[[nodiscard]] std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const DensityGrid& field);

/// Whether any material of a chunk is of another body.
[[nodiscard]] bool holds_others(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body);

/// Which samples of a chunk are solid and of another body, row by row.
class OtherBodies {
 public:
  /// Lifetime: `chunk` must outlive this.
  OtherBodies(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body);

  /// Requires: 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t row(int y, int z) const;
  /// Whether there is none, whatever is solid.
  [[nodiscard]] bool empty() const { return listed_are_others_ && listed_.empty(); }

 private:
  const DensityChunk& chunk_;
  std::vector<VoxelType> listed_;
  bool listed_are_others_;
};

/// A chunk in which what is solid of other bodies is as far out as it was in.
[[nodiscard]] DensityChunk without_others(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body);

/// The densities of one body of several: those of all, `without_others`. Shares the chunks of `whole` in which there
/// are no others; chunks that are not near the body are left out where it is transparent.
[[nodiscard]] DensityGrid field_of_body(const DensityGrid& whole, const VoxelRegistry& types, std::uint32_t body,
                                        Threads threads);

/// A chunk of such a field.
[[nodiscard]] DensityChunk chunk_of_body(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body);

}  // namespace quoin::smooth
