#include <algorithm>
#include <atomic>
#include <limits>
#include <map>
#include <mutex>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/io/chunk_source.h>

#include "core/work/progress_steps.h"

namespace quoin {

namespace {

// Maximum number of damage lines, for readable reports on broken worlds.
constexpr std::size_t kMaxLines = 20;

bool meet(const IBox& a, const IBox& b) {
  return !intersect(a, b).empty();
}

std::string text_of(const IBox& chunks) {
  const IVec3 middle = (chunks.min + (chunks.size() - 1) / 2) * kChunkEdge;
  return std::to_string(middle.x) + ", " + std::to_string(middle.z);
}

bool is_over(const IBox& chunks, IVec3 chunk) {
  return chunk.x >= chunks.min.x && chunk.x < chunks.max.x && chunk.z >= chunks.min.z && chunk.z < chunks.max.z;
}

void warn_of_outside(const ChunkSource& source, const IBox& chunks, std::size_t read,
                     std::vector<std::string>& warnings) {
  const std::size_t all = source.parts().size();
  if (read == all) return;
  const auto& spawn = source.info().spawn;
  const bool is_at_spawn = spawn && is_over(chunks, chunk_of(voxel_of(*spawn)));
  const std::string why = spawn ? "the spawn has no chunks around it" : "the world has no spawn";
  const std::string where = is_at_spawn ? "only chunks around the spawn are read: "
                                        : why + "; only the chunks around (" + text_of(chunks) + ") are read: ";
  warnings.push_back(where + std::to_string(read) + " of " + std::to_string(all) +
                     " parts of the world (convert it to .quoin for all)");
}

void add_lines(const std::vector<Error>& broken, std::vector<std::string>& warnings) {
  for (std::size_t i = 0; i < std::min(broken.size(), kMaxLines); ++i) {
    warnings.push_back("left out: " + to_string(broken[i]));
  }
  if (broken.size() > kMaxLines) warnings.push_back("and " + std::to_string(broken.size() - kMaxLines) + " more");
}

/// Reads the parts that meet a box, several at once. Errors: of a part; Cancelled.
Result<std::vector<SourcePart>> read_parts(const ChunkSource& source, const IBox& chunks, Threads threads,
                                           const Progress& progress) {
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < source.parts().size(); ++i) {
    if (meet(source.parts()[i], chunks)) wanted.push_back(i);
  }
  std::vector<SourcePart> parts(wanted.size());
  ProgressSteps steps(progress, wanted.size());
  std::mutex mutex;
  std::optional<Error> error;
  std::atomic<bool> has_failed{false};
  parallel_for(wanted.size(), threads, [&](std::size_t i) {
    if (has_failed || steps.cancelled()) return;
    auto part = source.read_part(wanted[i]);
    if (part) {
      parts[i] = std::move(*part);
      return steps.step();
    }
    const std::scoped_lock lock(mutex);
    if (!error) error = part.error();
    has_failed = true;
  });
  if (error) return *error;
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return parts;
}

}  // namespace

std::string text_of_skipped_blocks(const std::map<std::string, std::uint64_t>& blocks) {
  std::string names;
  for (const auto& [name, count] : blocks) {
    names += (names.empty() ? "" : ", ") + with_thousands(static_cast<std::int64_t>(count)) + " " + name;
  }
  return names.empty() ? names : "left out, since they are invisible: " + names;
}

Result<LoadedScene> load_source(const ChunkSource& source, const IBox& chunks, Threads threads,
                                const Progress& progress) {
  auto parts = read_parts(source, chunks, threads, progress);
  if (!parts) return parts.error();
  LoadedScene loaded;
  loaded.format = source.info().format;
  SourceTypes types(source);
  SceneGrid grid;
  grid.name = source.info().name;
  std::vector<Error> broken = source.info().broken;
  std::map<std::string, std::uint64_t> skipped_blocks;
  for (SourcePart& part : *parts) {
    for (SourceChunk& each : part.chunks) {
      if (!chunks.contains(each.chunk)) continue;
      if (auto done = types.renumber(each.voxels, loaded.scene.types); !done) return done.error();
      grid.grid.put_chunk(each.chunk, std::move(each.voxels));
    }
    std::ranges::move(part.broken, std::back_inserter(broken));
    for (const auto& [name, count] : part.skipped_blocks) skipped_blocks[name] += count;
    for (Lamp& lamp : part.lamps) {
      if (!chunks.contains(chunk_of(voxel_of(lamp.position)))) continue;
      lamp.position *= source.info().spacing;
      lamp.range *= source.info().spacing;
      loaded.scene.lamps.push_back(std::move(lamp));
    }
  }
  loaded.warnings = source.info().warnings;
  add_lines(broken, loaded.warnings);
  if (!skipped_blocks.empty()) loaded.warnings.push_back(text_of_skipped_blocks(skipped_blocks));
  warn_of_outside(source, chunks, parts->size(), loaded.warnings);
  loaded.dimension = source.info().dimension;
  loaded.dimensions = source.info().dimensions;
  const GridHandle handle = loaded.scene.add_grid(std::move(grid));
  Instance instance;
  instance.name = source.info().name;
  instance.grid = handle;
  instance.voxel_size = source.info().spacing;
  loaded.scene.add_instance(std::move(instance));
  return loaded;
}

IBox chunks_around_spawn(const ChunkSource& source, int radius) {
  QUOIN_ASSERT(radius >= 0, "a radius that is not negative");
  const IBox& all = source.info().chunks;
  const auto moved = [](int at, std::int64_t by) {
    using Limits = std::numeric_limits<int>;
    return static_cast<int>(std::clamp<std::int64_t>(at + by, Limits::min(), Limits::max()));
  };
  const auto around = [&](IVec3 middle) {
    const std::int64_t end = std::int64_t{radius} + 1;
    return intersect(all, {{moved(middle.x, -radius), all.min.y, moved(middle.z, -radius)},
                           {moved(middle.x, end), all.max.y, moved(middle.z, end)}});
  };
  IVec3 middle = all.min + all.size() / 2;
  if (source.info().spawn) middle = chunk_of(voxel_of(*source.info().spawn));
  const std::span<const IBox> parts = source.parts();
  const IBox wanted = around(middle);
  const bool has_parts = std::ranges::any_of(parts, [&](const IBox& part) { return meet(part, wanted); });
  if (has_parts || parts.empty()) return wanted;
  const auto distance = [middle](const IBox& part) {
    const std::int64_t x = std::int64_t{part.min.x} - middle.x;
    const std::int64_t z = std::int64_t{part.min.z} - middle.z;
    return x * x + z * z;
  };
  return around(std::ranges::min_element(parts, {}, distance)->min);
}

}  // namespace quoin
