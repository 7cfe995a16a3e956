#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>

// Files of 32 x 32 chunks: Anvil (.mca) and McRegion (.mcr), https://minecraft.wiki/w/Region_file_format, and Linear
// (.linear).
//
//   1,024 x (uint24 first sector, uint8 sectors), by z, then x; 1,024 x uint32 times; sectors of 4,096 bytes
//   a chunk: uint32 bytes after it; uint8 compression (| 128: in the sidecar file c.X.Z.mcc); the compressed NBT
//
// A Linear file, of LinearPaper and its relatives: all 1,024 chunks in one zstd stream.
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

/// Expands a stream of blocks written by Java's LZ4BlockOutputStream: "LZ4Block", a byte (16: uncompressed, 32:
/// compressed; its lower bits are the level), three uint32 with the least significant byte first (compressed bytes,
/// bytes, checksum), the block. The last block is empty. Checksums are not verified.
///
/// Errors: BadFormat, with the offset; LimitExceeded beyond `max_bytes`; Unsupported in builds without LZ4.
[[nodiscard]] Result<std::vector<std::byte>> expand_lz4_blocks(std::span<const std::byte> bytes, std::size_t max_bytes);

inline constexpr int kRegionEdge = 32;
/// The maximum decompressed bytes of a chunk; the game's have some 100,000.
inline constexpr std::size_t kMaxChunkBytes = std::size_t{64} << 20;

/// Decompresses the NBT of a chunk, or of a whole file.
enum class ChunkCompression : std::uint8_t { Gzip = 1, Zlib = 2, None = 3, Lz4 = 4 };
/// Errors: BadFormat, with the offset in `bytes`; LimitExceeded beyond `max_bytes`; Unsupported for other numbers, and
/// for LZ4 in builds without it.
[[nodiscard]] Result<std::vector<std::byte>> decompress(std::span<const std::byte> bytes, std::uint8_t compression,
                                                        std::size_t max_bytes);
/// Decompresses an NBT file, detecting gzip, zlib and plain NBT. Errors: as `decompress`.
[[nodiscard]] Result<std::vector<std::byte>> decompress_file(std::span<const std::byte> bytes, std::size_t max_bytes);

enum class RegionKind : std::uint8_t { Anvil, Linear, McRegion };

/// Parses the region coordinates in a file name: (x, z) of "r.X.Z.mca", after any prefix.
struct RegionName {
  int x = 0;
  int z = 0;
  RegionKind kind = RegionKind::Anvil;
};
[[nodiscard]] std::optional<RegionName> parse_region_name(const std::filesystem::path& path);

/// Returns true if a file that begins with these bytes is a region: a Linear file, or a table whose entries mostly
/// refer to possible sectors, with chunks in most of the sectors within the bytes. A few damaged entries are accepted.
/// Returns false for a region without chunks.
[[nodiscard]] bool is_region_file(std::span<const std::byte> beginning);

/// A region that is open for reading. Threads: any number at once.
class RegionFile {
 public:
  /// Errors: CannotRead; BadFormat if the file is shorter than its table.
  [[nodiscard]] static Result<std::unique_ptr<RegionFile>> open(const std::filesystem::path& path, RegionName name);
  /// Opens the bytes of a file, which are copied. Chunks in sidecar files are not found.
  [[nodiscard]] static Result<std::unique_ptr<RegionFile>> of(std::span<const std::byte> bytes);
  RegionFile(const RegionFile&) = delete;
  RegionFile& operator=(const RegionFile&) = delete;
  ~RegionFile();

  /// Returns true if the chunk exists. Requires: 0 <= x, z < 32.
  [[nodiscard]] bool has(int x, int z) const { return linear_ ? linear_->has(index_of(x, z)) : entry(x, z) != 0; }
  /// Returns the decompressed NBT of a chunk. Requires: has(x, z).
  /// Errors: BadFormat, Unsupported, LimitExceeded, CannotRead; with the file and the offset in it.
  [[nodiscard]] Result<std::vector<std::byte>> read(int x, int z) const;
  /// Returns the offset of a chunk in the file; in a Linear file the offset of all compressed data.
  [[nodiscard]] std::uint64_t offset(int x, int z) const {
    return linear_ ? LinearRegion::kDataOffset : std::uint64_t{entry(x, z) >> 8} * 4096;
  }
  /// Returns a number that differs after the game has saved the chunk, 0 for a chunk that does not exist; from the
  /// file's table, or of a Linear file from its time.
  [[nodiscard]] std::uint64_t stamp(int x, int z) const;
  /// Returns the time of the chunk's last save, in seconds since 1970. Requires: 0 <= x, z < 32.
  [[nodiscard]] std::uint32_t time(int x, int z) const { return linear_ ? file_time_ : times_[index_of(x, z)]; }
  /// Returns true if all chunks of the file are held in memory once one is read.
  [[nodiscard]] bool is_expanded_whole() const { return linear_ != nullptr; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  RegionFile(std::filesystem::path path, RegionName name, int descriptor);
  [[nodiscard]] Status read_table();
  [[nodiscard]] Status read_linear();
  static std::size_t index_of(int x, int z) {
    QUOIN_ASSERT(x >= 0 && x < kRegionEdge && z >= 0 && z < kRegionEdge, "0 <= x, z < 32");
    return static_cast<std::size_t>(z * kRegionEdge + x);
  }
  [[nodiscard]] std::uint32_t entry(int x, int z) const { return table_[index_of(x, z)]; }
  [[nodiscard]] Result<std::vector<std::byte>> read_sectors(int x, int z, std::uint8_t& compression) const;
  [[nodiscard]] Result<std::vector<std::byte>> read_external(int x, int z) const;
  [[nodiscard]] Result<std::size_t> read_at(std::uint64_t offset, std::span<std::byte> out) const;
  [[nodiscard]] Error fault(int x, int z, std::string what) const;

  std::filesystem::path path_;
  RegionName name_;
  int descriptor_;                // -1: reads `bytes_`
  std::vector<std::byte> bytes_;  // for data without a file
  std::uint64_t size_ = 0;
  std::uint32_t file_time_ = 0;
  std::array<std::uint32_t, kRegionEdge * kRegionEdge> table_{};
  std::array<std::uint32_t, kRegionEdge * kRegionEdge> times_{};
  std::unique_ptr<const LinearRegion> linear_;
};

}  // namespace quoin::minecraft
