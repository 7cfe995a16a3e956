#include <quoin/grid/downsample.h>

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "grid/chunk_order.h"
#include "grid/halving.h"

namespace quoin {
namespace {

constexpr int kHalfEdge = kChunkEdge / 2;

// The voxels of the two by two rows that make one row of cells: [z][y].
using Rows = std::array<std::array<VoxelType, kChunkEdge>, 4>;

// The one type of the 4 x 4 rows in which (y, z) lies, if they are stored as such.
std::optional<VoxelType> uniform_rows(const Chunk& chunk, int y, int z) {
  const Chunk::Mixed* mixed = chunk.mixed();
  if (mixed == nullptr) return chunk.uniform();
  const std::uint32_t slab = mixed->slabs[Chunk::slab_index(y, z)];
  if ((slab & Chunk::kUniformSlab) == 0) return std::nullopt;
  const std::uint32_t index = slab & ~Chunk::kUniformSlab;
  return mixed->direct() ? static_cast<VoxelType>(index) : mixed->palette[index];
}

// Makes one chunk of cells.
class ChunkHalver {
 public:
  ChunkHalver(const Grid& grid, const VoxelRegistry& types, IVec3 chunk) : masks_(grid, chunk), types_(&types) {}

  [[nodiscard]] Chunk make() {
    cells_.assign(kChunkVoxels, kAir);
    for (int octant = 0; octant < 8; ++octant) fill_octant({octant & 1, octant >> 1 & 1, octant >> 2});
    return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(cells_));
  }

 private:
  void fill_octant(IVec3 octant) {
    const Chunk* chunk = masks_.octant(octant);
    if (chunk == nullptr) return;
    for (int z = 0; z < kHalfEdge; ++z) {
      for (int y = 0; y < kHalfEdge; ++y) {
        const IVec3 first = octant * kHalfEdge + IVec3{0, y, z};
        const std::uint64_t row = masks_.solid_cells(first.y, first.z) >> first.x & 0xFFFF'FFFFU;
        if (row != 0) fill_row(*chunk, first, row);
      }
    }
  }

  // `first`: the row's first cell; `solid`: which of its 32 cells to fill.
  void fill_row(const Chunk& chunk, IVec3 first, std::uint64_t solid) {
    VoxelType* out = cells_.data() + (first.z * kChunkEdge + first.y) * kChunkEdge + first.x;
    const int y = 2 * (first.y % kHalfEdge);
    const int z = 2 * (first.z % kHalfEdge);
    if (const auto type = uniform_rows(chunk, y, z)) {
      std::fill_n(out, kHalfEdge, *type);
      return;
    }
    for (int i = 0; i < 4; ++i) chunk.read_row(y + (i & 1), z + (i >> 1), rows_[static_cast<std::size_t>(i)]);
    for (std::uint64_t left = solid; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      out[x] = type_of(x, 2 * (first + IVec3{x, 0, 0}));
    }
  }

  // `x`: of the cell in its row; `fine`: its first voxel.
  [[nodiscard]] VoxelType type_of(int x, IVec3 fine) const {
    std::array<VoxelType, 8> found{};
    VoxelType least = std::numeric_limits<VoxelType>::max();
    VoxelType greatest = kAir;
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i] = rows_[i >> 1][static_cast<std::size_t>(2 * x) + (i & 1)];
      if (found[i] == kAir) continue;
      least = std::min(least, found[i]);
      greatest = std::max(greatest, found[i]);
    }
    return least == greatest ? least : heaviest(found, fine);
  }

  [[nodiscard]] VoxelType heaviest(const std::array<VoxelType, 8>& found, IVec3 fine) const {
    const bool has_opaque = std::any_of(found.begin(), found.end(),
                                        [&](VoxelType type) { return type != kAir && types_->is_opaque(type); });
    std::array<int, 8> weights{};
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i] == kAir || (has_opaque && !types_->is_opaque(found[i]))) continue;
      const auto bits = static_cast<int>(i);
      const int weight = 1 + 2 * masks_.exposed_faces(fine + IVec3{bits & 1, bits >> 1 & 1, bits >> 2});
      const auto first = static_cast<std::size_t>(std::find(found.begin(), found.end(), found[i]) - found.begin());
      weights[first] += weight;
    }
    std::size_t best = 0;
    for (std::size_t i = 1; i < found.size(); ++i) {
      const bool is_lower = weights[i] == weights[best] && found[i] < found[best];
      if (weights[i] > weights[best] || (is_lower && weights[i] > 0)) best = i;
    }
    return found[best];
  }

  HalvingMasks masks_;
  const VoxelRegistry* types_;
  std::vector<VoxelType> cells_;
  Rows rows_{};
};

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
