#include "grid/change_records.h"

#include <random>

#include <gtest/gtest.h>

namespace quoin {
namespace {

// Compares voxel by voxel: how far each of the 27 chunks around must look to see a changed voxel.
ChunkDifference slow_difference(const Chunk& a, const Chunk& b) {
  ChunkDifference found;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) {
        const VoxelType before = a.get(x, y, z);
        const VoxelType after = b.get(x, y, z);
        if (before != after) found.types.add(y, z, std::uint64_t{1} << x);
        if ((before == kAir) != (after == kAir)) found.solid.add(y, z, std::uint64_t{1} << x);
      }
    }
  }
  return found;
}

void expect_equal(const ChangeReach& a, const ChangeReach& b) {
  EXPECT_EQ(a.samples, b.samples);
  for (int reach = 0; reach <= 64; ++reach) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 d = Neighbourhood::offset(i);
      ASSERT_EQ(a.is_within(reach, d.x, d.y, d.z), b.is_within(reach, d.x, d.y, d.z)) << reach << " " << i;
    }
  }
}

TEST(ChunkDifference, MatchesVoxelwiseComparison) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto any = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
    Chunk before(static_cast<VoxelType>(any(2)));
    const auto edit = [&](Chunk& chunk, int edits) {
      for (int i = 0; i < edits; ++i) {
        const IVec3 at{any(64), any(64), any(64)};
        const auto type = static_cast<VoxelType>(any(seed % 3 == 0 ? 3 : 40));
        chunk.fill_box({at, at + IVec3{1 + any(9), 1 + any(9), 1 + any(9)}}, type, [](int, int, std::uint64_t) {});
      }
    };
    edit(before, any(40));
    Chunk after = before;
    edit(after, any(4));
    if (seed % 2 == 0) after.compact();
    const ChunkDifference fast = difference(&before, &after);
    const ChunkDifference slow = slow_difference(before, after);
    expect_equal(fast.solid, slow.solid);
    expect_equal(fast.types, slow.types);
    expect_equal(difference(nullptr, &after).solid, slow_difference(Chunk(), after).solid);
    expect_equal(difference(&after, nullptr).types, slow_difference(after, Chunk()).types);
    EXPECT_EQ(difference(&after, &after).types.samples, 0);
  }
}

}  // namespace
}  // namespace quoin
