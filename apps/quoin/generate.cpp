#include <memory>

#include <quoin/io/formats.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/store/world_saver.h>
#include <quoin/stream/streamed_world.h>
#include <quoin/terrain/terrain.h>

#include "command_files.h"
#include "commands.h"
#include "options.h"
#include "output.h"
#include "render/thumbnail.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

/// The most voxels that fit into a .vox file.
constexpr std::int64_t kMaxVoxels = std::int64_t{1} << 31;

struct GenerateOptions {
  std::filesystem::path output;
  bool is_smooth = false;
  bool is_endless = false;  ///< an unbounded world, generated around the origin
  bool force = false;
  TerrainOptions terrain;
  SmoothTerrainOptions smooth;  ///< additional options of smooth terrain
  Threads threads;
  bool json = false;
};

struct Outcome {
  std::int64_t voxels = 0;
  std::size_t types = 0;
  FaceCounts faces;
  std::uint64_t bytes = 0;
  double seconds_generate = 0;
  double seconds_write = 0;
  std::vector<std::string> warnings;
};

/// Returns the voxels or samples along each axis of one unit of --chunks.
int edge_of_unit(bool is_smooth) {
  return is_smooth ? kChunkEdge : kTerrainUnit;
}

/// Returns the height of an endless world in chunks.
int endless_height(const GenerateOptions& options) {
  return (options.terrain.size.y * edge_of_unit(options.is_smooth) + kChunkEdge - 1) / kChunkEdge;
}

/// The limits of --chunks.
IVec3 max_chunks(bool is_smooth) {
  return is_smooth ? IVec3{512, 16, 512} : IVec3{1'024, 32, 1'024};
}
std::int64_t max_total(bool is_smooth) {
  const std::int64_t unit = edge_of_unit(is_smooth);
  return kMaxVoxels / (unit * unit * unit);
}
std::string chunk_limits(bool is_smooth) {
  const IVec3 most = max_chunks(is_smooth);
  return "at most " + std::to_string(most.x) + "x" + std::to_string(most.y) + "x" + std::to_string(most.z) + " and " +
         with_thousands(max_total(is_smooth)) + " units";
}

std::optional<IVec3> read_chunks(const std::string& text, bool is_smooth) {
  const auto size = parse_box_size(text);
  const bool fits = size && glm::all(glm::greaterThan(*size, IVec3{0})) &&
                    glm::all(glm::lessThanEqual(*size, max_chunks(is_smooth))) &&
                    std::int64_t{size->x} * size->y * size->z <= max_total(is_smooth);
  return fits ? size : std::nullopt;
}

/// Generates the voxels or the field of the world. Errors: Cancelled.
Status make_content(const GenerateOptions& options, const TerrainTypes& types, const Progress& progress,
                    SceneGrid& content) {
  if (options.is_smooth) {
    auto field = generate_smooth_terrain(options.smooth, types, options.threads, progress);
    if (!field) return field.error();
    content.field = std::move(*field);
    return {};
  }
  auto grid = generate_terrain(options.terrain, types, options.threads, progress);
  if (!grid) return grid.error();
  content.grid = std::move(*grid);
  return {};
}

Result<SavedScene> save(const Scene& scene, const GenerateOptions& options, ProgressBar& bar) {
  const auto format = format_for_writing(options.output);
  if (!format || format->format != FileFormat::World) {
    return save_scene(scene, options.output, options.threads, bar.listener("writing"));
  }
  WorldChanges more;
  if (auto done = put_thumbnail(scene, options.threads, more); !done) return done.error();
  return write_world(scene, options.output, options.threads, bar.listener("writing"), std::move(more));
}

Result<Outcome> generate(const GenerateOptions& options) {
  Stopwatch watch;
  if (auto kept = check_replaced(options.output, {}, options.force); !kept) return kept.error();
  if (auto writable = check_outputs({options.output}); !writable) return writable.error();
  catch_interrupts();
  ProgressBar bar;
  Scene scene;
  const auto materials = add_terrain_types(scene.types);
  if (!materials) return materials.error();
  SceneGrid content;
  content.name = "terrain";
  content.canvas = {IVec3{0}, options.terrain.size * edge_of_unit(options.is_smooth)};
  if (Status done = make_content(options, *materials, bar.listener("generating"), content); !done) return done.error();
  Outcome outcome;
  outcome.voxels = content.grid.voxel_count() + content.field.solid_count();
  outcome.types = options.is_smooth ? scene.types.size() - 1 : content.grid.types().size();
  outcome.seconds_generate = watch.lap();
  Instance instance;
  instance.name = content.name;
  instance.grid = scene.add_grid(std::move(content));
  scene.add_instance(std::move(instance));
  outcome.faces = count_faces(scene, InstanceFilter::All, options.threads);
  if (was_interrupted()) return make_error(ErrorCode::Cancelled, "cancelled", options.output.string());
  auto saved = save(scene, options, bar);
  if (!saved) return saved.error();
  outcome.bytes = saved->bytes;
  outcome.warnings = std::move(saved->warnings);
  outcome.seconds_write = watch.lap();
  return outcome;
}

/// Creates an endless world and generates the area around the origin.
Result<Outcome> generate_endless(const GenerateOptions& options) {
  Stopwatch watch;
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::symlink_status(options.output, error))) {
    return make_error(ErrorCode::CannotWrite,
                      "cannot write " + options.output.string() + ": the file exists; --endless needs a new file");
  }
  if (auto writable = check_outputs({options.output}); !writable) return writable.error();
  catch_interrupts();
  Outcome outcome;
  Status done;
  {
    auto world = StreamedWorld::open_or_create(options.output, {.workers = options.threads});
    if (!world) return world.error();
    const EndlessTerrain terrain{options.terrain.seed, endless_height(options), options.is_smooth};
    const auto grid = world->add_terrain(terrain);
    const IVec3 size = options.terrain.size * edge_of_unit(options.is_smooth);
    const Viewer viewer{.position = {0.0, 0.5 * size.y, 0.0}, .radius = 0.5 * std::max(size.x, size.z)};
    done = grid ? world->load_all({&viewer, 1}) : Status(grid.error());
    if (done) {
      const SceneGrid& content = world->scene().grids()[*grid];
      outcome.voxels = content.grid.voxel_count() + content.field.solid_count();
      outcome.types = world->scene().types.size() - 1;
      outcome.seconds_generate = watch.lap();
      WorldChanges more;
      done = put_thumbnail(world->scene(), options.threads, more);
      if (done && !more.empty()) {
        const auto saved = world->store().save(std::move(more));
        if (!saved) done = saved.error();
      }
      if (done) done = world->flush();
      for (std::string& problem : world->take_problems()) outcome.warnings.push_back(std::move(problem));
    }
  }
  if (done && was_interrupted()) done = make_error(ErrorCode::Cancelled, "cancelled", options.output.string());
  if (!done) {
    std::filesystem::remove(options.output, error);
    return done.error();
  }
  outcome.bytes = std::filesystem::file_size(options.output, error);
  outcome.seconds_write = watch.lap();
  return outcome;
}

// Fields have no faces, and the faces of endless worlds are not counted.
bool has_faces(const GenerateOptions& options) {
  return !options.is_smooth && !options.is_endless;
}

Json outcome_json(const GenerateOptions& options, const Outcome& outcome) {
  const IVec3 size = options.terrain.size;
  const int unit = edge_of_unit(options.is_smooth);
  return {{"seed", options.terrain.seed},
          {"chunks", {size.x, size.y, size.z}},
          {"size", {size.x * unit, size.y * unit, size.z * unit}},
          {"voxels", outcome.voxels},
          {"types", outcome.types},
          {"endless", options.is_endless},
          {"faces_visible", has_faces(options) ? Json(outcome.faces.visible) : Json()},
          {"faces_total", has_faces(options) ? Json(outcome.faces.total) : Json()},
          {"bytes", outcome.bytes},
          {"files", {options.output.string()}},
          {"seconds", {{"generate", outcome.seconds_generate}, {"write", outcome.seconds_write}}},
          {"warnings", outcome.warnings}};
}

std::string outcome_text(const GenerateOptions& options, const Outcome& outcome) {
  const IVec3 size = options.terrain.size * edge_of_unit(options.is_smooth);
  return std::string(options.is_endless ? "Endless terrain: seed " : "Terrain: seed ") +
         std::to_string(options.terrain.seed) + ", " + std::to_string(size.x) + " x " + std::to_string(size.y) + " x " +
         std::to_string(size.z) + (options.is_smooth ? "\nSolid samples: " : "\nVoxels: ") +
         with_thousands(outcome.voxels) + " of " + std::to_string(outcome.types) + " types\n" +
         (has_faces(options) ? to_string(outcome.faces) + "\n" : "") + "Wrote " + options.output.string() + ", " +
         bytes_for_people(outcome.bytes) + " in " +
         number_for_people(outcome.seconds_generate + outcome.seconds_write) + " s\n";
}

/// Checks the options against the format of the output. Errors: InvalidArgument.
Status settle(const CLI::App& command, const GenerateOptions& options) {
  const auto format = format_for_writing(options.output);
  const bool is_wrong =
      !format || format->can(FormatCapability::Meshes) || (options.is_smooth && format->format == FileFormat::Vox);
  if (is_wrong) {
    return make_error(ErrorCode::InvalidArgument,
                      "cannot write " + options.output.string() + ": " +
                          (options.is_smooth ? "smooth terrain" : "terrain") + " is written as .quoin" +
                          (options.is_smooth ? " or " : ", .vox or ") + ".json; use `quoin convert` for other formats");
  }
  const auto is_world = [&] { return format->format == FileFormat::World; };
  return check_rules(command, {{{"--endless"}, needs("a .quoin file", is_world)}});
}

int run_generate(const GenerateOptions& options) {
  const auto outcome = options.is_endless ? generate_endless(options) : generate(options);
  if (!outcome) {
    die_if_interrupted();
    print_error(outcome.error());
    return kFailed;
  }
  if (options.json) return print_json(outcome_json(options, *outcome));
  print_warnings(outcome->warnings);
  return print_summary(outcome_text(options, *outcome));
}

/// Adds the options of both kinds of terrain. `unit`: the unit of --chunks.
std::shared_ptr<GenerateOptions> add_world(CLI::App& command, const char* files, bool is_smooth, const char* unit,
                                           int& status) {
  auto options = std::make_shared<GenerateOptions>();
  options->is_smooth = is_smooth;
  command.add_option("OUT", options->output, files)->required()->check(file_name());
  set_heading(command, heading::kOutput);
  add_parsed<std::uint64_t>(
      command, "--seed", "N", {parse_unsigned, "a whole number from 0 to 18446744073709551615"},
      [options](const std::uint64_t& seed) { options->terrain.seed = options->smooth.seed = seed; },
      "Seed, a whole number (default 42)");
  add_parsed<IVec3>(
      command, "--chunks", "XxYxZ",
      {[is_smooth](const std::string& text) { return read_chunks(text, is_smooth); },
       "XxYxZ, as in 4x2x4, " + chunk_limits(is_smooth)},
      [options](const IVec3& size) { options->terrain.size = options->smooth.size = size; },
      std::string("Width, height and depth in units of ") + unit + " (default 4x2x4); " + chunk_limits(is_smooth));
  command.add_flag(
      "--endless", options->is_endless,
      "Write an unbounded .quoin, which programs extend with StreamedWorld. Generates only a square of the "
      "width of --chunks around the origin");
  command.add_flag("--force", options->force, kForceHelp);
  set_heading(command, heading::kGeneral);
  command.add_flag("--json", options->json, "Print one JSON object instead of text");
  add_quiet_option(command);
  command.add_option("--threads", options->threads.count, "Number of threads, 1 to 1024 (default: all)")
      ->check(CLI::Range(1U, 1024U));
  command.callback([&command, options, &status] {
    const Status fits = settle(command, *options);
    status = fits ? run_generate(*options) : wrong_usage(fits.error());
  });
  return options;
}

}  // namespace

void add_generate_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("generate", "Generate a world from a seed");
  command->require_subcommand(1);
  command->footer("Example: quoin generate terrain hills.vox");
  CLI::App* terrain = command->add_subcommand("terrain", "Hills, rivers, caves and woods");
  add_world(*terrain, "File to write: .quoin, .vox, .json", false, "32 voxels", status);
  terrain->footer(
      "The same seed gives the same world on every machine. Taller worlds have larger hills.\n"
      "Example: quoin generate terrain hills.vox --seed 7 --chunks 8x3x8");
  CLI::App* smooth = command->add_subcommand("smooth-terrain", "Smooth hills with cliffs, arches and caves");
  const auto options = add_world(*smooth, "File to write: .quoin, .json", true, "64 samples", status);
  set_heading(*smooth, heading::kOutput);
  smooth->add_flag("!--no-overhangs", options->smooth.overhangs, "Generate no overhangs and no arches");
  smooth->add_flag("!--no-caves", options->smooth.caves, "Generate no caves");
  smooth->footer(
      "The same seed gives the same world on every machine. With --no-overhangs the ground has the heights of "
      "generate terrain.\n"
      "Example: quoin generate smooth-terrain hills.json && quoin render hills.json -o hills.png");
}

}  // namespace quoin::tool
