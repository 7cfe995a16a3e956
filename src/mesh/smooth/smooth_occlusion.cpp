// Occlusion at arbitrary positions: their cells, and the samples of one chunk in the order of slices.

#include <quoin/mesh/smooth_occlusion.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include <tsl/robin_map.h>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/caches.h"
#include "core/moved_from.h"
#include "core/work/progress_steps.h"
#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_mesher.h"

namespace quoin::smooth {
namespace {

/// A position in the form of a vertex: a cell, and a multiple of 1/65,536 within it.
struct CellSample {
  IVec3 cell;    ///< in the whole field, at the level
  Vec3 snapped;  ///< 0 to 1 within it
};

/// Returns the largest integer that is not above `at`. Requires: it is in the range of int64. Avoids the library
/// call of std::floor.
std::int64_t whole_below(double at) {
  QUOIN_ASSERT(at >= -0x1p63 && at < 0x1p63, "in the range of int64");
  const auto whole = static_cast<std::int64_t>(at);
  return whole - (static_cast<double>(whole) > at ? 1 : 0);
}

/// Returns true if all components are in the int32 range; false for NaN.
bool is_in_int32(DVec3 position) {
  constexpr double kLimit = 2'147'483'648.0;
  const auto is_in = [](double at) { return at >= -kLimit && at < kLimit; };
  return is_in(position.x) && is_in(position.y) && is_in(position.z);
}

/// Returns the cell of a position in samples of level 0; empty if the position is NaN or outside the int32 range.
std::optional<CellSample> place_at(DVec3 position, int level) {
  if (!is_in_int32(position)) return std::nullopt;
  const DVec3 at = position * double{depth_unit(level)};
  CellSample place{};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t whole = whole_below(at[axis]);
    place.cell[axis] = static_cast<int>(whole);
    place.snapped[axis] = snap(static_cast<float>(at[axis] - static_cast<double>(whole)));
  }
  return place;
}

Vec3 unit_or_up(Vec3 normal) {
  // In double, no vector of floats overflows or underflows.
  const DVec3 n(normal);
  const double length = std::sqrt((n.x * n.x + n.y * n.y) + n.z * n.z);
  if (!(length > 0.0) || !std::isfinite(length)) return {0.0F, 1.0F, 0.0F};
  return Vec3(n / length);
}

/// Returns the unit normal for occlusion: other lengths are normalized, invalid normals become +y.
Vec3 sound_normal(Vec3 normal) {
  constexpr float kTolerance = 1e-3F;
  const float square = (normal.x * normal.x + normal.y * normal.y) + normal.z * normal.z;
  return std::abs(square - 1.0F) <= kTolerance ? normal : unit_or_up(normal);
}

/// The effective settings and level, within their limits.
struct Sampling {
  SmoothOcclusionOptions occlusion;
  int level = 0;

  Sampling(const SmoothOcclusionOptions& wanted, int wanted_level);
};

/// The sample positions of one chunk.
struct ChunkSamples {
  const SmoothSamples& samples;
  IVec3 chunk{0};                          ///< its coordinates, if `samples` is relative to the field
  std::span<const std::uint32_t> numbers;  ///< samples in the chunk or a cell around it; other samples are far air
};

/// Computes occlusion with the mesher's kernels, including the rows that the samples of a chunk read.
class SampleKernel {
 public:
  void occlude(const DensityNeighbourhood& chunks, const ChunkSamples& samples, const Sampling& sampling,
               std::span<float> out);

 private:
  void sort_by_slice(const ChunkSamples& samples, const Sampling& sampling, std::span<float> out);
  void occlude_some(const SmoothSamples& samples, int z, std::size_t first, std::size_t count, std::span<float> out);

  struct Entry {
    std::uint32_t number;
    std::uint16_t place;
    std::int16_t z;
    Vec3 snapped;
  };

  const Kernel& kernel_ = kKernels.widest();
  Work work_;
  BlockVector<Entry> entries_;                                  // samples within reach, in input order
  BlockVector<Entry> sorted_;                                   // by slice
  std::array<std::uint32_t, kChunkEdge + 3> first_of_slice_{};  // [z + 1], starting at cell -1
  std::array<float, kPlacesAtOnce + 64> occlusion_{};
};

/// Returns the occlusion of a position in far air.
float open_occlusion(const SmoothOcclusionOptions& options) {
  const bool is_weighted =
      options.method == SmoothOcclusion::Weighted || options.method == SmoothOcclusion::WeightedPublished;
  return is_weighted ? weighted_occlusion(0.0F, 0.0F, options) : 0.0F;
}

Sampling::Sampling(const SmoothOcclusionOptions& wanted, int wanted_level)
    : occlusion(within_limits(wanted, std::clamp(wanted_level, 0, kMaxSmoothLevel))),
      level(std::clamp(wanted_level, 0, kMaxSmoothLevel)) {}

/// Returns the occlusion of one sample position, without kernels. `place.cell` is relative to the centre chunk's first
/// cell.
float occlusion_of_sample(const DensityNeighbourhood& chunks, const CellSample& place, Vec3 normal,
                          const Sampling& sampling) {
  const float unit = depth_unit(sampling.level);
  const int size = 1 << sampling.level;
  return occlusion_at_vertex(place.snapped, sound_normal(normal), sampling.occlusion, [&](int x, int y, int z) {
    return float_from_half(chunks.get((place.cell + IVec3{x, y, z}) * size)) * unit;
  });
}

// Finds the cells of the samples. Samples out of reach are open.
void SampleKernel::sort_by_slice(const ChunkSamples& wanted, const Sampling& sampling, std::span<float> out) {
  const DVec3 origin = DVec3(wanted.samples.origin) - DVec3(wanted.chunk) * static_cast<double>(kChunkEdge);
  entries_.clear();
  first_of_slice_.fill(0);
  for (const std::uint32_t number : wanted.numbers) {
    QUOIN_ASSERT(number < wanted.samples.positions.size() && number < out.size(), "one of the samples");
    const auto place = place_at(DVec3(wanted.samples.positions[number]) + origin, sampling.level);
    const auto in_reach = [&](int cell) { return cell >= -1 && cell <= work_.n; };
    if (!place || !in_reach(place->cell.x) || !in_reach(place->cell.y) || !in_reach(place->cell.z)) {
      out[number] = open_occlusion(sampling.occlusion);
      continue;
    }
    const IVec3 cell = place->cell;
    entries_.push_back({number, static_cast<std::uint16_t>(place_of(cell.x, cell.y)), static_cast<std::int16_t>(cell.z),
                        place->snapped});
    ++first_of_slice_[static_cast<std::size_t>(cell.z + 2)];
  }
  for (std::size_t i = 1; i < first_of_slice_.size(); ++i) first_of_slice_[i] += first_of_slice_[i - 1];
  sorted_.resize(entries_.size());
  auto next = first_of_slice_;
  for (const Entry& entry : entries_) sorted_[next[static_cast<std::size_t>(entry.z + 1)]++] = entry;
}

void SampleKernel::occlude_some(const SmoothSamples& samples, int z, std::size_t first, std::size_t count,
                                std::span<float> out) {
  // Kernels read whole registers, so the last place is repeated.
  constexpr std::size_t kOverrun = 16;
  QUOIN_ASSERT(count > 0 && count <= kPlacesAtOnce && first + count <= sorted_.size(), "samples of the slice");
  for (std::size_t i = 0; i < count + kOverrun; ++i) {
    const Entry& entry = sorted_[first + std::min(i, count - 1)];
    const Vec3 normal = sound_normal(samples.normals[entry.number]);
    work_.places[i] = entry.place;
    for (int axis = 0; axis < 3; ++axis) {
      work_.fractions[axis][i] = entry.snapped[axis];
      work_.normals[axis][i] = normal[axis];
    }
  }
  kernel_.occlude(work_, z, count, occlusion_.data());
  for (std::size_t i = 0; i < count; ++i) out[sorted_[first + i].number] = occlusion_[i];
}

void SampleKernel::occlude(const DensityNeighbourhood& chunks, const ChunkSamples& wanted, const Sampling& sampling,
                           std::span<float> out) {
  work_.level = sampling.level;
  work_.n = kChunkEdge >> sampling.level;
  work_.cells = {-1, work_.n + 1};
  work_.occlusion = sampling.occlusion;
  work_.apron = apron_of(sampling.occlusion);
  work_.chunks = &chunks;
  sort_by_slice(wanted, sampling, out);
  work_.occlusion_rows.fill({});
  const auto slice = [&](int z) {
    const auto at = static_cast<std::size_t>(z + 1);
    return std::span(sorted_).subspan(first_of_slice_[at], first_of_slice_[at + 1] - first_of_slice_[at]);
  };
  for (int z = work_.cells.first; z < work_.cells.last; ++z) {
    RowSet rows;
    for (const Entry& entry : slice(z)) rows.unite(RowSet::of_cells(entry.place >> kPlaceShift));
    if (!rows.empty()) add_occlusion_rows(work_, rows, z);
  }
  work_.is_dense = false;
  begin_occlusion(work_);
  for (int z = work_.cells.first; z < work_.cells.last; ++z) {
    const std::size_t first = first_of_slice_[static_cast<std::size_t>(z + 1)];
    const std::size_t count = slice(z).size();
    for (std::size_t done = 0; done < count; done += kPlacesAtOnce) {
      occlude_some(wanted.samples, z, first + done, std::min(kPlacesAtOnce, count - done), out);
    }
  }
}

}  // namespace
}  // namespace quoin::smooth

namespace quoin {

namespace {

using smooth::CellSample;
using smooth::SampleKernel;
using smooth::Sampling;

// Chunks with fewer samples than this are computed sample by sample: gathering the kernels' rows would cost more.
constexpr std::size_t kFewSamples = 24;

void check_samples(const SmoothSamples& samples, std::span<float> out) {
  QUOIN_ASSERT(samples.normals.size() == samples.positions.size(), "as many normals as positions");
  QUOIN_ASSERT(out.size() >= samples.positions.size(), "a value for every sample");
  QUOIN_ASSERT(samples.positions.size() < std::numeric_limits<std::uint32_t>::max(), "fewer than 2^32 samples");
}

// Requires: the position is in the int32 range.
IVec3 chunk_at(DVec3 position) {
  const auto chunk = [](double at) { return static_cast<int>(smooth::whole_below(at) >> kChunkShift); };
  return {chunk(position.x), chunk(position.y), chunk(position.z)};
}

// Converts a cell to be relative to the first cell of its chunk.
CellSample in_chunk(const CellSample& place, IVec3 chunk, int level) {
  return {place.cell - chunk * (kChunkEdge >> level), place.snapped};
}

// The positions of a field, grouped by chunk.
class SamplesByChunk {
 public:
  SamplesByChunk(const SmoothSamples& samples, const Sampling& sampling, std::span<float> out) {
    const std::size_t count = samples.positions.size();
    const float open = smooth::open_occlusion(sampling.occlusion);
    constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();
    BlockVector<std::uint32_t> chunk_of_sample(count);
    for (std::size_t i = 0; i < count; ++i) {
      const DVec3 position = DVec3(samples.positions[i]) + DVec3(samples.origin);
      if (smooth::is_in_int32(position)) {
        chunk_of_sample[i] = index_of(chunk_at(position));
      } else {
        chunk_of_sample[i] = kNowhere;
        out[i] = open;
      }
    }
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    numbers_.resize(first_.back());
    BlockVector<std::uint32_t> next = first_;
    for (std::size_t i = 0; i < count; ++i) {
      if (chunk_of_sample[i] != kNowhere) numbers_[next[chunk_of_sample[i]]++] = static_cast<std::uint32_t>(i);
    }
  }

  [[nodiscard]] std::size_t size() const { return chunks_.size(); }
  [[nodiscard]] IVec3 chunk(std::size_t i) const { return chunks_[i]; }
  [[nodiscard]] std::span<const std::uint32_t> numbers(std::size_t i) const {
    return std::span(numbers_).subspan(first_[i], first_[i + 1] - first_[i]);
  }

 private:
  // Counts one more position in the chunk. Returns the chunk's index.
  std::uint32_t index_of(IVec3 chunk) {
    if (chunks_.empty() || chunk != chunks_[last_]) {
      const auto [found, is_new] = indices_.try_emplace(chunk, static_cast<std::uint32_t>(chunks_.size()));
      last_ = found->second;
      if (is_new) {
        chunks_.push_back(chunk);
        first_.push_back(0);
      }
    }
    ++first_[last_ + 1];
    return last_;
  }

  tsl::robin_map<IVec3, std::uint32_t, CoordinateHash> indices_;
  std::vector<IVec3> chunks_;
  std::uint32_t last_ = 0;
  BlockVector<std::uint32_t> first_{
      0};  // first of each chunk, in `numbers_`; while counting, the count of the chunk before
  BlockVector<std::uint32_t> numbers_;
};

}  // namespace

float smooth_occlusion(const DensityGrid& field, DVec3 position, Vec3 normal, const SmoothOcclusionOptions& options,
                       int level) {
  const Sampling sampling(options, level);
  if (sampling.occlusion.method == SmoothOcclusion::None) return 0.0F;
  const auto place = smooth::place_at(position, sampling.level);
  if (!place) return smooth::open_occlusion(sampling.occlusion);
  const IVec3 chunk = chunk_at(position);
  return smooth::occlusion_of_sample(field.neighbourhood(chunk), in_chunk(*place, chunk, sampling.level), normal,
                                     sampling);
}

Status smooth_occlusion(const DensityGrid& field, const SmoothSamples& samples, const SmoothOcclusionOptions& options,
                        std::span<float> out, Threads threads, const Progress& progress) {
  check_samples(samples, out);
  const Sampling sampling(options, samples.level);
  if (sampling.occlusion.method == SmoothOcclusion::None) {
    std::fill_n(out.begin(), samples.positions.size(), 0.0F);
    return {};
  }
  const SamplesByChunk chunks(samples, sampling, out);
  ObjectPool<SampleKernel> kernels;
  ProgressSteps steps(progress, chunks.size());
  parallel_for(chunks.size(), threads, [&](std::size_t i) {
    if (steps.cancelled()) return;
    const IVec3 chunk = chunks.chunk(i);
    const DensityNeighbourhood neighbourhood = field.neighbourhood(chunk);
    const auto numbers = chunks.numbers(i);
    if (numbers.size() >= kFewSamples) {
      kernels.with([&](SampleKernel& kernel) {
        kernel.occlude(neighbourhood, {samples, chunk, numbers}, sampling, out);
      });
      return steps.step();
    }
    for (const std::uint32_t number : numbers) {
      const auto place = smooth::place_at(DVec3(samples.positions[number]) + DVec3(samples.origin), sampling.level);
      QUOIN_ASSERT(place.has_value(), "a position in the range of int32");
      out[number] = smooth::occlusion_of_sample(neighbourhood, in_chunk(*place, chunk, sampling.level),
                                                samples.normals[number], sampling);
    }
    steps.step();
  });
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return {};
}

struct SmoothOccluder::Scratch {
  SampleKernel kernel;
  BlockVector<std::uint32_t> numbers;
};

SmoothOccluder::SmoothOccluder() : scratch_(std::make_unique<Scratch>()) {}
SmoothOccluder::SmoothOccluder(SmoothOccluder&&) noexcept = default;
SmoothOccluder& SmoothOccluder::operator=(SmoothOccluder&&) noexcept = default;
SmoothOccluder::~SmoothOccluder() = default;

void SmoothOccluder::occlude(const DensityNeighbourhood& chunks, const SmoothSamples& samples,
                             const SmoothOcclusionOptions& options, std::span<float> out) {
  check_samples(samples, out);
  const Sampling sampling(options, samples.level);
  const std::size_t count = samples.positions.size();
  if (sampling.occlusion.method == SmoothOcclusion::None) return void(std::fill_n(out.begin(), count, 0.0F));
  for (std::size_t i = impl_of(scratch_).numbers.size(); i < count; ++i) {
    impl_of(scratch_).numbers.push_back(static_cast<std::uint32_t>(i));
  }
  impl_of(scratch_).kernel.occlude(chunks, {samples, IVec3{0}, std::span(impl_of(scratch_).numbers).first(count)},
                                   sampling, out);
}

}  // namespace quoin
