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

/// Gzip (RFC 1952) and Zlib (RFC 1950) are two wrappings of the same compressed data, Deflate (RFC 1951).
enum class Compression : std::uint8_t { None, Gzip, Zlib, Deflate };

/// The bytes of a file from an offset to its end, in order, decompressed if they are a compressed stream.
///
/// Consecutive gzip members are one stream, as in the standard. Bytes after the last member, or after the end of a zlib
/// stream, are ignored.
/// Memory: zlib's window, for any stream. Offsets in errors are file offsets.
class ByteStream {
 public:
  /// Requires: `file` outlives the stream, begin <= file.size().
  ByteStream(std::span<const std::byte> file, std::size_t begin, Compression compression);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  /// Fills `out`, or less of it at the end of the stream; returns how many bytes were read.
  /// Errors: BadFormat when compressed data are damaged or cut off.
  [[nodiscard]] Result<std::size_t> read(std::span<std::byte> out);
  /// As `read`, without keeping the bytes; returns how many there were.
  [[nodiscard]] Result<std::uint64_t> skip(std::uint64_t count);

  /// The most bytes that the whole stream can give: exact without compression; 1,032 a byte with it, which deflate
  /// cannot exceed.
  [[nodiscard]] std::uint64_t max_bytes() const;
  /// The bytes left in the file itself.
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

/// The same bytes as one gzip stream (RFC 1952), `level` 0 (stored) to 9 (smallest). The same bytes give the same
/// stream. Requires: fewer than 2^31 of them.
[[nodiscard]] std::vector<std::byte> gzipped(std::span<const std::byte> bytes, int level);

/// The first bytes of a file, decompressed where it is a gzip stream: `most` of them, or all that there are.
[[nodiscard]] Result<std::vector<std::byte>> first_bytes(std::span<const std::byte> file, std::size_t most);

}  // namespace quoin
