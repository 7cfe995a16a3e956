#include "io/vox/write/node_content.h"

#include <algorithm>
#include <initializer_list>

#include "io/vox/chunk_reader.h"

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
  const std::span<const std::byte> tail = chunk.take(chunk.remaining());
  node.tail.assign(tail.begin(), tail.end());
  return node;
}

void write_node(const NodeContent& node, ChunkWriter& out) {
  out.i32(node.id);
  out.dict(node.attributes.all());
  switch (node.kind) {
    case NodeKind::Transform:
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

void set_motion(Entries& key, const Motion& motion) {
  const Offset& t = motion.translation;
  const bool turns = motion.orientation != Orientation{} || !key.get("_r").empty();
  const bool moves = t != Offset{0, 0, 0} || !key.get("_t").empty();
  if (turns) key.set("_r", std::to_string(byte_from_orientation(motion.orientation)));
  if (moves) key.set("_t", std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]));
}

Motion motion_of(const Entries& key) {
  const IVec3 moved = parse_translation(key.get("_t")).value_or(IVec3{0});
  return {parse_orientation(key.get("_r")).value_or(Orientation{}), {moved.x, moved.y, moved.z}};
}

}  // namespace quoin::vox
