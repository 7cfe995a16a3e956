#include "io/minecraft/nbt.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "io/byte_stream.h"

namespace quoin::nbt {

namespace {

/// Returns the bytes of a number, or of an array's element; 0 for types of variable size.
std::size_t bytes_of(Tag tag) {
  switch (tag) {
    case Tag::Byte:
    case Tag::ByteArray:
      return 1;
    case Tag::Short:
      return 2;
    case Tag::Int:
    case Tag::Float:
    case Tag::IntArray:
      return 4;
    case Tag::Long:
    case Tag::Double:
    case Tag::LongArray:
      return 8;
    default:
      return 0;
  }
}

bool is_number(Tag tag) {
  return tag >= Tag::Byte && tag <= Tag::Double;
}

bool is_array(Tag tag) {
  return tag == Tag::ByteArray || tag == Tag::IntArray || tag == Tag::LongArray;
}

}  // namespace

class Parser {
 public:
  Parser(std::span<const std::byte> bytes, const Limits& limits) : bytes_(bytes), limits_(limits) {
    document_.bytes_ = bytes;
    document_.order_ = limits.order;
  }

  Result<Document> run() {
    constexpr std::size_t kMaxBytes = 0x7FFFFFFF;
    if (bytes_.size() > kMaxBytes) return make_error(ErrorCode::LimitExceeded, "the NBT data has more than 2 GiB");
    Status done = named_value(0, nullptr);
    if (!done) return done.error();
    document_.size_ = at_;
    return std::move(document_);
  }

 private:
  [[nodiscard]] Error fault(std::string what, std::size_t at) const {
    return make_error(ErrorCode::BadFormat, "NBT: " + std::move(what), {}, at);
  }
  [[nodiscard]] bool has(std::size_t count) const { return bytes_.size() - at_ >= count; }
  [[nodiscard]] Error cut_off() const { return fault("cut off", bytes_.size()); }

  Result<Tag> tag() {
    if (!has(1)) return cut_off();
    const auto tag = std::to_integer<std::uint8_t>(bytes_[at_]);
    if (tag > static_cast<std::uint8_t>(Tag::LongArray)) return fault("unknown tag " + std::to_string(tag), at_);
    ++at_;
    return static_cast<Tag>(tag);
  }

  Result<std::uint32_t> add(Tag tag) {
    if (document_.nodes_.size() >= limits_.nodes) {
      return make_error(ErrorCode::LimitExceeded, "NBT: more than " + std::to_string(limits_.nodes) + " values", {},
                        at_);
    }
    document_.nodes_.emplace_back().tag = tag;
    return static_cast<std::uint32_t>(document_.nodes_.size() - 1);
  }

  // Reads a tag, a name and a payload; sets `is_end`, unless null, at the end of a compound.
  Status named_value(int depth, bool* is_end) {
    const auto kind = tag();
    if (!kind) return kind.error();
    if (*kind == Tag::End) {
      if (is_end == nullptr) return fault("no content", at_ - 1);
      *is_end = true;
      return {};
    }
    if (!has(2)) return cut_off();
    const std::size_t length = load<std::uint16_t>(bytes_.data() + at_, limits_.order);
    at_ += 2;
    if (!has(length)) return cut_off();
    const auto index = add(*kind);
    if (!index) return index.error();
    document_.nodes_[*index].name = static_cast<std::uint32_t>(at_);
    at_ += length;
    return payload(*index, depth);
  }

  Result<std::uint32_t> count() {
    if (!has(4)) return cut_off();
    const auto count = load<std::int32_t>(bytes_.data() + at_, limits_.order);
    if (count < 0) return fault("invalid length " + std::to_string(count), at_);
    at_ += 4;
    return static_cast<std::uint32_t>(count);
  }

  Status payload(std::uint32_t index, int depth) {
    const Tag kind = document_.nodes_[index].tag;
    Status done;
    if (is_number(kind)) {
      done = flat(index, 1, bytes_of(kind));
    } else if (is_array(kind)) {
      const auto elements = count();
      if (!elements) return elements.error();
      done = flat(index, *elements, bytes_of(kind));
    } else if (kind == Tag::String) {
      if (!has(2)) return cut_off();
      const std::uint32_t length = load<std::uint16_t>(bytes_.data() + at_, limits_.order);
      at_ += 2;
      done = flat(index, length, 1);
    } else {
      if (depth >= limits_.depth) {
        return make_error(ErrorCode::LimitExceeded,
                          "NBT: nested deeper than " + std::to_string(limits_.depth) + " levels", {}, at_);
      }
      done = kind == Tag::List ? list(index, depth + 1) : compound(index, depth + 1);
    }
    document_.nodes_[index].next = static_cast<std::uint32_t>(document_.nodes_.size());
    return done;
  }

  Status flat(std::uint32_t index, std::uint32_t elements, std::size_t bytes) {
    if (!has(elements * bytes)) return cut_off();
    document_.nodes_[index].begin = static_cast<std::uint32_t>(at_);
    document_.nodes_[index].count = elements;
    at_ += elements * bytes;
    return {};
  }

  Status list(std::uint32_t index, int depth) {
    const auto element = tag();
    if (!element) return element.error();
    const auto elements = count();
    if (!elements) return elements.error();
    document_.nodes_[index].element = *element;
    if (is_number(*element)) return flat(index, *elements, bytes_of(*element));
    document_.nodes_[index].begin = static_cast<std::uint32_t>(at_);
    document_.nodes_[index].count = *elements;
    if (*element == Tag::End) {
      return *elements == 0 ? Status() : fault("a list of " + std::to_string(*elements) + " End tags", at_ - 4);
    }
    for (std::uint32_t i = 0; i < *elements; ++i) {
      const auto child = add(*element);
      if (!child) return child.error();
      if (auto done = payload(*child, depth); !done) return done;
    }
    return {};
  }

  Status compound(std::uint32_t index, int depth) {
    document_.nodes_[index].begin = static_cast<std::uint32_t>(at_);
    for (bool is_end = false; !is_end;) {
      if (auto done = named_value(depth, &is_end); !done) return done;
      document_.nodes_[index].count += is_end ? 0U : 1U;
    }
    return {};
  }

  std::span<const std::byte> bytes_;
  Limits limits_;
  std::size_t at_ = 0;
  Document document_;
};

Result<Document> Document::parse(std::span<const std::byte> bytes, const Limits& limits) {
  return Parser(bytes, limits).run();
}

Value Document::root() const {
  return nodes_.empty() ? Value() : Value(this, 0);
}

std::string_view Value::name() const {
  if (document_ == nullptr || node().name == 0) return {};
  const std::byte* const text = document_->bytes_.data() + node().name;
  return {reinterpret_cast<const char*>(text), load<std::uint16_t>(text - 2, document_->order_)};
}

Value Value::operator[](std::string_view name) const {
  if (tag() != Tag::Compound) return {};
  for (std::uint32_t at = index_ + 1; at < node().next; at = document_->nodes_[at].next) {
    const Value value(document_, at);
    if (value.name() == name) return value;
  }
  return {};
}

std::optional<std::int64_t> Value::integer() const {
  const Tag kind = tag();
  if (kind != Tag::Byte && kind != Tag::Short && kind != Tag::Int && kind != Tag::Long) return std::nullopt;
  return integer(0);
}

std::optional<double> Value::number() const {
  return is_number(tag()) ? number(0) : std::nullopt;
}

std::optional<std::string_view> Value::text() const {
  if (tag() != Tag::String) return std::nullopt;
  return std::string_view(reinterpret_cast<const char*>(document_->bytes_.data() + node().begin), node().count);
}

std::size_t Value::count() const {
  return document_ != nullptr ? node().count : 0;
}

Tag Value::element() const {
  switch (tag()) {
    case Tag::ByteArray:
      return Tag::Byte;
    case Tag::IntArray:
      return Tag::Int;
    case Tag::LongArray:
      return Tag::Long;
    case Tag::List:
      return node().element;
    default:
      return tag();
  }
}

std::span<const std::byte> Value::bytes() const {
  if ((!is_array(tag()) && tag() != Tag::List) || element() != Tag::Byte) return {};
  return document_->bytes_.subspan(node().begin, node().count);
}

std::span<const std::byte> Value::long_bytes() const {
  if (tag() != Tag::LongArray) return {};
  return document_->bytes_.subspan(node().begin, std::size_t{node().count} * 8);
}

bool Value::is_integers() const {
  const Tag kind = element();
  return (is_array(tag()) || tag() == Tag::List) && kind >= Tag::Byte && kind <= Tag::Long;
}

std::int64_t Value::integer(std::size_t i) const {
  QUOIN_ASSERT(document_ != nullptr && i < node().count, "an element of an array or a list");
  const std::byte* const begin = document_->bytes_.data() + node().begin;
  switch (element()) {
    case Tag::Byte:
      return static_cast<std::int8_t>(begin[i]);
    case Tag::Short:
      return load<std::int16_t>(begin + 2 * i, document_->order_);
    case Tag::Int:
      return load<std::int32_t>(begin + 4 * i, document_->order_);
    case Tag::Long:
      return load<std::int64_t>(begin + 8 * i, document_->order_);
    default:
      return 0;
  }
}

std::optional<double> Value::number(std::size_t i) const {
  if (!is_number(element()) || i >= count()) return std::nullopt;
  const std::byte* const begin = document_->bytes_.data() + node().begin;
  if (element() == Tag::Float) return static_cast<double>(load<float>(begin + 4 * i, document_->order_));
  if (element() == Tag::Double) return load<double>(begin + 8 * i, document_->order_);
  return static_cast<double>(integer(i));
}

}  // namespace quoin::nbt

namespace quoin::minecraft {

namespace {

using nbt::Tag;

constexpr std::size_t kLeastLong = std::size_t{1} << 20;
constexpr int kMaxDepth = 512;

bool is_uniform(std::span<const std::byte> bytes) {
  QUOIN_ASSERT(!bytes.empty(), "at least one byte");
  return std::memcmp(bytes.data(), bytes.data() + 1, bytes.size() - 1) == 0;
}

/// Returns the bytes of a number, or of an array's element; 0 for tags without a fixed size.
std::size_t bytes_of_tag(Tag tag) {
  constexpr std::array<std::size_t, 13> kBytes = {0, 1, 2, 4, 8, 4, 8, 1, 0, 0, 0, 4, 8};
  return kBytes.at(static_cast<std::size_t>(tag));
}

/// Walks through a document and copies it.
class Walker {
 public:
  Walker(std::span<const std::byte> gzip, std::size_t max_bytes)
      : stream_(gzip, 0, Compression::Gzip), max_bytes_(max_bytes), buffer_(kBufferBytes) {}

  Result<LargeNbt> run() {
    if (auto done = walk_named({}, 0); !done) return done.error();
    return std::move(out_);
  }

 private:
  [[nodiscard]] Error cut_off() const {
    return make_error(ErrorCode::BadFormat, "NBT: cut off", {}, stream_.position());
  }
  [[nodiscard]] Error too_much() const {
    return make_error(ErrorCode::LimitExceeded, "expands to more than " + std::to_string(max_bytes_) + " bytes", {},
                      stream_.position());
  }
  Status fill() {
    const auto count = stream_.read(buffer_);
    if (!count) return count.error();
    at_ = 0;
    end_ = *count;
    return end_ == 0 ? Status(cut_off()) : Status();
  }
  /// Copies bytes to the document.
  Status copy(std::uint64_t count) {
    if (held_bytes_ + out_.bytes.size() > max_bytes_ || count > max_bytes_ - out_.bytes.size()) return too_much();
    while (count > 0) {
      if (at_ == end_) {
        if (auto filled = fill(); !filled) return filled;
      }
      const auto now = static_cast<std::size_t>(std::min<std::uint64_t>(count, end_ - at_));
      const auto first = buffer_.begin() + static_cast<std::ptrdiff_t>(at_);
      out_.bytes.insert(out_.bytes.end(), first, first + static_cast<std::ptrdiff_t>(now));
      at_ += now;
      count -= now;
    }
    return {};
  }
  /// Copies a number to the end of the document.
  template <class T>
  Result<T> number() {
    if (auto copied = copy(sizeof(T)); !copied) return copied.error();
    return load<T>(out_.bytes.data() + out_.bytes.size() - sizeof(T), std::endian::big);
  }
  Result<std::uint32_t> count() {
    const auto count = number<std::int32_t>();
    if (!count) return count.error();
    if (*count < 0) {
      return make_error(ErrorCode::BadFormat, "NBT: invalid length " + std::to_string(*count), {}, stream_.position());
    }
    return static_cast<std::uint32_t>(*count);
  }
  Result<Tag> tag() {
    const auto tag = number<std::uint8_t>();
    if (!tag) return tag.error();
    if (*tag <= static_cast<std::uint8_t>(Tag::LongArray)) return static_cast<Tag>(*tag);
    return make_error(ErrorCode::BadFormat, "NBT: unknown tag " + std::to_string(*tag), {}, stream_.position());
  }
  Result<std::string> text() {
    const auto length = number<std::uint16_t>();
    if (!length) return length.error();
    if (auto copied = copy(*length); !copied) return copied.error();
    const auto* const first = reinterpret_cast<const char*>(out_.bytes.data() + out_.bytes.size() - *length);
    return std::string(first, *length);
  }

  /// A tag, a name and a payload. Returns false for the end of a compound.
  Result<bool> walk_named(const std::string& parent, int depth) {
    const auto kind = tag();
    if (!kind) return kind.error();
    if (*kind == Tag::End) return false;
    const auto name = text();
    if (!name) return name.error();
    const bool is_data =
        *name == "BlockData" || *name == "BiomeData" || (*name == "Data" && (parent == "Blocks" || parent == "Biomes"));
    if (*kind == Tag::ByteArray && is_data) {
      if (auto done = walk_long_array(); !done) return done.error();
      return true;
    }
    if (auto done = walk_payload(*kind, *name, depth); !done) return done.error();
    return true;
  }

  Status walk_payload(Tag kind, const std::string& name, int depth) {
    if (depth >= kMaxDepth) return make_error(ErrorCode::LimitExceeded, "NBT: nested deeper than 512 levels");
    if (kind == Tag::String) {
      const auto read = text();
      return read ? Status() : Status(read.error());
    }
    if (kind == Tag::Compound) {
      for (;;) {
        const auto more = walk_named(name, depth + 1);
        if (!more) return more.error();
        if (!*more) return {};
      }
    }
    if (kind == Tag::List) return walk_list(depth);
    const bool is_array = kind == Tag::ByteArray || kind == Tag::IntArray || kind == Tag::LongArray;
    const auto elements = is_array ? count() : Result<std::uint32_t>(1U);
    if (!elements) return elements.error();
    return copy(std::uint64_t{*elements} * bytes_of_tag(kind));
  }

  Status walk_list(int depth) {
    const auto element = tag();
    if (!element) return element.error();
    const auto elements = count();
    if (!elements) return elements.error();
    const bool is_number = *element >= Tag::Byte && *element <= Tag::Double;
    if (is_number) return copy(std::uint64_t{*elements} * bytes_of_tag(*element));
    if (*element == Tag::End) return {};  // the parser reports the mistake
    for (std::uint32_t i = 0; i < *elements; ++i) {
      if (auto done = walk_payload(*element, {}, depth + 1); !done) return done;
    }
    return {};
  }

  /// Stores a long array separately; the document gets length 0 for it.
  Status walk_long_array() {
    const auto elements = count();
    if (!elements) return elements.error();
    if (*elements < kLeastLong) return copy(*elements);
    std::fill_n(out_.bytes.end() - 4, 4, std::byte{0});
    PagedBytes& array = out_.arrays[out_.bytes.size()];
    std::vector<std::byte> pages(kBufferBytes);
    for (std::uint64_t left = *elements; left > 0;) {
      const auto now = static_cast<std::size_t>(std::min<std::uint64_t>(left, pages.size()));
      const std::size_t held = std::min(now, end_ - at_);
      std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(at_), held, pages.begin());
      at_ += held;
      const auto read = stream_.read(std::span(pages).subspan(held, now - held));
      if (!read) return read.error();
      if (*read < now - held) return cut_off();
      const std::uint64_t held_before = array.held_bytes();
      array.append(std::span(pages).first(now));
      held_bytes_ += array.held_bytes() - held_before;
      if (held_bytes_ > max_bytes_) return too_much();
      left -= now;
    }
    return {};
  }

  static constexpr std::size_t kBufferBytes = 64 * PagedBytes::kPageBytes;
  ByteStream stream_;
  std::size_t max_bytes_;
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0;
  std::size_t end_ = 0;
  std::uint64_t held_bytes_ = 0;  // memory of pages
  LargeNbt out_;
};

/// Returns the bytes of a page with so many bits per byte, including its values.
std::size_t bytes_of_page(std::uint8_t bits) {
  QUOIN_ASSERT(bits == 1 || bits == 2 || bits == 4 || bits == 8, "1, 2, 4 or 8 bits");
  if (bits == 8) return PagedBytes::kPageBytes;
  return (std::size_t{1} << bits) + PagedBytes::kPageBytes * bits / 8;
}

/// The distinct values of a page in order of occurrence, as far as 4 bits can number them.
struct PageValues {
  static constexpr std::size_t kMost = 16;
  std::array<std::byte, kMost> values{};
  std::size_t count = 0;  ///< kMost + 1: more values

  explicit PageValues(std::span<const std::byte> content) {
    constexpr std::size_t kStep = 64;
    for (std::size_t at = 0; at < content.size() && count <= kMost; at += kStep) {
      const auto some = content.subspan(at, std::min(kStep, content.size() - at));
      if (count > 0 && count <= 4 && are_first_four(some)) continue;
      for (const std::byte value : some) {
        const auto known = std::span(values).first(std::min(count, kMost));
        if (std::ranges::find(known, value) != known.end()) continue;
        if (++count > kMost) break;
        values[count - 1] = value;
      }
    }
  }
  [[nodiscard]] std::uint8_t bits() const { return count <= 2 ? 1 : count <= 4 ? 2 : count <= kMost ? 4 : 8; }
  /// Writes for each byte the number of its value.
  void number(std::span<const std::byte> content, PagedBytes::PageContent& out) const {
    QUOIN_ASSERT(count <= kMost && content.size() <= out.size(), "at most 16 values, and room for their numbers");
    if (count <= 4) {
      for (std::size_t i = 0; i < content.size(); ++i) {
        const std::byte value = content[i];
        const int number = value == values[0] ? 0 : value == values[1] ? 1 : value == values[2] ? 2 : 3;
        out[i] = static_cast<std::byte>(number);
      }
      return;
    }
    std::array<std::byte, 256> number_of{};
    for (std::size_t i = 0; i < count; ++i) number_of[std::to_integer<std::size_t>(values[i])] = std::byte(i);
    for (std::size_t i = 0; i < content.size(); ++i) out[i] = number_of[std::to_integer<std::size_t>(content[i])];
  }

 private:
  /// Returns true if all bytes are among the values so far. Requires: 0 < count <= 4.
  [[nodiscard]] bool are_first_four(std::span<const std::byte> some) const {
    QUOIN_ASSERT(count > 0 && count <= 4, "0 < count <= 4");
    const auto value = [&](std::size_t i) { return values[i < count ? i : 0]; };
    const std::array<std::byte, 4> four = {value(0), value(1), value(2), value(3)};
    unsigned others = 0;
    for (const std::byte b : some) {
      const auto differs = [&](std::size_t i) { return static_cast<unsigned>(b != four[i]); };
      others |= differs(0) & differs(1) & differs(2) & differs(3);
    }
    return others == 0;
  }
};

/// Unpacks numbers of `bits` each, the lowest first, and replaces them by their values.
template <unsigned bits>
void unpack(const std::byte* values, PagedBytes::PageContent& out) {
  constexpr std::size_t kEach = 8 / bits;
  const std::byte* const packed = values + (std::size_t{1} << bits);
  for (std::size_t i = 0; i < out.size(); i += kEach) {
    auto rest = std::to_integer<unsigned>(packed[i / kEach]);
    for (std::size_t k = 0; k < kEach; ++k, rest >>= bits) out[i + k] = values[rest & ((1U << bits) - 1)];
  }
}

}  // namespace

PagedBytes::Page PagedBytes::packed(std::span<const std::byte> content) {
  QUOIN_ASSERT(!content.empty() && content.size() <= kPageBytes, "the bytes of a page");
  Page page;
  page.value = content.front();
  if (is_uniform(content)) return page;
  const PageValues values(content);
  page.bits = values.bits();
  page.bytes = std::make_unique<std::byte[]>(bytes_of_page(page.bits));  // NOLINT
  if (page.bits == 8) {
    std::ranges::copy(content, page.bytes.get());
    return page;
  }
  std::byte* const packed = std::copy_n(values.values.begin(), std::size_t{1} << page.bits, page.bytes.get());
  PageContent numbers{};
  values.number(content, numbers);
  const std::size_t each = 8U / page.bits;
  for (std::size_t i = 0; i < content.size(); i += each) {
    unsigned byte = 0;
    for (std::size_t k = 0; k < each; ++k) byte |= std::to_integer<unsigned>(numbers[i + k]) << (k * page.bits);
    packed[i / each] = static_cast<std::byte>(byte);
  }
  return page;
}

void PagedBytes::read_page(std::size_t number, PageContent& out) const {
  QUOIN_ASSERT(number < pages_.size(), "a page of the array");
  const Page& page = pages_[number];
  switch (page.bits) {
    case 0:
      out.fill(page.value);
      break;
    case 1:
      unpack<1>(page.bytes.get(), out);
      break;
    case 2:
      unpack<2>(page.bytes.get(), out);
      break;
    case 4:
      unpack<4>(page.bytes.get(), out);
      break;
    default:
      std::copy_n(page.bytes.get(), kPageBytes, out.begin());
  }
}

void PagedBytes::append(std::span<const std::byte> bytes) {
  QUOIN_ASSERT(size_ % kPageBytes == 0, "whole pages before");
  for (std::size_t at = 0; at < bytes.size(); at += kPageBytes) {
    const std::span<const std::byte> content = bytes.subspan(at, std::min(kPageBytes, bytes.size() - at));
    Page page = packed(content);
    held_bytes_ += page.bits == 0 ? 0 : bytes_of_page(page.bits);
    pages_.push_back(std::move(page));
  }
  size_ += bytes.size();
}

std::optional<std::byte> PagedBytes::uniform(std::uint64_t begin, std::uint64_t end) const {
  QUOIN_ASSERT(begin < end && end <= size_, "a range of the array");
  std::optional<std::byte> value;
  PageContent content;
  for (std::uint64_t at = begin; at < end;) {
    const std::uint64_t page_end = std::min(end, (at / kPageBytes + 1) * kPageBytes);
    const std::size_t page = at / kPageBytes;
    std::optional<std::byte> found = uniform_page(page);
    if (!found) {
      read_page(page, content);
      const auto part = std::span(content).subspan(at % kPageBytes, static_cast<std::size_t>(page_end - at));
      if (!is_uniform(part)) return std::nullopt;
      found = part.front();
    }
    if (value && *value != *found) return std::nullopt;
    value = found;
    at = page_end;
  }
  return value;
}

Result<LargeNbt> read_large_nbt(std::span<const std::byte> gzip, std::size_t max_bytes) {
  return Walker(gzip, max_bytes).run();
}

}  // namespace quoin::minecraft
