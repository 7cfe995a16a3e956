#include "terrain/terrain_parts.h"

#include <algorithm>
#include <array>
#include <memory>
#include <span>

#include <quoin/core/assert.h>

namespace quoin::terrain {
namespace {

/// For each layer of a chunk, one bit per column, set if something reaches this high.
class Profile {
 public:
  /// `height` is the topmost layer that column x fills; negative is none.
  void add(int x, int height) {
    QUOIN_ASSERT(x >= 0 && x < kChunkEdge, "0 <= x < 64");
    if (height >= 0) reach_[static_cast<std::size_t>(std::min(height, kChunkEdge - 1))] |= std::uint64_t{1} << x;
  }
  void finish() {
    for (std::size_t y = kChunkEdge - 1; y > 0; --y) reach_[y - 1] |= reach_[y];
  }
  [[nodiscard]] std::uint64_t operator[](int y) const {
    QUOIN_ASSERT(y >= 0 && y < kChunkEdge, "0 <= y < 64");
    return reach_[static_cast<std::size_t>(y)];
  }

 private:
  std::array<std::uint64_t, kChunkEdge> reach_{};
};

/// The profiles of one slice of constant z.
struct Slice {
  Profile solid;
  Profile below_cover;
  Profile stone;
  Profile buried;  ///< no side can be seen
  Profile may_be_cave;
  std::array<std::uint64_t, kStrata> shifted{};
  std::array<std::uint64_t, kSurfaces> covered_with{};
  std::uint64_t sandy = 0;
};

/// Returns the highest y where a cave may remove a column's ground. Caves open only in steep slopes and never into
/// water.
int cave_ceiling(const Column& column, int water_level) {
  if (column.lowest < water_level) return column.lowest - 2;
  return column.is_steep ? column.height : column.height - 4;
}

Slice make_slice(const Column* columns, int floor, int water_level) {
  Slice slice;
  for (int x = 0; x < kChunkEdge; ++x) {
    const Column& column = columns[x];
    QUOIN_ASSERT(column.stratum >= 0 && column.stratum < kStrata && static_cast<int>(column.surface) < kSurfaces,
                 "a stratum and a surface");
    slice.solid.add(x, column.height - floor);
    slice.below_cover.add(x, column.height - 1 - floor);
    const bool is_bare = column.surface == Surface::Stone;
    slice.stone.add(x, is_bare ? column.height - floor : column.height - 1 - column.soil - floor);
    slice.may_be_cave.add(x, cave_ceiling(column, water_level) - floor);
    slice.buried.add(x, (column.is_steep ? column.lowest - 2 : column.height) - floor);
    slice.shifted[static_cast<std::size_t>(column.stratum)] |= std::uint64_t{1} << x;
    slice.covered_with[static_cast<std::size_t>(column.surface)] |= std::uint64_t{1} << x;
    slice.sandy |= std::uint64_t{column.is_sandy} << x;
  }
  for (Profile* profile : {&slice.solid, &slice.below_cover, &slice.stone, &slice.buried, &slice.may_be_cave}) {
    profile->finish();
  }
  return slice;
}

std::uint64_t bits_between(int first, int end) {
  QUOIN_ASSERT(first >= 0 && first < end && end <= kChunkEdge, "0 <= first < end <= 64");
  return (~std::uint64_t{0} >> (kChunkEdge - (end - first))) << first;
}

/// Returns the columns whose bare rock is dark in layer `y` of the world.
std::uint64_t dark_columns(const Slice& slice, int y) {
  QUOIN_ASSERT(y >= 0, "a layer of the world");
  constexpr int kDarkLayers = 3;
  std::uint64_t dark = 0;
  for (int i = 0; i < kDarkLayers; ++i) dark |= slice.shifted[static_cast<std::size_t>((y + i) % kStrata)];
  return dark;
}

class GroundWriter {
 public:
  GroundWriter(const TerrainTypes& types, Chunk& chunk, int floor, std::uint64_t inside)
      : cover_{types.grass, types.meadow, types.earth, types.stone, types.sand, types.gravel, types.snow},
        types_(types),
        chunk_(chunk),
        floor_(floor),
        inside_(inside) {}

  void write_row(const Slice& slice, int y, int z, bool is_under_water, std::uint64_t caves) {
    const std::uint64_t stone = slice.stone[y];
    const std::uint64_t soil = slice.below_cover[y] & ~stone;
    const std::uint64_t cover = slice.solid[y] & ~slice.below_cover[y] & ~stone;
    const std::uint64_t dark = stone & ~slice.buried[y] & dark_columns(slice, floor_ + y);
    set(y, z, stone & ~dark & ~caves, types_.stone);
    set(y, z, dark & ~caves, types_.dark_stone);
    set(y, z, soil & ~slice.sandy & ~caves, types_.earth);
    set(y, z, soil & slice.sandy & ~caves, types_.sand);
    for (std::size_t i = 0; i < kSurfaces && cover != 0; ++i) {
      set(y, z, cover & slice.covered_with[i] & ~caves, cover_[i]);
    }
    if (is_under_water) set(y, z, ~slice.solid[y], types_.water);
  }

  void carve(int y, int z, std::uint64_t caves) { set(y, z, caves, kAir); }

 private:
  void set(int y, int z, std::uint64_t mask, VoxelType type) {
    if ((mask & inside_) != 0) chunk_.fill_row(y, z, mask & inside_, type);
  }

  std::array<VoxelType, kSurfaces> cover_;
  const TerrainTypes& types_;
  Chunk& chunk_;
  int floor_;  ///< y of the chunk's lowest layer
  std::uint64_t inside_;
};

struct Extent {
  int all_stone = 0;  ///< everything below is stone of one colour
  int highest = 0;    ///< everything above is air or water
};

Extent extent_of(std::span<const Column> columns) {
  QUOIN_ASSERT(!columns.empty(), "at least one column");
  Extent extent{columns.front().height, columns.front().height};
  for (const Column& column : columns) {
    extent.all_stone = std::min(extent.all_stone, std::min(column.height - column.soil, column.lowest - 2));
    extent.highest = std::max(extent.highest, column.height);
  }
  return extent;
}

void fill(Chunk& chunk, const IBox& box, VoxelType type) {
  if (!box.empty()) chunk.fill_box(box, type, [](int, int, std::uint64_t) {});
}

/// The layers of four slices, a slab deep, that need a test per layer. Layers below are stone, layers above are water
/// or air. Both ends are multiples of 4 except at the box's own ends.
struct Layers {
  int from;
  int to;
};

}  // namespace

Chunk make_ground(const Landform& land, const std::vector<Column>& columns, const TerrainTypes& types, IVec3 at,
                  const IBox& part, bool has_caves) {
  QUOIN_ASSERT(columns.size() == std::size_t{kChunkEdge} * kChunkEdge, "a column of ground per column of voxels");
  QUOIN_ASSERT((part.min.z | part.max.z) % 4 == 0, "whole slabs");
  const int floor = at.y * kChunkEdge;
  const int water_end = std::clamp(land.water_level() + 1 - floor, part.min.y, part.max.y);
  const Extent whole = extent_of(columns);
  Chunk chunk;
  if (part.empty() || std::max(whole.highest, land.water_level()) < floor) return chunk;
  const auto caves = has_caves ? std::make_unique<CaveMasks>() : nullptr;
  if (caves != nullptr) find_caves(land.seed(), at, whole.highest + 1 - floor, *caves);
  GroundWriter writer(types, chunk, floor, bits_between(part.min.x, part.max.x));
  for (int first_z = part.min.z; first_z < part.max.z; first_z += 4) {
    const std::span band(columns.data() + first_z * kChunkEdge, 4 * std::size_t{kChunkEdge});
    const Extent extent = extent_of(band);
    // Fills whole slabs at a time if they are uniform: they stay uniform, which is fast and small.
    const Layers layers{std::clamp((extent.all_stone - floor) & ~3, part.min.y, part.max.y),
                        std::clamp((extent.highest + 4 - floor) & ~3, part.min.y, part.max.y)};
    fill(chunk, {{part.min.x, part.min.y, first_z}, {part.max.x, layers.from, first_z + 4}}, types.stone);
    fill(chunk, {{part.min.x, layers.to, first_z}, {part.max.x, water_end, first_z + 4}}, types.water);
    for (int z = first_z; z < first_z + 4; ++z) {
      const Slice slice = make_slice(columns.data() + z * kChunkEdge, floor, land.water_level());
      for (int y = part.min.y; y < layers.to; ++y) {
        const bool is_bedrock = floor + y < 2;
        const std::uint64_t hollow = caves == nullptr || is_bedrock ? 0 : caves->row(y, z) & slice.may_be_cave[y];
        if (y >= layers.from) {
          writer.write_row(slice, y, z, y < water_end, hollow);
        } else if (hollow != 0) {
          writer.carve(y, z, hollow);
        }
      }
    }
  }
  return chunk;
}

}  // namespace quoin::terrain
