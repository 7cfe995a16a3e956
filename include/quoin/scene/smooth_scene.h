#pragma once

#include <cstddef>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

struct SmoothFieldOptions {
  InstanceFilter instances = InstanceFilter::Visible;
  /// Of all densities that are made; beyond it there is an error, and none are kept. Besides them the renderer of the
  /// scene has its trees, and another copy of chunks with transparent materials.
  std::size_t max_bytes = std::size_t{1} << 30;
};

/// A scene as its smooth meshes show it, for rays: in the place of each grid's voxels stands the field that their
/// smooth mesh is made from (`field_from_grid`), fields stay as they are. It holds the instances that are drawn, and no
/// others.
///
///   quoin::SmoothScene smooth;
///   if (auto made = smooth.update(scene); !made) return made.error();
///   const quoin::CpuRenderer renderer(smooth.scene());
///
/// Space:   as the scene that it follows: instances keep their places, names and handles' order. A grid's samples are
///          its voxels' centres.
/// Shape:   that of the field, but for what smooth meshes have by moving vertices: what is thin keeps its thickness,
///          voxels that touch by an edge are joined, and where two bodies meet (water and its bed) they do so in the
///          middle between voxels. Flat glass and water are as thick as those of blocks.
/// Threads: one at a time; several may follow one scene.
class SmoothScene {
 public:
  explicit SmoothScene(const SmoothFieldOptions& options = {});
  SmoothScene(SmoothScene&&) noexcept;
  SmoothScene& operator=(SmoothScene&&) noexcept;
  ~SmoothScene();

  /// Takes over what was changed in `of` since the last time; of another scene than before all is new. It reads `of` in
  /// the meantime, and keeps nothing of it but shared chunks.
  ///
  /// Errors: Cancelled when `progress` returns false, which is asked after every few chunks; what was made until then
  ///         is kept for the next time, and `scene` is what it was. LimitExceeded beyond `max_bytes`, again and at once
  ///         until there are fewer chunks; `scene` is empty then.
  /// Cost:   some 6 ms a chunk that a surface comes near, for each that lies within kVoxelFieldReach voxels of an edit,
  ///         or holds or is beside what changed between opaque and transparent.
  Status update(const Scene& of, Threads threads = {}, const Progress& progress = {});

  /// What rays go through. It stays in its place, and its journals tell renderers of updates.
  [[nodiscard]] const Scene& scene() const;
  /// Of densities.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
