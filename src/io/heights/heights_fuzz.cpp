#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include <quoin/io/heights.h>

/// Reads any bytes as an image in every encoding: the result must be an error, or as many heights as its size says and
/// a landscape of them.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using quoin::HeightEncoding;
  for (const auto encoding : {HeightEncoding::Grey, HeightEncoding::Mapbox, HeightEncoding::Terrarium}) {
    quoin::HeightOptions options;
    options.encoding = encoding;
    const auto map = quoin::read_height_map({reinterpret_cast<const std::byte*>(data), size}, options);
    if (!map) continue;
    if (map->metres.size() != static_cast<std::size_t>(map->width) * static_cast<std::size_t>(map->height)) {
      std::fprintf(stderr, "not as many heights as the size says\n");
      std::abort();
    }
    constexpr std::size_t kMost = 4096;
    if (map->metres.size() > kMost) continue;
    options.metres_per_voxel = 100.0;
    static_cast<void>(quoin::scene_from_heights(*map, options, {1}));
    options.as_field = true;
    static_cast<void>(quoin::scene_from_heights(*map, options, {1}));
  }
  return 0;
}
