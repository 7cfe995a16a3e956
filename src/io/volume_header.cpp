#include "io/volume_header.h"

#include <limits>
#include <string>

namespace quoin {

namespace {

struct TypeInfo {
  std::string_view name;
  std::size_t bytes;
};

/// In the order of ScalarType.
constexpr std::array<TypeInfo, 10> kTypes = {{{"uint8", 1},
                                              {"int8", 1},
                                              {"uint16", 2},
                                              {"int16", 2},
                                              {"uint32", 4},
                                              {"int32", 4},
                                              {"uint64", 8},
                                              {"int64", 8},
                                              {"float32", 4},
                                              {"float64", 8}}};

glm::dmat4 from_columns(DVec3 x, DVec3 y, DVec3 z) {
  return {glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(0, 0, 0, 1)};
}

}  // namespace

std::string_view name_of(ScalarType type) {
  return kTypes[static_cast<std::size_t>(type)].name;
}

std::size_t bytes_of(ScalarType type) {
  return kTypes[static_cast<std::size_t>(type)].bytes;
}

glm::dmat4 quoin_from_space(VolumeSpace space) {
  switch (space) {
    case VolumeSpace::RightFrontHead:
      return from_columns({-1, 0, 0}, {0, 0, 1}, {0, 1, 0});
    case VolumeSpace::LeftFrontHead:
    case VolumeSpace::LeftHanded:
      return from_columns({1, 0, 0}, {0, 0, 1}, {0, 1, 0});
    case VolumeSpace::LeftBackHead:
    case VolumeSpace::RightHanded:
      break;
  }
  return from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0});
}

std::string text_of_size(IVec3 size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y) + " x " + std::to_string(size.z);
}

Status set_size(const std::array<std::int64_t, 3>& extents, const VolumeOptions& options,
                std::optional<std::uint64_t> byte_offset, Volume& volume) {
  std::int64_t room = std::min<std::int64_t>(options.most_values, std::numeric_limits<std::int64_t>::max() / 8);
  std::string text;
  for (const std::int64_t extent : extents) {
    text += (text.empty() ? "" : " x ") + std::to_string(extent);
    // Rounding down twice is rounding down once.
    room = extent > std::numeric_limits<std::int32_t>::max() ? 0 : room / extent;
  }
  if (room < 1) {
    return fail(ErrorCode::LimitExceeded,
                "it claims " + text + " values; at most " + std::to_string(options.most_values) + " are read", {},
                byte_offset);
  }
  for (int axis = 0; axis < 3; ++axis) {
    volume.size[axis] = static_cast<std::int32_t>(extents[static_cast<std::size_t>(axis)]);
  }
  return {};
}

}  // namespace quoin
