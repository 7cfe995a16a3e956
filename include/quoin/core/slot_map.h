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
#include <quoin/core/memory.h>

namespace [[gnu::visibility("default")]] quoin {

/// A handle to an element of a SlotMap<T>. It becomes invalid for good when the element is removed. A default handle is
/// invalid.
///
/// In a copy of the map (SlotMap::copied), the handle refers to the copied element. It is invalid in every other map,
/// even if both maps were filled in the same way. An element inserted after the copy has no handle in the other map.
template <class T>
struct Handle {
  std::uint32_t index = 0xFFFFFFFFu;  ///< slot index
  std::uint64_t generation = 0;       ///< unique per element in this process; 0 means none

  bool operator==(const Handle& other) const = default;
  /// Orders handles by slot, for a stable order of objects drawn at equal depth.
  bool operator<(const Handle& other) const {
    return index != other.index ? index < other.index : generation < other.generation;
  }
};

/// A container that finds its values by generational handle. Insert, remove and find are O(1); iteration is in slot
/// order. An element keeps its address until it is removed, even if other elements are inserted or the map is moved.
template <class T>
class SlotMap {
 public:
  SlotMap() = default;
  /// Moves the elements and leaves the other map empty. Existing handles stay valid in this map.
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

  /// Inserts a value into a free slot and returns its handle.
  /// Errors: bad_alloc, or an exception from moving a T. The map is then unchanged.
  Handle<T> insert(T value) {
    const std::uint32_t index = next_index();
    if (index / kPage == pages_.size()) pages_.push_back(std::make_unique<Page>());
    Slot& slot = slot_at(index);
    QUOIN_ASSERT(!slot.value.has_value(), "a free slot");
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
  /// Returns the slot of the next inserted element (the Handle::index that `insert` returns next).
  [[nodiscard]] std::uint32_t next_index() const { return free_.empty() ? count_ : free_.back(); }

  /// Removes an element and invalidates its handle. Returns false if the handle is invalid.
  bool remove(Handle<T> handle) {
    if (find(handle) == nullptr) return false;
    free_.push_back(handle.index);  // first, because it may throw
    Slot& slot = slot_at(handle.index);
    slot.value.reset();
    slot.generation = 0;
    --size_;
    return true;
  }

  /// Returns the element, or null if the handle is invalid. Lifetime: the map owns the element.
  [[nodiscard]] const T* find(Handle<T> handle) const {
    if (handle.index >= count_) return nullptr;
    const Slot& slot = slot_at(handle.index);
    return slot.value.has_value() && slot.generation == handle.generation ? &*slot.value : nullptr;
  }
  [[nodiscard]] T* find(Handle<T> handle) { return const_cast<T*>(std::as_const(*this).find(handle)); }

  /// Returns the element. Requires: the handle is valid.
  [[nodiscard]] const T& operator[](Handle<T> handle) const {
    const T* found = find(handle);
    QUOIN_ASSERT(found != nullptr, "the handle names an element");
    return *found;
  }
  [[nodiscard]] T& operator[](Handle<T> handle) { return const_cast<T&>(std::as_const(*this)[handle]); }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

  /// Returns the handles of all elements, in slot order.
  [[nodiscard]] std::vector<Handle<T>> handles() const {
    std::vector<Handle<T>> all;
    all.reserve(size_);
    for_each([&](Handle<T> handle, const T&) { all.push_back(handle); });
    return all;
  }
  /// Returns the handle of the element in a slot, or nullopt if the slot is empty.
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

  /// Returns a map with the same handles, in which each value is `copy(value)`.
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
  /// Brings a map that `copied` returned up to date, by copying the slots in `changed` again. Elements that were there
  /// before keep their addresses. Requires: all other slots are as they were when the map was copied.
  template <class Copy>
  void update_copy(SlotMap& made, const std::vector<Handle<T>>& changed, Copy&& copy) const {
    while (made.pages_.size() < pages_.size()) made.pages_.push_back(std::make_unique<Page>());
    for (const Handle<T> handle : changed) {
      const Slot& from = slot_at(handle.index);
      Slot& to = made.slot_at(handle.index);
      if (from.value.has_value()) {
        to.value = copy(*from.value);
      } else {
        to.value.reset();
      }
      to.generation = from.generation;
    }
    made.free_ = free_;
    made.count_ = count_;
    made.size_ = size_;
  }

 private:
  struct Slot {
    std::optional<T> value;
    std::uint64_t generation = 0;  // of the value; 0 means none
  };
  static constexpr std::size_t kPage = 32;
  struct Page : std::array<Slot, kPage>, LargeObject {};

  [[nodiscard]] const Slot& slot_at(std::uint32_t index) const {
    QUOIN_ASSERT(index / kPage < pages_.size(), "a slot of the map");
    return (*pages_[index / kPage])[index % kPage];
  }
  [[nodiscard]] Slot& slot_at(std::uint32_t index) { return const_cast<Slot&>(std::as_const(*this).slot_at(index)); }

  std::vector<std::unique_ptr<Page>> pages_;
  std::vector<std::uint32_t> free_;
  std::uint32_t count_ = 0;  // number of slots ever used
  std::size_t size_ = 0;
};

}  // namespace quoin

// Hashes handles, so that they can be keys of std::unordered_map. Doxygen 1.9 finds no scope for it.
/// @cond
template <class T>
struct std::hash<quoin::Handle<T>> {
  [[nodiscard]] std::size_t operator()(const quoin::Handle<T>& handle) const noexcept {
    return std::hash<std::uint64_t>()(handle.generation);  // unique per element
  }
};
/// @endcond
