#include <quoin/grid/downsample.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "core/work/progress_steps.h"
#include "grid/halving/chunk_halver.h"
#include "grid/halving/density_halver.h"

namespace quoin {
namespace {

IVec3 halved_coordinates(IVec3 chunk) {
  return {chunk.x >> 1, chunk.y >> 1, chunk.z >> 1};
}

// A halved chunk of voxels.
struct VoxelHalving {
  using Content = Grid;
  using Made = Chunk;
  const VoxelRegistry* types;

  [[nodiscard]] Chunk make(const Grid& finer, IVec3 chunk) const { return downsample_chunk(finer, *types, chunk); }
};

// A halved chunk of densities.
struct DensityHalving {
  using Content = DensityGrid;
  using Made = HalvedDensityChunk;

  [[nodiscard]] static HalvedDensityChunk make(const DensityGrid& finer, IVec3 chunk) {
    return DensityHalver(finer, chunk).make();
  }
};

// Adds the halved chunks that read a voxel, or a sample, of the change: their own and those of one cell past them.
template <class Change>
void add_readers(const Change& change, std::vector<IVec3>& chunks) {
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

// A level of voxels.
struct VoxelLevel {
  Grid content;

  void begin(const Grid& finer) { static_cast<void>(finer); }
  void put(IVec3 chunk, Chunk made) { content.put_chunk(chunk, std::move(made)); }
};

// A level of a field.
struct DensityLevel {
  DensityGrid content;
  std::map<IVec3, DownsampledDensityCounts, ByZyx> chunks;  // that hold any solid
  DownsampledDensityCounts counts;                          // of all

  // Resets the level if the band of the finer field differs.
  void begin(const DensityGrid& finer) {
    const float band = DensityGrid(0.5F * finer.band()).band();
    if (content.band() == band) return;
    content = DensityGrid(band);
    chunks.clear();
    counts = {};
  }
  void put(IVec3 chunk, HalvedDensityChunk made) {
    content.put_chunk(chunk, std::move(made.samples));
    DownsampledDensityCounts& known = chunks[chunk];
    counts -= known;
    counts += known = made.counts;
    if (known == DownsampledDensityCounts{}) chunks.erase(chunk);
  }
};

// The stored data of a level and its read position in the changes of the finer level.
template <class Halving, class Kept>
struct Level : Kept {
  using Content = typename Halving::Content;
  using Kept::content;
  ChangeCursor followed;

  // Returns false, without a change, if `progress` cancelled the update.
  bool update(const Content& finer, const Halving& halving, Threads threads, const Progress& progress = {}) {
    ChangeCursor now = followed;
    const auto changes = finer.changes_since(now);
    std::vector<IVec3> dirty;
    if (changes.all) {
      Kept::begin(finer);
      dirty = content.chunks();
      for (const IVec3 chunk : finer.chunks()) dirty.push_back(halved_coordinates(chunk));
    }
    for (const auto& change : changes.items) add_readers(change, dirty);
    sort_and_unite(dirty);
    std::erase_if(dirty, [&](IVec3 chunk) {
      for (int i = 0; i < 8; ++i) {
        if (finer.find_chunk(2 * chunk + IVec3{i & 1, i >> 1 & 1, i >> 2}) != nullptr) return false;
      }
      return content.find_chunk(chunk) == nullptr;
    });
    std::vector<typename Halving::Made> made(dirty.size());
    ProgressSteps steps(progress, dirty.size());
    parallel_for(dirty.size(), threads, [&](std::size_t i) {
      if (steps.cancelled()) return;
      made[i] = halving.make(finer, dirty[i]);
      steps.step();
    });
    if (steps.cancelled()) return false;
    for (std::size_t i = 0; i < dirty.size(); ++i) Kept::put(dirty[i], std::move(made[i]));
    followed = now;
    return true;
  }
};

// The levels of a grid or a field.
template <class Halving, class Kept>
struct Levels {
  using Content = typename Halving::Content;
  std::vector<std::unique_ptr<Level<Halving, Kept>>> kept;

  void update(const Content& full, const Halving& halving, int levels, Threads threads) {
    const Content* finer = &full;
    const auto wanted = static_cast<std::size_t>(std::max(levels, 0));
    kept.resize(std::min(kept.size(), wanted));
    for (std::size_t i = 0; i < wanted; ++i) {
      if (i == kept.size()) kept.push_back(std::make_unique<Level<Halving, Kept>>());
      kept[i]->update(*finer, halving, threads);
      finer = &kept[i]->content;
      if (finer->chunk_count() != 0) continue;
      // An empty level stays, although it does not count, so that the next edit does not rebuild it.
      kept.resize(i + 1);
      return;
    }
  }
  [[nodiscard]] int count() const {
    const bool is_last_empty = !kept.empty() && kept.back()->content.chunk_count() == 0;
    return static_cast<int>(kept.size()) - static_cast<int>(is_last_empty);
  }
  [[nodiscard]] const Level<Halving, Kept>& at(int level) const {
    QUOIN_ASSERT(level >= 1 && level <= count(), "1 <= level <= levels()");
    return *kept[static_cast<std::size_t>(level) - 1];
  }
};

}  // namespace

Chunk downsample_chunk(const Grid& grid, const VoxelRegistry& types, IVec3 chunk) {
  return ChunkHalver(grid, types, chunk).make();
}

Result<Grid> downsample(const Grid& grid, const VoxelRegistry& types, Threads threads, const Progress& progress) {
  Level<VoxelHalving, VoxelLevel> level;
  if (!level.update(grid, {&types}, threads, progress)) return make_error(ErrorCode::Cancelled, "cancelled");
  return std::move(level.content);
}

Result<DensityGrid> downsample(const DensityGrid& field, Threads threads, const Progress& progress) {
  Level<DensityHalving, DensityLevel> level;
  if (!level.update(field, {}, threads, progress)) return make_error(ErrorCode::Cancelled, "cancelled");
  return std::move(level.content);
}

struct GridPyramid::Impl : Levels<VoxelHalving, VoxelLevel> {};

GridPyramid::GridPyramid() : impl_(std::make_unique<Impl>()) {}
GridPyramid::GridPyramid(GridPyramid&&) noexcept = default;
GridPyramid& GridPyramid::operator=(GridPyramid&&) noexcept = default;
GridPyramid::~GridPyramid() = default;

void GridPyramid::update(const Grid& grid, const VoxelRegistry& types, int levels, Threads threads) {
  impl_of(impl_).update(grid, {&types}, levels, threads);
}

int GridPyramid::levels() const {
  return impl_of(impl_).count();
}

const Grid& GridPyramid::level(int level) const {
  return impl_of(impl_).at(level).content;
}

struct DensityPyramid::Impl : Levels<DensityHalving, DensityLevel> {};

DensityPyramid::DensityPyramid() : impl_(std::make_unique<Impl>()) {}
DensityPyramid::DensityPyramid(DensityPyramid&&) noexcept = default;
DensityPyramid& DensityPyramid::operator=(DensityPyramid&&) noexcept = default;
DensityPyramid::~DensityPyramid() = default;

void DensityPyramid::update(const DensityGrid& field, int levels, Threads threads) {
  impl_of(impl_).update(field, {}, levels, threads);
}

int DensityPyramid::levels() const {
  return impl_of(impl_).count();
}

const DensityGrid& DensityPyramid::level(int level) const {
  return impl_of(impl_).at(level).content;
}

const DownsampledDensityCounts& DensityPyramid::counts(int level) const {
  return impl_of(impl_).at(level).counts;
}

}  // namespace quoin
