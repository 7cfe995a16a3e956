#include "io/glass_bodies.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "io/glass_material.h"
#include "io/mesh_parts.h"

namespace quoin {
namespace {

double area_of(const MeshView& view, std::size_t i) {
  const Vec3 a = view.positions[view.indices[i]];
  return glm::length(glm::cross(DVec3(view.positions[view.indices[i + 1]] - a),
                                DVec3(view.positions[view.indices[i + 2]] - a))) /
         2.0;
}

double area_of(const MeshView& view) {
  double area = 0.0;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) area += area_of(view, i);
  return area;
}

/// The world's length of a unit of the part.
double unit_of(const MeshPlacement& placement) {
  return std::cbrt(std::abs(glm::determinant(glm::dmat3(placement.matrix()))));
}

float thickness_of(const MeshPart& part, const MeshView& view, VoxelType type) {
  for (const GlassThickness& known : part.thickness) {
    if (known.type == type && known.voxels > 0.0F) return known.voxels;
  }
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    if (view.types[view.indices[i]] == type) indices.insert(indices.end(), &view.indices[i], &view.indices[i] + 3);
  }
  MeshView own = view;
  own.indices = indices;
  return thickness_of(own);
}

}  // namespace

GlassBodies::GlassBodies(const SceneMeshes& meshes) {
  std::vector<double> squares(meshes.parts.size());
  std::vector<double> cubes(meshes.parts.size());
  for (const MeshPlacement& placement : meshes.placements) {
    const double unit = unit_of(placement);
    squares[placement.part] += unit * unit;
    cubes[placement.part] += unit * unit * unit;
  }
  for (std::size_t i = 0; i < meshes.parts.size(); ++i) {
    if (!(squares[i] > 0.0)) continue;
    const double unit = cubes[i] / squares[i];
    for (const MeshView& view : meshes.parts[i].surfaces) {
      if (!is_transparent(view.surface) || view.indices.empty()) continue;
      if (view.has_albedo()) {
        smooth_.push_back({quoin::thickness_of(view), unit, area_of(view) * squares[i]});
      } else {
        add_blocks(meshes.parts[i], view, unit, squares[i]);
      }
    }
  }
}

void GlassBodies::add_blocks(const MeshPart& part, const MeshView& view, double unit, double times) {
  std::map<VoxelType, double> areas;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    areas[view.types[view.indices[i]]] += area_of(view, i) * times;
  }
  for (const auto& [type, area] : areas) by_type_[type].push_back({thickness_of(part, view, type), unit, area});
}

GlassBodies::Typical GlassBodies::typical(VoxelType type) const {
  const auto found = by_type_.find(type);
  return found == by_type_.end() ? Typical{} : typical_of(found->second);
}

GlassBodies::Typical GlassBodies::typical_of(std::vector<Seen> seen) {
  std::ranges::sort(seen, {}, &Seen::thickness);
  double area = 0.0;
  double units = 0.0;
  for (const Seen& each : seen) {
    area += each.area;
    units += each.area * each.unit;
  }
  Typical typical{seen.back().thickness, area > 0.0 ? static_cast<float>(units / area) : 1.0F};
  double before = 0.0;
  for (const Seen& each : seen) {
    before += each.area;
    if (before < area / 2.0) continue;
    typical.thickness = each.thickness;
    break;
  }
  return typical;
}

}  // namespace quoin
