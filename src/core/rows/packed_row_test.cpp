#include "core/rows/packed_row.h"

#include <array>
#include <cstdint>
#include <random>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin::packed_row {
namespace {

TEST(PackedRow, EqualMaskMatchesSingleVoxels) {
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

TEST(PackedRowDeathTest, RejectsVoxelsAndIndicesThatDoNotFit) {
  [[maybe_unused]] std::array<std::uint64_t, 4> row{};
  QUOIN_EXPECT_MISTAKE((void)read(row.data(), 4, 64), "0 <= x < 64");
  QUOIN_EXPECT_MISTAKE(write(row.data(), 4, 0, 16), "an index of that many bits");
  QUOIN_EXPECT_MISTAKE((void)equal_mask(row.data(), 4, 16), "an index of that many bits");
  QUOIN_EXPECT_MISTAKE((void)repeat(3, 1), "1, 2, 4, 8 or 16 bits");
}

}  // namespace
}  // namespace quoin::packed_row
