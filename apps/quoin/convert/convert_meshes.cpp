// Meshes of scenes, and files of meshes.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <quoin/io/mesh_file.h>
#include <quoin/io/vox.h>
#include <quoin/mesh/blocky.h>
#include <quoin/render/lit_meshes.h>
#include <quoin/scene/scene_meshes.h>

#include "convert/convert.h"

namespace quoin::tool {

namespace {

/// Meshes a grid as a closed surface for 3D printing. Adds the voxels whose shapes have parts without volume to `flat`.
Result<MeshPart> part_for_printing(const Scene& scene, GridHandle grid, MeshStats& stats, std::int64_t& flat) {
  std::int64_t flat_here = 0;
  auto surface = closed_surface(scene.grids()[grid].grid, scene.types, {}, &flat_here);
  if (!surface) return surface.error();
  flat += flat_here;
  const auto quads = static_cast<std::int64_t>(surface->positions.size() / 4);
  stats.faces_total += 6 * scene.grids()[grid].grid.voxel_count();
  stats.faces_visible += quads;
  stats.quads += quads;
  stats.triangles += static_cast<std::int64_t>(surface->indices.size() / 3);
  stats.vertices += static_cast<std::int64_t>(surface->positions.size());
  BlockyMesh mesh;
  mesh.surfaces[0] = std::move(*surface);
  return mesh_part({}, std::move(mesh));
}

/// Returns the file units per world unit that make the smallest voxels `voxel` file units long.
double scale_for_voxels(const Scene& scene, double voxel) {
  double least = std::numeric_limits<double>::infinity();
  for (const InstanceHandle handle : scene.instances().handles()) {
    least = std::min(least, scene.instances()[handle].voxel_size);
  }
  return std::isfinite(least) ? voxel / least : voxel;
}

/// Meshes the scene as blocks, writes it and fills in `outcome`.
Status convert_blockily(const Scene& scene, const SceneAnimation& animation, const ConvertOptions& options,
                        Outcome& outcome) {
  Stopwatch watch;
  ProgressBar bar(!options.is_one_of_many);
  outcome.mesher = options.mesher;
  const InstanceFilter filter = options.common.instances();
  std::int64_t flat = 0;
  BlockySceneOptions wanted;
  wanted.mesh = {outcome.mesher == Mesher::Greedy, !options.occlusion_off, options.watertight};
  wanted.instances = filter;
  wanted.atlas = options.is_atlas;
  if (format_for_writing(options.output)->can(FormatCapability::Printing)) {
    wanted.part_of = [&](GridHandle grid, MeshStats& stats) { return part_for_printing(scene, grid, stats, flat); };
  }
  const Progress progress = bar.listener("meshing");
  auto meshes = options.light ? mesh_lit_scene(scene, *options.light, wanted, options.common.threads, progress)
                              : mesh_scene(scene, wanted, options.common.threads, progress);
  if (!meshes) return meshes.error();
  if (options.animate) animation.animate(*meshes, options.frames_per_second);
  outcome.faces = {meshes->stats.faces_visible, meshes->stats.faces_total};
  outcome.seconds.mesh = watch.lap();
  warn_of_left_out(scene, filter, outcome.warnings);
  if (flat > 0) {
    outcome.warnings.push_back("plates without thickness, which have no volume to print, are left out in " +
                               with_thousands(flat) + " voxels");
  }
  add_lights(scene, options, *meshes, outcome.warnings);
  warn_of_data(voxels_with_data(scene), outcome.warnings);
  return write_meshes(*meshes, options, bar, outcome);
}

/// Reads all frames of a file; `first` holds frame 0.
Status read_frames(const LoadedScene& first, const ConvertOptions& options, SceneAnimation& animation) {
  constexpr std::int64_t kMaxFrames = 100'000;
  if (first.last_frame >= kMaxFrames) {
    return make_error(
        ErrorCode::LimitExceeded,
        std::to_string(first.last_frame + 1) + " frames exceed the limit of " + std::to_string(kMaxFrames),
        options.common.input.string());
  }
  const InstanceFilter filter = options.common.instances();
  if (auto added = animation.add(first.scene, filter); !added) return added;
  ProgressBar bar(!options.is_one_of_many);
  const Progress progress = bar.listener("frames");
  for (std::int64_t frame = 1; frame <= first.last_frame; ++frame) {
    auto scene = scene_at_frame(*first.source, static_cast<int>(frame));
    if (!scene) return scene.error();
    if (auto added = animation.add(*scene, filter); !added) return added;
    if (!progress(static_cast<double>(frame) / static_cast<double>(first.last_frame))) {
      return make_error(ErrorCode::Cancelled, "cancelled", options.common.input.string());
    }
  }
  return {};
}

/// Reads all frames of a file into `animation` and adds warnings about content it cannot show.
Status animate(const LoadedScene& loaded, const ConvertOptions& options, SceneAnimation& animation, Outcome& outcome) {
  if (loaded.last_frame == 0) {
    outcome.warnings.emplace_back(
        loaded.named_files.empty()
            ? "--animate has no effect: the file has one frame"
            : "--animate has no effect: only a .vox input is animated, not the .vox files of a scene");
  }
  // Hidden instances are not part of the animation.
  warn_of_left_out(loaded.scene, options.common.instances(), outcome.warnings);
  if (auto read = read_frames(loaded, options, animation); !read) return read;
  std::erase_if(outcome.warnings, [](const auto& each) { return each.starts_with("animated"); });
  return {};
}

/// Returns the given mesher, or the default: smooth if the scene has only fields and there is no atlas, else greedy.
Mesher mesher_for(const Scene& scene, const ConvertOptions& options) {
  if (options.mesher) return *options.mesher;
  const bool is_smooth = scene.voxel_count() == 0 && solid_samples(scene) > 0 && !options.is_atlas;
  return is_smooth ? Mesher::Smooth : Mesher::Greedy;
}

}  // namespace

Conversion convert_to_meshes(const ConvertOptions& options, LoadedScene& loaded, Outcome outcome, Stopwatch& watch) {
  ConvertOptions settled = options;
  settled.mesher = mesher_for(loaded.scene, options);
  if (Status fits = check_mesher_rules(options, *settled.mesher); !fits) return Conversion::wrong_usage(fits.error());
  if (options.voxel_mm) settled.scale = scale_for_voxels(loaded.scene, *options.voxel_mm);
  if (options.light && !loaded.scene.environment) loaded.scene.environment = Environment::natural();
  settled.cameras = loaded.cameras;
  SceneAnimation animation;
  if (options.animate) {
    if (Status done = animate(loaded, settled, animation, outcome); !done) return done.error();
    outcome.seconds.read += watch.lap();
  }
  const auto convert = settled.mesher == Mesher::Smooth ? convert_smoothly : convert_blockily;
  // Only .vox files are animated, and their models are always near their origins.
  const Status done = options.animate ? convert(animation.scene(), animation, settled, outcome)
                                      : convert(near_grids(loaded.scene), animation, settled, outcome);
  if (!done) return done.error();
  return outcome;
}

void add_lights(const Scene& scene, const ConvertOptions& options, SceneMeshes& meshes,
                std::vector<std::string>& warnings) {
  if (!options.lights) return warn_of_lamps(scene, warnings);
  meshes.lamps = scene.lamps;
  for (const FileCamera& each : options.cameras) {
    meshes.cameras.push_back({"camera " + std::to_string(each.number), each.camera});
  }
  const bool has_wide_spot = std::ranges::any_of(scene.lamps, [](const Lamp& lamp) {
    return lamp.kind == Lamp::Kind::Spot && lamp.outer_angle_radians > std::numbers::pi / 2.0;
  });
  if (has_wide_spot)
    warnings.emplace_back("lamp cones wider than 180 degrees are limited to 180 degrees, the maximum of glTF");
}

namespace {

MeshFileOptions mesh_file_options(const ConvertOptions& options, FileFormat format) {
  MeshFileOptions file;
  if (options.ao_as_attribute) file.occlusion_in = OcclusionIn::Attribute;
  if (options.is_atlas) file.textures_in = TexturesIn::Atlas;
  file.compress = options.compress;
  file.quantize = options.quantize;
  if (options.scale) file.scale = *options.scale;
  file.up = options.up.value_or(format_info(format).up);
  return file;
}

/// Returns the number of types of the meshes whose textures the file lacks.
std::size_t lost_textures(const SceneMeshes& meshes, FileFormat format) {
  if (!meshes.types.has_textures()) return 0;
  const bool has_blocks = can(format, FormatCapability::Faces);
  std::vector<bool> is_lost(meshes.types.size());
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      if (has_blocks && !view.has_albedo()) continue;
      for (const VoxelType type : view.types) {
        if (!meshes.types[type].faces.empty()) is_lost[type] = true;
      }
    }
  }
  return static_cast<std::size_t>(std::ranges::count(is_lost, true));
}

/// Warns of open edges in 3D printing files, of coordinates relative to an offset, and of textures that are left out.
void warn_of_meshes(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& file,
                    std::vector<std::string>& warnings) {
  if (can(format, FormatCapability::Printing)) {
    if (const std::uint64_t open = count_open_edges(meshes); open > 0) {
      warnings.push_back(with_thousands(static_cast<std::int64_t>(open)) +
                         " open edges: the mesh is not closed for printing");
    }
  }
  if (const std::size_t lost = lost_textures(meshes, format); lost > 0) {
    warnings.push_back("textures of types left out: " + std::to_string(lost));
  }
  if (const DVec3 offset = mesh_file_offset(meshes, format, file); offset != DVec3(0.0)) {
    warnings.push_back("coordinates in the file are relative to (" + number_for_people(offset.x) + ", " +
                       number_for_people(offset.y) + ", " + number_for_people(offset.z) +
                       "): floats cannot separate voxels this far from the origin");
  }
}

}  // namespace

Status write_meshes(SceneMeshes& meshes, const ConvertOptions& options, ProgressBar& bar, Outcome& outcome) {
  Stopwatch watch;
  for (MeshPart& part : meshes.parts) {
    if (part.name.empty() && !options.is_from_stream) part.name = stem_of_file(options.common.input);
  }
  outcome.meshes = meshes.stats;
  if (options.simplify && outcome.meshes.triangles > 0 && outcome.meshes.simplified_away == 0) {
    outcome.warnings.push_back(
        "--simplify " + digits_for_people(*options.simplify) +
        " removes no triangles: in a sample of the mesh, at most about 1 % could be removed within this "
        "error");
  }
  if (outcome.meshes.triangles == 0) outcome.warnings.emplace_back("the mesh is empty");
  const auto format = format_for_writing(options.output);
  if (!format) return format.error();
  const MeshFileOptions file = mesh_file_options(options, format->format);
  const auto files = mesh_files(meshes, options.output, file);
  if (!files) return files.error();
  outcome.files = *files;
  // The earlier check covers only OUT, not the files written next to it.
  for (const auto& each : *files) {
    if (auto kept = check_replaced(each, options.inputs, options.force); !kept) return kept;
  }
  warn_of_meshes(meshes, format->format, file, outcome.warnings);
  const auto bytes = write_mesh(meshes, options.output, file, bar.listener("writing"));
  if (!bytes) return bytes.error();
  outcome.bytes = *bytes;
  outcome.seconds.write = watch.lap();
  return {};
}

}  // namespace quoin::tool
