#include "mesh/occlusion/places.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <quoin/core/assert.h>

#include "core/instruction_set.h"
#include "mesh/smooth/smooth_cell.h"

namespace quoin::smooth {

namespace {

auto pick_kernel() {
#ifdef QUOIN_X86_KERNELS
  if (has_instruction_set(InstructionSet::Avx512Bytes)) return occlude_avx512;
  if (has_instruction_set(InstructionSet::Avx2)) return occlude_avx2;
#endif
  return occlude_plain;
}

}  // namespace

Vec3 unit_or_up(Vec3 normal) {
  // In double, no vector of floats overflows or underflows.
  const DVec3 n(normal);
  const double length = std::sqrt((n.x * n.x + n.y * n.y) + n.z * n.z);
  if (!(length > 0.0) || !std::isfinite(length)) return {0.0F, 1.0F, 0.0F};
  return Vec3(n / length);
}

float open_occlusion(const SmoothOcclusionOptions& options) {
  const bool is_weighted =
      options.method == SmoothOcclusion::Weighted || options.method == SmoothOcclusion::WeightedPublished;
  return is_weighted ? weighted_occlusion(0.0F, 0.0F, options) : 0.0F;
}

Sampling::Sampling(const SmoothOcclusionOptions& wanted, int wanted_level)
    : occlusion(within_limits(wanted, std::clamp(wanted_level, 0, kMaxSmoothLevel))),
      level(std::clamp(wanted_level, 0, kMaxSmoothLevel)) {}

float occlusion_of_place(const DensityNeighbourhood& chunks, const CellSample& place, Vec3 normal,
                         const Sampling& sampling) {
  const float unit = depth_unit(sampling.level);
  const int size = 1 << sampling.level;
  return occlusion_at_vertex(place.snapped, sound_normal(normal), sampling.occlusion, [&](int x, int y, int z) {
    return float_from_half(chunks.get((place.cell + IVec3{x, y, z}) * size)) * unit;
  });
}

SampleKernel::SampleKernel() : kernel_(pick_kernel()) {}

// Finds the cells of the samples. Samples out of reach are open.
void SampleKernel::sort_by_slice(const ChunkSamples& wanted, const Sampling& sampling, std::span<float> out) {
  const DVec3 origin = DVec3(wanted.places.origin) - DVec3(wanted.chunk) * static_cast<double>(kChunkEdge);
  entries_.clear();
  first_of_slice_.fill(0);
  for (const std::uint32_t number : wanted.numbers) {
    QUOIN_ASSERT(number < wanted.places.positions.size() && number < out.size(), "one of the samples");
    const auto place = place_at(DVec3(wanted.places.positions[number]) + origin, sampling.level);
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

void SampleKernel::occlude_some(const SmoothSamples& places, int z, std::size_t first, std::size_t count,
                                std::span<float> out) {
  // Kernels read whole registers, so the last place is repeated.
  constexpr std::size_t kOverrun = 16;
  QUOIN_ASSERT(count > 0 && count <= kPlacesAtOnce && first + count <= sorted_.size(), "samples of the slice");
  for (std::size_t i = 0; i < count + kOverrun; ++i) {
    const Entry& entry = sorted_[first + std::min(i, count - 1)];
    const Vec3 normal = sound_normal(places.normals[entry.number]);
    work_.places[i] = entry.place;
    for (int axis = 0; axis < 3; ++axis) {
      work_.fractions[axis][i] = entry.snapped[axis];
      work_.normals[axis][i] = normal[axis];
    }
  }
  kernel_(work_, z, count, occlusion_.data());
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
      occlude_some(wanted.places, z, first + done, std::min(kPlacesAtOnce, count - done), out);
    }
  }
}

}  // namespace quoin::smooth
