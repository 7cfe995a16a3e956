#include "io/image/decode.h"

#include <string_view>
#include <utility>

#include "core/bytes/bytes.h"
#include "io/image/png.h"

namespace quoin {

Result<AlphaImage> decode_image(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  if (text.starts_with("\x89PNG")) {
    auto decoded = decode_png(bytes);
    if (!decoded) return decoded.error();
    return AlphaImage{static_cast<int>(decoded->width), static_cast<int>(decoded->height), std::move(decoded->pixels)};
  }
  if (text.starts_with("\xFF\xD8\xFF")) return decode_jpeg(bytes);
  if (text.starts_with("RIFF") && text.substr(0, 12).ends_with("WEBP")) return decode_webp(bytes);
  return make_error(ErrorCode::Unsupported, "not a PNG, JPEG or WebP image");
}

}  // namespace quoin
