#include "trace/density/density_glass.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace quoin {
namespace {

constexpr VoxelType kOpaque = 0xFFFF;

struct Types {
  VoxelRegistry registry;
  VoxelType stone, water, glass, amber;

  Types() {
    const auto add = [this](Visibility visibility) {
      VoxelProperties properties;
      properties.visibility = visibility;
      return registry.add(properties).value();
    };
    stone = add(Visibility::Opaque);
    water = add(Visibility::Transparent);
    glass = add(Visibility::Transparent);
    amber = add(Visibility::Transparent);
  }
};

// Finds the material at a point: the simple slow way, in double precision.
class Oracle {
 public:
  Oracle(const DensityGrid& field, const VoxelRegistry& types) : field_(&field), types_(&types) {}

  [[nodiscard]] VoxelType body_of(IVec3 sample) const {
    if (!(field_->density(sample) < 0.0F)) return kAir;
    const VoxelType material = field_->material(sample);
    return types_->is_transparent(material) ? material : kOpaque;
  }

  // Returns the trilinear field of one body; for kAir, the field of the whole solid.
  [[nodiscard]] double field_of(VoxelType body, const DVec3& p) const {
    const DVec3 whole = glm::floor(p);
    const DVec3 f = p - whole;
    double sum = 0.0;
    for (int i = 0; i < 8; ++i) {
      const IVec3 corner{i & 1, i >> 1 & 1, i >> 2};
      const double weight =
          (corner.x == 0 ? 1 - f.x : f.x) * (corner.y == 0 ? 1 - f.y : f.y) * (corner.z == 0 ? 1 - f.z : f.z);
      const IVec3 sample = IVec3(whole) + corner;
      const double density = field_->density(sample);
      sum += weight * (body == kAir || body_of(sample) == body ? density : std::abs(density));
    }
    return sum;
  }

  [[nodiscard]] VoxelType at(const DVec3& p) const {
    if (!(field_of(kAir, p) < 0.0)) return kAir;
    if (field_of(kOpaque, p) < 0.0) return kOpaque;
    VoxelType best = kAir;
    double least = std::numeric_limits<double>::infinity();
    for (VoxelType type = 1; type < types_->size(); ++type) {
      if (!types_->is_transparent(type)) continue;
      const double own = field_of(type, p);
      if (own < least) least = own, best = type;
    }
    return best;
  }

 private:
  const DensityGrid* field_;
  const VoxelRegistry* types_;
};

std::vector<GlassSpan> spans_along(const DensityGlass& glass, const Ray& ray, double max_t, double largest) {
  std::vector<GlassSpan> spans;
  visit_glass(
      glass, ray, max_t, [&](VoxelType) { return largest; },
      [&](const GlassSpan& span) {
        spans.push_back(span);
        return true;
      });
  return spans;
}

// Joins consecutive spans of one type.
std::vector<GlassSpan> joined(const std::vector<GlassSpan>& spans) {
  std::vector<GlassSpan> bodies;
  for (const GlassSpan& span : spans) {
    if (!bodies.empty() && bodies.back().type == span.type && bodies.back().t_exit == span.t_enter) {
      bodies.back().t_exit = span.t_exit;
    } else {
      bodies.push_back(span);
    }
  }
  return bodies;
}

VoxelType type_at(const std::vector<GlassSpan>& spans, double t) {
  for (const GlassSpan& span : spans) {
    if (t >= span.t_enter && t < span.t_exit) return span.type;
  }
  return kAir;
}

DVec3 random_between(std::mt19937& random, double low, double high) {
  std::uniform_real_distribution<double> any(low, high);
  return {any(random), any(random), any(random)};
}

// Gives every sample its own value and material: all kinds of cells.
DensityGrid noise(const Types& types, IVec3 corner, int edge, unsigned seed, int materials) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> density(-4.0F, 2.5F);
  DensityGrid field;
  field.edit({corner, corner + edge}, [&](IVec3, DensitySample) {
    const auto material = static_cast<VoxelType>(types.stone + random() % static_cast<unsigned>(materials));
    return DensitySample{density(random), material};
  });
  return field;
}

// Compares a ray's spans with the oracle at many points. Returns the number of transparent points.
int check(const DensityGlass& glass, const Oracle& oracle, const Ray& ray, double max_t) {
  const std::vector<GlassSpan> spans = spans_along(glass, ray, max_t, 64.0);
  double last = 0.0;
  for (const GlassSpan& span : spans) {
    EXPECT_GE(span.t_enter, last);
    EXPECT_GT(span.t_exit, span.t_enter);
    EXPECT_LE(span.t_exit, max_t);
    EXPECT_EQ(span.starts_inside, span.t_enter == 0.0 && oracle.at(ray.origin) == span.type);
    last = span.t_exit;
  }
  int transparent = 0;
  constexpr double kStep = 0.0137;
  for (double t = 0.5 * kStep; t < max_t; t += kStep) {
    const auto found = [&](double at) { return oracle.at(ray.origin + ray.direction * at); };
    const VoxelType type = found(t);
    // Near a change either answer is correct.
    if (found(t - 2e-3) != type || found(t + 2e-3) != type) continue;
    const VoxelType expected = type == kOpaque ? kAir : type;
    EXPECT_EQ(type_at(spans, t), expected) << t;
    transparent += expected != kAir;
    if (testing::Test::HasFailure()) return transparent;
  }
  return transparent;
}

TEST(DensityGlass, SpansMatchOracle) {
  const Types types;
  std::mt19937 random(3);
  for (const int materials : {2, 3, 4}) {
    for (const IVec3 corner : {IVec3{20, 20, 20}, IVec3{58, 57, 59}, IVec3{-7, -70, -134}}) {
      const DensityGrid field = noise(types, corner, 10, random(), materials);
      const DensityGlass glass(field, types.registry);
      const Oracle oracle(field, types.registry);
      const DVec3 middle = DVec3(corner) + 5.0;
      int transparent = 0;
      for (int i = 0; i < 40; ++i) {
        const DVec3 origin = middle + random_between(random, -9.0, 9.0);
        DVec3 direction = glm::normalize(middle + random_between(random, -4.0, 4.0) - origin);
        if (i % 4 == 0) direction = DVec3{0, 0, origin.z < middle.z ? 1.0 : -1.0};
        transparent += check(glass, oracle, {origin, direction}, i % 5 == 0 ? 6.5 : 24.0);
        if (HasFailure()) FAIL() << "materials " << materials << ", ray " << i;
      }
      EXPECT_GT(transparent, 2000);
    }
  }
}

// A lake and a ball of glass in it: large blocks of one type.
DensityGrid lake(const Types& types) {
  DensityGrid field;
  field.edit({{-40, -40, -40}, {100, 20, 100}}, [&](IVec3 p, DensitySample) {
    const double floor = p.y + 20.0 + 6.0 * std::sin(0.1 * p.x);
    const double ball = glm::distance(DVec3(p), DVec3{30, -6, 30}) - 12.0;
    const double surface = p.y - 8.3;
    const double depth = std::min({std::abs(floor), std::abs(ball), std::abs(surface)});
    if (floor < 0.0) return DensitySample{static_cast<float>(-depth), types.stone};
    if (ball < 0.0) return DensitySample{static_cast<float>(-depth), types.glass};
    return DensitySample{static_cast<float>(surface < 0.0 ? -depth : depth), types.water};
  });
  return field;
}

TEST(DensityGlass, BlocksMatchCells) {
  const Types types;
  const DensityGrid field = lake(types);
  const DensityGlass glass(field, types.registry);
  std::mt19937 random(11);
  std::size_t by_cells = 0;
  std::size_t by_blocks = 0;
  for (int i = 0; i < 3000; ++i) {
    const DVec3 origin = DVec3{30, 0, 30} + random_between(random, -80.0, 80.0);
    const Ray ray{origin, glm::normalize(DVec3{30, -6, 30} + random_between(random, -30.0, 30.0) - origin)};
    const auto single = spans_along(glass, ray, 300.0, 1.0);
    const auto large = spans_along(glass, ray, 300.0, 64.0);
    by_cells += single.size();
    by_blocks += large.size();
    const auto one = joined(single);
    const auto other = joined(large);
    ASSERT_EQ(one.size(), other.size()) << i;
    for (std::size_t k = 0; k < one.size(); ++k) {
      ASSERT_EQ(one[k].type, other[k].type);
      ASSERT_EQ(one[k].t_enter, other[k].t_enter);
      ASSERT_EQ(one[k].t_exit, other[k].t_exit);
    }
  }
  EXPECT_LT(2 * by_blocks, by_cells);
}

TEST(DensityGlass, ReportsEntryAndExitOfBallInWater) {
  const Types types;
  const DensityGrid field = lake(types);
  const DensityGlass glass(field, types.registry);
  const auto bodies = joined(spans_along(glass, {{30, 50, 30}, {0, -1, 0}}, 300.0, 64.0));
  ASSERT_EQ(bodies.size(), 3U);
  const double floor = 20.0 + 6.0 * std::sin(3.0);
  EXPECT_EQ(bodies[0].type, types.water);
  EXPECT_NEAR(bodies[0].t_enter, 50.0 - 8.3, 0.01);
  EXPECT_EQ(bodies[1].type, types.glass);
  EXPECT_NEAR(bodies[1].t_enter, 50.0 - 6.0, 0.05);
  EXPECT_NEAR(bodies[1].t_exit, 50.0 + 18.0, 0.05);
  EXPECT_NEAR(bodies[2].t_exit, 50.0 + floor, 0.05);
  const auto normal = [&](const GlassSpan& body, double t, VoxelType other) {
    return glass_normal(glass, {30, static_cast<int>(std::floor(50.0 - t)), 30}, {30, 50 - t, 30}, body.type, other);
  };
  EXPECT_GT(normal(bodies[0], bodies[0].t_enter, kAir).y, 0.999);
  EXPECT_GT(normal(bodies[1], bodies[1].t_enter, types.water).y, 0.99);
  EXPECT_GT(normal(bodies[2], bodies[2].t_enter, types.glass).y, 0.99) << "out of the water, into the ball above";
  EXPECT_LT(normal(bodies[1], bodies[1].t_exit, types.water).y, -0.99) << "out of the ball";
}

// Compares digging, painting and filling with trees that are built from scratch.
TEST(DensityGlass, FollowsEdits) {
  const Types types;
  DensityGrid field = lake(types);
  DensityGlass glass(field, types.registry);
  ChangeCursor cursor = field.cursor();
  std::mt19937 random(17);
  const auto place = [&] { return DVec3{30, 0, 30} + random_between(random, -36.0, 36.0); };
  for (int i = 0; i < 8; ++i) {
    field.remove_sphere(place(), 6.0);
    field.add_sphere(place(), 5.0, i % 2 == 0 ? types.glass : types.stone);
    const IVec3 corner(place());
    field.edit({corner, corner + 9}, [&](IVec3, DensitySample now) {
      now.material = i % 3 == 0 ? types.water : i % 3 == 1 ? types.stone : types.amber;
      return now;
    });
    glass.update(types.registry, field.changes_since(cursor));
    const DensityGlass fresh(field, types.registry);
    EXPECT_EQ(glass.cells().bounds(), fresh.cells().bounds());
    for (int k = 0; k < 200; ++k) {
      const DVec3 origin = place();
      const Ray ray{origin, glm::normalize(place() - origin)};
      const auto followed = spans_along(glass, ray, 200.0, 64.0);
      const auto anew = spans_along(fresh, ray, 200.0, 64.0);
      ASSERT_EQ(followed.size(), anew.size()) << i;
      for (std::size_t s = 0; s < anew.size(); ++s) {
        ASSERT_EQ(followed[s].type, anew[s].type);
        ASSERT_EQ(followed[s].t_enter, anew[s].t_enter);
        ASSERT_EQ(followed[s].t_exit, anew[s].t_exit);
      }
    }
  }
}

TEST(DensityGlass, StopsWithVisitorOrRay) {
  const Types types;
  const DensityGrid field = lake(types);
  const DensityGlass glass(field, types.registry);
  const Ray down{{0, 50, 0}, {0, -2, 0}};
  int visits = 0;
  visit_glass(
      glass, down, 100.0, [](VoxelType) { return 64.0; }, [&](const GlassSpan&) { return ++visits < 2; });
  EXPECT_EQ(visits, 2);
  EXPECT_TRUE(spans_along(glass, down, 20.0, 64.0).empty());
  const auto cut = joined(spans_along(glass, down, 22.0, 64.0));
  ASSERT_EQ(cut.size(), 1U);
  EXPECT_EQ(cut[0].t_exit, 22.0);
  EXPECT_TRUE(spans_along(glass, {DVec3(std::nan("")), {0, 1, 0}}, 10.0, 64.0).empty());
  EXPECT_TRUE(spans_along(glass, {{0, 0, 0}, {0, 0, 0}}, 10.0, 64.0).empty());
  EXPECT_TRUE(spans_along(glass, down, -1.0, 64.0).empty());
}

}  // namespace
}  // namespace quoin
