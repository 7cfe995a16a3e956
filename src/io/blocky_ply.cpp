#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include <quoin/io/ply.h>
#include <quoin/mesh/occlusion.h>

#include "core/srgb.h"
#include "io/block_writer.h"
#include "io/placement.h"
#include "io/ply_layout.h"
#include "io/smooth_parts.h"

namespace quoin {

namespace {

constexpr std::size_t kLevels = 4;

/// A grid's mesh and all its places.
struct BlockyPart {
  const GridMesh* grid = nullptr;
  std::vector<SmoothPlacement> placements;
};

using Srgb = std::array<std::uint8_t, 3>;

/// The colour of every type at every level of occlusion, [type * kLevels + level].
std::vector<Srgb> colours_of(const VoxelRegistry& types) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  // By way of 16 bits, as smooth meshes hold their colours.
  const auto darkened = [&](std::uint8_t byte, std::uint8_t level) {
    const auto linear = static_cast<std::uint16_t>(std::lround(linear_from_srgb(byte) * 65'535.0F));
    return encode(static_cast<float>(linear) / 65'535.0F * occlusion_brightness(level));
  };
  std::vector<Srgb> colours;
  colours.reserve(types.size() * kLevels);
  for (std::size_t type = 0; type < types.size(); ++type) {
    const Rgba8 colour = types[static_cast<VoxelType>(type)].colour;
    for (std::uint8_t level = 0; level < kLevels; ++level) {
      colours.push_back({darkened(colour.r, level), darkened(colour.g, level), darkened(colour.b, level)});
    }
  }
  return colours;
}

/// Every grid with its places, in the order of their handles.
std::vector<BlockyPart> parts_of(const Scene& scene, const SceneMeshes& meshes) {
  std::map<GridHandle, BlockyPart> parts;
  for (const GridMesh& grid : meshes.grids) parts[grid.grid].grid = &grid;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const auto part = parts.find(instance.grid);
    if (part == parts.end() || !is_drawn(scene, instance, meshes.hidden)) continue;
    part->second.placements.push_back({instance.name, world_from_pivot(instance)});
  }
  std::vector<BlockyPart> list;
  list.reserve(parts.size());
  for (auto& [grid, part] : parts) list.push_back(std::move(part));
  return list;
}

/// What is wrong with a surface; null when nothing is.
const char* fault_of(const BlockyTriangles& triangles, const VoxelRegistry& types) {
  const std::size_t count = triangles.positions.size();
  const bool has_all = triangles.directions.size() == count && triangles.types.size() == count &&
                       (triangles.levels.empty() || triangles.levels.size() == count);
  if (!has_all) return "not one direction, type and level a vertex";
  if (triangles.indices.size() % 3 != 0) return "indices that are not three a triangle";
  const auto is_known = [&](VoxelType type) { return type < types.size(); };
  if (!std::all_of(triangles.types.begin(), triangles.types.end(), is_known)) return "a type that the scene has not";
  const auto is_level = [](std::uint8_t level) { return level < kLevels; };
  if (!std::all_of(triangles.levels.begin(), triangles.levels.end(), is_level)) return "a level beyond 3";
  const auto is_vertex = [count](std::uint32_t index) { return index < count; };
  if (!std::all_of(triangles.indices.begin(), triangles.indices.end(), is_vertex))
    return "an index beyond its vertices";
  const auto is_sound = [](const Vec3& p) { return is_finite(DVec3(p)); };
  if (!std::all_of(triangles.positions.begin(), triangles.positions.end(), is_sound)) {
    return "a position that is not finite";
  }
  return nullptr;
}

Status check_parts(const Scene& scene, const std::vector<BlockyPart>& parts) {
  for (const BlockyPart& part : parts) {
    const SceneGrid& grid = scene.grids()[part.grid->grid];
    DBox bounds;
    for (const BlockyTriangles& triangles : part.grid->mesh.surfaces) {
      if (const char* fault = fault_of(triangles, scene.types)) return unsound_part(grid.name, fault);
      for (const Vec3& position : triangles.positions) bounds.extend(DVec3(position));
    }
    const char* fault =
        is_finite(grid.pivot) ? fault_of_places(bounds, grid.pivot, part.placements) : "a pivot that is not finite";
    if (fault != nullptr) return unsound_part(grid.name, fault);
  }
  return {};
}

PlyCounts count(const std::vector<BlockyPart>& parts) {
  PlyCounts counts;
  for (const BlockyPart& part : parts) {
    for (const BlockyTriangles& triangles : part.grid->mesh.surfaces) {
      counts.vertices += triangles.positions.size() * part.placements.size();
      counts.faces += triangles.indices.size() / 3 * part.placements.size();
    }
  }
  return counts;
}

void write_vertices(const BlockyTriangles& triangles, const VertexTransform& transform,
                    const std::vector<Srgb>& colours, bool occlusion, BlockWriter& out) {
  std::array<Vec3, kDirections.size()> normals{};
  for (const Direction direction : kDirections) {
    normals[static_cast<std::size_t>(direction)] = Vec3(transform.normal(Vec3(normal_of(direction))));
  }
  const bool has_levels = occlusion && !triangles.levels.empty();
  for (std::size_t i = 0; i < triangles.positions.size() && !out.failed(); ++i) {
    const Vec3 position(transform.position(triangles.positions[i]));
    const Vec3& normal = normals[static_cast<std::size_t>(triangles.directions[i])];
    const Srgb& colour = colours[triangles.types[i] * kLevels + (has_levels ? triangles.levels[i] : 0)];
    char* at = out.room(kPlyVertexBytes);
    std::memcpy(at, &position, sizeof(position));
    std::memcpy(at + sizeof(position), &normal, sizeof(normal));
    std::memcpy(at + sizeof(position) + sizeof(normal), colour.data(), colour.size());
    out.advance(at + kPlyVertexBytes);
  }
}

void write_faces(const BlockyTriangles& triangles, bool turned, std::uint64_t first, BlockWriter& out) {
  const std::size_t second = turned ? 2 : 1;
  const auto corner = [&](std::size_t i) { return static_cast<std::int32_t>(first + triangles.indices[i]); };
  for (std::size_t i = 0; i < triangles.indices.size() && !out.failed(); i += 3) {
    const std::array corners = {corner(i), corner(i + second), corner(i + 3 - second)};
    char* at = out.room(kPlyFaceBytes);
    *at = 3;
    std::memcpy(at + 1, corners.data(), sizeof(corners));
    out.advance(at + kPlyFaceBytes);
  }
}

/// Calls `write(triangles, transform)` for every surface in every place of its grid.
template <class Write>
void for_each_surface(const Scene& scene, const std::vector<BlockyPart>& parts, Write write) {
  for (const BlockyPart& part : parts) {
    for (const SmoothPlacement& placement : part.placements) {
      const VertexTransform transform(placement.world_from_mesh, scene.grids()[part.grid->grid].pivot);
      for (const BlockyTriangles& triangles : part.grid->mesh.surfaces) write(triangles, transform);
    }
  }
}

Result<std::uint64_t> write_checked(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                    const Progress& progress) {
  if (auto sound = check_placements(scene, meshes.hidden); !sound) return tl::unexpected<Error>(sound.error());
  const std::vector<BlockyPart> parts = parts_of(scene, meshes);
  if (auto sound = check_parts(scene, parts); !sound) return tl::unexpected<Error>(sound.error());
  const std::vector<Srgb> colours = colours_of(scene.types);
  return write_ply_file(path, count(parts), progress, [&](BlockWriter& out) {
    for_each_surface(scene, parts, [&](const BlockyTriangles& triangles, const VertexTransform& transform) {
      write_vertices(triangles, transform, colours, meshes.occlusion, out);
    });
    std::uint64_t first = 0;
    for_each_surface(scene, parts, [&](const BlockyTriangles& triangles, const VertexTransform& transform) {
      write_faces(triangles, transform.mirrors(), first, out);
      first += triangles.positions.size();
    });
  });
}

}  // namespace

Result<std::uint64_t> write_ply(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                const Progress& progress) {
  auto bytes = write_checked(scene, meshes, path, progress);
  if (!bytes && bytes.error().path.empty()) bytes.error().path = path.string();
  return bytes;
}

}  // namespace quoin
