#include "io/glass.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <quoin/core/assert.h>

#include "io/mesh_parts.h"

namespace quoin {

namespace {

constexpr float kLeastAttenuation = 0.01F;  // glTF colours may be 0, but some clients take logarithms of them

}  // namespace

GlassMaterial glass_material(const Surface& surface, float thickness) {
  QUOIN_ASSERT(thickness > 0.0F, "a body that has a thickness");
  GlassMaterial glass;
  glass.thickness = thickness;
  if (!std::isfinite(surface.log_clarity)) {
    glass.tint = Vec3(0.0F);
    return glass;
  }
  const float own = 1.0F - std::exp(surface.log_clarity * thickness);
  Vec3 passed;
  float wanted = 0.0F;
  float weight = 0.0F;
  for (int channel = 0; channel < 3; ++channel) {
    glass.tint[channel] = std::exp((surface.log_transmittance[channel] - surface.log_clarity) * thickness);
    passed[channel] = std::exp(surface.log_transmittance[channel] * thickness);
    const float square = surface.colour[channel] * surface.colour[channel];
    wanted += 1.0F - passed[channel] + own * square;
    weight += 1.0F + square;
  }
  glass.alpha = std::clamp(wanted / weight, own, 1.0F);
  if (!(glass.alpha > 0.0F)) return glass;
  glass.transmission = 1.0F - own / glass.alpha;
  for (int channel = 0; channel < 3; ++channel) {
    const float untinted = glass.alpha * glass.transmission * surface.colour[channel];
    if (!(untinted > 0.0F)) continue;
    // The remaining attenuation, after one alpha for all channels, may have any hue, and some clients apply it to the
    // uncovered part too.
    const float least = std::max(passed[channel], kLeastAttenuation);
    glass.attenuation[channel] =
        std::clamp((passed[channel] - (1.0F - glass.alpha)) / untinted, least, std::max(least, 1.0F));
  }
  return glass;
}

std::uint16_t glass_alpha(const LinearRgba16& albedo, float thickness) {
  constexpr float kFull = 65535.0F;
  Surface surface;
  surface.colour = Vec3(albedo[0], albedo[1], albedo[2]) / kFull;
  set_absorption(static_cast<float>(albedo[3]) / kFull, surface);
  return static_cast<std::uint16_t>(std::lround(glass_material(surface, thickness).alpha * kFull));
}

float thickness_of(const MeshView& view) {
  constexpr double kOpen = 1e-3;
  if (view.positions.empty()) return 1.0F;
  const DVec3 origin(view.positions.front());
  double volume = 0.0;
  DVec3 sum(0.0);
  DVec3 shown(0.0);
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    const DVec3 a = DVec3(view.positions[view.indices[i]]) - origin;
    const DVec3 b = DVec3(view.positions[view.indices[i + 1]]) - origin;
    const DVec3 c = DVec3(view.positions[view.indices[i + 2]]) - origin;
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    const DVec3 area = glm::cross(b - a, c - a) / 2.0;
    sum += area;
    shown += glm::abs(area) / 2.0;
  }
  const double largest = std::max({shown.x, shown.y, shown.z});
  if (!(volume > 0.0) || !(largest > 0.0) || glm::length(sum) > kOpen * largest) return 1.0F;
  return static_cast<float>(volume / largest);
}

namespace {

double area_of(const MeshView& view, std::size_t i) {
  QUOIN_ASSERT(i + 2 < view.indices.size(), "a triangle of the surface");
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

/// Returns the world length of a unit of the part.
double unit_of(const MeshPlacement& placement) {
  return std::cbrt(std::abs(glm::determinant(glm::dmat3(placement.matrix()))));
}

float thickness_of(const MeshPart& part, const MeshView& view, VoxelType type) {
  for (const GlassThickness& known : part.thickness) {
    if (known.type == type && known.voxels > 0.0F) return known.voxels;
  }
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    QUOIN_ASSERT(view.indices[i] < view.types.size(), "a vertex with a type");
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
    QUOIN_ASSERT(placement.part < meshes.parts.size(), "a part of the meshes");
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
        if (!view.types.empty()) add_by_type({}, view, unit, squares[i], smooth_by_type_);
      } else {
        add_by_type(meshes.parts[i], view, unit, squares[i], by_type_);
      }
    }
  }
}

void GlassBodies::add_by_type(const MeshPart& part, const MeshView& view, double unit, double times, ByType& all) {
  std::map<VoxelType, double> areas;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    areas[view.types[view.indices[i]]] += area_of(view, i) * times;
  }
  for (const auto& [type, area] : areas) all[type].push_back({thickness_of(part, view, type), unit, area});
}

GlassBodies::Typical GlassBodies::typical(VoxelType type) const {
  const auto found = by_type_.find(type);
  return found == by_type_.end() ? Typical{} : typical_of(found->second);
}

GlassBodies::Typical GlassBodies::typical_of_smooth(VoxelType type) const {
  const auto found = smooth_by_type_.find(type);
  return found == smooth_by_type_.end() ? Typical{} : typical_of(found->second);
}

GlassBodies::Typical GlassBodies::typical_of(std::vector<Seen> seen) {
  std::ranges::sort(seen, {}, &Seen::thickness);
  double area = 0.0;
  double units = 0.0;
  for (const Seen& each : seen) {
    area += each.area;
    units += each.area * each.unit;
  }
  QUOIN_ASSERT(!seen.empty(), "at least one body");
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
