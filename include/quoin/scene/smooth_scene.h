#pragma once

#include <cstddef>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

struct SmoothFieldOptions {
  InstanceFilter instances = InstanceFilter::Visible;
  /// Limit for all densities that are made; exceeding it is an error, and none are kept. The renderer of the scene
  /// needs additional memory for its trees and for a copy of chunks with transparent materials.
  std::size_t max_bytes = std::size_t{1} << 30;
};

/// Converts a scene's voxels to fields, so that rays see the same surfaces as the smooth meshes. Each grid's voxels are
/// replaced by the field of their smooth mesh (`field_from_grid`); existing fields stay. The result contains only drawn
/// instances.
///
///   quoin::SmoothScene smooth;
///   if (auto made = smooth.update(scene); !made) return made.error();
///   const quoin::CpuRenderer renderer(smooth.scene());
///
/// Space:   as the source scene: instances keep their transforms, names and handle order. A grid's samples are its
///          voxel centres.
/// Shape:   equals the field, except for features that smooth meshes create by moving vertices: thin parts keep their
///          thickness, voxels that touch along an edge are joined, and two bodies (water and its bed) meet halfway
///          between voxels. Flat glass and water are as thick as in the blocky mesh.
/// Threads: one at a time; several SmoothScenes may read one scene.
class SmoothScene {
 public:
  explicit SmoothScene(const SmoothFieldOptions& options = {});
  SmoothScene(SmoothScene&&) noexcept;
  SmoothScene& operator=(SmoothScene&&) noexcept;
  ~SmoothScene();

  /// Applies the changes of `of` since the last update; converts everything if `of` is another scene. Reads `of` only
  /// during the call and keeps only shared chunks.
  ///
  /// Errors: Cancelled if `progress`, called every few chunks, returns false; finished chunks are kept for the next
  ///         update and `scene` stays unchanged. LimitExceeded beyond `max_bytes`; `scene` is then empty, and later
  ///         calls fail at once until there are fewer chunks.
  /// Cost:   about 6 ms for each affected chunk near a surface. A chunk is affected if it is within kVoxelFieldReach
  ///         voxels of an edit, or if it or a neighbour has a type whose transparency changed.
  Status update(const Scene& of, Threads threads = {}, const Progress& progress = {});

  /// Returns the converted scene. It keeps its address, and its change journals notify renderers of updates.
  [[nodiscard]] const Scene& scene() const;
  /// Returns the bytes of all densities.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
