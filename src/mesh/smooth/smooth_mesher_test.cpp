#include <quoin/mesh/smooth.h>

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "core/instruction_sets_for_tests.h"
#include "core/made_with_for_tests.h"
#include "mesh/smooth/smooth_test_support.h"

namespace quoin {
namespace {

template <class T>
bool same_bytes(const Buffer<T>& a, const Buffer<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same(const SmoothChunkMesh& a, const SmoothChunkMesh& b) {
  EXPECT_TRUE(same_bytes(a.positions, b.positions));
  EXPECT_TRUE(same_bytes(a.normals, b.normals));
  EXPECT_TRUE(same_bytes(a.occlusion, b.occlusion));
  EXPECT_TRUE(same_bytes(a.cells, b.cells));
  EXPECT_TRUE(same_bytes(a.indices, b.indices));
}

TEST(SmoothMesherKernels, MatchPlainKernel) {
  const World worlds[] = {World(sphere({20.3, 40.1, 31.7}, 30.2)), World(noise(7, 3.0)), World([](IVec3 p) {
                            return std::sin(0.3 * p.x) + std::sin(0.21 * p.y) + std::cos(0.17 * p.z);
                          })};
  SmoothMesher plain = made_with<SmoothMesher>(InstructionSet::Plain);
  std::vector<SmoothMesher> others;
  for (const InstructionSet set : {InstructionSet::Avx2, InstructionSet::Avx512Bytes}) {
    if (has_instruction_set(set)) others.push_back(made_with<SmoothMesher>(set));
  }
  if (others.empty()) GTEST_SKIP() << "this machine has only the plain kernel";
  for (const World& world : worlds) {
    for (const SmoothOcclusion form : {SmoothOcclusion::None, SmoothOcclusion::SolidShare, SmoothOcclusion::Weighted,
                                       SmoothOcclusion::WeightedPublished, SmoothOcclusion::SoftShare}) {
      for (const float spread : {0.4F, 1.0F, 2.0F, 2.5F}) {
        for (const int level : {0, 1, 3}) {
          if ((form == SmoothOcclusion::None) != (spread == 0.4F) && level != 1) continue;
          SCOPED_TRACE(testing::Message() << "spread " << spread << " level " << level);
          const SmoothOptions options = with(form, level, spread);
          SmoothChunkMesh expected;
          plain.mesh(world.around(), options, expected);
          EXPECT_GT(expected.indices.size(), 0U);
          for (SmoothMesher& other : others) {
            SmoothChunkMesh mesh;
            other.mesh(world.around(), options, mesh);
            expect_same(mesh, expected);
          }
        }
      }
    }
  }
}

TEST(SmoothMesher, IsIndependentOfPreviousMeshes) {
  const World first(noise(1, 5.0));
  const World second(sphere({31, 31, 31}, 25.5));
  const SmoothOptions options = with(SmoothOcclusion::SolidShare);
  SmoothMesher fresh;
  SmoothChunkMesh expected;
  fresh.mesh(second.around(), options, expected);
  SmoothMesher used;
  SmoothChunkMesh mesh;
  used.mesh(first.around(), options, mesh);
  used.mesh(second.around(), options, mesh);
  expect_same(mesh, expected);
}

TEST(SmoothMesher, SphereNormalsPointOutwards) {
  const DVec3 centre(31.2, 30.7, 31.9);
  const World world(sphere(centre, 28.0));
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  mesher.mesh(world.around(), with(SmoothOcclusion::None), mesh);
  double worst = 0;
  double sum = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const DVec3 out = DVec3(mesh.positions[i]) - centre;
    EXPECT_NEAR(glm::length(out), 28.0, 0.05);
    EXPECT_NEAR(glm::length(DVec3(mesh.normals[i])), 1.0, 1e-6);
    const double angle = glm::degrees(std::acos(std::min(1.0, glm::dot(glm::normalize(out), DVec3(mesh.normals[i])))));
    worst = std::max(worst, angle);
    sum += angle;
  }
  EXPECT_LT(worst, 1.5);
  EXPECT_LT(sum / static_cast<double>(mesh.positions.size()), 0.6);
  RecordProperty("worst_degrees", std::to_string(worst));
  RecordProperty("mean_degrees", std::to_string(sum / static_cast<double>(mesh.positions.size())));
}

TEST(SmoothMesher, KeepsPlaneThroughSamplesFlat) {
  const World world([](IVec3 p) { return p.y - 20.0; });
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  mesher.mesh(world.around(), with(SmoothOcclusion::SolidShare), mesh);
  ASSERT_EQ(mesh.positions.size(), 65U * 65U);
  EXPECT_EQ(mesh.indices.size(), 64U * 64U * 6U);
  for (const Vec3& p : mesh.positions) EXPECT_EQ(p.y, 20.0F);
  for (const Vec3& n : mesh.normals) EXPECT_LT(glm::length(n - Vec3(0, 1, 0)), 1e-6F);
  for (const float occlusion : mesh.occlusion) EXPECT_EQ(occlusion, 0.0F);
}

TEST(SmoothMesher, FindsNoSurfaceInOneSign) {
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  for (const double value : {0.0, 8.0, -8.0, -0.0, 1e30, -1e30, std::nan("")}) {
    const World world([=](IVec3) { return value; });
    mesher.mesh(world.around(), with(SmoothOcclusion::Weighted), mesh);
    EXPECT_EQ(mesh.positions.size(), 0U) << value;
    EXPECT_EQ(mesh.indices.size(), 0U) << value;
  }
}

TEST(SmoothMesher, SurvivesInfinitiesAndNaN) {
  const World world([](IVec3 p) {
    const int kind = (p.x * 7 + p.y * 5 + p.z * 3) & 7;
    if (kind == 0) return std::numeric_limits<double>::infinity();
    if (kind == 1) return -std::numeric_limits<double>::infinity();
    if (kind == 2) return std::nan("");
    return kind == 3 ? 0.0 : kind - 5.5;
  });
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  for (const SmoothOcclusion form : {SmoothOcclusion::SolidShare, SmoothOcclusion::Weighted,
                                     SmoothOcclusion::WeightedPublished, SmoothOcclusion::SoftShare}) {
    mesher.mesh(world.around(), with(form), mesh);
    ASSERT_GT(mesh.positions.size(), 10'000U);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_TRUE(mesh.positions[i][axis] >= -1.0F && mesh.positions[i][axis] <= 64.0F);
      }
      ASSERT_NEAR(glm::length(mesh.normals[i]), 1.0F, 1e-5F);
      ASSERT_TRUE(mesh.occlusion[i] >= 0.0F && mesh.occlusion[i] <= 1.0F);
    }
  }
}

TEST(SmoothMesher, ClampsLevelsToCoarsest) {
  const World world(sphere({31.2, 30.7, 31.9}, 25.0));
  SmoothMesher mesher;
  SmoothChunkMesh coarsest;
  SmoothChunkMesh mesh;
  mesher.mesh(world.around(), with(SmoothOcclusion::SolidShare, kMaxSmoothLevel), coarsest);
  EXPECT_GT(coarsest.indices.size(), 0U);
  for (const int level : {4, 6, 7, 64, 255}) {
    mesher.mesh(world.around(), with(SmoothOcclusion::SolidShare, level), mesh);
    expect_same(mesh, coarsest);
  }
  EXPECT_EQ(reach_of({}, 40), reach_of({}, kMaxSmoothLevel));
  EXPECT_EQ(reach_of({}, -1), reach_of({}, 0));
}

TEST(SmoothMesher, SplitsQuadsAlongTheShorterDiagonal) {
  const World world(noise(3, 4.0));
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  mesher.mesh(world.around(), with(SmoothOcclusion::None), mesh);
  for (std::size_t i = 0; i < mesh.indices.size(); i += 6) {
    const auto at = [&](std::size_t c) { return mesh.positions[mesh.indices[i + c]]; };
    ASSERT_EQ(mesh.indices[i], mesh.indices[i + 3]);
    ASSERT_EQ(mesh.indices[i + 2], mesh.indices[i + 4]);
    EXPECT_LE(glm::length(at(0) - at(2)), glm::length(at(1) - at(5)) + 0.06F);
  }
}

}  // namespace
}  // namespace quoin
