#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>

namespace quoin {

/// Light at a voxel, 0 (dark) to 15: of the sky, and of lamps in three colours.
struct LightLevels {
  std::uint8_t sky = 0;
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;

  bool operator==(const LightLevels&) const = default;
};

/// In 16 bits, as meshes carry it: sky in the lowest four, then red, green and blue. Requires: levels of at most 15.
[[nodiscard]] constexpr std::uint16_t packed(LightLevels levels) {
  QUOIN_ASSERT(std::max({levels.sky, levels.red, levels.green, levels.blue}) <= 15, "levels from 0 to 15");
  return static_cast<std::uint16_t>(levels.sky | levels.red << 4 | levels.green << 8 | levels.blue << 12);
}
/// The levels of such a word.
[[nodiscard]] constexpr LightLevels unpacked_light(std::uint16_t word) {
  return {static_cast<std::uint8_t>(word & 15), static_cast<std::uint8_t>(word >> 4 & 15),
          static_cast<std::uint8_t>(word >> 8 & 15), static_cast<std::uint8_t>(word >> 12)};
}

/// What a type gives off by itself: 0 for most. `emission` of 1 and more is level 15 in the brightest channel of its
/// colour, the others in proportion to their sRGB values; less is less in proportion. Its `sky` is 0.
[[nodiscard]] LightLevels lamp_levels(const VoxelProperties& properties);

struct PropagatedLightOptions {
  /// What types give off, for games with levels of their own; empty: `lamp_levels`. `sky` counts as 0, and
  /// what is above 15 as 15.
  std::function<LightLevels(VoxelType, const VoxelProperties&)> lamp{};
};

/// Light in game time: that of the sky and of coloured lamps, spread through whatever is not opaque, one level less a
/// step, kept up to date while a grid is edited. What block games light their faces with.
///
///   PropagatedLight light;
///   light.update(grid, types);                                    // once, and after each edit
///   for (const ChunkChange& change : light.changes_since(cursor).items) mesh_again(change);
///   light.split(quads, chunk, lit_quads, levels);                 // a level a quad, merging kept where it is equal
///
/// Sky:     level 15 falls straight down without loss, until something opaque; it is 15 outside of the world. y is up.
/// Lamps:   the level of a type is in its own voxel, and spreads from there, whatever its visibility.
/// Colours: a transparent type lets a colour of lamps pass where that channel of its colour is at least half the
///          greatest, the sky always.
/// Exact:   equal to a search from every lamp and every column of sky (Dijkstra), whatever edits led there.
/// Cost:    of an update O(rows of 64 voxels within reach of what changed, and of columns of sky that it opens or
///          closes), times the level. The first: some tenths of a millisecond a chunk.
/// Memory:  a bit a voxel, channel and bit of its levels, where these are not the same in a slab of 64x4x4 voxels; less
///          where rows are alike.
/// Threads: any number may read at once, and take snapshots; an update needs it to itself. A snapshot is light of its
///          own: LiveLight updates on a worker while the game shows what was there before.
/// Source:  levels as block games have them; spread by whole words instead of a queue.
class PropagatedLight {
 public:
  explicit PropagatedLight(PropagatedLightOptions options = {});
  PropagatedLight(PropagatedLight&&) noexcept;
  PropagatedLight& operator=(PropagatedLight&&) noexcept;
  ~PropagatedLight();

  /// Takes over what was edited since the last update, or all of another grid or where types pass or give off another
  /// light. When it throws (bad_alloc), the next update begins anew.
  void update(const Grid& grid, const VoxelRegistry& types, Threads threads = {});

  /// The light as it is now; later updates of either do not reach the other. A cursor of this one's changes reads
  /// on in the snapshot, and the other way round, until the snapshot is updated itself, which goes on from what it is.
  /// Cost: some pointers; an update copies of what the two share no more than it changes, in slabs of 64x4x4 voxels.
  [[nodiscard]] PropagatedLight snapshot() const;

  /// As of the last update. Of an opaque voxel: what it gives off.
  [[nodiscard]] LightLevels at(IVec3 voxel) const;
  /// The 64 voxels along x in whose row `voxel` lies, packed.
  void read_row(IVec3 voxel, std::span<std::uint16_t, kChunkEdge> out) const;

  /// Where light changed, exactly, as Grid::changes_since tells of voxels.
  [[nodiscard]] GridChanges changes_since(ChangeCursor& cursor) const;

  /// Splits quads of a chunk where the light in front of their faces changes. `light` gets a level a quad of `out`, in
  /// the order of the quads they come from; both are replaced.
  void split(const QuadBuffer& quads, IVec3 chunk, QuadBuffer& out, std::vector<std::uint16_t>& light) const;

  /// Bytes held, also those that snapshots share.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  explicit PropagatedLight(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
