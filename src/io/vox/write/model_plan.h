#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/result.h>

#include "io/vox/vox_reader.h"
#include "io/vox/write/vox_parts.h"

namespace quoin::vox {

/// The models of a grid in the file.
struct GridPlan {
  GridHandle grid;
  std::vector<Piece> pieces;         ///< never empty; a single piece for a model of the source
  std::size_t source_model = kNone;  ///< the source's model that it keeps; kNone for new models
  bool is_resized = false;           ///< for a model of the source: its box changed
  bool is_changed = false;           ///< for a model of the source: its voxels changed, or their positions in the box
  std::uint32_t first_model = 0;     ///< model number of its first piece: the source's models come first, then new ones
};

/// All grids, in the order of their handles.
struct ModelPlan {
  std::vector<GridPlan> grids;
  std::uint32_t count = 0;  ///< number of models, including the source's

  /// Returns null for a grid that is not in the scene.
  [[nodiscard]] const GridPlan* find(GridHandle grid) const;
};

/// Plans the models of all grids. `keeps_graph`: the transforms of the source stay, so a model shown by several keys
/// must keep its pivot.
[[nodiscard]] ModelPlan plan_models(const Scene& scene, const VoxSource& source, bool keeps_graph);

/// Returns the content of a changed model's XYZI (or TDCZ) chunk: remaining voxels in the file's order, then new
/// voxels. Invisible voxels, outside the model or of colour 0, stay if the box is unchanged.
///
/// Memory: up to one byte per voxel of the box and, for a TDCZ, four bytes per voxel.
/// Errors: as unpack_voxels.
[[nodiscard]] Result<std::vector<std::byte>> revised_voxels(const Grid& grid, const GridPlan& plan,
                                                            const VoxSource& source,
                                                            const std::vector<std::uint8_t>& index_of_type);

}  // namespace quoin::vox
