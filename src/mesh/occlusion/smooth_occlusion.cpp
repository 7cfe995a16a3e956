#include <quoin/mesh/smooth_occlusion.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

#include <quoin/core/assert.h>

#include <tsl/robin_map.h>

#include "core/moved_from.h"
#include "core/object_pool.h"
#include "core/work/progress_steps.h"
#include "mesh/occlusion/places.h"

namespace quoin {

namespace {

using smooth::CellSample;
using smooth::SampleKernel;
using smooth::Sampling;

// Chunks with fewer samples than this are computed sample by sample: gathering the kernels' rows would cost more.
constexpr std::size_t kFewPlaces = 24;

void check_places(const SmoothSamples& places, std::span<float> out) {
  QUOIN_ASSERT(places.normals.size() == places.positions.size(), "as many normals as positions");
  QUOIN_ASSERT(out.size() >= places.positions.size(), "room for every place");
  QUOIN_ASSERT(places.positions.size() < std::numeric_limits<std::uint32_t>::max(), "less than 2^32 places");
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
class PlacesByChunk {
 public:
  PlacesByChunk(const SmoothSamples& places, const Sampling& sampling, std::span<float> out) {
    const std::size_t count = places.positions.size();
    const float open = smooth::open_occlusion(sampling.occlusion);
    constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> chunk_of_place(count);
    for (std::size_t i = 0; i < count; ++i) {
      const DVec3 position = DVec3(places.positions[i]) + DVec3(places.origin);
      if (smooth::is_in_int32(position)) {
        chunk_of_place[i] = index_of(chunk_at(position));
      } else {
        chunk_of_place[i] = kNowhere;
        out[i] = open;
      }
    }
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    numbers_.resize(first_.back());
    std::vector<std::uint32_t> next = first_;
    for (std::size_t i = 0; i < count; ++i) {
      if (chunk_of_place[i] != kNowhere) numbers_[next[chunk_of_place[i]]++] = static_cast<std::uint32_t>(i);
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
  std::vector<std::uint32_t> first_{
      0};  // first of each chunk, in `numbers_`; while counting, the count of the chunk before
  std::vector<std::uint32_t> numbers_;
};

}  // namespace

float smooth_occlusion(const DensityGrid& field, DVec3 position, Vec3 normal, const SmoothOcclusionOptions& options,
                       int level) {
  const Sampling sampling(options, level);
  if (sampling.occlusion.method == SmoothOcclusion::None) return 0.0F;
  const auto place = smooth::place_at(position, sampling.level);
  if (!place) return smooth::open_occlusion(sampling.occlusion);
  const IVec3 chunk = chunk_at(position);
  return smooth::occlusion_of_place(field.neighbourhood(chunk), in_chunk(*place, chunk, sampling.level), normal,
                                    sampling);
}

Status smooth_occlusion(const DensityGrid& field, const SmoothSamples& places, const SmoothOcclusionOptions& options,
                        std::span<float> out, Threads threads, const Progress& progress) {
  check_places(places, out);
  const Sampling sampling(options, places.level);
  if (sampling.occlusion.method == SmoothOcclusion::None) {
    std::fill_n(out.begin(), places.positions.size(), 0.0F);
    return {};
  }
  const PlacesByChunk chunks(places, sampling, out);
  ObjectPool<SampleKernel> kernels;
  ProgressSteps steps(progress, chunks.size());
  parallel_for(chunks.size(), threads, [&](std::size_t i) {
    if (steps.cancelled()) return;
    const IVec3 chunk = chunks.chunk(i);
    const DensityNeighbourhood neighbourhood = field.neighbourhood(chunk);
    const auto numbers = chunks.numbers(i);
    if (numbers.size() >= kFewPlaces) {
      kernels.with([&](SampleKernel& kernel) {
        kernel.occlude(neighbourhood, {places, chunk, numbers}, sampling, out);
      });
      return steps.step();
    }
    for (const std::uint32_t number : numbers) {
      const auto place = smooth::place_at(DVec3(places.positions[number]) + DVec3(places.origin), sampling.level);
      QUOIN_ASSERT(place.has_value(), "a position in the range of int32");
      out[number] = smooth::occlusion_of_place(neighbourhood, in_chunk(*place, chunk, sampling.level),
                                               places.normals[number], sampling);
    }
    steps.step();
  });
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return {};
}

struct SmoothOccluder::Scratch {
  SampleKernel kernel;
  std::vector<std::uint32_t> numbers;
};

SmoothOccluder::SmoothOccluder() : scratch_(std::make_unique<Scratch>()) {}
SmoothOccluder::SmoothOccluder(SmoothOccluder&&) noexcept = default;
SmoothOccluder& SmoothOccluder::operator=(SmoothOccluder&&) noexcept = default;
SmoothOccluder::~SmoothOccluder() = default;

void SmoothOccluder::occlude(const DensityNeighbourhood& chunks, const SmoothSamples& places,
                             const SmoothOcclusionOptions& options, std::span<float> out) {
  check_places(places, out);
  const Sampling sampling(options, places.level);
  const std::size_t count = places.positions.size();
  if (sampling.occlusion.method == SmoothOcclusion::None) return void(std::fill_n(out.begin(), count, 0.0F));
  for (std::size_t i = impl_of(scratch_).numbers.size(); i < count; ++i) {
    impl_of(scratch_).numbers.push_back(static_cast<std::uint32_t>(i));
  }
  impl_of(scratch_).kernel.occlude(chunks, {places, IVec3{0}, std::span(impl_of(scratch_).numbers).first(count)},
                                   sampling, out);
}

}  // namespace quoin
