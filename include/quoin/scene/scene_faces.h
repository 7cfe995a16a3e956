#pragma once

#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/mesh/visible_faces.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Keeps count of the faces of a scene's voxels while it is edited, as a mesher would find them.
///
/// Counted are the grids that drawn instances place, each once, however often it is placed: what `mesh_scene` meshes.
/// Follows the journals of scene, types and grids: an edit of a few voxels costs the chunks around it, whatever the
/// scene's size.
///
/// Lifetime: the scene is only read within calls.
///
///   SceneFaces faces;
///   faces.update(scene);                      // all of it; later what changed since
///   print(faces.counts().visible, "visible of", faces.counts().total);
class SceneFaces {
 public:
  explicit SceneFaces(InstanceFilter filter = InstanceFilter::Visible);
  SceneFaces(SceneFaces&&) noexcept;
  SceneFaces& operator=(SceneFaces&&) noexcept;
  ~SceneFaces();

  /// Counts what changed since the last update: the chunks of `chunks_to_mesh`, and what was placed, hidden or removed.
  /// All of it the first time, when this is another scene, and where the visibility of types in use changed.
  /// Cost: some tens of microseconds a chunk, on all threads where there are many.
  /// Threads: reads the scene, which must not be edited meanwhile.
  const FaceCounts& update(const Scene& scene, Threads threads = {});

  /// As of the last update.
  [[nodiscard]] const FaceCounts& counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The faces of a scene as it is now. Cost: as the first update of SceneFaces.
[[nodiscard]] FaceCounts count_faces(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible,
                                     Threads threads = {});

}  // namespace quoin
