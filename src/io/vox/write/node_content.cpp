#include "io/vox/write/node_content.h"

#include <algorithm>
#include <initializer_list>
#include <iterator>

#include <quoin/core/assert.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

std::string_view Entries::get(std::string_view key) const {
  const auto found = std::find_if(all_.rbegin(), all_.rend(), [&](const auto& entry) { return entry.first == key; });
  return found == all_.rend() ? std::string_view{} : std::string_view(found->second);
}

void Entries::set(std::string_view key, std::string value) {
  const auto found = std::find_if(all_.rbegin(), all_.rend(), [&](const auto& entry) { return entry.first == key; });
  if (found != all_.rend()) {
    found->second = std::move(value);
  } else {
    all_.emplace_back(key, std::move(value));
  }
}

void Entries::erase(std::string_view key) {
  std::erase_if(all_, [&](const auto& entry) { return entry.first == key; });
}

void Entries::set_or_erase(std::string_view key, const std::string& value) {
  if (value.empty()) {
    erase(key);
  } else {
    set(key, value);
  }
}

bool says_more(const NodeContent& node) {
  const auto has_others = [](const Entries& entries, std::initializer_list<std::string_view> known) {
    return std::ranges::any_of(entries.all(),
                               [&](const auto& entry) { return std::ranges::find(known, entry.first) == known.end(); });
  };
  return !node.tail.empty() || has_others(node.attributes, {"_name", "_hidden", "_loop"}) ||
         std::ranges::any_of(node.frames,
                             [&](const Entries& key) {
                               return has_others(key, {"_r", "_t", "_f"});
                             }) ||
         std::ranges::any_of(node.models, [&](const auto& key) { return has_others(key.second, {"_f"}); });
}

NodeContent read_node(NodeKind kind, std::span<const std::byte> content) {
  ChunkReader chunk(content, {}, 0, 0, content.size());
  NodeContent node;
  node.kind = kind;
  node.id = chunk.i32();
  node.attributes = Entries(chunk.dict());
  if (kind == NodeKind::Transform) {
    node.children.push_back(chunk.i32());
    node.reserved = chunk.i32();
    node.layer = chunk.i32();
  }
  const std::uint32_t count = chunk.u32();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (kind == NodeKind::Group) {
      node.children.push_back(chunk.i32());
    } else if (kind == NodeKind::Transform) {
      node.frames.emplace_back(chunk.dict());
    } else {
      const std::uint32_t model = chunk.u32();
      node.models.emplace_back(model, chunk.dict());
    }
  }
  QUOIN_ASSERT(!chunk.failed(), "a chunk that was read without an error");
  const std::span<const std::byte> tail = chunk.take(chunk.remaining());
  node.tail.assign(tail.begin(), tail.end());
  return node;
}

void write_node(const NodeContent& node, ChunkWriter& out) {
  out.i32(node.id);
  out.dict(node.attributes.all());
  switch (node.kind) {
    case NodeKind::Transform:
      QUOIN_ASSERT(node.children.size() == 1, "a transform with one child");
      out.i32(node.children.front());
      out.i32(node.reserved);
      out.i32(node.layer);
      out.u32(static_cast<std::uint32_t>(node.frames.size()));
      for (const Entries& frame : node.frames) out.dict(frame.all());
      break;
    case NodeKind::Group:
      out.u32(static_cast<std::uint32_t>(node.children.size()));
      for (const std::int32_t child : node.children) out.i32(child);
      break;
    case NodeKind::Shape:
      out.u32(static_cast<std::uint32_t>(node.models.size()));
      for (const auto& [model, attributes] : node.models) {
        out.u32(model);
        out.dict(attributes.all());
      }
      break;
  }
  out.raw(node.tail);
}

std::string_view chunk_id(NodeKind kind) {
  switch (kind) {
    case NodeKind::Transform:
      return "nTRN";
    case NodeKind::Group:
      return "nGRP";
    case NodeKind::Shape:
      return "nSHP";
  }
  return {};
}

NodeContent node_of(const VoxSource& source, std::size_t node) {
  QUOIN_ASSERT(node < source.document.nodes.size(), "a node of the source");
  const vox::Node& known = source.document.nodes[node];
  const auto& chunks = source.document.chunks;
  const auto at = std::ranges::lower_bound(chunks, known.offset, {}, &ChunkSpan::begin);
  QUOIN_ASSERT(at != chunks.end() && at->kind == ChunkKind::Node, "every node has its chunk");
  const std::span<const std::byte> file = source.bytes;
  return read_node(known.kind, file.subspan(at->begin + kChunkHeaderBytes, at->content_bytes));
}

void set_motion(Entries& key, const Motion& motion) {
  const Offset& t = motion.translation;
  const bool turns = motion.orientation != AxisOrientation{} || !key.get("_r").empty();
  const bool moves = t != Offset{0, 0, 0} || !key.get("_t").empty();
  if (turns) key.set("_r", std::to_string(byte_from_orientation(motion.orientation)));
  if (moves) key.set("_t", std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]));
}

Motion motion_of(const Entries& key) {
  const IVec3 moved = parse_translation(key.get("_t")).value_or(IVec3{0});
  return {parse_orientation(key.get("_r")).value_or(AxisOrientation{}), {moved.x, moved.y, moved.z}};
}

namespace {

template <class Key, class AttributesOf>
KeyInForce key_in_force(const std::vector<Key>& keys, bool loops, int frame, AttributesOf attributes_of) {
  QUOIN_ASSERT(!keys.empty(), "a node with keys");
  std::vector<std::pair<std::int64_t, std::size_t>> sorted;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    sorted.emplace_back(frame_of_key(attributes_of(keys[i]).get("_f"), i).value_or(0), i);
  }
  std::ranges::sort(sorted);
  KeyInForce found;
  found.frame = frame;
  if (loops) {
    const std::int64_t length = sorted.back().first - sorted.front().first + 1;
    found.frame = sorted.front().first + ((frame - sorted.front().first) % length + length) % length;
  }
  const auto after = std::ranges::upper_bound(sorted, found.frame, {}, [](const auto& key) { return key.first; });
  const auto& key = after == sorted.begin() ? *after : *std::prev(after);
  found.place = key.second;
  found.is_exact = key.first == found.frame;
  return found;
}

bool loops(const NodeContent& node) {
  return node.attributes.get("_loop") == "1";
}

}  // namespace

KeyInForce frame_in_force(const NodeContent& transform, int frame) {
  return key_in_force(transform.frames, loops(transform), frame,
                      [](const Entries& key) -> const Entries& { return key; });
}

KeyInForce model_in_force(const NodeContent& shape, int frame) {
  return key_in_force(shape.models, loops(shape), frame, [](const auto& key) -> const Entries& { return key.second; });
}

void set_motion_at(NodeContent& transform, int frame, const Motion& motion) {
  if (transform.frames.empty()) transform.frames.emplace_back();
  const KeyInForce key = frame_in_force(transform, frame);
  if (transform.frames.size() == 1 || key.is_exact) {
    set_motion(transform.frames[key.place], motion);
    return;
  }
  // Added at the end: keys without `_f` have their index as their frame.
  Entries& added = transform.frames.emplace_back();
  set_motion(added, motion);
  added.set("_f", std::to_string(key.frame));
}

}  // namespace quoin::vox
