#include "convert/convert.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include <quoin/io/chunk_source.h>
#include <quoin/io/mesh_file.h>
#include <quoin/io/vox.h>
#include <quoin/mesh/closed_surface.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/render/lit_meshes.h>
#include <quoin/scene/near_grids.h>
#include <quoin/scene/volume_scene.h>
#include <quoin/store/world_import.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>

#include "command_files.h"
#include "commands.h"
#include "output.h"
#include "render/small_image.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

/// Meshes a grid as a closed surface for 3D printing.
Result<MeshPart> part_for_printing(const Scene& scene, GridHandle grid, MeshStats& stats) {
  auto surface = closed_surface(scene.grids()[grid].grid);
  if (!surface) return surface.error();
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
  BlockySceneOptions wanted;
  wanted.mesh = {outcome.mesher == Mesher::Greedy, !options.occlusion_off, options.watertight};
  wanted.instances = filter;
  wanted.atlas = options.is_atlas;
  if (format_for_writing(options.output)->can(FormatCapability::Printing)) {
    wanted.part_of = [&scene](GridHandle grid, MeshStats& stats) { return part_for_printing(scene, grid, stats); };
  }
  const Progress progress = bar.listener("meshing");
  auto meshes = options.light ? mesh_lit_scene(scene, *options.light, wanted, options.common.threads, progress)
                              : mesh_scene(scene, wanted, options.common.threads, progress);
  if (!meshes) return meshes.error();
  if (options.animate) animation.animate(*meshes, options.frames_per_second);
  outcome.faces = {meshes->stats.faces_visible, meshes->stats.faces_total};
  outcome.seconds.mesh = watch.lap();
  warn_of_left_out(scene, filter, outcome.warnings);
  add_lights(scene, options, *meshes, outcome.warnings);
  warn_of_data(voxels_with_data(scene), outcome.warnings);
  return write_meshes(*meshes, options, bar, outcome);
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

Status convert_to_meshes(const LoadedScene& loaded, const ConvertOptions& options, Stopwatch& watch, Outcome& outcome) {
  SceneAnimation animation;
  if (options.animate) {
    if (auto done = animate(loaded, options, animation, outcome); !done) return done;
    outcome.seconds.read += watch.lap();
  }
  const auto convert = options.mesher == Mesher::Smooth ? convert_smoothly : convert_blockily;
  // Only .vox files are animated, and their models are always near their origins.
  if (options.animate) return convert(animation.scene(), animation, options, outcome);
  return convert(near_grids(loaded.scene), animation, options, outcome);
}

/// Returns an error message if an option needs the smooth mesher, else "".
std::string find_blocks_error(const ConvertOptions& options) {
  if (options.has_field_occlusion) return "--ao-form, --ao-spread, --ao-offset and --ao-power need --mesher smooth";
  if (options.simplify) return "--simplify needs --mesher smooth";
  const bool is_of_smooth = options.smoothness || options.colours || options.separate_models;
  return is_of_smooth ? "--smoothness, --colours and --no-unite need --mesher smooth" : "";
}

/// Returns the given mesher, or the default: smooth if the scene has only fields and there is no atlas, else greedy.
Mesher mesher_for(const Scene& scene, const ConvertOptions& options) {
  if (options.mesher) return *options.mesher;
  const bool is_smooth = scene.voxel_count() == 0 && solid_samples(scene) > 0 && !options.is_atlas;
  return is_smooth ? Mesher::Smooth : Mesher::Greedy;
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

/// Reads a scene. A volume becomes a field; its surface value is stored in the outcome.
Result<LoadedScene> read_scene(const ConvertOptions& options, const LoadOptions& load, const OpenedInput& input,
                               Outcome& outcome) {
  ProgressBar bar(!options.is_one_of_many);
  const Progress progress = bar.listener("reading");
  if (!input.is_volume) return load_scene(input.file, load, options.common.threads, progress);
  const auto volume = read_input_volume(options.common, part_of(progress, 0.0, 0.5));
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

Result<Outcome> convert_scene(const ConvertOptions& options, const FormatInfo& format, const OpenedInput& input,
                              std::string& fault) {
  Stopwatch watch;
  LoadOptions load = options.common.load;
  load.keep_source = !format.can(FormatCapability::Meshes) || options.animate;
  constexpr std::size_t kTypesOfVox = 255;
  if (format.format == FileFormat::Vox) {
    load.mesh.max_types = std::min(load.mesh.max_types.value_or(kTypesOfVox), kTypesOfVox);
  }
  Outcome outcome;
  auto loaded = read_scene(options, load, input, outcome);
  if (!loaded) return loaded.error();
  outcome.content = {loaded->scene.voxel_count(), solid_samples(loaded->scene)};
  outcome.warnings = std::move(loaded->warnings);
  outcome.seconds.read = watch.lap();
  catch_interrupts();
  if (format.can(FormatCapability::Meshes)) {
    ConvertOptions settled = options;
    settled.mesher = mesher_for(loaded->scene, options);
    if (options.voxel_mm) settled.scale = scale_for_voxels(loaded->scene, *options.voxel_mm);
    if (settled.light && !loaded->scene.environment) loaded->scene.environment = Environment::natural();
    settled.cameras = loaded->cameras;
    fault = settled.mesher == Mesher::Smooth ? "" : find_blocks_error(settled);
    if (!fault.empty()) return make_error(ErrorCode::InvalidArgument, fault, options.common.input.string());
    if (auto done = convert_to_meshes(*loaded, settled, watch, outcome); !done) return done.error();
    return outcome;
  }
  prune_unrequested(options, format, *loaded, outcome.warnings);
  fit_voxels(options, format, input.is_volume, *loaded, outcome.warnings);
  outcome.content = {loaded->scene.voxel_count(), solid_samples(loaded->scene)};
  outcome.files = {options.output};
  outcome.faces = count_faces(loaded->scene, options.common.instances(), options.common.threads);
  ProgressBar bar(!options.is_one_of_many);
  const auto saved = save(*loaded, format, options, bar);
  if (!saved) return saved.error();
  outcome.bytes = saved->bytes;
  outcome.warnings.insert(outcome.warnings.end(), saved->warnings.begin(), saved->warnings.end());
  outcome.seconds.write = watch.lap();
  return outcome;
}

/// Renders the area around the spawn of a source as the thumbnail of the converted world.
Status add_thumbnail(const ChunkSource& source, const ConvertOptions& options) {
  constexpr int kRadius = 4;
  const Threads threads = options.common.threads;
  const auto stop = [](double) { return !was_interrupted(); };
  const auto around = load_source(source, chunks_around_spawn(source, kRadius), threads, stop);
  if (!around) return around.error();
  WorldChanges changes;
  if (auto done = put_thumbnail(around->scene, threads, changes); !done) return done;
  if (changes.empty()) return {};
  auto world = WorldStore::open(options.output, WorldAccess::Write, threads);
  if (!world) return world.error();
  if (const auto ticket = world->save(std::move(changes)); !ticket) return ticket.error();
  return world->flush();
}

/// Converts a world of any size chunk by chunk to a .quoin file.
Result<Outcome> convert_by_chunks(const ConvertOptions& options) {
  Stopwatch watch;
  const auto source = open_chunk_source(options.common.input, options.common.load.dimension);
  if (!source) return source.error();
  catch_interrupts();
  Outcome outcome;
  outcome.files = {options.output};
  outcome.seconds.read = watch.lap();
  ProgressBar bar(!options.is_one_of_many);
  const auto imported = import_world(**source, options.output, options.common.threads, bar.listener("converting"));
  if (!imported) return imported.error();
  outcome.content.voxels = static_cast<std::int64_t>(imported->voxels);
  outcome.bytes = imported->bytes;
  if (auto done = add_thumbnail(**source, options); !done) return done.error();
  outcome.warnings = (*source)->info().warnings;
  for (const std::string& line : imported->broken) outcome.warnings.push_back("left out: " + line);
  if (!imported->skipped_blocks.empty()) outcome.warnings.push_back(text_of_skipped_blocks(imported->skipped_blocks));
  if (!imported->guessed.empty()) {
    std::string names;
    for (const std::string& name : imported->guessed) names += (names.empty() ? "" : ", ") + name;
    outcome.warnings.push_back("unknown blocks, with an appearance guessed from their names: " + names);
  }
  outcome.seconds.write = watch.lap();
  if (Status counted = count_faces_of_output(options, outcome); !counted) return counted.error();
  return outcome;
}

std::string mesh_text(const Outcome& outcome) {
  const std::string size = with_thousands(outcome.meshes.triangles) + " triangles, " +
                           with_thousands(outcome.meshes.vertices) + " vertices\n";
  if (outcome.mesher == Mesher::Smooth) return "Mesh: " + size;
  return "Mesh: " + with_thousands(outcome.meshes.quads) + " quads, " + size;
}

std::string outcome_text(const Outcome& outcome) {
  std::string text = (outcome.is_volume ? "Solid samples: " + with_thousands(outcome.content.solid_samples)
                                        : content_text(outcome.content)) +
                     "\n";
  if (outcome.faces.total > 0) text += to_string(outcome.faces) + "\n";
  const bool is_field = outcome.content.voxels == 0 && outcome.content.solid_samples > 0;
  if (is_field && outcome.mesher) text += "Faces: " + with_thousands(outcome.meshes.triangles) + " triangles\n";
  if (outcome.iso) {
    text += "Iso: " + digits_for_people(*outcome.iso) +
            (outcome.is_iso_found ? " (between the two groups of values; set another with --iso)\n" : "\n");
  }
  if (outcome.mesher) text += mesh_text(outcome);
  if (outcome.meshes.simplify_error > 0)
    text += "Simplified: error up to " + digits_for_people(outcome.meshes.simplify_error) + " voxels\n";
  const double seconds = outcome.seconds.read + outcome.seconds.mesh + outcome.seconds.write;
  text += "Wrote ";
  for (const auto& file : outcome.files) text += file.string() + ", ";
  return text + bytes_for_people(outcome.bytes) + " in " + number_for_people(seconds) + " s\n";
}

/// Returns true if the input is certainly meshed as blocks. Does not read its content, which may take long.
bool is_surely_blocks(const ConvertOptions& options, const OpenedInput& input) {
  if (options.mesher) return options.mesher != Mesher::Smooth;
  const LoadOptions& load = options.common.load;
  if (input.is_volume || load.mesh.as_field || (load.heights && load.heights->as_field)) return false;
  const std::optional<FileFormat>& format = input.file.format;
  return format && format != FileFormat::Scene && format != FileFormat::World && format != FileFormat::Vdb;
}

/// Returns an error message if an option does not fit the kind of input, else "".
std::string find_usage_error(const ConvertOptions& options, const OpenedInput& input) {
  const bool is_volume = input.is_volume;
  if (options.simplify && !can_simplify()) {
    return "cannot use --simplify: this build has no meshoptimizer (libmeshoptimizer-dev in Debian)";
  }
  if (options.mesh_only && is_surely_blocks(options, input)) {
    if (std::string fault = find_blocks_error(options); !fault.empty()) return fault;
  }
  if (is_volume && options.mesher && options.mesher != Mesher::Smooth) {
    return "cannot use --mesher " + name_of(*options.mesher) + ": the input is a volume; use --mesher smooth";
  }
  if (is_volume && options.light) return "cannot use --light: the input is a volume, not voxels or a field";
  if (is_volume && options.is_atlas) return "cannot use --texture atlas: the input is a volume, not voxels";
  if (is_volume && options.animate) return "cannot use --animate: the input is a volume, not a .vox file";
  if (is_volume && (options.smoothness || options.colours || options.separate_models)) {
    return "cannot use --smoothness, --colours or --no-unite: the input is a volume, not voxels";
  }
  const LoadOptions& load = options.common.load;
  if (is_volume)
    return load.show_hidden || load.frame != 0 ? "cannot use --hidden or --frame: the input is a volume, not voxels"
                                               : "";
  return options.iso && !input.heeds_iso() ? "cannot use --iso: the input holds voxels, not a volume" : "";
}

/// Returns an error message if an option needs triangles and the input has none, else "".
std::string find_mesh_input_error(const ConvertOptions& options, const OpenedInput& input, const FormatInfo& to) {
  if (options.mesh_input.empty()) return "";
  const std::optional<FileFormat>& format = input.file.format;
  // An unrecognized file may be a triangle mesh. The reader reports why it is not recognized.
  if (!format || can(format, FormatCapability::Meshes)) return "";
  const bool may_have_field = input.heeds_iso() || format == FileFormat::Scene || format == FileFormat::World;
  if (options.mesh_input == "--solid" && may_have_field) {
    return to.can(FormatCapability::Meshes) ? "cannot use --solid: it converts fields to voxels, but " +
                                                  std::string(to.extension) + " is a mesh format"
                                            : "";
  }
  return "cannot use " + options.mesh_input + ": it needs a triangle mesh, and the input is " +
         std::string(format->name());
}

Result<Outcome> convert(const ConvertOptions& options, const FormatInfo& format, const OpenedInput& input,
                        std::string& fault) {
  return input.is_volume && format.can(FormatCapability::Meshes) ? convert_volume(options, format)
                                                                 : convert_scene(options, format, input, fault);
}

/// Replaces standard streams ("-") by temporary files. Returns a usage error, or "".
Result<std::string> open_streams(ConvertOptions& options, const ManyOptions& many, StandardStreams& streams) {
  if (options.output == kStandardStream) {
    const auto format = format_for_writing("file." + many.to);
    if (many.to.empty() || !format)
      return "writing to standard output needs --to FORMAT, one of " + extensions_with(FormatCapability::Write);
    if (format->format == FileFormat::Gltf || format->format == FileFormat::Obj) {
      return "cannot write " + std::string(format->extension) + " to standard output: it consists of several files";
    }
    if (options.common.json) return std::string("cannot use --json: OUT is standard output");
    auto file = streams.output(std::string(format->extension));
    if (!file) return file.error();
    options.output = *file;
  }
  if (Status read = streams.take_input(options.common.input); !read) return read.error();
  return std::string();
}

/// Fails if the input is not in the format of --from.
Status check_input(const ConvertOptions& options, const OpenedInput& input) {
  if (options.from.empty()) return {};
  const std::string name = input.file.format ? std::string(input.file.format->name()) : "unknown";
  if (name == options.from) return {};
  return make_error(ErrorCode::BadFormat, "the format is " + name + ", not " + options.from,
                    options.common.input.string());
}

WatchedWork run_one(ConvertOptions& options, const ManyOptions& many) {
  const bool is_to_stream = options.output == kStandardStream;
  StandardStreams streams;
  WatchedWork work;
  if (options.watch) work.read = files_read(options.common.input, options.common.load.sidecar_files);
  const auto ended = [&](int status) {
    work.status = status;
    return work;
  };
  const auto failed = [&](const Error& error) {
    const Error named = streams.named(error);
    streams.remove();
    die_if_interrupted();
    print_error(named);
    return ended(kFailed);
  };
  const auto misused = [&](const std::string& fault) {
    print_error(fault);
    return ended(kWrongUsage);
  };
  options.is_from_stream = options.common.input == kStandardStream;
  if (is_to_stream || options.is_from_stream) catch_interrupts();
  const auto streams_error = open_streams(options, many, streams);
  if (!streams_error) return failed(streams_error.error());
  const auto format = format_for_writing(options.output);
  std::string fault = !streams_error->empty() ? *streams_error
                      : !format               ? to_string(format.error())
                                              : find_format_error(options, *format);
  if (!fault.empty()) return misused(fault);
  options.inputs = FileSet({&options.common.input, 1});
  const auto outcome = convert_file(options, *format, fault);
  if (!fault.empty()) return misused(fault);
  if (!outcome) return failed(outcome.error());
  work.written = outcome->files;
  if (options.common.json) return ended(print_json(outcome_json(*outcome)));
  print_warnings(outcome->warnings);
  if (!is_to_stream) return ended(print_summary(outcome_text(*outcome)));
  if (Status written = streams.write_output(); !written) return failed(written.error());
  return ended(kDone);
}

}  // namespace

int run_convert(ConvertOptions& options, const ManyOptions& many) {
  Converted done;
  const auto work = [&] { return many.inputs.empty() ? run_one(options, many) : run_many(options, many, done); };
  if (!options.watch) return work().status;
  const SidecarFiles allowed = options.common.load.sidecar_files;
  return watch(many.inputs.empty() ? files_read(options.common.input, allowed) : many.inputs, work);
}

/// Returns the number of block faces. For fields returns the number of triangles, or null without a mesh.
Json faces_json(const Outcome& outcome, std::int64_t of_blocks) {
  const bool is_field = outcome.content.voxels == 0 && outcome.content.solid_samples > 0;
  if (!is_field) return of_blocks;
  return outcome.mesher ? Json(outcome.meshes.triangles) : Json();
}

Json outcome_json(const Outcome& outcome) {
  Json files = Json::array();
  for (const auto& file : outcome.files) files.push_back(file.string());
  return {
      {"voxels", outcome.is_volume ? outcome.content.solid_samples : outcome.content.voxels},
      {"solid_samples", outcome.content.solid_samples},
      {"mesher", outcome.mesher ? Json(name_of(*outcome.mesher)) : Json()},
      {"iso", outcome.iso ? Json(*outcome.iso) : Json()},
      {"faces_visible", faces_json(outcome, outcome.faces.visible)},
      {"faces_total", faces_json(outcome, outcome.faces.total)},
      {"quads", outcome.meshes.quads},
      {"triangles", outcome.meshes.triangles},
      {"vertices", outcome.meshes.vertices},
      {"simplify_error", outcome.meshes.simplify_error},
      {"bytes", outcome.bytes},
      {"files", files},
      {"seconds", {{"read", outcome.seconds.read}, {"mesh", outcome.seconds.mesh}, {"write", outcome.seconds.write}}},
      {"warnings", outcome.warnings}};
}

std::string find_format_error(const ConvertOptions& options, const FormatInfo& format) {
  if (options.voxel_mm && !format.can(FormatCapability::Printing)) {
    return "--voxel-mm needs .stl or .3mf; use --scale for other mesh formats";
  }
  if (!format.can(FormatCapability::Meshes)) {
    if (!options.mesh_only) return "";
    return "--mesher, --no-ao, --ao-..., --watertight, --smoothness, --colours, --no-unite, --simplify, "
           "--scale, --up, --texture, --light, --lights, --animate, --compress and --quantize need a mesh format; " +
           (options.output.empty() ? std::string(format.extension) : options.output.string()) + " is not one";
  }
  if (options.voxel_mm && options.scale) return "--voxel-mm and --scale cannot be used together";
  const std::tuple<bool, FormatCapability, const char*> needs[] = {
      {options.ao_as_attribute, FormatCapability::OcclusionAttribute, "--ao-attribute"},
      {options.is_atlas, FormatCapability::Textures, "--texture atlas"},
      {options.lights, FormatCapability::Lamps, "--lights"},
      {options.light.has_value(), FormatCapability::VertexLight, "--light"},
      {options.animate, FormatCapability::Animation, "--animate"},
      {options.compress, FormatCapability::Compression, "--compress"},
      {options.quantize, FormatCapability::Compression, "--quantize"},
  };
  for (const auto& [is_given, capability, option] : needs) {
    if (!is_given) continue;
    if (const Status able = check_capability(format.format, capability, option); !able) return able.error().message;
  }
  return "";
}

Result<Outcome> convert_file(const ConvertOptions& options, const FormatInfo& format, std::string& fault) {
  const auto input = open_input(options.common.input, options.common.load);
  if (!input) return input.error();
  if (Status sound = check_input(options, *input); !sound) return sound.error();
  fault = find_usage_error(options, *input);
  if (fault.empty() && !options.is_one_of_many) fault = find_mesh_input_error(options, *input, format);
  if (!fault.empty()) return make_error(ErrorCode::InvalidArgument, fault, options.common.input.string());
  if (auto kept = check_replaced(options.output, options.inputs, options.force); !kept) return kept.error();
  if (options.is_one_of_many) {
    if (auto made = make_folder_of(options.output); !made) return made.error();
  }
  if (auto writable = check_outputs({options.output}); !writable) return writable.error();
  const std::optional<FileFormat>& from = input->file.format;
  if (format.format == FileFormat::World && can(from, FormatCapability::Chunks)) return convert_by_chunks(options);
  if (from == FileFormat::World && format.format == FileFormat::World) return copy_world_file(options);
  if (from == FileFormat::World && format.can(FormatCapability::Meshes) && meshes_by_chunks(options)) {
    auto meshed = mesh_world_file(options);
    if (!meshed) return meshed.error();
    if (*meshed) return std::move(**meshed);
  }
  return convert(options, format, *input, fault);
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
  file.compress = options.compress;
  file.quantize = options.quantize;
  if (options.scale) file.scale = *options.scale;
  file.up = options.up.value_or(format_info(format).up);
  return file;
}

/// Warns of open edges in 3D printing files and of coordinates relative to an offset.
void warn_of_meshes(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& file,
                    std::vector<std::string>& warnings) {
  if (can(format, FormatCapability::Printing)) {
    if (const std::uint64_t open = count_open_edges(meshes); open > 0) {
      warnings.push_back(with_thousands(static_cast<std::int64_t>(open)) +
                         " open edges: the mesh is not closed for printing");
    }
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
  const auto files = mesh_files(meshes, options.output);
  if (!files) return files.error();
  outcome.files = *files;
  // The earlier check covers only OUT, not the files written next to it.
  for (const auto& file : *files) {
    if (auto kept = check_replaced(file, options.inputs, options.force); !kept) return kept;
  }
  const auto format = format_for_writing(options.output);
  if (!format) return format.error();
  const MeshFileOptions file = mesh_file_options(options, format->format);
  warn_of_meshes(meshes, format->format, file, outcome.warnings);
  const auto bytes = write_mesh(meshes, options.output, file, bar.listener("writing"));
  if (!bytes) return bytes.error();
  outcome.bytes = *bytes;
  outcome.seconds.write = watch.lap();
  return {};
}

}  // namespace quoin::tool
