#pragma once

// Shared parts of blocky and smooth scene meshes.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/progress.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin {

/// Checks the drawn instances. Errors: InvalidArgument, naming the first instance with an invalid placement.
[[nodiscard]] Status check_instances(const Scene& scene, InstanceFilter filter);

/// Returns the grids that drawn instances place, each once, in handle order.
[[nodiscard]] std::vector<GridHandle> drawn_grids(const Scene& scene, InstanceFilter filter);

/// Places instances, and takes the groups above them into the meshes.
class MeshHierarchy {
 public:
  MeshHierarchy(const Scene& scene, SceneMeshes& meshes) : scene_(scene), meshes_(meshes) {}
  /// Returns the placement of an instance for a part.
  [[nodiscard]] MeshPlacement place(InstanceHandle handle, std::size_t part);

 private:
  [[nodiscard]] std::optional<std::size_t> group_of(GroupHandle handle);
  [[nodiscard]] std::string layer_name(LayerHandle handle) const;

  const Scene& scene_;
  SceneMeshes& meshes_;
  std::map<GroupHandle, std::size_t> groups_;
};

/// The surfaces of one grid: opaque, then all transparent.
using SmoothBodies = std::array<SmoothMesh, 2>;

/// Appends the vertices and triangles of a mesh to another. If the other has no triangles, `more` replaces it.
void append(SmoothMesh& all, SmoothMesh more);

/// Creates a part from the non-empty surfaces of a grid.
[[nodiscard]] MeshPart part_of_bodies(std::string name, SmoothBodies bodies, const DVec3& pivot);

struct SurfaceOptions {
  const SmoothMeshOptions& mesh;
  std::optional<float> simplify_error;
};

/// Meshes a field, simplifies the mesh if requested, and counts the result.
[[nodiscard]] Result<SmoothMesh> surface_of(const DensityGrid& field, const VoxelRegistry& types,
                                            const SurfaceOptions& wanted, MeshStats& stats, Threads threads,
                                            const Progress& progress);

/// Simplifies a mesh if an error is given, and keeps the vertices' `tags` (may be empty) in step. Counts the result.
[[nodiscard]] Status simplify_and_count(SmoothMesh& mesh, std::optional<float> error, std::vector<std::uint32_t>& tags,
                                        MeshStats& stats);

/// Adds a part for each grid's field with a surface, and its placements: those of the grid's instances, in their order.
/// Each transparent material is a separate closed body; bodies meet as in images.
[[nodiscard]] Status add_fields(const Scene& scene, const std::vector<GridHandle>& grids, InstanceFilter filter,
                                const SurfaceOptions& wanted, MeshHierarchy& hierarchy, SceneMeshes& meshes,
                                Threads threads, const Progress& progress);

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
