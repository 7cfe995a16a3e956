#include "io/vox/write/graph_revision.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes/text.h"

namespace quoin::vox {

namespace {

// Indices in RevisedGraph::added of the nodes from begin_graph.
constexpr std::size_t kNewRoot = 0;
constexpr std::size_t kNewTop = 1;
constexpr std::int32_t kOnlyLayer = 0;

std::string instance_text(const Instance& instance) {
  if (instance.name.empty()) return "an instance";
  std::string text = "instance \"";
  text += printable(instance.name);
  text += '"';
  return text;
}

/// Converts a world point to MagicaVoxel's axes, rounded to whole voxels; nullopt beyond 32 bits.
std::optional<Offset> rounded(DVec3 point, bool& is_exact) {
  constexpr double kRounding = 1e-6;
  Offset offset{};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::abs(point[axis]) < std::numeric_limits<std::int32_t>::max())) return std::nullopt;
    is_exact = is_exact && std::abs(point[axis] - std::round(point[axis])) < kRounding;
    offset[static_cast<std::size_t>(axis)] = std::llround(point[axis]);
  }
  return vox_from_quoin(offset);
}

/// Returns true for positions that MagicaVoxel does not show.
bool is_beyond_magica(const DVec3& position) {
  constexpr double kMost = 1'000.0;
  return std::max({std::abs(position.x), std::abs(position.y), std::abs(position.z)}) > kMost;
}

template <class Placed>
bool has_same_place(const Placed& a, const Placed& b) {
  return a.position == b.position && a.rotation == b.rotation && a.mirrored == b.mirrored;
}

}  // namespace

bool has_32_bits(const Offset& offset) {
  return std::ranges::all_of(offset, [](std::int64_t value) {
    // Below the maximum, so that it can be negated.
    return value > -std::int64_t{std::numeric_limits<std::int32_t>::max()} &&
           value < std::numeric_limits<std::int32_t>::max();
  });
}

NodeContent GraphRevision::read(std::size_t node) const {
  const auto known = out_.changed.find(node);
  return known != out_.changed.end() ? known->second : node_of(source_, node);
}

NodeContent& GraphRevision::change(std::size_t node) {
  if (!source_.placements.is_tree) out_.must_be_new = true;
  const auto known = out_.changed.find(node);
  return known != out_.changed.end() ? known->second : out_.changed.emplace(node, read(node)).first->second;
}

std::size_t GraphRevision::last_transform(const PlacedNode& placed) const {
  if (placed.transform_count == 0) return kNone;
  return source_.placements.chains[placed.first_transform + placed.transform_count - 1];
}

Parent GraphRevision::parent_in_source(std::size_t group) const {
  if (group == kNone) return top_;
  const PlacedNode& placed = source_.placements.groups[group];
  return {placed.node, kNone, placed.world};
}

Parent GraphRevision::parent_now(GroupHandle group) const {
  const auto found = groups_.find(group);
  return found == groups_.end() ? top_ : found->second;
}

std::int32_t GraphRevision::layer_id(LayerHandle layer) const {
  if (scene_.layers().find(layer) != nullptr) return out_.layer_ids[layer.index];
  return out_.adds_only_layer ? kOnlyLayer : kNoLayer;
}

/// Layers of the source keep their ids; new ones take the next.
void GraphRevision::number_layers() {
  const std::vector<Layer>& layers = source_.document.layers;
  std::set<std::int32_t> used;
  for (const Layer& layer : layers) used.insert(layer.id);
  for (const Node& node : source_.document.nodes) used.insert(node.layer);
  std::int32_t next = 0;
  scene_.layers().for_each([&](LayerHandle handle, const SceneLayer&) {
    out_.layer_ids.resize(handle.index + std::size_t{1}, kNoLayer);
    const auto known = std::ranges::find(source_.layer_of, std::size_t{handle.index});
    if (source_.scene.layers().find(handle) != nullptr && known != source_.layer_of.end()) {
      out_.layer_ids[handle.index] = layers[static_cast<std::size_t>(known - source_.layer_of.begin())].id;
      return;
    }
    while (used.contains(next)) ++next;
    out_.layer_ids[handle.index] = next++;
  });
  out_.adds_only_layer = layers.empty() && scene_.layers().empty() && !keeps_graph_;
}

/// Adds a root and a group that represents the scene itself, with children of the source.
void GraphRevision::begin_graph(std::vector<std::int32_t> below) {
  NodeContent transform;
  transform.kind = NodeKind::Transform;
  transform.id = ids_.take();
  NodeContent group;
  group.kind = NodeKind::Group;
  group.id = ids_.take();
  group.children = std::move(below);
  transform.children = {group.id};
  transform.frames.emplace_back();
  out_.added.push_back(std::move(transform));
  out_.added.push_back(std::move(group));
  top_ = {kNone, kNewTop, {}};
}

/// Returns the source's root if no group of it is the scene itself. Requires: the source has a graph.
std::optional<std::int32_t> GraphRevision::root_below_no_group() const {
  const Placements& placements = source_.placements;
  const auto first_of = [&](const auto& all) -> std::optional<std::int32_t> {
    for (const PlacedNode& placed : all) {
      if (placed.parent != kNone) continue;
      const std::size_t highest = placed.transform_count > 0 ? placements.chains[placed.first_transform] : placed.node;
      return source_.document.nodes[highest].id;
    }
    return std::nullopt;
  };
  const auto group = first_of(placements.groups);
  return group ? group : first_of(placements.all);
}

void GraphRevision::find_top() {
  if (!keeps_graph_) {
    begin_graph({});
  } else if (source_.placements.top_group == kNone) {
    const auto root = root_below_no_group();
    begin_graph(root ? std::vector{*root}
                     : std::vector<std::int32_t>{});  // settle_root removes it later if the graph does not use it
  } else {
    top_ = {source_.placements.top_group, kNone, source_.placements.top_motion};
  }
}

/// Removes a node and its chain from the graph. Nodes below stay, or are removed separately.
void GraphRevision::remove(const PlacedNode& placed) {
  if (!source_.placements.is_tree) out_.must_be_new = true;
  const Document& document = source_.document;
  std::size_t highest = placed.node;
  for (std::size_t i = placed.transform_count; i-- > 0;) {
    highest = source_.placements.chains[placed.first_transform + i];
    out_.is_removed[highest] = true;
  }
  out_.is_removed[placed.node] = true;
  children_[parent_in_source(placed.parent)].removed.insert(document.nodes[highest].id);
}

void GraphRevision::remove_missing_nodes() {
  const Placements& placements = source_.placements;
  for (std::size_t i = 0; i < placements.groups.size(); ++i) {
    if (scene_.groups().find(handle_read(source_.scene.groups(), i)) == nullptr) remove(placements.groups[i]);
  }
  for (std::size_t i = 0; i < placements.all.size(); ++i) {
    const Instance* instance = scene_.instances().find(handle_read(source_.scene.instances(), i));
    if (instance == nullptr || models_.find(instance->grid) == nullptr) remove(placements.all[i]);
  }
}

/// Returns the motion of the pivot that the file gives to the grid's first piece.
Result<Motion> GraphRevision::place(const Instance& instance, const GridPlan& plan) {
  if (instance.voxel_size != 1.0) {
    return make_error(ErrorCode::Unsupported,
                      instance_text(instance) + " has a different voxel size than others, which .vox cannot store");
  }
  const auto orientation = orientation_from_turn({instance.rotation, instance.mirrored});
  if (!orientation.has_value()) {
    return make_error(ErrorCode::Unsupported,
                      instance_text(instance) + " is not rotated by multiples of 90 degrees, as .vox requires");
  }
  bool is_exact = true;
  const DVec3 world = world_from_grid(instance, scene_.grids()[plan.grid], pivot_of(plan.pieces.front()));
  const auto translation = rounded(world, is_exact);
  if (!translation) {
    return make_error(ErrorCode::LimitExceeded, instance_text(instance) + " is too far from the origin for .vox");
  }
  for (std::size_t piece = 0; piece < plan.pieces.size(); ++piece) {
    if (has_32_bits(from_first_piece(plan, piece).translation)) continue;
    return make_error(ErrorCode::LimitExceeded, instance_text(instance) + " is too wide for .vox");
  }
  if (!is_exact) ++out_.rounded;
  const bool is_far = std::ranges::any_of(plan.pieces, [&](const auto& piece) {
    return is_beyond_magica(world_from_grid(instance, scene_.grids()[plan.grid], pivot_of(piece)));
  });
  if (is_far) ++out_.beyond_limit;
  return Motion{*orientation, *translation};
}

/// A group's placement only affects editing: the part that the file cannot store is dropped, and no other node moves.
Motion GraphRevision::place(const SceneGroup& group, const Motion& parent) {
  bool is_exact = true;
  const auto translation = rounded(group.position, is_exact);
  const auto orientation = orientation_from_turn({group.rotation, group.mirrored});
  if (!translation || !orientation) {
    ++out_.turns_left_out;
    return {parent.orientation, translation.value_or(parent.translation)};
  }
  return {*orientation, *translation};
}

/// Returns the transform right above a node, inserting one if there is none.
NodeContent& GraphRevision::transform_of(const Known& known) {
  const std::size_t last = last_transform(known.placed);
  if (last != kNone) return change(last);
  const auto [place, is_new] = inserted_.try_emplace(known.placed.node, out_.added.size());
  if (!is_new) return out_.added[place->second];
  NodeContent inserted;
  inserted.kind = NodeKind::Transform;
  inserted.id = ids_.take();
  inserted.children = {source_.document.nodes[known.placed.node].id};
  inserted.frames.emplace_back();
  if (!source_.placements.is_tree) out_.must_be_new = true;
  children_[known.parent].replaced.emplace(inserted.children.front(), inserted.id);
  return out_.added.emplace_back(std::move(inserted));
}

void GraphRevision::show(const Known& known, bool visible, NodeContent& transform) {
  if (!visible) {
    transform.attributes.set("_hidden", "1");
    return;
  }
  transform.attributes.erase("_hidden");
  const PlacedNode& placed = known.placed;
  if (source_.document.nodes[placed.node].hidden) change(placed.node).attributes.erase("_hidden");
  for (std::size_t i = 0; i + 1 < placed.transform_count; ++i) {
    const std::size_t above = source_.placements.chains[placed.first_transform + i];
    const bool on_hidden_layer = was_hidden(source_.document.nodes[above].layer);
    if (!on_hidden_layer && !source_.document.nodes[above].hidden) continue;
    NodeContent& node = change(above);
    node.attributes.erase("_hidden");
    if (on_hidden_layer) node.layer = kNoLayer;
  }
}

bool GraphRevision::was_hidden(std::int32_t layer) const {
  return std::ranges::any_of(source_.document.layers,
                             [&](const Layer& each) { return each.hidden && each.id == layer; });
}

bool GraphRevision::is_hidden(std::int32_t layer) const {
  const std::vector<Layer>& layers = source_.document.layers;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (layers[i].id != layer || source_.layer_of[i] == kNone) continue;
    const SceneLayer* now = scene_.layers().find(handle_read(source_.scene.layers(), source_.layer_of[i]));
    if (now != nullptr && !now->visible) return true;
  }
  return false;
}

/// A chain's transforms above its last one may be on layers that the scene does not track. If such a layer was shown or
/// hidden, they are removed from it.
void GraphRevision::keep_shown_by_chain(const Wanted& wanted, const Known& known) {
  const PlacedNode& placed = known.placed;
  for (std::size_t i = 0; i + 1 < placed.transform_count; ++i) {
    const std::size_t above = source_.placements.chains[placed.first_transform + i];
    const std::int32_t layer = source_.document.nodes[above].layer;
    if (was_hidden(layer) == is_hidden(layer)) continue;
    change(above).layer = kNoLayer;
    if (!wanted.visible) transform_of(known).attributes.set("_hidden", "1");
  }
}

/// `transform`: null if there is none; one is inserted if the node has to move.
Status GraphRevision::move(const Wanted& wanted, const Known& known, NodeContent* transform, const NodeContent& read) {
  const PlacedNode& placed = known.placed;
  const bool is_elsewhere = !wanted.parent.is_same(known.parent);
  const Motion above_now = wanted.parent.world * placed.before;
  const Motion above_before = placed.parent_motion * placed.before;
  const Motion local = inverse(above_now) * wanted.world;
  Motion now = inverse(above_before) * placed.world;
  if (is_elsewhere && read.frames.size() > 1) {
    // Moves all keys.
    const Motion from_before = inverse(above_now) * above_before;
    if (transform == nullptr) transform = &transform_of(known);
    for (Entries& key : transform->frames) {
      const Motion motion = from_before * motion_of(key);
      if (!has_32_bits(motion.translation)) {
        return make_error(ErrorCode::LimitExceeded, "\"" + wanted.name + "\" moves too far from the origin for .vox");
      }
      set_motion(key, motion);
    }
    now = from_before * now;
  }
  if (local == now) return {};
  if (!has_32_bits(local.translation)) {
    return make_error(ErrorCode::LimitExceeded, "\"" + wanted.name + "\" is too far from the origin for .vox");
  }
  set_motion_at(transform != nullptr ? *transform : transform_of(known), source_.frame, local);
  return {};
}

Status GraphRevision::revise_transform(const Wanted& wanted, const Known& known) {
  const PlacedNode& placed = known.placed;
  if (wanted.name != known.name) {
    transform_of(known).attributes.set_or_erase("_name", printable(wanted.name));
    if (source_.document.nodes[placed.node].kind == NodeKind::Group) {
      if (!source_.document.nodes[placed.node].name.empty()) change(placed.node).attributes.erase("_name");
    }
  }
  if (wanted.visible != known.visible) show(known, wanted.visible, transform_of(known));
  keep_shown_by_chain(wanted, known);
  if (wanted.layer != known.layer) transform_of(known).layer = layer_id(wanted.layer);
  const std::size_t last = last_transform(placed);
  const NodeContent read_transform = last == kNone ? NodeContent{} : read(last);
  const bool is_changed = last != kNone && out_.changed.contains(last);
  const bool is_elsewhere = !wanted.parent.is_same(known.parent);
  NodeContent* transform = is_changed ? &change(last) : nullptr;
  if (Status moved = move(wanted, known, transform, read_transform); !moved) return moved;
  if (!is_elsewhere) return {};
  if (!source_.placements.is_tree) out_.must_be_new = true;
  const bool has_chain = placed.transform_count > 0;
  std::int32_t top =
      source_.document.nodes[has_chain ? source_.placements.chains[placed.first_transform] : placed.node].id;
  ChildChanges& before = children_[known.parent];
  before.removed.insert(top);
  // An inserted transform moves with its node.
  if (const auto inserted = before.replaced.find(top); inserted != before.replaced.end()) top = inserted->second;
  children_[wanted.parent].added.push_back(top);
  return {};
}

Status GraphRevision::revise_group(GroupHandle handle) {
  const SceneGroup& group = scene_.groups()[handle];
  Wanted wanted{group.name, group.visible, group.layer, parent_now(parent_of(scene_, handle)), {}};
  if (scene_.layers().find(wanted.layer) == nullptr) wanted.layer = {};
  const SceneGroup* before = keeps_graph_ ? source_.scene.groups().find(handle) : nullptr;
  if (before == nullptr) {
    wanted.world = place(group, wanted.parent.world);
    const std::int32_t id = ids_.take();
    NodeContent content;
    content.kind = NodeKind::Group;
    content.id = ids_.take();
    auto transform = transform_for(wanted, content.id);
    if (!transform) return transform.error();
    transform->id = id;
    children_[wanted.parent].added.push_back(id);
    out_.added.push_back(std::move(*transform));
    groups_[handle] = {kNone, out_.added.size(), wanted.world};
    out_.added.push_back(std::move(content));
    return {};
  }
  const PlacedNode& placed = source_.placements.groups[handle.index];
  const Known known{placed, before->name, before->visible, before->layer, parent_in_source(placed.parent)};
  wanted.world = has_same_place(group, *before) ? placed.world : place(group, wanted.parent.world);
  groups_[handle] = {placed.node, kNone, wanted.world};
  return revise_transform(wanted, known);
}

Status GraphRevision::revise_groups() {
  for (const GroupHandle handle : groups_from_top(scene_)) {
    if (Status done = revise_group(handle); !done) return done;
  }
  return {};
}

/// A new transform, without an id.
Result<NodeContent> GraphRevision::transform_for(const Wanted& wanted, std::int32_t child) {
  NodeContent transform;
  transform.kind = NodeKind::Transform;
  transform.children = {child};
  transform.layer = layer_id(wanted.layer);
  transform.attributes.set_or_erase("_name", printable(wanted.name));
  if (!wanted.visible) transform.attributes.set("_hidden", "1");
  const Motion local = inverse(wanted.parent.world) * wanted.world;
  if (!has_32_bits(local.translation)) {
    return make_error(ErrorCode::LimitExceeded, "\"" + wanted.name + "\" is too far from the origin for .vox");
  }
  set_motion(transform.frames.emplace_back(), local);
  return transform;
}

Status GraphRevision::add_instance(InstanceHandle handle, const Instance& instance) {
  const GridPlan& plan = *models_.find(instance.grid);
  const auto world = place(instance, plan);
  if (!world) return world.error();
  Wanted wanted{instance.name, instance.visible, instance.layer, parent_now(instance.group), *world};
  const std::int32_t id = ids_.take();
  auto transform = transform_for(wanted, ids_.take());
  if (!transform) return transform.error();
  transform->id = id;
  children_[wanted.parent].added.push_back(id);
  const NodeContent shape = shape_of(transform->children.front(), plan.first_model);
  const bool was_frame = was_of_frames() && source_.scene.instances().find(handle) != nullptr &&
                         source_.scene.grids().find(plan.grid) != nullptr &&
                         plan.grid.index == static_cast<std::size_t>(source_.frame);
  keeps_frames_ = keeps_frames_ || was_frame;
  const std::string name = printable(instance.name);
  if (was_frame) return add_frames(std::move(*transform), shape, plan, name);
  add_model(std::move(*transform), shape, plan, name);
  return {};
}

Status GraphRevision::revise_instance(const Instance& instance, const PlacedShape& placement, const Instance& before) {
  const GridPlan& plan = *models_.find(instance.grid);
  Wanted wanted{instance.name, instance.visible, instance.layer, parent_now(instance.group), placement.world};
  if (scene_.layers().find(wanted.layer) == nullptr) wanted.layer = {};
  const Known known{placement, before.name, before.visible, before.layer, parent_in_source(placement.parent)};
  const bool stands_still = has_same_place(instance, before) && instance.voxel_size == before.voxel_size &&
                            instance.grid == before.grid && plan.source_model != kNone && !plan.is_resized &&
                            scene_.grids()[plan.grid].pivot == source_.scene.grids()[plan.grid].pivot;
  if (!stands_still) {
    const auto world = place(instance, plan);
    if (!world) return world.error();
    wanted.world = *world;
  }
  show_model(placement, plan);
  return revise_transform(wanted, known);
}

/// Removes instances without a grid.
Status GraphRevision::revise_instances() {
  for (const InstanceHandle handle : scene_.instances().handles()) {
    const Instance& instance = scene_.instances()[handle];
    if (models_.find(instance.grid) == nullptr) continue;
    const Instance* before = keeps_graph_ ? source_.scene.instances().find(handle) : nullptr;
    Status done = before != nullptr ? revise_instance(instance, source_.placements.all[handle.index], *before)
                                    : add_instance(handle, instance);
    if (!done) return done;
  }
  return {};
}

void GraphRevision::apply_child_changes() {
  for (const auto& [parent, changes] : children_) {
    const bool is_gone = parent.source_node != kNone && out_.is_removed[parent.source_node];
    if (is_gone || (parent.source_node == kNone && parent.added == kNone)) continue;
    NodeContent& group = parent.source_node != kNone ? change(parent.source_node) : out_.added[parent.added];
    std::erase_if(group.children, [&](std::int32_t child) { return changes.removed.contains(child); });
    for (std::int32_t& child : group.children) {
      const auto replaced = changes.replaced.find(child);
      if (replaced != changes.replaced.end()) child = replaced->second;
    }
    group.children.insert(group.children.end(), changes.added.begin(), changes.added.end());
  }
}

/// Returns true if the reader would treat the group, as the topmost one, as the scene itself.
bool GraphRevision::would_be_the_scene(const SceneGroup& group) const {
  return group.visible && printable(group.name).empty() && scene_.layers().find(group.layer) == nullptr;
}

bool GraphRevision::needs_new_top() const {
  const auto changes = children_.find(top_);
  if (changes != children_.end()) return true;
  const std::vector<PlacedNode>& groups = source_.placements.groups;
  const auto root = std::ranges::find(groups, kNone, &PlacedNode::parent);
  if (root == groups.end()) return false;
  const auto slot = static_cast<std::uint32_t>(root - groups.begin());
  const SceneGroup* group = scene_.groups().find({slot, 0});
  return group != nullptr && would_be_the_scene(*group);
}

/// Gives the node with the root's id another id.
void GraphRevision::free_root_id() {
  const std::vector<Node>& nodes = source_.document.nodes;
  const auto taken = std::ranges::find(nodes, kRootTransform, &Node::id);
  if (taken == nodes.end()) return;
  const std::int32_t id = ids_.take();
  const auto refers = [](const auto& children) { return std::ranges::count(children, kRootTransform) > 0; };
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto children = std::span(source_.document.children).subspan(nodes[i].first_child, nodes[i].child_count);
    if (!out_.is_removed[i] && nodes[i].kind != NodeKind::Shape && refers(children)) change(i);
  }
  for (auto& [place, node] : out_.changed) std::ranges::replace(node.children, kRootTransform, id);
  for (NodeContent& node : out_.added) std::ranges::replace(node.children, kRootTransform, id);
  change(static_cast<std::size_t>(taken - nodes.begin())).id = id;
}

/// If the source had no group for the scene itself, the new root is kept only if it gets new nodes.
void GraphRevision::settle_root() {
  if (!keeps_graph_ || source_.placements.top_group != kNone) return;
  if (!needs_new_top()) {
    out_.added.erase(out_.added.begin(), out_.added.begin() + kNewTop + 1);
    return;
  }
  if (!source_.placements.is_tree) out_.must_be_new = true;
  free_root_id();
  out_.added[kNewRoot].id = kRootTransform;
}

Result<RevisedGraph> GraphRevision::run() {
  number_layers();
  find_top();
  if (keeps_graph_) remove_missing_nodes();
  if (Status done = revise_groups(); !done) return done.error();
  if (Status done = revise_instances(); !done) return done.error();
  if (was_of_frames() && !keeps_frames_) out_.frames_left_out = std::ssize(source_.document.models);
  name_shapes();
  apply_child_changes();
  settle_root();
  return std::move(out_);
}

RevisedGraph revise_layers(const Scene& scene, const VoxSource& source) {
  ModelPlan nothing;
  return GraphRevision(scene, source, nothing, true).layers_only();
}

Result<RevisedGraph> revise_graph(const Scene& scene, const VoxSource& source, const ModelPlan& models,
                                  bool keeps_graph) {
  return GraphRevision(scene, source, models, keeps_graph).run();
}

bool needs_graph(const Scene& scene, const VoxSource& source, const ModelPlan& models) {
  if (!source.document.nodes.empty()) return false;
  if (!scene.groups().empty()) return true;
  // Without a graph the reader shows one model.
  if (scene.instances().empty()) return models.count > 0;
  if (source.placements.all.empty() || scene.instances().size() != 1) return true;
  const auto handle = scene.instances().handle_at(0);
  const Instance* before = handle ? source.scene.instances().find(*handle) : nullptr;
  if (before == nullptr) return true;
  const Instance& instance = scene.instances()[*handle];
  const GridPlan* plan = models.find(instance.grid);
  if (plan == nullptr || plan->source_model != static_cast<std::size_t>(source.frame)) return true;
  const SceneGrid& grid = scene.grids()[instance.grid];
  const bool says_nothing =
      instance.name.empty() && grid.name.empty() && instance.visible && scene.layers().find(instance.layer) == nullptr;
  // Compares with the position that the reader would choose: on the ground, centred. Checks the models of other frames
  // too.
  for (const GridPlan& other : models.grids) {
    const bool was_there = source.scene.grids().find(other.grid) != nullptr;
    if (was_there && (other.source_model == kNone || (other.is_resized && other.grid != instance.grid))) return true;
  }
  const int height = plan->pieces.front().size.y;
  const DVec3 pivot = world_from_grid(instance, grid, pivot_of(plan->pieces.front()));
  return !says_nothing || instance.rotation != before->rotation || instance.mirrored || instance.voxel_size != 1.0 ||
         pivot != DVec3(0, height / 2, 0);
}

// The models that instances show: shapes of one model, groups of shapes for grids of several pieces, and shape keys for
// former frames.
namespace {

NodeContent group_of(std::int32_t id) {
  NodeContent group;
  group.kind = NodeKind::Group;
  group.id = id;
  return group;
}

}  // namespace

Motion from_first_piece(const GridPlan& plan, std::size_t piece) {
  const DVec3 way = pivot_of(plan.pieces[piece]) - pivot_of(plan.pieces.front());
  return {{}, vox_from_quoin({std::llround(way.x), std::llround(way.y), std::llround(way.z)})};
}

NodeContent GraphRevision::shape_of(std::int32_t id, std::uint32_t model) const {
  NodeContent shape;
  shape.kind = NodeKind::Shape;
  shape.id = id;
  shape.models.emplace_back(model, Entries{});
  return shape;
}

/// Returns the frames of a file without a scene graph, where each model was a frame. `box`: the new motion of the
/// source box's pivot for the current frame.
std::vector<GraphRevision::Frame> GraphRevision::frames_about(const Motion& box) const {
  const auto lone = [&](std::size_t model) {
    Motion motion;
    motion.translation[2] = source_.document.models[model].size.z / 2;
    return motion;
  };
  const Motion ground = box * inverse(lone(static_cast<std::size_t>(source_.frame)));
  std::vector<Frame> frames(source_.document.models.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const GridPlan* plan = models_.find(handle_read(source_.scene.grids(), i));
    if (plan == nullptr || source_.scene.grids().find(plan->grid) == nullptr) continue;
    // A model that outgrew its box has another pivot.
    frames[i] = {plan, ground * lone(i) * inverse(from_source_box(*plan, i))};
  }
  return frames;
}

/// Returns the offset between the pivots of a source model's box and of its first piece.
Motion GraphRevision::from_source_box(const GridPlan& plan, std::size_t model) const {
  GridPlan boxes = plan;
  const IBox before = canvas_of(source_.document.models[model].size);
  boxes.pieces.push_back({before.min, before.size(), 0});
  return from_first_piece(boxes, plan.pieces.size());
}

/// Makes `shape` show at each frame the model of a single piece, and nothing for several pieces.
void GraphRevision::show_frames(const std::vector<Frame>& frames, NodeContent& transform, NodeContent& shape) {
  transform.frames.clear();
  shape.models.clear();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool is_one = frames[i].plan != nullptr && frames[i].plan->pieces.size() == 1;
    out_.has_empty_model = out_.has_empty_model || !is_one;
    Entries& key = transform.frames.emplace_back();
    if (is_one) set_motion(key, frames[i].first);
    key.set("_f", std::to_string(i));
    const std::uint32_t model = is_one ? frames[i].plan->first_model : models_.count;
    shape.models.emplace_back(model, Entries{}).second.set("_f", std::to_string(i));
  }
}

/// Adds a piece of a grid below a group, at `group` in the added nodes. `frame`: the only frame of `frame_count` that
/// shows it; kNone: all frames show it.
void GraphRevision::hang_piece(std::size_t group, const std::string& name, const GridPlan& plan, std::size_t piece,
                               const Motion& motion, std::size_t frame, std::size_t frame_count) {
  NodeContent transform;
  transform.kind = NodeKind::Transform;
  transform.id = ids_.take();
  transform.children = {ids_.take()};
  transform.layer = layer_id({});
  transform.attributes.set_or_erase("_name", name);
  set_motion(transform.frames.emplace_back(), motion);
  out_.added[group].children.push_back(transform.id);
  const std::uint32_t model = plan.first_model + static_cast<std::uint32_t>(piece);
  NodeContent shape = shape_of(transform.children.front(), model);
  if (frame != kNone) {
    shape.models.clear();
    out_.has_empty_model = true;
    for (std::size_t i = 0; i < frame_count; ++i) {
      shape.models.emplace_back(i == frame ? model : models_.count, Entries{}).second.set("_f", std::to_string(i));
    }
  }
  out_.added.push_back(std::move(transform));
  added_shapes_[plan.grid].push_back(out_.added.size());
  out_.added.push_back(std::move(shape));
}

void GraphRevision::add_model(NodeContent transform, NodeContent shape, const GridPlan& plan, const std::string& name) {
  out_.added.push_back(std::move(transform));
  const std::size_t at = out_.added.size();
  const bool is_one = plan.pieces.size() == 1;
  if (is_one) added_shapes_[plan.grid].push_back(at);
  out_.added.push_back(is_one ? std::move(shape) : group_of(shape.id));
  for (std::size_t i = 0; !is_one && i < plan.pieces.size(); ++i) {
    hang_piece(at, name, plan, i, from_first_piece(plan, i), kNone, 0);
  }
}

/// Adds all models that were frames as keys of one shape. Models of several pieces become a group with a shape for
/// each.
Status GraphRevision::add_frames(NodeContent transform, NodeContent shape, const GridPlan& plan,
                                 const std::string& name) {
  const Motion box = from_source_box(plan, static_cast<std::size_t>(source_.frame));
  const auto is_one = [](const Frame& frame) { return frame.plan != nullptr && frame.plan->pieces.size() == 1; };
  std::vector<Frame> frames = frames_about(motion_of(transform.frames.front()) * box);
  const auto check_range = [&](const Motion& motion) -> Status {
    if (has_32_bits(motion.translation)) return {};
    return make_error(ErrorCode::LimitExceeded, "\"" + name + "\" is too far from the origin for .vox");
  };
  for (const Frame& frame : frames) {
    if (auto fits = check_range(frame.first); !fits) return fits;
  }
  if (std::ranges::all_of(frames, [&](const Frame& frame) { return frame.plan == nullptr || is_one(frame); })) {
    show_frames(frames, transform, shape);
    out_.added.push_back(std::move(transform));
    added_shapes_[plan.grid].push_back(out_.added.size());
    out_.added.push_back(std::move(shape));
    return {};
  }
  frames = frames_about(box);
  for (const Frame& frame : frames) {
    if (auto fits = check_range(frame.first); !fits) return fits;
  }
  out_.added.push_back(std::move(transform));
  const std::size_t group = out_.added.size();
  out_.added.push_back(group_of(shape.id));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].plan == nullptr || is_one(frames[i])) continue;
    for (std::size_t piece = 0; piece < frames[i].plan->pieces.size(); ++piece) {
      const Motion motion = frames[i].first * from_first_piece(*frames[i].plan, piece);
      if (auto fits = check_range(motion); !fits) return fits;
      hang_piece(group, name, *frames[i].plan, piece, motion, i, frames.size());
    }
  }
  if (std::ranges::none_of(frames, is_one)) return {};
  NodeContent others;
  others.kind = NodeKind::Transform;
  others.id = ids_.take();
  others.layer = layer_id({});
  others.attributes.set_or_erase("_name", name);
  shape.id = ids_.take();
  others.children = {shape.id};
  out_.added[group].children.push_back(others.id);
  show_frames(frames, others, shape);
  out_.added.push_back(std::move(others));
  if (plan.pieces.size() == 1) added_shapes_[plan.grid].push_back(out_.added.size());
  out_.added.push_back(std::move(shape));
  return {};
}

/// Adds a shape below a transform: a copy of a source shape that shows other models. Returns the transform's id.
std::int32_t GraphRevision::add_shape(const NodeContent& before, const std::vector<std::uint32_t>& shown,
                                      const Motion& motion) {
  const std::int32_t id = ids_.take();
  NodeContent shape = before;
  shape.id = ids_.take();
  shape.attributes.erase("_hidden");
  for (std::size_t i = 0; i < shown.size(); ++i) shape.models[i].first = shown[i];
  NodeContent& transform = out_.added.emplace_back();
  transform.kind = NodeKind::Transform;
  transform.id = id;
  transform.children = {shape.id};
  set_motion(transform.frames.emplace_back(), motion);
  out_.added.push_back(std::move(shape));
  return id;
}

/// Turns a shape that shows one model at the frame into a group of shapes that show its pieces at that frame only. An
/// additional shape shows the models of the other frames.
void GraphRevision::show_pieces(std::size_t shape_node, const GridPlan& plan) {
  NodeContent& shape = change(shape_node);
  const NodeContent before = shape;
  const KeyInForce now = model_in_force(before, source_.frame);
  const bool has_others = before.models.size() > 1;
  const std::uint32_t nothing = models_.count;
  out_.has_empty_model = out_.has_empty_model || has_others;
  shape.kind = NodeKind::Group;
  shape.models.clear();
  shape.attributes = Entries{};
  if (before.attributes.get("_hidden") == "1") shape.attributes.set("_hidden", "1");
  std::vector<std::int32_t> children;
  for (std::size_t i = 0; i < plan.pieces.size(); ++i) {
    std::vector<std::uint32_t> shown(before.models.size(), nothing);
    shown[now.place] = plan.first_model + static_cast<std::uint32_t>(i);
    added_shapes_[plan.grid].push_back(out_.added.size() + 1);
    children.push_back(add_shape(before, shown, from_first_piece(plan, i)));
  }
  if (has_others) {
    std::vector<std::uint32_t> shown;
    shown.reserve(before.models.size());
    for (const auto& [model, key] : before.models) shown.push_back(model);
    shown[now.place] = nothing;
    children.push_back(add_shape(before, shown, {}));
  }
  shape.children = std::move(children);
}

void GraphRevision::show_model(const PlacedShape& placement, const GridPlan& plan) {
  if (plan.pieces.size() > 1) {
    show_pieces(placement.node, plan);
    return;
  }
  source_shapes_[plan.grid].push_back(placement.node);
  if (placement.model == plan.first_model) return;
  NodeContent& shape = change(placement.node);
  shape.models[model_in_force(shape, source_.frame).place].first = plan.first_model;
}

/// Names shapes after their grids where the instances' names differ.
void GraphRevision::name_shapes() {
  std::map<GridHandle, std::string> of_instances;
  for (const InstanceHandle handle : scene_.instances().handles()) {
    const Instance& instance = scene_.instances()[handle];
    std::string& name = of_instances[instance.grid];
    if (name.empty()) name = printable(instance.name);
  }
  for (const GridPlan& plan : models_.grids) {
    const std::string wanted = printable(scene_.grids()[plan.grid].name);
    const std::vector<std::size_t>& known = source_shapes_[plan.grid];
    std::string read;
    for (const std::size_t node : known) {
      if (read.empty()) read = printable(source_.document.nodes[node].name);
    }
    const std::string& of_instance = of_instances[plan.grid];
    if ((read.empty() ? of_instance : read) == wanted) continue;
    const std::string name = wanted == of_instance ? std::string{} : wanted;
    for (const std::size_t node : known) change(node).attributes.set_or_erase("_name", name);
    for (const std::size_t node : added_shapes_[plan.grid]) out_.added[node].attributes.set_or_erase("_name", name);
  }
}

}  // namespace quoin::vox
