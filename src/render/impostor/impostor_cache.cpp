#include <quoin/render/impostor_cache.h>

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/caches.h"
#include "core/moved_from.h"
#include "core/work/workers.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {
namespace {

// The grid content that an impostor was built from.
struct Origin {
  ChangeCursor grid;
  ChangeCursor field;
  ChangeCursor data;        // of the grid; only used if types have shapes
  std::uint64_t types = 0;  // counter of changes of types that impostors show
  int edge = 0;
};

GridChanges everything() {
  GridChanges changes;
  changes.all = true;
  return changes;
}

// The input of a worker that builds an impostor.
struct BuildInput {
  SceneGrid grid;  // snapshots of voxels and field
  Origin origin;
  GridChanges changes;  // since the impostor that the job will find, or all
  std::shared_ptr<const VoxelRegistry> types;
};

struct Entry {
  std::shared_ptr<const Impostor> impostor;  // null until the first is ready
  Origin origin;
  std::optional<BuildInput> waiting;
  std::optional<Origin> building;
  bool is_replaced = false;  // the grid being built has been replaced: its impostor is never shown
  std::uint64_t last_use = 0;
  std::size_t refused_bytes = 0;  // size of the last impostor, refused for lack of room

  // Returns the origin of the newest impostor: waiting, being built or complete; null if none.
  [[nodiscard]] Origin* newest() {
    if (waiting) return &waiting->origin;
    return building ? &*building : impostor != nullptr ? &origin : nullptr;
  }
};
using Entries = std::map<GridHandle, Entry>;

}  // namespace

// The mutex guards all following members.
struct ImpostorCache::Impl {
  explicit Impl(const ImpostorCacheOptions& given) : options(given) {}

  void look_at(const VoxelRegistry& types);
  void ask(Entry& entry, GridHandle handle, const SceneGrid& grid, int edge);
  [[nodiscard]] bool has_other_shapes(const Grid& grid, ChangeCursor& followed) const;
  GridChanges changes_of(Entry& entry, const BuildInput& job);
  void start_workers();
  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock);
  [[nodiscard]] Entries::iterator next_to_build();
  void build(Entries::iterator entry, std::unique_lock<std::mutex>& lock);
  void put(GridHandle handle, const Origin& origin, std::shared_ptr<const Impostor> made);
  void release(Entry& entry);
  void drop(Entries::iterator entry);
  bool make_room(std::size_t bytes, std::uint64_t used_before);
  bool has_room(const Entry& entry);
  void forget_missing(const Scene& scene);
  void free_unused(std::unique_lock<std::mutex>& lock);

  const ImpostorCacheOptions options;
  mutable std::mutex mutex;
  Entries entries;
  std::deque<GridHandle> queue;  // waiting entries
  std::size_t building = 0;
  Stats stats;
  std::uint64_t built_bytes = 0;
  ChangeCursor followed_types;
  std::shared_ptr<const VoxelRegistry> types;
  std::uint64_t types_changed = 0;  // counter of changes of types that impostors show
  std::uint64_t round = 0;          // incremented at each wait
  // Impostors replaced while a caller held them. A worker frees them, because that takes time.
  std::vector<std::shared_ptr<const Impostor>> replaced;
  bool has_unused = false;  // some of these may be unused
  Workers workers{mutex};
};

void ImpostorCache::Impl::look_at(const VoxelRegistry& now) {
  PendingChanges changes(followed_types, now);
  if (has_other_visibility(*changes) || quoin::has_other_shapes(*changes, now)) {
    types = std::make_shared<const VoxelRegistry>(now);
    ++types_changed;
  }
  changes.commit();
}

// Returns true if the data of a voxel with a shape has changed. Otherwise moves the cursor to the present.
bool ImpostorCache::Impl::has_other_shapes(const Grid& grid, ChangeCursor& followed) const {
  if (types == nullptr || !types->has_shapes() || !grid.has_data_changed_since(followed)) return false;
  ChangeCursor now = followed;
  const DataChanges changes = grid.data_changes_since(now);
  if (changes.all) return true;
  for (const DataChange& change : changes.items_unless_all()) {
    const Chunk* const chunk = grid.find_chunk(change.chunk);
    if (chunk == nullptr) continue;
    for (int z = change.box.min.z; z < change.box.max.z; ++z) {
      for (int y = change.box.min.y; y < change.box.max.y; ++y) {
        for (int x = change.box.min.x; x < change.box.max.x; ++x) {
          if (types->is_shaped(chunk->get(x, y, z))) return true;
        }
      }
    }
  }
  followed = now;
  return false;
}

// Queues the grid's present state; replaces an older state in the queue.
void ImpostorCache::Impl::ask(Entry& entry, GridHandle handle, const SceneGrid& grid, int edge) {
  start_workers();
  BuildInput job;
  job.grid.grid = grid.grid.snapshot();
  job.grid.field = grid.field.snapshot();
  ChangeCursor data;
  if (types->has_shapes()) (void)job.grid.grid.data_changes_since(data);
  job.origin = {grid.grid.cursor(), grid.field.cursor(), data, types_changed, edge};
  job.types = types;
  job.changes = changes_of(entry, job);
  const bool is_new = !entry.waiting.has_value();
  if (is_new) queue.push_back(handle);
  entry.waiting = std::move(job);
  if (is_new) workers.wake_one();
}

// Returns the changes since the impostor that the job will find. An impostor of another grid (replaced, or with the
// same handle in another scene) is never used again.
GridChanges ImpostorCache::Impl::changes_of(Entry& entry, const BuildInput& job) {
  GridChanges changes = everything();
  const Origin* base = entry.building ? &*entry.building : entry.impostor != nullptr ? &entry.origin : nullptr;
  if (base == nullptr) return changes;
  ChangeCursor of_grid = base->grid;
  ChangeCursor of_field = base->field;
  GridChanges since = job.grid.grid.changes_since(of_grid);
  const DensityChanges of_samples = job.grid.field.changes_since(of_field);
  if (since.all || of_samples.all) {
    release(entry);
    entry.is_replaced = entry.building.has_value();
  }
  // Grids that have or had a field are rebuilt from scratch.
  const bool has_field = job.grid.field.chunk_count() != 0 || !of_samples.empty();
  ChangeCursor of_data = base->data;
  if (base->types == types_changed && base->edge == job.origin.edge && !has_field &&
      !has_other_shapes(job.grid.grid, of_data)) {
    changes = std::move(since);
  }
  return changes;
}

void ImpostorCache::Impl::start_workers() {
  if (workers.is_started()) return;
  workers.start(worker_count(options.workers), [this](Workers::Lock& lock, unsigned /*worker*/) { return step(lock); },
                {.name = "impostor", .priority = JobPriority::Low});
}

Workers::Clock::time_point ImpostorCache::Impl::step(Workers::Lock& lock) {
  const Entries::iterator next = has_unused ? entries.end() : next_to_build();
  if (!has_unused && next == entries.end()) return Workers::kWhenWoken;
  try {
    if (next != entries.end()) build(next, lock);
    free_unused(lock);
  } catch (const std::bad_alloc&) {
    // If memory for the lists above runs out: the impostor is dropped and requested again.
    if (!lock.owns_lock()) lock.lock();
    ++stats.out_of_memory;
  }
  return Workers::kAgain;
}

// Removes and returns the first queued entry that is not being built.
Entries::iterator ImpostorCache::Impl::next_to_build() {
  for (auto each = queue.begin(); each != queue.end(); ++each) {
    const auto entry = entries.find(*each);
    QUOIN_ASSERT(entry != entries.end() && entry->second.waiting, "a queued impostor waits");
    if (entry->second.building) continue;
    queue.erase(each);
    return entry;
  }
  return entries.end();
}

void ImpostorCache::Impl::build(Entries::iterator entry, std::unique_lock<std::mutex>& lock) {
  std::optional<BuildInput> job = std::exchange(entry->second.waiting, std::nullopt);
  if (!has_room(entry->second)) {
    drop(entry);  // until the next request
    workers.notify();
    return;
  }
  const GridHandle handle = entry->first;
  const std::shared_ptr<const Impostor> before = entry->second.impostor;
  entry->second.building = job->origin;
  ++building;
  lock.unlock();
  std::shared_ptr<const Impostor> made;
  const bool is_again = before != nullptr && !job->changes.all;
  try {
    made = std::make_shared<const Impostor>(is_again ? before->rebuilt(job->grid.grid, *job->types, job->changes)
                                                     : Impostor::build(job->grid, *job->types, {job->origin.edge}));
  } catch (const std::bad_alloc&) {
    // The build failed.
  }
  const Origin origin = job->origin;
  job.reset();  // frees the snapshot's data without the lock
  lock.lock();
  QUOIN_ASSERT(building != 0 && entry->second.building, "a finished build was started");
  --building;
  Entry& built = entry->second;
  if (std::exchange(built.is_replaced, false)) {
    built.building.reset();
    if (made != nullptr) replaced.push_back(std::move(made));
    has_unused = true;
  } else if (made != nullptr) {
    stats.rebuilt += static_cast<std::uint64_t>(is_again);
    put(handle, origin, std::move(made));
  } else {
    ++stats.out_of_memory;
    built.building.reset();
    if (built.waiting) built.waiting->changes = everything();
  }
  workers.notify();
  workers.wake_all();
}

void ImpostorCache::Impl::put(GridHandle handle, const Origin& origin, std::shared_ptr<const Impostor> made) {
  const auto entry = entries.find(handle);
  QUOIN_ASSERT(made != nullptr && entry != entries.end(), "an impostor of a requested grid");
  entry->second.building.reset();
  const std::size_t bytes = made->bytes();
  ++stats.built;
  built_bytes += bytes;
  release(entry->second);
  entry->second.refused_bytes = 0;
  if (!make_room(bytes, entry->second.last_use)) {
    ++stats.dropped;
    entry->second.refused_bytes = bytes;
    if (entry->second.waiting) entry->second.waiting->changes = everything();
    drop(entry);
    return;
  }
  ++stats.held;
  stats.bytes += bytes;
  QUOIN_ASSERT(entry->second.impostor == nullptr, "the previous impostor was released");
  entry->second.impostor = std::move(made);
  entry->second.origin = origin;
}

void ImpostorCache::Impl::release(Entry& entry) {
  if (entry.impostor == nullptr) return;
  QUOIN_ASSERT(stats.held != 0 && stats.bytes >= entry.impostor->bytes(), "held impostors are counted");
  --stats.held;
  stats.bytes -= entry.impostor->bytes();
  replaced.push_back(std::exchange(entry.impostor, nullptr));
  has_unused = true;
}

// Frees the impostor. Entries that are being built, queued or refused remain, without an impostor.
void ImpostorCache::Impl::drop(Entries::iterator entry) {
  release(entry->second);
  if (!entry->second.building && !entry->second.waiting && entry->second.refused_bytes == 0) entries.erase(entry);
}

// Makes room for `bytes` by dropping impostors last used before `used_before`. Returns false if that is impossible.
bool ImpostorCache::Impl::make_room(std::size_t bytes, std::uint64_t used_before) {
  const auto may_drop = [&](Entries::iterator each) {
    const Entry& entry = each->second;
    return entry.impostor != nullptr && !entry.waiting && !entry.building && entry.last_use < used_before;
  };
  const std::uint64_t held = drop_oldest(
      entries, stats.bytes + bytes, options.max_bytes, may_drop,
      [](Entries::iterator each) { return each->second.impostor->bytes(); },
      [&](Entries::iterator each) {
        ++stats.dropped;
        drop(each);
      });
  return held <= options.max_bytes;
}

// Estimates by the entry's own refused size, or by the mean size of built impostors.
bool ImpostorCache::Impl::has_room(const Entry& entry) {
  const std::size_t mean = stats.built == 0 ? 1 : built_bytes / stats.built;
  const std::size_t likely = std::max(entry.refused_bytes, mean);
  return entry.impostor != nullptr || make_room(likely, entry.last_use);
}

void ImpostorCache::Impl::forget_missing(const Scene& scene) {
  for (auto each = entries.begin(); each != entries.end();) {
    const auto entry = each++;
    if (scene.grids().find(entry->first) != nullptr) continue;
    if (entry->second.waiting) {
      entry->second.waiting.reset();
      std::erase(queue, entry->first);
    }
    entry->second.refused_bytes = 0;
    drop(entry);
  }
  ++round;
}

// Impostors still held by callers are checked again at the next replacement.
void ImpostorCache::Impl::free_unused(std::unique_lock<std::mutex>& lock) {
  has_unused = false;
  const auto kept = std::partition(replaced.begin(), replaced.end(),
                                   [](const std::shared_ptr<const Impostor>& each) { return each.use_count() > 1; });
  std::vector<std::shared_ptr<const Impostor>> unused(std::make_move_iterator(kept),
                                                      std::make_move_iterator(replaced.end()));
  replaced.erase(kept, replaced.end());
  lock.unlock();
  unused.clear();
  lock.lock();
}

ImpostorCache::ImpostorCache(const ImpostorCacheOptions& options) : impl_(std::make_unique<Impl>(options)) {}
ImpostorCache::ImpostorCache(ImpostorCache&&) noexcept = default;
ImpostorCache& ImpostorCache::operator=(ImpostorCache&&) noexcept = default;
ImpostorCache::~ImpostorCache() = default;

std::shared_ptr<const Impostor> ImpostorCache::find(const Scene& scene, GridHandle grid,
                                                    const ImpostorOptions& options) {
  const SceneGrid* named = scene.grids().find(grid);
  if (named == nullptr) return nullptr;
  const std::lock_guard lock(impl_of(impl_).mutex);
  impl_of(impl_).look_at(scene.types);
  Entry& entry = impl_of(impl_).entries[grid];
  entry.last_use = impl_of(impl_).round;
  Origin* newest = entry.newest();
  const bool is_current = newest != nullptr && newest->types == impl_of(impl_).types_changed &&
                          newest->edge == options.edge && !named->grid.has_changed_since(newest->grid) &&
                          !named->field.has_changed_since(newest->field) &&
                          !impl_of(impl_).has_other_shapes(named->grid, newest->data);
  if (!is_current) impl_of(impl_).ask(entry, grid, *named, options.edge);
  return entry.impostor;
}

std::size_t ImpostorCache::wait(const Scene& scene, double seconds) {
  Impl& me = impl_of(impl_);
  std::unique_lock lock(me.mutex);
  const auto is_ready = [&] { return me.queue.empty() && me.building == 0; };
  if (seconds == std::numeric_limits<double>::infinity()) {
    while (!is_ready()) {
      auto next = me.entries.end();
      me.workers.wait(lock, [&] { return is_ready() || (next = me.next_to_build()) != me.entries.end(); });
      if (next != me.entries.end()) me.build(next, lock);
    }
  } else if (seconds > 0.0) {
    constexpr double kLongest = 1e6;  // limit of the clock type
    me.workers.wait_for(lock, std::min(seconds, kLongest), is_ready);
  }
  me.forget_missing(scene);
  if (me.has_unused) me.workers.wake_one();
  return me.queue.size() + me.building;
}

void ImpostorCache::update_types(const VoxelRegistry& types) {
  const std::lock_guard lock(impl_of(impl_).mutex);
  impl_of(impl_).look_at(types);
}

ImpostorCache::Stats ImpostorCache::stats() const {
  const std::lock_guard lock(impl_of(impl_).mutex);
  Stats stats = impl_of(impl_).stats;
  stats.waiting = impl_of(impl_).queue.size() + impl_of(impl_).building;
  return stats;
}

}  // namespace quoin
