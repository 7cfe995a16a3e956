#include <map>

#include <quoin/io/ply.h>
#include <quoin/io/smooth_files.h>
#include <quoin/mesh/occlusion.h>

#include "core/srgb.h"
#include "io/placement.h"

namespace quoin {

namespace {

LinearRgba16 linear_albedo(const Rgba8& colour) {
  const auto linear = [](std::uint8_t byte) {
    return static_cast<std::uint16_t>(linear_from_srgb(byte) * 65'535.0F + 0.5F);
  };
  return {linear(colour.r), linear(colour.g), linear(colour.b), 65'535};
}

void append(const BlockyTriangles& triangles, const std::vector<LinearRgba16>& albedo_of, bool occlusion,
            SmoothMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), triangles.positions.begin(), triangles.positions.end());
  for (const Direction direction : triangles.directions) mesh.normals.emplace_back(normal_of(direction));
  for (const VoxelType type : triangles.types) mesh.albedo.push_back(albedo_of[type]);
  if (occlusion) {
    for (const std::uint8_t level : triangles.levels) mesh.openness.push_back(occlusion_brightness(level));
  }
  for (const std::uint32_t index : triangles.indices) mesh.indices.push_back(first + index);
}

/// Makes room for all surfaces of a grid and no more.
void reserve_for(const GridMesh& grid, bool occlusion, SmoothMesh& mesh) {
  std::size_t vertices = 0;
  std::size_t indices = 0;
  for (const BlockyTriangles& triangles : grid.mesh.surfaces) {
    vertices += triangles.positions.size();
    indices += triangles.indices.size();
  }
  mesh.positions.reserve(vertices);
  mesh.normals.reserve(vertices);
  mesh.albedo.reserve(vertices);
  if (occlusion) mesh.openness.reserve(vertices);
  mesh.indices.reserve(indices);
}

/// The blocks of a scene in the form of smooth meshes, each grid once.
std::vector<SmoothPart> parts_of(const Scene& scene, const SceneMeshes& meshes) {
  std::vector<LinearRgba16> albedo_of;
  for (std::size_t type = 0; type < scene.types.size(); ++type) {
    albedo_of.push_back(linear_albedo(scene.types[static_cast<VoxelType>(type)].colour));
  }
  std::map<GridHandle, SmoothPart> parts;
  for (const GridMesh& grid : meshes.grids) {
    SmoothPart& part = parts[grid.grid];
    part.name = scene.grids()[grid.grid].name;
    part.pivot = scene.grids()[grid.grid].pivot;
    reserve_for(grid, meshes.occlusion, part.mesh);
    for (const BlockyTriangles& triangles : grid.mesh.surfaces) {
      append(triangles, albedo_of, meshes.occlusion, part.mesh);
    }
  }
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const auto part = parts.find(instance.grid);
    if (part == parts.end() || !is_drawn(scene, instance, meshes.hidden)) continue;
    part->second.placements.push_back({instance.name, world_from_pivot(instance)});
  }
  std::vector<SmoothPart> list;
  list.reserve(parts.size());
  for (auto& [grid, part] : parts) list.push_back(std::move(part));
  return list;
}

}  // namespace

Result<std::uint64_t> write_ply(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                const Progress& progress) {
  if (auto sound = check_placements(scene, meshes.hidden); !sound) {
    sound.error().path = path.string();
    return tl::unexpected<Error>(sound.error());
  }
  return write_ply(parts_of(scene, meshes), path, {meshes.occlusion}, progress);
}

}  // namespace quoin
