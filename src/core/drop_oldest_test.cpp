#include "core/caches.h"

#include <map>
#include <unordered_map>

#include <gtest/gtest.h>

namespace quoin {
namespace {

struct Entry {
  std::uint64_t bytes = 0;
  std::uint64_t last_use = 0;
};
using Cache = std::map<int, Entry>;

template <class Map>
std::uint64_t trim(Map& cache, std::uint64_t max_bytes, std::uint64_t now) {
  std::uint64_t held = 0;
  for (const auto& [key, entry] : cache) held += entry.bytes;
  return drop_oldest(
      cache, held, max_bytes, [&](auto each) { return each->second.last_use != now; },
      [](auto each) { return each->second.bytes; }, [&](auto each) { cache.erase(each); });
}

TEST(DropOldest, DropsLeastRecentlyUsed) {
  Cache cache = {{1, {10, 5}}, {2, {10, 3}}, {3, {10, 4}}, {4, {10, 6}}};
  EXPECT_EQ(trim(cache, 25, 7), 20);
  EXPECT_EQ(cache.size(), 2);
  EXPECT_TRUE(cache.contains(1) && cache.contains(4));
}

TEST(DropOldest, KeepsAllEntriesWithinLimit) {
  Cache cache = {{1, {10, 1}}, {2, {10, 2}}};
  EXPECT_EQ(trim(cache, 20, 7), 20);
  EXPECT_EQ(cache.size(), 2);
}

TEST(DropOldest, KeepsEntriesThatMustStay) {
  Cache cache = {{1, {30, 7}}, {2, {10, 2}}, {3, {10, 7}}};
  EXPECT_EQ(trim(cache, 5, 7), 40);
  EXPECT_FALSE(cache.contains(2));
}

TEST(DropOldest, DropsEqualEntriesInMapOrder) {
  Cache cache = {{3, {10, 1}}, {1, {10, 1}}, {2, {10, 1}}};
  EXPECT_EQ(trim(cache, 10, 7), 10);
  EXPECT_TRUE(cache.contains(3));
}

TEST(DropOldest, DropsManyEntriesOfHashTable) {
  std::unordered_map<int, Entry> cache;
  for (int i = 0; i < 1000; ++i) cache[i] = {1, static_cast<std::uint64_t>(i * 7 % 1000)};
  EXPECT_EQ(trim(cache, 100, 1000), 100);
  for (const auto& [key, entry] : cache) EXPECT_GE(entry.last_use, 900) << key;
}

}  // namespace
}  // namespace quoin
