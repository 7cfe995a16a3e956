#include <quoin/grid/downsample.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "grid/chunk_halver.h"
#include "grid/chunk_order.h"

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

// What is kept of a level: which versions of the finer grid's chunks it was made of.
struct Level {
  Grid grid;
  std::vector<std::pair<IVec3, std::uint64_t>> made_of;

  void update(const Grid& finer, const VoxelRegistry& types, Threads threads);
};

bool same_chunk_before(const std::pair<IVec3, std::uint64_t>& a, const std::pair<IVec3, std::uint64_t>& b) {
  return by_zyx(a.first, b.first);
}

void Level::update(const Grid& finer, const VoxelRegistry& types, Threads threads) {
  std::vector<std::pair<IVec3, std::uint64_t>> now;
  for (const IVec3 chunk : finer.chunks()) now.emplace_back(chunk, finer.version(chunk));
  std::vector<std::pair<IVec3, std::uint64_t>> changed;
  const auto order = [](const auto& a, const auto& b) {
    return a.first != b.first ? same_chunk_before(a, b) : a.second < b.second;
  };
  std::set_symmetric_difference(now.begin(), now.end(), made_of.begin(), made_of.end(), std::back_inserter(changed),
                                order);
  std::vector<IVec3> dirty;
  for (const auto& [chunk, version] : changed) {
    for (int i = 0; i < 27; ++i) dirty.push_back(halved_coordinates(chunk + IVec3{i % 3, i / 3 % 3, i / 9} - 1));
  }
  sort_and_unite(dirty);
  std::erase_if(dirty, [&](IVec3 chunk) {
    for (int i = 0; i < 8; ++i) {
      if (finer.find_chunk(2 * chunk + IVec3{i & 1, i >> 1 & 1, i >> 2}) != nullptr) return false;
    }
    return grid.find_chunk(chunk) == nullptr;
  });
  remake(finer, types, dirty, threads, grid);
  made_of = std::move(now);
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
    kept.resize(i);
    return;
  }
}

int GridPyramid::levels() const {
  return static_cast<int>(impl_->levels.size());
}

const Grid& GridPyramid::level(int level) const {
  return impl_->levels[static_cast<std::size_t>(level) - 1]->grid;
}

}  // namespace quoin
