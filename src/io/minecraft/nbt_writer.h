#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "io/minecraft/nbt.h"

namespace quoin::nbt {

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
