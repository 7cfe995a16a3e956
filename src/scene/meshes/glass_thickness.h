#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin {

namespace glass_thickness_detail {

constexpr int kDeepest = 1024;

/// [depth in voxels]: the area of the triangles with this depth behind them. Areas are integers, so that sums do not
/// depend on the order.
using AreaByDepth = std::vector<double>;

template <class Reader>
int depth_behind(Reader& reader, Vec3 middle, Direction face, VoxelType type) {
  const IVec3 inwards = -normal_of(face);
  IVec3 voxel(glm::floor(middle + 0.5F * Vec3(inwards)));
  int depth = 0;
  while (depth < kDeepest && reader.get(voxel) == type) {
    ++depth;
    voxel += inwards;
  }
  return std::max(depth, 1);
}

inline float median(const AreaByDepth& areas) {
  QUOIN_ASSERT(!areas.empty(), "areas of a type");
  double half = 0.0;
  for (const double area : areas) half += area / 2.0;
  for (std::size_t depth = 0; depth < areas.size(); ++depth) {
    half -= areas[depth];
    if (half <= 0.0 && areas[depth] > 0.0) return static_cast<float>(depth);
  }
  return static_cast<float>(areas.size() - 1);
}

}  // namespace glass_thickness_detail

/// Returns the thickness of the bodies of each transparent type, by type. Measures straight inwards from the middle of
/// each triangle of a grid's surfaces, at most 1,024 voxels deep. `reader` has `get(voxel)`, like GridReader.
/// Cost: one lookup per voxel behind the middle of a triangle.
template <class Reader>
std::vector<GlassThickness> glass_thickness(Reader& reader, std::span<const MeshView> surfaces) {
  using namespace glass_thickness_detail;
  std::map<VoxelType, AreaByDepth> areas;
  for (const MeshView& view : surfaces) {
    if (view.surface != SurfaceClass::Transparent && view.surface != SurfaceClass::EmissiveTransparent) continue;
    QUOIN_ASSERT(view.types.size() == view.positions.size() && view.directions.size() == view.positions.size(),
                 "a type and a direction for each vertex");
    for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
      const std::uint32_t first = view.indices[i];
      const Vec3 a = view.positions[first];
      const Vec3 b = view.positions[view.indices[i + 1]];
      const Vec3 c = view.positions[view.indices[i + 2]];
      const VoxelType type = view.types[first];
      const int voxels = depth_behind(reader, (a + b + c) / 3.0F, view.directions[first], type);
      AreaByDepth& of_type = areas.try_emplace(type, kDeepest + 1).first->second;
      of_type[static_cast<std::size_t>(voxels)] += glm::length(glm::cross(b - a, c - a));
    }
  }
  std::vector<GlassThickness> thickness;
  thickness.reserve(areas.size());
  for (const auto& [type, each] : areas) thickness.push_back({type, median(each)});
  return thickness;
}

}  // namespace quoin
