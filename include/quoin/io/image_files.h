#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace [[gnu::visibility("default")]] quoin {

/// Writes an 8-bit RGB PNG, atomically. The same image always gives the same bytes. Returns the file's size; the
/// overload without a path returns the bytes.
///
/// Space:  sRGB, the default for a PNG without colour-space chunks.
/// Errors: InvalidArgument if the sizes are not positive or do not match the length of `rgb`; LimitExceeded if a side
///         is longer than a million pixels; CannotWrite.
/// Cost:   about 17 ns per pixel: 16 ms for 1280 x 720. Smaller files would take more than twice as long.
[[nodiscard]] Result<std::uint64_t> write_png(const Image& image, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_png(const Image& image);
/// Writes an 8-bit RGBA PNG; otherwise as above.
[[nodiscard]] Result<std::uint64_t> write_png(const AlphaImage& image, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_png(const AlphaImage& image);

/// Reads any PNG as 8-bit RGB and drops alpha.
///
/// Errors: CannotRead, BadFormat; LimitExceeded beyond 2^28 pixels. Memory stays within a multiple of the file's size.
[[nodiscard]] Result<Image> read_png(const std::filesystem::path& path);
[[nodiscard]] Result<Image> read_png(std::span<const std::byte> bytes);

/// Reads a PNG, JPEG or WebP, detected by content, as 8-bit sRGB with alpha: the images of textures.
///
/// Errors: CannotRead; BadFormat; Unsupported for other formats and for formats missing from the build; LimitExceeded
///         beyond 2^28 pixels. Memory stays within a multiple of the file's size, except for images of one colour.
[[nodiscard]] Result<AlphaImage> read_alpha_image(const std::filesystem::path& path);
[[nodiscard]] Result<AlphaImage> read_alpha_image(std::span<const std::byte> bytes);

/// Writes one float per pixel as a greyscale PFM ("Pf"), atomically. The file is little-endian with rows from the
/// bottom, as the format defines. Floats are stored exactly, including infinity. Returns the file's size; the overload
/// without a path returns the bytes.
///
/// Source: P. Debevec, "PFM Portable FloatMap Image Format".
/// Errors: InvalidArgument if the sizes are not positive or do not match the length of `values`; CannotWrite.
[[nodiscard]] Result<std::uint64_t> write_pfm(const FloatImage& image, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_pfm(const FloatImage& image);

/// Writes a JPEG without chroma subsampling, atomically. The same image gives the same bytes on every machine.
/// `quality`: 1 to 100.
///
/// Errors: InvalidArgument as write_png, and for a quality out of range; LimitExceeded if a side is longer than 65,500
///         pixels; Unsupported in builds without libjpeg; CannotWrite.
[[nodiscard]] Result<std::uint64_t> write_jpeg(const Image& image, const std::filesystem::path& path, int quality = 92);
[[nodiscard]] Result<std::vector<std::byte>> write_jpeg(const Image& image, int quality = 92);
/// Returns true if this build includes libjpeg.
[[nodiscard]] bool has_jpeg();

/// The time that a lossless WebP takes.
enum class WebPEffort : std::uint8_t {
  Small,  ///< about 0.5 microseconds per pixel
  Quick,  ///< about 0.02 microseconds per pixel; a quarter larger for rendered images, no larger for maps
};

/// Writes a lossless WebP, atomically; about half the size of a PNG. The same image gives the same bytes. With
/// WebPEffort::Quick, pixels with alpha 0 also keep their colours.
///
/// Errors: InvalidArgument as write_png; LimitExceeded if a side is longer than 16,383 pixels; Unsupported in builds
///         without libwebp; CannotWrite.
[[nodiscard]] Result<std::uint64_t> write_webp(const Image& image, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_webp(const Image& image);
[[nodiscard]] Result<std::uint64_t> write_webp(const AlphaImage& image, const std::filesystem::path& path,
                                               WebPEffort effort = WebPEffort::Small);
[[nodiscard]] Result<std::vector<std::byte>> write_webp(const AlphaImage& image, WebPEffort effort = WebPEffort::Small);
/// Returns true if this build includes libwebp.
[[nodiscard]] bool has_webp();

/// Reads linear light from Radiance .hdr (RGBE) or OpenEXR .exr, detected by content. From an .exr, reads the channels
/// R, G and B, or Y. Values are as stored, except that the exposure of an .hdr is undone.
///
/// Source: G. Ward, "Real pixels" (Graphics gems II, 1991).
/// Errors: CannotRead; BadFormat; Unsupported for an .exr in builds without OpenEXR; LimitExceeded beyond 2^26 pixels.
///         Memory stays within a multiple of the file's size, except for runs of one colour.
[[nodiscard]] Result<RadianceImage> read_radiance(const std::filesystem::path& path);
[[nodiscard]] Result<RadianceImage> read_radiance(std::span<const std::byte> bytes);

/// One channel of an OpenEXR file.
struct ExrChannel {
  enum class Type : std::uint8_t { Float16, Float32, Uint32 };
  std::string name;  ///< "R", "albedo.R", "Z"; readers group channels by the text before the last dot
  Type type = Type::Float16;
  std::vector<float> values{};  ///< one per pixel, for Float16 and Float32; Float16 clamps to its largest value
  std::vector<std::uint32_t> numbers{};  ///< for Uint32
};

/// Writes channels as one OpenEXR file with lossless compression (ZIP), atomically. Returns the file's size; the
/// overload without a path returns the bytes.
///
/// Errors: InvalidArgument if the sizes are not positive, there are no channels, two have the same name, or a channel's
///         length does not match the sizes; Unsupported in builds without OpenEXR; CannotWrite.
[[nodiscard]] Result<std::uint64_t> write_exr(int width, int height, std::span<const ExrChannel> channels,
                                              const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::byte>> write_exr(int width, int height, std::span<const ExrChannel> channels);
/// Returns true if this build includes OpenEXR.
[[nodiscard]] bool has_exr();

}  // namespace quoin
