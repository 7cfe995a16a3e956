#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/buffer.h>

#include "grid/density/density_grid_impl.h"
#include "grid/density/density_shapes.h"

namespace quoin {
namespace {

constexpr int kSide = kChunkEdge + 2;

/// New values of a part of a chunk, computed before any sample changes.
struct Smoothed {
  ChunkPart part;
  std::vector<float> densities;                         // x fastest, of the part
  std::vector<std::pair<IVec3, VoxelType>> new_solids;  // samples and their materials, in the order of `densities`
};

bool is_one_value(const DensityNeighbourhood& around) {
  const auto value = [&](const DensityChunk* chunk) {
    return chunk == nullptr ? std::optional(around.outside) : chunk->uniform();
  };
  const std::optional<Half> first = value(around.chunks[0]);
  return first.has_value() && std::all_of(around.chunks.begin(), around.chunks.end(),
                                          [&](const DensityChunk* chunk) { return value(chunk) == first; });
}

/// The densities of a part of a chunk and one sample around it.
class Window {
 public:
  Window() {
    values_.resize(std::size_t{kSide} * kSide * kSide);
    row_sums_.resize(values_.size());
  }

  void read(const DensityNeighbourhood& around, const IBox& part) {
    QUOIN_ASSERT(intersect(part, kWholeChunk) == part, "a part of the chunk");
    part_ = part;
    for (int z = part.min.z - 1; z <= part.max.z; ++z) {
      for (int y = part.min.y - 1; y <= part.max.y; ++y) {
        double* row = values_.data() + index({0, y, z});
        for (int x = part.min.x - 1; x <= part.max.x; ++x) row[x] = float_from_half(around.get({x, y, z}));
        double* sums = row_sums_.data() + index({0, y, z});
        for (int x = part.min.x; x < part.max.x; ++x) sums[x] = row[x - 1] + row[x] + row[x + 1];
      }
    }
  }
  [[nodiscard]] double at(IVec3 p) const { return values_[index(p)]; }
  // Sums of halves are exact in double, in any order.
  [[nodiscard]] double mean_of_neighbours(IVec3 p) const {
    double sum = 0.0;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) sum += row_sums_[index(p + IVec3{0, dy, dz})];
    }
    return (sum - at(p)) / 26.0;
  }

 private:
  [[nodiscard]] static std::size_t index(IVec3 p) {
    return static_cast<std::size_t>(((p.z + 1) * kSide + p.y + 1) * kSide + p.x + 1);
  }

  IBox part_;
  Buffer<double> values_;
  Buffer<double> row_sums_;
};

// Returns the most frequent material of the solid samples among the 26 neighbours; at ties the lowest.
VoxelType prevailing_material(const DensityStore& store, IVec3 sample) {
  std::map<VoxelType, int> counts;
  for (int i = 0; i < 27; ++i) {
    const IVec3 at = sample + Neighbourhood::offset(i);
    if (i != 13 && DensityChunk::is_solid(store.get(at))) ++counts[store.material(at)];
  }
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == counts.end() ? kAir : most->first;
}

Smoothed smoothed(const DensityStore& store, const Brush& brush, const ChunkPart& part, const Window& window) {
  Smoothed result{part, {}, {}};
  const IVec3 size = part.box.size();
  result.densities.reserve(static_cast<std::size_t>(size.x * size.y * size.z));
  for (int z = part.box.min.z; z < part.box.max.z; ++z) {
    for (int y = part.box.min.y; y < part.box.max.y; ++y) {
      for (int x = part.box.min.x; x < part.box.max.x; ++x) {
        const IVec3 sample = part.chunk * kChunkEdge + IVec3{x, y, z};
        const double before = window.at({x, y, z});
        const double weight = brush.weight(DVec3(sample));
        const double mean = weight == 0.0 ? before : window.mean_of_neighbours({x, y, z});
        const auto after = static_cast<float>(before + weight * (mean - before));
        result.densities.push_back(after);
        if (!(before < 0.0) && after < 0.0F) {
          result.new_solids.emplace_back(sample, prevailing_material(store, sample));
        }
      }
    }
  }
  return result;
}

// Returns the parts of a box that can change: far air changes only next to a chunk.
std::vector<ChunkPart> parts_near_chunks(const DensityStore& store, const LongBox& box) {
  std::vector<IVec3> chunks;
  const IBox wanted = chunks_of(box);
  const IBox near{wanted.min - 1, wanted.max + 1};
  store.entries().for_each_in(near, [&](IVec3 at, const DensityStore::Entry&) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 chunk = at + Neighbourhood::offset(i);
      if (wanted.contains(chunk)) chunks.push_back(chunk);
    }
  });
  sort_and_unite(chunks);
  std::vector<ChunkPart> parts;
  parts.reserve(chunks.size());
  for (const IVec3 chunk : chunks) parts.push_back({chunk, part_of(box, chunk)});
  return parts;
}

}  // namespace

std::int64_t DensityGrid::smooth(DVec3 centre, double radius, double strength) {
  const Brush brush(centre, radius, strength);
  if (!brush.is_sound()) return 0;
  const NoticeOfEdits notice(impl().store, notice_);
  DensityStore& store = impl().store;
  const LongBox box = clipped(box_around(brush.sphere().min(), brush.sphere().max()));
  if (is_empty(box)) return 0;
  std::vector<ChunkPart> parts;
  std::vector<Smoothed> news;
  Window window;
  for (const ChunkPart& part : parts_near_chunks(store, box)) {
    if (!is_loaded_around(part.chunk)) continue;  // the result would depend on unknown samples
    const DensityNeighbourhood around = neighbourhood(part.chunk);
    if (is_one_value(around)) continue;
    window.read(around, part.box);
    news.push_back(smoothed(store, brush, part, window));
    parts.push_back(part);
  }
  // Parts and their rows come in the order of computation.
  auto current = news.begin();
  std::size_t next = 0;
  std::size_t next_solid = 0;
  return store.edit_parts(parts, [&](IVec3 start, int first, int end, SampleRow& row) {
    if (next == current->densities.size()) {
      ++current;
      next = 0;
      next_solid = 0;
    }
    QUOIN_ASSERT(current != news.end() && next < current->densities.size(), "a row that was computed");
    for (int x = first; x < end; ++x) {
      const auto i = static_cast<std::size_t>(x);
      row.densities[i] = current->densities[next++];
      const auto& solids = current->new_solids;
      if (next_solid < solids.size() && solids[next_solid].first == start + IVec3{x, 0, 0}) {
        row.materials[i] = solids[next_solid++].second;
      }
    }
    return true;
  });
}

}  // namespace quoin
