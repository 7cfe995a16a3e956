#include <quoin/scene/level_of_detail.h>

#include <glm/geometric.hpp>

namespace quoin {

ContentSphere content_sphere(const Grid& grid) {
  const IBox box = grid.bounds();
  if (box.empty()) return {};
  const DVec3 low(box.min);
  const DVec3 high(box.max);
  return {0.5 * (low + high), 0.5 * glm::length(high - low)};
}

}  // namespace quoin
