#include "store/meshes/chunk_cache.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/drop_oldest.h"
#include "store/world/world_rules.h"

namespace quoin::store {

ChunkCache::ChunkCache(const WorldStore& world, std::uint32_t grid, std::size_t bytes)
    : world_(world), grid_(grid), max_bytes_(bytes) {
  auto places = world.chunks(grid, 0);
  if (!places) {
    status_ = places.error();
    return;
  }
  places_ = std::move(*places);
}

void ChunkCache::load(std::span<const IVec3> places, Threads threads) {
  ++now_;
  std::vector<IVec3> missing;
  const auto before = [](IVec3 a, IVec3 b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); };
  for (const IVec3 place : places) {
    const auto found = loaded_.find(place);
    if (found != loaded_.end()) {
      found->second.last_use = now_;
    } else if (std::ranges::binary_search(places_, place, before)) {
      missing.push_back(place);
    }
  }
  std::vector<std::optional<Result<std::optional<StoredChunk>>>> read(missing.size());
  parallel_for(missing.size(), threads, [&](std::size_t i) { read[i] = world_.load_chunk({grid_, 0, missing[i]}); });
  for (std::size_t i = 0; i < missing.size(); ++i) {
    Result<std::optional<StoredChunk>>& outcome = *read[i];
    const bool is_new = counted_.insert(missing[i]).second;
    Entry entry;
    entry.last_use = now_;
    if (!outcome) {
      if (outcome.error().code != ErrorCode::BadFormat && status_) status_ = outcome.error();
      if (is_new) damage_.push_back(outcome.error().message);
    } else if (*outcome) {
      entry.chunk = std::move((*outcome)->voxels);
      if (is_new) {
        voxels_ += entry.chunk.non_air_count();
        data_ += static_cast<std::int64_t>(entry.chunk.data_count());
      }
      has_densities_ = has_densities_ || (*outcome)->densities.has_value();
    }
    bytes_ += entry.chunk.bytes();
    loaded_.insert_or_assign(missing[i], std::move(entry));
  }
}

const Chunk* ChunkCache::find(IVec3 place) const {
  const auto found = loaded_.find(place);
  return found == loaded_.end() ? nullptr : &found->second.chunk;
}

void ChunkCache::trim() {
  if (bytes_ <= max_bytes_) return;
  // Drops more than necessary, so that the cache is not searched for each chunk.
  bytes_ = drop_oldest(
      loaded_, bytes_, max_bytes_ / 8 * 7, [&](auto each) { return each->second.last_use != now_; },
      [](auto each) { return each->second.chunk.bytes(); }, [&](auto each) { loaded_.erase(each); });
}

}  // namespace quoin::store
