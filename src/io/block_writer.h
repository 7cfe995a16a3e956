#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>

namespace quoin {

/// Collects small values in blocks of 1 MiB on their way to a file or to memory. After an error it ignores further
/// writes; `finish` returns the error.
class BlockWriter {
 public:
  using Sink = std::function<Status(std::span<const std::byte>)>;

  /// `expected_bytes`: the total that progress is relative to; 0 when unknown.
  BlockWriter(Sink sink, const Progress& progress, std::uint64_t expected_bytes)
      : sink_(std::move(sink)), progress_(progress), expected_bytes_(expected_bytes) {
    block_.resize(kBlockBytes);
  }

  /// Writes the value's bytes as they are in memory.
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= kBlockBytes);
    QUOIN_ASSERT(used_ <= kBlockBytes, "a position within the block");
    if (used_ + sizeof(T) > kBlockBytes) flush();
    std::memcpy(block_.data() + used_, &value, sizeof(T));
    used_ += sizeof(T);
  }

  void put(std::span<const std::byte> bytes);
  /// Reserves space for up to `most` bytes of text; `advance` sets the end of the written part.
  [[nodiscard]] char* room(std::size_t most) {
    QUOIN_ASSERT(most <= kBlockBytes, "text that fits a block");
    if (used_ + most > kBlockBytes) flush();
    return reinterpret_cast<char*>(block_.data() + used_);
  }
  void advance(const char* end) {
    const auto used = static_cast<std::size_t>(reinterpret_cast<const std::byte*>(end) - block_.data());
    QUOIN_ASSERT(used >= used_ && used <= kBlockBytes, "text within its room");
    used_ = used;
  }
  void put_text(std::string_view text) { put(std::as_bytes(std::span(text))); }
  /// Pads to a multiple of four bytes since the start.
  void align(char filler);

  /// Returns true if further writes are ignored; lets long loops end early.
  [[nodiscard]] bool failed() const { return !status_.has_value(); }
  [[nodiscard]] std::uint64_t bytes() const { return written_ + used_; }
  /// Errors: the sink's first error; Cancelled.
  [[nodiscard]] Status finish();

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

  void flush();

  Sink sink_;
  const Progress& progress_;
  std::uint64_t expected_bytes_;
  std::vector<std::byte> block_;
  std::size_t used_ = 0;
  std::uint64_t written_ = 0;
  Status status_;
};

}  // namespace quoin
