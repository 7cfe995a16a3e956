#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace quoin {

/// Decodes a PNG, JPEG or WebP, detected by content, to 8-bit sRGB with alpha.
///
/// Errors: BadFormat; Unsupported for other formats and for formats missing from the build; LimitExceeded beyond 2^28
/// pixels.
[[nodiscard]] Result<AlphaImage> decode_image(std::span<const std::byte> bytes);

/// Errors: as decode_image.
[[nodiscard]] Result<AlphaImage> decode_jpeg(std::span<const std::byte> bytes);
[[nodiscard]] Result<AlphaImage> decode_webp(std::span<const std::byte> bytes);

/// Reads a greyscale PFM of either byte order. Ignores the magnitude of the scale.
///
/// Errors: CannotRead; BadFormat with the byte offset; Unsupported for colour ("PF"). Memory stays within the input's
///         size.
[[nodiscard]] Result<FloatImage> read_pfm(const std::filesystem::path& path);
[[nodiscard]] Result<FloatImage> read_pfm(std::span<const std::byte> bytes);

inline constexpr std::size_t kMostImagePixels = std::size_t{1} << 28;

}  // namespace quoin
