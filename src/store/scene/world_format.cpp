#include <string>
#include <utility>

#include <quoin/store/world_saver.h>

#include "io/world_format.h"
#include "store/world/world_changes.h"

namespace quoin {

namespace {

Result<LoadedScene> load(const WorldStore& world, const LoadOptions& options, Threads threads,
                         const Progress& progress) {
  auto loaded = load_world(world, options, threads, progress);
  if (!loaded) return loaded.error();
  const auto values = world.value_names();
  if (!values) return values.error();
  if (!values->empty()) {
    loaded->loaded.warnings.push_back("a game keeps " + std::to_string(values->size()) +
                                      (values->size() == 1 ? " value" : " values") +
                                      " in it, which no other file holds (quoin world backup copies all)");
  }
  return std::move(loaded->loaded);
}

}  // namespace

Result<LoadedScene> read_world_format(const std::filesystem::path& path, const LoadOptions& options, Threads threads,
                                      const Progress& progress) {
  const auto world = WorldStore::open(path, WorldAccess::Read, threads);
  if (!world) return world.error();
  return load(*world, options, threads, progress);
}

Result<LoadedScene> read_world_format(std::span<const std::byte> bytes, const LoadOptions& options, Threads threads,
                                      const Progress& progress) {
  const auto world = WorldParts::open(bytes);
  if (!world) return world.error();
  return load(*world, options, threads, progress);
}

Result<SavedScene> write_world_format(const Scene& scene, const LoadedScene* loaded, const std::filesystem::path& path,
                                      Threads threads, const Progress& progress) {
  return loaded != nullptr ? write_world(*loaded, path, threads, progress)
                           : write_world(scene, path, threads, progress);
}

}  // namespace quoin
