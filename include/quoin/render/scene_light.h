#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/grid/grid.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// The light of a grid and the voxels that block it. Lifetime: until the next update of the SceneLight it comes from.
struct GridLight {
  const PropagatedLight* light = nullptr;
  /// The grid's voxels. If the grid has a field, each of its solid samples in an air voxel adds a voxel of the field's
  /// material, or of an unregistered type if it has no material.
  const Grid* voxels = nullptr;
};

/// Propagated light of all grids of a scene, each grid separately.
///
///   SceneLight light;
///   light.update(scene);                       // once, and after edits
///   const GridLight of = light.of(handle);
///   SurfaceLight surface(*of.light, *of.voxels, scene.types);
///
/// Fields: a solid sample blocks light like the voxel whose minimum corner it is, which is half a voxel off.
/// Cost:   an update costs PropagatedLight::update for the changes plus a check per grid. Fields are updated by whole
///         chunks.
class SceneLight {
 public:
  explicit SceneLight(PropagatedLightOptions options = {});
  SceneLight(SceneLight&&) noexcept;
  SceneLight& operator=(SceneLight&&) noexcept;
  ~SceneLight();

  void update(const Scene& scene, Threads threads = {});
  /// Returns a PropagatedLight::snapshot of each grid. GridLight::voxels still points into the scene of the last
  /// update, which must outlive the snapshot, except for grids with fields.
  [[nodiscard]] SceneLight snapshot() const;
  /// Returns the light of a grid as of the last update. For a grid that the scene did not have then: open sky.
  [[nodiscard]] GridLight of(GridHandle grid) const;
  /// Returns the bytes of all light, including bytes shared with snapshots.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Entry;
  PropagatedLightOptions options_;
  std::unique_ptr<Entry> unknown_;  // returned for unknown grids
  std::map<GridHandle, std::unique_ptr<Entry>> grids_;
};

}  // namespace quoin
