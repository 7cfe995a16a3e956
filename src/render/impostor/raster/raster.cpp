#include "render/impostor/raster/raster.h"

#include <limits>

#include <quoin/core/assert.h>

namespace quoin::raster {
namespace {

Vector single(DVec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

}  // namespace

void set_aim(const Aim& aim, double x, double y, Job& job) {
  QUOIN_ASSERT(aim.focal > 0.0 && aim.voxel_size > 0.0, "a positive focal length and voxel size");
  const DVec3 centre = aim.centre;
  const double step = (aim.is_perspective ? centre.z : 1.0) / aim.focal;  // voxels per pixel at the centre
  job.point.at = single(aim.right * (x * step - centre.x) + aim.down * (y * step - centre.y));
  job.point.x = single(aim.right * step), job.point.y = single(aim.down * step);
  const double turn = aim.is_perspective ? 1.0 / aim.focal : 0.0;
  job.direction.at = single(aim.forward + aim.right * (x * turn) + aim.down * (y * turn));
  job.direction.x = single(aim.right * turn), job.direction.y = single(aim.down * turn);
  job.forward = single(aim.forward);
  job.depth_at = static_cast<float>(centre.z * aim.voxel_size);
  job.depth_step = static_cast<float>(aim.voxel_size);
  job.across = single(aim.right * aim.focal), job.down = single(aim.down * aim.focal);
  job.across_at = static_cast<float>(centre.x * aim.focal), job.down_at = static_cast<float>(centre.y * aim.focal);
  job.ahead = single(aim.is_perspective ? aim.forward : DVec3(0.0));
  job.ahead_at = aim.is_perspective ? static_cast<float>(centre.z) : 1.0F;
  job.column_at = static_cast<float>(-x), job.row_at = static_cast<float>(-y);
}

void Canvas::clear() {
  depth.fill(std::numeric_limits<float>::infinity());
  furthest.fill(std::numeric_limits<float>::infinity());
  id.fill(std::numeric_limits<std::int32_t>::max());
}

void Canvas::set_pattern(int column, int row, std::uint32_t sample) {
  for (int y = 0; y < kTile; ++y) {
    for (int x = 0; x < kTile; ++x) pattern[index_of(x, y)] = Pattern::at(column + x, row + y, sample);
  }
}

}  // namespace quoin::raster
