#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <quoin/io/file.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/store/world_store.h>

#include "command_files.h"
#include "commands.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

struct WorldOptions {
  std::filesystem::path world;
  std::filesystem::path output;
  bool force = false;
  bool json = false;
};

int fail(const Error& error) {
  die_if_interrupted();
  print_error(error);
  return kFailed;
}

Json box_of(const IBox& box) {
  return {{"min", list_of(box.min)}, {"max", list_of(box.empty() ? box.min : box.max)}};
}

int run_info(const WorldOptions& options) {
  ProgressBar bar;
  const auto summary = summarize_world(options.world, bar.listener("reading"));
  if (!summary) return fail(summary.error());
  Json grids = Json::array();
  std::string text =
      options.world.filename().string() + ": world version " + std::to_string(summary->version) + ", " +
      bytes_for_people(summary->bytes) + ", " + with_thousands(summary->saves) +
      " saves\nTypes: " + with_thousands(summary->types) + "\nInstances: " + with_thousands(summary->instances) +
      "\nValues: " + with_thousands(summary->values) +
      "\nThumbnail: " + (summary->thumbnail_bytes == 0 ? "none" : bytes_for_people(summary->thumbnail_bytes)) + "\n";
  for (const auto& [number, grid] : summary->grids) {
    Json levels = Json::object();
    for (const auto& [level, chunks] : grid.by_level) levels[std::to_string(level)] = chunks;
    grids.push_back({{"number", number},
                     {"name", grid.grid.name},
                     {"whole", grid.grid.whole},
                     {"chunks", grid.chunks},
                     {"chunk_bounds", box_of(grid.chunk_bounds)},
                     {"levels", levels}});
    const IVec3 size = grid.chunk_bounds.size();
    text += "Grid " + std::to_string(number) + (grid.grid.name.empty() ? "" : " \"" + grid.grid.name + "\"") + ": " +
            with_thousands(grid.chunks) + " chunks within " + std::to_string(size.x) + " x " + std::to_string(size.y) +
            " x " + std::to_string(size.z) + (grid.grid.whole ? ", whole" : "") + "\n";
  }
  if (!options.json) return print_summary(text);
  return print_json({{"version", summary->version},
                     {"bytes", summary->bytes},
                     {"saves", summary->saves},
                     {"types", summary->types},
                     {"instances", summary->instances},
                     {"values", summary->values},
                     {"thumbnail_bytes", summary->thumbnail_bytes},
                     {"grids", grids}});
}

Json damage_of(const WorldCheck& check) {
  Json damage = Json::array();
  for (const WorldDamage& each : check.damage) {
    Json line = {{"what", each.what}};
    if (each.chunk) {
      line["grid"] = each.chunk->grid;
      line["level"] = each.chunk->level;
      line["chunk"] = list_of(each.chunk->chunk);
    }
    damage.push_back(std::move(line));
  }
  return damage;
}

std::string counts_of(const WorldCheck& check) {
  return with_thousands(check.chunks) + " chunks and " + with_thousands(check.parts) + " other parts are intact";
}

int run_check(const WorldOptions& options) {
  ProgressBar bar;
  const auto check = check_world(options.world, bar.listener("checking"));
  if (!check) return fail(check.error());
  const int status = check->damage.empty() ? kDone : kFailed;
  if (options.json) {
    const int printed = print_json({{"chunks", check->chunks}, {"parts", check->parts}, {"damage", damage_of(*check)}});
    return printed == kDone ? status : printed;
  }
  for (const WorldDamage& each : check->damage) print_error(options.world.string() + ": " + each.what);
  const int printed = print_summary(options.world.filename().string() + ": " + counts_of(*check) +
                                    (check->damage.empty() ? "\n"
                                                           : ", " + with_thousands(check->damage.size()) +
                                                                 " are damaged (run quoin world repair)\n"));
  return printed == kDone ? status : printed;
}

int run_repair(const WorldOptions& options) {
  const std::filesystem::path& to = options.output.empty() ? options.world : options.output;
  ProgressBar bar;
  const auto repair = repair_world(options.world, to, bar.listener("repairing"));
  if (!repair) return fail(repair.error());
  const WorldCheck& check = repair->check;
  if (options.json) {
    return print_json({{"chunks", check.chunks},
                       {"parts", check.parts},
                       {"lost", damage_of(check)},
                       {"files", {to.string()}},
                       {"kept", repair->kept.string()}});
  }
  for (const WorldDamage& each : check.damage) print_warnings({each.what});
  return print_summary("Wrote " + to.string() + ": " + counts_of(check) + "\n" +
                       (repair->kept.empty() ? "" : "The damaged world is kept as " + repair->kept.string() + "\n"));
}

int report_bytes(const WorldOptions& options, const std::filesystem::path& file, std::uint64_t bytes) {
  if (options.json) return print_json({{"files", {file.string()}}, {"bytes", bytes}});
  return print_summary("Wrote " + file.string() + ", " + bytes_for_people(bytes) + "\n");
}

int run_backup(const WorldOptions& options) {
  const auto bytes = back_up_world(options.world, options.output);
  return bytes ? report_bytes(options, options.output, *bytes) : fail(bytes.error());
}

int run_compact(const WorldOptions& options) {
  const auto bytes = compact_world(options.world);
  return bytes ? report_bytes(options, options.world, *bytes) : fail(bytes.error());
}

int run_thumbnail(const WorldOptions& options) {
  if (auto kept = check_replaced(options.output, FileSet({&options.world, 1}), options.force); !kept)
    return fail(kept.error());
  if (auto writable = check_outputs({options.output}); !writable) return fail(writable.error());
  const auto world = WorldStore::open(options.world, WorldAccess::Read);
  if (!world) return fail(world.error());
  const auto png = world->thumbnail();
  if (!png) return fail(png.error());
  if (!*png) {
    return fail(make_error(ErrorCode::InvalidArgument,
                           "the world has no thumbnail; `quoin thumbnail` renders an image of any world",
                           options.world.string()));
  }
  if (auto written = write_file(**png, options.output); !written) {
    Error error = written.error();
    if (error.path.empty()) error.path = options.output.string();
    return fail(error);
  }
  return report_bytes(options, options.output, (*png)->size());
}

using Run = int (*)(const WorldOptions& options);

std::shared_ptr<WorldOptions> add(CLI::App& command, CLI::App*& added, const char* name, const char* help, Run run,
                                  int& status) {
  auto options = std::make_shared<WorldOptions>();
  added = command.add_subcommand(name, help);
  added->add_option("WORLD", options->world, "World file, NAME.quoin")->required()->check(file_name());
  added->add_flag("--json", options->json, "Print one JSON object instead of text");
  add_quiet_option(*added);
  added->callback([options, run, &status] { status = run(*options); });
  return options;
}

}  // namespace

void add_world_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("world", "Check, repair, back up and compact world files (.quoin)");
  command->require_subcommand(1);
  command->footer("Example: quoin world check home.quoin");
  CLI::App* added = nullptr;
  add(*command, added, "info", "Print the contents of a world", run_info, status);
  added->footer("Example: quoin world info home.quoin");
  add(*command, added, "check", "Read all of a world; print a line per damaged part and exit with 1 if there is one",
      run_check, status);
  added->footer("Example: quoin world check home.quoin");
  const auto repaired = add(*command, added, "repair", "Keep the intact parts of a damaged world", run_repair, status);
  added
      ->add_option("-o,--output", repaired->output,
                   "File to write (default: WORLD itself; the damaged file is kept as WORLD~)")
      ->type_name("FILE")
      ->check(file_name());
  added->footer("Example: quoin world repair home.quoin -o repaired.quoin");
  const auto backed_up =
      add(*command, added, "backup", "Copy a world, also while a program writes it", run_backup, status);
  added->add_option("OUT", backed_up->output, "File to write; must not exist")->required()->check(file_name());
  added->footer("Example: quoin world backup home.quoin monday.quoin");
  const auto shown = add(*command, added, "thumbnail", "Write the preview image of a world", run_thumbnail, status);
  added->add_option("OUT", shown->output, "Image to write: .png")->required()->check(file_name());
  added->add_flag("--force", shown->force, "Overwrite OUT even if it is a voxel file, not an image");
  added->footer("Example: quoin world thumbnail home.quoin home.png");
  add(*command, added, "compact", "Remove unused space from a world file", run_compact, status);
  added->footer("Example: quoin world compact home.quoin");
}

}  // namespace quoin::tool
