// Cube World models: three sizes, and three bytes per voxel; black is empty.

#include <cstdint>
#include <span>
#include <utility>

#include "core/bytes/bytes.h"
#include "io/format_driver.h"
#include "io/models/model_builder.h"

namespace quoin::models {

namespace {

bool is_cub(std::span<const std::byte> whole) {
  ByteReader reader(whole);
  std::uint64_t volume = 3;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t edge = reader.u32();
    if (edge == 0 || edge > static_cast<std::uint32_t>(kMaxEdge)) return false;
    volume *= edge;
  }
  return !reader.failed() && volume == reader.remaining();
}

// x changes fastest, then the second ground axis, then the height. Rotated so that up is +y.
Result<LoadedScene> read_cub(std::span<const std::byte> bytes) {
  if (!is_cub(bytes)) return bad_at(0, "the file size does not match the model's three sizes");
  ByteReader reader(bytes);
  const auto width = static_cast<int>(reader.u32());
  const auto depth = static_cast<int>(reader.u32());
  const auto height = static_cast<int>(reader.u32());
  ModelBuilder builder;
  Model model;
  model.canvas = {IVec3(0), {width, height, depth}};
  builder.begin(std::move(model));
  for (int y = 0; y < height; ++y) {
    for (int z = depth - 1; z >= 0; --z) {
      for (int x = 0; x < width; ++x) {
        const auto rgb = reader.take(3);
        const Rgba8 colour{static_cast<std::uint8_t>(rgb[0]), static_cast<std::uint8_t>(rgb[1]),
                           static_cast<std::uint8_t>(rgb[2]), 255};
        if (colour.r == 0 && colour.g == 0 && colour.b == 0) continue;
        if (auto put = builder.put({x, y, z}, colour); !put) return put.error();
      }
    }
  }
  return builder.take("cub");
}

}  // namespace

}  // namespace quoin::models

namespace quoin {

extern constinit const FormatDriver kCubeWorldFormat = {
    .info = {FileFormat::CubeWorld, ".cub", "Cube World model", FormatCapability::Read},
    .detect_whole = models::is_cub,
    .read = [](const FormatInput& input) { return models::read_cub(input.bytes); },
};

}  // namespace quoin
