#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include <quoin/grid/voxel_field.h>
#include <quoin/render/lit_meshes.h>

#include "commands.h"
#include "convert/convert.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

SmoothMeshOptions mesh_options(const ConvertOptions& options) {
  SmoothMeshOptions mesh;
  mesh.occlusion = options.field_occlusion;
  if (options.occlusion_off) mesh.occlusion.method = SmoothOcclusion::None;
  return mesh;
}

std::optional<float> simplify_error(const ConvertOptions& options) {
  if (!options.simplify) return std::nullopt;
  return static_cast<float>(*options.simplify);
}

SmoothSceneOptions scene_options(const ConvertOptions& options) {
  SmoothSceneOptions wanted;
  wanted.mesh.occlusion = mesh_options(options).occlusion;
  if (options.smoothness) wanted.mesh.smoothness = static_cast<float>(*options.smoothness);
  wanted.mesh.colours = options.colours.value_or(wanted.mesh.colours);
  wanted.unite = !options.separate_models && !options.animate;
  wanted.simplify_error = simplify_error(options);
  wanted.instances = options.common.instances();
  return wanted;
}

/// Warns if the output loses glow or transparency: outside glTF, vertex colours have no emission, and .obj and .ply
/// have no alpha.
void warn_of_looks(const Scene& scene, const ConvertOptions& options, std::vector<std::string>& warnings) {
  bool is_lost = false;
  bool is_transparent = false;
  for (const GridHandle grid : drawn_grids(scene, options.common.instances())) {
    for (const VoxelType type : scene.grids()[grid].grid.types()) {
      is_lost |= type != kAir && type < scene.types.size() && scene.types[type].emission > 0.0F;
      is_transparent |= scene.types.is_transparent(type);
    }
  }
  const std::string extension = options.output.extension().string();
  const bool has_alpha = extension != ".obj" && extension != ".ply";
  if (is_transparent && !has_alpha) warnings.push_back("transparent voxels look opaque in " + extension);
  const auto format = format_for_writing(options.output);
  const bool keeps_emission = format && format->can(FormatCapability::Lamps) && !options.light;
  if (is_lost && !keeps_emission) warnings.emplace_back("glowing voxels become surfaces that do not glow");
}

/// Scales a volume to metres for glTF. The other formats have no unit.
void scale_to(const FormatInfo& format, const std::string& unit, SceneMeshes& meshes) {
  if (!format.can(FormatCapability::Metres)) return;
  const double metres = metres_of_unit(unit).value_or(1.0);
  for (MeshPlacement& placement : meshes.placements) {
    placement.world_from_part = glm::scale(glm::dmat4(1.0), DVec3(metres)) * placement.matrix();
  }
}

}  // namespace

Status convert_smoothly(const Scene& scene, const SceneAnimation& animation, const ConvertOptions& options,
                        Outcome& outcome) {
  Stopwatch watch;
  ProgressBar bar(!options.is_one_of_many);
  const InstanceFilter filter = options.common.instances();
  auto meshes = mesh_scene_smoothly(scene, scene_options(options), options.common.threads, bar.listener("meshing"));
  if (!meshes) return meshes.error();
  if (options.light) {
    if (Status lit = light_meshes(scene, *options.light, *meshes, options.common.threads); !lit) return lit;
  }
  if (options.animate) animation.animate(*meshes, options.frames_per_second);
  outcome.mesher = Mesher::Smooth;
  outcome.faces = count_faces(scene, filter, options.common.threads);
  outcome.seconds.mesh = watch.lap();
  warn_of_left_out(scene, filter, outcome.warnings);
  add_lights(scene, options, *meshes, outcome.warnings);
  warn_of_data(voxels_with_data(scene), outcome.warnings);
  warn_of_looks(scene, options, outcome.warnings);
  return write_meshes(*meshes, options, bar, outcome);
}

Result<Outcome> convert_volume(const ConvertOptions& options, const FormatInfo& format, const DetectedFile& file) {
  Stopwatch watch;
  auto volume = [&] {
    ProgressBar bar(!options.is_one_of_many);
    return read_input_volume(options.common, file, bar.listener("reading"));
  }();
  if (!volume) return volume.error();
  Outcome outcome;
  outcome.is_volume = true;
  outcome.mesher = Mesher::Smooth;
  outcome.warnings = volume->warnings;
  outcome.seconds.read = watch.lap();
  catch_interrupts();
  ProgressBar bar(!options.is_one_of_many);
  const auto iso = surface_value(*volume, options.iso ? std::optional(static_cast<float>(*options.iso)) : std::nullopt);
  if (!iso) return make_error(iso.error().code, iso.error().message, options.common.input.string());
  outcome.is_iso_found = !options.iso && volume->min < volume->max;
  outcome.iso = options.iso ? *options.iso : static_cast<double>(*iso);
  VolumeMeshOptions wanted;
  wanted.iso = *iso;
  wanted.mesh = mesh_options(options);
  wanted.simplify_error = simplify_error(options);
  auto meshes = mesh_volume(*volume, wanted, options.common.threads, bar.listener("meshing"));
  if (!meshes) return meshes.error();
  outcome.content.solid_samples = meshes->stats.solid_samples;
  outcome.seconds.mesh = watch.lap();
  scale_to(format, volume->units, *meshes);
  volume->values = {};
  if (auto done = write_meshes(*meshes, options, bar, outcome); !done) return done.error();
  return outcome;
}

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
