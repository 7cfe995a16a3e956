#include "render/light/surface/light_bricks.h"

#include <algorithm>
#include <bit>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/grid/changes.h>

#include "core/coordinates/chunk_order.h"
#include "render/light/occlusion_directions.h"
#include "render/light/voxel_light.h"

namespace quoin {
namespace {

constexpr int kBrickShift = 3;
constexpr int kBricksOfChunk = kChunkEdge / LightBricks::kEdge;

IVec3 brick_of(IVec3 voxel) {
  return {voxel.x >> kBrickShift, voxel.y >> kBrickShift, voxel.z >> kBrickShift};
}

template <class Use>
void for_bricks(const IBox& bricks, const Use& use) {
  for (int z = bricks.min.z; z < bricks.max.z; ++z) {
    for (int y = bricks.min.y; y < bricks.max.y; ++y) {
      for (int x = bricks.min.x; x < bricks.max.x; ++x) use(IVec3(x, y, z));
    }
  }
}

// The bricks of a box of voxels, and `around` more.
IBox bricks_of_box(const IBox& voxels, int around) {
  return {brick_of(voxels.min) - around, brick_of(voxels.max - 1) + 1 + around};
}

IBox in_grid(const ChunkChange& change) {
  const IVec3 low = change.chunk * kChunkEdge;
  return {change.box.min + low, change.box.max + low};
}

}  // namespace

std::uint32_t LightBricks::slot_of(IVec3 brick, std::int32_t grid) {
  const auto bits = [](int coordinate) { return static_cast<std::uint32_t>(coordinate); };
  return hash_of(hash_of(bits(brick.x), bits(brick.y)), hash_of(bits(brick.z), bits(grid)));
}

std::int32_t LightBricks::index_of(GridHandle grid) const {
  const auto found = std::lower_bound(grids_.begin(), grids_.end(), grid,
                                      [](const OfGrid& each, GridHandle handle) { return each.handle < handle; });
  QUOIN_ASSERT(found != grids_.end() && found->handle == grid, "a grid of the scene of the last update");
  return static_cast<std::int32_t>(found - grids_.begin());
}

void LightBricks::begin_anew(const Scene& scene) {
  bricks_.assign(1, {});
  held_ = 0;
  numbers_.clear();
  free_.clear();
  grids_.clear();
  std::vector<GridHandle> handles = scene.grids().handles();
  std::sort(handles.begin(), handles.end());
  for (const GridHandle handle : handles) grids_.emplace_back().handle = handle;
  changed_ = {};
}

void LightBricks::look_at_chunk(OfGrid& of, const GridLight& light, IVec3 chunk) {
  const Chunk* voxels = light.voxels->find_chunk(chunk);
  if (voxels == nullptr) {
    of.occupied.erase(chunk);
    return;
  }
  Occupied& held = of.occupied[chunk];
  held = {};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t row = ~voxels->row_mask(y, z, kAir);
      for (int x = 0; x < kBricksOfChunk; ++x) {
        const std::uint64_t is_held = (row >> (kEdge * x) & 0xFFU) != 0 ? 1 : 0;
        held[static_cast<std::size_t>(z / kEdge)] |= is_held << (x + kBricksOfChunk * (y / kEdge));
      }
    }
  }
}

bool LightBricks::is_at_surface(const OfGrid& of, IVec3 brick) {
  bool is_near = false;
  for_bricks({brick - 1, brick + 2}, [&](IVec3 at) {
    if (is_near) return;
    const auto found = of.occupied.find({at.x >> kBrickShift, at.y >> kBrickShift, at.z >> kBrickShift});
    if (found == of.occupied.end()) return;
    const IVec3 local{at.x & 7, at.y & 7, at.z & 7};
    is_near = (found->second[static_cast<std::size_t>(local.z)] >> (local.x + 8 * local.y) & 1U) != 0;
  });
  return is_near;
}

// Returns the bricks whose light or voxels may have changed.
std::vector<IVec3> LightBricks::bricks_to_find(OfGrid& of, const GridLight& light, const GridChanges& voxels,
                                               const GridChanges& levels) {
  std::vector<IVec3> bricks;
  const auto add = [&](const IBox& box) { for_bricks(box, [&](IVec3 brick) { bricks.push_back(brick); }); };
  if (voxels.all || levels.all) {
    // Known bricks may have disappeared.
    for (const auto& [chunk, held] : of.occupied) add({chunk * kBricksOfChunk - 1, (chunk + 1) * kBricksOfChunk + 1});
    of.occupied.clear();
    for (const IVec3 chunk : light.voxels->chunks()) {
      look_at_chunk(of, light, chunk);
      add({chunk * kBricksOfChunk - 1, (chunk + 1) * kBricksOfChunk + 1});
    }
  }
  for (const ChunkChange& change : voxels.items_unless_all()) {
    look_at_chunk(of, light, change.chunk);
    add(bricks_of_box(in_grid(change), 1));
  }
  for (const ChunkChange& change : levels.items_unless_all()) add(bricks_of_box(in_grid(change), 0));
  sort_and_unite(bricks);
  return bricks;
}

LightBricks::Found LightBricks::find(const OfGrid& of, LightRows& rows, IVec3 brick) {
  Found found{brick};
  if (!is_at_surface(of, brick)) return found;
  found.numbers.assign(kNumbers, 0);
  std::uint32_t passing = 0;
  bool is_uniform = true;
  const std::uint16_t first = rows.word(brick * kEdge);
  for (std::size_t row = 0; row < 64; ++row) {
    const IVec3 voxel = brick * kEdge + IVec3(0, static_cast<int>(row % 8), static_cast<int>(row / 8));
    const LightRows::Row& of_row = rows.row_of(voxel);
    const auto x = static_cast<std::size_t>(voxel.x & (kChunkEdge - 1));
    const auto bits = static_cast<std::uint32_t>(of_row.passing >> x & 0xFFU);
    passing += static_cast<std::uint32_t>(std::popcount(bits));
    found.numbers[256 + row / 4] |= bits << 8 * (row % 4);
    QUOIN_ASSERT(x + 8 <= of_row.words.size(), "a brick's part of a row");
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint16_t word = of_row.words[x + i];
      is_uniform &= word == first;
      found.numbers[4 * row + i / 2] |= std::uint32_t{word} << 16 * (i % 2);
    }
  }
  is_uniform &= passing == 512;
  if (is_uniform) found.what = kIsUniform | first;
  if (is_uniform || passing == 0) found.numbers.clear();
  return found;
}

std::size_t LightBricks::find_slot(IVec3 brick, std::int32_t grid) const {
  QUOIN_ASSERT(std::has_single_bit(bricks_.size()) && held_ < bricks_.size(), "a power of two, with a free slot");
  const std::size_t mask = bricks_.size() - 1;
  std::size_t slot = slot_of(brick, grid) & mask;
  while (bricks_[slot].is_held != 0 && (bricks_[slot].brick != brick || bricks_[slot].grid != grid)) {
    slot = (slot + 1) & mask;
  }
  return slot;
}

void LightBricks::grow() {
  std::vector<Brick> before(2 * bricks_.size());
  std::swap(before, bricks_);
  for (const Brick& each : before) {
    if (each.is_held != 0) bricks_[find_slot(each.brick, each.grid)] = each;
  }
  changed_ = {};
}

// Bricks that become opaque keep their slot, since others may come after it.
void LightBricks::put(std::int32_t grid, Found found) {
  QUOIN_ASSERT(grid >= 0 && static_cast<std::size_t>(grid) < grids_.size(), "one of the grids");
  std::size_t slot = find_slot(found.brick, grid);
  const bool has_numbers = !found.numbers.empty();
  if (bricks_[slot].is_held == 0) {
    if (!has_numbers && found.what == kAllOpaque) return;
    if (2 * (held_ + 1) > bricks_.size()) {
      grow();
      slot = find_slot(found.brick, grid);
    }
    ++held_;
    bricks_[slot].brick = found.brick;
    bricks_[slot].grid = grid;
    bricks_[slot].is_held = 1;
  }
  std::uint32_t& what = bricks_[slot].what;
  const bool had_numbers = (what & kIsUniform) == 0;
  if (had_numbers && !has_numbers) free_.push_back(what);
  if (!has_numbers) {
    what = found.what;
  } else if (!had_numbers && free_.empty()) {
    numbers_.resize(numbers_.size() + kNumbers);
    what = static_cast<std::uint32_t>(numbers_.size() - kNumbers);
  } else if (!had_numbers) {
    what = free_.back();
    free_.pop_back();
  }
  if (has_numbers) {
    QUOIN_ASSERT(found.numbers.size() == kNumbers && what + kNumbers <= numbers_.size(), "room for a brick's numbers");
    std::copy(found.numbers.begin(), found.numbers.end(), numbers_.begin() + what);
    changed_.numbers.push_back(what);
  }
  changed_.slots.push_back(static_cast<std::uint32_t>(slot));
}

void LightBricks::update(const Scene& scene, const SceneLight& light, Threads threads) {
  constexpr std::size_t kAtOnce = 512;
  const bool is_known = scene.grids().size() == grids_.size() &&
                        std::all_of(grids_.begin(), grids_.end(),
                                    [&](const OfGrid& each) { return scene.grids().find(each.handle) != nullptr; });
  PendingChanges types(followed_types_, scene.types);
  const bool was_unfinished = std::exchange(is_unfinished_, true);
  if (!is_known || !types->empty() || was_unfinished) begin_anew(scene);
  for (std::size_t grid = 0; grid < grids_.size(); ++grid) {
    OfGrid& of = grids_[grid];
    const GridLight content = light.of(of.handle);
    PendingChanges voxels(of.followed_voxels, *content.voxels);
    PendingChanges levels(of.followed_light, *content.light);
    const std::vector<IVec3> places = bricks_to_find(of, content, *voxels, *levels);
    std::vector<Found> found(places.size());
    parallel_for((places.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t part) {
      LightRows rows(*content.light, *content.voxels, scene.types);
      const std::size_t end = std::min(places.size(), (part + 1) * kAtOnce);
      for (std::size_t i = part * kAtOnce; i < end; ++i) found[i] = find(of, rows, places[i]);
    });
    for (Found& each : found) put(static_cast<std::int32_t>(grid), std::move(each));
    voxels.commit();
    levels.commit();
  }
  types.commit();
  is_unfinished_ = false;
}

void LightCache::update() {
  const std::lock_guard lock(mutex_);
  is_lit_ = has_bricks_ = false;
}

void LightCache::use(const SceneLight* light) {
  const std::lock_guard lock(mutex_);
  lent_ = light;
  if (lent_ != nullptr) light_ = SceneLight();
  is_lit_ = has_bricks_ = false;
}

const SceneLight& LightCache::light(const Scene& scene, Threads threads) {
  const std::lock_guard lock(mutex_);
  if (lent_ != nullptr) return *lent_;
  if (!is_lit_) light_.update(scene, threads);
  is_lit_ = true;
  return light_;
}

LightBricks& LightCache::bricks(const Scene& scene, Threads threads) {
  const SceneLight& lit = light(scene, threads);
  if (!has_bricks_) bricks_.update(scene, lit, threads);
  has_bricks_ = true;
  return bricks_;
}

}  // namespace quoin
