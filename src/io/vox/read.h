#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

#include "io/vox/chunks.h"
#include "io/vox/orientation.h"

namespace quoin::vox {

/// A model as the scene graph shows it: the sum of all transforms on one way down to a shape. MagicaVoxel's axes.
struct Placement {
  std::uint32_t model = 0;
  bool hidden = false;
  Orientation orientation;
  Offset translation{0, 0, 0};
  std::string_view name;        ///< of the transform right above the shape
  std::string_view shape_name;  ///< of the shape itself; Quoin's writer puts a grid's name there
};

/// The placements at one frame, in the order of the graph, and what there is to warn of.
struct Placements {
  std::vector<Placement> all;
  std::vector<bool> is_model_used;  ///< at any frame
  std::vector<std::string> warnings;
};

/// Walks the scene graph of the document.
///
/// Without nodes every model is a frame of an animation, and the one chosen stands on the ground, centred.
/// Between two keys of a transform the position is interpolated, rounded towards zero, and the turn is the earlier's.
/// Cost:   memory and time within a small multiple of the file's size, whatever the graph.
/// Errors: BadFormat for cycles and for nodes or models that are not there; LimitExceeded when nodes with several
///         parents multiply beyond `file_bytes`; InvalidArgument for a frame that is not there.
[[nodiscard]] Result<Placements> place_models(const Document& document, int frame, std::size_t file_bytes);

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
