#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>

namespace quoin {

/// The changes of a container in the order in which they happened: what stands behind every `changes_since`.
///
///   serial    1 2 3 4 5 6 7 8 9
///   record        c d a b c a        3 to 8: kept; 1 and 2 were let go (first_ = 3, end_ = 9)
///                       ^ seen_ = 6  no cursor has read what came later: another change of `a` or `c` joins 8 or 7
///
/// A key (a chunk, a type, an instance) has the serial of its last record beside it, kept by the container, so that its
/// next change joins that record as long as nobody has read it. So what a cursor is told is exact, and of a container
/// that is edited a million times between two frames there are as many records as keys, and one more each time that a
/// key went and came again.
///
/// A copy (a snapshot's) shares the records up to then and goes by the same name; when it is changed itself, it becomes
/// a container of its own.
/// Record: copyable, `merge(const Record&)`. Threads: any number may read and copy at once, and copies may be read
/// while this is written.
template <class Record>
class ChangeJournal {
 public:
  ChangeJournal() : container_(next_serial()) {}
  ChangeJournal(const ChangeJournal& other)
      : container_(other.container_), is_copy_(true), first_(other.first_), end_(other.end_), blocks_(other.blocks_) {
    // The records stay as they are from now on, and later ones are kept for consumers that read only copies.
    other.observe();
    seen_.store(other.seen_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  }
  ChangeJournal& operator=(const ChangeJournal&) = delete;

  /// Before anything else of a change: a copy becomes a container of its own.
  void begin_change() {
    if (is_copy_) [[unlikely]]
      become_own();
  }

  /// Books a change of a key with `serial`, 0 at first. `keys` are those of the container. Never throws: where there is
  /// no memory, all has changed.
  void note(std::uint64_t& serial, const Record& record, std::size_t keys) {
    QUOIN_ASSERT(serial < end_, "a serial of this journal");
    const std::uint64_t seen = seen_.load(std::memory_order_relaxed);
    if (serial > seen) {
      at(serial).merge(record);
    } else if (seen != kNobody) {
      append(serial, record, keys);
    }
  }

  /// Moves the cursor to the present; calls `visit(record)` for what came after it, oldest first. False, without a
  /// visit, when that is not known.
  template <class Visit>
  bool visit_since(ChangeCursor& cursor, Visit&& visit) const {
    const bool is_known = cursor.container_ == container_ && cursor.next_ >= first_ && cursor.next_ <= end_;
    if (is_known) {
      for (std::uint64_t serial = cursor.next_; serial < end_; ++serial) visit(at(serial));
    }
    observe();
    cursor.container_ = container_;
    cursor.next_ = end_;
    return is_known;
  }

  /// What every `changes_since` returns: the changes since the cursor, each key once, in the order of `less(a, b)`,
  /// which compares records by their keys. Records tell of a change by `change()`.
  template <class Change, class Less>
  [[nodiscard]] Changes<Change> changes_since(ChangeCursor& cursor, Less&& less) const {
    return changes_since<Change>(
        cursor, less, [](const Record& record, std::vector<Change>& items) { items.push_back(record.change()); });
  }
  /// The same of one aspect: `tell(record, items)` appends what a record says of that, if anything.
  template <class Change, class Less, class Tell>
  [[nodiscard]] Changes<Change> changes_since(ChangeCursor& cursor, Less&& less, Tell&& tell) const {
    std::vector<Record> records;
    Changes<Change> changes;
    changes.all = !visit_since(cursor, [&](const Record& record) { records.push_back(record); });
    std::stable_sort(records.begin(), records.end(), less);
    for (std::size_t i = 0; i < records.size();) {
      Record united = records[i];
      for (++i; i < records.size() && !less(united, records[i]); ++i) united.merge(records[i]);
      tell(united, changes.items);
    }
    return changes;
  }

  /// What `visit_since` does to a cursor.
  [[nodiscard]] ChangeCursor present() const {
    ChangeCursor cursor;
    visit_since(cursor, [](const Record&) {});
    return cursor;
  }
  /// Whether `visit_since` would tell of anything.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const {
    return cursor.container_ != container_ || cursor.next_ != end_;
  }
  /// The same of one aspect, of which nothing is told in records after the one with `serial`.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor, std::uint64_t serial) const {
    return cursor.container_ != container_ || cursor.next_ < first_ || cursor.next_ <= serial;
  }

  [[nodiscard]] std::size_t bytes() const { return blocks_.size() * (sizeof(Block) + sizeof(blocks_[0])); }

 private:
  static constexpr std::uint64_t kNobody = ~std::uint64_t{0};
  static constexpr std::size_t kBlock = 256;
  static constexpr std::size_t kLeast = 8192;  // records that are kept, however small the container
  using Block = std::array<Record, kBlock>;

  // What is there was read, or may have been.
  void observe() const { seen_.store(end_ - 1, std::memory_order_relaxed); }

  [[nodiscard]] Record& at(std::uint64_t serial) const {
    QUOIN_ASSERT(serial >= first_ && serial < end_, "a record that is kept");
    QUOIN_ASSERT(serial / kBlock - first_ / kBlock < blocks_.size(), "blocks cover all that is kept");
    return (*blocks_[static_cast<std::size_t>(serial / kBlock - first_ / kBlock)])[serial % kBlock];
  }

  // Whoever asks next is told that all has changed.
  void forget() {
    blocks_.clear();
    first_ = ++end_;
    seen_.store(end_ - 1, std::memory_order_relaxed);
  }

  void append(std::uint64_t& serial, const Record& record, std::size_t keys) {
    if (end_ - first_ >= kLeast + 2 * keys) let_go();
    if (blocks_.empty() || end_ % kBlock == 0) {
      try {
        blocks_.push_back(std::make_shared<Block>());
      } catch (const std::bad_alloc&) {
        return forget();
      }
    }
    serial = end_++;
    at(serial) = record;
  }

  // The oldest block goes; and what is left of it counts as read, so that nothing joins it.
  void let_go() {
    QUOIN_ASSERT(end_ - first_ > kBlock && blocks_.size() > 1, "more than what goes");
    first_ = (first_ / kBlock + 1) * kBlock;
    blocks_.erase(blocks_.begin());
    if (seen_.load(std::memory_order_relaxed) + 1 < first_) seen_.store(first_ - 1, std::memory_order_relaxed);
  }

  void become_own() {
    is_copy_ = false;
    container_ = next_serial();
    blocks_.clear();
    first_ = end_;
    seen_.store(kNobody, std::memory_order_relaxed);
  }

  std::uint64_t container_;
  bool is_copy_ = false;
  std::uint64_t first_ = 1;
  std::uint64_t end_ = 1;
  mutable std::atomic<std::uint64_t> seen_{
      kNobody};                                 // the last serial that a cursor may have read; kNobody: none asked
  std::vector<std::shared_ptr<Block>> blocks_;  // [serial / kBlock - first_ / kBlock]
};

}  // namespace quoin
