#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include <quoin/grid/chunk.h>
#include <quoin/grid/neighbourhood.h>

namespace quoin {

/// How near the changed samples of a chunk come to each of its neighbours, so that it can be asked later, and exactly,
/// whether a neighbour that reads `reach` samples beyond its own reads one of them.
class ChangeReach {
 public:
  ChangeReach() { least_.fill(kNever); }

  /// Counts samples of a row that changed.
  void add(int y, int z, std::uint64_t changed) {
    if (changed == 0) return;
    samples += std::popcount(changed);
    const std::array<std::uint8_t, 3> x_steps = {static_cast<std::uint8_t>(std::countr_zero(changed) + 1), 0,
                                                 static_cast<std::uint8_t>(std::countl_zero(changed) + 1)};
    const std::array<std::uint8_t, 3> y_steps = steps(y);
    const std::array<std::uint8_t, 3> z_steps = steps(z);
    for (std::size_t i = 0; i < least_.size(); ++i) {
      const std::uint8_t farthest = std::max({x_steps[i % 3], y_steps[i / 3 % 3], z_steps[i / 9]});
      least_[i] = std::min(least_[i], farthest);
    }
  }

  /// For an edit that was broken off: anything may have changed.
  void add_all() {
    samples = kChunkVoxels;
    for (std::size_t i = 0; i < least_.size(); ++i) least_[i] = i == 13 ? 0 : 1;
  }

  void add(const ChangeReach& other) {
    samples += other.samples;
    for (std::size_t i = 0; i < least_.size(); ++i) least_[i] = std::min(least_[i], other.least_[i]);
  }

  [[nodiscard]] bool is_within(int reach, int dx, int dy, int dz) const {
    return least_[static_cast<std::size_t>(Neighbourhood::index(dx, dy, dz))] <= reach;
  }

  std::int64_t samples = 0;

 private:
  static constexpr std::uint8_t kNever = 255;

  // From the previous chunk, this one and the next: how many samples beyond its own a chunk must read.
  static std::array<std::uint8_t, 3> steps(int local) {
    return {static_cast<std::uint8_t>(local + 1), 0, static_cast<std::uint8_t>(kChunkEdge - local)};
  }

  std::array<std::uint8_t, 27> least_{};  ///< [(dz + 1) * 9 + (dy + 1) * 3 + (dx + 1)]
};

}  // namespace quoin
