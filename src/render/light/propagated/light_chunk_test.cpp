#include "render/light/propagated/light_chunk.h"

#include <algorithm>
#include <bit>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"

namespace quoin::propagated {
namespace {

// Returns slabs of several kinds: one level, sky and rock, gradients along an axis, random levels.
SlabPlanes random_planes(std::mt19937_64& random) {
  SlabPlanes planes;
  const unsigned kind = random() % 5;
  for (unsigned row = 0; row < kSlabWords; ++row) {
    for (unsigned x = 0; x < 64; ++x) {
      const unsigned anything = random() % 16;
      const unsigned level = kind == 0   ? 6
                             : kind == 1 ? (x + row > 40 ? 15 : 0)
                             : kind == 2 ? (row >> 2) + 3
                             : kind == 3 ? x / 5
                                         : anything;
      for (std::size_t i = 0; i < kPlanes; ++i) {
        const std::uint64_t bit = std::uint64_t{1} << x;
        std::uint64_t& word = planes.plane(i)[row];
        word = (level >> i & 1U) != 0 ? word | bit : word & ~bit;
      }
    }
  }
  return planes;
}

unsigned level_of(const SlabPlanes& planes, std::size_t row, unsigned x) {
  unsigned level = 0;
  for (std::size_t i = 0; i < kPlanes; ++i) level |= static_cast<unsigned>(planes.plane(i)[row] >> x & 1U) << i;
  return level;
}

SlabKinds kinds_of(SlabPlanes& planes) {
  const SlabPlanes before{};
  std::array<std::uint64_t, kSlabWords> inside;
  inside.fill(~std::uint64_t{0});
  std::array<std::uint64_t, kSlabWords> changed;
  return kernel().merge(before.words.data(), inside.data(), planes.words.data(), changed.data());
}

TEST(LightSlab, RoundTripsPlanes) {
  std::mt19937_64 random(1);
  for (int step = 0; step < 200; ++step) {
    SlabPlanes planes = random_planes(random);
    const LightSlab made = LightSlab::of(planes, kinds_of(planes));
    const LightSlab slab = made;  // NOLINT(performance-unnecessary-copy-initialization): it is shared
    SlabPlanes read;
    slab.read(read);
    ASSERT_EQ(read.words, planes.words);
    for (std::size_t row = 0; row < kSlabWords; ++row) {
      for (std::size_t i = 0; i < kPlanes; ++i) ASSERT_EQ(slab.row(row)[i], planes.plane(i)[row]);
      for (unsigned x = 0; x < 64; ++x) ASSERT_EQ(slab.at(row, x), level_of(planes, row, x));
    }
  }
}

TEST(LightSlab, StoresOnlyDifferencesBetweenPlanes) {
  SlabPlanes planes{};
  const auto bytes = [&] { return LightSlab::of(planes, kinds_of(planes)).bytes(); };
  for (std::size_t i = 0; i < kPlanes; ++i) {
    for (std::size_t row = 0; row < kSlabWords; ++row) planes.plane(i)[row] = ~std::uint64_t{0};
  }
  EXPECT_EQ(bytes(), 0U) << "all sky";
  for (std::size_t i = 0; i < kPlanes; ++i) {
    for (std::size_t row = 0; row < kSlabWords; ++row) planes.plane(i)[row] = (std::uint64_t{1} << row) * 7;
  }
  EXPECT_EQ(bytes(), 28 + 16 * 4U) << "sky and rock: half of one plane, all of whose rows differ";
  for (std::size_t row = 0; row < kSlabWords; ++row) planes.plane(2)[row] = row < 8 ? 5 : 9;
  EXPECT_EQ(bytes(), 28 + (16 + 16 + 16) * 4U) << "the plane above it, it and the plane below it";
  for (std::size_t i = 0; i < kPlanes; ++i) {
    for (std::size_t row = 0; row < kSlabWords; ++row) planes.plane(i)[row] = row < 8 ? 0 : std::uint64_t{1} << 40;
  }
  EXPECT_EQ(bytes(), 28 + 4U) << "one unit: the planes below equal it";
}

TEST(ChannelLight, CountsBytesOfItsSlabs) {
  std::mt19937_64 random(4);
  ChannelLight light;
  EXPECT_EQ(light.bytes(), 0U);
  const std::size_t empty = [] {
    ChannelLight one;
    one.take({.slabs = {{0, LightSlab(3)}}});
    return one.bytes();
  }();
  for (int step = 0; step < 300; ++step) {
    const ChannelLight before = light;
    const std::size_t bytes_before = before.bytes();
    ChannelChange change;
    change.is_uniform = random() % 50 == 0;
    for (std::size_t i = 0; !change.is_uniform && i < random() % 20; ++i) {
      SlabPlanes planes = random_planes(random);
      change.slabs.push_back({random() % kSlabs, LightSlab::of(planes, kinds_of(planes))});
    }
    light.take(std::move(change));
    std::size_t expected = light.is_uniform() ? 0 : empty;
    for (std::size_t i = 0; i < kSlabs && !light.is_uniform(); ++i) expected += light.stored(i).bytes();
    ASSERT_EQ(light.bytes(), expected) << step;
    ASSERT_EQ(before.bytes(), bytes_before) << "a copy does not change";
  }
}

TEST(LightSlabKernel, PacksAndReadsAlikeWithEveryInstructionSet) {
  std::mt19937_64 random(3);
  for (int step = 0; step < 300; ++step) {
    SlabPlanes planes = random_planes(random);
    // Covers rows equal to the previous ones, halves of rows, and units after many missing ones.
    for (std::size_t i = 0; i < planes.words.size(); ++i) {
      if (i % kSlabWords != 0 && random() % 4 < static_cast<unsigned>(step % 5)) planes.words[i] = planes.words[i - 1];
      if (random() % 8 == 0) planes.words[i] &= 0xFFFF'FFFFU;
    }
    SlabUnitsRoom wanted_units;
    const SlabUnits wanted = kPlainKernel.pack_slab(planes.words.data(), wanted_units);
    const std::size_t count = wanted.first[kPlanes];
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride use(set);
      SlabUnitsRoom units;
      const SlabUnits made = kernel().pack_slab(planes.words.data(), units);
      ASSERT_EQ(made.fresh, wanted.fresh);
      ASSERT_EQ(made.first, wanted.first);
      ASSERT_TRUE(std::equal(units.begin(), units.begin() + count, wanted_units.begin()));
      // Uses a buffer of the exact size, so that a sanitizer reports reads past it.
      const std::vector<std::uint32_t> exact(units.begin(), units.begin() + count);
      SlabPlanes read;
      kernel().unpack_slab(made, exact.data(), read.words.data());
      ASSERT_EQ(read.words, planes.words);
      for (std::size_t row = 0; row < kSlabWords; ++row) {
        RowPlanes of_row;
        kernel().unpack_row(made, exact.data(), row, of_row.data());
        ASSERT_EQ(of_row, planes.row(row));
      }
    }
  }
}

TEST(LightSlabKernel, MergesAlikeWithEveryInstructionSet) {
  std::mt19937_64 random(2);
  for (int step = 0; step < 100; ++step) {
    const SlabPlanes before = random_planes(random);
    const SlabPlanes after = random_planes(random);
    std::array<std::uint64_t, kSlabWords> inside;
    for (std::uint64_t& word : inside) word = step % 3 == 0 ? 0 : ~(random() << (random() % 64));
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride use(set);
      SlabPlanes now = after;
      std::array<std::uint64_t, kSlabWords> changed;
      const SlabKinds kinds = kernel().merge(before.words.data(), inside.data(), now.words.data(), changed.data());
      bool is_changed = false;
      for (std::size_t row = 0; row < kSlabWords; ++row) {
        for (unsigned x = 0; x < 64; ++x) {
          const bool is_inside = (inside[row] >> x & 1U) != 0;
          const unsigned expected = level_of(is_inside ? after : before, row, x);
          ASSERT_EQ(level_of(now, row, x), expected);
          const bool differs = expected != level_of(before, row, x);
          ASSERT_EQ((changed[row] >> x & 1U) != 0, differs);
          is_changed |= differs;
        }
      }
      ASSERT_EQ(kinds.is_changed, is_changed);
      for (std::size_t i = 0; is_changed && i < kPlanes; ++i) {
        std::uint64_t ones = 0;
        std::uint64_t zeros = 0;
        for (std::size_t row = 0; row < kSlabWords; ++row) ones |= now.plane(i)[row], zeros |= ~now.plane(i)[row];
        ASSERT_EQ(kinds.has_ones >> i & 1U, ones != 0 ? 1U : 0U);
        ASSERT_EQ(kinds.has_zeros >> i & 1U, zeros != 0 ? 1U : 0U);
      }
    }
  }
}

TEST(LightSlabDeathTest, RejectsLevelsAndRowsBeyondTheirRange) {
  QUOIN_EXPECT_MISTAKE(LightSlab(16), "a level");
  QUOIN_EXPECT_MISTAKE((void)LightSlab(3).row(kSlabWords), "one of the slab's rows");
  QUOIN_EXPECT_MISTAKE((void)LightSlab(3).at(0, 64), "0 <= x < 64");
}

}  // namespace
}  // namespace quoin::propagated
