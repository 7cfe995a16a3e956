#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/result.h>

#include "io/vox/source.h"
#include "io/vox/write/model_plan.h"
#include "io/vox/write/node_content.h"

namespace quoin::vox {

/// The revised scene graph and layers of a file.
struct RevisedGraph {
  std::map<std::size_t, NodeContent> changed;  ///< by index in the source's nodes
  std::vector<bool> is_removed;                ///< by index in the source's nodes
  std::vector<NodeContent> added;
  std::vector<std::int32_t> layer_ids;  ///< by slot of the scene's layers
  bool adds_only_layer = false;         ///< the file has no layers, and its shapes are on layer 0
  std::int64_t rounded = 0;             ///< instances that were rounded to whole voxels
  std::int64_t beyond_limit = 0;        ///< instances farther out than MagicaVoxel shows
  std::int64_t turns_left_out = 0;      ///< groups whose rotation or reflection the file cannot store
  std::int64_t frames_left_out = 0;     ///< dropped frames of a file without a graph
  bool has_empty_model = false;         ///< shapes show an empty model, whose number is the plan's count
  /// A node with several parents has to change, so the whole graph must be rewritten.
  bool must_be_new = false;
};

/// Compares the scene with the source, and updates the differences in its graph. Without `keeps_graph` all nodes are
/// new.
///
/// Errors: as write_vox.
[[nodiscard]] Result<RevisedGraph> revise_graph(const Scene& scene, const VoxSource& source, const ModelPlan& models,
                                                bool keeps_graph);

/// As above, for a file without a scene graph that needs none: only its layers.
[[nodiscard]] RevisedGraph revise_layers(const Scene& scene, const VoxSource& source);

/// Returns true if a file without a scene graph needs one to show the scene: without a graph, its reader shows one
/// model at its default position.
[[nodiscard]] bool needs_graph(const Scene& scene, const VoxSource& source, const ModelPlan& models);

}  // namespace quoin::vox
