#include <memory>

#include <quoin/io/formats.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/terrain/terrain.h>

#include "commands.h"
#include "interrupt.h"
#include "output.h"
#include "output_files.h"
#include "parse.h"
#include "progress_bar.h"
#include "stopwatch.h"

namespace quoin::tool {

namespace {

/// More than this many voxels would not fit into a .vox file.
constexpr std::int64_t kMaxVoxels = std::int64_t{1} << 31;

struct GenerateOptions {
  std::filesystem::path output;
  std::string seed = "42";
  std::string chunks = "4x2x4";
  TerrainOptions terrain;
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

/// What is wrong with the options, which are read into `options.terrain`; empty when nothing is.
std::string read_options(GenerateOptions& options) {
  const auto seed = parse_unsigned(options.seed);
  if (!seed) return "--seed: must be a whole number from 0 to 18446744073709551615, not \"" + options.seed + "\"";
  const std::string got = ", not \"" + options.chunks + "\"";
  const auto parsed = parse_box_size(options.chunks);
  if (!parsed) return "--chunks: must be like 4x2x4" + got;
  const IVec3 size = *parsed;
  if (size.x < 1 || size.y < 1 || size.z < 1 || size.x > 1'024 || size.y > 32 || size.z > 1'024) {
    return "--chunks: must be 1 to 1024 wide and deep and 1 to 32 high" + got;
  }
  constexpr std::int64_t kUnitVoxels = std::int64_t{kTerrainUnit} * kTerrainUnit * kTerrainUnit;
  if (std::int64_t{size.x} * size.y * size.z > kMaxVoxels / kUnitVoxels) {
    return "--chunks: must be at most " + with_thousands(kMaxVoxels / kUnitVoxels) + " in all" + got;
  }
  options.terrain.seed = *seed;
  options.terrain.size = size;
  return "";
}

Scene scene_of(Grid grid, VoxelRegistry types, IVec3 size) {
  Scene scene;
  scene.types = std::move(types);
  SceneGrid entry;
  entry.name = "terrain";
  entry.grid = std::move(grid);
  entry.canvas = {IVec3{0}, size * kTerrainUnit};
  Instance instance;
  instance.name = entry.name;
  instance.grid = scene.add_grid(std::move(entry));
  scene.add_instance(std::move(instance));
  return scene;
}

Result<Outcome> generate(const GenerateOptions& options) {
  Stopwatch watch;
  if (auto writable = check_outputs({options.output}); !writable) return writable.error();
  catch_interrupts();
  ProgressBar bar;
  VoxelRegistry types;
  const auto materials = add_terrain_types(types);
  if (!materials) return materials.error();
  auto grid = generate_terrain(options.terrain, *materials, options.threads, bar.listener("generating"));
  if (!grid) return grid.error();
  Outcome outcome;
  outcome.voxels = grid->voxel_count();
  outcome.types = grid->types().size();
  outcome.seconds_generate = watch.lap();
  LoadedScene made;
  made.scene = scene_of(std::move(*grid), std::move(types), options.terrain.size);
  outcome.faces = count_faces(made.scene, InstanceFilter::All, options.threads);
  if (was_interrupted()) return make_error(ErrorCode::Cancelled, "cancelled", options.output.string());
  const auto bytes = save_scene(made, options.output, outcome.warnings, options.threads, bar.listener("writing"));
  if (!bytes) return bytes.error();
  outcome.bytes = *bytes;
  outcome.seconds_write = watch.lap();
  return outcome;
}

Json outcome_json(const GenerateOptions& options, const Outcome& outcome) {
  const IVec3 size = options.terrain.size;
  return {{"seed", options.terrain.seed},
          {"chunks", {size.x, size.y, size.z}},
          {"size", {size.x * kTerrainUnit, size.y * kTerrainUnit, size.z * kTerrainUnit}},
          {"voxels", outcome.voxels},
          {"types", outcome.types},
          {"faces_visible", outcome.faces.visible},
          {"faces_total", outcome.faces.total},
          {"bytes", outcome.bytes},
          {"files", {options.output.string()}},
          {"seconds", {{"generate", outcome.seconds_generate}, {"write", outcome.seconds_write}}},
          {"warnings", outcome.warnings}};
}

std::string outcome_text(const GenerateOptions& options, const Outcome& outcome) {
  const IVec3 size = options.terrain.size * kTerrainUnit;
  return "Terrain: seed " + std::to_string(options.terrain.seed) + ", " + std::to_string(size.x) + " x " +
         std::to_string(size.y) + " x " + std::to_string(size.z) + "\nVoxels: " + with_thousands(outcome.voxels) +
         " of " + std::to_string(outcome.types) + " types\n" + to_string(outcome.faces) + "\nWrote " +
         options.output.string() + ", " + bytes_for_people(outcome.bytes) + " in " +
         number_for_people(outcome.seconds_generate + outcome.seconds_write) + " s\n";
}

int run_generate(GenerateOptions& options) {
  const auto format = format_for_writing(options.output);
  if (!format || format->is_mesh) {
    print_error(options.output.string() +
                ": a terrain is written as .vox or .json; `quoin convert` turns that into other formats");
    return kWrongUsage;
  }
  if (const std::string fault = read_options(options); !fault.empty()) {
    print_error(fault + " (try --help)");
    return kWrongUsage;
  }
  const auto outcome = generate(options);
  if (!outcome) {
    die_if_interrupted();
    print_error(outcome.error());
    return kFailed;
  }
  if (options.json) return print_json(outcome_json(options, *outcome));
  print_warnings(outcome->warnings);
  return print(outcome_text(options, *outcome));
}

}  // namespace

void add_generate_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("generate", "Make a world from a seed");
  command->require_subcommand(1);
  command->footer("Example: quoin generate terrain hills.vox");
  CLI::App* terrain = command->add_subcommand("terrain", "Hills, rivers, caves and woods");
  const auto options = std::make_shared<GenerateOptions>();
  terrain->add_option("OUT", options->output, "File to write: .vox, .json")->required()->check(file_name());
  terrain->add_option("--seed", options->seed, "Which world: a whole number (default 42)");
  terrain->add_option(
      "--chunks", options->chunks,
      "Width x height x depth in units of 32 voxels (default 4x2x4); 1024x32x1024 at most, 65,536 in all");
  terrain->add_flag("--json", options->json, "Print one JSON object instead of text");
  terrain->add_option("--threads", options->threads.count, "Threads to use (default: all)")
      ->check(CLI::Range(1U, 1024U));
  terrain->footer(
      "The same seed gives the same world on every machine. The landscape's forms grow with the world's height.\n"
      "Example: quoin generate terrain hills.vox --seed 7 --chunks 8x3x8");
  terrain->callback([options, &status] { status = run_generate(*options); });
}

}  // namespace quoin::tool
