// Compares path tracing kernels with their scalar versions: every bit, with every instruction set.

#include "render/path/kernel/shade.h"

#include <array>
#include <cstdint>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/hash.h>

#include "core/instruction_sets_for_tests.h"
#include "render/path/light_tree.h"
#include "render/path/path_math.h"
#include "render/path/path_tile.h"
#include "render/path/scatter.h"
#include "render/path/sky_light.h"

namespace quoin::path {
namespace {

class Numbers {
 public:
  std::uint32_t word() { return mix_bits(seed_ += 0x9E37'79B9U); }
  float unit() { return unit_of(word()); }
  float between(float low, float high) { return low + (high - low) * unit(); }
  Vec3 direction() {
    const Vec3 v{between(-1.0F, 1.0F), between(-1.0F, 1.0F), between(-1.0F, 1.0F)};
    return glm::dot(v, v) > 0.01F ? glm::normalize(v) : Vec3(0.0F, 1.0F, 0.0F);
  }

 private:
  std::uint32_t seed_ = 1;
};

void put(Vec3 v, BlockLanes<float> (&to)[3], std::size_t lane) {
  for (int i = 0; i < 3; ++i) to[i][lane] = v[i];
}
Vec3 get(const BlockLanes<float> (&from)[3], std::size_t lane) {
  return {from[0][lane], from[1][lane], from[2][lane]};
}

std::vector<LampBounds> some_lamps(Numbers& numbers, std::size_t count) {
  std::vector<LampBounds> lamps(count);
  for (std::size_t i = 0; i < count; ++i) {
    LampBounds& lamp = lamps[i];
    lamp.low = Vec3(numbers.between(-40.0F, 40.0F), numbers.between(-5.0F, 5.0F), numbers.between(-40.0F, 40.0F));
    lamp.high = lamp.low + Vec3(numbers.between(0.0F, 3.0F), 0.0F, numbers.between(0.0F, 3.0F));
    lamp.axis = i % 3 == 0 ? numbers.direction() : Vec3(0.0F, 1.0F, 0.0F);
    if (i % 5 == 0) lamp.cos_spread = lamp.cos_edge = -1.0F;  // shines in all directions
    lamp.power = numbers.between(0.1F, 10.0F);
  }
  return lamps;
}

// Axes, their borders and directions in between: cases where component comparisons tie.
std::vector<Vec3> awkward_directions() {
  std::vector<Vec3> all;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x != 0 || y != 0 || z != 0)
          all.push_back(glm::normalize(Vec3(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z))));
      }
    }
  }
  return all;
}

TEST(PathKernel, MatchesSinglePointFunctions) {
  Numbers numbers;
  const std::vector<Vec3> awkward = awkward_directions();
  Environment environment;
  environment.sky.model = SkyModel::Uniform;
  for (const double angle : {0.0, 0.0093, 0.5}) {
    environment.sun.angle_radians = angle;
    const SkyLight sky(environment);
    const SkySample middle = sky.sun_sample(sky.to_sun());
    const Frame sun_frame(sky.to_sun());
    ShadeLight light;
    light.has_sun = true;
    light.one_less_cos = sky.one_less_cos();
    light.sun_density = middle.density;
    for (int i = 0; i < 3; ++i) {
      light.to_sun[i] = sky.to_sun()[i], light.sun_radiance[i] = middle.radiance[i];
      light.sun_frame[0][i] = sun_frame.x[i], light.sun_frame[1][i] = sun_frame.y[i];
      light.sun_frame[2][i] = sun_frame.z[i];
    }
    for (std::size_t round = 0; round < 40; ++round) {
      ShadeBlock asked;
      for (std::size_t i = 0; i < kBlockPoints; ++i) {
        asked.pixel[i] = numbers.word(), asked.sample[i] = numbers.word() % 4096U, asked.dimension[i] = 8U * (i % 9U);
        put(numbers.direction(), asked.direction, i);
        put(round % 2 == 0 ? awkward[(round * 7 + i) % awkward.size()] : numbers.direction(), asked.normal, i);
        put({numbers.unit(), numbers.unit(), numbers.unit()}, asked.colour, i);
        put({numbers.unit(), numbers.unit(), numbers.unit()}, asked.throughput, i);
      }
      for (const InstructionSet set : sets_of_this_machine()) {
        const InstructionSetOverride over(set);
        ShadeBlock block = asked;
        kernel().shade(light, block);
        for (std::size_t i = 0; i < kBlockPoints; ++i) {
          SCOPED_TRACE(name_of(set));
          const Random random(asked.pixel[i], asked.sample[i]);
          const Vec3 direction = get(asked.direction, i);
          Vec3 normal = get(asked.normal, i);
          const float facing = -glm::dot(normal, direction);
          if (facing < 1e-3F) normal = glm::normalize(normal - direction * (1e-3F - facing));
          ASSERT_EQ(get(block.normal, i), normal);
          const Frame frame(normal);
          const Scatter scatter({get(asked.colour, i), 1.0F, 0.0F}, {0.0F, 0.0F, 1.0F});
          const SkySample sun = sky.sample_sun(random.pair(asked.dimension[i] + dimension::kSun));
          ASSERT_EQ(get(block.sun, i), sun.direction);
          const Vec3 in{0.0F, 0.0F, frame.to_local(sun.direction).z};
          Vec3 lit = get(asked.throughput, i) * scatter.value(in);
          lit *= sky.one_less_cos() > 0.0F ? sun.radiance / sun.density * balance(sun.density, scatter.density(in))
                                           : sun.radiance;
          ASSERT_EQ(get(block.sun_light, i), in.z > 0.0F ? lit : Vec3(0.0F));
          const Pair u = random.pair(asked.dimension[i] + dimension::kDirection);
          ASSERT_EQ(block.pair[0][i], u.x);
          ASSERT_EQ(block.pair[1][i], u.y);
          const Scattered next = scatter.sample(u, 0.5F);
          ASSERT_EQ(block.next_density[i], next.density);
          const Vec3 to = glm::normalize(frame.to_world(next.direction));
          ASSERT_EQ(get(block.next, i), to);
          ASSERT_EQ(static_cast<std::uint32_t>(block.next_bin[i]), bin_of(to));
        }
      }
    }
  }
}

TEST(PathKernel, ChoosesLampsByProbability) {
  Numbers numbers;
  for (const std::size_t count : {1U, 2U, 3U, 200U}) {
    const LightTree tree(some_lamps(numbers, count));
    std::vector<float> shares(2 * LightTree::kTopNodes, 1.0F);
    for (std::size_t i = 1; i < LightTree::kTopNodes; ++i)
      shares[LightTree::kTopNodes + i] = numbers.between(0.05F, 1.0F);
    std::size_t chosen = 0;
    for (int round = 0; round < 60; ++round) {
      LampBlock asked;
      for (std::size_t i = 0; i < kBlockPoints; ++i) {
        put({numbers.between(-40.0F, 40.0F), numbers.between(-8.0F, 8.0F), numbers.between(-40.0F, 40.0F)}, asked.point,
            i);
        put(i % 4 == 3 ? Vec3(0.0F) : numbers.direction(), asked.normal, i);
        asked.u[i] = numbers.unit();
        asked.table[i] = i % 2 == 0 ? 0 : static_cast<std::int32_t>(LightTree::kTopNodes);
      }
      asked.active = round == 0 ? 0x5A5AU : 0xFFFFU;
      std::array<std::int32_t, kBlockPoints> first{};
      for (const InstructionSet set : sets_of_this_machine()) {
        SCOPED_TRACE(name_of(set));
        const InstructionSetOverride over(set);
        LampBlock block = asked;
        kernel().choose_lamps(tree.branches(), shares.data(), block);
        for (std::size_t i = 0; i < kBlockPoints; ++i) {
          if (set == InstructionSet::Plain) first[i] = block.lamp[i];
          ASSERT_EQ(block.lamp[i], first[i]);
          ASSERT_TRUE((asked.active >> i & 1U) != 0 || block.lamp[i] == -1);
          if (block.lamp[i] < 0) continue;
          ++chosen;
          const float expected = tree.probability(static_cast<std::uint32_t>(block.lamp[i]), get(asked.point, i),
                                                  get(asked.normal, i), shares.data() + asked.table[i]);
          ASSERT_EQ(block.probability[i], expected);
        }
      }
    }
    EXPECT_GT(chosen, 100U);
  }
}

// Matches a single point with choose and pairs of numbers; each pixel uses its own numbers for lamps.
TEST(PathKernel, ShadesByLampsWithPerPixelNumbers) {
  Numbers numbers;
  const LightTree tree(some_lamps(numbers, 200));
  std::size_t chosen = 0;
  for (const std::uint32_t turned : {0U, 0x1234'5678U}) {
    ShadeLight light;
    light.lamps = tree.branches();
    light.shares = LightTree::whole_shares();
    light.lamp_numbers = turned;
    ShadeBlock asked;
    asked.in_air = 0x8421U;
    asked.lamps.active = 0x7FFFU;
    for (std::size_t i = 0; i < kBlockPoints; ++i) {
      asked.pixel[i] = numbers.word(), asked.sample[i] = numbers.word() % 4096U, asked.dimension[i] = 8U * (i % 9U);
      put({numbers.between(-40.0F, 40.0F), numbers.between(-8.0F, 8.0F), numbers.between(-40.0F, 40.0F)},
          asked.lamps.point, i);
      const Vec3 normal = numbers.direction();
      put(normal, asked.normal, i);
      put(-normal, asked.direction, i);
    }
    for (const InstructionSet set : sets_of_this_machine()) {
      SCOPED_TRACE(name_of(set));
      const InstructionSetOverride over(set);
      ShadeBlock block = asked;
      kernel().shade(light, block);
      for (std::size_t i = 0; i < kBlockPoints; ++i) {
        const Random own(asked.pixel[i], asked.sample[i]);
        const Random of_lamps(asked.pixel[i] ^ turned, asked.sample[i]);
        const Pair point = of_lamps.pair(asked.dimension[i] + dimension::kLampPoint);
        ASSERT_EQ(block.lamp_pair[0][i], point.x);
        ASSERT_EQ(block.lamp_pair[1][i], point.y);
        ASSERT_EQ(block.pair[0][i], own.pair(asked.dimension[i] + dimension::kDirection).x);
        const bool is_active = (asked.lamps.active >> i & 1U) != 0;
        const Vec3 normal = (asked.in_air >> i & 1U) != 0 ? Vec3(0.0F) : get(asked.normal, i);
        const LightTree::Choice expected =
            tree.choose(get(asked.lamps.point, i), normal, of_lamps.one(asked.dimension[i] + dimension::kLampChoice));
        ASSERT_EQ(block.lamps.lamp[i], is_active ? expected.lamp : -1);
        ASSERT_EQ(block.lamps.probability[i], is_active ? expected.probability : 0.0F);
        chosen += is_active && expected.lamp >= 0 ? 1U : 0U;
      }
    }
  }
  EXPECT_GT(chosen, 30U);
}

TEST(PathKernel, MatchesRandomNumbersOfPixels) {
  Numbers numbers;
  for (std::uint32_t sample = 0; sample < 300; ++sample) {
    BlockLanes<std::uint32_t> pixel;
    for (std::uint32_t& each : pixel) each = numbers.word();
    for (const InstructionSet set : sets_of_this_machine()) {
      SCOPED_TRACE(name_of(set));
      const InstructionSetOverride over(set);
      BlockLanes<float> x;
      BlockLanes<float> y;
      kernel().pairs(pixel, sample, 3, x, y);
      for (std::size_t i = 0; i < kBlockPoints; ++i) {
        const Pair u = Random(pixel[i], sample).pair(3);
        ASSERT_EQ(x[i], u.x);
        ASSERT_EQ(y[i], u.y);
      }
    }
  }
}

}  // namespace
}  // namespace quoin::path
