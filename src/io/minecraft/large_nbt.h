#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>

namespace quoin::minecraft {

/// A long array of bytes in pages. A page of one value takes no memory of its own; pages of 2, 4 or 16 values have 1, 2
/// or 4 bits per byte.
class PagedBytes {
 public:
  static constexpr std::size_t kPageBytes = 4096;
  using PageContent = std::array<std::byte, kPageBytes>;

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Returns the memory of pages with several values, in bytes.
  [[nodiscard]] std::uint64_t held_bytes() const { return held_bytes_; }
  /// Appends bytes. Requires: each call except the last appends whole pages.
  void append(std::span<const std::byte> bytes);
  /// Returns the common value of a page's bytes; nullopt if they differ. Requires: page * kPageBytes < size().
  [[nodiscard]] std::optional<std::byte> uniform_page(std::size_t page) const {
    QUOIN_ASSERT(page < pages_.size(), "a page of the array");
    return pages_[page].bits == 0 ? std::optional(pages_[page].value) : std::nullopt;
  }
  /// Writes the bytes of a page. Bytes past the end of the array are unspecified. Requires: as uniform_page.
  void read_page(std::size_t page, PageContent& out) const;
  /// Returns the common value of a range's bytes; nullopt if they differ. Cost: O(pages).
  /// Requires: begin < end <= size().
  [[nodiscard]] std::optional<std::byte> uniform(std::uint64_t begin, std::uint64_t end) const;

 private:
  struct Page {
    std::byte value{0};
    std::uint8_t bits = 0;                 // per byte; 0: all have the value
    std::unique_ptr<std::byte[]> bytes{};  // NOLINT: with less than 8 bits the values, then numbers of these
  };
  [[nodiscard]] static Page packed(std::span<const std::byte> content);

  std::vector<Page> pages_;
  std::uint64_t size_ = 0;
  std::uint64_t held_bytes_ = 0;
};

/// A compressed NBT document without its longest arrays of bytes.
struct LargeNbt {
  std::vector<std::byte> bytes;  ///< the document; a long array has no elements in it
  /// The long arrays, by the offset in `bytes` where their elements would begin.
  std::map<std::size_t, PagedBytes> arrays;
};

/// Reads a gzip stream of NBT, and separates the blocks and biomes of a Sponge schematic (BlockData, BiomeData, Data of
/// Blocks or Biomes) if they have 1 MiB or more. Memory: `max_bytes`, and 16 bytes per page.
/// Errors: BadFormat; LimitExceeded.
[[nodiscard]] Result<LargeNbt> read_large_nbt(std::span<const std::byte> gzip, std::size_t max_bytes);

}  // namespace quoin::minecraft
