#include "io/minecraft/region_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <numeric>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/bytes/bytes.h"
#include "core/bytes/files.h"
#include "core/rows/packed_row.h"
#include "io/byte_stream.h"

#ifdef QUOIN_HAVE_ZSTD
#include <zstd.h>
#endif

#ifdef QUOIN_HAVE_LZ4
#include <lz4.h>
#endif

namespace quoin::minecraft {

namespace {

constexpr std::size_t kSectorBytes = 4096;
constexpr std::size_t kChunkHeader = 5;
constexpr std::uint8_t kExternal = 128;

Result<std::vector<std::byte>> inflate_all(std::span<const std::byte> bytes, Compression compression,
                                           std::size_t max_bytes) {
  ByteStream stream(bytes, 0, compression);
  std::vector<std::byte> out;
  constexpr std::size_t kUsualRatio = 16;
  std::size_t room = std::min(max_bytes, bytes.size() * kUsualRatio + kSectorBytes);
  while (true) {
    const std::size_t filled = out.size();
    out.resize(filled + room);
    const auto count = stream.read(std::span(out).subspan(filled));
    if (!count) return count.error();
    out.resize(filled + *count);
    if (*count < room) return out;
    if (out.size() >= max_bytes) {
      return make_error(ErrorCode::LimitExceeded, "expands to more than " + std::to_string(max_bytes) + " bytes", {},
                        stream.position());
    }
    room = std::min(max_bytes - out.size(), out.size());
  }
}

std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole ? std::optional(number) : std::nullopt;
}

/// Returns the part after the last dot and shortens the text to the part before it.
std::optional<std::string_view> take_last(std::string_view& text) {
  const std::size_t dot = text.rfind('.');
  if (dot == std::string_view::npos) return std::nullopt;
  const std::string_view last = text.substr(dot + 1);
  text = text.substr(0, dot);
  return last;
}

}  // namespace

Result<std::vector<std::byte>> decompress(std::span<const std::byte> bytes, std::uint8_t compression,
                                          std::size_t max_bytes) {
  switch (static_cast<ChunkCompression>(compression)) {
    case ChunkCompression::Gzip:
      return inflate_all(bytes, Compression::Gzip, max_bytes);
    case ChunkCompression::Zlib:
      return inflate_all(bytes, Compression::Zlib, max_bytes);
    case ChunkCompression::None:
      return std::vector<std::byte>(bytes.begin(), bytes.end());
    case ChunkCompression::Lz4:
      return expand_lz4_blocks(bytes, max_bytes);
  }
  return make_error(ErrorCode::Unsupported, "unknown compression method " + std::to_string(compression));
}

Result<std::vector<std::byte>> decompress_file(std::span<const std::byte> bytes, std::size_t max_bytes) {
  constexpr std::byte kDeflate{8};
  const bool is_zlib = bytes.size() >= 2 && (bytes[0] & std::byte{15}) == kDeflate &&
                       std::to_integer<int>(bytes[0]) >> 4 <= 7 &&
                       (std::to_integer<int>(bytes[0]) * 256 + std::to_integer<int>(bytes[1])) % 31 == 0;
  const ChunkCompression found = begins_gzip(bytes) ? ChunkCompression::Gzip
                                 : is_zlib          ? ChunkCompression::Zlib
                                                    : ChunkCompression::None;
  return decompress(bytes, static_cast<std::uint8_t>(found), max_bytes);
}

std::optional<RegionName> parse_region_name(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  std::string_view text = name;
  const auto extension = take_last(text);
  if (!extension) return std::nullopt;
  constexpr std::pair<std::string_view, RegionKind> kKinds[] = {
      {"mca", RegionKind::Anvil}, {"linear", RegionKind::Linear}, {"mcr", RegionKind::McRegion}};
  const auto* const kind = std::ranges::find(kKinds, *extension, [](const auto& each) { return each.first; });
  if (kind == std::end(kKinds)) return std::nullopt;
  const auto z = take_last(text);
  const auto x = z ? take_last(text) : std::nullopt;
  if (!x || !text.ends_with('r')) return std::nullopt;
  const auto x_number = whole_number(*x);
  const auto z_number = whole_number(*z);
  if (!x_number || !z_number) return std::nullopt;
  return RegionName{*x_number, *z_number, kind->second};
}

RegionFile::RegionFile(std::filesystem::path path, RegionName name, int descriptor)
    : path_(std::move(path)), name_(name), descriptor_(descriptor) {}

RegionFile::~RegionFile() {
  if (descriptor_ >= 0) close_after_reading(descriptor_);
}

bool is_region_file(std::span<const std::byte> beginning) {
  if (LinearRegion::begins(beginning)) return true;
  if (beginning.size() < 2 * kSectorBytes) return false;
  std::size_t sound = 0;
  std::size_t damaged = 0;
  std::size_t chunks = 0;
  std::size_t no_chunks = 0;
  for (std::size_t i = 0; i < kSectorBytes / 4; ++i) {
    const auto entry = load<std::uint32_t>(beginning.data() + 4 * i, std::endian::big);
    if (entry == 0) continue;
    const std::uint64_t at = std::uint64_t{entry >> 8} * kSectorBytes;
    const bool is_sound = at >= 2 * kSectorBytes && (entry & 255U) != 0;
    ++(is_sound ? sound : damaged);
    if (!is_sound || at + kChunkHeader > beginning.size()) continue;
    const auto size = load<std::uint32_t>(beginning.data() + at, std::endian::big);
    const auto compression = std::to_integer<unsigned>(beginning[at + 4]) & ~unsigned{kExternal};
    const bool is_chunk = size >= 1 && size <= kMaxChunkBytes && compression >= 1 && compression <= 4;
    ++(is_chunk ? chunks : no_chunks);
  }
  return chunks > no_chunks && sound >= damaged;
}

Result<std::unique_ptr<RegionFile>> RegionFile::of(std::span<const std::byte> bytes) {
  std::unique_ptr<RegionFile> file(new RegionFile({}, {}, -1));
  file->bytes_.assign(bytes.begin(), bytes.end());
  file->size_ = bytes.size();
  if (auto done = file->read_table(); !done) return done.error();
  return file;
}

Result<std::unique_ptr<RegionFile>> RegionFile::open(const std::filesystem::path& path, RegionName name) {
  const auto cannot = [&] {
    return make_error(ErrorCode::CannotRead, std::generic_category().message(errno), path.string());
  };
  const int descriptor = open_for_reading(path);
  if (descriptor < 0) return cannot();
  std::unique_ptr<RegionFile> file(new RegionFile(path, name, descriptor));
  struct stat info {};
  if (::fstat(descriptor, &info) != 0) return cannot();
  if (!S_ISREG(info.st_mode)) return make_error(ErrorCode::CannotRead, "not a regular file", path.string());
  file->size_ = static_cast<std::uint64_t>(info.st_size);
  file->file_time_ = static_cast<std::uint32_t>(info.st_mtime);
  if (auto done = file->read_table(); !done) return done.error();
  return file;
}

Status RegionFile::read_linear() {
  std::vector<std::byte> bytes(static_cast<std::size_t>(size_));
  const auto count = read_at(0, bytes);
  if (!count) return count.error();
  bytes.resize(*count);
  auto linear = LinearRegion::parse(std::move(bytes));
  if (!linear) {
    Error error = linear.error();
    error.path = path_.string();
    return error;
  }
  linear_ = std::move(*linear);
  return {};
}

Status RegionFile::read_table() {
  if (size_ == 0) return {};  // the game creates files and may leave them empty
  std::array<std::byte, 8> magic{};
  if (const auto count = read_at(0, magic); count && LinearRegion::begins(std::span(magic).first(*count))) {
    return read_linear();
  }
  if (name_.kind == RegionKind::Linear) {
    return make_error(ErrorCode::BadFormat, "a .linear file without the header of a Linear region", path_.string(), 0);
  }
  std::array<std::byte, kSectorBytes> table{};
  const auto count = read_at(0, table);
  if (!count) return count.error();
  if (*count < table.size()) {
    return make_error(ErrorCode::BadFormat,
                      "a region file of " + std::to_string(*count) + " bytes, shorter than its table", path_.string(),
                      *count);
  }
  for (std::size_t i = 0; i < table_.size(); ++i) {
    table_[i] = load<std::uint32_t>(table.data() + 4 * i, std::endian::big);
  }
  std::array<std::byte, kSectorBytes> times{};  // 0 past the end of the file
  if (const auto read = read_at(kSectorBytes, times); !read) return read.error();
  for (std::size_t i = 0; i < times_.size(); ++i) {
    times_[i] = load<std::uint32_t>(times.data() + 4 * i, std::endian::big);
  }
  return {};
}

std::uint64_t RegionFile::stamp(int x, int z) const {
  if (!has(x, z)) return 0;
  if (linear_) return mixed_with(mixed_with(kHashSeed, file_time_), size_);
  return mixed_with(mixed_with(kHashSeed, entry(x, z)), time(x, z));
}

Result<std::size_t> RegionFile::read_at(std::uint64_t offset, std::span<std::byte> out) const {
  if (descriptor_ < 0) {
    const std::size_t begin = std::min<std::uint64_t>(offset, bytes_.size());
    const std::size_t count = std::min(out.size(), bytes_.size() - begin);
    std::copy_n(bytes_.data() + begin, count, out.data());
    return count;
  }
  std::size_t filled = 0;
  while (filled < out.size()) {
    const ssize_t count =
        ::pread(descriptor_, out.data() + filled, out.size() - filled, static_cast<off_t>(offset + filled));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return make_error(ErrorCode::CannotRead, std::generic_category().message(errno), path_.string());
    if (count == 0) break;
    filled += static_cast<std::size_t>(count);
  }
  return filled;
}

Error RegionFile::fault(int x, int z, std::string what) const {
  const std::string place =
      std::to_string(name_.x * kRegionEdge + x) + ", " + std::to_string(name_.z * kRegionEdge + z);
  return make_error(ErrorCode::BadFormat, "chunk (" + place + "): " + std::move(what), path_.string(), offset(x, z));
}

Result<std::vector<std::byte>> RegionFile::read_sectors(int x, int z, std::uint8_t& compression) const {
  const std::uint64_t begin = offset(x, z);
  if (begin < 2 * kSectorBytes) return fault(x, z, "the first sector is inside the table");
  if (begin + kChunkHeader > size_) return fault(x, z, "the first sector is past the end of the file");
  std::array<std::byte, kChunkHeader> header{};
  if (const auto count = read_at(begin, header); !count || *count < header.size()) {
    return count ? Result<std::vector<std::byte>>(fault(x, z, "cut off")) : count.error();
  }
  const std::uint64_t bytes = load<std::uint32_t>(header.data(), std::endian::big);
  compression = std::to_integer<std::uint8_t>(header[4]);
  // The chunk may have more sectors than the table says; the checksum of its compressed data then confirms it.
  if (bytes < 1 || begin + 4 + bytes > size_) {
    return fault(x, z, "claims " + std::to_string(bytes) + " bytes");
  }
  if (bytes > kMaxChunkBytes) return fault(x, z, "has " + std::to_string(bytes) + " bytes, more than the limit");
  std::vector<std::byte> content(static_cast<std::size_t>(bytes - 1));
  const auto count = read_at(begin + kChunkHeader, content);
  if (!count) return count.error();
  if (*count < content.size()) return fault(x, z, "cut off");
  return content;
}

Result<std::vector<std::byte>> RegionFile::read_external(int x, int z) const {
  const std::string name =
      "c." + std::to_string(name_.x * kRegionEdge + x) + "." + std::to_string(name_.z * kRegionEdge + z) + ".mcc";
  const std::filesystem::path file = path_.parent_path() / name;
  auto bytes = read_file_beginning(file, kMaxChunkBytes);
  if (!bytes) return fault(x, z, "cannot read " + name + ": " + bytes.error().message);
  return bytes;
}

Result<std::vector<std::byte>> RegionFile::read(int x, int z) const {
  QUOIN_ASSERT(has(x, z), "a chunk of the region");
  if (linear_) {
    auto chunk = linear_->read(index_of(x, z));
    if (!chunk) chunk.error().path = path_.string();
    return chunk;
  }
  std::uint8_t compression = 0;
  auto content = read_sectors(x, z, compression);
  if (!content) return content;
  if ((compression & kExternal) != 0) {
    content = read_external(x, z);
    if (!content) return content;
    compression &= static_cast<std::uint8_t>(~kExternal);
  }
  auto expanded = decompress(*content, compression, kMaxChunkBytes);
  if (expanded) return expanded;
  Error error = fault(x, z, expanded.error().message);
  error.code = expanded.error().code;
  return error;
}

namespace {

constexpr std::uint64_t kMagic = 0xC3FF13183CCA9D9A;
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kStreamBytesAt = 20;
constexpr std::size_t kTableBytes = LinearRegion::kChunks * 8;
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

template <class T>
T big(std::span<const std::byte> bytes, std::size_t at) {
  QUOIN_ASSERT(at + sizeof(T) <= bytes.size(), "bytes of a number");
  return load<T>(bytes.data() + at, std::endian::big);
}

Error bad(std::string message, std::size_t at) {
  return make_error(ErrorCode::BadFormat, "Linear region: " + std::move(message), {}, at);
}

#ifdef QUOIN_HAVE_ZSTD

/// Expands the first `wanted` bytes of a zstd stream. Memory grows with the output.
Result<std::vector<std::byte>> expand_zstd(std::span<const std::byte> stream, std::size_t wanted) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  if (!context) return make_error(ErrorCode::LimitExceeded, "not enough memory");
  std::vector<std::byte> out;
  ZSTD_inBuffer input{stream.data(), stream.size(), 0};
  while (out.size() < wanted) {
    constexpr std::size_t kStep = std::size_t{1} << 17;
    const std::size_t filled = out.size();
    out.resize(filled + std::min(wanted - filled, std::max(kStep, filled)));
    ZSTD_outBuffer output{out.data() + filled, out.size() - filled, 0};
    for (bool has_moved = true; has_moved && output.pos < output.size;) {
      const std::size_t before = input.pos + output.pos;
      const std::size_t state = ZSTD_decompressStream(context.get(), &output, &input);
      const std::size_t at = LinearRegion::kDataOffset + input.pos;
      if (ZSTD_isError(state) != 0) return bad(std::string("damaged zstd data: ") + ZSTD_getErrorName(state), at);
      has_moved = input.pos + output.pos != before;
    }
    out.resize(filled + output.pos);
    if (output.pos < output.size) {
      return bad(
          "the data expands to " + std::to_string(out.size()) + " bytes, not the promised " + std::to_string(wanted),
          LinearRegion::kDataOffset + input.pos);
    }
  }
  return out;
}

#else

Result<std::vector<std::byte>> expand_zstd(std::span<const std::byte>, std::size_t) {
  return make_error(ErrorCode::Unsupported,
                    "cannot read Linear regions (.linear): Quoin was built without zstd (Debian: libzstd-dev)");
}

#endif

}  // namespace

bool LinearRegion::begins(std::span<const std::byte> beginning) {
  return beginning.size() >= sizeof(kMagic) && big<std::uint64_t>(beginning, 0) == kMagic;
}

Result<std::unique_ptr<const LinearRegion>> LinearRegion::parse(std::vector<std::byte> file) {
  QUOIN_ASSERT(begins(file), "a Linear region");
  if (file.size() < kDataOffset) return bad("the header is cut off", file.size());
  const auto version = std::to_integer<int>(file[kVersionAt]);
  if (version != 1 && version != 2) {
    return make_error(ErrorCode::Unsupported,
                      "Linear region: version " + std::to_string(version) + " is not supported (1 and 2 are)", {},
                      kVersionAt);
  }
  std::unique_ptr<LinearRegion> region(new LinearRegion(std::move(file)));
  const std::span<const std::byte> bytes = region->file_;
  region->stream_bytes_ = big<std::uint32_t>(bytes, kStreamBytesAt);
  if (region->stream_bytes_ > bytes.size() - kDataOffset) {
    return bad("the header claims " + std::to_string(region->stream_bytes_) + " compressed bytes, but " +
                   std::to_string(bytes.size() - kDataOffset) + " are left",
               kStreamBytesAt);
  }
  const auto table = expand_zstd(bytes.subspan(kDataOffset, region->stream_bytes_), kTableBytes);
  if (!table) return table.error();
  std::uint64_t sum = kTableBytes;
  for (std::size_t i = 0; i < kChunks; ++i) {
    region->sizes_[i] = big<std::uint32_t>(*table, 8 * i);
    sum += region->sizes_[i];
    if (region->sizes_[i] > kMaxChunkBytes || sum > kMaxBytes) {
      return make_error(ErrorCode::LimitExceeded, "Linear region: the chunks claim too many bytes", {}, kDataOffset);
    }
  }
  return std::unique_ptr<const LinearRegion>(std::move(region));
}

void LinearRegion::expand() const {
  const auto all = std::accumulate(sizes_.begin(), sizes_.end(), kTableBytes);
  expanded_ = expand_zstd(std::span(file_).subspan(kDataOffset, stream_bytes_), all);
}

Result<std::vector<std::byte>> LinearRegion::read(std::size_t chunk) const {
  QUOIN_ASSERT(has(chunk), "a chunk of the region");
  std::call_once(once_, [this] { expand(); });
  if (!expanded_) return expanded_.error();
  const auto begin = std::accumulate(sizes_.begin(), sizes_.begin() + static_cast<std::ptrdiff_t>(chunk), kTableBytes);
  QUOIN_ASSERT(begin + sizes_[chunk] <= expanded_->size(), "a chunk within the expanded bytes");
  const auto first = expanded_->begin() + static_cast<std::ptrdiff_t>(begin);
  return std::vector<std::byte>(first, first + static_cast<std::ptrdiff_t>(sizes_[chunk]));
}

#ifdef QUOIN_HAVE_LZ4

Result<std::vector<std::byte>> expand_lz4_blocks(std::span<const std::byte> bytes, std::size_t max_bytes) {
  constexpr std::string_view kMagic = "LZ4Block";
  constexpr std::size_t kHeader = 21;
  constexpr unsigned kStored = 0x10;
  constexpr unsigned kCompressed = 0x20;
  std::vector<std::byte> out;
  std::size_t at = 0;
  const auto fault = [&](const char* what) { return make_error(ErrorCode::BadFormat, what, {}, at); };
  while (at < bytes.size()) {
    if (bytes.size() - at < kHeader) return fault("LZ4: cut off");
    const std::byte* const header = bytes.data() + at;
    if (!std::equal(kMagic.begin(), kMagic.end(), reinterpret_cast<const char*>(header))) {
      return fault("LZ4: not the start of a block");
    }
    const unsigned method = std::to_integer<unsigned>(header[8]) & 0xF0U;
    const std::size_t packed = load<std::uint32_t>(header + 9, std::endian::little);
    const std::size_t size = load<std::uint32_t>(header + 13, std::endian::little);
    if (size == 0 && packed == 0) return out;
    if (packed > bytes.size() - at - kHeader) return fault("LZ4: cut off");
    if (size > max_bytes - out.size())
      return make_error(ErrorCode::LimitExceeded, "LZ4: the output exceeds the limit", {}, at);
    // LZ4 expands a byte to at most 255 bytes.
    if (size / 255 > packed) return fault("LZ4: a block claims more output than its bytes can hold");
    const std::byte* const content = header + kHeader;
    if (method == kStored) {
      if (packed != size) return fault("LZ4: an uncompressed block has two different sizes");
      out.insert(out.end(), content, content + size);
    } else if (method == kCompressed) {
      const std::size_t filled = out.size();
      out.resize(filled + size);
      const int count =
          LZ4_decompress_safe(reinterpret_cast<const char*>(content), reinterpret_cast<char*>(out.data() + filled),
                              static_cast<int>(packed), static_cast<int>(size));
      if (count != static_cast<int>(size)) return fault("LZ4: the compressed data is damaged");
    } else {
      return fault("LZ4: unknown compression method");
    }
    at += kHeader + packed;
  }
  return out;
}

#else

Result<std::vector<std::byte>> expand_lz4_blocks(std::span<const std::byte>, std::size_t) {
  return make_error(ErrorCode::Unsupported, "cannot read LZ4: Quoin was built without it (Debian: liblz4-dev)");
}

#endif

}  // namespace quoin::minecraft
