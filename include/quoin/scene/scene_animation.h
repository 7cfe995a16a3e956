#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_meshes.h>

namespace [[gnu::visibility("default")]] quoin {

/// Merges the frames of a changing scene into one scene whose instances appear, disappear and move. Use it to write
/// animations into mesh files. Each frame lasts until the next; nothing is interpolated.
///
///   quoin::SceneAnimation animation;
///   for (const quoin::Scene& frame : frames) {
///     if (quoin::Status added = animation.add(frame); !added) return added.error();
///   }
///   auto meshes = quoin::mesh_scene(animation.scene());
///   if (!meshes) return meshes.error();
///   animation.animate(*meshes, 12.0);               // frames per second
///   return quoin::write_mesh(*meshes, "walk.glb");
class SceneAnimation {
 public:
  /// Adds the next frame: the instances that pass `filter`. Instances are matched between frames by their index in
  /// handle order. Grids, types, groups and layers are taken from the first frame, so every frame must have the same
  /// grids in the same slots. Frames of a .vox file do, and so do snapshots of one scene in which only instances
  /// change.
  /// Cost:   O(instances), times the grids that each instance has shown; memory grows with the number of changes.
  /// Errors: InvalidArgument if the number of instances differs from earlier frames or grids are in other slots.
  [[nodiscard]] Status add(const Scene& frame, InstanceFilter filter = InstanceFilter::Visible);

  /// Returns a scene with everything that any frame shows. An instance that shows several grids in turn becomes several
  /// instances.
  [[nodiscard]] const Scene& scene() const { return scene_; }
  [[nodiscard]] std::size_t frame_count() const { return frames_; }

  /// Sets the animation tracks of the placements and places them as in the first frame.
  /// Requires: `meshes` was made from `scene()` without uniting instances; `frames_per_second` is positive.
  void animate(SceneMeshes& meshes, double frames_per_second) const;

 private:
  /// The appearance of an instance in some frames. Each is a separate part in the file, because a node shows one mesh.
  struct Look {
    GridHandle grid;  ///< in scene_
    bool mirrored = false;
    bool operator==(const Look&) const = default;
  };
  /// A change at a frame; without a value the instance is hidden from there on.
  struct Change {
    std::size_t frame = 0;
    std::optional<Similarity> at;
  };
  struct Shown {
    Look look;
    InstanceHandle instance;  ///< in scene_
    std::vector<Change> changes;
    std::size_t frames_until_last = 0;  ///< the number of frames at the end of its last appearance
  };

  [[nodiscard]] bool has_the_same_grids(const Scene& frame) const;
  Shown& shown_as(std::size_t index, const Scene& frame, const Instance& instance);
  static void show(Shown& shown, std::size_t frame, const Similarity& world_from_grid);
  [[nodiscard]] std::vector<MeshKey> keys_of(const Shown& shown, double frames_per_second) const;

  Scene scene_;
  std::size_t frames_ = 0;
  std::vector<std::vector<Shown>> instances_;  ///< by index in handle order
};

}  // namespace quoin
