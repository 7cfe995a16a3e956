#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace quoin::array {

// The interfaces between labels: a slot for each pair of labels that meet, with a number, which is first a count of
// triangles and then a write position.
//
// Labels are stored as keys: their bits, changed so that the order as unsigned numbers is the order of the labels.
class InterfaceTable {
 public:
  struct Slot {
    std::uint64_t back = 0;
    std::uint64_t front = 0;  // equal to `back`: empty
    std::uint64_t number = 0;
  };

  // Returns the slot of a pair; new slots have number 0. The reference is valid until the next call.
  [[gnu::always_inline]] Slot& slot(std::uint64_t back, std::uint64_t front) {
    for (std::size_t i = place(back, front);; i = (i + 1) & mask_) {
      Slot& slot = slots_[i];
      if (slot.back == back && slot.front == front) return slot;
      if (slot.back == slot.front) return insert(back, front);
    }
  }
  // Returns all used slots, in unspecified order.
  [[nodiscard]] std::vector<Slot> used() const;

  InterfaceTable();

 private:
  [[nodiscard, gnu::always_inline]] std::size_t place(std::uint64_t back, std::uint64_t front) const {
    const std::uint64_t mixed = (back * 0x9E37'79B9'7F4A'7C15U + front) * 0xD6E8'FEB8'6659'FD93U;
    return static_cast<std::size_t>(mixed >> 32) & mask_;
  }
  Slot& insert(std::uint64_t back, std::uint64_t front);

  std::vector<Slot> storage_;
  Slot* slots_ = nullptr;  // data of storage_
  std::size_t mask_ = 0;
  std::size_t count_ = 0;
};

}  // namespace quoin::array
