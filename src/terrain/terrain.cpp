#include <quoin/terrain/terrain.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/terrain/noise.h>

#include "terrain/landform.h"
#include "terrain/terrain_parts.h"

namespace quoin::terrain {
namespace {

constexpr std::uint32_t kTreeStream = 0xC00;
constexpr std::uint32_t kRockStream = 0xD00;
constexpr int kTreeSpacing = 6;
constexpr int kRockSpacing = 13;

// Returns a number from 0 to `choices` - 1 from at least four bits of a hash.
int pick(std::uint32_t hash, int shift, int choices) {
  QUOIN_ASSERT(shift >= 0 && shift <= 28 && choices > 0 && choices <= 256, "at least four bits, and 1 to 256 choices");
  return static_cast<int>((hash >> shift & 0xFFU) * static_cast<std::uint32_t>(choices) >> 8);
}

bool fits(const Plant& plant, const IBox& world) {
  const IVec3 reach{kPlantReach, 0, kPlantReach};
  return world.contains(plant.foot - reach) && world.contains(plant.foot + reach + IVec3{0, plant.height, 0});
}

std::optional<Plant> tree_in_cell(const Landform& land, int cell_x, int cell_z) {
  const std::uint32_t hash = hash_of(land.seed() + kTreeStream, cell_x, cell_z);
  const int x = cell_x * kTreeSpacing + pick(hash, 0, kTreeSpacing - 2);
  const int z = cell_z * kTreeSpacing + pick(hash, 8, kTreeSpacing - 2);
  const double forest = land.forest(x, z);
  const auto chance = static_cast<double>(hash >> 16 & 0xFFU) * (1.0 / 256.0);
  if (chance > std::clamp(forest, 0.05, 0.85)) return std::nullopt;
  const Column column = land.column(x, z);
  const bool is_soil = column.surface == Surface::Grass || column.surface == Surface::Meadow;
  if (!is_soil || column.height <= land.sea() + 1 || column.height - column.lowest > 2) return std::nullopt;
  Plant plant;
  plant.shape = mix_bits(hash);
  plant.foot = {x, column.height, z};
  const int above_sea = column.height - land.sea();
  const bool is_high = above_sea > land.top() / 5 + pick(plant.shape, 0, 7) - 3;
  if (forest < 0.0 || pick(plant.shape, 8, 9) == 0) {
    plant.growth = Growth::Bush;
    plant.height = 2;
  } else if (is_high || pick(plant.shape, 12, 8) == 0) {
    plant.growth = Growth::Conifer;
    plant.height = 8 + pick(plant.shape, 16, 6);
  } else {
    plant.growth = Growth::Broadleaf;
    plant.height = 7 + pick(plant.shape, 16, 4);
  }
  return plant;
}

std::optional<Plant> rock_in_cell(const Landform& land, int cell_x, int cell_z) {
  const std::uint32_t hash = hash_of(land.seed() + kRockStream, cell_x, cell_z);
  if (pick(hash, 16, 100) >= 30) return std::nullopt;
  const int x = cell_x * kRockSpacing + pick(hash, 0, kRockSpacing);
  const int z = cell_z * kRockSpacing + pick(hash, 8, kRockSpacing);
  const Column column = land.column(x, z);
  if (column.is_steep || column.surface == Surface::Snow) return std::nullopt;
  return Plant{{x, column.height, z}, Growth::Rock, 3, mix_bits(hash)};
}

int cell_of(int voxel, int spacing) {
  QUOIN_ASSERT(spacing > 0, "a positive spacing");
  return voxel >= 0 ? voxel / spacing : -((spacing - 1 - voxel) / spacing);
}

template <class InCell>
void add_plants(int spacing, const IBox& world, IVec3 first, IVec3 last, InCell&& in_cell, std::vector<Plant>& out) {
  for (int z = cell_of(first.z, spacing); z <= cell_of(last.z, spacing); ++z) {
    for (int x = cell_of(first.x, spacing); x <= cell_of(last.x, spacing); ++x) {
      const std::optional<Plant> plant = in_cell(x, z);
      if (plant && fits(*plant, world)) out.push_back(*plant);
    }
  }
}

/// Writes single voxels; skips voxels outside the chunk.
class Painter {
 public:
  Painter(IVec3 chunk, Chunk& out) : origin_(chunk * kChunkEdge), chunk_(out) {}

  void put(IVec3 voxel, VoxelType type, bool only_in_air) {
    const IVec3 local = voxel - origin_;
    if (chunk_of(local) != IVec3{0}) return;
    if (only_in_air && chunk_.get(local) != kAir) return;
    chunk_.set(local, type);
  }

  /// Fills the voxels whose centre lies in an ellipsoid with a rough border, varied by `shape`.
  void put_ball(IVec3 middle, double across, double up, VoxelType type, std::uint32_t shape, bool only_in_air) {
    QUOIN_ASSERT(across > 0.0 && up > 0.0, "positive radii");
    const double per_across = 1.0 / (across * across);
    const double per_up = 1.0 / (up * up);
    for (int z = -kPlantReach; z <= kPlantReach; ++z) {
      for (int y = -kPlantReach; y <= kPlantReach; ++y) {
        for (int x = -kPlantReach; x <= kPlantReach; ++x) {
          const double fray = static_cast<double>(hash_of(shape, x, y, z) >> 24) * (0.45 / 256.0);
          if ((x * x + z * z) * per_across + y * y * per_up + fray > 1.15) continue;
          put(middle + IVec3{x, y, z}, type, only_in_air);
        }
      }
    }
  }

 private:
  IVec3 origin_;
  Chunk& chunk_;
};

void draw_conifer(Painter& painter, const Plant& plant, VoxelType needles) {
  for (int y = 2; y <= plant.height; ++y) {
    const int below_tip = plant.height - y;
    const double radius = 0.4 + 0.30 * below_tip - (below_tip % 2 == 0 ? 0.0 : 0.8) + 0.02 * (plant.shape & 15U);
    const double r = std::min(radius, 3.2);
    const int reach = 3;
    for (int z = -reach; z <= reach; ++z) {
      for (int x = -reach; x <= reach; ++x) {
        const bool is_stem = x == 0 && z == 0;
        if (is_stem || x * x + z * z <= r * r) painter.put(plant.foot + IVec3{x, y, z}, needles, true);
      }
    }
  }
}

void draw_leaves(Painter& painter, const Plant& plant, const TerrainTypes& types) {
  const VoxelType leaves = (plant.shape >> 28) < 5 ? types.young_leaves : types.leaves;
  const double size = 0.05 * (plant.shape >> 20 & 15U);
  if (plant.growth == Growth::Conifer) {
    draw_conifer(painter, plant, types.needles);
  } else if (plant.growth == Growth::Broadleaf) {
    painter.put_ball(plant.foot + IVec3{0, plant.height - 3, 0}, 2.6 + size, 2.5, leaves, plant.shape, true);
  } else if (plant.growth == Growth::Bush) {
    painter.put_ball(plant.foot + IVec3{0, 1, 0}, 1.2 + size, 1.2, leaves, plant.shape, true);
  }
}

}  // namespace

std::vector<Plant> plants_near(const Landform& land, const TerrainOptions& options, const IBox& world, int first_x,
                               int first_z, int edge) {
  const IVec3 first{first_x - kPlantReach, 0, first_z - kPlantReach};
  const IVec3 last{first_x + edge - 1 + kPlantReach, 0, first_z + edge - 1 + kPlantReach};
  std::vector<Plant> plants;
  if (options.rocks) {
    add_plants(
        kRockSpacing, world, first, last, [&](int x, int z) { return rock_in_cell(land, x, z); }, plants);
  }
  if (options.plants) {
    add_plants(
        kTreeSpacing, world, first, last, [&](int x, int z) { return tree_in_cell(land, x, z); }, plants);
  }
  return plants;
}

void draw_plants(const std::vector<Plant>& plants, const TerrainTypes& types, IVec3 chunk, Chunk& out) {
  Painter painter(chunk, out);
  for (const Plant& plant : plants) {
    if (plant.growth != Growth::Rock) continue;
    const double size = 1.3 + 0.09 * (plant.shape & 15U);
    painter.put_ball(plant.foot + IVec3{0, 1, 0}, size, 0.75 * size, types.rock, plant.shape, false);
  }
  for (const Plant& plant : plants) {
    if (plant.growth != Growth::Rock) draw_leaves(painter, plant, types);
  }
  for (const Plant& plant : plants) {
    if (plant.growth != Growth::Broadleaf && plant.growth != Growth::Conifer) continue;
    const int stem = plant.growth == Growth::Conifer ? plant.height - 6 : plant.height - 3;
    for (int y = 1; y <= stem; ++y) painter.put(plant.foot + IVec3{0, y, 0}, types.trunk, false);
  }
}

namespace {

constexpr int kStep = 4;
constexpr int kPoints = kChunkEdge / kStep + 1;
constexpr double kAcross = 1.0 / 34.0;  // tunnels lie flatter than they are wide
constexpr double kUp = 1.0 / 21.0;
constexpr double kReach = 0.115;  // maximum absolute value in a cave

struct Samples {
  std::array<std::array<double, 2>, static_cast<std::size_t>(kPoints) * kPoints * kPoints> at;

  [[nodiscard]] static std::size_t index(int x, int y, int z) {
    QUOIN_ASSERT(std::min({x, y, z}) >= 0 && std::max({x, y, z}) < kPoints, "a point of the chunk");
    return static_cast<std::size_t>((z * kPoints + y) * kPoints + x);
  }
};

void sample(std::uint32_t seed, IVec3 chunk, int layers, Samples& samples) {
  const IVec3 origin = chunk * kChunkEdge;
  for (int z = 0; z < kPoints; ++z) {
    for (int y = 0; y < layers; ++y) {
      for (int x = 0; x < kPoints; ++x) {
        const IVec3 voxel = origin + IVec3{x, y, z} * kStep;
        const double px = kAcross * voxel.x;
        const double py = kUp * voxel.y;
        const double pz = kAcross * voxel.z;
        samples.at[Samples::index(x, y, z)] = {noise3(seed + 0xA00, px, py, pz), noise3(seed + 0xB00, px, py, pz)};
      }
    }
  }
}

using Corners = std::array<std::array<double, 8>, 2>;

// Gets the eight samples around a cell. Returns false if the two interpolations cannot both be near zero.
bool corners_of(const Samples& samples, IVec3 cell, Corners& corners) {
  for (std::size_t i = 0; i < 8; ++i) {
    const int corner = static_cast<int>(i);
    const auto& value =
        samples.at[Samples::index(cell.x + (corner & 1), cell.y + (corner >> 1 & 1), cell.z + (corner >> 2))];
    corners[0][i] = value[0];
    corners[1][i] = value[1];
  }
  return std::all_of(corners.begin(), corners.end(), [](const std::array<double, 8>& values) {
    const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
    return -kReach < *greatest && *least < kReach;
  });
}

double between(double a, double b, double t) {
  return a + t * (b - a);
}

// Adds the voxels of one row of a cell.
std::uint64_t row_of_cell(const Corners& corners, int y, int z) {
  const double ty = (y + 0.5) * (1.0 / kStep);
  const double tz = (z + 0.5) * (1.0 / kStep);
  double ends[2][2];
  for (std::size_t n = 0; n < 2; ++n) {
    for (std::size_t x = 0; x < 2; ++x) {
      const auto& c = corners[n];
      ends[n][x] = between(between(c[x], c[x + 2], ty), between(c[x + 4], c[x + 6], ty), tz);
    }
  }
  std::uint64_t bits = 0;
  for (int x = 0; x < kStep; ++x) {
    const double tx = (x + 0.5) * (1.0 / kStep);
    const double a = between(ends[0][0], ends[0][1], tx);
    const double b = between(ends[1][0], ends[1][1], tx);
    bits |= std::uint64_t{a * a + b * b < kReach * kReach} << x;
  }
  return bits;
}

}  // namespace

void find_caves(std::uint32_t seed, IVec3 chunk, int height, CaveMasks& out) {
  out.rows.fill(0);
  const int cells = std::clamp((height + kStep - 1) / kStep, 0, kPoints - 1);
  if (cells == 0) return;
  const auto samples = std::make_unique<Samples>();
  sample(seed, chunk, cells + 1, *samples);
  Corners corners{};
  for (int z = 0; z < kPoints - 1; ++z) {
    for (int y = 0; y < cells; ++y) {
      for (int x = 0; x < kPoints - 1; ++x) {
        if (!corners_of(*samples, {x, y, z}, corners)) continue;
        for (int i = 0; i < kStep * kStep; ++i) {
          const std::uint64_t bits = row_of_cell(corners, i % kStep, i / kStep);
          out.rows[static_cast<std::size_t>((z * kStep + i / kStep) * kChunkEdge + y * kStep + i % kStep)] |=
              bits << (x * kStep);
        }
      }
    }
  }
}

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

namespace quoin {
namespace {

Status check(const TerrainOptions& options) {
  constexpr int kMaxAcross = 1'024;
  constexpr int kMaxUp = 32;
  constexpr int kMaxPlace = 1 << 20;
  const IVec3 size = options.size;
  if (std::min({size.x, size.y, size.z}) < 1 || size.y > kMaxUp || std::max(size.x, size.z) > kMaxAcross) {
    return make_error(ErrorCode::InvalidArgument,
                      "terrain size: must be 1 to 1024 units of 32 voxels wide and deep, 1 to 32 high");
  }
  if (std::min(options.first_x, options.first_z) < -kMaxPlace ||
      std::max(options.first_x, options.first_z) > kMaxPlace) {
    return make_error(ErrorCode::InvalidArgument, "terrain origin: must be at most 1048576 units from 0");
  }
  return {};
}

// Returns true if all types are set, as by add_terrain_types.
[[maybe_unused]] bool are_filled(const TerrainTypes& t) {
  const VoxelType all[] = {t.grass,  t.earth, t.stone,  t.sand,         t.snow,    t.water, t.meadow,
                           t.gravel, t.trunk, t.leaves, t.young_leaves, t.needles, t.rock,  t.dark_stone};
  return std::find(std::begin(all), std::end(all), kAir) == std::end(all);
}

IBox world_box(const TerrainOptions& options) {
  const IVec3 first{options.first_x, 0, options.first_z};
  return {first * kTerrainUnit, (first + options.size) * kTerrainUnit};
}

/// All chunks above one square of 64x64 columns.
class ColumnOfChunks {
 public:
  ColumnOfChunks(const terrain::Landform& land, const TerrainOptions& options, int chunk_x, int chunk_z)
      : land_(land),
        options_(options),
        world_(world_box(options)),
        x_(chunk_x),
        z_(chunk_z),
        columns_(land.columns(chunk_x * kChunkEdge, chunk_z * kChunkEdge, kChunkEdge)),
        plants_(terrain::plants_near(land, options, world_, chunk_x * kChunkEdge, chunk_z * kChunkEdge, kChunkEdge)) {}

  [[nodiscard]] Chunk make(const TerrainTypes& types, int chunk_y) const {
    const IVec3 at{x_, chunk_y, z_};
    const IVec3 origin = at * kChunkEdge;
    const IBox part = intersect({world_.min - origin, world_.max - origin}, {IVec3{0}, IVec3{kChunkEdge}});
    Chunk chunk = terrain::make_ground(land_, columns_, types, at, part, options_.caves);
    terrain::draw_plants(plants_, types, at, chunk);
    chunk.compact();  // a third of the memory is room to grow
    return chunk;
  }

 private:
  const terrain::Landform& land_;
  const TerrainOptions& options_;
  IBox world_;
  int x_;
  int z_;
  std::vector<terrain::Column> columns_;
  std::vector<terrain::Plant> plants_;
};

IBox chunks_of(const IBox& voxels) {
  return {chunk_of(voxels.min), chunk_of(voxels.max - 1) + 1};
}

VoxelProperties material(const char* name, Rgba8 colour, Visibility visibility = Visibility::Opaque) {
  VoxelProperties properties;
  properties.name = name;
  properties.colour = colour;
  properties.visibility = visibility;
  return properties;
}

VoxelProperties water() {
  VoxelProperties properties = material("water", {58, 120, 168, 178}, Visibility::Transparent);
  properties.collides = false;
  properties.roughness = 0.1F;
  properties.ior = 1.33F;
  return properties;
}

}  // namespace

Result<TerrainTypes> add_terrain_types(VoxelRegistry& types) {
  TerrainTypes all;
  const std::pair<VoxelType*, VoxelProperties> wanted[] = {
      {&all.grass, material("grass", {77, 179, 51})},
      {&all.earth, material("earth", {128, 77, 26})},
      {&all.stone, material("stone", {128, 128, 128})},
      {&all.sand, material("sand", {222, 203, 145})},
      {&all.snow, material("snow", {240, 244, 250})},
      {&all.water, water()},
      {&all.meadow, material("meadow", {132, 186, 66})},
      {&all.gravel, material("gravel", {150, 141, 128})},
      {&all.trunk, material("trunk", {94, 66, 42})},
      {&all.leaves, material("leaves", {48, 118, 44})},
      {&all.young_leaves, material("young leaves", {98, 150, 44})},
      {&all.needles, material("needles", {30, 84, 56})},
      {&all.rock, material("rock", {106, 104, 108})},
      {&all.dark_stone, material("dark stone", {108, 105, 102})},
  };
  for (const auto& [id, properties] : wanted) {
    const auto added = types.find_or_add(properties);
    if (!added) return added.error();
    *id = *added;
  }
  return all;
}

Chunk generate_terrain_chunk(const TerrainOptions& options, const TerrainTypes& types, IVec3 chunk) {
  QUOIN_ASSERT(check(options).has_value(), "sizes and origins within their ranges");
  QUOIN_ASSERT(are_filled(types), "types that add_terrain_types filled");
  if (!chunks_of(world_box(options)).contains(chunk)) return Chunk();
  const terrain::Landform land(options);
  return ColumnOfChunks(land, options, chunk.x, chunk.z).make(types, chunk.y);
}

Result<Grid> generate_terrain(const TerrainOptions& options, const TerrainTypes& types, Threads threads,
                              const Progress& progress) {
  if (auto sound = check(options); !sound) return sound.error();
  QUOIN_ASSERT(are_filled(types), "types that add_terrain_types filled");
  const terrain::Landform land(options);
  const IBox chunks = chunks_of(world_box(options));
  const auto across = static_cast<std::size_t>(chunks.size().x);
  const auto up = static_cast<std::size_t>(chunks.size().y);
  const std::size_t count = across * static_cast<std::size_t>(chunks.size().z);
  // Batches allow progress reports and store chunks in a fixed order.
  constexpr std::size_t kBatch = 64;
  Grid grid;
  std::vector<Chunk> made;
  for (std::size_t first = 0; first < count; first += kBatch) {
    if (progress && !progress(static_cast<double>(first) / static_cast<double>(count))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
    const std::size_t batch = std::min(kBatch, count - first);
    made.clear();
    made.resize(batch * up);
    const auto place = [&](std::size_t i) {
      return chunks.min + IVec3{static_cast<int>((first + i) % across), 0, static_cast<int>((first + i) / across)};
    };
    parallel_for(batch, threads, [&](std::size_t i) {
      const ColumnOfChunks column(land, options, place(i).x, place(i).z);
      for (std::size_t y = 0; y < up; ++y) made[i * up + y] = column.make(types, chunks.min.y + static_cast<int>(y));
    });
    for (std::size_t i = 0; i < made.size(); ++i) {
      grid.put_chunk(place(i / up) + IVec3{0, static_cast<int>(i % up), 0}, std::move(made[i]));
    }
  }
  if (progress) progress(1.0);
  return grid;
}

}  // namespace quoin
