#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::minecraft {

/// A long array of bytes in pages: a page of one value takes a byte.
class PagedBytes {
 public:
  static constexpr std::size_t kPageBytes = 4096;

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Bytes of pages of several values, which take memory.
  [[nodiscard]] std::uint64_t held_bytes() const { return held_bytes_; }
  /// Appends bytes. Requires: all calls before the last one append whole pages.
  void append(std::span<const std::byte> bytes);
  /// Requires: at < size().
  [[nodiscard]] std::byte operator[](std::uint64_t at) const {
    const Page& page = pages_[at / kPageBytes];
    return page.bytes ? page.bytes[at % kPageBytes] : page.value;
  }
  /// The value that all bytes of a range have; nothing where they differ. Cost: O(pages).
  /// Requires: begin < end <= size().
  [[nodiscard]] std::optional<std::byte> uniform(std::uint64_t begin, std::uint64_t end) const;

 private:
  struct Page {
    std::byte value{0};
    std::unique_ptr<std::byte[]> bytes{};  // NOLINT: null where all have the value
  };
  std::vector<Page> pages_;
  std::uint64_t size_ = 0;
  std::uint64_t held_bytes_ = 0;
};

/// A compressed NBT document without its longest arrays of bytes.
struct LargeNbt {
  std::vector<std::byte> bytes;  ///< the document; a long array has no elements in it
  /// The long arrays, by where the elements would begin in `bytes`.
  std::map<std::size_t, PagedBytes> arrays;
};

/// Reads a gzip stream of NBT, and puts apart the blocks and biomes of a Sponge schematic (BlockData, BiomeData, Data
/// of Blocks or Biomes) where they have 1 MiB or more. Memory: `max_bytes`, and 16 bytes per page.
/// Errors: BadFormat; LimitExceeded.
[[nodiscard]] Result<LargeNbt> read_large_nbt(std::span<const std::byte> gzip, std::size_t max_bytes);

}  // namespace quoin::minecraft
