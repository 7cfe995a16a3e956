#include "mesh/array/interfaces.h"

#include <utility>

#include <quoin/core/assert.h>

namespace quoin::array {
namespace {

constexpr std::size_t kFirstSlots = 256;

}  // namespace

InterfaceTable::InterfaceTable() : storage_(kFirstSlots), slots_(storage_.data()), mask_(kFirstSlots - 1) {}

InterfaceTable::Slot& InterfaceTable::insert(std::uint64_t back, std::uint64_t front) {
  if (2 * count_ >= storage_.size()) {
    std::vector<Slot> larger(2 * storage_.size());
    mask_ = larger.size() - 1;
    for (const Slot& slot : storage_) {
      if (slot.back == slot.front) continue;
      std::size_t i = place(slot.back, slot.front);
      while (larger[i].back != larger[i].front) i = (i + 1) & mask_;
      larger[i] = slot;
    }
    storage_ = std::move(larger);
    slots_ = storage_.data();
  }
  ++count_;
  QUOIN_ASSERT(back != front && 2 * count_ <= storage_.size(), "two labels, and room for their slot");
  std::size_t i = place(back, front);
  while (slots_[i].back != slots_[i].front) i = (i + 1) & mask_;
  slots_[i] = {back, front, 0};
  return slots_[i];
}

std::vector<InterfaceTable::Slot> InterfaceTable::used() const {
  std::vector<Slot> all;
  all.reserve(count_);
  for (const Slot& slot : storage_) {
    if (slot.back != slot.front) all.push_back(slot);
  }
  return all;
}

}  // namespace quoin::array
