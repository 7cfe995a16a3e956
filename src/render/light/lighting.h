#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_shape.h>
#include <quoin/render/light_options.h>
#include <quoin/render/propagated_light.h>

#include "render/light/lamp_table.h"
#include "render/light/light_model.h"
#include "render/light/occlusion_directions.h"
#include "scene/surfaces.h"
#include "scene/tracer/scene_view.h"

namespace quoin {

/// The kind of light that a point sends to the viewer.
enum class PointKind : std::uint8_t {
  Surface,  ///< lit colour and emission
  Unlit,    ///< own colour, unlit: seen from inside
  Glow,     ///< emission only
};

/// A point of a voxel's face, or of a field's surface, to be lit.
struct SurfacePoint {
  DVec3 position{0.0};      ///< in its grid, on the face or surface
  IVec3 voxel{0};           ///< of a shape's point: the voxel that has the shape
  std::int32_t placed = 0;  ///< index into SceneTracer::placed
  VoxelType type = kAir;
  Direction face = Direction::PosX;  ///< fields: the direction nearest to the normal
  bool in_field = false;
  bool is_far = false;           ///< of an impostor, whose faces and shapes show the means of their textures
  bool is_blended = false;       ///< fields: a blend of the materials around, as Surfaces::blend_of_field
  bool is_tilted = false;        ///< of a shape's turned element, or inclined fluid: `normal` counts, not `face`
  std::uint8_t orientation = 0;  ///< AxisOrientation::index of a cube that its state turns
  std::uint16_t shown_side = 0;  ///< 1 + the index in TypeFaces::sides of the texture that it shows; 0: that of `face`
  std::int16_t shape_face = -1;  ///< for a shape: the side that is seen, an index into `model->faces`, or -1
  const ShapeModel* model = nullptr;  ///< of `voxel`, for a shape
  Vec3 normal{0.0F};                  ///< of a field or where `is_tilted`, in its grid, of unit length or 0
  float lift = 0.0F;                  ///< of a field: height of the position above the surface, along the normal
  PointKind kind = PointKind::Surface;
  std::uint32_t pixel = 0;  ///< seed for random numbers: combines pixel and sample
  float openness = -1.0F;   ///< 0 to 1 if already known, independent of the occlusion options; less than 0: unknown

  /// Returns true if `normal` counts, not `face`.
  [[nodiscard]] bool has_normal() const { return in_field || is_tilted; }
};

/// Sets the side of a shape that a point shows: an index into `model.faces`, and the normal on the side that is seen.
/// Corrects the rounding of the position. Requires: `point.face` is the direction nearest to the normal.
void put_on_shape(const ShapeModel& model, std::int16_t face, const Vec3& normal, SurfacePoint& point);
/// Turns the textures of a point by its voxel's state, on cubes and cells of halved grids. Requires: the state turns
/// the point's type; `placed` is its grid.
void turn_by_state(const PlacedGrid& placed, const VoxelRegistry& types, SurfacePoint& point);

/// The reference lighting model: a sun with shadows, an ambient term with occlusion, and emission.
///
///   colour * (0.15 * openness + diffuse + lamplight) + emitted, times the exposure,
///
/// with diffuse = max(n.l, 0), or 0 in shadow. Transparent bodies tint sunlight and lamplight. Without occlusion the
/// ambient term is 0.1. The colours of the ambient term and of sunlight come from daylight_of. Secondary rays start
/// 0.01 voxels in front of the face. Distances are in voxels of the grid that was hit; for a halved grid, in voxels of
/// the full grid. Other shadings: see Shading.
///
/// LightModel::Propagated has colour * light_colour * (1 - 0.75 * occlusion) + emitted instead.
class Lighting {
 public:
  /// `view`, `surfaces` and `lamps` must outlive it. Requires: `check` accepts the options and the environment.
  /// `lamps`: for the same placed grids; null: no lamps. `detail_colours`: surfaces have the colour of their grid's
  /// detail and emit nothing. `levels`: for each placed grid, if the options' model is propagated light.
  Lighting(const SceneView& view, const VoxelRegistry& types, const Surfaces& surfaces, const LightOptions& options,
           const Environment& environment, const LampTable* lamps = nullptr, bool detail_colours = false,
           std::vector<GridLight> levels = {});

  /// Shows the textures of types (VoxelProperties::faces) instead of their mean colours. Faces of halved grids
  /// and impostors show the last mipmap level, the mean of their texture. `spacing`: the distance of an image's samples
  /// in world units; with `is_perspective` at distance 1 from the view's origin.
  ///
  /// Filter: the nearest texel of the mipmap level whose texels are nearest in size to the samples' distance.
  /// Cost:   O(placed grids).
  /// Requires: `spacing` is positive.
  void show_textures(double spacing, bool is_perspective);

  /// Computes the linear light of each point, not clamped. Returns the number of rays traced.
  ///
  /// Requires: as many places in `colours` as points. The result for a point does not depend on the others; neighbours
  /// should lie side by side, since sixteen are traced together. `sample`: the number of their sample in each pixel.
  std::int64_t light(std::span<const SurfacePoint> points, std::span<Vec3> colours, int sample = 0) const;

  [[nodiscard]] const Surfaces& surfaces() const { return *surfaces_; }
  /// Returns the colour of the background. `up`: the y of a unit direction.
  [[nodiscard]] Vec3 sky(float up) const;

 private:
  /// Light directions for one placed grid, in its own space.
  struct Frame {
    DVec3 to_sun{0.0};
    double voxels_per_cell = 1.0;
    std::array<float, 6> diffuse{};
    DVec3 eye{0.0};               // of a perspective view
    double square_spacing = 0.0;  // of samples, in voxels; of a perspective view at a distance of 1 voxel
    bool shows_means = false;     // of textures: cells of a halved grid stand for many voxels
  };
  struct Group;
  [[nodiscard]] static std::vector<std::uint32_t> coherent_order(std::span<const SurfacePoint> points);
  [[nodiscard]] double voxels_per_cell(std::int32_t placed) const;
  // Lights groups of one placed grid; the shadow rays of all groups are traced together.
  std::int64_t light_groups(std::span<const Group> groups, std::span<Vec3> colours) const;
  void find_propagated(const Group& group, std::span<Vec3> light) const;
  // Finds the sunlight of groups of one placed grid: sixteen colours for each group.
  std::int64_t find_sunlight(std::span<const Group> groups, std::span<Vec3> sunlight) const;
  // Sets the sunlight of a group's points without shadows. Returns the lanes whose rays to the sun are to be traced.
  std::uint32_t sunlit_lanes(const Group& group, std::span<Vec3> sunlight) const;
  // Multiplies the light of each active lane by the transmittance of its ray. Returns how many rays were traced.
  std::int64_t shadow(const Group& group, RayPacket& rays, std::span<Vec3> light) const;
  // Does what `shadow` does, with the blocked rays known.
  void darken(const Group& group, RayPacket& rays, std::uint32_t blocked, std::span<Vec3> light) const;
  void tint(const Group& group, const RayPacket& rays, std::span<Vec3> light) const;
  std::int64_t add_lamplight(const Group& group, std::span<Vec3> lamplight) const;
  struct LampPlaces;
  std::int64_t add_lamp(const Group& group, const LampPlaces& places, const PlacedLamp& lamp, std::uint32_t lanes,
                        std::span<Vec3> lamplight) const;
  std::int64_t find_openness(const Group& group, std::span<float> openness) const;
  [[nodiscard]] float smooth_openness(const SurfacePoint& point) const;
  std::int64_t trace_openness(const Group& group, std::uint32_t lanes, std::span<float> openness) const;
  void set_occlusion_directions(const Group& group, int ray, RayPacket& rays) const;
  /// The colours that a point shows.
  struct Colours {
    Vec3 own{0.0F};
    Vec3 emitted{0.0F};
  };
  [[nodiscard]] Colours colours_at(const SurfacePoint& point) const;
  // As `colours_at`, with textures or the colours of detail.
  [[nodiscard]] Colours other_colours_at(const SurfacePoint& point) const;
  [[nodiscard]] Colours untextured_colours_at(const SurfacePoint& point) const;
  // Sets the unlit colours of points, with textures or the colours of detail.
  void show_other_colours(std::span<const SurfacePoint> points, std::span<Vec3> colours) const;
  [[nodiscard]] Colours colours_of_type(const SurfacePoint& point) const;
  // Returns true if a point lies on a cell of a halved grid that stands for shapes.
  [[nodiscard]] bool is_cell_of_shapes(const SurfacePoint& point) const;
  [[nodiscard]] Colours colours_of_field(const SurfacePoint& point, const FieldPoint* textured) const;
  // Returns the square of the distance between samples at a point, in voxels of its grid.
  [[nodiscard]] double square_spacing_at(const SurfacePoint& point) const;
  [[nodiscard]] const FaceTexels* texels_at(const SurfacePoint& point) const;
  [[nodiscard]] Vec3 textured_colour(const FaceTexels& face, const SurfacePoint& point) const;
  [[nodiscard]] Vec3 texel_colour(const FaceTexels& face, const SurfacePoint& point) const;
  [[nodiscard]] Colours colours_of_shape(const SurfacePoint& point) const;
  [[nodiscard]] Vec3 shade(const SurfacePoint& point, Vec3 direct, float openness) const;
  [[nodiscard]] Vec3 shade_lit(const SurfacePoint& point, Vec3 direct, float openness) const;
  // Returns the sun's diffuse term without shadows.
  [[nodiscard]] float diffuse(const Frame& frame, const SurfacePoint& point) const;
  [[nodiscard]] Vec3 normal_colour(const SurfacePoint& point) const;
  [[nodiscard]] bool needs_openness() const;
  [[nodiscard]] bool is_propagated() const;

  const SceneView* view_;
  const VoxelRegistry* types_;
  const Surfaces* surfaces_;
  const LampTable* lamps_;
  LightOptions options_;
  OcclusionDirections directions_;
  std::vector<Frame> frames_;
  std::vector<Surface> detail_surfaces_;  // of each placed grid; empty where types have their own colours
  bool has_other_surfaces_ = false;       // with `detail_surfaces_` or textures
  bool is_perspective_ = false;
  // By type, of the surfaces; empty if textures are not shown.
  std::span<const std::shared_ptr<const TypeFaces>> faces_;
  std::vector<GridLight> levels_;
  LightLook look_;
  float exposure_ = 1.0F;
  float sky_ = 1.0F;  // brightness
  Daylight daylight_;
};

}  // namespace quoin
