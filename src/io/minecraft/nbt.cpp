#include "io/minecraft/nbt.h"

#include <string>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"

namespace quoin::nbt {

namespace {

template <class T>
T big(const std::byte* bytes) {
  return load<T>(bytes, std::endian::big);
}

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
    const std::size_t length = big<std::uint16_t>(bytes_.data() + at_);
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
    const auto count = big<std::int32_t>(bytes_.data() + at_);
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
      const std::uint32_t length = big<std::uint16_t>(bytes_.data() + at_);
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
  return {reinterpret_cast<const char*>(text), big<std::uint16_t>(text - 2)};
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
      return big<std::int16_t>(begin + 2 * i);
    case Tag::Int:
      return big<std::int32_t>(begin + 4 * i);
    case Tag::Long:
      return big<std::int64_t>(begin + 8 * i);
    default:
      return 0;
  }
}

std::optional<double> Value::number(std::size_t i) const {
  if (!is_number(element()) || i >= count()) return std::nullopt;
  const std::byte* const begin = document_->bytes_.data() + node().begin;
  if (element() == Tag::Float) return static_cast<double>(big<float>(begin + 4 * i));
  if (element() == Tag::Double) return big<double>(begin + 8 * i);
  return static_cast<double>(integer(i));
}

}  // namespace quoin::nbt
