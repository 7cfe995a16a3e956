#include <quoin/grid/density_grid.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "core/not_finite_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "grid/change_follower_for_tests.h"
#include "grid/density/density_oracle.h"

namespace quoin {
namespace {

constexpr float kBand = 8.0F;

// The two surfaces blend at points that are nearly equally far from both.
double flowing_least(double a, double b, double blend) {
  const double k = std::min(blend, kBand - std::max(a, b));
  if (k <= 0.0) return std::min(a, b);
  const double h = std::max(k - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4.0 * k);
}

double sphere_distance(DVec3 p, DVec3 centre, double radius) {
  const DVec3 d = p - centre;
  return std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) - radius;
}

double box_distance(DVec3 p, DVec3 min, DVec3 max, double rounding) {
  const DVec3 half = 0.5 * max - 0.5 * min;
  const double r = std::min({rounding, half.x, half.y, half.z});
  const DVec3 q = glm::abs(p - (0.5 * min + 0.5 * max)) - (half - r);
  const DVec3 out = glm::max(q, DVec3(0.0));
  return std::sqrt(out.x * out.x + out.y * out.y + out.z * out.z) + std::min(std::max({q.x, q.y, q.z}), 0.0) - r;
}

double fade(DVec3 p, DVec3 centre, double radius) {
  const DVec3 d = (p - centre) / radius;
  const double left = 1.0 - (d.x * d.x + d.y * d.y + d.z * d.z);
  return left > 0.0 ? left * left : 0.0;
}

DensitySample with_material(DensitySample before, double density, VoxelType material) {
  const auto after = static_cast<float>(density);
  return {after, !(before.density < 0.0F) && after < 0.0F ? material : before.material};
}

DensitySample smoothed(PlainField& old, IVec3 p, double weight) {
  const DensitySample before = old.at(p);
  if (weight == 0.0) return before;
  double sum = 0.0;
  std::map<VoxelType, int> materials;
  for (int i = 0; i < 27; ++i) {
    const IVec3 at = p + Neighbourhood::offset(i);
    if (i == 13) continue;
    sum += old.density(at);
    if (old.density(at) < 0.0F) ++materials[old.at(at).material];
  }
  VoxelType most = kAir;
  for (const auto& [type, count] : materials) {
    if (most == kAir || count > materials[most]) most = type;
  }
  return with_material(before, before.density + weight * (sum / 26.0 - before.density), most);
}

/// A random edit, applied to both fields.
class RandomEdit {
 public:
  explicit RandomEdit(std::mt19937& random) : random_(random) {
    kind_ = random_() % 6;
    centre_ = {place(), place(), place()};
    radius_ = number(0.0, 24.0);
    size_ = {number(0.0, 30.0), number(0.0, 30.0), number(0.0, 30.0)};
    blend_ = random_() % 2 == 0 ? 0.0 : number(0.0, 12.0);
    rounding_ = random_() % 2 == 0 ? 0.0 : number(0.0, 9.0);
    strength_ = number(0.1, 1.2);
    normal_ = {number(-3.0, 3.0), number(-3.0, 3.0), number(-3.0, 3.0)};
    material_ = static_cast<VoxelType>(1 + random_() % 3);
  }

  std::int64_t apply(DensityGrid& grid) const {
    switch (kind_) {
      case 0:
        return grid.add_sphere(centre_, radius_, material_, blend_);
      case 1:
        return grid.remove_sphere(centre_, radius_, blend_);
      case 2:
        return grid.add_box(centre_, centre_ + size_, material_, rounding_, blend_);
      case 3:
        return grid.remove_box(centre_, centre_ + size_, rounding_, blend_);
      case 4:
        return grid.smooth(centre_, radius_ + 0.1, strength_);
      default:
        return grid.flatten(centre_, radius_ + 0.1, {centre_ + 2.0, normal_, strength_, material_});
    }
  }

  std::vector<IVec3> apply(PlainField& field) const {
    PlainField old = field;
    return field.edit([&](IVec3 p, DensitySample before) { return picked(old, p, before); });
  }

 private:
  [[nodiscard]] DensitySample picked(PlainField& old, IVec3 sample, DensitySample before) const {
    const DVec3 p(sample);
    const double a = before.density;
    const double weight = std::min(strength_, 1.0) * fade(p, centre_, radius_ + 0.1);
    switch (kind_) {
      case 0:
        return with_material(before, flowing_least(a, sphere_distance(p, centre_, radius_), blend_), material_);
      case 1:
        return with_material(before, -flowing_least(-a, sphere_distance(p, centre_, radius_), blend_), 0);
      case 2:
        return with_material(before, flowing_least(a, box_distance(p, centre_, centre_ + size_, rounding_), blend_),
                             material_);
      case 3:
        return with_material(before, -flowing_least(-a, box_distance(p, centre_, centre_ + size_, rounding_), blend_),
                             0);
      case 4:
        return smoothed(old, sample, weight);
      default: {
        const DVec3 n = normal_ / std::sqrt(normal_.x * normal_.x + normal_.y * normal_.y + normal_.z * normal_.z);
        const DVec3 d = p - (centre_ + 2.0);
        const double plane = std::clamp(d.x * n.x + d.y * n.y + d.z * n.z, -double{kBand}, double{kBand});
        return with_material(before, a + weight * (plane - a), material_);
      }
    }
  }
  double number(double low, double high) { return low + (high - low) * (random_() / 4294967296.0); }
  // Often returns a whole or half number, which causes exact ties.
  double place() { return random_() % 3 == 0 ? std::round(number(-40.0, 60.0)) / 2.0 : number(-20.0, 30.0); }

  std::mt19937& random_;
  unsigned kind_ = 0;
  DVec3 centre_{0.0};
  double radius_ = 0.0;
  DVec3 size_{0.0};
  double blend_ = 0.0;
  double rounding_ = 0.0;
  double strength_ = 0.0;
  DVec3 normal_{0.0};
  VoxelType material_ = kAir;
};

// Expects densities to match within one unit of a half's last place, and signs and materials exactly.
void expect_equal(const DensityGrid& grid, PlainField& plain) {
  int differing = 0;
  plain.for_each([&](IVec3 p, const DensitySample& expected) {
    const float found = grid.density(p);
    const bool is_near = std::abs(found - expected.density) <= std::abs(expected.density) / 1000.0F;
    if (!is_near || (found < 0.0F) != (expected.density < 0.0F) || grid.material(p) != expected.material) ++differing;
  });
  ASSERT_EQ(differing, 0);
}

TEST(DensityEdits, MatchPlainFieldAndReportReachedChunks) {
  for (unsigned seed = 1; seed <= static_cast<unsigned>(cases(2, 4)); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    DensityGrid grid(kBand);
    ChangeFollower follower(grid);
    PlainField plain({IVec3(-54), IVec3(70)}, kBand);
    for (int round = 0; round < 12; ++round) {
      SCOPED_TRACE(round);
      const RandomEdit edit(random);
      const std::vector<IVec3> changed = edit.apply(plain);
      EXPECT_EQ(edit.apply(grid), static_cast<std::int64_t>(changed.size()));
      // By day every second round compares all samples.
      if (is_nightly() || round % 2 == 1) {
        ASSERT_NO_FATAL_FAILURE(expect_equal(grid, plain));
      }
      EXPECT_EQ(follower.is_behind(grid), !changed.empty());
      const int reach = std::array{0, 1, 5, 12, 33, 64}[random() % 6];
      EXPECT_EQ(follower.take(grid, reach), chunks_reached(changed, reach)) << "reach " << reach;
      EXPECT_TRUE(follower.take(grid, 64).empty());
    }
  }
}

TEST(DensityEdits, StoreDistancesOfSphere) {
  DensityGrid grid;
  const DVec3 centre{-0.3, 63.7, 0.2};
  EXPECT_GT(grid.add_sphere(centre, 10.0, 7), 0);
  for (int y = 30; y < 100; ++y) {
    for (int x = -30; x < 30; ++x) {
      const double distance = std::clamp(sphere_distance({x, y, 3}, centre, 10.0), -8.0, 8.0);
      EXPECT_NEAR(grid.density({x, y, 3}), distance, 8.0 / 2048.0);
      EXPECT_EQ(grid.material({x, y, 3}), distance < 0.0 ? 7 : 0);
    }
  }
  EXPECT_EQ(grid.add_sphere(centre, 10.0, 9), 0);
}

TEST(DensityEdits, KeepMaterialOfRemovedRockNearSurface) {
  DensityGrid grid;
  grid.add_box({-20, -20, -20}, {20, 20, 20}, 3);
  grid.remove_sphere({20, 0, 0}, 6.0);
  EXPECT_GT(grid.density({16, 0, 0}), 0.0F);
  EXPECT_EQ(grid.material({16, 0, 0}), 3);
  grid.add_sphere({17, 0, 0}, 2.0, 5);
  EXPECT_EQ(grid.material({16, 0, 0}), 5);
  EXPECT_EQ(grid.material({0, 0, 0}), 3);
}

TEST(DensityEdits, RemovingAllSolidLeavesNoChunks) {
  DensityGrid grid;
  ChangeFollower follower(grid);
  grid.add_box({-70, 3, 3}, {80, 90, 40}, 3, 4.0);
  EXPECT_GT(grid.chunk_count(), 3U);
  grid.remove_sphere({0, 40, 20}, 400.0);
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_EQ(grid.solid_count(), 0);
  EXPECT_TRUE(grid.solid_bounds().empty());
  EXPECT_FALSE(follower.take(grid, 0).empty());
}

TEST(DensityEdits, BlendIntoAirAddsOnlyShape) {
  DensityGrid sharp;
  DensityGrid blended;
  sharp.add_sphere({5, 5, 5}, 9.0, 1);
  blended.add_sphere({5, 5, 5}, 9.0, 1, 1e9);
  EXPECT_EQ(sharp.solid_count(), blended.solid_count());
}

TEST(DensityEdits, BlendFillsCrease) {
  DensityGrid sharp;
  DensityGrid blended;
  for (DensityGrid* grid : {&sharp, &blended}) grid->add_box({-20, -20, -20}, {20, 0, 20}, 1);
  sharp.add_sphere({0, 4, 0}, 6.0, 1);
  blended.add_sphere({0, 4, 0}, 6.0, 1, 4.0);
  EXPECT_GT(blended.solid_count(), sharp.solid_count());
  for (int x = 0; x < 20; ++x) EXPECT_LE(blended.density({x, 1, 0}), sharp.density({x, 1, 0}));
}

TEST(DensityEdits, IgnoreInvalidSizes) {
  DensityGrid grid;
  grid.add_sphere({0, 0, 0}, 5.0, 1);
  ChangeFollower follower(grid);
  for (const double bad : {-1.0, kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(grid.add_sphere({0, 0, 0}, bad, 2), 0);
    EXPECT_EQ(grid.add_sphere({0, 0, 0}, 9.0, 2, bad), 0);
    EXPECT_EQ(grid.remove_sphere({0, 0, 0}, bad), 0);
    EXPECT_EQ(grid.add_box({0, 0, 0}, {5, 5, bad}, 2), 0);
    EXPECT_EQ(grid.add_box({0, 0, 0}, {5, 5, 5}, 2, bad), 0);
    EXPECT_EQ(grid.remove_box({0, 0, 0}, {5, bad, 5}), 0);
    EXPECT_EQ(grid.smooth({0, 0, 0}, bad, 0.5), 0);
    EXPECT_EQ(grid.flatten({0, 0, 0}, bad, {{0, 0, 0}, {0, 1, 0}, 0.5, 1}), 0);
  }
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(grid.add_sphere({0, bad, 0}, 3.0, 2), 0);
    EXPECT_EQ(grid.smooth({bad, 0, 0}, 3.0, 0.5), 0);
    EXPECT_EQ(grid.flatten({0, 0, 0}, 5.0, {{0, bad, 0}, {0, 1, 0}, 0.5, 1}), 0);
    EXPECT_EQ(grid.flatten({0, 0, 0}, 5.0, {{0, 0, 0}, {0, bad, 0}, 0.5, 1}), 0);
  }
  for (const double bad : {0.0, -1.0, kNan, -kInfinity}) {
    EXPECT_EQ(grid.smooth({0, 0, 0}, 5.0, bad), 0);
    EXPECT_EQ(grid.flatten({0, 0, 0}, 5.0, {{0, 1, 0}, {0, 1, 0}, bad, 1}), 0);
  }
  EXPECT_EQ(grid.flatten({0, 0, 0}, 5.0, {{0, 1, 0}, {0, 0, 0}, 0.5, 1}), 0);
  EXPECT_FALSE(follower.is_behind(grid));
  EXPECT_TRUE(follower.take(grid, 64).empty());
}

TEST(DensityEdits, HandleDistantAndHugeShapes) {
  DensityGrid grid;
  ChangeFollower follower(grid);
  EXPECT_EQ(grid.add_sphere({1e300, 0, 0}, 5.0, 1), 0);
  EXPECT_EQ(grid.add_box({1e300, 1e300, 1e300}, {1.7e308, 1.7e308, 1.7e308}, 1), 0);
  EXPECT_GT(grid.add_sphere({1e9, -1e9, 1e9}, 5.0, 1), 0);
  EXPECT_GT(grid.smooth({0, 0, 0}, 1e300, 0.5), 0);
  EXPECT_GT(grid.remove_sphere({0, 0, 0}, 1e300), 0);
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_EQ(grid.remove_box({-1.7e308, -1.7e308, -1.7e308}, {1.7e308, 1.7e308, 1.7e308}), 0);
  const double edge = std::numeric_limits<int>::max();
  EXPECT_EQ(grid.add_sphere({edge, edge, edge}, 20.0, 1), 0);
  EXPECT_GT(grid.add_sphere({edge - 64.0, 0, 0}, 20.0, 1), 0);
  EXPECT_LT(grid.solid_bounds().max.x, std::numeric_limits<int>::max() - 62);
  EXPECT_GT(grid.add_sphere({-edge + 64.0, 0, 0}, 20.0, 1), 0);
  EXPECT_FALSE(follower.take(grid, 64).empty());
}

TEST(DensityEdits, StoreInsideOfLargeSolidUniformly) {
  DensityGrid grid;
  EXPECT_EQ(grid.add_box({-8, -8, -8}, {64 * 4 + 7, 64 * 4 + 7, 64 * 4 + 7}, 2) > 0, true);
  EXPECT_EQ(grid.find_chunk({1, 1, 1})->uniform(), std::optional(stored_density(-8.0F, 8.0F)));
  EXPECT_EQ(grid.find_chunk({0, 0, 0})->uniform(), std::optional(stored_density(-8.0F, 8.0F)));
  EXPECT_EQ(grid.find_chunk({-1, 0, 0})->uniform(), std::nullopt);
  EXPECT_EQ(grid.material({100, 100, 100}), 2);
}

TEST(DensityEdits, SmoothingLowersTip) {
  DensityGrid grid;
  grid.add_box({-30, -30, -30}, {30, 0, 30}, 4);
  grid.add_sphere({0, 0, 0}, 1.2, 6);
  const float before = grid.density({0, 1, 0});
  EXPECT_LT(before, 0.0F);
  EXPECT_GT(grid.smooth({0, 0, 0}, 8.0, 1.0), 0);
  EXPECT_GT(grid.density({0, 1, 0}), before);
}

TEST(DensityEdits, FlatteningMovesSurfaceToPlane) {
  DensityGrid grid;
  grid.add_box({-30, -30, -30}, {30, 0, 30}, 4);
  grid.flatten({0, 3, 0}, 20.0, {{0, 3, 0}, {0, 1e300, 0}, 1.0, 5});
  EXPECT_EQ(grid.density({0, 3, 0}), 0.0F);
  EXPECT_NEAR(grid.density({4, 3, 4}), 3.0F - 3.0F * std::pow(1.0F - 32.0F / 400.0F, 2.0F), 0.01F);
  EXPECT_LT(grid.density({0, 2, 0}), 0.0F);
  EXPECT_EQ(grid.material({0, 2, 0}), 5);
  EXPECT_EQ(grid.material({0, -2, 0}), 4);
}

TEST(DensityEdits, StopWhenCancelled) {
  std::int64_t asked = 0;
  double last = 0.0;
  const auto listen = [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
    return ++asked < 3;
  };
  const auto fresh = [&] {
    asked = 0;
    last = 0.0;
    return DensityGrid();
  };
  DensityGrid grid = fresh();
  ChangeCursor cursor = grid.cursor();
  const std::int64_t edited = grid.edit(
      IBox{IVec3(0), IVec3(1'000'000, 64, 64)},
      [](IVec3, DensitySample) {
        return DensitySample{-8.0F, 3};
      },
      listen);
  EXPECT_EQ(edited, 3 * 64 * 64 * 64);
  EXPECT_EQ(grid.solid_count(), edited) << "what was done stays";
  EXPECT_EQ(grid.changes_since(cursor).items_unless_all().size(), 3U) << "and is reported";

  grid = fresh();
  const std::int64_t added = grid.add_box(DVec3(0.0), DVec3(1e9), 3, 0.0, 0.0, listen);
  EXPECT_GT(added, 0);
  EXPECT_EQ(asked, 3);
  grid = fresh();
  grid.add_sphere(DVec3(0.0), 1e6, 3, 0.0, listen);
  EXPECT_EQ(asked, 3);
  grid = fresh();
  grid.flatten(DVec3(0.0), 1e6, {}, listen);
  EXPECT_EQ(asked, 3);

  grid = DensityGrid();
  double whole = 0.0;
  grid.add_sphere(DVec3(0.0), 40.0, 3, 0.0, [&](double fraction) { return (whole = fraction) <= 1.0; });
  EXPECT_EQ(whole, 1.0);
  DensityGrid same;
  same.add_sphere(DVec3(0.0), 40.0, 3);
  EXPECT_EQ(grid.solid_count(), same.solid_count());
}

}  // namespace
}  // namespace quoin
