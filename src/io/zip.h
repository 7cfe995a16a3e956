#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>

namespace quoin {

/// Returns the CRC-32 of bytes, as zip files store it.
[[nodiscard]] std::uint32_t crc32_of(std::span<const std::byte> bytes);

/// Writes texts to a zip file one after another, compressed. The bytes are the same on every run.
///
/// Source: PKWARE, ".ZIP File Format Specification" 6.3.3. Memory: the compressed bytes.
class ZipFile {
 public:
  ZipFile();
  ~ZipFile();
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  /// Starts a file; later writes belong to it. Requires: the name is ASCII.
  void begin(std::string name);
  void put(std::string_view text);
  /// Returns the whole file. Errors: LimitExceeded if a file, or the whole, has 4 GiB or more.
  [[nodiscard]] Result<std::vector<std::byte>> take();

 private:
  struct Deflater;
  struct Entry {
    std::string name;
    std::uint32_t crc = 0;
    std::uint64_t size = 0;
    std::uint64_t at = 0;
    std::uint64_t packed = 0;
  };
  void end();

  std::vector<std::byte> bytes_;
  std::vector<Entry> entries_;
  std::unique_ptr<Deflater> deflater_;
};

/// The files in a zip file, stored or compressed by deflate, found by the directory at its end; zip64 too.
/// Source: PKWARE, ".ZIP File Format Specification" 6.3.3. Lifetime: the bytes.
class ZipParts {
 public:
  /// Errors: BadFormat, with the offset; Unsupported for files in several parts.
  [[nodiscard]] static Result<ZipParts> open(std::span<const std::byte> zip);

  /// The names as stored in the directory.
  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] bool has(std::string_view name) const { return entries_.contains(name); }
  /// The expanded size and CRC-32 of a file, as stored in the directory. Requires: has(name).
  struct Sum {
    std::uint64_t size = 0;
    std::uint32_t crc = 0;
  };
  [[nodiscard]] Sum sum_of(std::string_view name) const;
  /// Returns a file's content. Memory: its size, which is limited by its compressed bytes.
  /// Errors: BadFormat, also for a wrong checksum; Unsupported for other compressions and for encrypted files;
  ///         LimitExceeded if it expands to more than `max_bytes`, before it is expanded. Requires: has(name).
  [[nodiscard]] Result<std::vector<std::byte>> read(
      std::string_view name, std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max()) const;

 private:
  struct Entry {
    std::uint32_t flags = 0;
    std::uint32_t method = 0;
    std::uint32_t crc = 0;
    std::uint64_t packed = 0;
    std::uint64_t size = 0;
    std::uint64_t at = 0;
  };
  struct Directory;
  [[nodiscard]] static Result<Directory> find_directory(std::span<const std::byte> zip);

  std::span<const std::byte> bytes_;
  std::map<std::string, Entry, std::less<>> entries_;
};

}  // namespace quoin
