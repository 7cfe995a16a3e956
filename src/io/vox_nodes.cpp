#include <algorithm>
#include <limits>

#include "io/text.h"
#include "io/vox_chunk_reader.h"
#include "io/vox_chunks.h"

namespace quoin::vox {

namespace {

constexpr std::int64_t kMaxInt32 = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t kMinInt32 = std::numeric_limits<std::int32_t>::min();

// The least bytes that one of them takes: a frame is an empty DICT, a shape's model an id and an empty DICT.
constexpr std::size_t kLeastFrameBytes = 4;
constexpr std::size_t kLeastModelBytes = 8;
constexpr std::size_t kChildBytes = 4;

std::string quoted(std::string_view text) {
  constexpr std::size_t kMost = 40;
  std::string out = "\"";
  out += printable(text.substr(0, kMost));
  out += '"';
  return out;
}

/// `_f`; a key without one takes its place in the list.
Result<std::int32_t> parse_frame(const ChunkReader& chunk, const Dict& dict, std::size_t place) {
  const std::string_view text = dict.get("_f");
  if (text.empty()) return static_cast<std::int32_t>(place);
  const std::optional<std::int64_t> frame = parse_integer(text);
  if (!frame.has_value() || *frame < 0 || *frame > kMaxInt32) return chunk.error("has the frame " + quoted(text));
  return static_cast<std::int32_t>(*frame);
}

Result<Orientation> parse_orientation(const ChunkReader& chunk, std::string_view text) {
  if (text.empty()) return Orientation{};
  const std::optional<std::int64_t> byte = parse_integer(text);
  std::optional<Orientation> orientation;
  if (byte.has_value() && *byte >= 0 && *byte <= 255) {
    orientation = orientation_from_byte(static_cast<std::uint8_t>(*byte));
  }
  if (!orientation.has_value()) return chunk.error("has the rotation " + quoted(text));
  return *orientation;
}

/// Three integers with blanks between them.
Result<IVec3> parse_translation(const ChunkReader& chunk, std::string_view text) {
  IVec3 translation{0};
  std::string_view rest = text;
  for (int axis = 0; axis < 3 && !text.empty(); ++axis) {
    rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
    const std::size_t length = std::min(rest.find(' '), rest.size());
    const std::optional<std::int64_t> value = parse_integer(rest.substr(0, length));
    if (!value.has_value() || *value < kMinInt32 || *value > kMaxInt32) {
      return chunk.error("has the translation " + quoted(text));
    }
    translation[axis] = static_cast<int>(*value);
    rest.remove_prefix(length);
  }
  if (rest.find_first_not_of(' ') != std::string_view::npos) {
    return chunk.error("has the translation " + quoted(text));
  }
  return translation;
}

Result<TransformKey> parse_transform_key(ChunkReader& chunk, std::size_t place) {
  const Dict dict = chunk.dict();
  if (chunk.failed()) return chunk.too_short();
  const Result<std::int32_t> frame = parse_frame(chunk, dict, place);
  if (!frame) return tl::unexpected(frame.error());
  const Result<Orientation> orientation = parse_orientation(chunk, dict.get("_r"));
  if (!orientation) return tl::unexpected(orientation.error());
  const Result<IVec3> translation = parse_translation(chunk, dict.get("_t"));
  if (!translation) return tl::unexpected(translation.error());
  return TransformKey{*frame, *orientation, *translation};
}

Result<ModelKey> parse_model_key(ChunkReader& chunk, std::size_t place) {
  const std::uint32_t model = chunk.u32();
  const Dict dict = chunk.dict();
  if (chunk.failed()) return chunk.too_short();
  const Result<std::int32_t> frame = parse_frame(chunk, dict, place);
  if (!frame) return tl::unexpected(frame.error());
  return ModelKey{*frame, model};
}

/// Reads the `node.key_count` keys of a node, and sorts them by frame.
template <class Key>
Status parse_keys(ChunkReader& chunk, Result<Key> (*parse)(ChunkReader&, std::size_t), std::vector<Key>& keys,
                  Node& node, Document& out) {
  node.first_key = keys.size();
  for (std::size_t i = 0; i < node.key_count; ++i) {
    const Result<Key> key = parse(chunk, i);
    if (!key) return tl::unexpected(key.error());
    out.last_frame = std::max(out.last_frame, key->frame);
    keys.push_back(*key);
  }
  const auto first = keys.begin() + static_cast<std::ptrdiff_t>(node.first_key);
  std::stable_sort(first, keys.end(), [](const Key& a, const Key& b) { return a.frame < b.frame; });
  return {};
}

/// What all nodes begin with: an id and attributes.
Node parse_node(ChunkReader& chunk, NodeKind kind) {
  Node node;
  node.kind = kind;
  node.offset = chunk.offset();
  node.id = chunk.i32();
  const Dict attributes = chunk.dict();
  node.name = attributes.get("_name");
  node.hidden = attributes.is_set("_hidden");
  node.loops = attributes.is_set("_loop");
  return node;
}

}  // namespace

Status parse_transform(ChunkReader& chunk, Document& out) {
  Node node = parse_node(chunk, NodeKind::Transform);
  const std::int32_t child = chunk.i32();
  static_cast<void>(chunk.i32());  // reserved
  node.layer = chunk.i32();
  node.key_count = chunk.count(kLeastFrameBytes);
  if (chunk.failed()) return chunk.too_short();
  node.first_child = out.children.size();
  node.child_count = 1;
  out.children.push_back(child);
  if (Status status = parse_keys(chunk, &parse_transform_key, out.transform_keys, node, out); !status) return status;
  if (node.key_count == 0) {
    out.transform_keys.emplace_back();
    node.key_count = 1;
  }
  out.nodes.push_back(node);
  return {};
}

Status parse_group(ChunkReader& chunk, Document& out) {
  Node node = parse_node(chunk, NodeKind::Group);
  node.first_child = out.children.size();
  node.child_count = chunk.count(kChildBytes);
  for (std::size_t i = 0; i < node.child_count; ++i) out.children.push_back(chunk.i32());
  if (chunk.failed()) return chunk.too_short();
  out.nodes.push_back(node);
  return {};
}

Status parse_shape(ChunkReader& chunk, Document& out) {
  Node node = parse_node(chunk, NodeKind::Shape);
  node.key_count = chunk.count(kLeastModelBytes);
  if (chunk.failed()) return chunk.too_short();
  if (node.key_count == 0) return chunk.error("has no model");
  if (Status status = parse_keys(chunk, &parse_model_key, out.model_keys, node, out); !status) return status;
  out.nodes.push_back(node);
  return {};
}

Status parse_layer(ChunkReader& chunk, Document& out) {
  Layer layer;
  layer.id = chunk.i32();
  layer.hidden = chunk.dict().is_set("_hidden");
  if (chunk.failed()) return chunk.too_short();
  out.layers.push_back(layer);
  return {};
}

Status parse_animation_range(ChunkReader& chunk, Document& out) {
  const Dict dict = chunk.dict();
  if (chunk.failed()) return chunk.too_short();
  const std::string_view range = dict.get("_anim_range");
  const std::optional<std::int64_t> last = parse_integer(range.substr(range.rfind(' ') + 1));
  if (last.has_value() && *last > out.last_frame && *last <= kMaxInt32) {
    out.last_frame = static_cast<std::int32_t>(*last);
  }
  return {};
}

}  // namespace quoin::vox
