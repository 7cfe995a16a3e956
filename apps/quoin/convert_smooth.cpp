#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include <glm/gtc/matrix_transform.hpp>

#include <quoin/io/smooth_files.h>
#include <quoin/io/smooth_scene.h>

#include "convert.h"
#include "interrupt.h"
#include "progress_bar.h"
#include "scene_warnings.h"
#include "stopwatch.h"

namespace quoin::tool {

namespace {

SmoothMeshOptions mesh_options(const ConvertOptions& options) {
  SmoothMeshOptions mesh;
  if (options.occlusion_off) mesh.occlusion.form = SmoothOcclusion::None;
  return mesh;
}

std::optional<float> simplify_error(const ConvertOptions& options) {
  if (!options.simplify) return std::nullopt;
  return static_cast<float>(*options.simplify);
}

Result<std::uint64_t> write_parts(std::span<const SmoothPart> parts, const FormatInfo& format,
                                  const ConvertOptions& options, const Progress& progress) {
  const SmoothFileOptions file{!options.occlusion_off};
  switch (format.format) {
    case FileFormat::Glb:
      return write_smooth_glb(parts, options.output, file, progress);
    case FileFormat::Gltf:
      return write_smooth_gltf(parts, options.output, file, progress);
    case FileFormat::Obj:
      return write_smooth_obj(parts, options.output, file, progress);
    case FileFormat::Ply:
      return write_ply(parts, options.output, file, progress);
    case FileFormat::Vox:
    case FileFormat::Scene:
    case FileFormat::Nifti:
    case FileFormat::Nrrd:
      break;
  }
  return fail(ErrorCode::Unsupported, "not a mesh format", options.output.string());
}

/// Counts and writes what has been meshed.
Status finish(std::span<const SmoothPart> parts, const ConvertOptions& options, const FormatInfo& format,
              ProgressBar& bar, Outcome& outcome) {
  Stopwatch watch;
  outcome.mesher = "smooth";
  for (const SmoothPart& part : parts) {
    outcome.triangles += static_cast<std::int64_t>(part.mesh.indices.size() / 3);
    outcome.vertices += static_cast<std::int64_t>(part.mesh.positions.size());
  }
  if (outcome.triangles == 0) outcome.warnings.emplace_back("nothing to draw");
  const bool is_gltf = format.format == FileFormat::Gltf;
  outcome.files = is_gltf ? smooth_gltf_files(parts, options.output) : std::vector{options.output};
  if (auto sound = check_companions(outcome.files, options); !sound) return sound;
  const auto bytes = write_parts(parts, format, options, bar.listener("writing"));
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  outcome.bytes = *bytes;
  outcome.seconds.write = watch.lap();
  return {};
}

/// The smooth mesher knows neither glass nor light.
void warn_of_looks(const Scene& scene, bool hidden, std::vector<std::string>& warnings) {
  std::set<GridHandle> drawn;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, hidden)) drawn.insert(instance.grid);
  }
  bool is_lost = false;
  for (const GridHandle grid : drawn) {
    for (const VoxelType type : scene.grids()[grid].grid.types()) {
      is_lost |= type != kAir && type < scene.types.size() && surface_class(scene.types[type]) != SurfaceClass::Opaque;
    }
  }
  if (is_lost) warnings.emplace_back("transparent and glowing voxels become plain, opaque surfaces");
}

Result<Volume> read_input(const ConvertOptions& options) {
  if (options.raw) return read_raw_volume(options.common.input, *options.raw);
  return read_volume(options.common.input);
}

/// Puts a volume into the file's unit: glTF's is the metre, the others have none.
void scale_to(const FormatInfo& format, const std::string& unit, SmoothPart& part) {
  if (format.format != FileFormat::Glb && format.format != FileFormat::Gltf) return;
  const double metres = metres_of_unit(unit).value_or(1.0);
  for (SmoothPlacement& placement : part.placements) {
    placement.world_from_mesh = glm::scale(glm::dmat4(1.0), DVec3(metres)) * placement.world_from_mesh;
  }
}

}  // namespace

Status convert_smoothly(const Scene& scene, const ConvertOptions& options, const FormatInfo& format, Outcome& outcome) {
  Stopwatch watch;
  ProgressBar bar;
  const bool hidden = options.common.load.hidden;
  const auto smooth = smooth_scene(scene, {mesh_options(options), simplify_error(options), hidden},
                                   options.common.threads, bar.listener("meshing"));
  if (!smooth) return tl::unexpected<Error>(smooth.error());
  outcome.simplify_error = smooth->simplify_error;
  outcome.seconds.mesh = watch.lap();
  warn_of_left_out(scene, hidden, outcome.warnings);
  warn_of_looks(scene, hidden, outcome.warnings);
  return finish(smooth->parts, options, format, bar, outcome);
}

Result<Outcome> convert_volume(const ConvertOptions& options, const FormatInfo& format) {
  Stopwatch watch;
  auto volume = read_input(options);
  if (!volume) return tl::unexpected<Error>(volume.error());
  Outcome outcome;
  outcome.is_volume = true;
  outcome.warnings = volume->warnings;
  outcome.seconds.read = watch.lap();
  catch_interrupts();
  ProgressBar bar;
  outcome.is_iso_found = !options.iso;
  outcome.iso = options.iso ? *options.iso : static_cast<double>(volume_threshold(*volume));
  SmoothVolumeOptions wanted;
  wanted.iso = static_cast<float>(*outcome.iso);
  wanted.mesh = mesh_options(options);
  wanted.simplify_error = simplify_error(options);
  auto smooth = smooth_volume(*volume, wanted, options.common.threads, bar.listener("meshing"));
  if (!smooth) return tl::unexpected<Error>(smooth.error());
  outcome.voxels = smooth->solid_samples;
  outcome.simplify_error = smooth->simplify_error;
  outcome.seconds.mesh = watch.lap();
  scale_to(format, volume->units, smooth->part);
  volume->values = {};
  if (auto done = finish({&smooth->part, 1}, options, format, bar, outcome); !done) {
    return tl::unexpected<Error>(done.error());
  }
  return outcome;
}

}  // namespace quoin::tool
