#include <algorithm>

#include <quoin/io/vox.h>
#include <quoin/scene/volume_scene.h>
#include <quoin/store/world_saver.h>

#include "convert/convert.h"
#include "render/thumbnail.h"

namespace quoin::tool {

namespace {

/// Returns the options for reading a scene that is written to `format`.
LoadOptions load_options(const ConvertOptions& options, const FormatInfo& format) {
  constexpr std::size_t kTypesOfVox = 255;
  LoadOptions load = options.common.load;
  load.keep_source = !format.can(FormatCapability::Meshes) || options.animate;
  if (format.format == FileFormat::Vox) {
    load.mesh.max_types = std::min(load.mesh.max_types.value_or(kTypesOfVox), kTypesOfVox);
  }
  return load;
}

/// Reads a scene. A volume becomes a field; its surface value is stored in the outcome.
Result<LoadedScene> read_scene(const ConvertOptions& options, const LoadOptions& load, const OpenedInput& input,
                               Outcome& outcome) {
  ProgressBar bar(!options.is_one_of_many);
  const Progress progress = bar.listener("reading");
  if (!input.is_volume) return load_scene(input.file, load, options.common.threads, progress);
  const auto volume = read_input_volume(options.common, input.file, part_of(progress, 0.0, 0.5));
  if (!volume) return volume.error();
  const auto iso = surface_value(*volume, load.iso);
  if (!iso) return make_error(iso.error().code, iso.error().message, options.common.input.string());
  outcome.is_iso_found = !load.iso && volume->min < volume->max;
  outcome.iso = options.iso ? *options.iso : static_cast<double>(*iso);
  VolumeSceneOptions wanted;
  wanted.iso = *iso;
  auto scene = scene_from_volume(*volume, wanted, options.common.threads, part_of(progress, 0.5, 1.0));
  if (!scene) return make_error(scene.error().code, scene.error().message, options.common.input.string());
  LoadedScene loaded;
  loaded.scene = std::move(*scene);
  loaded.format = volume->format;
  loaded.warnings = volume->warnings;
  return loaded;
}

/// From .vox to .vox all content is kept, so the warnings of the reader do not apply. With --frame only that frame is
/// written, and the warnings name the content that is left out.
void prune_unrequested(const ConvertOptions& options, const FormatInfo& format, LoadedScene& loaded,
                       std::vector<std::string>& warnings) {
  if (loaded.source == nullptr || format.format != FileFormat::Vox) return;
  if (!options.common.takes_frame) {
    warnings.clear();
    return;
  }
  for (const std::string& line : source_only_features(*loaded.source)) {
    warnings.push_back("left out because of --frame: " + line);
  }
  loaded.source = nullptr;
}

/// Converts a scene to the features of a voxel format.
void fit_voxels(const ConvertOptions& options, const FormatInfo& format, bool is_volume, LoadedScene& loaded,
                std::vector<std::string>& warnings) {
  const bool is_scan = is_volume || loaded.format == "vdb";
  const bool only_voxels = holds_only_voxels(format);
  if (only_voxels || options.as_voxels) make_voxels_of_fields(loaded.scene, options.common.threads, warnings);
  if (is_scan && only_voxels) turn_by_quarters(loaded.scene, warnings);
  const bool keeps_scale = format.format == FileFormat::Scene || format.format == FileFormat::World;
  const bool is_from_triangles = std::ranges::any_of(file_formats(), [&](const FormatInfo& info) {
    return info.name() == loaded.format && info.can(FormatCapability::Meshes);
  });
  const bool may_have_size = is_from_triangles ? !keeps_scale : is_scan && only_voxels;
  if (may_have_size) normalise_scale(loaded.scene, format, warnings);
}

Result<SavedScene> save(const LoadedScene& loaded, const FormatInfo& format, const ConvertOptions& options,
                        ProgressBar& bar) {
  const Threads threads = options.common.threads;
  const Progress progress = bar.listener("writing");
  if (format.format != FileFormat::World) return save_scene(loaded, options.output, threads, progress);
  WorldChanges more;
  if (auto done = put_thumbnail(loaded.scene, threads, more); !done) return done.error();
  return write_world(loaded, options.output, threads, progress, std::move(more));
}

/// Writes the scene to a format that is no mesh format, and completes `outcome`.
Result<Outcome> convert_to_voxels(const ConvertOptions& options, const FormatInfo& format, bool is_volume,
                                  LoadedScene& loaded, Outcome outcome, Stopwatch& watch) {
  prune_unrequested(options, format, loaded, outcome.warnings);
  fit_voxels(options, format, is_volume, loaded, outcome.warnings);
  outcome.content = {loaded.scene.voxel_count(), solid_samples(loaded.scene)};
  outcome.files = {options.output};
  outcome.faces = count_faces(loaded.scene, options.common.instances(), options.common.threads);
  ProgressBar bar(!options.is_one_of_many);
  const auto saved = save(loaded, format, options, bar);
  if (!saved) return saved.error();
  outcome.bytes = saved->bytes;
  outcome.warnings.insert(outcome.warnings.end(), saved->warnings.begin(), saved->warnings.end());
  outcome.seconds.write = watch.lap();
  return outcome;
}

}  // namespace

Conversion convert_scene(const ConvertOptions& options, const FormatInfo& format, const OpenedInput& input) {
  Stopwatch watch;
  Outcome outcome;
  auto loaded = read_scene(options, load_options(options, format), input, outcome);
  if (!loaded) return loaded.error();
  outcome.content = {loaded->scene.voxel_count(), solid_samples(loaded->scene)};
  outcome.warnings = std::move(loaded->warnings);
  outcome.seconds.read = watch.lap();
  catch_interrupts();
  if (format.can(FormatCapability::Meshes)) return convert_to_meshes(options, *loaded, std::move(outcome), watch);
  return convert_to_voxels(options, format, input.is_volume, *loaded, std::move(outcome), watch);
}

}  // namespace quoin::tool
