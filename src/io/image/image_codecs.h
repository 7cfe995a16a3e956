#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

/// Completes messages about missing image libraries.
#ifdef QUOIN_WITHOUT_IMAGES
#define QUOIN_IMAGES_OPTION " (QUOIN_WITH_IMAGES=OFF)"
#else
#define QUOIN_IMAGES_OPTION ""
#endif

namespace quoin {

/// Errors: as read_alpha_image.
[[nodiscard]] Result<AlphaImage> decode_jpeg(std::span<const std::byte> bytes);
[[nodiscard]] Result<AlphaImage> decode_webp(std::span<const std::byte> bytes);

/// Reads a greyscale PFM of either byte order. Ignores the magnitude of the scale.
///
/// Errors: CannotRead; BadFormat with the byte offset; Unsupported for colour ("PF"). Memory stays within the input's
///         size.
[[nodiscard]] Result<FloatImage> read_pfm(const std::filesystem::path& path);
[[nodiscard]] Result<FloatImage> read_pfm(std::span<const std::byte> bytes);

inline constexpr std::size_t kMostImagePixels = std::size_t{1} << 28;

/// 8-bit pixels in PNG order: rows from the top, channels interleaved.
struct PngImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t channels = 3;  ///< 3 RGB, 4 RGBA
  std::vector<std::uint8_t> pixels;
};

[[nodiscard]] inline PngImage png_of(const Image& image) {
  return {static_cast<std::uint32_t>(image.width), static_cast<std::uint32_t>(image.height), 3, image.rgb};
}

/// The compression effort for a small file.
enum class PngEffort : std::uint8_t {
  Smallest,  ///< for palettes
  Quick,     ///< for images: a third of the time, some 10 to 20 % more bytes
};

/// Encodes a PNG file without colour-space chunks, so that readers use the numbers unchanged; the same bytes on every
/// run.
///
/// Requires: positive sizes, and `pixels` of matching size.
/// Errors: LimitExceeded if libpng fails (sizes beyond a million, memory).
[[nodiscard]] Result<std::vector<std::byte>> encode_png(const PngImage& image, PngEffort effort = PngEffort::Smallest);

/// Decodes any PNG to RGBA.
///
/// Errors: BadFormat; LimitExceeded beyond 2^28 pixels. Memory stays within a multiple of the input's size.
[[nodiscard]] Result<PngImage> decode_png(std::span<const std::byte> file);

/// The raw samples of an image file, without gamma or scaling.
struct PngSamples {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t channels = 1;  ///< 1 grey, 3 RGB; palettes become colours; alpha is dropped
  std::uint32_t bits = 8;      ///< 8 (also for files with fewer bits) or 16
  std::vector<std::byte>
      bytes;  ///< rows from the top, channels interleaved; 16-bit samples have the more significant byte first
};

/// Errors: as decode_png.
[[nodiscard]] Result<PngSamples> decode_png_samples(std::span<const std::byte> file);

}  // namespace quoin
