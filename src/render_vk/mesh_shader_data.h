#pragma once

#include <array>
#include <cstdint>

#include "render_vk/shader_data.h"

namespace quoin::vulkan {

// What src/render_vk/shaders/mesh.glsl declares, field by field.

struct ShaderMeshInstance {
  std::array<Vec4, 4> clip{};
  std::array<Vec4, 3> axes{};
  std::array<Vec4, 2> diffuse{};
  Vec4 eye{0.0F};
  Vec4 room{0.0F};
};

struct ShaderGlassDraw {
  std::uint64_t data = 0;
  std::uint32_t instance = 0;
  std::uint32_t pad = 0;
  Vec4 offset{0.0F};
};

/// A transparent quad in the order of drawing.
struct ShaderGlassQuad {
  std::uint32_t draw = 0;
  std::uint32_t quad = 0;
};

// Bits of ShaderMeshFrame::flags.
constexpr std::uint32_t kMeshLit = 1;
constexpr std::uint32_t kMeshHasOcclusion = 2;
constexpr std::uint32_t kMeshAffectsAll = 4;
constexpr std::uint32_t kMeshShowOcclusion = 8;
constexpr std::uint32_t kMeshShowNormals = 16;

struct ShaderMeshFrame {
  Vec4 right{0.0F};
  Vec4 down{0.0F};
  Vec4 corner{0.0F};
  Vec4 forward{0.0F};
  Vec4 sky_zenith{0.0F};
  Vec4 sky_horizon{0.0F};
  Vec4 sky_ground{0.0F};
  Vec4 sun{0.0F};
  Vec4 light{0.0F};
  std::uint64_t surfaces = 0;
  std::uint64_t instances = 0;
  std::uint64_t draws = 0;
  std::uint64_t pad = 0;
  std::uint32_t last_surface = 0;
  std::uint32_t flags = 0;
  float exposure = 1.0F;
  float ground_begins = 0.0F;
  float ground_is_full = 0.0F;
  float sky_scale = 1.0F;
  std::array<std::uint32_t, 2> pads{};
};

// ShaderMeshPush::what.
constexpr std::uint32_t kDrawSurfaces = 0;
constexpr std::uint32_t kDrawEdgesOver = 1;
constexpr std::uint32_t kDrawEdgesOnly = 2;
constexpr std::uint32_t kDrawGlass = 3;  ///< and the channel

struct ShaderMeshPush {
  std::uint64_t frame = 0;
  std::uint64_t data = 0;
  std::array<float, 3> offset{};
  std::uint32_t instance = 0;
  std::uint64_t order = 0;
  std::uint32_t what = 0;
  std::uint32_t pad = 0;
};

static_assert(sizeof(ShaderMeshInstance) == 176 && sizeof(ShaderGlassDraw) == 32 && sizeof(ShaderGlassQuad) == 8);
static_assert(sizeof(ShaderMeshFrame) == 9 * 16 + 4 * 8 + 8 * 4 && sizeof(ShaderMeshPush) == 48);

}  // namespace quoin::vulkan
