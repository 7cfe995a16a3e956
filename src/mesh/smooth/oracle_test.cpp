// Every kernel returns the same bytes as the slow reference mesher.

#include <array>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/mesh/smooth.h>

#include "core/instruction_sets_for_tests.h"
#include "core/trilinear.h"
#include "core/work/nightly_for_tests.h"
#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_oracle.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

template <class T>
void expect_same_bytes(const Buffer<T>& a, const Buffer<T>& b, const char* name) {
  ASSERT_EQ(a.size(), b.size()) << name;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(std::memcmp(&a[i], &b[i], sizeof(T)), 0) << name << " " << i << " of " << a.size();
  }
}

void expect_same_mesh(const SmoothChunkMesh& a, const SmoothChunkMesh& b) {
  expect_same_bytes(a.positions, b.positions, "positions");
  expect_same_bytes(a.normals, b.normals, "normals");
  expect_same_bytes(a.occlusion, b.occlusion, "occlusion");
  expect_same_bytes(a.cells, b.cells, "cells");
  expect_same_bytes(a.indices, b.indices, "indices");
}

class SmoothKernels : public testing::TestWithParam<unsigned> {
 protected:
  // Returns a field that fills the chunk and reaches into all of its neighbours.
  DensityGrid grid() const {
    const IBox box{IVec3{-12}, IVec3{64 + 13}};
    switch (GetParam() % 3) {
      case 0:
        return oracle::grid_of(box, oracle::scatter(GetParam(), 0.5));
      case 1:
        return oracle::grid_of(box, oracle::waves(GetParam(), 9.0));
      default:
        return oracle::grid_of(box, oracle::waves(GetParam(), 50.0));
    }
  }

  // Compares the mesh of every kernel with the oracle's mesh.
  void check(const DensityNeighbourhood& chunks, const SmoothOptions& options) {
    oracle::smooth_mesh(chunks, options, expected_);
    ASSERT_GT(expected_.indices.size(), 0U);
    for (SmoothMesher& mesher : meshers_) {
      mesher.mesh(chunks, options, mesh_);
      expect_same_mesh(mesh_, expected_);
    }
  }

 private:
  static std::vector<SmoothMesher> meshers_of_all_sets() {
    std::vector<SmoothMesher> meshers;
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride over(set);
      meshers.emplace_back();
    }
    return meshers;
  }

  std::vector<SmoothMesher> meshers_ = meshers_of_all_sets();
  SmoothChunkMesh expected_;
  SmoothChunkMesh mesh_;
};

TEST_P(SmoothKernels, MatchOracle) {
  const DensityGrid field = grid();
  const DensityNeighbourhood chunks = field.neighbourhood(IVec3{0});
  for (int level = 0; level <= kMaxSmoothLevel; ++level) {
    for (const SmoothBorder border : {SmoothBorder::Shared, SmoothBorder::Open}) {
      // By day each field has one border per level; the next field has the other.
      const bool is_odd = (GetParam() + static_cast<unsigned>(level)) % 2 != 0;
      if (!is_nightly() && is_odd != (border == SmoothBorder::Open)) continue;
      SmoothOptions options;
      options.border = border;
      options.split_sheets = false;
      options.levels.fill(static_cast<std::uint8_t>(level));
      options.occlusion.method = static_cast<SmoothOcclusion>((GetParam() + static_cast<unsigned>(level)) % 4);
      options.occlusion.spread = level % 2 == 0 ? 2.0F : 0.4F;
      SCOPED_TRACE(testing::Message() << "seed " << GetParam() << ", level " << level);
      ASSERT_NO_FATAL_FAILURE(check(chunks, options));
    }
  }
}

// Few active cells take occlusion from lists, many take it otherwise; spreads of 1 and 2 have separate code.
TEST_P(SmoothKernels, MatchOracleOcclusion) {
  const DensityGrid field = grid();
  const DensityNeighbourhood chunks = field.neighbourhood(IVec3{0});
  constexpr std::array<std::pair<int, float>, 8> kCases = {
      {{0, 1.0F}, {0, 1.7F}, {0, 2.0F}, {1, 0.8F}, {1, 2.0F}, {1, 4.0F}, {2, 4.0F}, {3, 2.0F}}};
  for (unsigned i = 0; i < kCases.size(); ++i) {
    // By day each field takes half of them; together they take all, and all forms.
    if (!is_nightly() && (i / 2 + GetParam()) % 2 != 0) continue;
    const auto& [level, spread] = kCases[i];
    SmoothOptions options;
    options.split_sheets = false;
    options.levels.fill(static_cast<std::uint8_t>(level));
    options.occlusion = {static_cast<SmoothOcclusion>(1 + (GetParam() + i) % 4), spread, 0.3F,
                         level == 2 ? 1.5F : 2.0F};
    SCOPED_TRACE(testing::Message() << "level " << level << ", spread " << spread << ", form "
                                    << static_cast<int>(options.occlusion.method));
    ASSERT_NO_FATAL_FAILURE(check(chunks, options));
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, SmoothKernels, testing::Range(1U, static_cast<unsigned>(cases(3, 4))));

// The oracle shares the arithmetic of a cell with the kernels, so it is compared with doubles here.
TEST(SmoothCell, HasVertexAtMeanOfCrossings) {
  std::mt19937 random(1);
  int compared = 0;
  for (int round = 0; round < 2000; ++round) {
    smooth::Corners corners{};
    CellCorners exact{};
    for (std::size_t i = 0; i < 8; ++i) exact[i] = corners[i] = static_cast<float>(random()) * 0x1p-29F - 4.0F;
    DVec3 sum(0.0);
    double count = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < 8; ++i) {
        const std::size_t end = i | std::size_t{1} << axis;
        if (end == i || (exact[i] < 0.0) == (exact[end] < 0.0)) continue;
        DVec3 at(smooth::corner_place(static_cast<int>(i)));
        at[axis] = exact[i] / (exact[i] - exact[end]);
        sum += at;
        count += 1.0;
      }
    }
    const DVec3 gradient = trilinear_gradient(exact, sum / count);
    if (count == 0.0 || glm::length(gradient) < 0.1) continue;
    const smooth::CellVertex vertex = smooth::cell_vertex(corners);
    ASSERT_LT(glm::distance(DVec3(vertex.fraction), sum / count), 1e-5) << round;
    ASSERT_LT(glm::distance(DVec3(vertex.snapped), sum / count), 3e-5) << round;
    ASSERT_LT(glm::distance(DVec3(vertex.normal), glm::normalize(gradient)), 1e-4) << round;
    ++compared;
  }
  EXPECT_GT(compared, 1500);
}

}  // namespace
}  // namespace quoin
