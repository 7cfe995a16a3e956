#include "io/surface_parts.h"

#include <map>

namespace quoin {

namespace {

/// Appends vertex `from` of `source`; answers its index in `target`.
std::uint32_t copy_vertex(const BlockyTriangles& source, std::size_t from, BlockyTriangles& target) {
  target.positions.push_back(source.positions[from]);
  target.directions.push_back(source.directions[from]);
  if (!source.levels.empty()) target.levels.push_back(source.levels[from]);
  target.types.push_back(source.types[from]);
  return static_cast<std::uint32_t>(target.positions.size() - 1);
}

}  // namespace

SurfaceParts::SurfaceParts(const BlockyMesh& mesh, const MaterialPalette& palette) {
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
    if (!mesh.surfaces[i].indices.empty()) add_surface(mesh.surfaces[i], static_cast<SurfaceClass>(i), palette);
  }
}

void SurfaceParts::add_surface(const BlockyTriangles& surface, SurfaceClass surface_class,
                               const MaterialPalette& palette) {
  std::map<std::size_t, BlockyTriangles*> by_material;
  const bool emissive = surface_class == SurfaceClass::Emissive || surface_class == SurfaceClass::EmissiveTransparent;
  if (emissive) {
    for (const VoxelType type : surface.types) by_material.try_emplace(palette.material_of(surface_class, type));
  }
  if (by_material.size() < 2) {
    parts_.push_back({&surface, palette.material_of(surface_class, surface.types.front())});
    return;
  }
  for (auto& [material, triangles] : by_material) {
    triangles = owned_.emplace_back(std::make_unique<BlockyTriangles>()).get();
    parts_.push_back({triangles, material});
  }
  // A triangle lies in one face, so its three vertices have one type and move together.
  std::vector<std::uint32_t> moved_to(surface.positions.size());
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    moved_to[i] = copy_vertex(surface, i, *by_material.at(palette.material_of(surface_class, surface.types[i])));
  }
  for (const std::uint32_t index : surface.indices) {
    by_material.at(palette.material_of(surface_class, surface.types[index]))->indices.push_back(moved_to[index]);
  }
}

}  // namespace quoin
