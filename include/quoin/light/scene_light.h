#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/grid/grid.h>
#include <quoin/light/propagated_light.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// A grid's light, and what is in its way. Lifetime: until the next update of what it is of.
struct GridLight {
  const PropagatedLight* light = nullptr;
  /// The grid's voxels; where it has a field, with a voxel of its material (or, without one, of a number that no type
  /// has) at each solid sample where there is none.
  const Grid* voxels = nullptr;
};

/// Propagated light of all grids of a scene, each by itself.
///
///   SceneLight light;
///   light.update(scene);                       // once, and after edits
///   const GridLight of = light.of(handle);
///   SurfaceLight surface(*of.light, *of.voxels, scene.types);
///
/// Fields: their samples stand in the way as the voxel does whose least corner they are: half a voxel off.
/// Cost:   of an update that of PropagatedLight for what changed, and a look at each grid; of fields all of a chunk in
///         which anything changed.
class SceneLight {
 public:
  explicit SceneLight(PropagatedLightOptions options = {});
  SceneLight(SceneLight&&) noexcept;
  SceneLight& operator=(SceneLight&&) noexcept;
  ~SceneLight();

  void update(const Scene& scene, Threads threads = {});
  /// As PropagatedLight::snapshot, of each grid; GridLight::voxels stays that of the last updates' scene, which must
  /// outlive it, but for grids with fields.
  [[nodiscard]] SceneLight snapshot() const;
  /// As of the last update. Of a grid that the scene did not have then: nothing but open sky.
  [[nodiscard]] GridLight of(GridHandle grid) const;
  /// Of all light, also what snapshots share.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Entry;
  PropagatedLightOptions options_;
  std::unique_ptr<Entry> unknown_;  // what grids that are not there have
  std::map<GridHandle, std::unique_ptr<Entry>> grids_;
};

}  // namespace quoin
