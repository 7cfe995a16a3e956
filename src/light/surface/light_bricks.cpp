#include "light/surface/light_bricks.h"

#include <algorithm>
#include <bit>
#include <unordered_set>

#include <quoin/core/assert.h>

#include "grid/chunk_order.h"
#include "grid/coordinate_hash.h"
#include "light/occlusion_directions.h"
#include "light/surface/rows.h"

namespace quoin {
namespace {

constexpr int kBricksOfChunk = kChunkEdge / LightBricks::kEdge;

// A brick that is held, and its numbers; none where all of it is alike.
struct MadeBrick {
  LightBricks::Brick brick;
  std::vector<std::uint32_t> numbers;
};

// Bricks of a chunk with any voxel.
std::vector<IVec3> bricks_with_voxels(const Chunk& chunk, IVec3 at) {
  std::array<std::uint64_t, kBricksOfChunk * kBricksOfChunk> held{};  // [y + 8 z]: a bit a voxel along x
  std::array<VoxelType, kChunkEdge> row;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      chunk.read_row(y, z, row);
      std::uint64_t& bits = held.at(static_cast<std::size_t>(y / 8 + 8 * (z / 8)));
      for (std::size_t x = 0; x < row.size(); ++x) bits |= std::uint64_t{row[x] != kAir} << x;
    }
  }
  std::vector<IVec3> bricks;
  for (std::size_t i = 0; i < held.size(); ++i) {
    for (int x = 0; x < kBricksOfChunk; ++x) {
      if ((held.at(i) >> 8 * x & 0xFFU) == 0) continue;
      bricks.push_back(at * kBricksOfChunk + IVec3(x, static_cast<int>(i % 8), static_cast<int>(i / 8)));
    }
  }
  return bricks;
}

// Those and the ones beside them, in an order of their own.
std::vector<IVec3> bricks_at_surfaces(const Grid& voxels) {
  std::unordered_set<IVec3, CoordinateHash> all;
  for (const IVec3 chunk : voxels.chunks()) {
    for (const IVec3 brick : bricks_with_voxels(*voxels.find_chunk(chunk), chunk)) {
      for (int i = 0; i < 27; ++i) all.insert(brick + IVec3(i % 3, i / 3 % 3, i / 9) - 1);
    }
  }
  std::vector<IVec3> sorted(all.begin(), all.end());
  sort_and_unite(sorted);
  return sorted;
}

// False where all of it is opaque.
bool make_brick(LightRows& rows, IVec3 at, MadeBrick& made) {
  made.brick.brick = at;
  made.brick.is_held = 1;
  made.numbers.assign(LightBricks::kNumbers, 0);
  std::uint32_t passing = 0;
  bool is_uniform = true;
  const std::uint16_t first = rows.word(at * LightBricks::kEdge);
  for (std::size_t row = 0; row < 64; ++row) {
    const IVec3 voxel = at * LightBricks::kEdge + IVec3(0, static_cast<int>(row % 8), static_cast<int>(row / 8));
    const LightRows::Row& of = rows.row_of(voxel);
    const auto x = static_cast<std::size_t>(voxel.x & (kChunkEdge - 1));
    const auto bits = static_cast<std::uint32_t>(of.passing >> x & 0xFFU);
    passing += static_cast<std::uint32_t>(std::popcount(bits));
    made.numbers[256 + row / 4] |= bits << 8 * (row % 4);
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint16_t word = of.words[x + i];
      is_uniform &= word == first;
      made.numbers[4 * row + i / 2] |= std::uint32_t{word} << 16 * (i % 2);
    }
  }
  if (passing == 512 && is_uniform) {
    made.brick.what = LightBricks::kIsUniform | first;
    made.numbers.clear();
  }
  return passing > 0;
}

std::vector<MadeBrick> bricks_of(const GridLight& of, const VoxelRegistry& types, Threads threads) {
  constexpr std::size_t kAtOnce = 512;
  const std::vector<IVec3> places = bricks_at_surfaces(*of.voxels);
  std::vector<std::vector<MadeBrick>> parts((places.size() + kAtOnce - 1) / kAtOnce);
  parallel_for(parts.size(), threads, [&](std::size_t part) {
    LightRows rows(*of.light, *of.voxels, types);
    const std::size_t end = std::min(places.size(), (part + 1) * kAtOnce);
    for (std::size_t i = part * kAtOnce; i < end; ++i) {
      MadeBrick made;
      if (make_brick(rows, places[i], made)) parts[part].push_back(std::move(made));
    }
  });
  std::vector<MadeBrick> all;
  for (std::vector<MadeBrick>& part : parts) std::move(part.begin(), part.end(), std::back_inserter(all));
  return all;
}

void put(LightBricks::Brick brick, std::vector<LightBricks::Brick>& table) {
  const std::size_t mask = table.size() - 1;
  std::size_t slot = LightBricks::slot_of(brick.brick, brick.grid) & mask;
  while (table[slot].is_held != 0) slot = (slot + 1) & mask;
  table[slot] = brick;
}

}  // namespace

std::uint32_t LightBricks::slot_of(IVec3 brick, std::int32_t grid) {
  const auto bits = [](int coordinate) { return static_cast<std::uint32_t>(coordinate); };
  return hash_of(hash_of(bits(brick.x), bits(brick.y)), hash_of(bits(brick.z), bits(grid)));
}

std::int32_t LightBricks::index_of(GridHandle grid) const {
  const auto found = std::lower_bound(grids.begin(), grids.end(), grid);
  QUOIN_ASSERT(found != grids.end() && *found == grid, "a grid of the table's scene");
  return static_cast<std::int32_t>(found - grids.begin());
}

void LightCache::update() {
  const std::lock_guard lock(mutex_);
  is_lit_ = false;
  bricks_ = nullptr;
}

const SceneLight& LightCache::up_to_date(const Scene& scene, Threads threads) {
  if (!is_lit_) light_.update(scene, threads);
  is_lit_ = true;
  return light_;
}

const SceneLight& LightCache::light(const Scene& scene, Threads threads) {
  const std::lock_guard lock(mutex_);
  return up_to_date(scene, threads);
}

std::shared_ptr<const LightBricks> LightCache::bricks(const Scene& scene, Threads threads) {
  const std::lock_guard lock(mutex_);
  if (bricks_ != nullptr) return bricks_;
  const SceneLight& light = up_to_date(scene, threads);
  auto made = std::make_shared<LightBricks>();
  made->grids = scene.grids().handles();
  std::sort(made->grids.begin(), made->grids.end());
  std::vector<std::vector<MadeBrick>> of_grids;
  std::size_t count = 0;
  for (const GridHandle grid : made->grids) {
    of_grids.push_back(bricks_of(light.of(grid), scene.types, threads));
    count += of_grids.back().size();
  }
  made->bricks.resize(std::bit_ceil(2 * count + 1));
  for (std::size_t grid = 0; grid < of_grids.size(); ++grid) {
    for (MadeBrick& each : of_grids[grid]) {
      each.brick.grid = static_cast<std::int32_t>(grid);
      if (!each.numbers.empty()) each.brick.what = static_cast<std::uint32_t>(made->numbers.size());
      made->numbers.insert(made->numbers.end(), each.numbers.begin(), each.numbers.end());
      put(each.brick, made->bricks);
    }
  }
  if (made->numbers.empty()) made->numbers.push_back(0);
  bricks_ = std::move(made);
  return bricks_;
}

}  // namespace quoin
