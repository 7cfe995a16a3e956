#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace quoin {

/// Writes a picture as an 8-bit RGB PNG, which appears whole or not at all; the same picture gives the same bytes.
/// Returns the file's size; without a path, its bytes.
///
/// The numbers are sRGB, as readers take those of a PNG without colour-space chunks.
/// Errors:   InvalidArgument when the sizes are not positive or `rgb` has not as many bytes as they say; LimitExceeded
///           when a side is longer than a million pixels; CannotWrite.
/// Cost:     some 17 nanoseconds a pixel: 16 ms for 1280 x 720. A smaller file would take more than twice that.
[[nodiscard]] Result<std::uint64_t> write_png(const Image& picture, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_png(const Image& picture);
/// The same with alpha, as RGBA.
[[nodiscard]] Result<std::uint64_t> write_png(const AlphaImage& picture, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_png(const AlphaImage& picture);

/// Reads any PNG as 8-bit RGB; alpha is dropped.
///
/// Errors: CannotRead, BadFormat; LimitExceeded beyond 2^28 pixels. Memory stays within a multiple of the file's size.
[[nodiscard]] Result<Image> read_png(const std::filesystem::path& path);
[[nodiscard]] Result<Image> read_png(std::span<const std::byte> bytes);

/// Writes one float a pixel as a greyscale PFM ("Pf"), little-endian, with rows from the bottom as the format says; the
/// file appears whole or not at all. Every float is kept to the bit, infinity too. Returns the file's size; without a
/// path, its bytes.
///
/// Source: P. Debevec, "PFM Portable FloatMap Image Format".
/// Errors: InvalidArgument when the sizes are not positive or `values` is not as long as they say; CannotWrite.
[[nodiscard]] Result<std::uint64_t> write_pfm(const FloatImage& picture, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_pfm(const FloatImage& picture);

/// Reads a greyscale PFM of either byte order; the size of its scale means nothing here.
///
/// Errors: CannotRead; BadFormat with the byte offset; Unsupported for colour ("PF"). Memory stays within the input's
///         size.
[[nodiscard]] Result<FloatImage> read_pfm(const std::filesystem::path& path);
[[nodiscard]] Result<FloatImage> read_pfm(std::span<const std::byte> bytes);

/// Writes a picture as a JPEG with whole colour in every pixel, which appears whole or not at all; the same picture
/// gives the same bytes on every machine. `quality`: 1 to 100.
///
/// Errors: InvalidArgument as write_png and for the quality; LimitExceeded when a side is longer than 65,500 pixels;
///         Unsupported where the library was built without libjpeg; CannotWrite.
[[nodiscard]] Result<std::uint64_t> write_jpeg(const Image& picture, const std::filesystem::path& path,
                                               int quality = 92);
[[nodiscard]] Result<std::vector<std::byte>> write_jpeg(const Image& picture, int quality = 92);
/// Whether there is libjpeg in this build.
[[nodiscard]] bool has_jpeg();

/// Writes a picture as a WebP without loss, half as large as a PNG or less, likewise.
///
/// Errors: InvalidArgument as write_png; LimitExceeded when a side is longer than 16,383 pixels; Unsupported where the
///         library was built without libwebp; CannotWrite.
/// Cost:   some half a microsecond a pixel.
[[nodiscard]] Result<std::uint64_t> write_webp(const Image& picture, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_webp(const Image& picture);
[[nodiscard]] Result<std::uint64_t> write_webp(const AlphaImage& picture, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_webp(const AlphaImage& picture);
/// Whether there is libwebp in this build.
[[nodiscard]] bool has_webp();

/// Reads linear light: Radiance's .hdr (RGBE) and OpenEXR's .exr, told apart by what they hold. Of an .exr the channels
/// R, G and B, or Y. Numbers are as in the file; an .hdr's exposure is taken back.
///
/// Source: G. Ward, "Real pixels" (Graphics gems II, 1991).
/// Errors: CannotRead; BadFormat; Unsupported for an .exr where the library was built without OpenEXR; LimitExceeded
///         beyond 2^26 pixels. Memory stays within a multiple of the file's size, but for runs of one colour.
[[nodiscard]] Result<RadianceImage> read_radiance(const std::filesystem::path& path);
[[nodiscard]] Result<RadianceImage> read_radiance(std::span<const std::byte> bytes);

/// One channel of an OpenEXR file.
struct ExrChannel {
  enum class Type : std::uint8_t { Float16, Float32, Uint32 };
  std::string name;  ///< "R", "albedo.R", "Z"; readers group by what stands before the last dot
  Type type = Type::Float16;
  std::vector<float> values{};           ///< a number a pixel, of floats; what is too large for a half is its largest
  std::vector<std::uint32_t> numbers{};  ///< of Uint32
};

/// Writes channels of one picture as an OpenEXR file, compressed without loss (ZIP), which appears whole or not at all.
/// Returns the file's size; without a path, its bytes.
///
/// Errors: InvalidArgument when the sizes are not positive, there is no channel, two have one name, or one has not as
///         many numbers as the sizes say; Unsupported where the library was built without OpenEXR; CannotWrite.
[[nodiscard]] Result<std::uint64_t> write_exr(int width, int height, std::span<const ExrChannel> channels,
                                              const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_exr(int width, int height, std::span<const ExrChannel> channels);
/// Whether there is OpenEXR in this build.
[[nodiscard]] bool has_exr();

}  // namespace quoin
