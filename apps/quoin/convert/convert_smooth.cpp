#include <algorithm>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

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

}  // namespace quoin::tool
