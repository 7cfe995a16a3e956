#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>

namespace quoin::store {

/// Values written once, in order, and then read: in an unnamed temporary file, which is deleted with the object.
class Spool {
 public:
  Spool() = default;
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&& other) noexcept;
  ~Spool();

  /// Errors: CannotWrite (a full disk, a missing folder).
  [[nodiscard]] Status append(std::span<const std::byte> bytes, const std::filesystem::path& folder);
  template <class T>
  [[nodiscard]] Status append(const std::vector<T>& values, const std::filesystem::path& folder) {
    return append(std::as_bytes(std::span(values)), folder);
  }
  /// Ends writing; values can then be read. Errors: as `append`.
  [[nodiscard]] Status finish();

  /// Returns all values. Lifetime: as the spool. Requires: finished, and written as values of that type.
  template <class T>
  [[nodiscard]] std::span<const T> values() const {
    QUOIN_ASSERT(buffer_.empty() && (mapped_ != nullptr || written_ == 0), "a finished spool");
    QUOIN_ASSERT(written_ % sizeof(T) == 0, "whole values of this type");
    return {static_cast<const T*>(mapped_), static_cast<std::size_t>(written_) / sizeof(T)};
  }
  [[nodiscard]] std::uint64_t bytes() const { return written_ + buffer_.size(); }
  /// Releases the pages read from this process's memory; later accesses read them from the file again.
  void give_back() const;

 private:
  [[nodiscard]] Status write_buffer();

  int file_ = -1;
  std::vector<std::byte> buffer_;
  std::uint64_t written_ = 0;
  void* mapped_ = nullptr;
};

}  // namespace quoin::store
