#include <quoin/grid/downsample.h>

#include <algorithm>
#include <utility>
#include <vector>

#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>

#include "grid/chunk_order.h"
#include "grid/halving/chunk_halver.h"

namespace quoin {
namespace {

IVec3 halved_coordinates(IVec3 chunk) {
  return {chunk.x >> 1, chunk.y >> 1, chunk.z >> 1};
}

// Makes these chunks of `coarse` anew.
void remake(const Grid& grid, const VoxelRegistry& types, const std::vector<IVec3>& chunks, Threads threads,
            Grid& coarse) {
  std::vector<Chunk> made(chunks.size());
  parallel_for(chunks.size(), threads, [&](std::size_t i) { made[i] = halved_chunk(grid, types, chunks[i]); });
  for (std::size_t i = 0; i < chunks.size(); ++i) coarse.put_chunk(chunks[i], std::move(made[i]));
}

// Adds the halved chunks that read a voxel of the change: their own voxels and those of one cell past them.
void add_readers(const ChunkChange& change, std::vector<IVec3>& chunks) {
  constexpr int kReach = 2;
  const IVec3 low = halved_coordinates(change.chunk - IVec3(glm::lessThan(change.box.min, IVec3(kReach))));
  const IVec3 high =
      halved_coordinates(change.chunk + IVec3(glm::greaterThan(change.box.max, IVec3(kChunkEdge - kReach))));
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) chunks.emplace_back(x, y, z);
    }
  }
}

// What is kept of a level: how far it has followed the finer grid.
struct Level {
  Grid grid;
  ChangeCursor followed;

  void update(const Grid& finer, const VoxelRegistry& types, Threads threads);
};

void Level::update(const Grid& finer, const VoxelRegistry& types, Threads threads) {
  ChangeCursor now = followed;
  const GridChanges changes = finer.changes_since(now);
  std::vector<IVec3> dirty;
  if (changes.all) {
    dirty = grid.chunks();
    for (const IVec3 chunk : finer.chunks()) dirty.push_back(halved_coordinates(chunk));
  }
  for (const ChunkChange& change : changes.items) add_readers(change, dirty);
  sort_and_unite(dirty);
  std::erase_if(dirty, [&](IVec3 chunk) {
    for (int i = 0; i < 8; ++i) {
      if (finer.find_chunk(2 * chunk + IVec3{i & 1, i >> 1 & 1, i >> 2}) != nullptr) return false;
    }
    return grid.find_chunk(chunk) == nullptr;
  });
  remake(finer, types, dirty, threads, grid);
  followed = now;
}

}  // namespace

Chunk halved_chunk(const Grid& grid, const VoxelRegistry& types, IVec3 chunk) {
  return ChunkHalver(grid, types, chunk).make();
}

Grid halved(const Grid& grid, const VoxelRegistry& types, Threads threads) {
  Grid coarse;
  std::vector<IVec3> chunks = grid.chunks();
  for (IVec3& chunk : chunks) chunk = halved_coordinates(chunk);
  sort_and_unite(chunks);
  remake(grid, types, chunks, threads, coarse);
  return coarse;
}

struct GridPyramid::Impl {
  std::vector<std::unique_ptr<Level>> levels;
};

GridPyramid::GridPyramid() : impl_(std::make_unique<Impl>()) {}
GridPyramid::GridPyramid(GridPyramid&&) noexcept = default;
GridPyramid& GridPyramid::operator=(GridPyramid&&) noexcept = default;
GridPyramid::~GridPyramid() = default;

void GridPyramid::update(const Grid& grid, const VoxelRegistry& types, int levels, Threads threads) {
  const Grid* finer = &grid;
  const auto wanted = static_cast<std::size_t>(std::max(levels, 0));
  auto& kept = impl_->levels;
  kept.resize(std::min(kept.size(), wanted));
  for (std::size_t i = 0; i < wanted; ++i) {
    if (i == kept.size()) kept.push_back(std::make_unique<Level>());
    kept[i]->update(*finer, types, threads);
    finer = &kept[i]->grid;
    if (finer->chunk_count() != 0) continue;
    // It stays, though it counts as none, so that the next edit does not make it anew.
    kept.resize(i + 1);
    return;
  }
}

int GridPyramid::levels() const {
  const auto& kept = impl_->levels;
  const bool is_last_empty = !kept.empty() && kept.back()->grid.chunk_count() == 0;
  return static_cast<int>(kept.size()) - static_cast<int>(is_last_empty);
}

const Grid& GridPyramid::level(int level) const {
  QUOIN_ASSERT(level >= 1 && level <= levels(), "1 <= level <= levels()");
  return impl_->levels[static_cast<std::size_t>(level) - 1]->grid;
}

}  // namespace quoin
