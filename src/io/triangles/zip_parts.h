#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::triangles {

/// The files in a zip file, stored or compressed by deflate, found by the directory at its end.
/// Source: PKWARE, ".ZIP File Format Specification" 6.3.3. Lifetime: the bytes.
class ZipParts {
 public:
  /// Errors: BadFormat, with the offset; Unsupported for zip64 and files in several parts.
  [[nodiscard]] static Result<ZipParts> open(std::span<const std::byte> zip);

  /// The names as stored in the directory.
  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] bool has(const std::string& name) const { return entries_.contains(name); }
  /// Returns a file's content. Memory: its size, which is limited by its compressed bytes.
  /// Errors: BadFormat; Unsupported for other compressions and for encrypted files. Requires: has(name).
  [[nodiscard]] Result<std::vector<std::byte>> read(const std::string& name) const;

 private:
  struct Entry {
    std::uint32_t flags = 0;
    std::uint32_t method = 0;
    std::uint32_t packed = 0;
    std::uint32_t size = 0;
    std::uint32_t at = 0;
  };
  std::span<const std::byte> bytes_;
  std::map<std::string, Entry> entries_;
};

}  // namespace quoin::triangles
