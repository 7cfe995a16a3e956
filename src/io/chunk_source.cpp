#include <quoin/io/chunk_source.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/thousands.h>

#include "core/caches.h"
#include "core/work/progress_steps.h"
#include "io/column_scan.h"
#include "io/luanti/luanti.h"
#include "io/minecraft/block_types.h"

namespace quoin {

namespace {

constexpr std::size_t kCacheBytes = std::size_t{32} << 20;
/// Cost of a part in addition to its chunks.
constexpr std::size_t kPartBytes = 256;

/// Returns the sort key of a box that is one chunk wide along x and z: by column, then bottom to top.
std::tuple<int, int, int> order_of(IVec3 place) {
  return {place.z, place.x, place.y};
}

}  // namespace

/// The most recently read parts. If several threads need a part, the first reads it and the others wait. If that fails,
/// the next thread reads it.
struct ChunkSource::Cache {
  struct Entry {
    bool is_read = false;
    std::vector<SourceChunk> chunks{};
    std::size_t bytes = 0;
    std::uint64_t last_use = 0;
  };
  std::mutex mutex;
  std::condition_variable was_read;
  std::unordered_map<std::size_t, Entry> entries;  // by part
  std::size_t bytes = 0;
  std::uint64_t uses = 0;

  /// Wakes the waiting threads when a thread stops reading a part. If the part is not read, also after an exception,
  /// the next of them reads it.
  struct Attempt {
    Cache& cache;
    std::size_t part;
    const Entry& entry;
    std::unique_lock<std::mutex>& lock;

    ~Attempt() {
      if (!lock.owns_lock()) lock.lock();
      if (!entry.is_read) cache.entries.erase(part);
      cache.was_read.notify_all();
    }
  };

  // Keeps the entry that was used last.
  void keep_within_limit() {
    if (bytes <= kCacheBytes) return;
    // Drops more than necessary, so that the cache is not searched for each part.
    bytes = drop_oldest(
        entries, bytes, kCacheBytes / 8 * 7,
        [&](auto each) { return each->second.is_read && each->second.last_use != uses; },
        [](auto each) { return each->second.bytes; }, [&](auto each) { entries.erase(each); });
  }
};

ChunkSource::ChunkSource(ChunkSourceInfo info, std::vector<IBox> parts)
    : info_(std::move(info)), parts_(std::move(parts)), by_position_(parts_.size()), cache_(std::make_unique<Cache>()) {
  QUOIN_ASSERT(parts_.size() <= std::numeric_limits<std::uint32_t>::max(), "at most 2^32 - 1 parts");
  std::iota(by_position_.begin(), by_position_.end(), 0U);
  std::ranges::sort(by_position_, {}, [&](std::uint32_t part) { return order_of(parts_[part].min); });
}

ChunkSource::~ChunkSource() = default;

std::optional<std::size_t> ChunkSource::part_of(IVec3 chunk) const {
  const auto after = std::ranges::upper_bound(by_position_, order_of(chunk), {},
                                              [&](std::uint32_t part) { return order_of(parts_[part].min); });
  if (after == by_position_.begin()) return std::nullopt;
  const std::uint32_t part = *(after - 1);
  return parts_[part].contains(chunk) ? std::optional<std::size_t>(part) : std::nullopt;
}

Result<std::optional<Chunk>> ChunkSource::read(IVec3 chunk, std::vector<Error>* broken) const {
  const auto part = part_of(chunk);
  if (!part) return std::optional<Chunk>();
  const auto chunk_in = [&](const std::vector<SourceChunk>& chunks) -> std::optional<Chunk> {
    const auto found = std::ranges::find(chunks, chunk, &SourceChunk::chunk);
    return found == chunks.end() ? std::nullopt : std::optional(found->voxels);
  };
  std::unique_lock lock(cache_->mutex);
  for (auto known = cache_->entries.find(*part); known != cache_->entries.end(); known = cache_->entries.find(*part)) {
    if (known->second.is_read) {
      known->second.last_use = ++cache_->uses;
      return chunk_in(known->second.chunks);
    }
    cache_->was_read.wait(lock);
  }
  Cache::Entry& entry = cache_->entries[*part];  // stays in place while others come and go
  const Cache::Attempt attempt{*cache_, *part, entry, lock};
  lock.unlock();
  Result<SourcePart> content = [&]() -> Result<SourcePart> {
    try {
      return read_part(*part);
    } catch (const std::bad_alloc&) {
      return make_error(ErrorCode::LimitExceeded, "not enough memory");
    }
  }();
  if (!content) return content.error();
  lock.lock();
  entry.is_read = true;
  entry.last_use = ++cache_->uses;
  entry.chunks = std::move(content->chunks);
  entry.bytes = kPartBytes;
  for (const SourceChunk& each : entry.chunks) entry.bytes += each.voxels.bytes();
  cache_->bytes += entry.bytes;
  if (broken != nullptr) std::ranges::move(content->broken, std::back_inserter(*broken));
  std::optional<Chunk> found = chunk_in(entry.chunks);
  cache_->keep_within_limit();
  return found;
}

Result<VisitedColumns> ChunkSource::visit_columns(std::size_t part, int top,
                                                  FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) const {
  auto content = read_part(part);
  if (!content) return content.error();
  ColumnScan scan(top);
  for (auto each = content->chunks.rbegin(); each != content->chunks.rend(); ++each) {
    scan.visit(each->chunk, each->voxels, visit);
  }
  return VisitedColumns{.broken = std::move(content->broken), .chunks = content->chunks.size()};
}

Result<std::uint64_t> ChunkSource::part_stamp(std::size_t part) const {
  QUOIN_ASSERT(part < parts().size(), "a part of the source");
  return std::uint64_t{0};
}

namespace {

/// Orders types by their properties, independent of the order of discovery.
bool comes_before(const VoxelProperties& a, const VoxelProperties& b) {
  const auto key = [](const VoxelProperties& p) {
    const std::array colour{p.colour.r, p.colour.g, p.colour.b, p.colour.a};
    std::array<std::tuple<std::uint64_t, int, bool, FaceAlpha, std::array<std::uint8_t, 5>>, 6> faces{};
    for (const Direction direction : kDirections) {
      if (p.faces.empty()) break;
      const VoxelFace& face = p.faces[direction];
      const Rgba8 tint = face.tint;
      faces[static_cast<std::size_t>(direction)] = {face.texture.hash(), face.turn, face.mirrored, face.alpha,
                                                    std::array{tint.r, tint.g, tint.b, tint.a, face.emission_share}};
    }
    const std::tuple rest(colour, p.visibility, p.collides, p.state_bits, p.emission, p.roughness, p.metalness, p.ior,
                          p.scattering, p.anisotropy, p.blocks_light, p.occludes, p.light_cost, p.remesh_on_data,
                          faces);
    return std::tuple<const std::string&, const std::map<std::string, std::string>&, decltype(rest)>(
        p.name, p.attributes, rest);
  };
  return key(a) < key(b);
}

}  // namespace

Status SourceTypes::renumber(Chunk& chunk, VoxelRegistry& into) {
  chunk.compact();
  std::vector<VoxelType> fresh;
  for (const VoxelType type : chunk.types()) {
    if (type != kAir && (type >= numbers_.size() || numbers_[type] == kAir)) fresh.push_back(type);
  }
  if (!fresh.empty()) {
    if (fresh.back() >= known_.size()) known_ = source_->types();
    QUOIN_ASSERT(fresh.back() < known_.size(), "a chunk of the source");
    std::ranges::sort(fresh, [&](VoxelType a, VoxelType b) { return comes_before(known_[a], known_[b]); });
    numbers_.resize(known_.size(), kAir);
  }
  for (const VoxelType type : fresh) {
    const auto number = into.find_or_add(known_[type]);
    if (!number) return number.error();
    numbers_[type] = *number;
  }
  chunk = chunk.renumbered([&](VoxelType type) { return numbers_[type]; });
  return {};
}

namespace {

// Maximum number of damage lines, for readable reports on broken worlds.
constexpr std::size_t kMaxLines = 20;

bool meet(const IBox& a, const IBox& b) {
  return !intersect(a, b).empty();
}

std::string middle_of(const IBox& chunks) {
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
                                        : why + "; only the chunks around (" + middle_of(chunks) + ") are read: ";
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

bool has_guessed_look(const VoxelProperties& properties) {
  return properties.attributes.contains(minecraft::kGuessAttribute) ||
         properties.attributes.contains(models::kNodeGuessAttribute);
}

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
