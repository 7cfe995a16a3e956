#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>

namespace quoin {

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

}  // namespace quoin
