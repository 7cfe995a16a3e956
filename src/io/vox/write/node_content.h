#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/vox/chunks.h"
#include "io/vox/vox_reader.h"

namespace quoin::vox {

/// Keys and values of a DICT for editing: unchanged entries keep their positions and bytes.
class Entries {
 public:
  Entries() = default;
  explicit Entries(const Dict& dict) {
    for (const auto& [key, value] : dict.entries) all_.emplace_back(key, value);
  }

  /// Returns the last value of that key; empty if there is none.
  [[nodiscard]] std::string_view get(std::string_view key) const;
  /// Sets the last value of that key, or appends a new entry.
  void set(std::string_view key, std::string value);
  void erase(std::string_view key);
  /// Sets the key, or erases it if the value is empty.
  void set_or_erase(std::string_view key, const std::string& value);

  [[nodiscard]] const ChunkWriter::Entries& all() const { return all_; }

 private:
  ChunkWriter::Entries all_;
};

/// The complete content of a scene graph chunk for editing.
struct NodeContent {
  NodeKind kind = NodeKind::Group;
  std::int32_t id = 0;
  Entries attributes;
  std::int32_t reserved = -1;                             ///< transforms only
  std::int32_t layer = -1;                                ///< transforms only
  std::vector<std::int32_t> children;                     ///< one for a transform; any number for a group
  std::vector<Entries> frames;                            ///< transforms only, in the file's order
  std::vector<std::pair<std::uint32_t, Entries>> models;  ///< shapes only, in the file's order
  std::vector<std::byte> tail;                            ///< trailing bytes of the chunk
};

/// Requires: `content` belongs to a chunk of this kind, which `parse_document` has read without an error.
[[nodiscard]] NodeContent read_node(NodeKind kind, std::span<const std::byte> content);

/// Returns the content of a source node.
[[nodiscard]] NodeContent node_of(const VoxSource& source, std::size_t node);

/// Writes the content without a chunk header: the same bytes that read_node read.
void write_node(const NodeContent& node, ChunkWriter& out);
[[nodiscard]] std::string_view chunk_id(NodeKind kind);

/// Returns true if the node has content that a scene cannot hold, animation aside: attributes other than Quoin's, and
/// trailing bytes.
[[nodiscard]] bool says_more(const NodeContent& node);

/// Sets the motion of a transform key: `_r` and `_t`, each omitted if it is the identity and was absent.
/// Requires: the motion fits 32 bits.
void set_motion(Entries& key, const Motion& motion);
[[nodiscard]] Motion motion_of(const Entries& key);

/// The key of a node that applies at a frame, by its index in the file's order; `is_exact` if the key is at that frame.
struct KeyInForce {
  std::size_t place = 0;
  std::int64_t frame = 0;  ///< folded frame if the node loops
  bool is_exact = false;
};

/// Requires: the transform, or the shape, has a key.
[[nodiscard]] KeyInForce frame_in_force(const NodeContent& transform, int frame);
[[nodiscard]] KeyInForce model_in_force(const NodeContent& shape, int frame);

/// Sets a transform's motion at a frame: in its only key, in the key at that frame, or in a new key.
void set_motion_at(NodeContent& transform, int frame, const Motion& motion);

}  // namespace quoin::vox
