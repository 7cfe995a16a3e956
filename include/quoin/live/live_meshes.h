#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/light/scene_light.h>
#include <quoin/light/surface_light.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/scene/scene.h>

namespace quoin {

enum class SurfaceStyle : std::uint8_t { Blocky, Smooth };

/// What of a SceneGrid a surface is of.
enum class SurfaceContent : std::uint8_t {
  Voxels,  ///< its `grid`, in the style of the meshes
  Field,   ///< its `field`; always smooth
};

/// The quads of one region of a chunk: [LiveMeshOptions::region_edge]^3 voxels from a multiple of that on.
struct SurfaceRegion {
  IVec3 region{0};  ///< it begins at voxel `region` * edge of the chunk
  /// Of the surface's quads those that face Direction d are [opaque[d], opaque[d + 1]), of transparent types
  /// [transparent[d], transparent[d + 1]): what the camera cannot see of a region need not be drawn.
  std::array<std::uint32_t, 7> opaque{};
  std::array<std::uint32_t, 7> transparent{};
  std::uint64_t hash = 0;  ///< of its quads and their light
};

/// The surface of one chunk as it is drawn; never changed once it was made.
struct ChunkSurface {
  SurfaceStyle style = SurfaceStyle::Blocky;
  int level = 0;  ///< of a field: of detail, 0 to kMaxSmoothLevel; its cells are 2^level samples wide
  /// Blocky: voxels, origin at the chunk's minimum corner; those of transparent types last, each by region, then
  /// direction, layer, row, column. None reaches over the border of a region.
  QuadBuffer quads;
  std::size_t opaque_quads = 0;
  std::vector<FaceLight> light;        ///< of each quad, where LiveMeshes uses light; else empty
  std::vector<SurfaceRegion> regions;  ///< blocky: those with quads, sorted by z, then y, then x
  /// Smooth: point p of the mesh is point p + 64 * chunk of the grid, of voxels p + 0.5 + 64 * chunk (samples are their
  /// middles); a colour (linear) and a type a vertex. Each transparent type is a closed body of its own, and of voxels
  /// thin things are kept (SmoothMeshOptions::keep_thin), as mesh_scene_smoothly has it; instances are not united.
  SmoothChunkMesh smooth;
  std::size_t glass_indices = 0;  ///< of its indices: those of transparent bodies, which come last
  std::vector<LinearRgba16> albedo;
  std::vector<VoxelType> types;
  /// What LiveMeshOptions::convert made of it; null without.
  std::shared_ptr<const void> converted;

  [[nodiscard]] bool is_empty() const { return quads.empty() && smooth.indices.empty(); }
  [[nodiscard]] std::int64_t triangles() const;
  [[nodiscard]] std::size_t bytes() const;  ///< without `converted`
};

/// What replaces the surface of a chunk.
struct SurfaceUpdate {
  GridHandle grid;
  IVec3 chunk{0};
  std::shared_ptr<const ChunkSurface> surface;  ///< null: nothing of the chunk is seen any more
  SurfaceContent content = SurfaceContent::Voxels;
  /// Bit x + n (y + n z), n = 64 / region_edge: the quads of that region differ from those that were given before, or
  /// there were none, or there are none now. What is not blocky has one region.
  std::uint64_t changed_regions = ~std::uint64_t{0};
};

struct LiveMeshOptions {
  SurfaceStyle style = SurfaceStyle::Blocky;  ///< of voxels
  bool merge = true;                          ///< blocky: neighbouring faces become one quad
  /// Blocky: 16, 32 or 64. Smaller regions are more quads, and less that is new to a graphics card after an edit.
  int region_edge = 64;
  LightMerging light_merging = LightMerging::Linear;  ///< blocky, with `use_light`: where faces stay merged
  SmoothOcclusionOptions occlusion{};                 ///< of smooth surfaces, those of fields too
  SurfaceColours colours = SurfaceColours::Sharp;     ///< of smooth surfaces of voxels; those of fields are blended
  /// Of fields: where all eyes are farther than this from a chunk, in samples of its nearest instance, it has level of
  /// detail 1, at twice that 2, and so on to kMaxSmoothLevel. A level is left only a tenth beyond where it ends. 0 and
  /// less count as 1, NaN as infinity: level 0 everywhere.
  double detail_distance = std::numeric_limits<double>::infinity();
  InstanceFilter instances = InstanceFilter::Visible;  ///< whose grids are meshed
  Threads workers{};  ///< unlike elsewhere 0 means one less than the machine has, at least 1
  /// Called by workers, several at once, for each surface that was made, before it can be taken: what it returns, say
  /// vertices in a format of your own, is ChunkSurface::converted. May be empty.
  std::function<std::shared_ptr<const void>(const SurfaceUpdate&)> convert{};
  /// Called from a worker that is done with a chunk: there may be something to take, less is `pending`, and there is
  /// room for more chunks. May be empty. It may call `take`, `pending` and `stats`, and nothing else of the meshes.
  std::function<void()> on_ready{};
};

/// The meshes of a scene's chunks, of voxels and of fields, kept up to date by worker threads while it is edited.
///
/// Only `update` reads the scene: workers read snapshots, so edits never wait for them. A chunk is meshed again only
/// when an edit could have changed its mesh; of several edits before its turn the last counts, and results of what was
/// removed meanwhile are dropped.
/// Seams:   surfaces of a field fit each other at any time: what an edit, or a change of levels of detail, changes in
///          chunks beside each other is given by one `take`, once all of it is there.
/// Callbacks: what `on_ready` or `convert` throws is thrown by the next `update` or `finish`, the first of several;
///           the surface is there without `converted`. bad_alloc of `convert` counts as the worker's.
/// Lifetime: the scene is only read within calls; surfaces belong to whoever took them.
/// Threads:  `update` and `finish` come from one thread at a time, the others from any.
class LiveMeshes {
 public:
  /// Requires: `region_edge` is 16, 32 or 64. Errors: std::system_error where the workers cannot be started.
  explicit LiveMeshes(const LiveMeshOptions& options = {});
  /// Waits for the chunks that are being meshed; others are given up.
  ~LiveMeshes();
  LiveMeshes(const LiveMeshes&) = delete;
  LiveMeshes& operator=(const LiveMeshes&) = delete;

  /// Takes over whatever was changed: voxels, grids, types whose visibility changed (smooth: whose colour did),
  /// instances that first show a grid or last showed it. Chunks nearest to an eye (world) come first. Call it after
  /// edits and once a frame while `pending` is not 0: no more chunks are handed out than keep the workers busy.
  ///
  /// Cost:   O(what changed), whatever the size of the world; O(instances) when some of them came, went or changed, and
  ///         while chunks wait for workers, besides O(chunks that wait).
  /// Errors: bad_alloc; the next call begins anew with all chunks.
  void update(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});

  /// From the next update on blocky surfaces of voxels carry this light at their corners, and a chunk is also meshed
  /// again when its light alone changed. Null: none. It is only read within `update` and `finish`; that of LiveLight
  /// (`&light.shown()`) is a few frames late, and so are the meshes.
  /// Lifetime: it must outlive its use here, until another is used.
  void use_light(const SceneLight* light);

  /// The surfaces that are new since the last call: of one chunk only the last, never one older than was given before.
  /// Of chunks of which nothing was, or is, to be seen, none is given. Once those of voxels have `max_bytes`, as
  /// ChunkSurface::bytes counts them, the rest waits for another call; those of fields, which fit each other, do not.
  /// Errors: bad_alloc, as `update`.
  [[nodiscard]] std::vector<SurfaceUpdate> take(std::size_t max_bytes = std::numeric_limits<std::size_t>::max());

  /// Chunks whose newest surface was not taken yet.
  [[nodiscard]] std::size_t pending() const;
  /// Calls `update` until nothing is left to mesh. For tests and screenshots.
  /// Errors: bad_alloc, also when workers' memory runs out for every chunk that is left.
  void finish(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});

  struct Stats {
    std::int64_t chunks_meshed = 0;     ///< in all
    double last_mesh_seconds = 0.0;     ///< of one chunk, on its worker
    double last_latency_seconds = 0.0;  ///< from the `update` that saw an edit to the surface's being there
    std::int64_t out_of_memory = 0;     ///< times a worker's memory ran out; the chunk stays pending, to be tried again
  };
  [[nodiscard]] Stats stats() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
