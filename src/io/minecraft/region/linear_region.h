#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>

// Regions as LinearPaper and its relatives store them (.linear): all 1,024 chunks in one zstd stream.
// Source: https://github.com/xymb-endcrystalme/LinearRegionFileFormatTools. The most significant byte comes first.
//
//   uint64 magic; uint8 version (1 or 2); uint64 time; int8 level; uint16 chunks; uint32 bytes of the stream;
//   uint64 hash
//   the stream: 1,024 x (uint32 bytes, uint32 time), by z, then x; the NBT of the chunks in that order
//   uint64 magic

namespace quoin::minecraft {

/// A Linear region. Threads: any number at once.
/// Memory: the file and, once a chunk was read, all its chunks as NBT.
class LinearRegion {
 public:
  static constexpr std::size_t kDataOffset = 32;
  static constexpr std::size_t kChunks = 1024;

  /// Returns true if a file begins with the format's magic number.
  [[nodiscard]] static bool begins(std::span<const std::byte> beginning);
  /// Parses the header and the table of sizes. Requires: `begins(file)`.
  /// Errors: BadFormat, with the offset; Unsupported for other versions, and in builds without zstd; LimitExceeded for
  /// chunks of more than 64 MiB or 1 GiB in all.
  [[nodiscard]] static Result<std::unique_ptr<const LinearRegion>> parse(std::vector<std::byte> file);

  /// Requires: chunk < kChunks.
  [[nodiscard]] bool has(std::size_t chunk) const {
    QUOIN_ASSERT(chunk < kChunks, "a chunk of the table");
    return sizes_[chunk] != 0;
  }
  /// Returns the NBT of a chunk. Expands the stream at the first call. Requires: has(chunk).
  /// Errors: BadFormat, with the offset in the file.
  [[nodiscard]] Result<std::vector<std::byte>> read(std::size_t chunk) const;

 private:
  explicit LinearRegion(std::vector<std::byte> file) : file_(std::move(file)) {}
  void expand() const;

  std::vector<std::byte> file_;
  std::size_t stream_bytes_ = 0;
  std::array<std::uint32_t, kChunks> sizes_{};
  mutable std::once_flag once_;
  mutable Result<std::vector<std::byte>> expanded_{std::vector<std::byte>()};
};

}  // namespace quoin::minecraft
