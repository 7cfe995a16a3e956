#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <quoin/io/block_packs.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/map/world_map.h>

#include "commands.h"
#include "options.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

struct MapCommand {
  std::filesystem::path world;
  std::filesystem::path folder;
  LoadOptions load;
  MapOptions map;
  bool json = false;
};

int fail(const Error& error) {
  die_if_interrupted();
  print_error(error);
  return kFailed;
}

void add(const DrawnMap& one, DrawnMap& all, const std::string& dimension) {
  all.tiles_written += one.tiles_written;
  all.tiles_kept += one.tiles_kept;
  all.tiles_removed += one.tiles_removed;
  all.chunks += one.chunks;
  all.bytes += one.bytes;
  for (const std::string& line : one.warnings) {
    all.warnings.push_back(dimension.empty() ? line : dimension + ": " + line);
  }
}

/// Draws all dimensions of the world, or the one that was chosen.
Result<DrawnMap> draw(const MapCommand& command) {
  std::shared_ptr<BlockPacks> packs;
  if (!command.load.packs.empty()) {
    auto opened = BlockPacks::open(command.load.packs);
    if (!opened) return opened.error();
    packs = std::move(*opened);
  }
  ProgressBar bar;
  DrawnMap all;
  std::vector<std::string> left{command.load.dimension};
  for (std::size_t i = 0; i < left.size(); ++i) {
    LoadOptions load = command.load;
    load.dimension = left[i];
    if (packs != nullptr) load.packs.clear();  // the source gets them below
    auto source = open_map_source(command.world, load, command.map.threads, bar.listener("reading"));
    if (!source && i > 0 && !was_interrupted()) {
      // The others are drawn: the game may just be writing the first region of this one.
      all.warnings.push_back(left[i] + " is left out: " + to_string(source.error()));
      continue;
    }
    if (!source) return source.error();
    const std::string dimension = (*source)->info().dimension;
    // Without a choice, the first one that opens is followed by the others.
    if (i == 0 && command.load.dimension.empty()) {
      for (const std::string& other : (*source)->info().dimensions) {
        if (other != dimension && !other.empty()) left.push_back(other);
      }
    }
    if (packs != nullptr) source = with_packs(std::move(*source), packs);
    const std::string label = left.size() > 1 ? "drawing " + dimension : "drawing";
    const auto drawn = draw_map(**source, command.folder, command.map, bar.listener(label));
    if (!drawn) return drawn.error();
    add(*drawn, all, left.size() > 1 ? dimension : "");
  }
  if (packs != nullptr) {
    if (std::string line = to_string(packs->report()); !line.empty()) all.warnings.push_back(std::move(line));
  }
  return all;
}

int run(const MapCommand& command) {
  catch_interrupts();
  Stopwatch watch;
  const auto drawn = draw(command);
  if (!drawn) return fail(drawn.error());
  const double seconds = watch.lap();
  if (command.json) {
    return print_json({{"tiles_written", drawn->tiles_written},
                       {"tiles_kept", drawn->tiles_kept},
                       {"tiles_removed", drawn->tiles_removed},
                       {"chunks", drawn->chunks},
                       {"bytes", drawn->bytes},
                       {"seconds", seconds},
                       {"warnings", drawn->warnings}});
  }
  print_warnings(drawn->warnings);
  std::error_code error;
  const auto index = command.folder / "index.html";
  const auto& page = std::filesystem::exists(index, error) ? index : command.folder;
  std::string text = "Wrote " + with_thousands(static_cast<std::int64_t>(drawn->tiles_written)) + " tiles, " +
                     bytes_for_people(drawn->bytes) + "; kept " +
                     with_thousands(static_cast<std::int64_t>(drawn->tiles_kept));
  if (drawn->tiles_removed > 0) {
    text += "; removed " + with_thousands(static_cast<std::int64_t>(drawn->tiles_removed));
  }
  return print_summary(text + "\nThe map: " + page.string() + "\n");
}

}  // namespace

void add_map_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("map", "Draw or update a map of a world for the browser");
  auto options = std::make_shared<MapCommand>();
  command
      ->add_option("WORLD", options->world,
                   "World to draw: a folder of Minecraft or Luanti, a .quoin world, or any other file with voxels")
      ->required()
      ->check(file_name());
  command->add_option("OUT", options->folder, "Folder of the map: a new one, or one to bring up to date")
      ->required()
      ->check(file_name());
  set_heading(*command, heading::kOutput);
  if (!has_webp()) options->map.tiles = MapTiles::Png;
  add_choice<MapTiles>(
      *command, "--tiles", {{"webp", MapTiles::WebP}, {"png", MapTiles::Png}},
      [options](const MapTiles& tiles) { options->map.tiles = tiles; },
      "Format of the tiles: webp or png (default webp)");
  command
      ->add_option("--ceiling", options->map.ceiling,
                   "Cut the world at this height, to see below a roof (default: 100 in Minecraft's nether, else none)")
      ->type_name("Y")
      ->check(CLI::Range(-1'000'000, 1'000'000));
  set_heading(*command, heading::kInput);
  add_dimension_option(*command, options->load);
  add_pack_option(*command, options->load, PlainBlocks::OwnPack);
  set_heading(*command, heading::kGeneral);
  command->add_flag("--json", options->json, "Print one JSON object instead of text");
  add_quiet_option(*command);
  command->add_option("--threads", options->map.threads.count, "Number of threads, 1 to 1024 (default: all)")
      ->check(CLI::Range(1U, 1024U));
  command->callback([options, &status] { status = run(*options); });
  command->footer("Example: quoin map \"saves/New World\" map\nThen open map/index.html.");
}

}  // namespace quoin::tool
