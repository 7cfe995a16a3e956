// Compares halved fields and pyramids with a sample-by-sample reference.

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/downsample.h>

#include "grid/density/density_storage.h"

namespace quoin {
namespace {

// Returns balls, boxes and holes of several materials across the borders of chunks and of coarse chunks.
DensityGrid random_field(std::mt19937& random, float band = 8.0F) {
  DensityGrid field(band);
  std::uniform_real_distribution<double> near(-24.0, 24.0);
  std::uniform_real_distribution<double> size(0.6, 12.0);
  const DVec3 centres[] = {DVec3(0.0), DVec3(128.0, 0.0, -64.0), DVec3(-128.0, 64.0, 127.0)};
  for (int i = 0; i < 40; ++i) {
    const DVec3 at = centres[i % 3] + DVec3(near(random), near(random), near(random));
    const auto material = static_cast<VoxelType>(1 + random() % 4);
    switch (random() % 4) {
      case 0:
        field.remove_sphere(at, size(random));
        break;
      case 1:
        field.add_box(at, at + DVec3(size(random), 0.7 * size(random), size(random)), material);
        break;
      default:
        field.add_sphere(at, size(random), material);
        break;
    }
  }
  return field;
}

bool has_air_around(const DensityGrid& field, IVec3 sample, int step) {
  for (int i = 0; i < 27; ++i) {
    if (!(field.density(sample + step * Neighbourhood::offset(i)) < 0.0F)) return true;
  }
  return false;
}

// Applies the rules of the header.
DensitySample expected_at(const DensityGrid& field, IVec3 sample) {
  const IVec3 fine = 2 * sample;
  const float band = DensityGrid(0.5F * field.band()).band();
  DensitySample expected;
  expected.density = float_from_half(stored_density(0.5F * field.density(fine), band));
  if (!(expected.density < 0.0F)) return expected;
  expected.material = field.material(fine);
  if (!has_air_around(field, fine, 2)) return expected;
  float greatest = field.density(fine);
  for (int i = 0; i < 27; ++i) {
    const IVec3 at = fine + Neighbourhood::offset(i);
    const float density = field.density(at);
    if (!(density < 0.0F) || density <= greatest) continue;
    greatest = density;
    expected.material = field.material(at);
  }
  return expected;
}

bool are_equal(const DensityGrid& a, const DensityGrid& b) {
  if (a.band() != b.band() || a.chunks() != b.chunks()) return false;
  for (const IVec3 chunk : a.chunks()) {
    if (a.find_chunk(chunk)->content_hash() != b.find_chunk(chunk)->content_hash()) return false;
  }
  return true;
}

TEST(DensityHalving, MatchesOracle) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const DensityGrid field = random_field(random, seed == 4 ? 3.1F : 8.0F);
    const DensityGrid coarse = *downsample(field);
    EXPECT_EQ(coarse.band(), DensityGrid(0.5F * field.band()).band());
    std::int64_t solid = 0;
    for (const IVec3 chunk : field.chunks()) {
      for (int i = 0; i < 32 * 32 * 32; ++i) {
        const IVec3 sample = chunk * 32 + IVec3{i & 31, i >> 5 & 31, i >> 10};
        const DensitySample expected = expected_at(field, sample);
        ASSERT_EQ(coarse.density(sample), expected.density) << sample.x << ' ' << sample.y << ' ' << sample.z;
        if (!(expected.density < 0.0F)) continue;
        ++solid;
        ASSERT_EQ(coarse.material(sample), expected.material) << sample.x << ' ' << sample.y << ' ' << sample.z;
      }
    }
    EXPECT_EQ(coarse.solid_count(), solid);
    EXPECT_GT(solid, 1000);
  }
}

TEST(DensityHalving, KeepsPositionOfSurface) {
  DensityGrid field;
  const DVec3 centre{70.3, 61.8, 10.4};
  field.add_sphere(centre, 40.0, 1);
  const DensityGrid coarse = *downsample(field);
  for (int i = 0; i < 200; ++i) {
    const double up = 1.0 - (i + 0.5) / 100.0;
    const double around = 2.4 * i;
    const double horizontal = std::sqrt(1.0 - up * up);
    const DVec3 out{horizontal * std::cos(around), up, horizontal * std::sin(around)};
    EXPECT_NEAR(coarse.density_at(0.5 * (centre + 40.0 * out)), 0.0, 0.03) << "of a coarse sample";
  }
}

TEST(DensityHalving, TakesMaterialFromOutside) {
  DensityGrid field;
  field.add_box({-100, -40, -100}, {100, 0.8, 100}, 1);
  // A layer of grass one sample thick.
  field.edit({{-110, 0, -110}, {110, 1, 110}}, [](IVec3, DensitySample sample) {
    if (sample.density < 0.0F) sample.material = 2;
    return sample;
  });
  const DensityGrid once = *downsample(field);
  const DensityGrid twice = *downsample(once);
  EXPECT_EQ(field.material({12, 0, 12}), 2);
  EXPECT_EQ(field.material({12, -1, 12}), 1);
  EXPECT_EQ(once.material({6, 0, 6}), 2);
  EXPECT_EQ(once.material({6, -2, 6}), 1);
  EXPECT_EQ(twice.material({3, 0, 3}), 2);
  // The grass no longer has any samples here.
  DensityGrid lower;
  lower.add_box({-100, -40, -100}, {100, -0.2, 100}, 1);
  lower.edit({{-110, -1, -110}, {110, 0, 110}}, [](IVec3, DensitySample sample) {
    if (sample.density < 0.0F) sample.material = 2;
    return sample;
  });
  EXPECT_EQ(lower.material({12, -2, 12}), 1);
  EXPECT_EQ(downsample(lower)->material({6, -1, 6}), 2);
}

TEST(DensityHalving, PyramidFollowsEdits) {
  std::mt19937 random(21);
  DensityGrid field = random_field(random);
  DensityPyramid pyramid;
  EXPECT_EQ(pyramid.levels(), 0);
  for (int step = 0; step < 10; ++step) {
    pyramid.update(field, 3);
    ASSERT_EQ(pyramid.levels(), 3);
    DensityGrid expected = field.snapshot();
    for (int level = 1; level <= 3; ++level) {
      const std::int64_t finer = expected.solid_count();
      expected = *downsample(expected);
      ASSERT_TRUE(are_equal(pyramid.level(level), expected)) << "step " << step << " level " << level;
      EXPECT_EQ(pyramid.counts(level).finer_solid, finer);
      EXPECT_EQ(pyramid.counts(level).solid, expected.solid_count());
    }
    const auto near_border = [&] {
      return 64.0 * (static_cast<int>(random() % 5) - 2) - static_cast<int>(random() % 4);
    };
    const DVec3 at{near_border(), near_border(), near_border()};
    if (step == 4) field.remove_sphere({0, 0, 0}, 30.0);
    if (step == 6) field = random_field(random, 4.0F);
    field.add_sphere(at, 3.0 + static_cast<double>(random() % 5), static_cast<VoxelType>(1 + random() % 4));
  }
  field.clear();
  pyramid.update(field, 3);
  EXPECT_EQ(pyramid.levels(), 0);
}

TEST(DensityHalving, CountsSurfaceAndThinSamples) {
  DensityGrid field;
  const auto counted = [&](auto&& change) {
    field.clear();
    change();
    DensityPyramid pyramid;
    pyramid.update(field, 1);
    const DensityGrid& coarse = pyramid.level(1);
    DownsampledDensityCounts expected;
    expected.finer_solid = field.solid_count();
    const IBox box = coarse.solid_bounds();
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) {
          const IVec3 at{x, y, z};
          if (!(coarse.density(at) < 0.0F)) continue;
          bool has_air = false;
          bool is_thin = false;
          for (int axis = 0; axis < 3; ++axis) {
            IVec3 step{0};
            step[axis] = 1;
            const bool low = !(coarse.density(at - step) < 0.0F);
            const bool high = !(coarse.density(at + step) < 0.0F);
            has_air |= low || high;
            is_thin |= low && high;
          }
          ++expected.solid;
          expected.surface += has_air ? 1 : 0;
          expected.thin += is_thin ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(pyramid.counts(1), expected);
    return pyramid.counts(1);
  };
  const DownsampledDensityCounts ball = counted([&] { field.add_sphere({60, 3, -70}, 30.0, 1); });
  EXPECT_LT(20 * ball.thin, ball.surface);
  const DownsampledDensityCounts plate = counted([&] { field.add_box({-60, 9.5, -60}, {60, 11.5, 60}, 1); });
  EXPECT_EQ(plate.thin, plate.surface);
}

TEST(DensityHalving, RebuildsOnlyChunksThatReadEdit) {
  DensityGrid field;
  for (const int x : {-40, 40}) {
    for (const int y : {-40, 40}) {
      for (const int z : {-40, 40}) field.add_sphere({x, y, z}, 60.0, 1);
    }
  }
  DensityPyramid pyramid;
  pyramid.update(field, 1);
  const auto made_anew = [&](IVec3 sample) {
    ChangeCursor cursor = pyramid.level(1).cursor();
    // Uses each material once, so that each edit makes a change.
    const auto material = static_cast<VoxelType>(field.material(sample) + 1);
    field.set(sample, {field.density(sample) < 0.0F ? -7.5F : -0.5F, material});
    std::vector<const DensityStorage*> before;
    const std::vector<IVec3> chunks = pyramid.level(1).chunks();
    std::vector<DensityChunk> kept;
    for (const IVec3 chunk : chunks) kept.push_back(*pyramid.level(1).find_chunk(chunk));
    pyramid.update(field, 1);
    int anew = 0;
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      anew += static_cast<int>(!kept[i].shares_storage_with(*pyramid.level(1).find_chunk(chunks[i])));
    }
    EXPECT_LE(pyramid.level(1).changes_since(cursor).items_unless_all().size(), static_cast<std::size_t>(anew));
    return anew;
  };
  EXPECT_EQ(made_anew({60, 60, 60}), 1);
  EXPECT_EQ(made_anew({64, 60, 60}), 1) << "both chunks of samples are halved into one";
  EXPECT_EQ(made_anew({2, 60, 60}), 1);
  EXPECT_EQ(made_anew({1, 60, 60}), 2);
  EXPECT_EQ(made_anew({-2, 60, 60}), 2);
  EXPECT_EQ(made_anew({-2, 1, -2}), 8);
}

TEST(DensityHalving, IsTheSameAtAnyThreadCount) {
  std::mt19937 random(9);
  const DensityGrid field = random_field(random);
  EXPECT_TRUE(are_equal(*downsample(field, {1}), *downsample(field, {4})));
}

}  // namespace
}  // namespace quoin
