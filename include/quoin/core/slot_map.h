#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>

namespace quoin {

/// Names an element of a SlotMap<T>; stays invalid for ever once that element is removed. The default names nothing.
/// In a copy of the map (SlotMap::copied) it names the copy of that element. In any other map it names nothing, also
/// where both were filled alike; what is inserted into one of the two after the copy has no name in the other.
template <class T>
struct Handle {
  std::uint32_t index = 0xFFFFFFFFu;  ///< the slot
  std::uint64_t generation = 0;       ///< of the element: no other one of this process has the same; 0: none

  bool operator==(const Handle& other) const = default;
  /// By slot; gives a stable order for things drawn at equal depth.
  bool operator<(const Handle& other) const {
    return index != other.index ? index < other.index : generation < other.generation;
  }
};

/// Values by generational handle: O(1) insert, remove and find; iteration in slot order. An element stays at its
/// address until it is removed, whatever else is inserted, and when the map is moved.
template <class T>
class SlotMap {
 public:
  SlotMap() = default;
  /// Leaves the other empty; its handles name the elements here.
  SlotMap(SlotMap&& other) noexcept
      : pages_(std::exchange(other.pages_, {})),
        free_(std::exchange(other.free_, {})),
        count_(std::exchange(other.count_, 0)),
        size_(std::exchange(other.size_, 0)) {}
  SlotMap& operator=(SlotMap&& other) noexcept {
    SlotMap taken(std::move(other));
    std::swap(pages_, taken.pages_);
    std::swap(free_, taken.free_);
    std::swap(count_, taken.count_);
    std::swap(size_, taken.size_);
    return *this;
  }
  ~SlotMap() = default;

  /// Puts a value in a free slot. Returns its handle.
  /// Errors: bad_alloc, and what moving a T throws; the map is then as it was.
  Handle<T> insert(T value) {
    const std::uint32_t index = next_index();
    if (index / kPage == pages_.size()) pages_.push_back(std::make_unique<Page>());
    Slot& slot = slot_at(index);
    slot.value.emplace(std::move(value));
    slot.generation = next_serial();
    if (index == count_) {
      ++count_;
    } else {
      free_.pop_back();
    }
    ++size_;
    return {index, slot.generation};
  }
  /// The slot that the next element is put into: Handle::index of what `insert` returns.
  [[nodiscard]] std::uint32_t next_index() const { return free_.empty() ? count_ : free_.back(); }

  /// Ends the element and its handle. Returns false when the handle names nothing.
  bool remove(Handle<T> handle) {
    if (find(handle) == nullptr) return false;
    free_.push_back(handle.index);  // first, since it may throw
    Slot& slot = slot_at(handle.index);
    slot.value.reset();
    slot.generation = 0;
    --size_;
    return true;
  }

  /// Null when the handle names nothing (never inserted, or removed since). Lifetime: the map owns the element.
  [[nodiscard]] const T* find(Handle<T> handle) const {
    if (handle.index >= count_) return nullptr;
    const Slot& slot = slot_at(handle.index);
    return slot.value.has_value() && slot.generation == handle.generation ? &*slot.value : nullptr;
  }
  [[nodiscard]] T* find(Handle<T> handle) { return const_cast<T*>(std::as_const(*this).find(handle)); }

  /// Requires: the handle names an element.
  [[nodiscard]] const T& operator[](Handle<T> handle) const {
    const T* found = find(handle);
    QUOIN_ASSERT(found != nullptr, "the handle names an element");
    return *found;
  }
  [[nodiscard]] T& operator[](Handle<T> handle) { return const_cast<T&>(std::as_const(*this)[handle]); }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

  /// The handles of all elements, in slot order.
  [[nodiscard]] std::vector<Handle<T>> handles() const {
    std::vector<Handle<T>> all;
    all.reserve(size_);
    for_each([&](Handle<T> handle, const T&) { all.push_back(handle); });
    return all;
  }
  /// The handle of the element in a slot, if any.
  [[nodiscard]] std::optional<Handle<T>> handle_at(std::uint32_t index) const {
    if (index >= count_ || !slot_at(index).value.has_value()) return std::nullopt;
    return Handle<T>{index, slot_at(index).generation};
  }

  /// Calls `visit(handle, value)` for every element, in slot order. Requires: `visit` neither inserts nor removes.
  template <class Visit>
  void for_each(Visit&& visit) const {
    std::uint32_t index = 0;
    for (const std::unique_ptr<Page>& page : pages_) {
      for (const Slot& slot : *page) {
        if (slot.value.has_value()) visit(Handle<T>{index, slot.generation}, *slot.value);
        ++index;
      }
    }
  }

  /// A map with the same handles, of `copy(value)`.
  template <class Copy>
  [[nodiscard]] SlotMap copied(Copy&& copy) const {
    SlotMap made;
    made.pages_.reserve(pages_.size());
    for (const std::unique_ptr<Page>& page : pages_) {
      Page& to = *made.pages_.emplace_back(std::make_unique<Page>());
      for (std::size_t i = 0; i < kPage; ++i) {
        to[i].generation = (*page)[i].generation;
        if ((*page)[i].value.has_value()) to[i].value.emplace(copy(*(*page)[i].value));
      }
    }
    made.free_ = free_;
    made.count_ = count_;
    made.size_ = size_;
    return made;
  }

 private:
  struct Slot {
    std::optional<T> value;
    std::uint64_t generation = 0;  // of the value; 0: none
  };
  static constexpr std::size_t kPage = 32;
  using Page = std::array<Slot, kPage>;

  [[nodiscard]] const Slot& slot_at(std::uint32_t index) const { return (*pages_[index / kPage])[index % kPage]; }
  [[nodiscard]] Slot& slot_at(std::uint32_t index) { return (*pages_[index / kPage])[index % kPage]; }

  std::vector<std::unique_ptr<Page>> pages_;
  std::vector<std::uint32_t> free_;
  std::uint32_t count_ = 0;  // slots that were ever used
  std::size_t size_ = 0;
};

}  // namespace quoin

/// So that handles are keys of std::unordered_map.
template <class T>
struct std::hash<quoin::Handle<T>> {
  [[nodiscard]] std::size_t operator()(const quoin::Handle<T>& handle) const noexcept {
    return std::hash<std::uint64_t>()(handle.generation);  // no two elements have the same
  }
};
