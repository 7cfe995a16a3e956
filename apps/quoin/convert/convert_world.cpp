#include <algorithm>
#include <memory>
#include <utility>

#include <quoin/io/block_packs.h>
#include <quoin/io/chunk_source.h>
#include <quoin/store/world_import.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/store/world_meshes.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>

#include "convert/convert.h"
#include "output.h"
#include "render/thumbnail.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

constexpr std::size_t kMaxLines = 20;

void report_lost(const std::vector<std::string>& lines, std::vector<std::string>& warnings) {
  for (std::size_t i = 0; i < std::min(lines.size(), kMaxLines); ++i) warnings.push_back(lines[i]);
  if (lines.size() > kMaxLines) {
    warnings.push_back("and " + std::to_string(lines.size() - kMaxLines) + " more; run quoin world check for all");
  }
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

}  // namespace

Result<Outcome> convert_by_chunks(const ConvertOptions& options, const DetectedFile& file) {
  Stopwatch watch;
  const std::vector<std::filesystem::path>& pack_files = options.common.load.packs;
  Result<std::shared_ptr<BlockPacks>> packs = nullptr;
  if (!pack_files.empty()) packs = BlockPacks::open(pack_files);
  if (!packs) return packs.error();
  auto source = open_chunk_source(file, options.common.load.dimension);
  if (!source) return source.error();
  if (*packs != nullptr) source = with_packs(std::move(*source), *packs);
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
  if (*packs != nullptr) {
    if (std::string line = to_string((*packs)->report()); !line.empty()) outcome.warnings.push_back(std::move(line));
  }
  outcome.seconds.write = watch.lap();
  if (Status counted = count_faces_of_output(options, outcome); !counted) return counted.error();
  return outcome;
}

Status count_faces_of_output(const ConvertOptions& options, Outcome& outcome) {
  if (!options.common.json) return {};
  const auto world = WorldStore::open(options.output, WorldAccess::Read, options.common.threads);
  if (!world) return world.error();
  const auto loaded = load_partial_world(*world);
  if (!loaded) return loaded.error();
  ProgressBar bar(!options.is_one_of_many);
  const auto faces = count_world_faces(*world, *loaded, options.common.instances(), options.common.threads,
                                       bar.listener("counting faces"));
  if (!faces) return faces.error();
  outcome.faces = *faces;
  return {};
}

Result<Outcome> copy_world_file(const ConvertOptions& options) {
  Stopwatch watch;
  catch_interrupts();
  Outcome outcome;
  outcome.files = {options.output};
  ProgressBar bar(!options.is_one_of_many);
  const auto copied = copy_world(options.common.input, options.output, bar.listener("copying"));
  if (!copied) return copied.error();
  outcome.content = {static_cast<std::int64_t>(copied->voxels), static_cast<std::int64_t>(copied->samples)};
  outcome.bytes = copied->bytes;
  std::vector<std::string> lines;
  for (const WorldDamage& lost : copied->lost) lines.push_back("left out: " + lost.what);
  report_lost(lines, outcome.warnings);
  outcome.seconds.write = watch.lap();
  if (Status counted = count_faces_of_output(options, outcome); !counted) return counted.error();
  return outcome;
}

bool meshes_by_chunks(const ConvertOptions& options) {
  const bool is_blocky = options.mesher != Mesher::Smooth;
  const auto format = format_for_writing(options.output);
  const bool is_print = format && format->can(FormatCapability::Printing);
  return is_blocky && !is_print && !options.is_atlas && !options.light && !options.animate &&
         !options.has_field_occlusion && !options.simplify && !options.smoothness && !options.colours &&
         !options.separate_models;
}

Result<std::optional<Outcome>> mesh_world_file(const ConvertOptions& options) {
  Stopwatch watch;
  const auto world = WorldStore::open(options.common.input, WorldAccess::Read, options.common.threads);
  if (!world) return world.error();
  auto loaded = load_partial_world(*world, options.common.load);
  if (!loaded) return loaded.error();
  const auto values = world->value_names();
  if (!values) return values.error();
  catch_interrupts();
  Outcome outcome;
  outcome.warnings = std::move(loaded->loaded.warnings);
  outcome.seconds.read = watch.lap();
  outcome.mesher = options.mesher.value_or(Mesher::Greedy);
  ProgressBar bar(!options.is_one_of_many);
  WorldMeshOptions wanted;
  wanted.scene.mesh = {outcome.mesher == Mesher::Greedy, !options.occlusion_off, options.watertight, {}};
  wanted.scene.instances = options.common.instances();
  wanted.folder = options.output.parent_path();
  auto made = mesh_world(*world, *loaded, wanted, options.common.threads, bar.listener("meshing"));
  if (!made && made.error().code == ErrorCode::Unsupported) return std::optional<Outcome>();
  if (!made) return made.error();
  outcome.content.voxels = made->voxels;
  outcome.faces = {made->meshes.stats.faces_visible, made->meshes.stats.faces_total};
  outcome.seconds.mesh = watch.lap();
  report_lost(made->broken, outcome.warnings);
  warn_of_values(values->size(), outcome.warnings);
  const Scene& scene = loaded->loaded.scene;
  warn_of_left_out(scene, wanted.scene.instances, outcome.warnings);
  ConvertOptions with_cameras = options;
  with_cameras.cameras = loaded->loaded.cameras;
  add_lights(scene, with_cameras, made->meshes, outcome.warnings);
  warn_of_data(made->voxels_with_data, outcome.warnings);
  if (auto done = write_meshes(made->meshes, options, bar, outcome); !done) return done.error();
  return std::optional(std::move(outcome));
}

}  // namespace quoin::tool
