#pragma once

#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include <quoin/grid/density_grid.h>

namespace quoin {

/// The densities and materials of a box in plain arrays, as an oracle for density grids.
class PlainField {
 public:
  PlainField(const IBox& box, float band)
      : box_(box),
        band_(band),
        samples_(static_cast<std::size_t>(box.size().x * box.size().y * box.size().z), DensitySample{band, kAir}) {}

  [[nodiscard]] const IBox& box() const { return box_; }
  [[nodiscard]] DensitySample& at(IVec3 sample) {
    const IVec3 p = sample - box_.min;
    const IVec3 size = box_.size();
    return samples_[static_cast<std::size_t>((p.z * size.y + p.y) * size.x + p.x)];
  }
  [[nodiscard]] float density(IVec3 sample) { return box_.contains(sample) ? at(sample).density : band_; }

  template <class Visit>
  void for_each(Visit&& visit) {
    DensitySample* sample = samples_.data();  // in the order of `at`
    for (int z = box_.min.z; z < box_.max.z; ++z) {
      for (int y = box_.min.y; y < box_.max.y; ++y) {
        for (int x = box_.min.x; x < box_.max.x; ++x, ++sample) visit(IVec3{x, y, z}, *sample);
      }
    }
  }

  /// Sets every sample to `pick`'s value, rounded and clamped like a density grid does. Returns the changed samples.
  template <class Pick>
  std::vector<IVec3> edit(Pick&& pick) {
    std::vector<IVec3> changed;
    for_each([&](IVec3 p, DensitySample& sample) {
      DensitySample wanted = pick(p, sample);
      wanted.density = float_from_half(stored_density(wanted.density, band_));
      if (wanted.density == band_) wanted.material = kAir;
      if (wanted.density != sample.density || wanted.material != sample.material) changed.push_back(p);
      sample = wanted;
    });
    return changed;
  }

 private:
  IBox box_;
  float band_;
  std::vector<DensitySample> samples_;
};

/// The chunks whose samples, grown by `reach`, hold one of these; sorted by z, y, x.
inline std::vector<IVec3> chunks_reached(const std::vector<IVec3>& samples, int reach) {
  std::set<std::tuple<int, int, int>> chunks;
  for (const IVec3 p : samples) {
    const IVec3 first = chunk_of(p - reach);
    const IVec3 last = chunk_of(p + reach);
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) chunks.emplace(z, y, x);
      }
    }
  }
  std::vector<IVec3> sorted;
  sorted.reserve(chunks.size());
  for (const auto& [z, y, x] : chunks) sorted.emplace_back(x, y, z);
  return sorted;
}

}  // namespace quoin
