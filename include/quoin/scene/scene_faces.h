#pragma once

#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/mesh/visible_faces.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// Counts the faces of a scene's voxels, as a mesher would find them, and keeps the counts up to date during edits.
///
/// It counts each grid that a drawn instance places, once per grid: the same grids that `mesh_scene` meshes. It reads
/// the change journals of scene, types and grids, so a small edit costs only the chunks around it, at any scene size.
///
/// Lifetime: the scene is only read during calls.
///
///   SceneFaces faces;
///   faces.update(scene);                      // counts all; later calls count only changes
///   print(faces.counts().visible, "visible of", faces.counts().total);
class SceneFaces {
 public:
  explicit SceneFaces(InstanceFilter filter = InstanceFilter::Visible);
  SceneFaces(SceneFaces&&) noexcept;
  SceneFaces& operator=(SceneFaces&&) noexcept;
  ~SceneFaces();

  /// Counts the changes since the last update: the chunks of `chunks_to_mesh`, with shapes also those at most two
  /// voxels away from a change of voxels or states, and grids that were placed, hidden or removed. Counts the whole
  /// scene the first time, for another scene, and grids with a type whose visibility or shapes changed.
  /// Cost:    some tens of microseconds per chunk; uses several threads for many chunks.
  /// Threads: reads the scene, which must not be edited during the call.
  const FaceCounts& update(const Scene& scene, Threads threads = {});

  /// Returns the counts of the last update.
  [[nodiscard]] const FaceCounts& counts() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

/// Counts the faces of a scene once. Cost: as the first SceneFaces::update.
[[nodiscard]] FaceCounts count_faces(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible,
                                     Threads threads = {});

}  // namespace quoin
