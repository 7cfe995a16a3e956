#include <quoin/scene/scene_meshes.h>

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include <glm/common.hpp>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"

namespace quoin {

namespace {

constexpr int kNearChunks = kNearVoxels / kChunkEdge;

/// The chunks of a grid that move together, and the chunk that becomes its origin.
struct Piece {
  IVec3 origin{0};
  std::vector<IVec3> chunks;
};

IVec3 shifted_right(IVec3 v, int bits) {
  return {v.x >> bits, v.y >> bits, v.z >> bits};
}

std::vector<IVec3> chunks_of(const SceneGrid& grid) {
  std::vector<IVec3> chunks = grid.grid.chunks();
  const std::vector<IVec3> more = grid.field.chunks();
  chunks.insert(chunks.end(), more.begin(), more.end());
  sort_and_unite(chunks);
  return chunks;
}

bool is_near(const std::vector<IVec3>& chunks) {
  return std::ranges::all_of(chunks, [](IVec3 chunk) {
    const IVec3 far = glm::max(glm::abs(chunk), glm::abs(chunk + 1));
    return std::max({far.x, far.y, far.z}) <= kNearChunks;
  });
}

/// Finds sets of touching chunks. Blocks of 2^3 chunks that touch are one set, so sets are at least two chunks apart.
class TouchingChunks {
 public:
  explicit TouchingChunks(const std::vector<IVec3>& chunks) {
    for (const IVec3 chunk : chunks) blocks_[shifted_right(chunk, 1)].push_back(chunk);
  }

  /// Removes and returns the connected set of a remaining block. Requires: the block exists.
  std::vector<IVec3> take(IVec3 block) {
    QUOIN_ASSERT(has(block), "a block that was not taken yet");
    std::vector<IVec3> chunks;
    std::vector<IVec3> waiting = {block};
    while (!waiting.empty()) {
      const IVec3 at = waiting.back();
      waiting.pop_back();
      const auto found = blocks_.find(at);
      if (found == blocks_.end()) continue;
      chunks.insert(chunks.end(), found->second.begin(), found->second.end());
      blocks_.erase(found);
      for (int i = 0; i < 27; ++i) waiting.push_back(at + IVec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
    }
    return chunks;
  }
  [[nodiscard]] bool has(IVec3 block) const { return blocks_.contains(block); }

 private:
  std::unordered_map<IVec3, std::vector<IVec3>, CoordinateHash> blocks_;
};

IVec3 least_of(const std::vector<IVec3>& chunks) {
  QUOIN_ASSERT(!chunks.empty(), "at least one chunk");
  IVec3 least = chunks.front();
  for (const IVec3 chunk : chunks) least = glm::min(least, chunk);
  return least;
}

/// Sets of chunks that begin in the same cell of kNearVoxels per side move together.
std::vector<Piece> pieces_of(const std::vector<IVec3>& chunks) {
  int bits = 0;
  while (1 << bits < kNearChunks) ++bits;
  TouchingChunks touching(chunks);
  std::map<IVec3, std::vector<IVec3>, ByZyx> by_cell;
  for (const IVec3 chunk : chunks) {
    const IVec3 block = shifted_right(chunk, 1);
    if (!touching.has(block)) continue;
    const std::vector<IVec3> set = touching.take(block);
    std::vector<IVec3>& cell = by_cell[shifted_right(least_of(set), bits)];
    cell.insert(cell.end(), set.begin(), set.end());
  }
  std::vector<Piece> pieces;
  for (auto& [cell, of_cell] : by_cell) {
    const IVec3 origin = is_near(of_cell) ? IVec3(0) : least_of(of_cell);
    pieces.push_back({origin, std::move(of_cell)});
  }
  return pieces;
}

SceneGrid grid_of(const SceneGrid& grid, const Piece& piece) {
  const IVec3 moved = piece.origin * kChunkEdge;
  SceneGrid made;
  made.name = grid.name;
  made.pivot = grid.pivot - DVec3(moved);
  if (!grid.canvas.empty()) made.canvas = {grid.canvas.min - moved, grid.canvas.max - moved};
  made.field = DensityGrid(grid.field.band());
  for (const IVec3 chunk : piece.chunks) {
    if (const Chunk* voxels = grid.grid.find_chunk(chunk)) made.grid.put_chunk(chunk - piece.origin, *voxels);
    if (const DensityChunk* samples = grid.field.find_chunk(chunk)) {
      made.field.put_chunk(chunk - piece.origin, *samples);
    }
  }
  return made;
}

}  // namespace

Scene near_grids(const Scene& scene) {
  Scene near = scene.snapshot();
  const std::vector<InstanceHandle> instances = scene.instances().handles();
  for (const GridHandle handle : scene.grids().handles()) {
    const SceneGrid& grid = scene.grids()[handle];
    const std::vector<IVec3> chunks = chunks_of(grid);
    if (is_near(chunks)) continue;
    const std::vector<Piece> pieces = pieces_of(chunks);
    QUOIN_ASSERT(!pieces.empty(), "at least one piece");
    near.edit(handle) = grid_of(grid, pieces.front());
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      const GridHandle piece = near.add_grid(grid_of(grid, pieces[i]));
      for (const InstanceHandle placed : instances) {
        Instance instance = scene.instances()[placed];
        if (instance.grid != handle) continue;
        instance.grid = piece;
        near.add_instance(std::move(instance));
      }
    }
  }
  return near;
}

}  // namespace quoin
