#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

#include "io/vox/vox_reader.h"
#include "io/vox/write/node_content.h"
#include "io/vox/write/vox_parts.h"

// Builds the scene graph to write. A single class, since each step uses the members that the previous one set:
//
//  number_layers, find_top    ids of layers; the group that is the scene itself, perhaps a new one
//  remove_missing_nodes       removed nodes of the source
//  revise_groups              from the top: position, name, layer, parent
//  revise_instances           the same, and the models that they show
//  name_shapes, apply_child_changes, settle_root
//
// The result is a RevisedGraph: the changed nodes of the source, and new nodes.

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

inline constexpr std::int32_t kRootTransform = 0;
inline constexpr std::int32_t kNoLayer = -1;

/// Returns true if each component can be written, and negated.
[[nodiscard]] bool has_32_bits(const Offset& offset);

/// Returns the motion of a grid's piece relative to the first piece.
[[nodiscard]] Motion from_first_piece(const GridPlan& plan, std::size_t piece);

/// Finds ids that no node uses.
class FreshIds {
 public:
  explicit FreshIds(const Document* document) {
    if (document == nullptr) return;
    for (const Node& node : document->nodes) used_.insert(node.id);
    // Ids that are referenced but missing must not be assigned to new nodes.
    used_.insert(document->children.begin(), document->children.end());
    constexpr std::int32_t kFarEnd = std::numeric_limits<std::int32_t>::max() / 2;
    if (!used_.empty() && *used_.rbegin() >= 0 && *used_.rbegin() < kFarEnd) next_ = *used_.rbegin() + 1;
  }
  std::int32_t take() {
    while (used_.contains(next_)) ++next_;
    return next_++;
  }

 private:
  std::set<std::int32_t> used_;
  std::int32_t next_ = kRootTransform;
};

/// The parent of new children: a group of the source or a new one.
struct Parent {
  std::size_t source_node = kNone;  ///< kNone: it is new
  std::size_t added = kNone;        ///< in RevisedGraph::added
  Motion world;

  bool operator<(const Parent& other) const {
    return source_node != other.source_node ? source_node < other.source_node : added < other.added;
  }
  [[nodiscard]] bool is_same(const Parent& other) const {
    return source_node == other.source_node && added == other.added;
  }
};

struct ChildChanges {
  std::set<std::int32_t> removed;
  std::map<std::int32_t, std::int32_t> replaced;
  std::vector<std::int32_t> added;
};

/// The common properties of an instance and a group, stored in its transform.
struct Wanted {
  std::string name;
  bool visible = true;
  LayerHandle layer;
  Parent parent;
  Motion world;
};

/// The same properties as read from the source.
struct Known {
  const PlacedNode& placed;
  const std::string& name;
  bool visible = true;
  LayerHandle layer;
  Parent parent;
};

class GraphRevision {
 public:
  GraphRevision(const Scene& scene, const VoxSource& source, const ModelPlan& models, bool keeps_graph)
      : scene_(scene),
        source_(source),
        models_(models),
        keeps_graph_(keeps_graph),
        ids_(keeps_graph ? &source.document : nullptr) {
    out_.is_removed.assign(source.document.nodes.size(), !keeps_graph);
  }

  Result<RevisedGraph> run();
  RevisedGraph layers_only() {
    number_layers();
    return std::move(out_);
  }

 private:
  /// The content of one frame in a file without a scene graph.
  struct Frame {
    const GridPlan* plan = nullptr;  ///< null: its grid was removed
    Motion first;                    ///< the pivot of its first piece
  };

  void number_layers();
  void find_top();
  void begin_graph(std::vector<std::int32_t> below);
  [[nodiscard]] std::optional<std::int32_t> root_below_no_group() const;
  [[nodiscard]] bool would_be_the_scene(const SceneGroup& group) const;
  [[nodiscard]] bool needs_new_top() const;
  void settle_root();
  void free_root_id();
  void remove_missing_nodes();
  void remove(const PlacedNode& placed);
  Status revise_groups();
  Status revise_group(GroupHandle handle);
  Status revise_instances();
  Status revise_instance(const Instance& instance, const PlacedShape& placement, const Instance& before);
  Status add_instance(InstanceHandle handle, const Instance& instance);
  Status revise_transform(const Wanted& wanted, const Known& known);
  void show(const Known& known, bool visible, NodeContent& transform);
  void keep_shown_by_chain(const Wanted& wanted, const Known& known);
  [[nodiscard]] bool was_hidden(std::int32_t layer) const;
  [[nodiscard]] bool is_hidden(std::int32_t layer) const;
  Status move(const Wanted& wanted, const Known& known, NodeContent* transform, const NodeContent& read);
  void show_model(const PlacedShape& placement, const GridPlan& plan);
  void show_pieces(std::size_t shape, const GridPlan& plan);
  std::int32_t add_shape(const NodeContent& before, const std::vector<std::uint32_t>& shown, const Motion& motion);
  void name_shapes();
  void apply_child_changes();

  NodeContent& change(std::size_t node);
  [[nodiscard]] NodeContent read(std::size_t node) const;
  [[nodiscard]] std::size_t last_transform(const PlacedNode& placed) const;
  NodeContent& transform_of(const Known& known);
  [[nodiscard]] Parent parent_in_source(std::size_t group) const;
  [[nodiscard]] Parent parent_now(GroupHandle group) const;
  [[nodiscard]] std::int32_t layer_id(LayerHandle layer) const;
  [[nodiscard]] Result<Motion> place(const Instance& instance, const GridPlan& plan);
  [[nodiscard]] Motion place(const SceneGroup& group, const Motion& parent);
  [[nodiscard]] Result<NodeContent> transform_for(const Wanted& wanted, std::int32_t child);
  [[nodiscard]] bool was_of_frames() const {
    return source_.document.nodes.empty() && source_.document.models.size() > 1;
  }
  [[nodiscard]] std::vector<Frame> frames_about(const Motion& box) const;
  [[nodiscard]] Motion from_source_box(const GridPlan& plan, std::size_t model) const;
  void show_frames(const std::vector<Frame>& frames, NodeContent& transform, NodeContent& shape);
  void hang_piece(std::size_t group, const std::string& name, const GridPlan& plan, std::size_t piece,
                  const Motion& motion, std::size_t frame, std::size_t frame_count);
  void add_model(NodeContent transform, NodeContent shape, const GridPlan& plan, const std::string& name);
  Status add_frames(NodeContent transform, NodeContent shape, const GridPlan& plan, const std::string& name);
  [[nodiscard]] NodeContent shape_of(std::int32_t id, std::uint32_t model) const;

  const Scene& scene_;
  const VoxSource& source_;
  const ModelPlan& models_;
  bool keeps_graph_;
  bool keeps_frames_ = false;
  FreshIds ids_;
  RevisedGraph out_;
  Parent top_;
  std::map<GroupHandle, Parent> groups_;  // groups of the scene
  std::map<Parent, ChildChanges> children_;
  std::map<std::size_t, std::size_t> inserted_;  // inserted transforms by node, as indices into RevisedGraph::added
  std::map<GridHandle, std::vector<std::size_t>> added_shapes_;   // new shapes by grid, in RevisedGraph::added
  std::map<GridHandle, std::vector<std::size_t>> source_shapes_;  // shapes in the source's nodes, by grid
};

}  // namespace quoin::vox
