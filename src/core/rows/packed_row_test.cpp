#include "core/rows/packed_row.h"

#include <array>
#include <cstdint>
#include <random>

#include <gtest/gtest.h>

namespace quoin::packed_row {
namespace {

TEST(PackedRow, EqualMaskIsThatOfSingleVoxels) {
  std::mt19937_64 random(3);
  for (const int bits : {1, 2, 4, 8, 16}) {
    for (int round = 0; round < 200; ++round) {
      std::array<std::uint64_t, 16> row;
      // Few values, so that many voxels are equal.
      const std::uint64_t few = repeat(bits, 1 + static_cast<std::uint32_t>(round) % ((1U << bits) - 1));
      for (std::uint64_t& word : row) word = random() & few;
      const std::uint32_t index = read(row.data(), bits, round % 64);
      std::uint64_t expected = 0;
      for (int x = 0; x < 64; ++x) expected |= std::uint64_t{read(row.data(), bits, x) == index} << x;
      ASSERT_EQ(equal_mask(row.data(), bits, index), expected) << bits << " bits, index " << index;
    }
  }
}

}  // namespace
}  // namespace quoin::packed_row
