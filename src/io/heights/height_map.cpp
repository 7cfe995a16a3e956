#include <quoin/core/assert.h>
#include <quoin/io/heights.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "core/bytes/bytes.h"
#include "io/heights/heights.h"
#include "io/image/image_codecs.h"

namespace quoin {

namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
/// The length of a degree of latitude.
constexpr double kMetresOfDegree = 111'320.0;
/// The edge lengths of .hgt files: three arc-seconds and one.
constexpr std::size_t kHgtEdges[] = {1201, 3601};

std::optional<std::size_t> hgt_edge(std::uint64_t bytes) {
  for (const std::size_t edge : kHgtEdges) {
    if (bytes == 2 * edge * edge) return edge;
  }
  return std::nullopt;
}

std::string_view name_of(HeightEncoding encoding) {
  switch (encoding) {
    case HeightEncoding::Grey:
      return "grey";
    case HeightEncoding::Mapbox:
      return "mapbox";
    case HeightEncoding::Terrarium:
      break;
  }
  return "terrarium";
}

HeightMap read_hgt(std::span<const std::byte> bytes, std::size_t edge) {
  QUOIN_ASSERT(edge > 1 && bytes.size() == 2 * edge * edge, "two bytes for each height");
  constexpr std::int16_t kVoid = -32'768;
  HeightMap map;
  map.format = "hgt";
  map.width = map.height = static_cast<int>(edge);
  map.metres_per_pixel = kMetresOfDegree / static_cast<double>(edge - 1);
  map.metres.resize(edge * edge);
  std::size_t voids = 0;
  for (std::size_t i = 0; i < map.metres.size(); ++i) {
    const auto height = load<std::int16_t>(bytes.data() + 2 * i, std::endian::big);
    voids += height == kVoid ? 1 : 0;
    map.metres[i] = height == kVoid ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(height);
  }
  if (voids > 0) {
    map.warnings.push_back(std::to_string(voids) + " of " + std::to_string(map.metres.size()) +
                           " heights are unknown (voids) and stay empty");
  }
  return map;
}

float metres_of(HeightEncoding encoding, const std::byte* rgb) {
  QUOIN_ASSERT(encoding != HeightEncoding::Grey && rgb != nullptr, "a pixel with three channels");
  const auto r = std::to_integer<std::uint32_t>(rgb[0]);
  const auto g = std::to_integer<std::uint32_t>(rgb[1]);
  const auto b = std::to_integer<std::uint32_t>(rgb[2]);
  const auto number = static_cast<double>(r << 16 | g << 8 | b);
  return static_cast<float>(encoding == HeightEncoding::Mapbox ? number / 10.0 - 10'000.0 : number / 256.0 - 32'768.0);
}

Result<HeightMap> read_image(std::span<const std::byte> bytes, HeightEncoding encoding, double metres_per_level) {
  const auto image = decode_png_samples(bytes);
  if (!image) return image.error();
  const bool is_grey = encoding == HeightEncoding::Grey;
  if (is_grey && image->channels != 1) {
    return make_error(ErrorCode::BadFormat,
                      "the image has colours, and grey heights need a greyscale image (colours: mapbox or terrarium)");
  }
  if (!is_grey && (image->channels != 3 || image->bits != 8)) {
    return make_error(ErrorCode::BadFormat,
                      std::string(name_of(encoding)) + " heights need an RGB image with 8 bits per channel");
  }
  HeightMap map;
  map.format = name_of(encoding);
  map.width = static_cast<int>(image->width);
  map.height = static_cast<int>(image->height);
  map.metres.resize(std::size_t{image->width} * image->height);
  QUOIN_ASSERT(image->bytes.size() == map.metres.size() * image->channels * (image->bits / 8),
               "a sample for each channel");
  const std::byte* const samples = image->bytes.data();
  for (std::size_t i = 0; i < map.metres.size(); ++i) {
    if (!is_grey) {
      map.metres[i] = metres_of(encoding, samples + 3 * i);
      continue;
    }
    const unsigned level = image->bits == 16 ? load<std::uint16_t>(samples + 2 * i, std::endian::big)
                                             : std::to_integer<unsigned>(samples[i]);
    map.metres[i] = static_cast<float>(level * metres_per_level);
  }
  return map;
}

}  // namespace

namespace heights {

bool is_hgt_size(std::uint64_t bytes) {
  return hgt_edge(bytes).has_value();
}

bool is_png(std::span<const std::byte> beginning) {
  return text_of(beginning).starts_with(kPngSignature);
}

Status check(const HeightOptions& options) {
  const auto is_length = [](double length) { return length >= 1e-6 && length <= 1e6; };
  const bool are_lengths = is_length(options.metres_per_level) && is_length(options.metres_per_pixel.value_or(1.0)) &&
                           is_length(options.metres_per_voxel.value_or(1.0)) &&
                           is_length(options.vertical_exaggeration);
  if (!are_lengths) {
    return make_error(
        ErrorCode::InvalidArgument,
        "metres per level, pixel and voxel, and the vertical exaggeration, must be 0.000001 to 1,000,000");
  }
  if (options.depth < 1 || options.depth > kMaxDepth) {
    return make_error(ErrorCode::InvalidArgument,
                      "the ground must be 1 to " + std::to_string(kMaxDepth) + " voxels deep");
  }
  return {};
}

}  // namespace heights

Result<HeightMap> read_height_map(std::span<const std::byte> bytes, const HeightOptions& options) {
  if (auto sound = heights::check(options); !sound) return sound.error();
  if (!options.encoding) {
    if (const auto edge = hgt_edge(bytes.size()); edge && !heights::is_png(bytes)) {
      HeightMap map = read_hgt(bytes, *edge);
      if (options.metres_per_pixel) map.metres_per_pixel = *options.metres_per_pixel;
      return map;
    }
    return make_error(ErrorCode::BadFormat,
                      heights::is_png(bytes)
                          ? "an image needs a height encoding: grey, mapbox or terrarium"
                          : "not an .hgt file, which has 1201 x 1201 or 3601 x 3601 values of 2 bytes");
  }
  if (!heights::is_png(bytes)) return bad_at(0, "not a PNG, which height-map images must be");
  auto map = read_image(bytes, *options.encoding, options.metres_per_level);
  if (!map) return map.error();
  if (options.metres_per_pixel) {
    map->metres_per_pixel = *options.metres_per_pixel;
  } else {
    map->warnings.emplace_back("the pixel distance is unknown and taken as 1 metre (--metres-per-pixel)");
  }
  return map;
}

}  // namespace quoin
