#include <quoin/mesh/smooth_occlusion.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/terrain/terrain.h>

#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"
#include "mesh/smooth/smooth_test_support.h"

namespace quoin {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Returns hills with caves in the eight chunks around the origin.
DensityGrid hilly_field() {
  DensityGrid grid(kBand);
  const auto field = [](IVec3 p) {
    return 0.8 * p.y + 9.0 * std::sin(0.11 * p.x) * std::cos(0.13 * p.z) + 3.0 * std::sin(0.5 * p.x + 0.4 * p.y) -
           2.0 * std::cos(0.61 * p.z - 0.3 * p.y);
  };
  for (int i = 0; i < 8; ++i) {
    const IVec3 chunk(-(i & 1), -(i >> 1 & 1), -(i >> 2));
    grid.put_chunk(chunk, chunk_of_field(field, chunk));
  }
  return grid;
}

std::vector<float> occlusion_of(const DensityGrid& field, const SmoothSamples& samples,
                                const SmoothOcclusionOptions& options, Threads threads = {}) {
  std::vector<float> out(samples.positions.size(), -1.0F);
  EXPECT_TRUE(smooth_occlusion(field, samples, options, out, threads).has_value());
  return out;
}

TEST(SmoothOcclusionAtPoints, MatchesMesherExactly) {
  const DensityGrid field = hilly_field();
  for (const SmoothOcclusion form : kForms) {
    for (const float spread : {0.0625F, 0.4F, 1.0F, 1.7F, 2.0F, 4.0F}) {
      SCOPED_TRACE(testing::Message() << "form " << static_cast<int>(form) << ", spread " << spread);
      SmoothMeshOptions options;
      options.occlusion = {form, spread, 0.3F, spread == 1.0F ? 1.5F : 2.0F};
      const auto mesh = build_smooth_mesh(field, {}, options);
      ASSERT_TRUE(mesh);
      ASSERT_GT(mesh->positions.size(), 20'000U);
      EXPECT_GT(*std::ranges::max_element(mesh->occlusion), 0.2F);
      const std::vector<float> found = occlusion_of(field, {mesh->positions, mesh->normals}, options.occlusion);
      ASSERT_EQ(found, mesh->occlusion);
      for (std::size_t i = 0; i < found.size(); i += 37) {
        ASSERT_EQ(smooth_occlusion(field, DVec3(mesh->positions[i]), mesh->normals[i], options.occlusion), found[i]);
      }
    }
  }
}

TEST(SmoothOcclusionAtPoints, MatchesChunkMeshOnEveryKernelAndLevel) {
  const DensityGrid field = hilly_field();
  const IVec3 chunk(-1, -1, -1);
  for (int level = 0; level <= kMaxSmoothLevel; ++level) {
    for (const SmoothOcclusion form : kForms) {
      for (const float spread : {0.7F, 1.0F, 2.0F, 4.0F}) {
        const SmoothOptions options = with(form, level, spread);
        SmoothMesher mesher;
        SmoothChunkMesh mesh;
        mesher.mesh(field.neighbourhood(chunk), options, mesh);
        ASSERT_GT(mesh.positions.size(), 60U);
        SmoothSamples samples{{mesh.positions.data(), mesh.positions.size()},
                              {mesh.normals.data(), mesh.normals.size()}};
        samples.level = level;
        const std::vector<float> expected(mesh.occlusion.begin(), mesh.occlusion.end());
        std::vector<float> found(expected.size());
        for (const InstructionSet set : sets_of_this_machine()) {
          const InstructionSetOverride over(set);
          SmoothOccluder().occlude(field.neighbourhood(chunk), samples, options.occlusion, found);
          ASSERT_EQ(found, expected) << "level " << level << ", spread " << spread;
        }
        samples.origin = chunk * kChunkEdge;
        ASSERT_EQ(occlusion_of(field, samples, options.occlusion), expected);
      }
    }
  }
}

TEST(SmoothOcclusionAtPoints, IsTheSameFarFromOrigin) {
  const IVec3 far_chunk(30'000'000, -33'000'000, 20'000'000);
  DensityGrid near(kBand);
  DensityGrid far(kBand);
  const DensityChunk ball = chunk_of_field([](IVec3 p) { return 20.0 - glm::length(DVec3(p) - 31.3); });
  near.put_chunk(IVec3(0), ball);
  far.put_chunk(far_chunk, ball);
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  mesher.mesh(near.neighbourhood(IVec3(0)), with(SmoothOcclusion::Weighted), mesh);
  const SmoothSamples samples{
      {mesh.positions.data(), mesh.positions.size()}, {mesh.normals.data(), mesh.normals.size()}, far_chunk * 64, 0};
  const std::vector<float> expected(mesh.occlusion.begin(), mesh.occlusion.end());
  EXPECT_EQ(occlusion_of(far, samples, with(SmoothOcclusion::Weighted).occlusion), expected);
}

TEST(SmoothOcclusionAtPoints, IsIndependentOfOrderAndBatch) {
  const DensityGrid field = hilly_field();
  std::mt19937 random(5);
  std::uniform_real_distribution<float> at(-90.0F, 80.0F);
  std::normal_distribution<float> normal;
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  // Enough in one slice for several kernel calls.
  for (int i = 0; i < 30'000; ++i) {
    const float z = i % 2 == 0 ? at(random) : -3.0F + 0.5F * std::sin(static_cast<float>(i));
    positions.emplace_back(at(random), at(random), z);
    normals.push_back(glm::normalize(Vec3(normal(random), normal(random), normal(random))));
  }
  for (const SmoothOcclusion form : kForms) {
    const SmoothOcclusionOptions options{form, 2.0F, 0.4F, 2.0F};
    const std::vector<float> all = occlusion_of(field, {positions, normals}, options, Threads{1});
    ASSERT_EQ(occlusion_of(field, {positions, normals}, options, Threads{4}), all);
    for (std::size_t i = 0; i < positions.size(); i += 101) {
      ASSERT_EQ(smooth_occlusion(field, DVec3(positions[i]), normals[i], options), all[i]);
      ASSERT_GE(all[i], 0.0F);
      ASSERT_LE(all[i], 1.0F);
    }
    const std::vector<float> some =
        occlusion_of(field, {std::span(positions).subspan(500, 40), std::span(normals).subspan(500, 40)}, options);
    EXPECT_TRUE(std::ranges::equal(some, std::span(all).subspan(500, 40)));
  }
}

TEST(SmoothOcclusionAtPoints, FarAirIsOpen) {
  const DensityGrid field = hilly_field();
  const std::vector<Vec3> positions = {{kNaN, 0, 0}, {0, kInfinity, 0}, {0, 0, -kInfinity},
                                       {3e9F, 0, 0}, {0, -4e37F, 0},    {1e6F, 5, 5},
                                       {0, 500, 0},  {2.1e9F, 0, 0},    {-2.147e9F, 0, 0}};
  const std::vector<Vec3> normals(positions.size(), Vec3(0, 1, 0));
  for (const SmoothOcclusion form : kForms) {
    const SmoothOcclusionOptions options{form, 2.0F, 0.4F, 2.0F};
    const float open = form == SmoothOcclusion::WeightedPublished ? 0.4F * 0.4F : 0.0F;
    for (const float found : occlusion_of(field, {positions, normals}, options)) EXPECT_EQ(found, open);
    for (const Vec3& position : positions) {
      EXPECT_EQ(smooth_occlusion(field, DVec3(position), {0, 1, 0}, options), open);
    }
    EXPECT_EQ(smooth_occlusion(DensityGrid(), {1, 2, 3}, {0, 1, 0}, options), open);
    std::vector<float> of_chunk(positions.size(), -1.0F);
    SmoothOccluder().occlude(field.neighbourhood({0, 9, 0}), {positions, normals}, options, of_chunk);
    for (const float found : of_chunk) EXPECT_EQ(found, open);
  }
  EXPECT_EQ(smooth_occlusion(field, {0, -30, 0}, {0, 1, 0}, {SmoothOcclusion::None, 2.0F, 0.4F, 2.0F}), 0.0F);
  EXPECT_EQ(smooth_occlusion(field, {-20, -50, -20}, {0, 1, 0}), 1.0F) << "deep in the rock";
}

TEST(SmoothOcclusionAtPoints, NormalizesNormalsAndDefaultsToUp) {
  const DensityGrid field = hilly_field();
  const DVec3 position(-7.3, -4.2, -11.9);
  const SmoothOcclusionOptions options{SmoothOcclusion::Weighted, 2.0F, 0.4F, 2.0F};
  const float up = smooth_occlusion(field, position, {0, 1, 0}, options);
  for (const Vec3 normal : {Vec3(0), Vec3(kNaN, 0, 1), Vec3(kInfinity, 0, 0), Vec3(0, 7, 0), Vec3(0, 1e-30F, 0),
                            Vec3(0, 3e38F, 0), Vec3(0, 0.99F, 0)}) {
    EXPECT_EQ(smooth_occlusion(field, position, normal, options), up) << normal.x << " " << normal.y;
  }
  EXPECT_NE(smooth_occlusion(field, position, {0, -1, 0}, options), up);
}

TEST(SmoothOcclusionAtPoints, ClampsOptionsLikeMesher) {
  const DensityGrid field = hilly_field();
  const DVec3 position(-7.3, -4.2, -11.9);
  const auto at = [&](SmoothOcclusionOptions options, int level = 0) {
    return smooth_occlusion(field, position, {0.6F, 0.8F, 0}, options, level);
  };
  EXPECT_EQ(at({SmoothOcclusion::Weighted, 99.0F, 0.4F, 2.0F}), at({SmoothOcclusion::Weighted, 4.0F, 0.4F, 2.0F}));
  EXPECT_EQ(at({SmoothOcclusion::Weighted, kNaN, kNaN, kNaN}), at({SmoothOcclusion::Weighted, 2.0F, 0.4F, 2.0F}));
  EXPECT_EQ(at({}, 99), at({}, kMaxSmoothLevel));
  EXPECT_EQ(at({}, -1), at({}, 0));
}

TEST(SmoothOcclusionAtPoints, IsEmptyWithoutPositions) {
  EXPECT_TRUE(occlusion_of(hilly_field(), {}, {}).empty());
}

TEST(SmoothOcclusionAtPoints, StopsWhenCancelled) {
  const DensityGrid field = hilly_field();
  const std::vector<Vec3> positions = {{-7, -4, -11}, {70, -4, -11}, {-7, -4, 80}};
  const std::vector<Vec3> normals(positions.size(), Vec3(0, 1, 0));
  std::vector<float> out(positions.size());
  const SmoothSamples samples{positions, normals};
  double last = 0.0;
  const auto listen = [&](double fraction) { return (last = fraction) < 2.0; };
  EXPECT_TRUE(smooth_occlusion(field, samples, {}, out, Threads{1}, listen).has_value());
  EXPECT_EQ(last, 1.0);
  const Status cancelled = smooth_occlusion(field, samples, {}, out, Threads{1}, [](double) { return false; });
  ASSERT_FALSE(cancelled.has_value());
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
}

TEST(SmoothOcclusionDeathTest, AssertsOnMismatchedSamples) {
  const DensityGrid field;
  const std::vector<Vec3> three(3, Vec3(0, 1, 0));
  const std::span<const Vec3> two = std::span(three).first(2);
  std::vector<float> out(2);
  QUOIN_EXPECT_MISTAKE((void)smooth_occlusion(field, {three, two}, {}, out), "as many normals as positions");
  QUOIN_EXPECT_MISTAKE((void)smooth_occlusion(field, {three, three}, {}, out), "a value for every sample");
  // An impossible number of samples, which must not be read.
  const std::span<const Vec3> many(three.data(), std::size_t{1} << 32);
  const std::span<float> room(out.data(), many.size());
  QUOIN_EXPECT_MISTAKE((void)smooth_occlusion(field, {many, many}, {}, room), "fewer than 2.32 samples");
  SmoothOccluder occluder;
  QUOIN_EXPECT_MISTAKE(occluder.occlude({}, {three, three}, {}, out), "a value for every sample");
}

}  // namespace
}  // namespace quoin
