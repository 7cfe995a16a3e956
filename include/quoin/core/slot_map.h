#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

namespace quoin {

/// Names an element of a SlotMap<T>; stays invalid for ever once that element is removed, and in any other map but
/// copies: there, but for one time in some millions, it names nothing. The default names nothing.
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

/// For SlotMap: numbers that lie far apart, so that handles of one map are none of another.
[[nodiscard]] std::uint32_t next_first_generation();

/// Values by generational handle: O(1) insert, remove and find; iteration in slot order. An element stays at its
/// address until it is removed, whatever else is inserted, and when the map is moved.
template <class T>
class SlotMap {
 public:
  SlotMap() : first_generation_(next_first_generation()) {}
  /// Leaves the other empty; its handles name the elements here.
  SlotMap(SlotMap&& other) noexcept
      : pages_(std::exchange(other.pages_, {})),
        free_(std::exchange(other.free_, {})),
        count_(std::exchange(other.count_, 0)),
        size_(std::exchange(other.size_, 0)),
        first_generation_(std::exchange(other.first_generation_, next_first_generation())) {}
  SlotMap& operator=(SlotMap&& other) noexcept {
    SlotMap taken(std::move(other));
    std::swap(pages_, taken.pages_);
    std::swap(free_, taken.free_);
    std::swap(count_, taken.count_);
    std::swap(size_, taken.size_);
    std::swap(first_generation_, taken.first_generation_);
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
    if (index == count_) {
      ++count_;
    } else {
      free_.pop_back();
    }
    ++size_;
    return handle_of(index, slot);
  }
  /// The slot that the next element is put into: Handle::index of what `insert` returns.
  [[nodiscard]] std::uint32_t next_index() const { return free_.empty() ? count_ : free_.back(); }

  /// Ends the element and its handle. Returns false when the handle names nothing.
  bool remove(Handle<T> handle) {
    if (find(handle) == nullptr) return false;
    free_.push_back(handle.index);  // first, since it may throw
    Slot& slot = slot_at(handle.index);
    slot.value.reset();
    ++slot.generation;
    --size_;
    return true;
  }

  /// Null when the handle names nothing (never inserted, or removed since). Lifetime: the map owns the element.
  [[nodiscard]] const T* find(Handle<T> handle) const {
    if (handle.index >= count_) return nullptr;
    const Slot& slot = slot_at(handle.index);
    return slot.value.has_value() && handle_of(handle.index, slot) == handle ? &*slot.value : nullptr;
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
    return handle_of(index, slot_at(index));
  }

  /// Calls `visit(handle, value)` for every element, in slot order. Requires: `visit` neither inserts nor removes.
  template <class Visit>
  void for_each(Visit&& visit) const {
    std::uint32_t index = 0;
    for (const std::unique_ptr<Page>& page : pages_) {
      for (const Slot& slot : *page) {
        if (slot.value.has_value()) visit(handle_of(index, slot), *slot.value);
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
    made.first_generation_ = first_generation_;
    return made;
  }

 private:
  struct Slot {
    std::optional<T> value;
    std::uint32_t generation = 0;  // from the map's first on
  };
  static constexpr std::size_t kPage = 32;
  using Page = std::array<Slot, kPage>;

  [[nodiscard]] Handle<T> handle_of(std::uint32_t index, const Slot& slot) const {
    return {index, first_generation_ + slot.generation};
  }
  [[nodiscard]] const Slot& slot_at(std::uint32_t index) const { return (*pages_[index / kPage])[index % kPage]; }
  [[nodiscard]] Slot& slot_at(std::uint32_t index) { return (*pages_[index / kPage])[index % kPage]; }

  std::vector<std::unique_ptr<Page>> pages_;
  std::vector<std::uint32_t> free_;
  std::uint32_t count_ = 0;  // slots that were ever used
  std::size_t size_ = 0;
  std::uint32_t first_generation_;  // far from those of other maps
};

}  // namespace quoin
