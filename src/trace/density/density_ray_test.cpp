#include <quoin/trace/density_ray.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "core/instruction_sets_for_tests.h"
#include "core/not_finite_for_tests.h"

namespace quoin {
namespace {

// The trilinear field in double precision, sample by sample: the reference for rays.
class Dense {
 public:
  explicit Dense(const DensityGrid& field) : field_(field) {}

  [[nodiscard]] double at(const DVec3& p) const {
    const DVec3 whole = glm::floor(p);
    const DVec3 f = p - whole;
    double sum = 0.0;
    for (int i = 0; i < 8; ++i) {
      const IVec3 corner{i & 1, i >> 1 & 1, i >> 2};
      const double weight =
          (corner.x == 0 ? 1 - f.x : f.x) * (corner.y == 0 ? 1 - f.y : f.y) * (corner.z == 0 ? 1 - f.z : f.z);
      sum += weight * static_cast<double>(field_.density(IVec3(whole) + corner));
    }
    return sum;
  }

  // Returns the lowest density on the ray from `from` to `to`, by more samples than a cubic has extremes in a cell.
  [[nodiscard]] double least(const Ray& ray, double from, double to) const {
    const double step = 0.02 / glm::length(ray.direction);
    double least = kInfinity;
    for (double t = from; t < to; t += step) least = std::min(least, at(ray.origin + ray.direction * t));
    return least;
  }

 private:
  const DensityGrid& field_;
};

struct Tally {
  int hits = 0;
  int misses = 0;
  int inside = 0;
  int left_out = 0;
};

// Returns the material of the nearest solid corner to a point of a cell; the one with the lowest index at ties.
VoxelType material_at(const DensityGrid& field, IVec3 cell, const DVec3& p) {
  double least = kInfinity;
  VoxelType found = kAir;
  for (int i = 0; i < 8; ++i) {
    const IVec3 sample = cell + IVec3{i & 1, i >> 1 & 1, i >> 2};
    const double away = glm::distance(DVec3(sample), p);
    if (field.density(sample) < 0.0F && away < least - 1e-7) {
      least = away;
      found = field.material(sample);
    }
  }
  return found;
}

// The field is not negative before a hit, and 0 at the hit. Without a hit it is never negative.
void check(const DensityTree& tree, const Ray& ray, double max_t, double far, Tally& tally) {
  const Dense dense(tree.field());
  const auto hit = first_hit(tree, ray, max_t);
  ASSERT_EQ(any_hit(tree, ray, max_t), hit.has_value());
  // A ray may skip a cell that it passes for less than 1e-3. Densities on that stretch stay above this limit.
  constexpr double kLeftOut = -0.02;
  if (!hit) {
    ++tally.misses;
    const double least = dense.least(ray, 0.0, std::min(max_t, far));
    EXPECT_GE(least, kLeftOut);
    tally.left_out += least < -1e-9;
    return;
  }
  ASSERT_LE(hit->t, max_t);
  ASSERT_GE(hit->t, 0.0);
  const DVec3 p = ray.origin + ray.direction * hit->t;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GE(p[axis], hit->cell[axis] - 1e-6);
    EXPECT_LE(p[axis], hit->cell[axis] + 1 + 1e-6);
  }
  if (hit->starts_inside) {
    ++tally.inside;
    EXPECT_EQ(hit->t, 0.0);
    EXPECT_LT(dense.at(p), 1e-9);
  } else {
    ++tally.hits;
    const double least = dense.least(ray, 0.0, hit->t - 1e-9);
    EXPECT_GE(least, kLeftOut) << hit->t;
    tally.left_out += least < -1e-9;
    EXPECT_NEAR(dense.at(p), 0.0, 1e-6) << hit->t;
    // The density decreases from here on.
    EXPECT_LE(glm::dot(hit->normal, ray.direction), 1e-6 * glm::length(ray.direction));
  }
  if (hit->normal != DVec3(0.0)) {
    EXPECT_NEAR(glm::length(hit->normal), 1.0, 1e-9);
  }
  EXPECT_EQ(hit->material, material_at(tree.field(), hit->cell, p));
}

DVec3 random_in(std::mt19937& random, double low, double high) {
  std::uniform_real_distribution<double> any(low, high);
  return {any(random), any(random), any(random)};
}

// Every sample has its own value: cells with up to three crossings of a ray, and sheets of all kinds.
DensityGrid noise(IVec3 corner, int edge, unsigned seed, double share_of_air) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> density(-4.0F, 4.0F);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  DensityGrid field;
  field.edit({corner, corner + edge}, [&](IVec3, DensitySample) {
    const float d = density(random);
    return DensitySample{any(random) < share_of_air ? std::abs(d) : d, static_cast<VoxelType>(1 + random() % 200)};
  });
  return field;
}

class DensityRays : public testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    QUOIN_SKIP_WITHOUT(GetParam());
    over_.emplace(GetParam());
  }

 private:
  std::optional<InstructionSetOverride> over_;
};

TEST_P(DensityRays, MatchTrilinearField) {
  Tally tally;
  std::mt19937 random(1);
  // Within one chunk, over the corner of eight, and among negative numbers.
  for (const IVec3 corner : {IVec3{20, 20, 20}, IVec3{58, 57, 59}, IVec3{-7, -70, -134}}) {
    for (const double share_of_air : {0.0, 0.7, 0.98}) {
      const DensityGrid field = noise(corner, 12, random(), share_of_air);
      const DensityTree tree(field);
      const DVec3 middle = DVec3(corner) + 6.0;
      for (int i = 0; i < 400; ++i) {
        Ray ray{middle + random_in(random, -14.0, 14.0), random_in(random, -1.0, 1.0)};
        if (i % 3 == 0) ray.direction = middle + random_in(random, -5.0, 5.0) - ray.origin;
        // Along axes and planes, starting at integers.
        if (i % 5 == 0) ray.direction[i / 5 % 3] = 0.0;
        if (i % 20 == 0) ray.direction[(i / 5 + 1) % 3] = 0.0;
        if (i % 7 == 0) ray.origin = glm::round(ray.origin);
        if (glm::length(ray.direction) == 0.0) continue;
        const double max_t = i % 4 == 0 ? 10.0 / glm::length(ray.direction) : kInfinity;
        check(tree, ray, max_t, 40.0 / glm::length(ray.direction), tally);
      }
    }
  }
  EXPECT_GT(tally.hits, 600);
  EXPECT_GT(tally.misses, 400);
  EXPECT_GT(tally.inside, 30);
  EXPECT_LE(tally.left_out, 1);
}

TEST_P(DensityRays, MatchPackets) {
  const DensityGrid field = noise({58, 57, 59}, 12, 5, 0.8);
  const DensityTree tree(field);
  std::mt19937 random(2);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    RayPacket packet;
    const DVec3 eye = DVec3(64.0) + random_in(random, -20.0, 20.0);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      if (random() % 8 == 0) continue;
      const DVec3 origin = i % 2 == 0 ? eye : DVec3(64.0) + random_in(random, -9.0, 9.0);
      Ray ray{origin, DVec3(64.0) + random_in(random, -7.0, 7.0) - origin};
      if (random() % 16 == 0) ray.direction.x = 0.0;
      if (random() % 64 == 0) ray.direction.x = std::numeric_limits<double>::quiet_NaN();
      packet.set(lane, ray, random() % 4 == 0 ? 0.5 : random() % 32 == 0 ? -1.0 : kInfinity);
    }
    DensityPacketHits found;
    first_hits(tree, packet, found);
    const std::uint32_t blocked = any_hits(tree, packet);
    EXPECT_EQ(blocked, found.hit);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const auto at = static_cast<std::size_t>(lane);
      const bool is_active = (packet.active >> lane & 1U) != 0;
      const auto alone = is_active ? first_hit(tree, packet.ray(lane), packet.max_t[at]) : std::nullopt;
      ASSERT_EQ(found.hit >> lane & 1U, alone.has_value());
      if (!alone) continue;
      ++hits;
      const DensityHit& hit = found.lanes[at];
      EXPECT_EQ(hit.t, alone->t);
      EXPECT_EQ(hit.cell, alone->cell);
      EXPECT_EQ(hit.normal, alone->normal);
      EXPECT_EQ(hit.material, alone->material);
      EXPECT_EQ(hit.starts_inside, alone->starts_inside);
    }
  }
  EXPECT_GT(hits, 1200);
}

// Packets of short rays walk in windows, other packets from cell to cell.
TEST_P(DensityRays, ShortRaysMatchPackets) {
  std::mt19937 random(11);
  int blocked = 0;
  int free = 0;
  // A field in eight chunks, a small field, and a field of thin solids.
  const DensityGrid fields[] = {noise({58, 57, 59}, 12, 5, 0.6), noise({0, 0, 0}, 9, 6, 0.8),
                                noise({-7, -70, -134}, 40, 7, 0.98)};
  for (const DensityGrid& field : fields) {
    const DensityTree tree(field);
    const IBox box = tree.cells().bounds();
    for (int i = 0; i < 1'500; ++i) {
      RayPacket packet;
      const DVec3 size(box.max - box.min);
      const DVec3 place = DVec3(box.min) - 2.0 + random_in(random, 0.0, 1.0) * (size + 4.0);
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        if (random() % 16 == 0) continue;
        Ray ray{place + random_in(random, -1.5, 1.5) * (i % 4 == 0 ? 8.0 : 1.0), random_in(random, -1.0, 1.0)};
        if (i % 3 == 0) ray.origin = glm::round(ray.origin * 2.0) / 2.0;
        if (i % 5 == 0) ray.direction = glm::round(ray.direction * 2.0);
        if (random() % 8 == 0) ray.direction[static_cast<int>(random() % 3)] *= 1e-5;
        const double max_t = random() % 64 == 0 ? -1.0 : static_cast<double>(random() % 24) * 0.5;
        packet.set(lane, ray, random() % 64 == 0 ? kInfinity : max_t);
      }
      const std::uint32_t found = any_hits(tree, packet);
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        if ((packet.active >> lane & 1U) == 0) continue;
        const bool is_blocked = any_hit(tree, packet.ray(lane), packet.max_t[static_cast<std::size_t>(lane)]);
        ASSERT_EQ((found >> lane & 1U) != 0, is_blocked) << "packet " << i << " lane " << lane;
        ++(is_blocked ? blocked : free);
      }
    }
  }
  EXPECT_GT(blocked, 4'000);
  EXPECT_GT(free, 4'000);
}

// A ray that enters and leaves a cell at zeros of the field has no root in it.
TEST_P(DensityRays, RaysThroughZerosMatchPackets) {
  std::mt19937 random(12);
  DensityGrid field;
  field.edit({IVec3{58}, IVec3{70}}, [&](IVec3, DensitySample) {
    return DensitySample{static_cast<float>(static_cast<int>(random() % 5)) - 2.0F, 1};
  });
  const DensityTree tree(field);
  int hits = 0;
  for (int i = 0; i < 6'000; ++i) {
    RayPacket packet;
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const auto corner = [&] { return DVec3(glm::round(random_in(random, 57.0, 71.0) * 2.0) / 2.0); };
      const DVec3 from = corner();
      const DVec3 way = (corner() - from) * random_in(random, 0.1, 3.0).x;
      if (way != DVec3(0.0)) packet.set(lane, {from, way}, random() % 8 == 0 ? 1.0 : kInfinity);
    }
    DensityPacketHits found;
    first_hits(tree, packet, found);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      if ((packet.active >> lane & 1U) == 0) continue;
      const auto at = static_cast<std::size_t>(lane);
      const auto alone = first_hit(tree, packet.ray(lane), packet.max_t[at]);
      ASSERT_EQ((found.hit >> lane & 1U) != 0, alone.has_value()) << "packet " << i << " lane " << lane;
      ASSERT_EQ(any_hit(tree, packet.ray(lane), packet.max_t[at]), alone.has_value());
      if (!alone) continue;
      ++hits;
      ASSERT_EQ(found.lanes[at].t, alone->t);
      ASSERT_EQ(found.lanes[at].cell, alone->cell);
    }
  }
  EXPECT_GT(hits, 20'000);
}

// Cells at the faces of a rough chunk, whose neighbours are solid, air, missing or rough: their corners lie in up to
// eight chunks, some without storage. Rays run along the faces, through many cells with a solid corner.
TEST_P(DensityRays, RaysAlongChunkFacesMatchPlainCode) {
  std::mt19937 random(21);
  std::uniform_real_distribution<float> rough(-0.9F, 0.9F);
  DensityGrid field;
  const IBox chunk{IVec3{64}, IVec3{128}};
  field.edit(chunk, [&](IVec3 p, DensitySample) {
    const int out = (p.x + p.y + p.z) % 9 - 4;
    return DensitySample{static_cast<float>(out) * 0.5F + rough(random), 1};
  });
  const auto fill = [&](IVec3 at, float density) {
    field.edit({at * 64, at * 64 + 64}, [&](IVec3, DensitySample) { return DensitySample{density, 2}; });
  };
  fill({2, 1, 1}, -8.0F);
  fill({1, 2, 1}, 3.0F);
  fill({1, 0, 1}, -2.5F);
  field.edit({{64, 64, 128}, {128, 128, 140}}, [&](IVec3, DensitySample) {
    return DensitySample{rough(random) + 0.3F, 3};
  });
  const DensityTree tree(field);
  int hits = 0;
  int misses = 0;
  for (int i = 0; i < 1'500; ++i) {
    const int axis = i % 3;
    const double face = i % 2 == 0 ? 127.5 : 63.5;
    RayPacket packet;
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      DVec3 from = random_in(random, 66.0, 126.0);
      from[axis] = face + random_in(random, -1.2, 1.2).x;
      DVec3 way = random_in(random, -1.0, 1.0);
      way[axis] *= i % 5 == 0 ? 1.0 : 0.02;
      packet.set(lane, {from, way}, i % 4 == 0 ? kInfinity : random_in(random, 0.1, 9.0).x);
    }
    DensityPacketHits found;
    first_hits(tree, packet, found);
    const std::uint32_t blocked = any_hits(tree, packet);
    EXPECT_EQ(blocked, found.hit);
    const InstructionSetOverride plain(InstructionSet::Plain);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const auto at = static_cast<std::size_t>(lane);
      const auto expected = first_hit(tree, packet.ray(lane), packet.max_t[at]);
      ASSERT_EQ((found.hit >> lane & 1U) != 0, expected.has_value()) << "packet " << i << " lane " << lane;
      expected ? ++hits : ++misses;
      if (!expected) continue;
      ASSERT_EQ(found.lanes[at].t, expected->t) << "packet " << i << " lane " << lane;
      ASSERT_EQ(found.lanes[at].cell, expected->cell);
      ASSERT_EQ(found.lanes[at].normal, expected->normal);
    }
  }
  EXPECT_GT(hits, 12'000);
  EXPECT_GT(misses, 500);
}

TEST_P(DensityRays, HitSphereAtItsSurface) {
  for (const DVec3 centre : {DVec3(31.5), DVec3(64.0, -64.0, 0.0), DVec3(1'000'000.0, -2'000'000.0, 500'000.0)}) {
    DensityGrid field;
    field.add_sphere(centre, 20.0, 7);
    const DensityTree tree(field);
    std::mt19937 random(3);
    for (int i = 0; i < 300; ++i) {
      const DVec3 out = glm::normalize(random_in(random, -1.0, 1.0));
      const double distance = i % 2 == 0 ? 60.0 : 5'000.0;
      const auto hit = first_hit(tree, {centre + out * distance, -out * 3.0});
      ASSERT_TRUE(hit);
      EXPECT_NEAR(hit->t * 3.0, distance - 20.0, 0.02);
      // Cells approximate the sphere, so the normal deviates slightly.
      EXPECT_GT(glm::dot(hit->normal, out), 0.998);
      EXPECT_EQ(hit->material, 7);
      // Passes the sphere, and starts away from it.
      const DVec3 aside = glm::normalize(glm::cross(out, DVec3(0.3, 0.5, 0.8))) * 20.1;
      EXPECT_FALSE(first_hit(tree, {centre + out * distance + aside, -out}));
      EXPECT_FALSE(any_hit(tree, {centre + out * 21.0, out}));
    }
    const auto inside = first_hit(tree, {centre + 0.25, {0, 1, 0}});
    ASSERT_TRUE(inside && inside->starts_inside);
    EXPECT_EQ(inside->t, 0.0);
  }
}

// Returns hills of 2,048 samples, 12 high, with a rough surface.
DensityGrid long_hills() {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> rough(-0.2F, 0.2F);
  DensityGrid field;
  field.edit({IVec3{-1024, 30, 40}, IVec3{1024, 60, 72}}, [&](IVec3 p, DensitySample) {
    const auto height = static_cast<float>(44.0 + 4.0 * std::sin(p.x * 0.05) + 3.0 * std::sin(p.z * 0.3));
    return DensitySample{static_cast<float>(p.y) - height + rough(random), 3};
  });
  return field;
}

// Single precision skips no cell that a ray passes in double precision, even where it grazes the surface from far away.
TEST_P(DensityRays, MatchDoublePrecisionAtAnyDistance) {
  const DensityGrid field = long_hills();
  const DensityTree tree(field);
  std::mt19937 random(5);
  int hits = 0;
  int others = 0;
  for (int i = 0; i < 500; ++i) {
    RayPacket packet;
    const double side = i % 2 == 0 ? -1.0 : 1.0;
    const DVec3 eye = DVec3(side * (i % 3 == 0 ? 900.0 : 300.0), 52.0, 56.0) + random_in(random, -3.0, 3.0);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const DVec3 spread = random_in(random, -0.006, 0.006);
      const DVec3 direction = DVec3(-side, -0.008 + spread.y, spread.z) * (i % 4 == 0 ? 0.01 : 1.0);
      // Some rays run along the surface that the previous ray hit.
      packet.set(lane, {eye, direction}, kInfinity);
      const auto before = i % 5 == 0 ? first_hit(tree, {eye, direction}) : std::nullopt;
      if (before)
        packet.set(lane, {eye + direction * before->t + before->normal * 0.001, {-side, 0.05, 0.1}}, kInfinity);
    }
    DensityPacketHits found;
    first_hits(tree, packet, found);
    const std::uint32_t blocked = any_hits(tree, packet);
    const InstructionSetOverride plain(InstructionSet::Plain);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const auto expected = first_hit(tree, packet.ray(lane));
      const bool is_hit = (found.hit >> lane & 1U) != 0;
      EXPECT_EQ(blocked >> lane & 1U, found.hit >> lane & 1U);
      hits += is_hit;
      const DensityHit& hit = found.lanes[static_cast<std::size_t>(lane)];
      // Results may differ in cells that rays pass for less than 1e-3.
      others += is_hit != expected.has_value() || (is_hit && (hit.t != expected->t || hit.cell != expected->cell));
    }
  }
  EXPECT_GT(hits, 2'000);
  EXPECT_LE(others, 2);
}

// As after two turns of 90 degrees: below the walks' threshold for motion, on an integer coordinate.
TEST_P(DensityRays, TinyDirectionComponentsCountAsZero) {
  DensityGrid field;
  field.add_box({300, 20, 20}, {310, 100, 100}, 1);
  const DensityTree tree(field);
  for (const double slow : {0.0, -3.7e-33, 3.7e-33, -1e-310}) {
    for (const double z : {64.0, 63.5}) {
      const auto hit = first_hit(tree, {{0.4, 60.3, z}, {1, 0, slow}});
      ASSERT_TRUE(hit) << slow;
      EXPECT_NEAR(hit->t, 299.6, 1e-6) << slow;
    }
  }
}

TEST(DensityRay, StopsAtEnd) {
  DensityGrid field;
  field.add_box({10, 10, 10}, {20, 20, 20}, 1);
  const DensityTree tree(field);
  const Ray ray{{15.3, 30, 15.6}, {0, -2, 0}};
  const double surface = first_hit(tree, ray)->t;
  EXPECT_NEAR(surface, 5.0, 1e-3);
  EXPECT_TRUE(first_hit(tree, ray, surface + 1e-9));
  EXPECT_FALSE(first_hit(tree, ray, surface - 1e-9));
  EXPECT_FALSE(first_hit(tree, ray, 0.0));
  EXPECT_FALSE(first_hit(tree, ray, -1.0));
  EXPECT_FALSE(first_hit(tree, ray, std::nan("")));
  EXPECT_TRUE(any_hit(tree, ray, surface + 1e-9));
  EXPECT_FALSE(any_hit(tree, ray, surface - 1e-9));
  for (const double odd : {kInfinity, std::nan("")}) {
    EXPECT_FALSE(first_hit(tree, {{15, odd, 15}, {0, -1, 0}}));
    EXPECT_FALSE(first_hit(tree, {{15, 30, 15}, {0, odd, 0}}));
    EXPECT_FALSE(any_hit(tree, {{15, 30, odd}, {0, -1, 0}}));
  }
  EXPECT_FALSE(first_hit(tree, {{15, 30, 15}, {0, 0, 0}}));
  // Slower than the walk's threshold along every axis, next to the solid.
  EXPECT_FALSE(first_hit(tree, {{15, 21.5, 15}, {0, -1e-40, 0}}));
  EXPECT_FALSE(any_hit(tree, {{15, 20.5, 15}, {0, 1e-40, 0}}));
  // Empty space.
  const DensityGrid nothing;
  const DensityTree empty(nothing);
  EXPECT_FALSE(first_hit(empty, ray));
  EXPECT_FALSE(any_hit(empty, ray));
}

TEST(DensityRay, TouchingZeroIsNoHit) {
  // A plane of samples that are exactly 0, with air on both sides.
  DensityGrid field;
  field.edit({IVec3{0}, IVec3{16}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(std::abs(p.y - 8)), 1};
  });
  // A distant solid sample, so that the tree is not empty.
  field.set({40, 40, 40}, {-1.0F, 2});
  const DensityTree tree(field);
  EXPECT_FALSE(first_hit(tree, {{5.5, 20, 5.5}, {0, -1, 0}}));
  // With a solid below, the ray enters where the density is 0.
  field.edit({IVec3{0}, IVec3{16, 8, 16}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y - 8), 1};
  });
  const DensityTree now(field);
  const auto hit = first_hit(now, {{5.5, 20, 5.5}, {0, -1, 0}});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->t, 12.0, 1e-9);
  EXPECT_EQ(hit->normal, (DVec3{0, 1, 0}));
  // The way out from the surface is air.
  EXPECT_FALSE(any_hit(now, {{5.5, 8, 5.5}, {0.3, 1, 0}}));
  EXPECT_TRUE(any_hit(now, {{5.5, 8, 5.5}, {0.3, -1, 0}}));
}

TEST(DensityTree, FollowsEdits) {
  DensityGrid field;
  field.add_sphere(DVec3(64.0), 30.0, 1);
  DensityTree tree(field);
  ChangeCursor cursor = field.cursor();
  std::mt19937 random(4);
  const auto same = [&] {
    const DensityTree anew(field);
    EXPECT_EQ(tree.cells().bounds(), anew.cells().bounds());
    for (int i = 0; i < 2'000; ++i) {
      const IVec3 cell{DVec3(64.0) + random_in(random, -75.0, 75.0)};
      EXPECT_EQ(tree.cells().is_occupied(cell), anew.cells().is_occupied(cell));
      bool has_solid = false;
      for (int c = 0; c < 8; ++c) has_solid |= field.density(cell + IVec3{c & 1, c >> 1 & 1, c >> 2}) < 0.0F;
      ASSERT_EQ(tree.cells().is_occupied(cell), has_solid);
    }
  };
  same();
  for (int i = 0; i < 30; ++i) {
    const DVec3 place = DVec3(64.0) + random_in(random, -60.0, 60.0);
    if (i % 3 == 0) {
      field.add_sphere(place, 6.0, 2);
    } else if (i % 3 == 1) {
      field.remove_sphere(glm::mix(place, DVec3(64.0), 0.6), 8.0);
    } else {
      // At the lower faces of a chunk, where cells of the chunks below end.
      field.set({64, 64, 64 + i}, {field.density({64, 64, 64 + i}) < 0.0F ? 2.0F : -2.0F, 3});
    }
    tree.update(field.changes_since(cursor));
    same();
  }
  field.clear();
  tree.update(field.changes_since(cursor));
  EXPECT_TRUE(tree.cells().bounds().empty());
  EXPECT_FALSE(first_hit(tree, {{64, 200, 64}, {0, -1, 0}}));
}

INSTANTIATE_TEST_SUITE_P(Sets, DensityRays,
                         testing::Values(InstructionSet::Plain, InstructionSet::Avx2, InstructionSet::Avx512),
                         name_of_set);

}  // namespace
}  // namespace quoin
