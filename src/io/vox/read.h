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

inline constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// The position of a shape or a group in the scene graph: below the nearest group above it, by a chain of transforms,
/// usually a single one.
struct Hanging {
  std::size_t node = kNone;    ///< the shape or the group itself, in Document::nodes; kNone where there is no graph
  std::size_t parent = kNone;  ///< in Placements::groups; kNone: the scene itself
  std::size_t first_transform = 0;  ///< in Placements::chains, from the highest down
  std::size_t transform_count = 0;
  Motion parent_motion;     ///< of the group above, in the world
  Motion before;            ///< of all transforms of the chain but the last, together
  Motion world;             ///< of all transforms down to here
  bool hidden = false;      ///< by itself or its chain, regardless of the groups above
  std::int32_t layer = -1;  ///< of the last transform
  std::string_view name;    ///< of the last transform
};

/// A model as the scene graph shows it: the sum of all transforms on one way down to a shape. MagicaVoxel's axes.
struct Placement : Hanging {
  std::uint32_t model = 0;
  std::string_view shape_name;  ///< of the shape itself; Quoin's writer stores a grid's name there
};

/// The placements at one frame, in the order of the graph, with warnings.
struct Placements {
  std::vector<Placement> all;
  /// Groups but the topmost, which is the scene itself unless it is hidden, on a layer or named; parents come first.
  std::vector<Hanging> groups;
  std::vector<std::size_t> chains;  ///< of transforms, in Document::nodes
  std::size_t top_group = kNone;    ///< the topmost group's node; kNone where it is in `groups` or is not there
  Motion top_motion;                ///< of it
  bool is_tree = true;              ///< no node has two parents
  std::size_t nodes_apart = 0;      ///< that no way from the root leads to
  std::vector<bool> is_model_used;  ///< at any frame
  std::vector<std::string> warnings;
};

/// Returns a transform's motion at a frame, as in `place_models`.
[[nodiscard]] Motion motion_at(const Document& document, const Node& node, int frame);
/// The place of the key, in the file's order sorted by frames, that a shape shows at a frame.
[[nodiscard]] std::size_t key_of_shape(const Document& document, const Node& shape, int frame);
/// The frame as the keys of a node count it: folded into their range where it loops.
[[nodiscard]] std::int64_t frame_of_transform(const Document& document, const Node& node, int frame);

/// Walks the scene graph of the document.
///
/// Without nodes every model is a frame of an animation, and the chosen model stands on the ground, centred. Between
/// two keys of a transform the position is interpolated, rounded towards zero, and the rotation is the earlier key's.
/// Cost:   memory and time within a small multiple of the file's size, for any graph.
/// Errors: BadFormat for cycles and for missing nodes or models; LimitExceeded when nodes with several parents multiply
///         beyond `file_bytes`; InvalidArgument for a missing frame.
[[nodiscard]] Result<Placements> place_models(const Document& document, int frame, std::size_t file_bytes);

/// Counts of dropped voxels, over all models.
struct ModelLosses {
  std::int64_t outside = 0;     ///< voxels beyond their model's size
  std::int64_t colourless = 0;  ///< voxels of colour index 0, which is air
};

/// Turns models into grids, one after another; keeps the scratch memory between them.
class ModelBuilder {
 public:
  explicit ModelBuilder(const std::array<std::uint8_t, kColours>& type_of) : type_of_(type_of) {}

  /// Voxel (x, y, z) of the model becomes voxel (x, z, size.y - 1 - y) of the grid; canvas and pivot as in SceneGrid.
  /// The last voxel of a position counts. Voxels outside the model or without a colour are dropped.
  ///
  /// Cost: O(voxels), independent of the model's size.
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
