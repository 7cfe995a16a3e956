#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "render/vulkan/trees/shader_data.h"

namespace quoin::vulkan {

// Mirrors src/render/shaders/paths/path_data.glsl, field by field.

struct ShaderPathFrame {
  Vec4 to_sun{0.0F};
  Vec4 sunlight{0.0F};
  Vec4 sky{0.0F};
  Vec4 background{0.0F};
  Vec4 ground{0.0F};
  Vec4 fog{0.0F};
  Vec4 lens_right{0.0F};
  Vec4 lens_up{0.0F};
  Vec4 environment{0.0F};
  Vec4 air{0.0F};
  std::uint64_t sky_pixels = 0;
  std::uint64_t sky_rows = 0;
  std::uint64_t sky_columns = 0;
  std::uint64_t gloss = 0;
  std::uint64_t lamps = 0;
  std::uint64_t lamp_nodes = 0;
  std::uint64_t lamp_ways = 0;
  std::uint64_t face_keys = 0;
  std::uint64_t face_lamps = 0;
  std::uint64_t states = 0;
  std::uint64_t sums = 0;
  std::uint64_t parts = 0;
  std::int32_t sky_model = 0;
  std::int32_t sky_width = 0;
  std::int32_t sky_height = 0;
  std::uint32_t face_mask = 0;
  std::uint32_t lamp_count = 0;
  std::int32_t max_bounces = 0;
  std::int32_t max_scatterings = 0;
  std::uint32_t seed = 0;
  std::int32_t lens_blades = 0;
  float lens_turn = 0.0F;
  std::uint32_t flags = 0;
  std::uint32_t sum_pitch = 0;
};

// Bits of ShaderPathFrame::flags.
constexpr std::uint32_t kPathGround = 1;
constexpr std::uint32_t kPathOnlyShadows = 2;
constexpr std::uint32_t kPathFog = 4;
constexpr std::uint32_t kPathLayers = 8;
constexpr std::uint32_t kPathMedia = 16;
constexpr std::uint32_t kPathUneven = 32;
constexpr std::uint32_t kPathSun = 64;

struct ShaderPathLamp {
  Vec4 corner{0.0F};
  Vec4 u{0.0F};
  Vec4 v{0.0F};
  Vec4 normal{0.0F};
  Vec4 radiance{0.0F};
  std::uint64_t texels = 0;
  std::uint32_t texel_axes = 0;
  std::uint32_t turn = 0;
  Vec4 light_of_texel{0.0F};
};

struct ShaderLampNode {
  Vec4 low{0.0F};
  Vec4 high{0.0F};
  Vec4 axis{0.0F};
  IVec4 next{-1};
};

constexpr std::size_t kPathStateBytes = 8 * 16;
constexpr std::uint32_t kPathSums = 5;  ///< vectors per pixel
constexpr std::uint32_t kPathSumsWithLayers = 7;

struct PathPush {
  std::uint64_t frame = 0;
  std::int32_t corner_x = 0;
  std::int32_t corner_y = 0;
  std::int32_t size_x = 0;
  std::int32_t size_y = 0;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  std::uint32_t begins = 0;
  std::uint32_t width = 0;
};

static_assert(sizeof(ShaderPathFrame) == 10 * 16 + 12 * 8 + 12 * 4);
static_assert(sizeof(ShaderPathLamp) == 112 && sizeof(ShaderLampNode) == 64 && sizeof(PathPush) == 40);

}  // namespace quoin::vulkan
