#include <string>
#include <utility>

#include <quoin/core/memory.h>
#include <quoin/store/world_saver.h>

#include "store/scene/world_memory.h"
#include "store/store_formats.h"
#include "store/world/world_changes.h"

namespace quoin {

namespace {

std::string megabytes(std::uint64_t bytes) {
  return std::to_string((bytes + 500'000) / 1'000'000) + " MB";
}

// Returns an error if memory is too small, instead of letting the system end the process.
Status check_memory(const WorldStore& world) {
  constexpr std::uint64_t kSmall = std::uint64_t{64} << 20;
  const auto needed = memory_of_world(world);
  if (!needed || *needed < kSmall) return {};
  const auto available = available_memory();
  if (!available || *needed <= *available) return {};
  return make_error(ErrorCode::LimitExceeded,
                    "loading the whole world needs about " + megabytes(*needed) + " of memory; " +
                        megabytes(*available) + " are available",
                    world.path().string());
}

Result<LoadedScene> load(const WorldStore& world, const LoadOptions& options, Threads threads,
                         const Progress& progress) {
  if (auto fits = check_memory(world); !fits) return fits.error();
  auto loaded = load_world(world, options, threads, progress);
  if (!loaded) return loaded.error();
  const auto values = world.value_names();
  if (!values) return values.error();
  if (!values->empty()) {
    loaded->loaded.warnings.push_back("application values left out: " + std::to_string(values->size()) +
                                      " (quoin world backup copies them)");
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

}  // namespace quoin
