#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/live/live_light.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/render/chunk_surface.h>
#include <quoin/render/propagated_light.h>
#include <quoin/render/surface_light.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// The result of LiveMeshOptions::convert. Any pointer that converts to a std::shared_ptr<const void> converts to it.
struct ConvertedSurface {
  ConvertedSurface() = default;
  template <std::convertible_to<std::shared_ptr<const void>> Pointer>
  ConvertedSurface(Pointer converted, std::size_t size = 0) : data(std::move(converted)), bytes(size) {}

  std::shared_ptr<const void> data;
  std::size_t bytes = 0;  ///< bytes of its elements, for example of a vector's vertices; 0: unknown
};

/// A function that converts surfaces: any callable with one of these parameter lists, returning a ConvertedSurface or a
/// pointer that converts to it. Use the second one to add content that surfaces do not contain, such as models of a
/// game's own, or materials per vertex.
///
///   [](const quoin::SurfaceUpdate& update) { ... }
///   [](const quoin::SurfaceUpdate& update, const quoin::SurfaceContext& context) { ... }
class SurfaceConverter {
 public:
  using WithContext = std::function<ConvertedSurface(const SurfaceUpdate&, const SurfaceContext&)>;

  /// Converts nothing.
  SurfaceConverter() = default;
  SurfaceConverter(std::nullptr_t) {}
  // NOLINTBEGIN(bugprone-forwarding-reference-overload): never a SurfaceConverter
  template <class Callable>
    requires(
        !std::same_as<std::remove_cvref_t<Callable>, SurfaceConverter> &&
        std::is_invocable_r_v<ConvertedSurface, std::decay_t<Callable>&, const SurfaceUpdate&, const SurfaceContext&>)
  SurfaceConverter(Callable&& convert) : convert_(std::forward<Callable>(convert)) {}
  template <class Callable>
    requires(!std::same_as<std::remove_cvref_t<Callable>, SurfaceConverter> &&
             !std::is_invocable_r_v<ConvertedSurface, std::decay_t<Callable>&, const SurfaceUpdate&,
                                    const SurfaceContext&> &&
             std::is_invocable_r_v<ConvertedSurface, std::decay_t<Callable>&, const SurfaceUpdate&>)
  SurfaceConverter(Callable&& convert) {
    std::function<ConvertedSurface(const SurfaceUpdate&)> plain(std::forward<Callable>(convert));
    if (!plain) return;
    convert_ = [plain = std::move(plain)](const SurfaceUpdate& update, const SurfaceContext& /*context*/) {
      return plain(update);
    };
  }
  // NOLINTEND(bugprone-forwarding-reference-overload)

  /// Returns true if there is a function.
  [[nodiscard]] explicit operator bool() const { return convert_ != nullptr; }
  /// Requires: there is a function.
  ConvertedSurface operator()(const SurfaceUpdate& update, const SurfaceContext& context) const {
    return convert_(update, context);
  }

 private:
  WithContext convert_;
};

struct LiveMeshOptions {
  SurfaceStyle style = SurfaceStyle::Blocky;  ///< of voxels
  bool merge = true;                          ///< blocky: neighbouring faces become one quad
  /// Blocky: Faces fills ChunkSurface::shapes. Cubes is for renderers that do not draw shapes.
  ShapeUse shapes = ShapeUse::Faces;
  /// Blocky: 16, 32 or 64. Edge of the regions that a renderer replaces after an edit (SurfaceUpdate::changed_regions),
  /// in voxels. Use 64 if it uploads whole chunks. Figures: docs/guide.md, "Blocky meshes".
  int region_edge = 16;
  LightMerging light_merging = LightMerging::Linear;  ///< blocky, with `use_light`: condition for merged faces
  SmoothOcclusionOptions occlusion{};                 ///< of smooth surfaces, including fields
  SurfaceColours colours = SurfaceColours::Sharp;     ///< of smooth voxel surfaces; fields are always blended
  /// Fields: distance limit of level of detail 0, in samples of the chunk's nearest instance. A chunk farther than this
  ///         from all eyes has level 1, at twice the distance level 2, and so on to kMaxSmoothLevel. A chunk leaves a
  ///         level only a tenth beyond the limit (hysteresis). 0 and negative values count as 1. NaN counts as
  ///         infinity: level 0 everywhere.
  double detail_distance = std::numeric_limits<double>::infinity();
  InstanceFilter instances = InstanceFilter::Visible;  ///< instances whose grids are meshed
  Threads workers{};
  /// Converts a new surface before it can be taken, for example to vertices in a custom format. The result becomes
  /// ChunkSurface::converted. `changed_regions` of its argument has all bits set. Called by several workers at once,
  /// for each surface that is not empty. Optional. The SurfaceContext is valid only during the call. A result that is
  /// returned with its size counts in `take`:
  ///   return quoin::ConvertedSurface(vertices, vertices->size() * sizeof(Vertex));
  SurfaceConverter convert{};
  /// Called by a worker after each completed chunk: there may be a surface to take, `pending` has decreased, and there
  /// is room for more chunks. Also called after each update of a LiveLight, by its worker. Optional. It may call
  /// `take`, `pending`, `shown_update` and `stats`, but no other member of LiveMeshes.
  std::function<void()> on_ready{};
};

/// The meshes of a scene's chunks, voxels and fields, updated by worker threads while the scene is edited.
///
///   meshes.use_light(light);                                  // a LiveLight; optional
///   each frame: edit(scene); meshes.update(scene, eye); upload(meshes.take()); draw();
///
/// Only `update` reads the scene: workers read snapshots, so edits never wait for them. A chunk is meshed again only if
/// an edit could have changed its mesh.
/// Together:  all surfaces that change because of the edits between two updates are returned by one `take`, when all
///            are complete: on both sides of a chunk border, of all grids, voxels and fields, with their light. These
///            surfaces form a step. Edits made while workers compute a step are combined into the next one, so an edit
///            is returned after at most two steps. New, removed, shown and hidden grids count as edits.
/// Loaded:    the chunks of the first update, loaded chunks (Grid::load_chunk) and new grids that are partial or have
///            more than 256 chunks are returned one by one, nearest first. So are all chunks of a step that edits more
///            than 256 chunks. Edits come before loaded chunks. With a LiveLight, an edit is lit together with all
///            chunks loaded before, and its surfaces are made when their light is complete. Light that loaded chunks
///            change on surfaces that were shown counts as an edit.
/// Instances: the caller draws the instances of the scene. `update` numbers the states of the scene. `shown_update`
///            returns the newest state with all of its edits taken. To show instances in step with surfaces, draw an
///            instance that was added in state n as soon as `shown_update` is at least n, and an instance that was
///            removed in state n until then. Instances that only move can be drawn at once.
/// Seams:     surfaces of a field also fit each other when their levels of detail change.
/// Callbacks: the next `update` or `finish` rethrows the first exception of `on_ready` or `convert`. If `convert`
///            throws, the surface is still returned, with a null `converted`. A bad_alloc from `convert` counts as the
///            worker running out of memory (Stats::out_of_memory). `set_convert` and `set_on_ready` replace them while
///            workers run, for example when a plug-in is loaded again.
/// Lifetime:  the scene is read only during calls; callers share ownership of the surfaces they take. After the last
///            owner has dropped a surface, a worker destroys it with its converted data. The owner's thread destroys
///            it if the LiveMeshes no longer exists, or if busy workers have left more than 64 MiB to destroy.
/// Threads:   `update` and `finish` must not overlap; any thread can call the other members. With a LiveLight, no other
///            thread may read LiveLight::shown during `take`, which changes it.
class LiveMeshes {
 public:
  /// Requires: `region_edge` is 16, 32 or 64. Errors: std::system_error if the workers cannot be started.
  explicit LiveMeshes(const LiveMeshOptions& options = {});
  /// Waits for the chunks being meshed, and with a LiveLight also for the light being computed. Cancels the rest.
  ~LiveMeshes();
  LiveMeshes(const LiveMeshes&) = delete;
  LiveMeshes& operator=(const LiveMeshes&) = delete;

  /// Applies the scene's changes since the last update: voxels, data of types whose data changes meshes
  /// (VoxelRegistry::remeshes_on_data), grids, visibility, shapes and orientations of types (smooth: also colour), and
  /// instances that show a grid for the first time or no longer show it. Chunks nearest to an eye (world coordinates)
  /// come first. Call it after edits, and once per frame while `pending` is not 0: each call queues only enough chunks
  /// to keep the workers busy. Eyes that are not finite are ignored; if all are, every chunk has distance 0.
  ///
  /// Returns the number of this call: 1, 2, 3 and so on.
  ///
  /// Cost:   O(changes), independent of the size of the world. O(instances) more if instances were added, removed or
  ///         changed. O(instances + waiting chunks) more while chunks wait for workers. With a LiveLight, instead of
  ///         the changes: as LiveLight::update.
  /// Errors: bad_alloc; the next call starts from scratch with all chunks.
  std::uint64_t update(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});

  /// Sets the light that blocky voxel surfaces carry at their corners from the next update on. Chunks are then also
  /// meshed again when only their light changed. Each surface shows the voxels and the light of one moment: `update`
  /// starts the computation of light, and workers mesh as soon as it is complete, without another call. `take` makes
  /// the light of the surfaces that it returns the light shown (LiveLight::shown).
  /// Waits for light being computed, also of the light used before.
  /// Requires: no other LiveMeshes uses the light. Must not overlap with `update` and `finish`. Either object may be
  /// destroyed first.
  void use_light(LiveLight& light);
  /// As above, with light that the caller keeps up to date: call SceneLight::update before `update`, with the same
  /// scene. Null: no light. It is read only during `update` and `finish`.
  /// Lifetime: the light must stay valid until another call replaces it.
  void use_light(const SceneLight* light);

  /// Replaces LiveMeshOptions::convert. Returns when no worker runs the former function any more, and when all of its
  /// results are destroyed, except those that were taken and not dropped before the call. Drop these too before the
  /// code of the function is unloaded.
  /// All chunks are meshed and converted again after the next `update`: those of partial grids, and of grids with more
  /// than 256 chunks, are returned one by one, all others together. The surfaces taken before stay valid. From now on,
  /// `take` returns only results of the new function.
  /// Must not overlap with `update`, `finish` and `use_light`, and must not be called by a callback. Cost: waits for
  /// the chunks that workers are meshing.
  /// Errors: bad_alloc, without any change.
  void set_convert(SurfaceConverter convert);
  /// Replaces LiveMeshOptions::on_ready. Returns when no worker runs the former function any more. Must not be called
  /// by a callback. Errors: bad_alloc, without any change.
  void set_on_ready(std::function<void()> on_ready);

  /// Returns the surfaces that are new since the last call. Each chunk appears once, with its newest surface. Skips
  /// chunks that had no surface and still have none. Once voxel surfaces reach `max_bytes`
  /// (ChunkSurface::upload_bytes), the remaining loaded chunks wait for another call. Edits and fields ignore the limit
  /// because their surfaces must fit each other.
  /// Errors: bad_alloc, as `update`.
  [[nodiscard]] std::vector<SurfaceUpdate> take(std::size_t max_bytes = std::numeric_limits<std::size_t>::max());

  /// Returns the greatest n such that the edits of updates 1 to n were all taken. Chunks that are returned one by one
  /// do not count.
  [[nodiscard]] std::uint64_t shown_update() const;
  /// Returns the number of chunks whose newest surface has not been taken yet, plus 1 while light is computed for them,
  /// or if memory ran out since the last successful `update`.
  [[nodiscard]] std::size_t pending() const;
  /// Calls `update` until all chunks are meshed. For tests and screenshots.
  /// Errors: bad_alloc, also if workers run out of memory for every remaining chunk.
  void finish(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});

  struct Stats {
    std::int64_t chunks_meshed = 0;     ///< in total
    double last_mesh_seconds = 0.0;     ///< of one chunk, on its worker
    double last_latency_seconds = 0.0;  ///< from the `update` after an edit to the finished, lit surface
    /// Number of times a worker ran out of memory. The chunk stays pending and is tried again.
    std::int64_t out_of_memory = 0;
  };
  [[nodiscard]] Stats stats() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
