// A frame: u8 version, u8, u8 flags, u8 bytes of an element, u32 bytes, u32 bytes of a block, u32 bytes of the frame;
// then the offset of each block (i32), and the blocks: streams of i32 size and bytes; split blocks have a stream for
// each byte of an element. Shuffled: the first bytes of all elements come first.

#include "io/vdb/vdb.h"

#include <algorithm>
#include <string>
#include <vector>

#include "core/bytes/byte_stream.h"
#include "core/bytes/bytes.h"

#ifdef QUOIN_HAVE_LZ4
#include <lz4.h>

#include <quoin/core/assert.h>
#endif

namespace quoin::vdb {

namespace {

constexpr std::size_t kHeader = 16;

struct Header {
  unsigned flags = 0;
  std::size_t element = 1;
  std::size_t bytes = 0;
  std::size_t block = 0;

  [[nodiscard]] bool is_shuffled() const { return (flags & 1U) != 0; }
  [[nodiscard]] bool is_stored() const { return (flags & 2U) != 0; }
  [[nodiscard]] bool is_shuffled_by_bits() const { return (flags & 4U) != 0; }
  [[nodiscard]] unsigned compressor() const { return flags >> 5; }
  [[nodiscard]] bool is_split() const {
    constexpr std::size_t kMostStreams = 16;
    constexpr std::size_t kLeastElements = 128;
    return (flags & 0x10U) == 0 && element <= kMostStreams && block / element >= kLeastElements;
  }
};

Status expand_lz4([[maybe_unused]] std::span<const std::byte> packed, [[maybe_unused]] std::span<std::byte> out,
                  std::size_t at) {
#ifdef QUOIN_HAVE_LZ4
  const int count =
      LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(out.data()),
                          static_cast<int>(packed.size()), static_cast<int>(out.size()));
  if (count == static_cast<int>(out.size())) return {};
  return bad_at(at, "Blosc: an LZ4 stream is damaged");
#else
  return make_error(ErrorCode::Unsupported, "cannot read LZ4: Quoin was built without it", {}, at);
#endif
}

Status expand_stream(const Header& header, std::span<const std::byte> packed, std::span<std::byte> out,
                     std::size_t at) {
  if (packed.size() == out.size()) {
    std::ranges::copy(packed, out.begin());
    return {};
  }
  constexpr unsigned kLz4 = 1;
  constexpr unsigned kZlib = 3;
  if (header.compressor() == kLz4) return expand_lz4(packed, out, at);
  if (header.compressor() != kZlib) {
    return make_error(
        ErrorCode::Unsupported,
        "Blosc: compressor " + std::to_string(header.compressor()) + " is not supported (LZ4 and zlib are)", {}, at);
  }
  ByteStream stream(packed, 0, Compression::Zlib);
  const auto count = stream.read(out);
  if (!count || *count != out.size()) return bad_at(at, "Blosc: a zlib stream is damaged");
  return {};
}

void unshuffle(std::span<const std::byte> shuffled, std::size_t element, std::span<std::byte> out) {
  QUOIN_ASSERT(element > 0 && out.size() == shuffled.size(), "as many bytes as before");
  const std::size_t count = shuffled.size() / element;
  for (std::size_t byte = 0; byte < element; ++byte) {
    for (std::size_t i = 0; i < count; ++i) out[i * element + byte] = shuffled[byte * count + i];
  }
  std::ranges::copy(shuffled.subspan(count * element), out.begin() + static_cast<std::ptrdiff_t>(count * element));
}

}  // namespace

Status expand_blosc(std::span<const std::byte> frame, std::span<std::byte> out) {
  ByteReader reader(frame);
  Header header;
  static_cast<void>(reader.take(2));
  header.flags = reader.u8();
  header.element = std::max<std::size_t>(reader.u8(), 1);
  header.bytes = reader.u32();
  header.block = reader.u32();
  static_cast<void>(reader.u32());
  if (reader.failed() || header.bytes != out.size())
    return bad_at(0, "Blosc: the frame does not have the expected number of bytes");
  if (header.is_stored()) {
    const auto stored = reader.take(out.size());
    if (reader.failed()) return bad_at(kHeader, "Blosc: cut off");
    std::ranges::copy(stored, out.begin());
    return {};
  }
  if (header.is_shuffled_by_bits())
    return make_error(ErrorCode::Unsupported, "Blosc: bit shuffle is not supported", {}, 2);
  if (header.block == 0 || (out.size() + header.block - 1) / header.block > reader.remaining() / 4) {
    return bad_at(8, "Blosc: invalid block size");
  }
  std::vector<std::byte> shuffled(std::min(header.block, out.size()));
  for (std::size_t begin = 0; begin < out.size(); begin += header.block) {
    const std::size_t at = reader.u32();
    if (at > frame.size()) return bad_at(reader.position(), "Blosc: a block starts past the end of the frame");
    const auto block = out.subspan(begin, std::min(header.block, out.size() - begin));
    const auto target = header.is_shuffled() ? std::span(shuffled).first(block.size()) : block;
    const bool is_split = header.is_split() && block.size() == header.block && block.size() % header.element == 0;
    const std::size_t stream = is_split ? block.size() / header.element : block.size();
    QUOIN_ASSERT(stream > 0, "a stream of at least one byte");
    ByteReader streams(frame, at, frame.size());
    for (std::size_t done = 0; done < block.size(); done += stream) {
      const std::size_t place = streams.position();
      const auto packed = streams.take(streams.u32());
      if (streams.failed()) return bad_at(place, "Blosc: cut off");
      if (auto expanded = expand_stream(header, packed, target.subspan(done, stream), place); !expanded)
        return expanded;
    }
    if (header.is_shuffled()) unshuffle(target, header.element, block);
  }
  return {};
}

}  // namespace quoin::vdb
