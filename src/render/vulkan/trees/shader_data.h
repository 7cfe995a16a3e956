#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <quoin/core/vec.h>
#include <quoin/grid/texture.h>

namespace quoin::vulkan {

// Mirrors src/render/shaders/data.glsl, field by field.

using Vec4 = glm::vec4;
using IVec4 = glm::ivec4;

[[nodiscard]] inline Vec4 to_vec4(DVec3 v, double w = 0.0) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)};
}

/// Edge of a density block: a field chunk's record has, for each word of 4^3 cells at the surface, the samples from one
/// before its first corner to one past its last, along each axis.
constexpr int kFieldBlockEdge = 7;
constexpr std::size_t kFieldBlockWords = 172;  ///< two halves per word
/// Edge of a body block: a record of a field's transparent part also has, after the densities, the bodies of the cells'
/// corners. A word of cells of one type has the type's number instead of a block's.
constexpr int kGlassBlockEdge = 5;
constexpr std::size_t kGlassBlockWords = 63;      ///< two numbers per word
constexpr std::uint32_t kOpaqueBody = 0xFFFF;     ///< no type's number
constexpr std::uint32_t kIsUniform = 0x80000000;  ///< the other bits are a type

/// A node of a sparse tree with 4^3 children per node; see data.glsl.
struct Node {
  std::uint64_t mask = 0;      ///< bit x + 4 y + 16 z: that child exists
  std::uint64_t children = 0;  ///< the address of the first child; odd: the node is full and has none
  bool operator==(const Node&) const = default;
};

struct ShaderTree {
  Node root;
  IVec4 low{0};
  IVec4 high{0};
};

struct ShaderGrid {
  ShaderTree opaque;
  ShaderTree transparent;
  ShaderTree field;
  ShaderTree glass;
};

/// The shapes of a grid, by the voxels that they touch; see shapes.glsl.
struct ShaderShapes {
  ShaderTree touched;
  ShaderTree glass;  ///< of shapes with glass
};

/// A shape in the list of a voxel that it touches.
struct ShaderShape {
  std::uint32_t what = 0;   ///< its type, and kShapeIsOpaque; packing adds its place and kShapeIsLast
  std::uint32_t model = 0;  ///< index in the table of vectors
};
constexpr std::uint32_t kShapePlace = 16;  ///< bits
constexpr std::uint32_t kShapeIsLast = 1U << 21;
constexpr std::uint32_t kShapeIsOpaque = 1U << 22;

// The table of vectors of shapes' models: sizes, and flags of sides.
constexpr std::uint32_t kBoxVectors = 3;
constexpr std::uint32_t kSideVectors = 5;
constexpr std::uint32_t kNoSide = 0xFFFF;
constexpr std::uint32_t kSideHides = 1U << 4;
constexpr std::uint32_t kSideIsCutout = 1U << 5;
constexpr std::uint32_t kSideHasLook = 1U << 6;
constexpr std::uint32_t kSideHasTexels = 1U << 7;
constexpr std::uint32_t kSideIsGlass = 1U << 8;
constexpr std::uint32_t kSideIsOnVoxel = 1U << 9;
constexpr std::uint32_t kSideIsTilted = 1U << 10;
constexpr std::uint32_t kSideIsLamp = 1U << 11;
constexpr std::uint32_t kSideDirection = 12;  ///< bits

struct ShaderPlaced {
  std::array<Vec4, 3> grid_axes{};
  std::array<Vec4, 3> view_axes{};
  IVec4 ref_base{0};
  Vec4 ref_inside{0.0F};
  Vec4 ref_view{0.0F};
  IVec4 start_base{0};
  Vec4 start{0.0F};
  Vec4 start_x{0.0F};
  Vec4 start_y{0.0F};
  Vec4 to_sun{0.0F};
  std::array<Vec4, 2> diffuse{};
  Vec4 detail_colour{0.0F};
  std::array<Vec4, 3> grid_axes_low{};
  Vec4 start_low{0.0F};
  Vec4 start_x_low{0.0F};
  Vec4 start_y_low{0.0F};
  IVec4 origin{0};
};

// Mirrors src/render/shaders/direct_light.glsl; bricks are LampTable::Brick.
struct ShaderLamp {
  Vec4 position{0.0F};
  std::array<Vec4, 3> axes{};
  std::array<Vec4, 6> power{};
  Vec4 low{0.0F};
  Vec4 high{0.0F};
  Vec4 direction{0.0F};
};

/// A rectangle of a level of an impostor; see far.glsl.
struct ShaderFarFace {
  Vec4 centre{0.0F};
  std::uint32_t face = 0;
  std::uint32_t views = 0;
  std::uint32_t direction = 0;
  float along_v = 0.0F;
};

struct ShaderVoxelFace {
  IVec3 voxel{0};
  std::uint32_t what = 0;
};

/// The surface in a cube of 4^3 bits.
struct ShaderFarCell {
  Vec4 corner{0.0F};
  std::uint64_t bits = 0;
  std::array<std::uint32_t, 26> face{};
};

struct ShaderFarLevel {
  std::uint64_t faces = 0;
  std::uint32_t count = 0;
  std::uint32_t sides = 0;
  std::uint64_t cells = 0;  ///< 0: faces themselves
  float step = 0.0F;
  std::uint32_t pad = 0;
};

struct ShaderFar {
  Vec4 point{0.0F};
  Vec4 point_x{0.0F};
  Vec4 point_y{0.0F};
  Vec4 direction{0.0F};
  Vec4 direction_x{0.0F};
  Vec4 direction_y{0.0F};
  Vec4 across{0.0F};
  Vec4 down{0.0F};
  Vec4 ahead{0.0F};
  Vec4 at{0.0F};
  Vec4 centre{0.0F};
  IVec4 area{0};
  IVec4 origin{0};
  ShaderFarLevel level;
  ShaderFarLevel coarser;
  ShaderFarLevel unseen;
  std::array<std::uint32_t, 4> near{};
  std::uint64_t faces = 0;
  std::uint32_t first_number = 0;
  std::uint32_t voxel_faces = 0;
};

struct ShaderFarPart {
  std::uint32_t draw =
      0;  ///< four times the impostor, plus the part: 0 its level, 1 the coarser one, 2 the unseen faces
  std::uint32_t first_group = 0;
};

// Bits of ShaderFrame::flags.
constexpr std::uint32_t kPerspective = 1;
constexpr std::uint32_t kLit = 2;
constexpr std::uint32_t kShadows = 4;
constexpr std::uint32_t kOcclusionRays = 8;
constexpr std::uint32_t kOcclusionVertex = 16;
constexpr std::uint32_t kAffectsAll = 32;
constexpr std::uint32_t kFixedDirections = 64;
constexpr std::uint32_t kDetailColours = 128;
constexpr std::uint32_t kUnlitOcclusion = 256;
constexpr std::uint32_t kShowOcclusion = 512;
constexpr std::uint32_t kShowNormals = 1024;
constexpr std::uint32_t kLamps = 2048;
constexpr std::uint32_t kGlassSurfaces = 4096;
constexpr std::uint32_t kPropagated = 8192;
constexpr std::uint32_t kUnoccluding = 16384;

constexpr std::uint32_t kBodies = 16;
constexpr std::size_t kPointBytes = 48;
constexpr std::size_t kBodyBytes = 48;
constexpr std::size_t kStateBytes = 32;
constexpr std::size_t kSumBytes = 16;

struct ShaderCounters {
  std::uint32_t rays_low = 0;
  std::uint32_t rays_high = 0;
  std::uint32_t hits = 0;
  std::uint32_t pending = 0;

  [[nodiscard]] std::int64_t rays() const {
    return static_cast<std::int64_t>(rays_low | std::uint64_t{rays_high} << 32);
  }
};

struct ShaderFrame {
  Vec4 right{0.0F};
  Vec4 down{0.0F};
  Vec4 corner{0.0F};
  Vec4 forward{0.0F};
  Vec4 start{0.0F};
  Vec4 start_x{0.0F};
  Vec4 start_y{0.0F};
  Vec4 right_low{0.0F};
  Vec4 down_low{0.0F};
  Vec4 corner_low{0.0F};
  Vec4 forward_low{0.0F};
  Vec4 sky_zenith{0.0F};
  Vec4 sky_horizon{0.0F};
  Vec4 sky_ground{0.0F};
  Vec4 light{0.0F};
  Vec4 ambient{0.0F};
  Vec4 sun{0.0F};
  Vec4 level_sky{0.0F};
  Vec4 level_lamps{0.0F};
  Vec4 level_least{0.0F};
  std::uint64_t placed = 0;
  std::uint64_t grids = 0;
  std::uint64_t tree = 0;
  std::uint64_t leaves = 0;
  std::uint64_t surfaces = 0;
  std::uint64_t directions = 0;
  std::uint64_t turns = 0;
  std::uint64_t thresholds = 0;
  std::uint64_t points = 0;
  std::uint64_t bodies = 0;
  std::uint64_t sun_bodies = 0;
  std::uint64_t states = 0;
  std::uint64_t sums = 0;
  std::uint64_t colours = 0;
  std::uint64_t depths = 0;
  std::uint64_t counters = 0;
  std::uint64_t fars = 0;
  std::uint64_t far_parts = 0;
  std::uint64_t far_depths = 0;
  std::uint64_t far_numbers = 0;
  std::uint64_t lamps = 0;
  std::uint64_t lamp_bricks = 0;
  std::uint64_t lamp_lists = 0;
  std::uint64_t light_bricks = 0;
  std::uint64_t light_numbers = 0;
  std::uint64_t light_pad = 0;
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::uint32_t flags = 0;
  std::uint32_t placed_count = 0;
  std::uint32_t last_surface = 0;
  std::int32_t occlusion_count = 0;
  float occlusion_distance = 0.0F;
  float shadow_distance = 0.0F;
  float exposure = 1.0F;
  float samples = 1.0F;
  float ground_begins = 0.0F;
  float ground_is_full = 0.0F;
  float view_depth = 0.0F;
  float sky_scale = 0.0F;
  float lift = 0.0F;
  std::uint32_t far_count = 0;
  std::uint32_t lamp_mask = 0;
  std::uint32_t light_mask = 0;
  std::uint64_t paths = 0;
  std::uint64_t texture_numbers = 0;
  std::uint64_t textured_faces = 0;
  std::uint64_t shape_grids = 0;
  std::uint64_t shape_models = 0;
  std::uint64_t shape_means = 0;
  std::uint32_t shaped_grids = 0;
  std::uint32_t pad = 0;
};

// Bits of a type's entry in the table of texture numbers; see data.glsl.
constexpr std::uint32_t kTextureNumber = 0xFFFF;
constexpr std::uint32_t kTextureTurn = 16;  ///< first bit of `state_turn` for state 0
constexpr std::uint32_t kIsTexturedGlass = 1U << 25;
constexpr std::uint32_t kIsCellOfFaces = 1U << 26;
constexpr std::uint32_t kHidesFaces = 1U << 30;
constexpr std::uint32_t kIsTurnedByState = 1U << 31;

/// A face of a type with textures; see data.glsl.
struct ShaderTexturedFace {
  std::uint64_t texels = 0;
  std::uint32_t shape = 0;
  std::uint32_t packed_tint = 0;
  Vec4 tint{0.0F};
  std::uint32_t on_fields = 0;
  std::array<std::uint32_t, 3> pad{};
};

struct ShaderPush {
  std::uint64_t frame = 0;
  std::int32_t corner_x = 0;
  std::int32_t corner_y = 0;
  std::int32_t size_x = 0;
  std::int32_t size_y = 0;
  float point_x = 0.5F;
  float point_y = 0.5F;
  float point_low_x = 0.0F;
  float point_low_y = 0.0F;
  float turn_cosine = 1.0F;
  float turn_sine = 0.0F;
  std::array<float, 3> upright{0.0F, 0.0F, 1.0F};
  std::uint32_t seed = 0;
  std::uint32_t first = 0;
  std::uint32_t round = 0;
  std::uint32_t base = 0;
  std::uint32_t pitch = 0;
  std::uint32_t far_first = 0;
  std::uint32_t far_count = 0;
  std::uint32_t far_groups = 0;
  std::uint32_t sample = 0;
  std::uint32_t pad = 0;
};

// Mirrors src/render/shaders/swap.comp.
struct SwapPush {
  std::uint64_t from = 0;
  std::uint64_t to = 0;
  std::uint32_t pixels = 0;
  std::uint32_t across = 0;
};

static_assert(sizeof(SwapPush) == 24);
static_assert(sizeof(Node) == 16 && sizeof(ShaderTree) == 48 && sizeof(ShaderGrid) == 192 &&
              sizeof(ShaderShapes) == 96);
static_assert(sizeof(ShaderFarFace) == 32 && sizeof(ShaderVoxelFace) == 16 && sizeof(ShaderFar) == 21 * 16 &&
              sizeof(ShaderFarCell) == 128);
static_assert(sizeof(ShaderPlaced) == 384 && sizeof(ShaderFrame) == 20 * 16 + 31 * 8 + 22 * 4);
static_assert(sizeof(ShaderLamp) == 13 * 16 && sizeof(ShaderTexturedFace) == 48);
static_assert(sizeof(ShaderPush) == 104 && sizeof(ShaderCounters) == 16);

/// Returns a colour as `unpackUnorm4x8` in shaders reads it.
[[nodiscard]] inline std::uint32_t packed_colour(Rgba8 colour) {
  return colour.r | std::uint32_t{colour.g} << 8 | std::uint32_t{colour.b} << 16 | std::uint32_t{colour.a} << 24;
}

/// Packs -1 to 1 in 16 bits.
[[nodiscard]] inline std::uint32_t signed_16(float value) {
  const float scaled = std::round(std::clamp(value, -1.0F, 1.0F) * 32767.0F);
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(scaled)) & 0xFFFF;
}

/// Packs a unit vector into a word, with precision 1/20,000: the octahedron's faces folded into a square. `unit_vector`
/// in shaders/data.glsl reads it.
[[nodiscard]] inline std::uint32_t octahedral(Vec3 v) {
  const float size = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
  if (!(size > 0.0F)) return 0;
  v /= size;
  const auto fold = [](float a, float b) { return (1.0F - std::abs(b)) * (a >= 0.0F ? 1.0F : -1.0F); };
  const float x = v.z >= 0.0F ? v.x : fold(v.x, v.y);
  const float y = v.z >= 0.0F ? v.y : fold(v.y, v.x);
  return signed_16(x) | signed_16(y) << 16;
}

}  // namespace quoin::vulkan
