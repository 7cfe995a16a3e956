#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin {

/// A scene that changes from frame to frame, as one whose instances come, go and move: for animations in files of
/// meshes. Each frame is shown until the next one; nothing is interpolated.
///
///   quoin::SceneAnimation animation;
///   for (const quoin::Scene& frame : frames) {
///     if (quoin::Status added = animation.add(frame); !added) return added.error();
///   }
///   auto meshes = quoin::mesh_scene(animation.scene());
///   if (!meshes) return meshes.error();
///   animation.animate(*meshes, 12.0);               // frames a second
///   return quoin::write_mesh(*meshes, "walk.glb");
class SceneAnimation {
 public:
  /// Adds the next frame, of what `filter` counts as drawn. Instances are told apart by their place in the order of
  /// their handles; of the grids, types, groups and layers those of the first frame are taken, for what is in the same
  /// slots in every frame: the frames of a .vox file, or snapshots of one scene whose instances alone change.
  /// Cost: O(instances), times the grids that each has shown; memory for what changes.
  /// Errors: InvalidArgument where the number of instances is another than before, or grids are in other slots.
  [[nodiscard]] Status add(const Scene& frame, InstanceFilter filter = InstanceFilter::Visible);

  /// All that any frame shows: an instance that shows several grids one after the other is as many.
  [[nodiscard]] const Scene& scene() const { return scene_; }
  [[nodiscard]] std::size_t frame_count() const { return frames_; }

  /// Gives the placements their tracks, and where they stand in the first frame. Requires: `meshes` are those of
  /// `scene()`, each instance by itself; `frames_per_second` is positive.
  void animate(SceneMeshes& meshes, double frames_per_second) const;

 private:
  /// What an instance is at one time: a part of its own in a file, since a node shows one mesh.
  struct Look {
    GridHandle grid;  ///< in scene_
    bool mirrored = false;
    bool operator==(const Look&) const = default;
  };
  /// From a frame on; nothing: it is not shown.
  struct Change {
    std::size_t frame = 0;
    std::optional<Similarity> at;
  };
  struct Shown {
    Look look;
    InstanceHandle instance;  ///< in scene_
    std::vector<Change> changes;
    std::size_t frames_until_last = 0;  ///< how many there were when it was last shown
  };

  [[nodiscard]] bool has_the_same_grids(const Scene& frame) const;
  Shown& shown_as(std::size_t place, const Scene& frame, const Instance& instance);
  static void show(Shown& shown, std::size_t frame, const Similarity& place);
  [[nodiscard]] std::vector<MeshKey> keys_of(const Shown& shown, double frames_per_second) const;

  Scene scene_;
  std::size_t frames_ = 0;
  std::vector<std::vector<Shown>> instances_;  ///< by their place in the order
};

}  // namespace quoin
