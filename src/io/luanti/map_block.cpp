// A row of a map, all numbers big-endian:
//
//   version 25 to 28   u8 version, u8 flags, u16 light (27 on), u8 2 or 1, u8 2
//                      zlib: param0 (u16 or u8), param1, param2 of 4096 nodes
//                      zlib: metadata
//                      objects: u8, u16 count, each u8 kind, 12 bytes place, u16 size, bytes
//                      u32 time, names
//                      timers
//   version 29         u8 version, then zstd: u8 flags, u16 light, u32 time, names, u8 2 or 1, u8 2,
//                      the nodes uncompressed, metadata, objects, timers
//   names              u8 0, u16 count, each u16 number, u16 size, bytes

#include "io/luanti/luanti.h"

#include <algorithm>
#include <new>
#include <string_view>

#include <zstd.h>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "io/byte_stream.h"

namespace quoin::luanti {

namespace {

constexpr int kOldest = 25;
constexpr int kFirstWithLight = 27;
constexpr int kFirstOfZstd = 29;
constexpr int kNewest = 29;
/// Limit of a decompressed row. The fields used here precede the nodes' metadata.
constexpr std::size_t kMaxContent = std::size_t{4} << 20;
constexpr std::size_t kMaxMetadata = std::size_t{16} << 20;
constexpr std::uint32_t kUnnamed = 0xFFFFFFFF;

std::uint16_t read_u16(ByteReader& reader) {
  const auto bytes = reader.take(2);
  return bytes.empty() ? std::uint16_t{0} : load<std::uint16_t>(bytes.data(), std::endian::big);
}

/// Reads the size of param0 in bytes.
Result<std::size_t> read_widths(ByteReader& reader) {
  const std::size_t at = reader.position();
  const std::size_t content = reader.u8();
  const std::size_t params = reader.u8();
  if (reader.failed()) return bad_at(at, "unexpected end before the nodes");
  if ((content != 1 && content != 2) || params != 2) return bad_at(at, "invalid node width");
  return content;
}

/// Sets the block's nodes. Requires: `content` has the bytes of 4096 nodes.
void put_nodes(std::span<const std::byte> content, std::size_t width, MapBlock& block) {
  QUOIN_ASSERT((width == 1 || width == 2) && content.size() >= kBlockNodes * (width + 2), "the bytes of 4096 nodes");
  const std::byte* const param2 = content.data() + kBlockNodes * (width + 1);
  for (std::size_t i = 0; i < kBlockNodes; ++i) {
    block.param2[i] = std::to_integer<std::uint8_t>(param2[i]);
    if (width == 2) {
      block.nodes[i] = load<std::uint16_t>(content.data() + 2 * i, std::endian::big);
      continue;
    }
    // The upper half of such numbers extends into param2.
    auto number = std::to_integer<std::uint16_t>(content[i]);
    if (number > 0x7F) {
      number = static_cast<std::uint16_t>(number << 4 | block.param2[i] >> 4);
      block.param2[i] &= 0x0F;
    }
    block.nodes[i] = number;
  }
}

/// Reads the names by number; the last one wins among duplicates.
Status read_names(ByteReader& reader, std::vector<std::uint32_t>& name_of, std::vector<std::string>& names) {
  const std::size_t at = reader.position();
  const int version = reader.u8();
  const std::size_t count = read_u16(reader);
  if (!reader.failed() && version != 0)
    return bad_at(at, "unknown version of the name table: " + std::to_string(version));
  names.clear();
  name_of.clear();
  for (std::size_t i = 0; i < count && !reader.failed(); ++i) {
    const std::size_t number = read_u16(reader);
    const std::string_view name = reader.text(read_u16(reader));
    if (number >= name_of.size()) name_of.resize(number + 1, kUnnamed);
    name_of[number] = static_cast<std::uint32_t>(names.size());
    names.emplace_back(name);
  }
  if (reader.failed()) return bad_at(at, "unexpected end in the names");
  return {};
}

/// Replaces the numbers of a block's own table by indices into its names.
Status name_nodes(std::size_t at, const std::vector<std::uint32_t>& name_of, MapBlock& block) {
  for (std::size_t i = 0; i < kBlockNodes; ++i) {
    const std::uint16_t number = block.nodes[i];
    const std::uint32_t name = number < name_of.size() ? name_of[number] : kUnnamed;
    if (name == kUnnamed) {
      return bad_at(at, "node " + std::to_string(i) + " has number " + std::to_string(number) + ", which has no name");
    }
    block.nodes[i] = static_cast<std::uint16_t>(name);
  }
  return {};
}

Status skip_objects(ByteReader& reader) {
  const std::size_t at = reader.position();
  static_cast<void>(reader.u8());  // version
  const std::size_t count = read_u16(reader);
  for (std::size_t i = 0; i < count && !reader.failed(); ++i) {
    static_cast<void>(reader.take(1 + 12));
    static_cast<void>(reader.take(read_u16(reader)));
  }
  if (reader.failed()) return bad_at(at, "unexpected end in the objects");
  return {};
}

/// Reads versions before zstd.
Status read_zlib(std::span<const std::byte> row, int version, std::vector<std::uint32_t>& name_of, MapBlock& block) {
  ByteReader reader(row);
  static_cast<void>(reader.take(version >= kFirstWithLight ? 4 : 2));
  const auto width = read_widths(reader);
  if (!width) return width.error();
  const std::size_t nodes_at = reader.position();
  std::array<std::byte, kBlockNodes * 4> content{};
  const auto nodes = std::span(content).first(kBlockNodes * (*width + 2));
  ByteStream node_stream(row, nodes_at, Compression::Zlib);
  const auto count = node_stream.read(nodes);
  if (!count) return count.error();
  // Only the stream's end must be left.
  const auto more = node_stream.skip(1);
  if (!more) return more.error();
  if (*count != nodes.size() || *more != 0) return bad_at(nodes_at, "expected the bytes of 4096 nodes");
  put_nodes(nodes, *width, block);
  ByteStream metadata(row, node_stream.position(), Compression::Zlib);
  const auto skipped = metadata.skip(kMaxMetadata + 1);
  if (!skipped) return skipped.error();
  if (*skipped > kMaxMetadata) return bad_at(node_stream.position(), "metadata exceeds 16 MiB");
  ByteReader rest(row, metadata.position(), row.size());
  if (auto done = skip_objects(rest); !done) return done;
  static_cast<void>(rest.u32());  // time
  if (auto done = read_names(rest, name_of, block.names); !done) return done;
  return name_nodes(nodes_at, name_of, block);
}

/// Reads the decompressed content of a zstd row.
Status read_expanded(std::span<const std::byte> content, std::vector<std::uint32_t>& name_of, MapBlock& block) {
  ByteReader reader(content);
  static_cast<void>(reader.take(1 + 2 + 4));
  if (auto done = read_names(reader, name_of, block.names); !done) return done;
  const auto width = read_widths(reader);
  if (!width) return width.error();
  const std::size_t at = reader.position();
  const auto nodes = reader.take(kBlockNodes * (*width + 2));
  if (reader.failed()) return bad_at(at, "expected the bytes of 4096 nodes");
  put_nodes(nodes, *width, block);
  return name_nodes(at, name_of, block);
}

}  // namespace

void MapBlockReader::Free::operator()(ZSTD_DCtx_s* context) const {
  ZSTD_freeDCtx(context);
}

MapBlockReader::MapBlockReader() : context_(ZSTD_createDCtx()) {
  if (context_ == nullptr) throw std::bad_alloc();
  constexpr int kMaxWindow = 23;  // of 2^23 bytes; Luanti uses less
  static_cast<void>(ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, kMaxWindow));
}

Status MapBlockReader::expand(std::span<const std::byte> frame) {
  constexpr std::size_t kStep = std::size_t{64} << 10;
  static_cast<void>(ZSTD_DCtx_reset(context_.get(), ZSTD_reset_session_only));
  content_.clear();
  ZSTD_inBuffer in{frame.data(), frame.size(), 0};
  for (std::size_t left = 1; left != 0 && content_.size() < kMaxContent;) {
    const std::size_t begin = content_.size();
    content_.resize(begin + kStep);
    ZSTD_outBuffer out{content_.data() + begin, kStep, 0};
    const std::size_t at = in.pos;
    left = ZSTD_decompressStream(context_.get(), &out, &in);
    content_.resize(begin + out.pos);
    if (ZSTD_isError(left) != 0) {
      return bad_at(1 + at, std::string("zstd: ") + ZSTD_getErrorName(left));
    }
    if (left != 0 && out.pos == 0 && in.pos == in.size) return bad_at(1 + in.pos, "zstd: unexpected end");
  }
  return {};
}

Status MapBlockReader::read(std::span<const std::byte> row, MapBlock& block) {
  if (row.empty()) return bad_at(0, "the row is empty");
  const auto version = std::to_integer<int>(row[0]);
  if (version < kOldest || version > kNewest) {
    return make_error(ErrorCode::Unsupported,
                      "unsupported block version " + std::to_string(version) +
                          " (supported: 25 to 29; Luanti upgrades blocks that it loads)",
                      {}, 0);
  }
  if (version < kFirstOfZstd) return read_zlib(row, version, name_of_, block);
  if (auto done = expand(row.subspan(1)); !done) return done;
  Status read = read_expanded(content_, name_of_, block);
  if (!read) read.error().message += " (offset in the decompressed data)";
  return read;
}

}  // namespace quoin::luanti
