#pragma once

#include <cstddef>
#include <span>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace quoin {

/// Decodes a PNG, JPEG or WebP, detected by content, to 8-bit sRGB with alpha.
///
/// Errors: BadFormat; Unsupported for other formats and for formats missing from the build; LimitExceeded beyond 2^28
/// pixels.
[[nodiscard]] Result<AlphaImage> decode_picture(std::span<const std::byte> bytes);

/// Errors: as decode_picture.
[[nodiscard]] Result<AlphaImage> decode_jpeg(std::span<const std::byte> bytes);
[[nodiscard]] Result<AlphaImage> decode_webp(std::span<const std::byte> bytes);

inline constexpr std::size_t kMostPicturePixels = std::size_t{1} << 28;

}  // namespace quoin
