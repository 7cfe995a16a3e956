// The models that instances show: shapes of one model, groups of shapes for grids of several pieces, and shape keys for
// former frames.

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes/text.h"
#include "io/vox/write/graph_revision.h"

namespace quoin::vox {

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

void GraphRevision::show_model(const Placement& placement, const GridPlan& plan) {
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
