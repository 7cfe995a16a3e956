#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <glm/common.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/hash.h>
#include <quoin/core/vec.h>

#include "light/glass_bodies.h"
#include "light/surfaces.h"
#include "render/path/denoise.h"
#include "render/path/kernel/kernel.h"
#include "render/path/path_math.h"

// Shared by the two halves of PathTile: path_tile.cpp has surfaces and light, path_tile_media.cpp has glass, fog and
// clouds.
namespace quoin::path {

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();
inline constexpr float kNoOther = std::numeric_limits<float>::infinity();  // a density without an alternative strategy
inline constexpr std::uint32_t kDimensions = 8;                            // per vertex
inline constexpr std::uint32_t kFog = 0x4000'0000;  // added to a vertex's dimensions for separate random numbers
inline constexpr std::uint32_t kFade = 0x5000'0000;
inline constexpr std::uint32_t kGroundSurface = 2;  // distinct from all results of surface_id

// Returns a direction's bin, below kBins.
inline std::uint32_t bin_of(Vec3 direction) {
  const Vec3 size = glm::abs(direction);
  const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  const float scale = 2.0F / std::max(size[axis], 1e-20F);
  const auto step = [&](float v) {
    return static_cast<std::uint32_t>(std::clamp(static_cast<int>(v * scale + 2.0F), 0, 3));
  };
  const std::uint32_t side = direction[axis] < 0.0F ? 1U : 0U;
  return 1 + (static_cast<std::uint32_t>(axis) * 2 + side) * 16 + step(direction[(axis + 1) % 3]) * 4 +
         step(direction[(axis + 2) % 3]);
}

inline Vec3 tint_of(const Surface& surface, double voxels) {
  const auto length = static_cast<float>(voxels);
  if (!(length > 0.0F)) return Vec3(1.0F);
  Vec3 tint;
  for (int i = 0; i < 3; ++i) {
    // Glass with full coverage transmits no light: the difference of infinities would be NaN.
    const float log = surface.log_clarity > -kNoOther ? surface.log_transmittance[i] - surface.log_clarity : 0.0F;
    tint[i] = exponential(log * length);
  }
  return tint;
}

inline float cover_of(const Surface& surface, double voxels) {
  return voxels > 0.0 ? 1.0F - exponential(surface.log_clarity * static_cast<float>(voxels)) : 0.0F;
}

// Returns a body's length; at least one voxel if its edges must be crisp.
inline double length_of(const Surface& surface, const GlassBody& body) {
  const bool is_soft = body.starts_inside || body.in_field || surface.scattering > 0.0F;
  return std::max(body.voxels, is_soft ? 0.0 : 1.0);
}

// Returns an id for the plane of a voxel's face, or for a field, of one grid and type; odd.
inline std::uint32_t surface_id(IVec3 voxel, Direction face, bool in_field, std::int32_t placed, VoxelType type) {
  const auto plane = in_field ? 0U : static_cast<std::uint32_t>(voxel[frame_of(face).axis]);
  std::uint32_t id = mix_bits(plane ^ (in_field ? 6U : static_cast<std::uint32_t>(face)) << 28);
  id = mix_bits(id ^ static_cast<std::uint32_t>(placed));
  return mix_bits(id ^ static_cast<std::uint32_t>(type)) | 1U;
}

// Returns a free path length in a medium that scatters `density` times per unit length on average.
inline double free_way(float u, double density) {
  QUOIN_ASSERT(u >= 0.0F && u < 1.0F && density > 0.0, "0 <= u < 1, and a positive density");
  return -static_cast<double>(log_of_two(1.0F - u)) * std::numbers::ln2 / density;
}

}  // namespace quoin::path
