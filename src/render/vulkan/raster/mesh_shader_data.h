#pragma once

#include <array>
#include <cstdint>

#include "render/vulkan/trees/shader_data.h"

namespace quoin::vulkan {

// Mirrors src/render/shaders/raster/mesh.glsl, field by field.

struct ShaderMeshInstance {
  std::array<Vec4, 4> clip{};
  std::array<Vec4, 3> axes{};
  Vec4 eye{0.0F};
  std::array<Vec4, 2> diffuse{};
  IVec4 home{0, 0, 0, -1};
  float room = 0.0F;
  float first_sample = 0.5F;
  std::array<float, 2> far_steps{};
  std::array<std::uint64_t, 2> far_cells{};
  std::array<std::uint32_t, 4> far_near{};
  Vec4 far_centre{0.0F};
};

struct ShaderGlassDraw {
  std::uint64_t data = 0;
  std::uint32_t instance = 0;
  std::uint32_t pad = 0;
  Vec4 offset{0.0F};
  std::uint64_t records = 0;  ///< of the chunk's shapes
  std::uint64_t shapes = 0;   ///< their faces
};

/// A transparent quad, or face of a shape, in the order of drawing.
struct ShaderGlassQuad {
  std::uint32_t draw = 0;
  std::uint32_t quad = 0;  ///< and kGlassIsShape
};
constexpr std::uint32_t kGlassIsShape = std::uint32_t{1} << 31;

struct ShaderMeshFrame {
  std::uint64_t frame = 0;  ///< a ShaderFrame
  std::uint64_t draws = 0;
  std::uint64_t order = 0;
  std::uint64_t pad = 0;
  Vec4 sun{0.0F};
};

// Draw modes in ShaderMeshPush::numbers,
constexpr std::uint32_t kDrawSurfaces = 0;
constexpr std::uint32_t kDrawEdgesOver = 1;
constexpr std::uint32_t kDrawEdgesOnly = 2;
constexpr std::uint32_t kDrawGlass = 3;  ///< and the channel
constexpr std::uint32_t kDrawDepth = 6;  ///< where surfaces are, before they are lit
// for the nearest glass: its depth, the transmittance of each channel, and the added light,
constexpr std::uint32_t kDrawGlassDepth = 7;
constexpr std::uint32_t kDrawGlassPassed = 8;
constexpr std::uint32_t kDrawGlassAdded = 9;
[[nodiscard]] constexpr bool is_channel_of_glass(std::uint32_t mode) {
  return mode >= kDrawGlass && mode < kDrawGlass + 3;
}
[[nodiscard]] constexpr bool is_nearest_glass(std::uint32_t mode) {
  return mode >= kDrawGlassDepth && mode <= kDrawGlassAdded;
}
// and for an impostor the share of pixels, of 2^24, that show the coarser level, and a bit set if this is that level.
// For a smooth mesh with materials, its number of vertices, which the materials follow.
constexpr int kMeshVerticesShift = 4;
constexpr int kMeshShareShift = 4;
constexpr std::uint32_t kMeshIsCoarser = std::uint32_t{1} << 28;
constexpr std::uint32_t kMeshHasCells = std::uint32_t{1} << 29;
// For other content: its types are transparent; only their faces that hide the background are drawn.
constexpr std::uint32_t kMeshIsTransparent = std::uint32_t{1} << 30;
constexpr std::uint32_t kMeshSolidOnly = std::uint32_t{1} << 31;

/// The faces of blocky meshes that a pipeline draws: `kPart` of the shaders.
enum class MeshFaces : std::uint8_t { Quads, Cutouts, Shapes, Mixed };

// Mirrors src/render/shaders/raster/shape.glsl.

/// A face of a shape's model.
struct ShaderShapeRecord {
  std::array<Vec4, 4> corners{};
  Vec4 down{0.0F};
  Vec4 normal{0.0F};
  std::uint64_t texels = 0;
  std::uint32_t bits = 0;
  std::uint32_t tint = 0;
};
constexpr int kAlphaShift = 12;
constexpr std::uint32_t kOwnLook = std::uint32_t{1} << 14;
constexpr int kTypeLookShift = 19;
constexpr std::uint32_t kNoLook = 7;
constexpr int kNormalShift = 22;
constexpr std::uint32_t kIsOpen = std::uint32_t{1} << 25;
constexpr std::uint32_t kIsPlate = std::uint32_t{1} << 26;
constexpr std::uint32_t kIsOnVoxel = std::uint32_t{1} << 27;

/// A visible face of a shape.
struct ShaderShapeFace {
  std::uint32_t bits = 0;
  std::uint32_t type = 0;
};
constexpr std::uint32_t kShapeIsFlipped = std::uint32_t{1} << 26;
constexpr int kRecordHighShift = 27;
constexpr std::size_t kMaxShapeRecords = std::size_t{1} << 21;

struct ShaderMeshPush {
  std::array<Vec4, 4> clip{};
  Vec4 eye{0.0F};
  std::array<float, 3> offset{};
  std::uint32_t instance = 0;
  std::uint64_t frame = 0;
  std::uint64_t data = 0;
  std::uint64_t far_faces = 0;
  float room = 0.0F;
  std::uint32_t numbers = 0;
};

static_assert(sizeof(ShaderMeshInstance) == 240 && sizeof(ShaderGlassDraw) == 48 && sizeof(ShaderGlassQuad) == 8);
static_assert(sizeof(ShaderShapeRecord) == 7 * 16 && sizeof(ShaderShapeFace) == 8);
static_assert(sizeof(ShaderMeshFrame) == 3 * 16 && sizeof(ShaderMeshPush) == 128);

}  // namespace quoin::vulkan
