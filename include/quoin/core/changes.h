#pragma once

#include <cstdint>
#include <vector>

namespace quoin {

/// A number that nothing in this process had before; never 0. Journals and elements of slot maps are told apart by it.
/// Threads: any.
[[nodiscard]] std::uint64_t next_serial();

/// How far a consumer has read the journal of changes of a container (Grid, DensityGrid, VoxelRegistry, Scene).
///
///   quoin::ChangeCursor cursor;                              // has read nothing
///   const quoin::GridChanges changes = grid.changes_since(cursor);
///   if (changes.all) forget_everything();                    // the first time, and rarely again
///   for (const quoin::IVec3 chunk : quoin::chunks_to_mesh(grid, changes)) mesh(grid.neighbourhood(chunk));
///
/// Each consumer has a cursor of its own; asking moves that cursor and no other, so consumers do not know of each
/// other. A cursor read from a container can be asked of its snapshots, and the other way round. It may also be asked
/// of any other container, and of one that took the place of the one it read: then all has changed. Asking costs time
/// in proportion to what changed, whatever the size of the container. A journal keeps as many changes as the container
/// has chunks (types, instances), twice, and some thousands; a cursor that is further behind is told that all has
/// changed. Before the first cursor there is no journal, and edits do not pay for one. When a consumer fails halfway,
/// it goes on with a copy of the cursor from before.
class ChangeCursor {
 public:
  bool operator==(const ChangeCursor&) const = default;
  /// Whether both are of the same container, at whatever times; never so of one that was not used yet.
  [[nodiscard]] bool is_beside(const ChangeCursor& other) const {
    return container_ != 0 && container_ == other.container_;
  }

 private:
  template <class Record>
  friend class ChangeJournal;
  std::uint64_t container_ = 0;
  std::uint64_t next_ = 0;
};

/// What changed between two states of a container.
template <class Change>
struct Changes {
  bool all = false;           ///< anything may have changed, what is no longer there included; `items` is empty
  std::vector<Change> items;  ///< each chunk (type, handle) once, in the order in which the container lists them

  [[nodiscard]] bool empty() const { return !all && items.empty(); }
};

// Part of the layout of Grid and DensityGrid, of no use to callers.

class EditNotices;

/// By it a container tells the one that holds it (a grid its scene) that it was edited. It stays where it is when the
/// container's content is moved.
class EditNotice {
 public:
  EditNotice() = default;
  EditNotice(const EditNotice&) {}
  EditNotice& operator=(const EditNotice& other) {
    if (this != &other) give();
    return *this;
  }
  ~EditNotice() = default;

  /// After every edit; costs something the first time since it was last taken.
  void give() {
    if (!is_given_) [[unlikely]]
      give_first();
  }

 private:
  friend class EditNotices;
  void give_first();

  EditNotices* to_ = nullptr;
  std::uint32_t index_ = 0;
  bool is_given_ = true;
};

}  // namespace quoin
