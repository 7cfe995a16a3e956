#pragma once

#include <cassert>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace quoin {

/// Names an element of a SlotMap<T>; stays invalid for ever once that element is removed.
template <class T>
struct Handle {
  std::uint32_t index = 0xFFFFFFFFu;
  std::uint32_t generation = 0;

  bool operator==(const Handle& other) const = default;
  /// By slot; gives a stable order for things drawn at equal depth.
  bool operator<(const Handle& other) const {
    return index != other.index ? index < other.index : generation < other.generation;
  }
};

/// Values by generational handle: O(1) insert, remove and find; iteration in slot order.
template <class T>
class SlotMap {
 public:
  Handle<T> insert(T value) {
    ++size_;
    if (!free_.empty()) {
      const std::uint32_t index = free_.back();
      free_.pop_back();
      slots_[index].value = std::move(value);
      return {index, slots_[index].generation};
    }
    slots_.push_back({std::move(value), 0});
    return {static_cast<std::uint32_t>(slots_.size() - 1), 0};
  }

  /// False when the handle names nothing.
  bool remove(Handle<T> handle) {
    if (find(handle) == nullptr) return false;
    Slot& slot = slots_[handle.index];
    slot.value.reset();
    ++slot.generation;
    free_.push_back(handle.index);
    --size_;
    return true;
  }

  /// Null when the handle names nothing (never inserted, or removed since).
  [[nodiscard]] const T* find(Handle<T> handle) const {
    if (handle.index >= slots_.size()) return nullptr;
    const Slot& slot = slots_[handle.index];
    return slot.value.has_value() && slot.generation == handle.generation ? &*slot.value : nullptr;
  }
  [[nodiscard]] T* find(Handle<T> handle) { return const_cast<T*>(std::as_const(*this).find(handle)); }

  /// Requires: the handle names an element.
  [[nodiscard]] const T& operator[](Handle<T> handle) const {
    const T* found = find(handle);
    assert(found != nullptr);
    return *found;
  }
  [[nodiscard]] T& operator[](Handle<T> handle) { return const_cast<T&>(std::as_const(*this)[handle]); }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

  /// The handles of all elements, in slot order.
  [[nodiscard]] std::vector<Handle<T>> handles() const {
    std::vector<Handle<T>> all;
    all.reserve(size_);
    for (std::uint32_t i = 0; i < slots_.size(); ++i) {
      if (slots_[i].value.has_value()) all.push_back({i, slots_[i].generation});
    }
    return all;
  }

  /// Calls `visit(handle, value)` for every element, in slot order. Requires: `visit` neither inserts nor removes.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::uint32_t i = 0; i < slots_.size(); ++i) {
      if (slots_[i].value.has_value()) visit(Handle<T>{i, slots_[i].generation}, *slots_[i].value);
    }
  }

 private:
  struct Slot {
    std::optional<T> value;
    std::uint32_t generation = 0;
  };
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::size_t size_ = 0;
};

}  // namespace quoin
