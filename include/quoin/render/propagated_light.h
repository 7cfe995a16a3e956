#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// Light levels at a voxel, 0 (dark) to 15: sky light, and lamp light in three colours.
struct LightLevels {
  std::uint8_t sky = 0;
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;

  bool operator==(const LightLevels&) const = default;
};

/// Packs light levels into 16 bits for meshes: sky in the lowest four bits, then red, green and blue.
/// Requires: levels of at most 15.
[[nodiscard]] constexpr std::uint16_t packed(LightLevels levels) {
  QUOIN_ASSERT(std::max({levels.sky, levels.red, levels.green, levels.blue}) <= 15, "levels from 0 to 15");
  return static_cast<std::uint16_t>(levels.sky | levels.red << 4 | levels.green << 8 | levels.blue << 12);
}
/// Returns the light levels in a packed word.
[[nodiscard]] constexpr LightLevels unpacked_light(std::uint16_t word) {
  return {static_cast<std::uint8_t>(word & 15), static_cast<std::uint8_t>(word >> 4 & 15),
          static_cast<std::uint8_t>(word >> 8 & 15), static_cast<std::uint8_t>(word >> 12)};
}

struct PropagatedLightOptions {
  /// Returns the lamp light that a type emits, for games with their own levels. `sky` is ignored, and levels above 15
  /// count as 15. If empty, an `emission` of 1 or more gives level 15 in the brightest channel of the type's colour,
  /// and the other channels in proportion to their sRGB values. A lower emission scales the levels.
  std::function<LightLevels(VoxelType, const VoxelProperties&)> lamp{};
};

/// Real-time light as in block games: sky light and coloured lamp light that spread through all voxels of types that do
/// not block light, and lose one level per step or more. Updates incrementally after edits.
///
///   PropagatedLight light;
///   light.update(grid, types);                                    // once, and after each edit
///   const GridChanges changes = light.changes_since(cursor);      // `all` the first time: chunks() has all chunks
///   for (const IVec3 chunk : changes.chunks(grid)) mesh_again(chunk);
///   light.split(quads, chunk, lit_quads, levels);                 // one level per quad; merged where levels agree
///
/// Sky:     level 15 falls straight down without loss until it meets a voxel that blocks it or costs levels, and is 15
///          outside the world. y is up.
/// Costs:   a step into a voxel costs one level, or `light_cost` levels of its type if these are more. Light enters a
///          transparent type that blocks light, at the same cost, and stays there (VoxelProperties::blocks_light); a
///          channel in which such a type emits keeps the type's own level.
/// Lamps:   a type's level applies in its own voxel and spreads from there, even if the voxel is opaque.
/// Shapes:  light passes between two voxels unless a shape of opaque material covers the common side of either wholly
///          (ShapeModel::covers_side): a slab stops light downwards, a door behind it. This also applies to
///          lamps with shapes. A type that sets `blocks_light` stops light as a cube, or not at all.
/// Colours: a transparent type passes a channel of lamp light if that channel of its colour is at least half its
///          greatest channel. It always passes sky light. An opaque type that light passes does so for all channels.
/// Exact:   the result equals a search from every lamp and every sky column (Dijkstra), independent of the order of
///          edits.
/// Cost:    an update costs O(rows of 64 voxels within reach of the edits, and of sky columns that the edits open or
///          close), times the levels. The first update takes some tenths of a millisecond per chunk. A chunk that a
///          partial grid loads or unloads costs as an edit of its voxels; a chunk of air costs nothing.
/// Memory:  at most 16 bits per voxel (4 channels of 4 bits), and only for channels that are not uniform in a slab of
///          64x4x4 voxels. Parts of rows that equal the row before are not stored.
/// Threads: any number can read and take snapshots at once; an update needs exclusive access. A snapshot is
///          independent: LiveLight updates on a worker while the game shows the earlier state.
/// Source:  levels as in block games; spread by whole 64-bit words instead of a queue.
class PropagatedLight {
 public:
  explicit PropagatedLight(PropagatedLightOptions options = {});
  PropagatedLight(PropagatedLight&&) noexcept;
  PropagatedLight& operator=(PropagatedLight&&) noexcept;
  ~PropagatedLight();

  /// Applies the edits since the last update, and changes of data if types have shapes. Recomputes everything for
  /// another grid, or when the transparency, shapes, light properties or emission of types changed.
  /// If it throws (bad_alloc), the next update starts from scratch.
  void update(const Grid& grid, const VoxelRegistry& types, Threads threads = {});

  /// Returns a copy of the current light. The two are independent. A cursor of one is also valid in the other until the
  /// snapshot itself is updated.
  /// Cost: some pointers. An update copies only the shared slabs of 64x4x4 voxels that it changes.
  [[nodiscard]] PropagatedLight snapshot() const;

  /// Returns the levels at a voxel as of the last update. For an opaque voxel that blocks light: its emission.
  [[nodiscard]] LightLevels at(IVec3 voxel) const;
  /// Reads the packed levels of the row of 64 voxels along x that contains `voxel`.
  void read_row(IVec3 voxel, std::span<std::uint16_t, kChunkEdge> out) const;

  /// Returns exactly the changes of light, as Grid::changes_since does for voxels.
  [[nodiscard]] GridChanges changes_since(ChangeCursor& cursor) const;

  /// Splits quads of a chunk where the light in front of their faces changes. `light` gets one packed level per quad of
  /// `out`, in the order of the source quads. Replaces `out` and `light`.
  void split(const QuadBuffer& quads, IVec3 chunk, QuadBuffer& out, std::vector<std::uint16_t>& light) const;

  /// Returns the number of rows of up to 64 voxels that all updates so far have visited to compute light: a measure of
  /// their cost that does not depend on the machine. Depends on the thread count.
  [[nodiscard]] std::uint64_t visited_rows() const;

  /// Returns the bytes held, including bytes shared with snapshots.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  explicit PropagatedLight(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Conversion of propagated light levels to colours. Images, shaders and mesh files all use these functions.

/// Mean of the light levels of several voxels: 0 to 15, fractional.
struct MeanLevels {
  float sky = 0.0F;
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;

  bool operator==(const MeanLevels&) const = default;
};

/// Colours that light levels convert to, linear.
struct LightLook {
  Vec3 sky{1.0F};
  Vec3 lamps{1.0F};  ///< light of level 15 from lamps; multiplied with the lamps' own colours
  Vec3 least{0.0F};  ///< minimum light, added everywhere, also at level 0
};

/// Returns the colours of propagated light. The sky's colour combines sky and sun: 0.3 of the ambient light's colour,
/// scaled by the sky's brightness, plus 0.7 of the sun's colour, scaled by the sun's brightness. By day, with both
/// brightnesses 1, it is white. `least_light`: LightOptions::least_light.
[[nodiscard]] LightLook light_look(const Environment& environment, double least_light = 0.0);

/// Returns the linear brightness of a light level: f / (4 - 3 f) with f = level / 15. It is 1 at level 15 and 0 at
/// level 0. It stays within 0.04 of 0.8^(15 - level), the curve of older games, but reaches 0.
/// Source: the curve of Minecraft's light table, applied to linear light.
[[nodiscard]] constexpr float light_of_level(float level) {
  const float f = level * (1.0F / 15.0F);
  return f / (4.0F - 3.0F * f);
}

/// Returns the brightness of a surface by its orientation: 1 upwards, 0.5 downwards, 0.8 along z, 0.6 along x, and
/// between these weighted by the squares of the normal. It keeps edges visible in evenly lit rooms.
/// Source: Minecraft's block shading, extended to any normal as in Forge.
[[nodiscard]] constexpr float light_of_facing(Vec3 normal) {
  const float up = normal.y < 0.0F ? 0.5F : 1.0F;
  return 0.6F * normal.x * normal.x + up * normal.y * normal.y + 0.8F * normal.z * normal.z;
}

/// Returns the linear, unclamped factor for a surface's colour. Sky light and lamp light add up.
/// Requires: `normal` has unit length, in grid coordinates (y is up).
[[nodiscard]] inline Vec3 light_colour(const MeanLevels& levels, Vec3 normal, const LightLook& look) {
  const Vec3 of_lamps{light_of_level(levels.red), light_of_level(levels.green), light_of_level(levels.blue)};
  return light_of_facing(normal) * (look.least + light_of_level(levels.sky) * look.sky + of_lamps * look.lamps);
}

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
/// Fields: a solid sample (i, j, k) blocks light like voxel (i, j, k), so the light is shifted by half a voxel.
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
  struct [[gnu::visibility("hidden")]] Entry;
  PropagatedLightOptions options_;
  std::unique_ptr<Entry> unknown_;  // returned for unknown grids
  std::map<GridHandle, std::unique_ptr<Entry>> grids_;
};

}  // namespace quoin
