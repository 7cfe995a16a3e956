#include <quoin/io/smooth_scene.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

#include <quoin/grid/voxel_field.h>
#include <quoin/io/scene_meshes.h>
#include <quoin/io/volume_field.h>
#include <quoin/mesh/simplify.h>

#include "io/placement.h"

namespace quoin {

namespace {

/// A listener for the stretch from `begin` to `end` of another's work.
Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](double fraction) { return whole(begin + fraction * (end - begin)); };
}

/// Meshes and, where that is asked for, simplifies; `reached` becomes the largest error so far.
Result<SmoothMesh> surface_of(const DensityGrid& field, const VoxelRegistry& types, const SmoothMeshOptions& options,
                              std::optional<float> simplify_error, float& reached, Threads threads,
                              const Progress& progress) {
  auto mesh = build_smooth_mesh(field, types, options, threads, progress);
  if (!mesh || !simplify_error) return mesh;
  const auto error = simplify_smooth_mesh(*mesh, *simplify_error);
  if (!error) return tl::unexpected<Error>(error.error());
  reached = std::max(reached, *error);
  return mesh;
}

/// The placements of every grid that is drawn.
std::map<GridHandle, std::vector<SmoothPlacement>> placements_of(const Scene& scene, bool hidden) {
  std::map<GridHandle, std::vector<SmoothPlacement>> placements;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, hidden)) {
      placements[instance.grid].push_back({instance.name, world_from_pivot(instance)});
    }
  }
  return placements;
}

}  // namespace

Result<SmoothScene> smooth_scene(const Scene& scene, const SmoothSceneOptions& options, Threads threads,
                                 const Progress& progress) {
  if (auto sound = check_placements(scene, options.hidden); !sound) return tl::unexpected<Error>(sound.error());
  SmoothScene smooth;
  auto placements = placements_of(scene, options.hidden);
  const auto count = static_cast<double>(placements.size());
  for (auto& [handle, places] : placements) {
    const SceneGrid& grid = scene.grids()[handle];
    const auto done = static_cast<double>(smooth.parts.size());
    auto mesh = surface_of(field_from_grid(grid.grid, threads), scene.types, options.mesh, options.simplify_error,
                           smooth.simplify_error, threads, part_of(progress, done / count, (done + 1.0) / count));
    if (!mesh) return tl::unexpected<Error>(mesh.error());
    // The field's sample is the voxel's centre.
    smooth.parts.push_back({grid.name, std::move(*mesh), grid.pivot - 0.5, std::move(places)});
  }
  return smooth;
}

Result<SmoothVolume> smooth_volume(const Volume& volume, const SmoothVolumeOptions& options, Threads threads,
                                   const Progress& progress) {
  constexpr double kFieldShare = 0.4;
  VoxelRegistry types;
  VoxelProperties look;
  look.name = volume.name;
  look.colour = options.colour;
  const auto material = types.add(look);
  if (!material) return tl::unexpected<Error>(material.error());
  const auto field = field_from_volume(volume, {options.iso, *material}, threads, part_of(progress, 0.0, kFieldShare));
  if (!field) return tl::unexpected<Error>(field.error());
  SmoothVolume smooth;
  smooth.solid_samples = field->solid_count();
  auto mesh = surface_of(*field, types, options.mesh, options.simplify_error, smooth.simplify_error, threads,
                         part_of(progress, kFieldShare, 1.0));
  if (!mesh) return tl::unexpected<Error>(mesh.error());
  smooth.part = {volume.name, std::move(*mesh), {}, {{volume.name, volume.world_from_voxel}}};
  return smooth;
}

std::optional<double> metres_of_unit(std::string_view unit) {
  struct Unit {
    std::string_view symbol, name, plural;
    double metres;
  };
  constexpr std::array kUnits = {Unit{"m", "meter", "meters", 1.0},
                                 Unit{"m", "metre", "metres", 1.0},
                                 Unit{"cm", "centimeter", "centimeters", 1e-2},
                                 Unit{"cm", "centimetre", "centimetres", 1e-2},
                                 Unit{"mm", "millimeter", "millimeters", 1e-3},
                                 Unit{"mm", "millimetre", "millimetres", 1e-3},
                                 Unit{"um", "micrometer", "micrometers", 1e-6},
                                 Unit{"um", "micrometre", "micrometres", 1e-6},
                                 Unit{"\u00B5m", "micron", "microns", 1e-6},
                                 Unit{"nm", "nanometer", "nanometers", 1e-9},
                                 Unit{"nm", "nanometre", "nanometres", 1e-9}};
  for (const Unit& known : kUnits) {
    if (unit == known.symbol || unit == known.name || unit == known.plural) return known.metres;
  }
  return std::nullopt;
}

}  // namespace quoin
