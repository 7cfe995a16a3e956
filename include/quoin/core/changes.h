#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include <quoin/core/vec.h>

namespace [[gnu::visibility("default")]] quoin {

/// Returns a serial number that is unique in this process and never 0. Identifies journals and slot-map elements.
/// Threads: any.
[[nodiscard]] std::uint64_t next_serial();

/// A consumer's read position in the change journal of a container (Grid, DensityGrid, VoxelRegistry, Scene).
///
///   quoin::ChangeCursor cursor;                              // has read nothing
///   const quoin::GridChanges changes = grid.changes_since(cursor);
///   if (changes.all) forget_everything();                    // the first time, and rarely again
///   for (const quoin::IVec3 chunk : quoin::chunks_to_mesh(grid, changes)) mesh(grid.neighbourhood(chunk));
///
/// Each consumer owns a cursor. Reading changes moves only that cursor, so consumers are independent of each other.
///
/// Snapshots:  a cursor can move between a container and its snapshots.
/// Unknown:    a cursor may also be used with an unrelated container, or with a replacement for its container. The
///             container then reports that everything changed (`Changes::all`).
/// Capacity:   a journal keeps up to 8,192 changes plus twice the number of chunks (types, instances). A cursor that is
///             further behind gets `Changes::all`. Recording starts when the first cursor reads; until then, edits
///             have no journal cost.
/// Cost:       proportional to the number of changes, independent of the container's size.
/// Failure:    if a read throws (bad_alloc), the cursor is unchanged. A consumer that may fail later reads with
///             PendingChanges.
class ChangeCursor {
 public:
  bool operator==(const ChangeCursor&) const = default;
  /// Returns true if both cursors were last used with the same container, at any position. Returns false if either is
  /// unused.
  [[nodiscard]] bool shares_container_with(const ChangeCursor& other) const {
    return container_ != 0 && container_ == other.container_;
  }

 private:
  template <class Record>
  friend class ChangeJournal;
  std::uint64_t container_ = 0;
  std::uint64_t next_ = 0;
};

/// The changes between two states of a container.
///
///   for (const quoin::IVec3 chunk : grid.changes_since(cursor).chunks(grid)) make_again(chunk);
///
///   if (changes.all) forget_everything();  // or, for more than the coordinates of chunks:
///   for (const quoin::ChunkChange& change : changes.items_unless_all()) make_again(change);
template <class Change>
class Changes {
 public:
  Changes() = default;
  /// Requires: each chunk (type) once, in the container's order.
  explicit Changes(std::vector<Change> items) : items_(std::move(items)) {}

  bool all = false;  ///< anything may have changed or been removed; nothing is listed

  [[nodiscard]] bool empty() const { return !all && items_.empty(); }

  /// Returns the chunks to process again: the changed chunks or, if `all` is set, all chunks of the grid or field (all
  /// loaded chunks of a partial one). Sorted by z, then y, then x.
  ///
  /// A changed chunk may no longer exist (Grid::find_chunk returns null). If `all` is set, chunks that the caller knows
  /// from before and that are not in the result are gone.
  /// Requires: the changes lead up to the container's present state.
  template <class Container>
  [[nodiscard]] std::vector<IVec3> chunks(const Container& container) const {
    if (all) return container.loaded_chunks();
    std::vector<IVec3> changed;
    changed.reserve(items_.size());
    for (const Change& change : items_) changed.push_back(change.chunk);
    return changed;
  }

  /// Returns each changed chunk (type) once, in the container's order, and nothing if `all` is set. A loop over them
  /// does nothing the first time, so handle `all` too.
  [[nodiscard]] const std::vector<Change>& items_unless_all() const& { return items_; }
  [[nodiscard]] std::vector<Change> items_unless_all() && { return std::move(items_); }

 private:
  std::vector<Change> items_;
};

/// The result of a container's `changes_since`.
template <class Container>
using ChangesOf = decltype(std::declval<const Container&>().changes_since(std::declval<ChangeCursor&>()));

/// Changes that a consumer applies completely or not at all.
///
///   quoin::PendingChanges changes(cursor, grid);
///   if (changes->all) forget_everything();
///   for (const quoin::IVec3 chunk : quoin::chunks_to_mesh(grid, *changes)) mesh(grid.neighbourhood(chunk));
///   changes.commit();
///
/// If the consumer throws or returns before `commit`, the next read from the cursor reports that everything changed.
/// Without changes there is nothing to apply, and the cursor is at the present at once.
/// Lifetime: the cursor must outlive it. Use one at a time per cursor.
template <class Container, class Storage = ChangesOf<Container>>
class PendingChanges {
 public:
  PendingChanges(ChangeCursor& cursor, const Container& container)
    requires(!std::is_reference_v<Storage>)
      : cursor_(&cursor), end_(cursor), changes_(container.changes_since(end_)) {
    cursor = changes_.empty() ? end_ : ChangeCursor{};
  }
  /// As above. The changes are kept in `buffer`, which keeps its memory for the next use. Lifetime: the buffer must
  /// outlive it.
  PendingChanges(ChangeCursor& cursor, const Container& container, ChangesOf<Container>& buffer)
    requires(std::is_reference_v<Storage>)
      : cursor_(&cursor), end_(cursor), changes_(buffer) {
    container.changes_since(end_, changes_);
    cursor = changes_.empty() ? end_ : ChangeCursor{};
  }
  PendingChanges(const PendingChanges&) = delete;
  PendingChanges& operator=(const PendingChanges&) = delete;

  /// Call when all changes are applied.
  void commit() { *cursor_ = end_; }

  [[nodiscard]] auto& operator*() { return changes_; }
  [[nodiscard]] const auto& operator*() const { return changes_; }
  [[nodiscard]] auto* operator->() { return &changes_; }
  [[nodiscard]] const auto* operator->() const { return &changes_; }

 private:
  ChangeCursor* cursor_;
  ChangeCursor end_;
  Storage changes_;
};
template <class Container>
PendingChanges(ChangeCursor&, const Container&, ChangesOf<Container>&)
    -> PendingChanges<Container, ChangesOf<Container>&>;

// Part of the layout of Grid and DensityGrid; not for callers.

class [[gnu::visibility("hidden")]] BulkMemory;
class [[gnu::visibility("hidden")]] ChangeNotifiers;
class [[gnu::visibility("hidden")]] LoadedChunks;

/// Notifies the owner of a container about edits, for example the scene that owns a grid. The notifier stays with
/// its container object when the container's content is moved.
class ChangeNotifier {
 public:
  ChangeNotifier() = default;
  ChangeNotifier(const ChangeNotifier&) {}
  ChangeNotifier& operator=(const ChangeNotifier& other) {
    if (this != &other) notify();
    return *this;
  }
  ~ChangeNotifier() = default;

  /// Notifies the owner; call it after every edit. Only the first call since the owner last read it does work.
  void notify() {
    if (!is_notified_) [[unlikely]]
      notify_first();
  }

 private:
  friend class ChangeNotifiers;
  void notify_first();

  ChangeNotifiers* to_ = nullptr;
  std::uint32_t index_ = 0;
  bool is_notified_ = true;
};

}  // namespace quoin
