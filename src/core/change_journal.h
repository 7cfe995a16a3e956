#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/core/memory.h>
#include <quoin/core/ref.h>

namespace quoin {

/// The changes of a container in chronological order. Every `changes_since` reads such a journal.
///
///   serial    1 2 3 4 5 6 7 8 9
///   record        c d a b c a        3 to 8: kept; 1 and 2 were dropped (first_ = 3, end_ = 9)
///                       ^ seen_ = 6  no cursor has read 7 and 8: another change of `a` or `c` merges into 8 or 7
///
/// The container stores the serial of the last record with each key (a chunk, a type, an instance). The next change of
/// the key merges into that record as long as no cursor has read it. Cursors therefore read exact changes. After a
/// million edits between two frames, a container has one record per key, plus one each time a key was removed and added
/// again.
///
/// A copy (as in a snapshot) shares the existing records and keeps the container's identity. The first change of the
/// copy makes it a separate container. Copies share the list of blocks, so they allocate nothing. A change that adds a
/// block replaces a shared list.
///
/// Record: copyable, `merge(const Record&)`.
/// Threads: several threads may read and copy at once. Copies may be read while this object is written.
template <class Record>
class ChangeJournal {
 public:
  ChangeJournal() : container_(next_serial()) {}
  ChangeJournal(const ChangeJournal& other)
      : container_(other.container_), is_copy_(true), first_(other.first_), end_(other.end_), blocks_(other.blocks_) {
    // Existing records become immutable. Later ones are kept for consumers that read only copies.
    other.observe();
    seen_.store(other.seen_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  }
  ChangeJournal& operator=(const ChangeJournal&) = delete;

  /// Brings an unchanged copy up to date. `later` is its original, or a later copy of that.
  void copy_again(const ChangeJournal& later) {
    QUOIN_ASSERT(is_copy_ && container_ == later.container_ && end_ <= later.end_, "a later state of the same journal");
    later.observe();
    first_ = later.first_;
    end_ = later.end_;
    blocks_ = later.blocks_;
    seen_.store(later.seen_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  }

  /// Call before any other step of a change: a copy becomes a separate container.
  void begin_change() {
    if (is_copy_) [[unlikely]]
      become_own();
  }

  /// Records a change of a key whose last record is `serial` (0: none). `keys` is the number of keys in the container.
  /// Never throws: if out of memory, every cursor reads that everything has changed.
  void note(std::uint64_t& serial, const Record& record, std::size_t keys) {
    QUOIN_ASSERT(serial < end_, "a serial of this journal");
    const std::uint64_t seen = seen_.load(std::memory_order_relaxed);
    if (serial > seen) {
      at(serial).merge(record);
    } else if (seen != kNoConsumer) {
      append(serial, record, keys);
    }
  }

  /// Moves the cursor to the present and calls `visit(record, serial)` for each later record, oldest first. Returns
  /// false without a visit if the changes since the cursor are unknown.
  template <class Visit>
  bool visit_since(ChangeCursor& cursor, Visit&& visit) const {
    const bool is_known = knows(cursor);
    if (is_known) {
      for (std::uint64_t serial = cursor.next_; serial < end_; ++serial) visit(at(serial), serial);
    }
    observe();
    cursor.container_ = container_;
    cursor.next_ = end_;
    return is_known;
  }

  /// Implements `changes_since`: writes the changes since the cursor, each key once, sorted by `less(a, b)`, which
  /// compares records by their keys. `Record::change()` returns the change. Keeps the memory of `changes`. If it
  /// throws, the cursor stays unchanged.
  template <class Change, class Less>
  void changes_since(ChangeCursor& cursor, Less&& less, Changes<Change>& changes) const {
    changes_since(cursor, less, changes,
                  [](const Record& record, std::vector<Change>& items) { items.push_back(record.change()); });
  }
  template <class Change, class Less>
  [[nodiscard]] Changes<Change> changes_since(ChangeCursor& cursor, Less&& less) const {
    Changes<Change> changes;
    changes_since(cursor, less, changes);
    return changes;
  }
  /// Writes the changes of one aspect: `report(record, items)` appends the changes of this aspect in a record, if any.
  template <class Change, class Less, class Report>
  void changes_since(ChangeCursor& cursor, Less&& less, Changes<Change>& changes, Report&& report) const {
    std::vector<Change> items = std::move(changes).items_unless_all();  // for their memory
    items.clear();
    ChangeCursor end = cursor;
    const bool is_known = knows(cursor);
    const std::size_t count = is_known ? static_cast<std::size_t>(end_ - cursor.next_) : 0;
    if (count == 0) {
      visit_since(end, [](const Record&, std::uint64_t) {});
    } else if (count <= kFew) {
      std::array<Record, kFew> few;  // needs no memory of its own
      std::size_t used = 0;
      visit_since(end, [&](const Record& record, std::uint64_t) { insert(record, few, used, less); });
      items.reserve(used);
      for (std::size_t i = 0; i < used; ++i) report(few[i], items);
    } else {
      BlockVector<Record> records;
      records.reserve(count);
      visit_since(end, [&](const Record& record, std::uint64_t) { records.push_back(record); });
      std::stable_sort(records.begin(), records.end(), less);
      for (std::size_t i = 0; i < records.size();) {
        Record united = records[i];
        for (++i; i < records.size() && !less(united, records[i]); ++i) united.merge(records[i]);
        report(united, items);
      }
    }
    changes = Changes<Change>(std::move(items));
    changes.all = !is_known;
    cursor = end;
  }

  /// Returns a cursor at the present, as `visit_since` leaves it.
  [[nodiscard]] ChangeCursor present() const {
    ChangeCursor cursor;
    visit_since(cursor, [](const Record&, std::uint64_t) {});
    return cursor;
  }
  /// Returns true if `visit_since` would visit a record or return false.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const {
    return cursor.container_ != container_ || cursor.next_ != end_;
  }
  /// Returns true if one aspect may have changed. `serial` is the last record with a change of this aspect.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor, std::uint64_t serial) const {
    return cursor.container_ != container_ || cursor.next_ < first_ || cursor.next_ <= serial;
  }

  [[nodiscard]] std::size_t bytes() const { return block_count() * (sizeof(Block) + sizeof(std::shared_ptr<Block>)); }

 private:
  static constexpr std::uint64_t kNoConsumer = ~std::uint64_t{0};
  static constexpr std::size_t kBlock = 256;
  static constexpr std::size_t kLeast = 8192;  // minimum number of records kept, even for a small container
  // Records kept per key. If every frame changes a tenth of the keys, these are 80 frames: more than a save waits.
  static constexpr std::size_t kPerKey = 8;
  static constexpr std::size_t kFew = 16;  // changes that most frames do not exceed
  using Block = std::array<Record, kBlock>;
  struct Blocks : RefCounted {
    std::vector<std::shared_ptr<Block>> list;  // [serial / kBlock - first_ / kBlock]
  };

  [[nodiscard]] std::size_t block_count() const { return blocks_ == nullptr ? 0 : blocks_->list.size(); }

  // Inserts a record into a sorted list, or merges it into the one with its key.
  template <class Less>
  static void insert(const Record& record, std::array<Record, kFew>& sorted, std::size_t& used, Less& less) {
    std::size_t at = used;
    while (at != 0 && less(record, sorted[at - 1])) --at;
    if (at != 0 && !less(sorted[at - 1], record)) return sorted[at - 1].merge(record);
    QUOIN_ASSERT(used < kFew, "room for the record");
    std::move_backward(sorted.begin() + at, sorted.begin() + used, sorted.begin() + used + 1);
    sorted[at] = record;
    ++used;
  }

  // Returns true if the journal has all changes since the cursor.
  [[nodiscard]] bool knows(const ChangeCursor& cursor) const {
    return cursor.container_ == container_ && cursor.next_ >= first_ && cursor.next_ <= end_;
  }

  // Marks all records as possibly read.
  void observe() const { seen_.store(end_ - 1, std::memory_order_relaxed); }

  [[nodiscard]] Record& at(std::uint64_t serial) const {
    QUOIN_ASSERT(serial >= first_ && serial < end_, "a kept record");
    QUOIN_ASSERT(serial / kBlock - first_ / kBlock < block_count(), "blocks cover all kept records");
    return (*blocks_->list[static_cast<std::size_t>(serial / kBlock - first_ / kBlock)])[serial % kBlock];
  }

  // Every cursor reads that everything has changed.
  void forget() {
    blocks_.reset();
    first_ = ++end_;
    seen_.store(end_ - 1, std::memory_order_relaxed);
  }

  void append(std::uint64_t& serial, const Record& record, std::size_t keys) {
    try {
      if (end_ - first_ >= kLeast + kPerKey * keys) trim();
      if (block_count() == 0 || end_ % kBlock == 0) add_block();
    } catch (const std::bad_alloc&) {
      return forget();
    }
    serial = end_++;
    QUOIN_ASSERT(serial / kBlock - first_ / kBlock + 1 == block_count(), "the last block has the last record");
    at(serial) = record;
  }

  void add_block() {
    auto block = std::allocate_shared<Block>(BlockAllocator<Block>());
    own_list().push_back(std::move(block));
  }

  // Returns the list to change it. If copies of the journal share it, this is a new one with the same blocks.
  std::vector<std::shared_ptr<Block>>& own_list() {
    if (blocks_ == nullptr) {
      blocks_ = make_ref<Blocks>();
    } else if (blocks_.is_shared()) {
      Ref<Blocks> own = make_ref<Blocks>();
      own->list.reserve(blocks_->list.size() + 1);
      own->list.insert(own->list.end(), blocks_->list.begin(), blocks_->list.end());
      blocks_ = std::move(own);
    }
    return blocks_->list;
  }

  // Drops the oldest block. Records up to its end count as read, so that no change merges into them.
  void trim() {
    QUOIN_ASSERT(end_ - first_ > kBlock && block_count() > 1, "more blocks than are removed");
    std::vector<std::shared_ptr<Block>>& list = own_list();
    list.erase(list.begin());
    first_ = (first_ / kBlock + 1) * kBlock;
    if (seen_.load(std::memory_order_relaxed) + 1 < first_) seen_.store(first_ - 1, std::memory_order_relaxed);
  }

  void become_own() {
    is_copy_ = false;
    container_ = next_serial();
    blocks_.reset();
    first_ = end_;
    seen_.store(kNoConsumer, std::memory_order_relaxed);
  }

  std::uint64_t container_;
  bool is_copy_ = false;
  std::uint64_t first_ = 1;
  std::uint64_t end_ = 1;
  mutable std::atomic<std::uint64_t> seen_{
      kNoConsumer};     // the last serial that a cursor may have read; kNoConsumer: no cursor exists
  Ref<Blocks> blocks_;  // null: no records
};

/// The notifiers of one container: lists which of its items were edited since the last `take`.
///
/// Threads: notifiers of different items may notify concurrently.
class ChangeNotifiers {
 public:
  ChangeNotifiers() = default;
  ChangeNotifiers(const ChangeNotifiers&) = delete;
  ChangeNotifiers& operator=(const ChangeNotifiers&) = delete;

  /// Reserves memory for the number, so that neither following an item nor notifying allocates.
  void make_room(std::uint32_t index) {
    const std::lock_guard lock(mutex_);
    if (index < next_.size()) return;
    next_.resize(std::size_t{2} * index + 1, kNotNotified);
  }
  /// Makes the notifier report to this object under a number. Requires: this object outlives the notifier.
  void follow(ChangeNotifier& notifier, std::uint32_t index) {
    make_room(index);
    const std::lock_guard lock(mutex_);
    notifier.to_ = this;
    notifier.index_ = index;
    notifier.is_notified_ = false;
  }
  /// Appends the numbers of the edited items, in the order of their notifications. Each is reported again only after it
  /// is followed again.
  void take(std::vector<std::uint32_t>& taken) {
    const std::lock_guard lock(mutex_);
    taken.reserve(taken.size() + notified_);  // before the list changes
    for (std::uint32_t index = first_; index != kEnd;) {
      taken.push_back(index);
      index = std::exchange(next_[index], kNotNotified);
    }
    first_ = last_ = kEnd;
    notified_ = 0;
  }

 private:
  friend class ChangeNotifier;
  void notify(std::uint32_t index) {
    const std::lock_guard lock(mutex_);
    QUOIN_ASSERT(index < next_.size(), "an index of a followed item");
    // A number is listed once, even if its item was removed and another item now has the number.
    if (next_[index] != kNotNotified) return;
    next_[index] = kEnd;
    (first_ == kEnd ? first_ : next_[last_]) = index;
    last_ = index;
    ++notified_;
  }

  static constexpr std::uint32_t kEnd = ~std::uint32_t{0};
  static constexpr std::uint32_t kNotNotified = kEnd - 1;

  std::mutex mutex_;
  std::vector<std::uint32_t> next_;  // by number: the next one of the list of notified ones
  std::uint32_t first_ = kEnd;
  std::uint32_t last_ = kEnd;
  std::size_t notified_ = 0;
};

}  // namespace quoin
