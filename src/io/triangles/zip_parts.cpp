#include "io/triangles/zip_parts.h"

#include <algorithm>

#include <quoin/core/assert.h>

#include "io/byte_reader.h"
#include "io/byte_stream.h"
#include "io/text.h"

namespace quoin::triangles {

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

}  // namespace quoin::triangles
