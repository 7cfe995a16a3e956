#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/gtc/type_ptr.hpp>
#include <glm/vec4.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/trace/ray.h>

namespace quoin {

class ShapeIndex;

/// The shading properties of a voxel type, in linear light.
struct Surface {
  Vec3 colour{0.0F};
  Vec3 emitted{0.0F};     ///< colour * emission
  float emission = 0.0F;  ///< of the type (emission_of); textured faces and shapes have shares of it
  /// Natural logarithms of the transmittance per voxel length: per channel, and for the share that passes without tint.
  /// 0 if clear; minus infinity if opaque.
  Vec3 log_transmittance{0.0F};
  float log_clarity = 0.0F;
  float ior = 1.0F;        ///< transparent types: see glass_ior; others: air
  float roughness = 1.0F;  ///< VoxelProperties::roughness clamped to [0, 1]; 1 for NaN
  float metalness = 0.0F;  ///< VoxelProperties::metalness clamped to [0, 1]; 0 for NaN
  /// VoxelProperties::scattering of a transparent type; 0 with Clouds::AsGlass.
  float scattering = 0.0F;
  float anisotropy = 0.0F;  ///< -0.99 to 0.99
};

/// Returns the index of refraction used to draw and export a transparent type. Returns nothing if the type's own value
/// is invalid: less than that of air, infinite or NaN.
[[nodiscard]] std::optional<float> glass_ior(const VoxelProperties& properties);

/// Returns the emission of a type, as a multiple of its colour: 0 for negative values and NaN, finite.
[[nodiscard]] float emission_of(const VoxelProperties& properties);

/// Sets the transmittance per voxel length of a transparent surface from its colour and alpha.
void set_absorption(float alpha, Surface& surface);

/// Treatment of types that scatter light inside.
enum class Clouds : std::uint8_t {
  AsGlass,
  Scatter,  ///< no refraction, tint or absorption; `log_clarity` is the unscattered light
};

/// The content of the cells of a transparent type, for rays.
enum class CellContent : std::uint8_t {
  Glass,  ///< one colour; also the kind of opaque types
  /// All faces are translucent: glass with the colour and alpha of the texel where a ray enters it.
  TexturedGlass,
  /// Any other textured type: a hollow cell, whose faces a ray meets one by one (meet_cell).
  Faces,
};

/// The number of texels of the levels with at most 2^i texels per side, by i.
inline constexpr std::array<std::uint32_t, 11> kTexelsUpTo = [] {
  static_assert(kMaxTextureSize == 1 << 10);
  std::array<std::uint32_t, 11> sums{1};
  for (std::size_t i = 1; i < sums.size(); ++i) sums[i] = sums[i - 1] + (1U << 2U * i);
  return sums;
}();

/// A textured face, ready for lookups of texels.
struct FaceTexels {
  const Rgba8* texels = nullptr;  ///< of all mipmap levels, level 0 first
  const float* linear = nullptr;  ///< linear light by sRGB byte
  std::uint8_t log_size = 0;      ///< of level 0; also the number of the last level
  FaceAlpha alpha = FaceAlpha::Opaque;
  std::array<std::uint8_t, 2> axis{};  ///< of the grid, along the texture's rows and down its columns
  std::array<double, 2> scale{};       ///< texels of level 0 per voxel along the axis, negative against it
  std::array<double, 2> offset{};      ///< texels from the texture's edge to the voxel's lower side
  std::uint32_t last = 0;              ///< the last row and column of level 0
  float emission = 0.0F;               ///< the face's share of the type's
  Vec3 tint{1.0F};

  /// Returns the texel that `texel_at` returns for a position on the face, in the grid. `level`: 0 to `log_size`.
  [[nodiscard]] Rgba8 texel(const DVec3& position, const IVec3& voxel, int level) const {
    QUOIN_ASSERT(level >= 0 && level <= log_size, "a level of the texture");
    // Coarser levels have the same texels, by powers of two. NaN gives the first one.
    const auto along = [&](std::size_t i) {
      const double share = glm::value_ptr(position)[axis[i]] - glm::value_ptr(voxel)[axis[i]];
      const double at = share * scale[i] + offset[i];
      return std::min(static_cast<std::uint32_t>(std::max(0.0, at)), last) >> level;
    };
    return texels[begin(level) + (along(1) << (log_size - level)) + along(0)];
  }
  /// Returns the index of a level's first texel.
  [[nodiscard]] std::uint32_t begin(int level) const {
    return kTexelsUpTo[log_size] - kTexelsUpTo[static_cast<std::size_t>(log_size - level)];
  }
  /// Returns the texel's tinted colour in linear light.
  [[nodiscard]] Vec3 colour(Rgba8 texel) const {
    return Vec3(linear[texel.r], linear[texel.g], linear[texel.b]) * tint;
  }
  /// Returns the tinted mean of the texture, weighted by alpha: its last mipmap level.
  [[nodiscard]] Vec3 mean() const { return colour(texels[begin(log_size)]); }
  /// Returns the share of the light behind it that a texel hides, 0 to 1.
  [[nodiscard]] float cover(Rgba8 texel) const {
    if (alpha == FaceAlpha::Translucent) return static_cast<float>(texel.a) / 255.0F;
    return alpha == FaceAlpha::Opaque || texel.a >= kCutoutAlpha ? 1.0F : 0.0F;
  }
};

/// Returns the mipmap level of a texture with 2^log_size texels per side, for samples whose distance has this square,
/// in sides of the texture. The level is log2 of the texels between samples, rounded. That is half the exponent of
/// twice their square, plus the texture's own size.
[[nodiscard]] inline int mipmap_level(double square, int log_size) {
  const auto exponent = static_cast<int>(std::bit_cast<std::uint64_t>(2.0 * square) >> 52 & 0x7FF) - 1023;
  return std::clamp((exponent >> 1) + log_size, 0, log_size);
}

/// Returns the tinted mean of a face's texture in linear light, weighted by alpha: its last mipmap level. Without a
/// texture, the tint.
[[nodiscard]] Vec3 mean_colour(const VoxelFace& face);

/// Prepares a face. `emission`: of the type. Lifetime: that of its texture. Requires: the face has one.
[[nodiscard]] FaceTexels face_texels(const VoxelFace& face, Direction direction, float emission);

/// Returns true if a side of a shape emits, can be seen, and rays end at it. `look`: of the side (look_of).
[[nodiscard]] bool is_emitting_side(const ModelFace& side, const VoxelFace* look, const VoxelProperties& type);

/// Returns true if path tracing samples a side of a shape as a lamp: an emitting side that is a rectangle.
[[nodiscard]] bool is_lamp_side(const ModelFace& side, const VoxelFace* look, const VoxelProperties& type);

/// The textured faces of a type.
struct TypeFaces {
  VoxelFaces kept;  ///< owns the texels
  CellContent content = CellContent::Glass;
  std::array<FaceTexels, 6> sides;  ///< by direction
  TriplanarRule on_fields;
};

/// A point of a field's surface that shows textures.
struct FieldPoint {
  DVec3 position{0.0};          ///< in voxels of the full grid
  Vec3 normal{0.0F};            ///< of unit length; 0: all sides count alike
  double square_spacing = 0.0;  ///< of the image's samples, in voxels; 0: level 0 of the mipmaps
};

/// Sets the colour and emission of a material at a point: those of its textures along the three axes, weighted by the
/// normal.
void show_triplanar(const TypeFaces& faces, const FieldPoint& point, Surface& surface);

/// Surfaces by type. Unregistered ids give a conspicuous magenta.
class Surfaces {
 public:
  explicit Surfaces(const VoxelRegistry& types, Clouds clouds = Clouds::AsGlass) : clouds_(clouds) { update(types); }
  /// Takes over the changed types. Returns false if there are none. Cost: O(changed types).
  bool update(const VoxelRegistry& types);
  /// Returns true if any type scatters light inside; always false with Clouds::AsGlass.
  [[nodiscard]] bool has_clouds() const {
    return std::ranges::any_of(surfaces_, [](const Surface& each) { return each.scattering > 0.0F; });
  }
  [[nodiscard]] const Surface& operator[](VoxelType type) const {
    QUOIN_ASSERT(!surfaces_.empty(), "an entry for unregistered types");
    return surfaces_[type < surfaces_.size() - 1 ? type : surfaces_.size() - 1];
  }
  /// Returns the textured faces of a type; null if it has none. Lifetime: until the next update.
  [[nodiscard]] const TypeFaces* faces(VoxelType type) const {
    return type < faces_.size() ? faces_[type].get() : nullptr;
  }
  /// Returns the mean colour of a type's shapes, for cells of halved grids. Requires: the type has shapes.
  [[nodiscard]] Vec3 mean_of_shapes(VoxelType type) const {
    QUOIN_ASSERT(type < shape_means_.size(), "a type with shapes");
    return Vec3(shape_means_[type]);
  }
  /// Returns the emission of these cells, as a multiple of their colour. Requires: the type has shapes.
  [[nodiscard]] float emission_of_shapes(VoxelType type) const {
    QUOIN_ASSERT(type < shape_means_.size(), "a type with shapes");
    return shape_means_[type].w;
  }
  /// Returns `faces` of all types; empty without textures.
  [[nodiscard]] std::span<const std::shared_ptr<const TypeFaces>> all_faces() const { return faces_; }
  /// Returns true if any type has textures.
  [[nodiscard]] bool has_textures() const { return has_textures_; }
  /// Returns true if any type has textured glass.
  [[nodiscard]] bool has_textured_glass() const { return has_textured_glass_; }
  /// Returns true if any type has cells of faces.
  [[nodiscard]] bool has_cells_of_faces() const { return has_cells_of_faces_; }
  /// Returns true if any such type has a translucent face, which tints light.
  [[nodiscard]] bool has_tinted_cells() const { return has_tinted_cells_; }
  /// Returns true if a type hides the faces of its neighbours: cubes all of them, shapes those that they cover.
  /// Unregistered ids do.
  [[nodiscard]] bool is_opaque(VoxelType type) const {
    return type + std::size_t{1} >= surfaces_.size() || is_opaque_[type] != 0;
  }
  /// Returns true if voxels of both types are one body of glass: equal types, or fluids of one kind
  /// (VoxelRegistry::joins). A ray keeps the look of the type that it enters.
  [[nodiscard]] bool joins(VoxelType a, VoxelType b) const {
    return a == b || (fluid(a) != kAir && fluid(a) == fluid(b));
  }
  /// Returns the first registered fluid of the kind of a type; kAir for other types.
  [[nodiscard]] VoxelType fluid(VoxelType type) const { return type < fluids_.size() ? fluids_[type] : kAir; }
  /// Returns the surface of a field's material. kAir has no material and is white, as in smooth meshes.
  [[nodiscard]] const Surface& of_field(VoxelType material) const;
  /// Returns the colour, emission, roughness and metalness at a point of a field's surface: the weighted mean of the
  /// solid samples among the 27 around it. With `point`, textured materials show their textures there. A flat smooth
  /// mesh has the same colours: at the middle of a cell the samples of its corners have equal weights, and between cell
  /// centres the weights change linearly.
  ///
  /// `inside`: the position in the cell, 0 to 1 on each axis. `nearest`: the material if no sample around is solid.
  /// Cost: 9 rows of samples, and 27 materials if these differ.
  [[nodiscard]] Surface blend_of_field(const DensityGrid& field, IVec3 cell, const DVec3& inside, VoxelType nearest,
                                       const FieldPoint* point = nullptr) const;

 private:
  void put(VoxelType type, const VoxelProperties& properties);
  // As `of_field`, with textures at `point`, which may be null.
  [[nodiscard]] Surface field_surface(VoxelType material, const FieldPoint* point) const;

  Clouds clouds_;
  std::vector<Surface> surfaces_;  // the last entry is for unregistered types
  ChangeCursor followed_;
  std::vector<std::shared_ptr<const TypeFaces>> faces_;  // empty without textures
  std::vector<std::uint8_t> is_opaque_;
  bool has_textures_ = false;
  bool has_textured_glass_ = false;
  bool has_cells_of_faces_ = false;
  bool has_tinted_cells_ = false;
  std::vector<glm::vec4> shape_means_;  // colour, emission; empty without shapes
  std::vector<VoxelType> fluids_;       // see `fluid`; empty without fluids
};

/// The way of a ray through a cell, or through a block of cells of one type.
struct CellSpan {
  IVec3 first{0};                         ///< the voxel that the ray enters
  IVec3 behind{0};                        ///< the voxel that it enters when it leaves the last one
  Direction face = Direction::PosX;       ///< of `first`, through which it enters
  Direction exit_face = Direction::PosX;  ///< through which it leaves
  bool starts_inside = false;
  double t_enter = 0.0;
  double t_exit = 0.0;
};

/// A visible texel that a ray meets.
struct MetFace {
  std::int32_t placed = 0;  ///< the grid
  /// The lit side. The inner side of a cell's face is the face of the neighbour that looks into the cell.
  IVec3 voxel{0};
  Direction face = Direction::PosX;
  VoxelType type = kAir;
  std::uint16_t side = 0;  ///< index into TypeFaces::sides
  double t = 0.0;
  Vec3 colour{0.0F};   ///< of the texel of level 0, in linear light
  float cover = 0.0F;  ///< share of the light behind that it hides; 1 ends the ray

  /// Returns the transmittance per channel: that of a voxel of glass of this colour and alpha.
  [[nodiscard]] Vec3 passed() const { return (1.0F - cover) * (Vec3(1.0F) - cover * (Vec3(1.0F) - colour)); }
};

/// Finds the content of a cell that a ray meets, for types with CellContent::Faces. All rays that see such a cell call
/// this: those of the camera, shadow and occlusion rays, and paths.
///
/// A face is there if the mesher draws it: its neighbour is neither opaque nor of the same type, and no opaque shape
/// there covers the whole side. The ray meets the outer side of its entry face, unless it starts inside, and the inner
/// side of its exit face. Opaque and cutout faces
/// have two sides; translucent ones are seen from outside only. Texels are those of level 0, so that all rays agree.
///
/// To join: other content than faces of cubes, such as shapes, is found here too. It appends its texels in order of t,
/// with `side` as their index in TypeFaces::sides. A span covers a whole block of one type; `largest` in
/// render/light/glass_bodies.cpp limits it to one voxel for content inside of voxels.
///
/// Appends to `out`, nearest first, texels with some cover up to and including `max_t`. Returns false if the last one
/// ends the ray. `voxels`: reads the grid of `ray_in_grid`. `shapes`: of this grid, or null if it has none. `placed`:
/// its index, for MetFace.
bool meet_cell(const Surfaces& surfaces, GridReader& voxels, const ShapeIndex* shapes, std::int32_t placed,
               VoxelType type, const Ray& ray_in_grid, const CellSpan& span, double max_t, std::vector<MetFace>& out);

}  // namespace quoin
