#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include <quoin/grid/voxel_field.h>

#include "convert/convert.h"

namespace quoin::tool {

namespace {

/// Returns the type for samples without a material: plain white.
VoxelType type_without_name(Scene& scene) {
  VoxelProperties white;
  white.colour = {255, 255, 255, 255};
  const auto type = scene.types.find_or_add(white);
  return type ? *type : VoxelType{1};
}

/// Adds an instance of `voxels` for each instance of the grid `of_field`.
void place_voxels(Scene& scene, GridHandle of_field, SceneGrid voxels) {
  const GridHandle added = scene.add_grid(std::move(voxels));
  for (const InstanceHandle handle : scene.instances().handles()) {
    Instance instance = scene.instances()[handle];
    if (instance.grid != of_field) continue;
    instance.grid = added;
    scene.add_instance(std::move(instance));
  }
}

/// Returns the nearest rotation by quarter turns.
DQuat nearest_quarters(const DQuat& rotation) {
  const glm::dmat3 axes = glm::mat3_cast(glm::normalize(rotation));
  std::array<int, 3> row_of = {0, 1, 2};
  std::array<int, 3> best = row_of;
  double most = -1.0;
  do {
    double sum = 0.0;
    for (int column = 0; column < 3; ++column) sum += std::abs(axes[column][row_of[static_cast<std::size_t>(column)]]);
    if (sum <= most) continue;
    most = sum;
    best = row_of;
  } while (std::next_permutation(row_of.begin(), row_of.end()));
  glm::dmat3 quarters(0.0);
  for (int column = 0; column < 3; ++column) {
    const int row = best[static_cast<std::size_t>(column)];
    quarters[column][row] = axes[column][row] < 0.0 ? -1.0 : 1.0;
  }
  // For angles near 45 degrees, rounding can produce a mirror image: flip the axis with the largest error.
  if (glm::determinant(quarters) < 0.0) {
    int weakest = 0;
    const auto length = [&](int column) { return std::abs(glm::dot(axes[column], quarters[column])); };
    for (int column = 1; column < 3; ++column) weakest = length(column) < length(weakest) ? column : weakest;
    quarters[weakest] = -quarters[weakest];
  }
  return glm::normalize(glm::quat_cast(quarters));
}

}  // namespace

void make_voxels_of_fields(Scene& scene, Threads threads, std::vector<std::string>& warnings) {
  std::int64_t count = 0;
  for (const GridHandle handle : scene.grids().handles()) {
    if (scene.grids()[handle].field.chunk_count() == 0) continue;
    const VoxelType unnamed = type_without_name(scene);
    SceneGrid& grid = scene.edit(handle);
    SceneGrid voxels;
    voxels.name = grid.name;
    voxels.pivot = grid.pivot + 0.5;
    voxels.grid = grid_from_field(grid.field, unnamed, threads);
    count += voxels.grid.voxel_count();
    grid.field = DensityGrid(grid.field.band());
    if (grid.grid.chunk_count() == 0) {
      grid = std::move(voxels);
    } else {
      place_voxels(scene, handle, std::move(voxels));
    }
  }
  if (count > 0) warnings.push_back("fields converted to voxels, one per solid sample: " + with_thousands(count));
}

void turn_by_quarters(Scene& scene, std::vector<std::string>& warnings) {
  constexpr double kSame = 1e-6;
  double most = 0.0;
  for (const InstanceHandle handle : scene.instances().handles()) {
    Instance& placed = scene.edit(handle);
    const DQuat before = glm::normalize(placed.rotation);
    placed.rotation = nearest_quarters(before);
    const double cosine = std::min(std::abs(glm::dot(before, placed.rotation)), 1.0);
    most = std::max(most, 2.0 * std::acos(cosine));
  }
  if (most <= kSame) return;
  warnings.push_back("rotated by up to " + number_for_people(glm::degrees(most)) +
                     " degrees to the nearest quarter turns: voxel formats have no other rotations");
}

void normalise_scale(Scene& scene, const FormatInfo& format, std::vector<std::string>& warnings) {
  const std::vector<InstanceHandle> handles = scene.instances().handles();
  if (handles.empty()) return;
  const Instance first = scene.instances()[handles.front()];
  if (!(first.voxel_size > 0.0)) return;
  warnings.push_back(std::string(format.extension) + " stores no voxel size: a voxel is " +
                     digits_for_people(first.voxel_size) + " units of the input");
  for (const InstanceHandle handle : handles) {
    Instance& placed = scene.edit(handle);
    placed.position = (placed.position - first.position) / first.voxel_size;
    placed.voxel_size /= first.voxel_size;
  }
  // The pivot of voxels made from a field is between voxels: move all instances to whole coordinates.
  const DVec3 corner = world_from_grid(scene.instances()[handles.front()], scene.grids()[first.grid], DVec3(0.0));
  const DVec3 moved = glm::round(corner) - corner;
  for (const InstanceHandle handle : handles) scene.edit(handle).position += moved;
}

}  // namespace quoin::tool
