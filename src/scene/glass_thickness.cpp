#include "scene/glass_thickness.h"

#include <algorithm>
#include <map>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/direction.h>

namespace quoin {
namespace {

constexpr int kDeepest = 1024;

struct Sample {
  int voxels = 0;
  double area = 0.0;
};

int depth_behind(GridReader& reader, Vec3 middle, Direction face, VoxelType type) {
  const IVec3 inwards = -normal_of(face);
  IVec3 voxel(glm::floor(middle + 0.5F * Vec3(inwards)));
  int depth = 0;
  while (depth < kDeepest && reader.get(voxel) == type) {
    ++depth;
    voxel += inwards;
  }
  return std::max(depth, 1);
}

float median(std::vector<Sample>& samples) {
  std::ranges::sort(samples, {}, &Sample::voxels);
  double half = 0.0;
  for (const Sample& sample : samples) half += sample.area / 2.0;
  for (const Sample& sample : samples) {
    half -= sample.area;
    if (half <= 0.0) return static_cast<float>(sample.voxels);
  }
  return static_cast<float>(samples.back().voxels);
}

}  // namespace

std::vector<GlassThickness> glass_thickness(const Grid& grid, std::span<const MeshView> surfaces) {
  std::map<VoxelType, std::vector<Sample>> samples;
  GridReader reader(grid);
  for (const MeshView& view : surfaces) {
    if (view.surface != SurfaceClass::Transparent && view.surface != SurfaceClass::EmissiveTransparent) continue;
    for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
      const std::uint32_t first = view.indices[i];
      const Vec3 a = view.positions[first];
      const Vec3 b = view.positions[view.indices[i + 1]];
      const Vec3 c = view.positions[view.indices[i + 2]];
      const VoxelType type = view.types[first];
      const int voxels = depth_behind(reader, (a + b + c) / 3.0F, view.directions[first], type);
      samples[type].push_back({voxels, glm::length(glm::cross(b - a, c - a))});
    }
  }
  std::vector<GlassThickness> thickness;
  for (auto& [type, each] : samples) thickness.push_back({type, median(each)});
  return thickness;
}

}  // namespace quoin
