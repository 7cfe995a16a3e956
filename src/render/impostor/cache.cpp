#include <quoin/render/impostor_cache.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

namespace quoin {
namespace {

// Which voxels an impostor was made of.
struct Origin {
  ChangeCursor grid;
  std::uint64_t types = 0;  // how often the transparency of types had changed
};

struct Entry {
  std::shared_ptr<const Impostor> impostor;  // null until the first is ready
  Origin origin;
  std::uint64_t last_use = 0;
  bool is_waiting = false;
};

}  // namespace

struct ImpostorCache::Impl {
  ImpostorCacheOptions options;
  mutable std::mutex mutex;
  std::map<GridHandle, Entry> entries;
  std::deque<GridHandle> waiting;
  ImpostorCacheStats stats;
  std::uint64_t built_bytes = 0;
  ChangeCursor followed_types;
  std::uint64_t types_changed = 0;  // how often, in whether they are transparent
  std::uint64_t round = 0;          // of build_some

  std::optional<GridHandle> take_waiting() {
    const std::lock_guard lock(mutex);
    if (waiting.empty()) return std::nullopt;
    const GridHandle next = waiting.front();
    waiting.pop_front();
    return next;
  }

  void drop(std::map<GridHandle, Entry>::iterator entry) {
    release(entry->second);
    entries.erase(entry);
  }

  void release(Entry& entry) {
    if (entry.impostor == nullptr) return;
    --stats.held;
    stats.bytes -= entry.impostor->bytes();
    entry.impostor = nullptr;
  }

  // Makes room for so many bytes by dropping what was not used since `used_before`; whether that was possible.
  bool make_room(std::size_t bytes, std::uint64_t used_before) {
    while (stats.bytes + bytes > options.max_bytes) {
      auto oldest = entries.end();
      for (auto each = entries.begin(); each != entries.end(); ++each) {
        if (each->second.impostor == nullptr || each->second.is_waiting || each->second.last_use >= used_before)
          continue;
        if (oldest == entries.end() || each->second.last_use < oldest->second.last_use) oldest = each;
      }
      if (oldest == entries.end()) return false;
      ++stats.dropped;
      drop(oldest);
    }
    return true;
  }

  void forget(GridHandle grid) {
    const std::lock_guard lock(mutex);
    if (const auto entry = entries.find(grid); entry != entries.end()) drop(entry);
  }

  // Whether the grid is still to be built, going by the mean size of those that were. Where there is no room it is
  // forgotten until it is asked for again.
  bool has_room(GridHandle grid) {
    const std::lock_guard lock(mutex);
    const auto entry = entries.find(grid);
    if (entry == entries.end()) return false;
    const std::size_t likely = stats.built == 0 ? 1 : built_bytes / stats.built;
    if (entry->second.impostor != nullptr || make_room(likely, entry->second.last_use)) return true;
    entries.erase(entry);
    return false;
  }

  // Requires: the lock.
  [[nodiscard]] Origin origin_of(const Grid& grid) const { return {grid.cursor(), types_changed}; }
  [[nodiscard]] bool is_current(const Entry& entry, const Grid& grid) const {
    return entry.origin.types == types_changed && !grid.has_changed_since(entry.origin.grid);
  }

  void look_at(const VoxelRegistry& types) {
    const std::lock_guard lock(mutex);
    if (has_other_visibility(types.changes_since(followed_types))) ++types_changed;
  }

  void put(GridHandle grid, const Origin& origin, std::shared_ptr<const Impostor> made) {
    const std::lock_guard lock(mutex);
    const auto entry = entries.try_emplace(grid).first;
    const std::size_t bytes = made->bytes();
    ++stats.built;
    built_bytes += bytes;
    release(entry->second);
    if (!make_room(bytes, entry->second.last_use)) {
      ++stats.dropped;
      entries.erase(entry);
      return;
    }
    ++stats.held;
    stats.bytes += bytes;
    entry->second = {std::move(made), origin, entry->second.last_use, false};
  }

  void forget_missing(const Scene& scene) {
    const std::lock_guard lock(mutex);
    for (auto each = entries.begin(); each != entries.end();) {
      const auto entry = each++;
      if (!entry->second.is_waiting && scene.grids().find(entry->first) == nullptr) drop(entry);
    }
    ++round;
  }

  void build(const Scene& scene, GridHandle handle) {
    const SceneGrid* grid = scene.grids().find(handle);
    if (grid == nullptr) return forget(handle);
    if (!has_room(handle)) return;
    Origin origin;
    {
      const std::lock_guard lock(mutex);
      origin = origin_of(grid->grid);
    }
    try {
      put(handle, origin, std::make_shared<Impostor>(Impostor::build(grid->grid, scene.types)));
    } catch (...) {
      // It may be asked for again.
      const std::lock_guard lock(mutex);
      if (const auto entry = entries.find(handle); entry != entries.end()) entry->second.is_waiting = false;
      throw;
    }
  }
};

ImpostorCache::ImpostorCache(const ImpostorCacheOptions& options) : impl_(std::make_unique<Impl>()) {
  impl_->options = options;
}
ImpostorCache::ImpostorCache(ImpostorCache&&) noexcept = default;
ImpostorCache& ImpostorCache::operator=(ImpostorCache&&) noexcept = default;
ImpostorCache::~ImpostorCache() = default;

std::shared_ptr<const Impostor> ImpostorCache::find(const Scene& scene, GridHandle grid) {
  const SceneGrid* named = scene.grids().find(grid);
  if (named == nullptr) return nullptr;
  const std::lock_guard lock(impl_->mutex);
  Entry& entry = impl_->entries[grid];
  entry.last_use = impl_->round;
  if ((entry.impostor == nullptr || !impl_->is_current(entry, named->grid)) && !entry.is_waiting) {
    impl_->waiting.push_back(grid);
    entry.is_waiting = true;
  }
  return entry.impostor;
}

std::size_t ImpostorCache::build_some(const Scene& scene, double budget_seconds, Threads threads) {
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  impl_->look_at(scene.types);
  const auto is_over = [&] { return !(std::chrono::duration<double>(Clock::now() - begin).count() < budget_seconds); };
  const std::size_t count = thread_count(threads);
  parallel_for(count, threads, [&](std::size_t i) {
    bool is_first = i == 0;
    while (is_first || !is_over()) {
      is_first = false;
      const std::optional<GridHandle> next = impl_->take_waiting();
      if (!next) return;
      impl_->build(scene, *next);
    }
  });
  impl_->forget_missing(scene);
  const std::lock_guard lock(impl_->mutex);
  return impl_->waiting.size();
}

void ImpostorCache::update_types(const VoxelRegistry& types) {
  impl_->look_at(types);
}

ImpostorCacheStats ImpostorCache::stats() const {
  const std::lock_guard lock(impl_->mutex);
  ImpostorCacheStats stats = impl_->stats;
  stats.waiting = impl_->waiting.size();
  return stats;
}

}  // namespace quoin
