#pragma once

#include <array>
#include <cstdint>

#include "render_vk/march/shader_data.h"

namespace quoin::vulkan {

// What src/render_vk/shaders/mesh.glsl declares, field by field.

struct ShaderMeshInstance {
  std::array<Vec4, 4> clip{};
  std::array<Vec4, 3> axes{};
  Vec4 eye{0.0F};
  std::array<std::array<float, 2>, 6> light{};
  float room = 0.0F;
  std::array<float, 3> pad{};
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

struct ShaderMeshFrame {
  Vec4 sky_zenith{0.0F};
  Vec4 sky_horizon{0.0F};
  Vec4 sky_ground{0.0F};
  Vec4 sun{0.0F};
  Vec4 light{0.0F};
  std::uint64_t draws = 0;
  std::uint64_t order = 0;
  float exposure = 1.0F;
  float ground_begins = 0.0F;
  float ground_is_full = 0.0F;
  float pad = 0.0F;
};

// ShaderMeshPush::numbers: what is drawn,
constexpr std::uint32_t kDrawSurfaces = 0;
constexpr std::uint32_t kDrawEdgesOver = 1;
constexpr std::uint32_t kDrawEdgesOnly = 2;
constexpr std::uint32_t kDrawGlass = 3;  ///< and the channel
// flags,
constexpr int kMeshFlagsShift = 4;
constexpr std::uint32_t kMeshLit = 1;
constexpr std::uint32_t kMeshHasOcclusion = 2;
constexpr std::uint32_t kMeshAffectsAll = 4;
constexpr std::uint32_t kMeshShowOcclusion = 8;
constexpr std::uint32_t kMeshShowNormals = 16;
// and the last surface.
constexpr int kMeshLastSurfaceShift = 12;

struct ShaderMeshPush {
  std::array<Vec4, 4> clip{};
  Vec4 eye{0.0F};
  std::array<float, 3> offset{};
  std::uint32_t instance = 0;
  std::uint64_t frame = 0;
  std::uint64_t data = 0;
  std::uint64_t surfaces = 0;
  float room = 0.0F;
  std::uint32_t numbers = 0;
};

static_assert(sizeof(ShaderMeshInstance) == 192 && sizeof(ShaderGlassDraw) == 32 && sizeof(ShaderGlassQuad) == 8);
static_assert(sizeof(ShaderMeshFrame) == 5 * 16 + 2 * 8 + 4 * 4 && sizeof(ShaderMeshPush) == 128);

}  // namespace quoin::vulkan
