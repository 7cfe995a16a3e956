#include <quoin/terrain/terrain.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "terrain/landform.h"
#include "terrain/terrain_parts.h"

namespace quoin {
namespace {

constexpr int kMaxAcross = 1'024;
constexpr int kMaxUp = 32;
constexpr int kMaxPlace = 1 << 20;

Status check(const TerrainOptions& options) {
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
