#pragma once

// Arrays to mesh, and the slow, obvious way to their vertices.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <type_traits>
#include <vector>

#include <quoin/core/buffer.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>

namespace quoin::array_tests {

using Size = std::array<std::int64_t, 3>;

template <class T>
constexpr ScalarType scalar_type_of() {
  if constexpr (std::is_same_v<T, float>) return ScalarType::Float32;
  if constexpr (std::is_same_v<T, double>) return ScalarType::Float64;
  constexpr auto kOrder = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 2 : sizeof(T) == 4 ? 4 : 6;
  return static_cast<ScalarType>(kOrder + (std::is_signed_v<T> ? 1 : 0));
}

/// A packed array; its last axis is contiguous.
template <class T>
class TestArray {
 public:
  template <class Value>
  TestArray(Size size, Value value) : size_(size) {
    for (std::int64_t x = 0; x < size[0]; ++x) {
      for (std::int64_t y = 0; y < size[1]; ++y) {
        for (std::int64_t z = 0; z < size[2]; ++z) values_.push_back(value(DVec3(x, y, z)));
      }
    }
  }
  [[nodiscard]] Size size() const { return size_; }
  [[nodiscard]] std::vector<T>& values() { return values_; }
  [[nodiscard]] const std::vector<T>& values() const { return values_; }
  [[nodiscard]] T at(IVec3 p) const {
    return values_[static_cast<std::size_t>((p.x * size_[1] + p.y) * size_[2] + p.z)];
  }
  [[nodiscard]] bool has(IVec3 p) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] < 0 || p[axis] >= size_[static_cast<std::size_t>(axis)]) return false;
    }
    return true;
  }
  [[nodiscard]] ArrayView view() const {
    ArrayView view;
    view.data = values_.data();
    view.type = scalar_type_of<T>();
    view.size = size_;
    view.strides = strides_of_last_fastest(size_, view.type);
    return view;
  }

 private:
  Size size_;
  std::vector<T> values_;
};

/// The same samples in another layout: axes from the fastest to the slowest, the axes in the bits of `reversed`
/// backwards, samples `spread` elements apart, and all data at a byte offset.
template <class T>
class Relaid {
 public:
  Relaid(const TestArray<T>& from, std::array<int, 3> order, int reversed, std::int64_t spread, std::size_t offset = 0)
      : view_(from.view()) {
    std::int64_t stride = spread * static_cast<std::int64_t>(sizeof(T));
    std::int64_t first = static_cast<std::int64_t>(offset);
    for (const int axis : order) {
      const auto a = static_cast<std::size_t>(axis);
      const bool is_reversed = (reversed >> axis & 1) != 0;
      view_.strides[a] = is_reversed ? -stride : stride;
      if (is_reversed) first += stride * (view_.size[a] - 1);
      stride *= view_.size[a];
    }
    bytes_.resize(static_cast<std::size_t>(stride) + offset);
    view_.data = bytes_.data() + first;
    for (std::int64_t x = 0; x < view_.size[0]; ++x) {
      for (std::int64_t y = 0; y < view_.size[1]; ++y) {
        for (std::int64_t z = 0; z < view_.size[2]; ++z) {
          const T value = from.at(IVec3(x, y, z));
          std::memcpy(bytes_.data() + first + x * view_.strides[0] + y * view_.strides[1] + z * view_.strides[2],
                      &value, sizeof(T));
        }
      }
    }
  }
  [[nodiscard]] const ArrayView& view() const { return view_; }

 private:
  ArrayView view_;
  std::vector<std::byte> bytes_;
};

/// Random values from -1 to 1.
inline TestArray<float> noise(Size size, unsigned seed) {
  std::mt19937 random(seed);
  return {size, [&](DVec3) { return static_cast<float>(random()) * 0x1p-31F - 1.0F; }};
}

template <class T>
bool same_bytes(const Buffer<T>& a, const Buffer<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// Positive where the triangles face outwards.
inline double enclosed_volume(const Buffer<Vec3>& positions, const Buffer<std::uint32_t>& indices) {
  double volume = 0.0;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const DVec3 a(positions[indices[i]]);
    const DVec3 b(positions[indices[i + 1]]);
    const DVec3 c(positions[indices[i + 2]]);
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  return volume;
}

/// Returns a sample's density. Beyond the array it is air, at the nearest sample's distance from the surface.
inline double density_at(const TestArray<float>& samples, double iso, IVec3 p) {
  if (samples.has(p)) return iso - double{samples.at(p)};
  const Size size = samples.size();
  return std::abs(iso - double{samples.at(glm::clamp(p, IVec3(0), IVec3(size[0], size[1], size[2]) - 1))});
}

/// The mean of the crossings of each cell that has any, in the order of the memory.
inline std::vector<DVec3> naive_vertices(const TestArray<float>& samples, double iso) {
  std::vector<DVec3> all;
  const Size size = samples.size();
  for (int x = -1; x < size[0]; ++x) {
    for (int y = -1; y < size[1]; ++y) {
      for (int z = -1; z < size[2]; ++z) {
        DVec3 sum(0.0);
        int count = 0;
        for (int edge = 0; edge < 12; ++edge) {
          IVec3 step(0);
          step[edge / 4] = 1;
          IVec3 from(x, y, z);
          from[(edge / 4 + 1) % 3] += edge & 1;
          from[(edge / 4 + 2) % 3] += edge >> 1 & 1;
          const double a = density_at(samples, iso, from);
          const double b = density_at(samples, iso, from + step);
          if ((a < 0.0) == (b < 0.0)) continue;
          sum += DVec3(from) + DVec3(step) * (a / (a - b));
          ++count;
        }
        if (count != 0) all.push_back(sum / static_cast<double>(count));
      }
    }
  }
  return all;
}

/// Returns the number of crossed edges; with an open border, only of edges with four cells around them.
inline std::size_t naive_edges(const TestArray<float>& samples, double iso, bool is_open = false) {
  std::size_t count = 0;
  const Size size = samples.size();
  for (int x = -1; x < size[0]; ++x) {
    for (int y = -1; y < size[1]; ++y) {
      for (int z = -1; z < size[2]; ++z) {
        for (int axis = 0; axis < 3; ++axis) {
          const IVec3 from(x, y, z);
          IVec3 to = from;
          ++to[axis];
          IVec3 margin(1);
          margin[axis] = 0;
          const bool is_inner =
              samples.has(from) && samples.has(to) && samples.has(from - margin) && samples.has(to + margin);
          if (is_open && !is_inner) continue;
          count += (density_at(samples, iso, from) < 0.0) != (density_at(samples, iso, to) < 0.0);
        }
      }
    }
  }
  return count;
}

}  // namespace quoin::array_tests
