#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>

#include "io/vox_chunks.h"
#include "io/vox_orientation.h"

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

}  // namespace quoin::vox
