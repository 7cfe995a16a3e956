#include <quoin/core/slot_map.h>

#include <map>
#include <new>
#include <random>
#include <string>
#include <unordered_map>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(SlotMap, KeepsAddressesOfElements) {
  SlotMap<std::string> map;
  const auto first = map.insert("first");
  const std::string* const place = map.find(first);
  for (int i = 0; i < 1000; ++i) (void)map.insert(std::to_string(i));
  EXPECT_EQ(map.find(first), place);
  const SlotMap<std::string> moved = std::move(map);
  EXPECT_EQ(moved.find(first), place);
  EXPECT_EQ(*place, "first");
}

TEST(SlotMap, IsEmptyAndUsableAfterMove) {
  SlotMap<int> map;
  const auto handle = map.insert(1);
  SlotMap<int> moved = std::move(map);
  EXPECT_TRUE(map.empty());  // NOLINT(bugprone-use-after-move): the documented guarantee
  EXPECT_EQ(map.find(handle), nullptr);
  EXPECT_TRUE(map.handles().empty());
  const auto again = map.insert(2);
  EXPECT_EQ(map[again], 2);
  EXPECT_EQ(moved[handle], 1);
  moved = std::move(map);
  EXPECT_EQ(moved[again], 2);
  EXPECT_EQ(moved.size(), 1U);
  EXPECT_TRUE(map.empty());  // NOLINT(bugprone-use-after-move)
}

TEST(SlotMap, HandlesWorkAsMapKeys) {
  SlotMap<int> map;
  const auto first = map.insert(1);
  const auto second = map.insert(2);
  std::unordered_map<Handle<int>, std::string> names{{first, "first"}, {second, "second"}};
  EXPECT_EQ(names.at(first), "first");
  map.remove(first);
  EXPECT_FALSE(names.contains(map.insert(3))) << "another, in the same slot";
}

TEST(SlotMap, KeepsHandleOfRemovedElementInvalid) {
  SlotMap<int> map;
  const auto old = map.insert(1);
  EXPECT_EQ(map.next_index(), 1U);
  EXPECT_TRUE(map.remove(old));
  EXPECT_FALSE(map.remove(old));
  EXPECT_EQ(map.next_index(), old.index);
  const auto next = map.insert(2);
  EXPECT_EQ(next.index, old.index);
  EXPECT_EQ(map.find(old), nullptr);
  EXPECT_EQ(map[next], 2);
}

TEST(SlotMap, RejectsHandlesOfOtherMaps) {
  SlotMap<int> map;
  SlotMap<int> other;
  const auto handle = map.insert(1);
  const auto same_place = other.insert(1);
  EXPECT_EQ(handle.index, same_place.index);
  EXPECT_NE(handle, same_place);
  EXPECT_EQ(other.find(handle), nullptr);
  EXPECT_FALSE(other.remove(handle));
  EXPECT_EQ(other.size(), 1U);
  for (int i = 0; i < 100; ++i) {  // nor after any number of elements in that slot
    EXPECT_TRUE(other.remove(*other.handle_at(0)));
    (void)other.insert(i);
    EXPECT_EQ(other.find(handle), nullptr);
  }
}

TEST(SlotMap, CopyAcceptsOnlyEarlierHandles) {
  SlotMap<int> map;
  const auto handle = map.insert(1);
  const auto removed = map.insert(2);
  EXPECT_TRUE(map.remove(removed));
  SlotMap<int> copy = map.copied([](int value) { return value; });
  EXPECT_EQ(copy[handle], 1);
  EXPECT_EQ(copy.find(removed), nullptr);
  const auto in_map = map.insert(3);
  const auto in_copy = copy.insert(4);
  EXPECT_EQ(in_map.index, in_copy.index);
  EXPECT_EQ(copy.find(in_map), nullptr);
  EXPECT_EQ(map.find(in_copy), nullptr);
  EXPECT_EQ(map[in_map], 3);
  EXPECT_EQ(copy[in_copy], 4);
}

// Its copy constructor, which also serves as the move constructor, can throw.
struct Fragile {
  explicit Fragile(int given) : value(given) {}
  Fragile(const Fragile& other) : value(other.value) {
    if (throws) throw std::bad_alloc();
  }
  Fragile& operator=(const Fragile&) = default;
  ~Fragile() = default;
  int value;
  static inline bool throws = false;
};

TEST(SlotMap, StaysUnchangedIfInsertThrows) {
  SlotMap<Fragile> map;
  std::map<std::uint32_t, int> plain;
  std::mt19937 random(5);
  for (int i = 0; i < 2'000; ++i) {
    const Fragile made(i);
    Fragile::throws = random() % 3 == 0;
    const std::uint32_t index = map.next_index();
    if (Fragile::throws) {
      EXPECT_THROW((void)map.insert(made), std::bad_alloc);
      EXPECT_EQ(map.next_index(), index);
    } else {
      EXPECT_EQ(map.insert(made).index, index);
      plain[index] = i;
    }
    Fragile::throws = false;
    if (random() % 4 == 0 && !map.empty()) {
      const auto gone = map.handles()[random() % map.size()];
      plain.erase(gone.index);
      EXPECT_TRUE(map.remove(gone));
    }
    ASSERT_EQ(map.size(), plain.size());
  }
  map.for_each([&](Handle<Fragile> handle, const Fragile& value) { EXPECT_EQ(plain.at(handle.index), value.value); });
}

TEST(SlotMapDeathTest, RejectsHandleOfRemovedElement) {
  SlotMap<int> map;
  const auto handle = map.insert(1);
  (void)map.remove(handle);
  QUOIN_EXPECT_MISTAKE((void)map[handle], "the handle names an element");
  QUOIN_EXPECT_MISTAKE((void)map[Handle<int>{}], "the handle names an element");
}

}  // namespace
}  // namespace quoin
