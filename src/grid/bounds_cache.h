#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>

#include <quoin/core/changes.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

#include "core/change_journal.h"
#include "core/coordinates/chunk_boxes.h"

namespace quoin {

/// The bounds of a grid, cached between calls. Changes inside the bounds that do not touch their sides keep the cached
/// bounds. After any other change, the cache keeps the boxes of all chunks.
///
/// `Entries` are the grid's chunks, with the serial of their last record, and `Record` is the record type of its
/// journal. `BoxOfEntry::of(entry)` returns the box of the counted voxels in one chunk, in the chunk's coordinates.
/// Threads: queries may run concurrently.
template <class Record, class Entries, class BoxOfEntry>
class BoundsCache {
 public:
  BoundsCache() : is_wanted_(std::make_shared<std::atomic<bool>>(false)) {}
  /// Copies keep no boxes until they need them.
  BoundsCache(const BoundsCache& other) : is_wanted_(other.is_wanted_) {
    const std::lock_guard lock(other.mutex_);
    cursor_ = other.cursor_;
    box_ = other.box_;
  }

  /// Call before a copy is made. If bounds were ever requested, updates them first, so that each copy starts from
  /// current bounds and not from those of the last request.
  void prepare(const ChangeJournal<Record>& journal, const Entries& entries) {
    if (is_wanted_->load(std::memory_order_relaxed)) update(journal, entries);
  }

  IBox update(const ChangeJournal<Record>& journal, const Entries& entries) {
    is_wanted_->store(true, std::memory_order_relaxed);
    const std::lock_guard lock(mutex_);
    bool is_within_all = true;
    ChangeCursor now = cursor_;
    const bool is_known = journal.visit_since(now, [&](const Record& record, std::uint64_t serial) {
      is_within_all = is_within_all && is_within(record);
      if (boxes_ != nullptr) put(record.chunk, serial, entries);
    });
    if (!is_known) {
      boxes_.reset();
      box_ = {};
      entries.for_each([&](IVec3 at, const auto& entry) { box_ = unite(box_, box_of(at, entry)); });
    } else if (!is_within_all) {
      if (boxes_ == nullptr) {
        auto made = std::make_unique<ChunkBoxes>();
        entries.for_each([&](IVec3 at, const auto& entry) { made->put(at, box_of(at, entry)); });
        boxes_ = std::move(made);
      }
      box_ = boxes_->bounds();
    }
    cursor_ = now;
    return box_;
  }
  [[nodiscard]] std::size_t bytes() const {
    const std::lock_guard lock(mutex_);
    return boxes_ == nullptr ? 0 : boxes_->bytes();
  }

 private:
  static IBox box_of(IVec3 at, const auto& entry) {
    const IBox inside = BoxOfEntry::of(entry);
    return {inside.min + at * kChunkEdge, inside.max + at * kChunkEdge};
  }
  // Leaves out chunks with a later record: a chunk that changes in each frame has many.
  void put(IVec3 chunk, std::uint64_t serial, const Entries& entries) {
    const auto* const entry = entries.find(chunk.x, chunk.y, chunk.z);
    if (entry != nullptr && entry->serial > serial) return;
    boxes_->put(chunk, entry == nullptr ? IBox{} : box_of(chunk, *entry));
  }
  [[nodiscard]] static bool changes_voxels(const Record& record) {
    if constexpr (requires { record.has_types(); }) return record.has_types();
    return true;
  }
  [[nodiscard]] bool is_within(const Record& record) const {
    if (!changes_voxels(record)) return true;
    if (box_.empty()) return false;
    const IBox changed = record.change().box;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t first = std::int64_t{record.chunk[axis]} * kChunkEdge;
      if (first + changed.min[axis] <= box_.min[axis] || first + changed.max[axis] >= box_.max[axis]) return false;
    }
    return true;
  }

  std::shared_ptr<std::atomic<bool>> is_wanted_;  // shared with copies
  mutable std::mutex mutex_;
  ChangeCursor cursor_;
  IBox box_;
  std::unique_ptr<ChunkBoxes> boxes_;
};

}  // namespace quoin
