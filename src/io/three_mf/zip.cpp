#include "io/three_mf/zip.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <zlib.h>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/byte_stream.h"

namespace quoin {

namespace {

constexpr std::uint64_t kMost = 0xFFFF'FFFF;
constexpr std::size_t kLocalHeader = 30;
// Offset in the local header of the checksum and both sizes, which are known only at the end.
constexpr std::size_t kSumAt = 14;

void put_number(std::vector<std::byte>& to, std::uint64_t value, int bytes) {
  // `bytes` may exceed the size of a number, to write zeros.
  for (int i = 0; i < bytes; ++i) to.push_back(i < 8 ? static_cast<std::byte>(value >> (8 * i)) : std::byte{0});
}

void set_number(std::vector<std::byte>& in, std::uint64_t at, std::uint64_t value) {
  QUOIN_ASSERT(at + 4 <= in.size(), "four bytes that were written");
  for (std::size_t i = 0; i < 4; ++i) in[static_cast<std::size_t>(at) + i] = static_cast<std::byte>(value >> (8 * i));
}

// 1980-01-01, the first day of the format.
constexpr std::uint32_t kDate = 0x0021;

void put_text(std::vector<std::byte>& to, std::string_view text) {
  for (const char c : text) to.push_back(static_cast<std::byte>(c));
}

}  // namespace

struct ZipFile::Deflater {
  z_stream stream{};
  Deflater() {
    // Without a zlib header. Fails only if memory runs out.
    const int made = deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    if (made != Z_OK) throw std::bad_alloc();
  }
  ~Deflater() { deflateEnd(&stream); }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  void run(std::string_view text, int flush, std::vector<std::byte>& out) {
    std::array<Bytef, 1 << 16> room;
    // zlib only reads through this pointer.
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(text.data()));  // NOLINT
    stream.avail_in = static_cast<uInt>(text.size());
    do {
      stream.next_out = room.data();
      stream.avail_out = static_cast<uInt>(room.size());
      deflate(&stream, flush);
      const std::size_t got = room.size() - stream.avail_out;
      const auto* const first = reinterpret_cast<const std::byte*>(room.data());
      out.insert(out.end(), first, first + got);
    } while (stream.avail_out == 0);
  }
};

ZipFile::ZipFile() = default;
ZipFile::~ZipFile() = default;

void ZipFile::begin(std::string name) {
  QUOIN_ASSERT(name.size() <= 0xFFFF && std::ranges::all_of(name, [](char c) { return c > 0; }), "a name of ASCII");
  end();
  Entry entry;
  entry.name = std::move(name);
  entry.at = bytes_.size();
  put_number(bytes_, 0x0403'4B50, 4);
  put_number(bytes_, 20, 2);  // needs version 2.0
  put_number(bytes_, 0, 2);
  put_number(bytes_, Z_DEFLATED, 2);
  put_number(bytes_, 0, 2);
  put_number(bytes_, kDate, 2);
  put_number(bytes_, 0, 12);
  put_number(bytes_, entry.name.size(), 2);
  put_number(bytes_, 0, 2);
  put_text(bytes_, entry.name);
  entries_.push_back(std::move(entry));
  deflater_ = std::make_unique<Deflater>();
}

void ZipFile::put(std::string_view text) {
  QUOIN_ASSERT(deflater_ != nullptr, "a file has begun");
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  Entry& entry = entries_.back();
  for (; !text.empty(); text.remove_prefix(std::min(kPiece, text.size()))) {
    const std::string_view piece = text.substr(0, kPiece);
    entry.crc = static_cast<std::uint32_t>(
        crc32(entry.crc, reinterpret_cast<const Bytef*>(piece.data()), static_cast<uInt>(piece.size())));
    entry.size += piece.size();
    deflater_->run(piece, Z_NO_FLUSH, bytes_);
  }
}

void ZipFile::end() {
  if (deflater_ == nullptr) return;
  deflater_->run({}, Z_FINISH, bytes_);
  deflater_.reset();
  Entry& entry = entries_.back();
  QUOIN_ASSERT(bytes_.size() >= entry.at + kLocalHeader + entry.name.size(), "content after its header");
  entry.packed = bytes_.size() - entry.at - kLocalHeader - entry.name.size();
  set_number(bytes_, entry.at + kSumAt, entry.crc);
  set_number(bytes_, entry.at + kSumAt + 4, entry.packed);
  set_number(bytes_, entry.at + kSumAt + 8, entry.size);
}

Result<std::vector<std::byte>> ZipFile::take() {
  end();
  const std::uint64_t directory = bytes_.size();
  for (const Entry& entry : entries_) {
    if (entry.size > kMost || directory > kMost)
      return make_error(ErrorCode::LimitExceeded, "the zip file would have 4 GiB or more");
    put_number(bytes_, 0x0201'4B50, 4);
    put_number(bytes_, 20, 2);  // made by version 2.0
    put_number(bytes_, 20, 2);
    put_number(bytes_, 0, 2);
    put_number(bytes_, Z_DEFLATED, 2);
    put_number(bytes_, 0, 2);
    put_number(bytes_, kDate, 2);
    put_number(bytes_, entry.crc, 4);
    put_number(bytes_, entry.packed, 4);
    put_number(bytes_, entry.size, 4);
    put_number(bytes_, entry.name.size(), 2);
    put_number(bytes_, 0, 12);
    put_number(bytes_, entry.at, 4);
    put_text(bytes_, entry.name);
  }
  const std::uint64_t size = bytes_.size() - directory;
  put_number(bytes_, 0x0605'4B50, 4);
  put_number(bytes_, 0, 4);
  put_number(bytes_, entries_.size(), 2);
  put_number(bytes_, entries_.size(), 2);
  put_number(bytes_, size, 4);
  put_number(bytes_, directory, 4);
  put_number(bytes_, 0, 2);
  return std::move(bytes_);
}

namespace {

constexpr std::uint32_t kEndOfDirectory = 0x06054B50;
constexpr std::uint32_t kOfDirectory = 0x02014B50;
constexpr std::uint32_t kOfFile = 0x04034B50;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kLongestComment = 65'535;
constexpr std::uint32_t kZip64 = 0xFFFFFFFF;

/// Returns the offset of the record that ends the directory, before a comment.
std::optional<std::size_t> find_end(std::span<const std::byte> zip) {
  if (zip.size() < kEndBytes) return std::nullopt;
  const std::size_t last = zip.size() - kEndBytes;
  const std::size_t first = last - std::min(last, kLongestComment);
  for (std::size_t at = last + 1; at-- > first;) {
    if (ByteReader(zip, at, zip.size()).u32() == kEndOfDirectory) return at;
  }
  return std::nullopt;
}

}  // namespace

Result<ZipParts> ZipParts::open(std::span<const std::byte> zip) {
  const auto end_at = find_end(zip);
  if (!end_at) return bad_at(zip.size(), "the zip file has no directory: it is cut off");
  ByteReader end(zip, *end_at + 10, zip.size());
  const std::size_t count = end.u16();
  const std::size_t size = end.u32();
  const std::size_t begin = end.u32();
  if (begin == kZip64 || count == 0xFFFF) {
    return make_error(ErrorCode::Unsupported, "zip64 is not supported", {}, *end_at);
  }
  if (begin > *end_at || size > *end_at - begin) return bad_at(*end_at, "the zip directory is outside the file");
  ZipParts parts;
  parts.bytes_ = zip;
  ByteReader reader(zip, begin, *end_at);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = reader.position();
    const bool is_entry = reader.u32() == kOfDirectory;
    Entry entry;
    (void)reader.take(4);  // versions
    entry.flags = reader.u16();
    entry.method = reader.u16();
    (void)reader.take(8);  // time, checksum
    entry.packed = reader.u32();
    entry.size = reader.u32();
    const std::size_t name = reader.u16();
    const std::size_t rest = std::size_t{reader.u16()} + reader.u16();
    (void)reader.take(8);  // disk, attributes
    entry.at = reader.u32();
    std::string text(reader.text(name));
    (void)reader.take(rest);
    if (!is_entry || reader.failed()) return bad_at(at, "the zip directory is damaged");
    parts.entries_[std::move(text)] = entry;
  }
  return parts;
}

std::vector<std::string> ZipParts::names() const {
  std::vector<std::string> names;
  names.reserve(entries_.size());
  for (const auto& [name, entry] : entries_) names.push_back(name);
  return names;
}

Result<std::vector<std::byte>> ZipParts::read(const std::string& name) const {
  QUOIN_ASSERT(has(name), "a file of the zip file");
  const Entry& entry = entries_.find(name)->second;
  constexpr std::uint32_t kEncrypted = 1;
  constexpr std::uint32_t kDeflate = 8;
  if ((entry.flags & kEncrypted) != 0 || (entry.method != 0 && entry.method != kDeflate)) {
    return make_error(ErrorCode::Unsupported, printable(name) + " is encrypted or not compressed by deflate", {},
                      entry.at);
  }
  ByteReader head(bytes_, std::min<std::size_t>(entry.at, bytes_.size()), bytes_.size());
  const bool is_file = head.u32() == kOfFile;
  (void)head.take(22);
  const std::size_t names_and_more = std::size_t{head.u16()} + head.u16();
  (void)head.take(names_and_more);
  const auto packed = head.take(entry.packed);
  if (!is_file || head.failed()) return bad_at(entry.at, printable(name) + " is outside the zip file");
  ByteStream stream(packed, 0, entry.method == kDeflate ? Compression::Deflate : Compression::None);
  if (entry.size > stream.max_bytes())
    return bad_at(entry.at, printable(name) + " claims more bytes than it can expand to");
  std::vector<std::byte> content(entry.size);
  const auto read = stream.read(content);
  if (!read || *read != content.size()) return bad_at(entry.at, printable(name) + " is damaged");
  return content;
}

}  // namespace quoin
