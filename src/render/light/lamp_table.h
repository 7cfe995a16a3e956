#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>

#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/render/light_options.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/trace/occupancy_tree.h>

#include "render/light/emissive_cells.h"
#include "render/light/occlusion_directions.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

/// A light source for other surfaces: a Lamp, or the emission of the voxels or the field in one cell.
struct PlacedLamp {
  DVec3 position{0.0};          ///< in the world
  glm::dmat3 axes{1.0};         ///< its own axes in the world, unit columns
  std::array<Vec3, 6> power{};  ///< per direction of its axes: light on a white surface that faces the lamp, times the
                                ///< squared distance; `power[0]` for a point
  double spread_squared = 0.0;  ///< world units: added to the distance's square
  DVec3 low{0.0};               ///< its box, from `position` along its axes, in world units: shadow rays end there
  DVec3 high{0.0};
  double reach = 0.0;  ///< world units: its light fades to 0 there
  bool is_point = false;
  DVec3 direction{0.0};  ///< a spot's, unit
  double cos_inner = -2.0;
  double cos_outer = -3.0;
};

/// Returns the shining lamps of Scene::lamps. `brightness` multiplies their own brightness.
[[nodiscard]] std::vector<PlacedLamp> placed_lamps(const Scene& scene, double brightness);

/// The light of a lamp at a point.
struct LampRay {
  Vec3 light{0.0F};        ///< on a white surface, if unoccluded; 0: none
  DVec3 direction{0.0};    ///< towards the lamp, unit, in the world
  double distance = -1.0;  ///< world units to the lamp's surface; not positive: the point is inside
};

/// Returns the light of a lamp at a point of a surface. `normal`: unit; 0, as fields have where their density is flat,
/// gives no light. `to_lamp`: from the point to the lamp's position. Both in the world.
[[nodiscard]] LampRay lamp_ray(const PlacedLamp& lamp, DVec3 to_lamp, DVec3 normal);

/// The lamps of a scene and the regions that they light.
///
/// Each brick of 16^3 voxels of each placed grid has a list of the lamps that reach it. If there are more than
/// `max_lamps`, the list contains those that can add the most light; ties go to the first. The lamps of a surface
/// therefore depend only on its position, not on the image.
struct LampTable {
  static constexpr int kBrick = 16;

  /// A list; `count` 0: empty. Open addressing by `slot_of`.
  struct Brick {
    IVec3 brick{0};
    std::int32_t placed = 0;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t pad[2]{};
  };
  std::vector<PlacedLamp> lamps;
  std::vector<Brick> bricks;  ///< a power of two
  std::vector<std::uint32_t> lists;
  int longest = 0;  ///< list

  [[nodiscard]] static std::uint32_t slot_of(IVec3 brick, std::int32_t placed) {
    const auto bits = [](int coordinate) { return static_cast<std::uint32_t>(coordinate); };
    return hash_of(hash_of(bits(brick.x), bits(brick.y)), hash_of(bits(brick.z), bits(placed)));
  }
  /// Returns the lamps of a brick of a placed grid. `brick`: voxel coordinates of the full grid / 16, rounded down.
  [[nodiscard]] std::span<const std::uint32_t> at(IVec3 brick, std::int32_t placed) const;
};

/// A grid and its placement.
struct LampPlace {
  GridHandle grid;
  const Grid* voxels = nullptr;
  const DensityGrid* field = nullptr;
  DVec3 pivot{0.0};
  glm::dmat3 axes{1.0};
  DVec3 position{0.0};
  double voxel_size = 1.0;
  const OccupancyTree* opaque = nullptr;
  const OccupancyTree* transparent = nullptr;  ///< may be null
  const OccupancyTree* cells = nullptr;        ///< of the field; may be null
  const OccupancyTree* shapes = nullptr;       ///< voxels that shapes touch; may be null
};

/// Returns the lamp data of a placed grid at full detail. Requires: `placed` belongs to `scene`; does not use its
/// pointers.
[[nodiscard]] LampPlace lamp_place(const Scene& scene, const PlacedGrid& placed, const OccupancyTree& opaque,
                                   const OccupancyTree* transparent, const DensityTree* field);

/// Makes the table of a scene at the first request after an `update`, and keeps the last two for different options:
/// images of a moving view may use fewer lamps. Threads: any number may call `table`.
class LampCache {
 public:
  /// Call after the scene was edited or its instances changed.
  void update();

  /// Returns null if no lamp shines or the options disable lamps. `brightness`: Environment::lamp_brightness. Calls
  /// `places` for the placed grids, in the order of SceneTracer::placed, only if it has to make the table. Cost of
  /// making it: the emissive cells of the changed chunks; for each chunk all lamps, for each brick the lamps near its
  /// chunk. Reads the scene only then.
  [[nodiscard]] std::shared_ptr<const LampTable> table(const Scene& scene, const LightOptions& light, double brightness,
                                                       Threads threads, FunctionRef<std::vector<LampPlace>()> places);

 private:
  [[nodiscard]] std::vector<PlacedLamp> lamps_of(const Scene& scene, std::span<const LampPlace> places,
                                                 double brightness);

  std::mutex mutex_;
  std::map<GridHandle, EmissiveCells> cells_;
  std::map<GridHandle, EmissiveCells> field_cells_;
  struct Kept {
    int max_lamps = 0;
    double brightness = 0.0;
    std::shared_ptr<const LampTable> table;
  };
  std::vector<Kept> kept_;  // up to date, most recently used last
};

}  // namespace quoin
