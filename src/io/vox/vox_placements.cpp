#include "io/vox/vox_reader.h"

#include <algorithm>
#include <optional>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"

namespace quoin::vox {

namespace {

// The number of graph visits that any file may need, and the file bytes per additional visit. Real files visit each
// node once and have at least 24 bytes per node.
constexpr std::size_t kFreeVisits = 65'536;
constexpr std::size_t kBytesPerVisit = 4;

/// Finds nodes by id. Sorted rather than hashed: a hostile choice of ids cannot slow it down.
class NodeIndex {
 public:
  static Result<NodeIndex> build(const Document& document) {
    NodeIndex index;
    index.by_id_.reserve(document.nodes.size());
    for (std::size_t i = 0; i < document.nodes.size(); ++i) index.by_id_.emplace_back(document.nodes[i].id, i);
    std::ranges::sort(index.by_id_);
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    const auto twice = std::adjacent_find(index.by_id_.begin(), index.by_id_.end(), same);
    if (twice != index.by_id_.end()) {
      return bad_at(document.nodes[std::next(twice)->second].offset,
                    "node " + std::to_string(twice->first) + " is a duplicate");
    }
    return index;
  }

  /// kNone if no node has this id.
  [[nodiscard]] std::size_t find(std::int32_t id) const {
    const auto found = std::ranges::lower_bound(by_id_, std::pair{id, std::size_t{0}});
    return found != by_id_.end() && found->first == id ? found->second : kNone;
  }

 private:
  std::vector<std::pair<std::int32_t, std::size_t>> by_id_;
};

/// The frame that a looping node shows: folded into the range of its keys, which are sorted.
std::int64_t folded(std::int64_t frame, std::int64_t first, std::int64_t last) {
  QUOIN_ASSERT(first <= last, "keys are sorted");
  const std::int64_t length = last - first + 1;
  return first + ((frame - first) % length + length) % length;
}

/// Returns the last key at or before the frame, or the first key.
template <class Key>
std::size_t key_at(std::span<const Key> keys, std::int64_t frame) {
  const auto after = std::ranges::upper_bound(keys, frame, {}, &Key::frame);
  return after == keys.begin() ? 0 : static_cast<std::size_t>(after - keys.begin()) - 1;
}

template <class Key>
std::int64_t frame_for(const Node& node, std::span<const Key> keys, int frame) {
  QUOIN_ASSERT(!keys.empty(), "a node with keys");
  return node.loops ? folded(frame, keys.front().frame, keys.back().frame) : frame;
}

std::span<const TransformKey> keys_of_transform(const Document& document, const Node& node) {
  return std::span(document.transform_keys).subspan(node.first_key, node.key_count);
}

std::span<const ModelKey> keys_of_shape(const Document& document, const Node& node) {
  return std::span(document.model_keys).subspan(node.first_key, node.key_count);
}

}  // namespace

std::int64_t frame_of_transform(const Document& document, const Node& node, int frame) {
  return frame_for(node, keys_of_transform(document, node), frame);
}

std::size_t key_of_shape(const Document& document, const Node& shape, int frame) {
  const std::span keys = keys_of_shape(document, shape);
  return key_at(keys, frame_for(shape, keys, frame));
}

Motion motion_at(const Document& document, const Node& node, int requested) {
  const std::span keys = keys_of_transform(document, node);
  const std::int64_t frame = frame_for(node, keys, requested);
  const std::size_t i = key_at(keys, frame);
  Motion motion{keys[i].orientation, {}};
  const bool between = i + 1 < keys.size() && frame > keys[i].frame;
  for (int axis = 0; axis < 3; ++axis) {
    std::int64_t value = keys[i].translation[axis];
    if (between) {
      // Below 2^62: a translation has 32 bits, and the two weights add up to a length of at most 31 bits.
      const std::int64_t length = std::int64_t{keys[i + 1].frame} - keys[i].frame;
      const std::int64_t past = frame - keys[i].frame;
      value = (value * (length - past) + std::int64_t{keys[i + 1].translation[axis]} * past) / length;
    }
    motion.translation[static_cast<std::size_t>(axis)] = value;
  }
  return motion;
}

namespace {

/// A transform or a group on the path from the root to the current node. `placed` is its position if it is a group,
/// else the chain down to it.
struct Step {
  std::size_t node = 0;
  std::size_t next_child = 0;
  PlacedNode placed;
  std::size_t group = kNone;  ///< its index in Placements::groups, if it is a listed group
};

class GraphWalk {
 public:
  GraphWalk(const Document& document, int frame, std::size_t file_bytes)
      : document_(document), frame_(frame), visits_left_(kFreeVisits + file_bytes / kBytesPerVisit) {
    names_left_ = visits_left_ * kBytesPerVisit;
  }

  Result<Placements> run();

 private:
  [[nodiscard]] std::size_t find_root() const;
  [[nodiscard]] bool is_layer_hidden(std::int32_t id) const;
  [[nodiscard]] Status check_shapes();
  [[nodiscard]] PlacedNode below(const Step& parent) const;
  [[nodiscard]] bool is_scene_itself(const PlacedNode& placed) const;
  [[nodiscard]] bool has_layer(std::int32_t id) const;
  Status take_names(const PlacedNode& placed, std::string_view more);
  void close_chain(PlacedNode& placed);
  void add_transform(Step& step);
  Status add_group(Step& step);
  Status enter(std::size_t node, const Step& parent);
  Status place(std::size_t node, const Step& parent);
  Status walk(std::size_t root);

  const Document& document_;
  int frame_;
  std::size_t visits_left_;
  std::size_t names_left_;
  NodeIndex index_;
  std::vector<std::int32_t> hidden_layers_;  // sorted
  std::vector<std::int32_t> layers_;         // sorted
  std::vector<bool> is_open_;
  std::vector<bool> is_seen_;
  std::vector<Step> way_;
  Placements out_;
};

bool GraphWalk::is_layer_hidden(std::int32_t id) const {
  return std::ranges::binary_search(hidden_layers_, id);
}

bool GraphWalk::has_layer(std::int32_t id) const {
  return std::ranges::binary_search(layers_, id);
}

/// Returns MagicaVoxel's root, transform 0, or else the first node without a parent. If the graph is all cycles,
/// returns the first node, to detect one.
std::size_t GraphWalk::find_root() const {
  const std::size_t zero = index_.find(0);
  if (zero != kNone && document_.nodes[zero].kind == NodeKind::Transform) return zero;
  std::vector<bool> has_parent(document_.nodes.size());
  for (const std::int32_t id : document_.children) {
    const std::size_t child = index_.find(id);
    if (child != kNone) has_parent[child] = true;
  }
  const auto root = std::ranges::find(has_parent, false);
  return root == has_parent.end() ? 0 : static_cast<std::size_t>(root - has_parent.begin());
}

/// Checks that every model that a shape shows at any frame exists.
Status GraphWalk::check_shapes() {
  out_.is_model_used.assign(document_.models.size(), false);
  for (const Node& node : document_.nodes) {
    if (node.kind != NodeKind::Shape) continue;
    for (const ModelKey& key : keys_of_shape(document_, node)) {
      if (key.model >= document_.models.size()) {
        return bad_at(node.offset, "node " + std::to_string(node.id) + " shows model " + std::to_string(key.model) +
                                       ", but there are " + std::to_string(document_.models.size()));
      }
      out_.is_model_used[key.model] = true;
    }
  }
  return {};
}

/// Returns the initial PlacedNode of a step's children.
PlacedNode GraphWalk::below(const Step& parent) const {
  if (parent.node != kNone && document_.nodes[parent.node].kind == NodeKind::Transform) return parent.placed;
  PlacedNode placed;
  placed.parent = parent.group;
  placed.parent_motion = parent.placed.world;
  placed.world = parent.placed.world;
  return placed;
}

Status GraphWalk::take_names(const PlacedNode& placed, std::string_view more) {
  const std::size_t bytes = placed.name.size() + more.size();
  if (bytes > names_left_) {
    return make_error(ErrorCode::LimitExceeded, "the scene graph repeats names too often", {},
                      document_.nodes[placed.node].offset);
  }
  names_left_ -= bytes;
  return {};
}

Status GraphWalk::place(std::size_t at, const Step& parent) {
  const Node& node = document_.nodes[at];
  PlacedShape placement{below(parent), 0, {}};
  placement.node = at;
  placement.hidden = placement.hidden || node.hidden;
  placement.model = document_.model_keys[node.first_key + key_of_shape(document_, node, frame_)].model;
  placement.shape_name = node.name;
  if (Status status = take_names(placement, placement.shape_name); !status) return status;
  close_chain(placement);
  out_.all.push_back(placement);
  return {};
}

/// The chain's transforms are the last steps of the path.
void GraphWalk::close_chain(PlacedNode& placed) {
  QUOIN_ASSERT(placed.transform_count <= way_.size(), "transforms on the path");
  placed.first_transform = out_.chains.size();
  for (std::size_t i = way_.size() - placed.transform_count; i < way_.size(); ++i) out_.chains.push_back(way_[i].node);
}

/// Returns true if the topmost group is the scene itself: it has no properties that a scene cannot hold.
bool GraphWalk::is_scene_itself(const PlacedNode& placed) const {
  return out_.top_group == kNone && out_.groups.empty() && out_.all.empty() && placed.parent == kNone &&
         !placed.hidden && placed.name.empty() && !has_layer(placed.layer);
}

void GraphWalk::add_transform(Step& step) {
  const Node& node = document_.nodes[step.node];
  PlacedNode& placed = step.placed;
  // The effects of a chain's earlier transforms count as its own.
  if (placed.transform_count > 0) {
    placed.before = inverse(placed.parent_motion) * placed.world;
    placed.hidden = placed.hidden || is_layer_hidden(placed.layer);
  }
  ++placed.transform_count;
  placed.world = placed.world * motion_at(document_, node, frame_);
  placed.hidden = placed.hidden || node.hidden;
  placed.name = node.name;
  placed.layer = node.layer;
}

Status GraphWalk::add_group(Step& step) {
  const Node& node = document_.nodes[step.node];
  PlacedNode& placed = step.placed;
  placed.node = step.node;
  placed.hidden = placed.hidden || node.hidden;
  if (placed.name.empty()) placed.name = node.name;
  close_chain(placed);
  if (is_scene_itself(placed)) {
    out_.top_group = step.node;
    out_.top_motion = placed.world;
    return {};
  }
  if (Status status = take_names(placed, {}); !status) return status;
  step.group = out_.groups.size();
  out_.groups.push_back(placed);
  return {};
}

Status GraphWalk::enter(std::size_t at, const Step& parent) {
  QUOIN_ASSERT(at < document_.nodes.size(), "a node of the document");
  const Node& node = document_.nodes[at];
  if (is_open_[at]) return bad_at(node.offset, "node " + std::to_string(node.id) + " is its own descendant");
  if (visits_left_ == 0) {
    return make_error(ErrorCode::LimitExceeded, "nodes with several parents multiply beyond the file's size", {},
                      node.offset);
  }
  --visits_left_;
  if (is_seen_[at]) out_.is_tree = false;
  is_seen_[at] = true;
  if (node.kind == NodeKind::Shape) return place(at, parent);
  Step step;
  step.node = at;
  step.placed = below(parent);
  if (node.kind == NodeKind::Transform) {
    add_transform(step);
  } else if (Status status = add_group(step); !status) {
    return status;
  }
  is_open_[at] = true;
  way_.push_back(step);
  return {};
}

Status GraphWalk::walk(std::size_t root) {
  Step above;
  above.node = kNone;
  if (Status status = enter(root, above); !status) return status;
  while (!way_.empty()) {
    Step& step = way_.back();
    const Node& node = document_.nodes[step.node];
    if (step.next_child == node.child_count) {
      is_open_[step.node] = false;
      way_.pop_back();
      continue;
    }
    const std::int32_t id = document_.children[node.first_child + step.next_child++];
    const std::size_t child = index_.find(id);
    if (child == kNone) {
      return bad_at(node.offset, "node " + std::to_string(node.id) + " refers to node " + std::to_string(id) +
                                     ", which does not exist");
    }
    // A copy, because entering extends the path.
    const Step parent = step;
    if (Status status = enter(child, parent); !status) return status;
  }
  return {};
}

Result<Placements> GraphWalk::run() {
  Result<NodeIndex> index = NodeIndex::build(document_);
  if (!index) return index.error();
  index_ = std::move(*index);
  for (const Layer& layer : document_.layers) {
    layers_.push_back(layer.id);
    if (layer.hidden) hidden_layers_.push_back(layer.id);
  }
  std::ranges::sort(hidden_layers_);
  std::ranges::sort(layers_);
  if (Status status = check_shapes(); !status) return status.error();
  is_open_.assign(document_.nodes.size(), false);
  is_seen_.assign(document_.nodes.size(), false);
  if (Status status = walk(find_root()); !status) return status.error();
  const auto separate = std::ranges::count(is_seen_, false);
  out_.nodes_apart = static_cast<std::size_t>(separate);
  if (separate > 0) out_.warnings.push_back("nodes outside the scene graph skipped: " + std::to_string(separate));
  return std::move(out_);
}

/// Shows one model of a file without a scene graph, where MagicaVoxel places a model that it loads.
Result<Placements> place_lone_model(const Document& document, int frame) {
  Placements out;
  out.is_model_used.assign(document.models.size(), true);
  if (document.models.empty()) {
    out.warnings.emplace_back("the file has no models");
    return out;
  }
  PlacedShape placement;
  placement.model = static_cast<std::uint32_t>(frame);
  QUOIN_ASSERT(frame >= 0 && static_cast<std::size_t>(frame) < document.models.size(), "a model of the document");
  placement.world.translation[2] = document.models[placement.model].size.z / 2;
  out.all.push_back(placement);
  return out;
}

}  // namespace

Result<Placements> place_models(const Document& document, int frame, std::size_t file_bytes) {
  const std::int64_t last = last_frame(document);
  if (frame < 0 || frame > last) {
    return make_error(ErrorCode::InvalidArgument,
                      "frame " + std::to_string(frame) + " does not exist; the last frame is " + std::to_string(last));
  }
  Result<Placements> placements =
      document.nodes.empty() ? place_lone_model(document, frame) : GraphWalk(document, frame, file_bytes).run();
  if (placements && is_animated(document)) {
    placements->warnings.push_back("animated: frame " + std::to_string(frame) + " of 0 to " + std::to_string(last) +
                                   " is shown");
  }
  return placements;
}

}  // namespace quoin::vox
