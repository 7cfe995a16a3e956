#include "io/minecraft/region/lz4_blocks.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/bytes/bytes.h"

#ifdef QUOIN_HAVE_LZ4
#include <lz4.h>
#endif

namespace quoin::minecraft {

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
