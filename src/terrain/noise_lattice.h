#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

namespace quoin::terrain {

/// Low-frequency noise is evaluated at every fourth sample and interpolated.
inline constexpr int kLatticeStep = 4;
/// From -4 to 68 in samples of a chunk.
inline constexpr int kLatticeEdge = kChunkEdge / kLatticeStep + 3;
/// From sample -1 to sample 64 of a chunk, as needed for gradients.
inline constexpr int kFieldEdge = kChunkEdge + 2;

/// Values at every fourth sample of a chunk and around it.
class Lattice {
 public:
  Lattice() : values_(std::size_t{kLatticeEdge} * kLatticeEdge * kLatticeEdge) {}

  /// `value(sample, column)` returns the value at a world sample; `column` is its [z][x] in the lattice.
  template <class Value>
  void fill(IVec3 corner, Value&& value) {
    std::size_t i = 0;
    for (int z = 0; z < kLatticeEdge; ++z) {
      for (int y = 0; y < kLatticeEdge; ++y) {
        for (int x = 0; x < kLatticeEdge; ++x) {
          const IVec3 sample = corner + (IVec3{x, y, z} - 1) * kLatticeStep;
          values_[i++] = static_cast<float>(value(sample, static_cast<std::size_t>(z * kLatticeEdge + x)));
        }
      }
    }
  }
  /// Returns false if no interpolated value can be that close to 0.
  [[nodiscard]] bool comes_within(double reach) const {
    const auto [least, greatest] = std::minmax_element(values_.begin(), values_.end());
    return *least<reach&& * greatest> - reach;
  }
  [[nodiscard]] const float* row(int y, int z) const {
    QUOIN_ASSERT(std::min(y, z) >= 0 && std::max(y, z) < kLatticeEdge, "a row of the lattice");
    return values_.data() + (z * kLatticeEdge + y) * kLatticeEdge;
  }

 private:
  std::vector<float> values_;
};

/// Returns the gradient of a field at a sample.
struct Slope {
  float length = 0.0F;
  float up = 0.0F;
};

/// Values at the samples of a chunk and at their neighbours.
class Field {
 public:
  Field() : values_(std::size_t{kFieldEdge} * kFieldEdge * kFieldEdge) {}

  void fill(float value) { std::fill(values_.begin(), values_.end(), value); }
  void upsample(const Lattice& lattice);

  /// Returns the row of samples from x = -1; `y` and `z` also start at sample -1.
  [[nodiscard]] float* row(int y, int z) {
    QUOIN_ASSERT(std::min(y, z) >= 0 && std::max(y, z) < kFieldEdge, "a row of the field");
    return values_.data() + (z * kFieldEdge + y) * kFieldEdge;
  }
  /// Requires: 0 <= x, y, z < 64.
  [[nodiscard]] float at(int x, int y, int z) const { return values_[index(x, y, z)]; }
  [[nodiscard]] Slope slope(int x, int y, int z) const {
    const float* here = values_.data() + index(x, y, z);
    constexpr int kPlane = kFieldEdge * kFieldEdge;
    const float dx = 0.5F * (here[1] - here[-1]);
    const float dy = 0.5F * (here[kFieldEdge] - here[-kFieldEdge]);
    const float dz = 0.5F * (here[kPlane] - here[-kPlane]);
    return {std::sqrt((dx * dx + dy * dy) + dz * dz), dy};
  }

 private:
  static std::size_t index(int x, int y, int z) {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
    return static_cast<std::size_t>(((z + 1) * kFieldEdge + y + 1) * kFieldEdge + x + 1);
  }

  std::vector<float> values_;
};

}  // namespace quoin::terrain
