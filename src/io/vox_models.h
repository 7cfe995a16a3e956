#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/scene/scene.h>

#include "io/vox_chunks.h"

namespace quoin::vox {

/// What was left out of models, over all of them.
struct ModelLosses {
  std::int64_t outside = 0;     ///< voxels beyond their model's size
  std::int64_t colourless = 0;  ///< voxels of colour index 0, which is air
};

/// Turns models into grids, one after another; keeps the scratch memory between them.
class ModelBuilder {
 public:
  explicit ModelBuilder(const std::array<std::uint8_t, kColours>& type_of) : type_of_(type_of) {}

  /// Voxel (x, y, z) of the model becomes voxel (x, z, size.y - 1 - y) of the grid; canvas and pivot as in SceneGrid.
  /// Where a position is named twice the last one counts. Voxels outside the model or without a colour are left out.
  ///
  /// Cost: O(voxels), whatever the model's size.
  [[nodiscard]] SceneGrid build(const Model& model);

  [[nodiscard]] const ModelLosses& losses() const { return losses_; }

 private:
  void build_densely(const Model& model, Grid& grid);
  void sort_into_chunks(const Model& model);
  void fill_chunk(IVec3 chunk, std::size_t first, std::size_t count, Grid& grid);

  std::array<std::uint8_t, kColours> type_of_;
  ModelLosses losses_;
  std::array<std::size_t, 65> chunk_begins_{};
  std::vector<std::uint32_t> sorted_;  ///< by chunk: place in the chunk in bits 0-17, type above
  std::vector<VoxelType> dense_;       ///< chunks, one after the other
};

/// The box and pivot of a grid made from a model of that size.
[[nodiscard]] IBox canvas_of(IVec3 model_size);
[[nodiscard]] DVec3 pivot_of(IVec3 model_size);

}  // namespace quoin::vox
