#include <quoin/io/chunk_source.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <quoin/core/assert.h>

#include "core/drop_oldest.h"

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

}  // namespace quoin
