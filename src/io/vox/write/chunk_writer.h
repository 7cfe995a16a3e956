#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace quoin::vox {

/// Builds the bytes of a .vox file.
class ChunkWriter {
 public:
  using Entries = std::vector<std::pair<std::string, std::string>>;

  /// Has room for so many bytes more, so that they are not moved as it grows.
  void reserve(std::size_t more) { bytes_.reserve(bytes_.size() + more); }
  void text(std::string_view text) { raw(std::as_bytes(std::span(text.data(), text.size()))); }
  void raw(std::span<const std::byte> bytes) {
    // Not `insert`, of which GCC 12 warns wrongly where it is inlined.
    const std::size_t at = bytes_.size();
    bytes_.resize(at + bytes.size());
    std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(at));
  }
  void u32(std::uint32_t value) {
    bytes_.resize(bytes_.size() + 4);
    patch(bytes_.size() - 4, value);
  }
  void i32(std::int32_t value) { u32(static_cast<std::uint32_t>(value)); }
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

  /// Starts a chunk; what follows until `end_chunk` is its content.
  [[nodiscard]] std::size_t begin_chunk(std::string_view id) {
    text(id);
    u32(0);
    u32(0);
    return bytes_.size();
  }
  /// `begin` is what begin_chunk gave. Content beyond 4 GiB wraps: ask `size` before trusting the bytes.
  /// `children`: bytes of other chunks that follow.
  void end_chunk(std::size_t begin, std::size_t children = 0) {
    patch(begin - 8, bytes_.size() - begin);
    patch(begin - 4, children);
  }

  /// Makes room for bytes that are written through `bytes` later.
  void leave(std::size_t count) { bytes_.resize(bytes_.size() + count); }
  [[nodiscard]] std::span<std::byte> bytes() { return bytes_; }

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

  /// Writes four bytes over those at `offset`.
  void patch(std::size_t offset, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes_[offset + i] = static_cast<std::byte>(value >> (8 * i) & 0xFFU);
  }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace quoin::vox
