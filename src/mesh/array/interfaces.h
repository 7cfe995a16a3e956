#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace quoin::array {

// The kinds of faces between labels: for each pair that meets, a slot with a number, of triangles or of a place.
//
// Labels are keys here: their bits, whose order as unsigned numbers is that of the labels.
class InterfaceTable {
 public:
  struct Slot {
    std::uint64_t back = 0;
    std::uint64_t front = 0;  // as `back`: empty
    std::uint64_t number = 0;
  };

  // That of a pair, new ones with 0. Valid until the next call.
  [[gnu::always_inline]] Slot& slot(std::uint64_t back, std::uint64_t front) {
    for (std::size_t i = place(back, front);; i = (i + 1) & mask_) {
      Slot& slot = slots_[i];
      if (slot.back == back && slot.front == front) return slot;
      if (slot.back == slot.front) return insert(back, front);
    }
  }
  // All that there are, in no order.
  [[nodiscard]] std::vector<Slot> used() const;

  InterfaceTable();

 private:
  [[nodiscard, gnu::always_inline]] std::size_t place(std::uint64_t back, std::uint64_t front) const {
    const std::uint64_t mixed = (back * 0x9E37'79B9'7F4A'7C15U + front) * 0xD6E8'FEB8'6659'FD93U;
    return static_cast<std::size_t>(mixed >> 32) & mask_;
  }
  Slot& insert(std::uint64_t back, std::uint64_t front);

  std::vector<Slot> storage_;
  Slot* slots_ = nullptr;  // those of storage_
  std::size_t mask_ = 0;
  std::size_t count_ = 0;
};

}  // namespace quoin::array
