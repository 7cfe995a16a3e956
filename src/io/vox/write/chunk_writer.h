#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"

namespace quoin::vox {

/// Builds the bytes of a .vox file.
class ChunkWriter : public ByteWriter {
 public:
  using Entries = std::vector<std::pair<std::string, std::string>>;

  void string(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size()));
    text(value);
  }
  void dict(const Entries& entries) {
    u32(static_cast<std::uint32_t>(entries.size()));
    for (const auto& [key, value] : entries) {
      string(key);
      string(value);
    }
  }

  /// Starts a chunk; writes until `end_chunk` are its content.
  [[nodiscard]] std::size_t begin_chunk(std::string_view id) {
    text(id);
    u32(0);
    u32(0);
    return size();
  }
  /// `begin`: the result of begin_chunk. Content beyond 4 GiB wraps: check `size` before using the bytes. `children`:
  /// bytes of child chunks after it.
  void end_chunk(std::size_t begin, std::size_t children = 0) {
    QUOIN_ASSERT(begin >= 12 && begin <= size(), "a chunk that was begun");
    patch(begin - 8, size() - begin);
    patch(begin - 4, children);
  }
};

}  // namespace quoin::vox
