#pragma once

// Random boxes, and rays against them one by one.

#include <algorithm>
#include <cstddef>
#include <random>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/trace/ray.h>

namespace quoin {

// Returns true if a single ray hits a box (slab test).
inline bool meets(const Ray& ray, double max_t, const DBox& box) {
  if (box.empty()) return false;
  double low = 0.0;
  double high = max_t;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0.0) {
      if (ray.origin[axis] < box.min[axis] || ray.origin[axis] > box.max[axis]) return false;
      continue;
    }
    const double a = (box.min[axis] - ray.origin[axis]) / ray.direction[axis];
    const double b = (box.max[axis] - ray.origin[axis]) / ray.direction[axis];
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high;
}

struct RandomBoxes {
  explicit RandomBoxes(unsigned seed) : random(seed) {}
  std::mt19937 random;
  std::uniform_real_distribution<double> share{-1.0, 1.0};
  DVec3 vector(double size) { return DVec3(share(random), share(random), share(random)) * size; }
  BlockVector<DBox> boxes(int count) {
    BlockVector<DBox> all(static_cast<std::size_t>(count));
    for (DBox& box : all) {
      const DVec3 at = vector(100.0);
      box.extend(at);
      box.extend(at + glm::abs(vector(10.0)));
    }
    return all;
  }
};

}  // namespace quoin
