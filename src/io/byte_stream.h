#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/result.h>

namespace quoin {

/// Returns true if the bytes begin with a gzip header (RFC 1952).
[[nodiscard]] bool begins_gzip(std::span<const std::byte> bytes);

/// Gzip (RFC 1952) and Zlib (RFC 1950) wrap the same compressed data, Deflate (RFC 1951).
enum class Compression : std::uint8_t { None, Gzip, Zlib, Deflate };

/// Reads the bytes of a file from an offset to its end, decompressing them if they are a compressed stream.
/// Consecutive gzip members are one stream, as in the standard. Bytes after the last member, or after the end of a zlib
/// stream, are ignored.
/// Memory: zlib's window. Offsets in errors are file offsets.
class ByteStream {
 public:
  /// Requires: `file` outlives the stream, begin <= file.size().
  ByteStream(std::span<const std::byte> file, std::size_t begin, Compression compression);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  /// Fills `out`, or part of it at the end of the stream. Returns the number of bytes read.
  /// Errors: BadFormat if compressed data is damaged or cut off.
  [[nodiscard]] Result<std::size_t> read(std::span<std::byte> out);
  /// Reads like `read` but discards the bytes. Returns their number.
  [[nodiscard]] Result<std::uint64_t> skip(std::uint64_t count);

  /// Returns the maximum size of the whole stream: exact without compression, else 1,032 bytes per compressed byte, the
  /// limit of deflate.
  [[nodiscard]] std::uint64_t max_bytes() const;
  /// Returns the number of bytes left in the file itself.
  [[nodiscard]] std::size_t remaining() const { return file_.size() - position_; }
  /// Returns the file offset of the next byte.
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] bool is_compressed() const { return inflater_ != nullptr; }
  /// Returns true if the last read failed because compressed data are truncated, not because they are damaged.
  [[nodiscard]] bool is_cut_off() const { return is_cut_off_; }

 private:
  struct Inflater;
  [[nodiscard]] Result<std::size_t> inflate_some(std::span<std::byte> out);
  [[nodiscard]] Status begin_next_member();

  std::span<const std::byte> file_;
  std::size_t begin_;
  std::size_t position_;
  bool is_cut_off_ = false;
  std::unique_ptr<Inflater> inflater_;
};

/// Returns the bytes as one gzip stream (RFC 1952). `level`: 0 (stored) to 9 (smallest). Equal bytes give equal
/// streams. Requires: fewer than 2^31 bytes.
[[nodiscard]] std::vector<std::byte> gzipped(std::span<const std::byte> bytes, int level);

/// Returns the first `most` bytes of a file, or all of it if shorter. Decompresses gzip streams.
[[nodiscard]] Result<std::vector<std::byte>> first_bytes(std::span<const std::byte> file, std::size_t most);

}  // namespace quoin
