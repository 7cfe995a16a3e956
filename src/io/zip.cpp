#include "io/zip.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <utility>

#include <zlib.h>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/rows/packed_row.h"
#include "io/byte_stream.h"

namespace quoin {

namespace {

// The first four bytes of records.
constexpr std::uint32_t kEndOfDirectory = 0x06054B50;
constexpr std::uint32_t kOfDirectory = 0x02014B50;
constexpr std::uint32_t kOfFile = 0x04034B50;
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
  put_number(bytes_, kOfFile, 4);
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
    put_number(bytes_, kOfDirectory, 4);
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
  put_number(bytes_, kEndOfDirectory, 4);
  put_number(bytes_, 0, 4);
  put_number(bytes_, entries_.size(), 2);
  put_number(bytes_, entries_.size(), 2);
  put_number(bytes_, size, 4);
  put_number(bytes_, directory, 4);
  put_number(bytes_, 0, 2);
  return std::move(bytes_);
}

namespace {

constexpr std::uint32_t kEndOfDirectory64 = 0x06064B50;
constexpr std::uint32_t kLocator64 = 0x07064B50;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kLocator64Bytes = 20;
constexpr std::size_t kLongestComment = 65'535;
// Fields that do not fit have these values, and zip64 records have the numbers.
constexpr std::uint64_t kInZip64 = 0xFFFFFFFF;
constexpr std::size_t kCountInZip64 = 0xFFFF;

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

/// Replaces the fields of an entry that its zip64 record has. Returns false if the record lacks one.
bool read_zip64(std::span<const std::byte> extra, std::initializer_list<std::uint64_t*> fields) {
  constexpr std::uint16_t kZip64Record = 1;
  ByteReader records(extra);
  while (records.remaining() >= 4) {
    const bool is_zip64 = records.u16() == kZip64Record;
    ByteReader record(records.take(records.u16()));
    if (!is_zip64) continue;
    for (std::uint64_t* const field : fields) {
      if (*field == kInZip64) *field = record.u64();
    }
    return !record.failed();
  }
  return std::ranges::none_of(fields, [](const std::uint64_t* field) { return *field == kInZip64; });
}

}  // namespace

struct ZipParts::Directory {
  std::uint64_t count = 0;
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

Result<ZipParts::Directory> ZipParts::find_directory(std::span<const std::byte> zip) {
  const auto end_at = find_end(zip);
  if (!end_at) return bad_at(zip.size(), "the zip file has no directory: it is cut off");
  ByteReader end(zip, *end_at + 10, zip.size());
  Directory directory;
  directory.count = end.u16();
  std::uint64_t size = end.u32();
  directory.begin = end.u32();
  directory.end = *end_at;
  if ((directory.count == kCountInZip64 || size == kInZip64 || directory.begin == kInZip64) &&
      *end_at >= kLocator64Bytes) {
    ByteReader locator(zip, *end_at - kLocator64Bytes, *end_at);
    const bool has_locator = locator.u32() == kLocator64;
    (void)locator.take(4);
    const std::uint64_t at = locator.u64();
    if (has_locator) {
      if (at > *end_at) return bad_at(*end_at, "the zip64 directory is outside the file");
      ByteReader end64(zip, static_cast<std::size_t>(at), *end_at);
      const bool is_end = end64.u32() == kEndOfDirectory64;
      (void)end64.take(28);
      directory.count = end64.u64();
      size = end64.u64();
      directory.begin = end64.u64();
      if (!is_end || end64.failed()) return bad_at(at, "the zip64 directory is damaged");
      directory.end = at;
    }
  }
  if (directory.begin > directory.end || size > directory.end - directory.begin) {
    return bad_at(*end_at, "the zip directory is outside the file");
  }
  return directory;
}

Result<ZipParts> ZipParts::open(std::span<const std::byte> zip) {
  const auto directory = find_directory(zip);
  if (!directory) return directory.error();
  ZipParts parts;
  parts.bytes_ = zip;
  ByteReader reader(zip, static_cast<std::size_t>(directory->begin), static_cast<std::size_t>(directory->end));
  for (std::uint64_t i = 0; i < directory->count; ++i) {
    const std::size_t at = reader.position();
    const bool is_entry = reader.u32() == kOfDirectory;
    Entry entry;
    (void)reader.take(4);  // versions
    entry.flags = reader.u16();
    entry.method = reader.u16();
    (void)reader.take(4);  // time
    entry.crc = reader.u32();
    entry.packed = reader.u32();
    entry.size = reader.u32();
    const std::size_t name = reader.u16();
    const std::size_t extra = reader.u16();
    const std::size_t comment = reader.u16();
    (void)reader.take(8);  // disk, attributes
    entry.at = reader.u32();
    std::string text(reader.text(name));
    const bool is_whole = read_zip64(reader.take(extra), {&entry.size, &entry.packed, &entry.at});
    (void)reader.take(comment);
    if (!is_entry || !is_whole || reader.failed()) return bad_at(at, "the zip directory is damaged");
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

std::uint32_t crc32_of(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

ZipParts::Sum ZipParts::sum_of(std::string_view name) const {
  QUOIN_ASSERT(has(name), "a file of the zip file");
  const Entry& entry = entries_.find(name)->second;
  return {entry.size, entry.crc};
}

Result<std::vector<std::byte>> ZipParts::read(std::string_view name, std::uint64_t max_bytes) const {
  QUOIN_ASSERT(has(name), "a file of the zip file");
  const Entry& entry = entries_.find(name)->second;
  constexpr std::uint32_t kEncrypted = 1;
  constexpr std::uint32_t kDeflate = 8;
  if ((entry.flags & kEncrypted) != 0 || (entry.method != 0 && entry.method != kDeflate)) {
    return make_error(ErrorCode::Unsupported, printable(name) + " is encrypted or not compressed by deflate", {},
                      entry.at);
  }
  if (entry.size > max_bytes) {
    return make_error(ErrorCode::LimitExceeded,
                      printable(name) + " has " + std::to_string(entry.size) + " bytes: at most " +
                          std::to_string(max_bytes) + " are read",
                      {}, entry.at);
  }
  const auto begin = static_cast<std::size_t>(std::min<std::uint64_t>(entry.at, bytes_.size()));
  ByteReader head(bytes_, begin, bytes_.size());
  const bool is_file = head.u32() == kOfFile;
  (void)head.take(22);
  const std::size_t names_and_more = std::size_t{head.u16()} + head.u16();
  (void)head.take(names_and_more);
  const auto packed = head.take(static_cast<std::size_t>(entry.packed));
  if (!is_file || head.failed()) return bad_at(entry.at, printable(name) + " is outside the zip file");
  ByteStream stream(packed, 0, entry.method == kDeflate ? Compression::Deflate : Compression::None);
  if (entry.size > stream.max_bytes())
    return bad_at(entry.at, printable(name) + " claims more bytes than it can expand to");
  std::vector<std::byte> content(static_cast<std::size_t>(entry.size));
  const auto read = stream.read(content);
  if (!read || *read != content.size()) return bad_at(entry.at, printable(name) + " is damaged");
  if (crc32_of(content) != entry.crc) {
    return bad_at(entry.at, printable(name) + " is damaged: its checksum is wrong");
  }
  return content;
}

}  // namespace quoin
