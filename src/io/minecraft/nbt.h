#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>

// Named Binary Tag, the tree format of Minecraft saves: https://minecraft.wiki/w/NBT_format. Numbers are big-endian in
// the Java edition, and little-endian in files of the Bedrock edition.

namespace quoin::nbt {

enum class Tag : std::uint8_t {
  End = 0,
  Byte,
  Short,
  Int,
  Long,
  Float,
  Double,
  ByteArray,
  String,
  List,
  Compound,
  IntArray,
  LongArray,
};

/// The limits of a document; larger ones are rejected.
struct Limits {
  int depth = 512;  ///< nesting of lists and compounds, the game's limit
  std::size_t nodes = std::size_t{1} << 22;
  std::endian order = std::endian::big;
};

class Value;

/// A parsed document: the positions of its values in bytes that it does not own.
/// Memory: 32 bytes per value, except elements of arrays and of lists of numbers.
class Document {
 public:
  /// Requires: `bytes` outlives the document.
  /// Errors: BadFormat, LimitExceeded, with the offset in `bytes`.
  [[nodiscard]] static Result<Document> parse(std::span<const std::byte> bytes, const Limits& limits = {});

  /// Returns the root value, usually a compound.
  [[nodiscard]] Value root() const;
  /// Returns the size of the document in bytes; other bytes may follow it.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  friend class Value;
  friend class Parser;
  struct Node {
    Tag tag = Tag::End;
    Tag element = Tag::End;   // element tag of a list
    std::uint32_t name = 0;   // offset of its name, which follows its length; 0: no name
    std::uint32_t begin = 0;  // offset of the payload, after any count
    std::uint32_t count = 0;  // elements, or bytes of a string
    std::uint32_t next = 0;   // node after all that is in it
  };
  std::span<const std::byte> bytes_;
  std::endian order_ = std::endian::big;
  std::size_t size_ = 0;
  std::vector<Node> nodes_;
};

/// A value of a document, or none. Queries on none, or on a value of another kind, return none.
/// Lifetime: the document and its bytes must outlive it.
class Value {
 public:
  Value() = default;

  [[nodiscard]] Tag tag() const { return document_ != nullptr ? node().tag : Tag::End; }
  [[nodiscard]] explicit operator bool() const { return document_ != nullptr; }
  /// Returns its offset in the document's bytes.
  [[nodiscard]] std::size_t offset() const { return document_ != nullptr ? node().begin : 0; }
  [[nodiscard]] std::string_view name() const;

  /// Returns the value of that name in a compound.
  [[nodiscard]] Value operator[](std::string_view name) const;
  /// Calls `visit(Value)` for the values in a compound, or in a list of non-numbers, in order.
  template <class Visit>
  void for_each(Visit visit) const {
    if (tag() != Tag::Compound && tag() != Tag::List) return;
    for (std::uint32_t at = index_ + 1; at < node().next; at = document_->nodes_[at].next) visit(Value(document_, at));
  }

  /// Returns the value of a byte, short, int or long.
  [[nodiscard]] std::optional<std::int64_t> integer() const;
  /// Returns the value of a number of any type.
  [[nodiscard]] std::optional<double> number() const;
  /// Returns the value of a string: UTF-8, except for NUL and characters beyond 16 bits.
  [[nodiscard]] std::optional<std::string_view> text() const;
  /// Returns the number of elements of an array or a list.
  [[nodiscard]] std::size_t count() const;
  /// Returns the bytes of a byte array (or of a list of bytes).
  [[nodiscard]] std::span<const std::byte> bytes() const;
  /// Returns element `i` of an array, or of a list of integers. Requires: i < count(); is_integers().
  [[nodiscard]] std::int64_t integer(std::size_t i) const;
  [[nodiscard]] bool is_integers() const;
  /// Returns element `i` of a list of numbers of any type, or of an array.
  [[nodiscard]] std::optional<double> number(std::size_t i) const;
  /// Returns the raw words of a long array, in the byte order of the document; empty for other values.
  [[nodiscard]] std::span<const std::byte> long_bytes() const;

 private:
  friend class Document;
  Value(const Document* document, std::uint32_t index) : document_(document), index_(index) {}
  [[nodiscard]] const Document::Node& node() const {
    QUOIN_ASSERT(index_ < document_->nodes_.size(), "a value of the document");
    return document_->nodes_[index_];
  }
  [[nodiscard]] Tag element() const;

  const Document* document_ = nullptr;
  std::uint32_t index_ = 0;
};

/// Returns BadFormat at a value.
[[nodiscard]] inline Error fault(std::string what, Value at) {
  return make_error(ErrorCode::BadFormat, std::move(what), {}, at.offset());
}

/// Returns a compound's value of the first of these names that is present.
[[nodiscard]] inline Value first_of(Value compound, std::string_view name, std::string_view other) {
  const Value found = compound[name];
  return found ? found : compound[other];
}

/// Writes a document, value after value. Values in compounds have names; `begin` and `end` come in pairs.
class DocumentWriter {
 public:
  void begin(std::string_view name) { head(Tag::Compound, name); }
  void end() { put(0, 1); }
  void byte(std::string_view name, std::int8_t value) { number(Tag::Byte, name, value, 1); }
  void int16(std::string_view name, std::int16_t value) { number(Tag::Short, name, value, 2); }
  void int32(std::string_view name, std::int32_t value) { number(Tag::Int, name, value, 4); }
  void int64(std::string_view name, std::int64_t value) { number(Tag::Long, name, value, 8); }
  void string(std::string_view name, std::string_view value) {
    head(Tag::String, name);
    text(value);
  }
  void bytes(std::string_view name, std::span<const std::byte> values) {
    head(Tag::ByteArray, name);
    put(static_cast<std::int64_t>(values.size()), 4);
    bytes_.insert(bytes_.end(), values.begin(), values.end());
  }
  void ints(std::string_view name, std::span<const std::int32_t> values) {
    head(Tag::IntArray, name);
    put(static_cast<std::int64_t>(values.size()), 4);
    for (const std::int32_t value : values) put(value, 4);
  }
  /// Writes an empty list.
  void empty_list(std::string_view name) {
    head(Tag::List, name);
    put(0, 1);
    put(0, 4);
  }
  [[nodiscard]] const std::vector<std::byte>& document() const { return bytes_; }

 private:
  void put(std::int64_t value, int size) {
    for (int i = size - 1; i >= 0; --i) bytes_.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFF));
  }
  // At most 65,535 bytes.
  void text(std::string_view value) {
    constexpr std::size_t kLongest = 0xFFFF;
    value = value.substr(0, kLongest);
    put(static_cast<std::int64_t>(value.size()), 2);
    const auto characters = std::as_bytes(std::span(value));
    bytes_.insert(bytes_.end(), characters.begin(), characters.end());
  }
  void head(Tag tag, std::string_view name) {
    put(static_cast<std::int64_t>(tag), 1);
    text(name);
  }
  void number(Tag tag, std::string_view name, std::int64_t value, int size) {
    head(tag, name);
    put(value, size);
  }

  std::vector<std::byte> bytes_;
};

}  // namespace quoin::nbt

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
