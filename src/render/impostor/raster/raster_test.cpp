// Compares the kernels that draw faces with a double-precision test of every face for every pixel.

#include "render/impostor/raster/raster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/memory.h>

#include "bench/workloads.h"
#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"
#include "render/impostor/seen_faces.h"
#include "render/impostor/surface_cells.h"

namespace quoin {
namespace {

struct Shape {
  BlockVector<SeenFace> faces;
  ContentSphere content;
  ImpostorFaces::Level level;

  explicit Shape(unsigned seed) {
    std::mt19937 random(seed);
    Grid grid;
    for (int i = 0; i < 12; ++i) {
      const auto coordinate = [&](unsigned most) { return static_cast<int>(random() % most); };
      const IVec3 at{coordinate(20), coordinate(20), coordinate(20)};
      grid.fill_box({at, at + IVec3{coordinate(7) + 1, coordinate(7) + 1, coordinate(7) + 1}}, 1);
    }
    content = content_sphere(grid);
    const OccupancyTree tree = OccupancyTree::build(grid, workloads::three_types(), Occupancy::Opaque);
    const auto shell = ImpostorShell::build(tree, 1 << 20, 1 << 20);
    for (const ShellFace& face : shell.value().faces()) faces.push_back({face, nullptr, 0});
    level = all_faces(faces, content);
    for (std::size_t i = 0; i < level.views.size(); ++i) {
      if (level.views[i] != 0) level.views[i] = 1U << random() % 26;
    }
    for (std::uint32_t& views : level.groups.views) views = ~0U;
  }

  // Boxes of cells give rectangles of many sizes.
  [[nodiscard]] ImpostorFaces::Level coarse() const {
    return SurfaceCells(faces, content, 128, 2).level([](const IBox&) { return false; });
  }
};

raster::Aim random_aim(std::mt19937& random, double radius) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const auto direction = [&] { return glm::normalize(DVec3(normal(random), normal(random), normal(random))); };
  raster::Aim aim;
  aim.forward = direction();
  aim.right = glm::normalize(glm::cross(aim.forward, direction()));
  aim.down = glm::cross(aim.forward, aim.right);
  if (share(random) < 0.2) aim.right = -aim.right;  // as for a mirrored instance
  aim.is_perspective = share(random) < 0.8;
  aim.voxel_size = std::exp2(normal(random));
  const double distance = radius * (share(random) < 0.3 ? 1.5 * share(random) : 2.0 + 30.0 * share(random));
  aim.centre = {0.2 * radius * normal(random), 0.2 * radius * normal(random), distance + 1e-3};
  const double pixels = 4.0 + 60.0 * share(random);
  aim.focal = pixels / (2.0 * radius) * (aim.is_perspective ? aim.centre.z : 1.0);
  return aim;
}

struct Met {
  double depth = std::numeric_limits<double>::infinity();
  double rim = 0.0;  // distance inside the nearest face's edge, in voxels
  double next = std::numeric_limits<double>::infinity();
  int face = -1;
};

// Returns the first face that a pixel's ray meets, and the margin of that choice.
Met met_by(const Shape& shape, const raster::Aim& aim, std::uint32_t views, double x, double y) {
  DVec3 origin = -(aim.right * aim.centre.x + aim.down * aim.centre.y + aim.forward * aim.centre.z);
  DVec3 direction = aim.forward;
  const DVec3 across = (aim.right * x + aim.down * y) / aim.focal;
  (aim.is_perspective ? direction : origin) += across;
  Met met;
  for (std::size_t i = 0; i < shape.level.views.size(); ++i) {
    if ((shape.level.views[i] & views) == 0) continue;
    const auto index = shape.level.face[i];
    const ShellFace& face = shape.faces[index].face;
    const FaceFrame& frame = frame_of(face.direction);
    const DVec3 middle = DVec3(face.voxel) + 0.5 + 0.5 * DVec3(normal_of(face.direction)) - shape.content.centre;
    if (direction[frame.axis] * frame.sign >= 0.0) continue;
    const double along = (middle[frame.axis] - origin[frame.axis]) / direction[frame.axis];
    if (along <= 0.0) continue;
    const DVec3 offset = glm::abs(origin + direction * along - middle);
    const double rim = 0.5 - std::max(offset[frame.u], offset[frame.v]);
    if (rim < 0.0) continue;
    const double depth = along * aim.voxel_size;
    if (depth < met.depth) {
      met.next = met.depth;
      met = {depth, rim, met.next, static_cast<int>(index)};
    } else {
      met.next = std::min(met.next, depth);
    }
  }
  return met;
}

int met_face(const Shape& shape, const raster::Canvas& canvas, std::size_t pixel) {
  return static_cast<int>(raster::face_of(shape.level, raster::Met::of(canvas.face[pixel])));
}

TEST(ImpostorRaster, MatchesBruteForceOverFacesAndPixels) {
  std::int64_t pixels = 0;
  std::int64_t others = 0;
  std::int64_t covered = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Shape shape(seed);
    std::mt19937 random(seed);
    for (int round = 0; round < 16; ++round) {
      const raster::Aim aim = random_aim(random, shape.content.radius);
      raster::Job job;
      job.level = &shape.level;
      job.views = round % 2 == 0 ? ~0U : 0x155'5555U;
      job.id = 3;
      raster::Canvas canvas;
      canvas.clear();
      raster::set_aim(aim, -15.7, -16.2, job);
      raster::draw()(job, canvas);
      for (int y = 0; y < raster::kTile; ++y) {
        for (int x = 0; x < raster::kTile; ++x) {
          const std::size_t i = raster::index_of(x, y);
          const Met met = met_by(shape, aim, job.views, x - 15.7, y - 16.2);
          const double size = aim.voxel_size;
          // Excludes cases that single precision may decide differently: at a face's edge, or where two faces lie close
          // together.
          if (met.face >= 0 && (met.rim < 1e-3 || met.next - met.depth < 2e-3 * size)) continue;
          ++pixels;
          covered += met.face >= 0;
          const bool is_met = std::isfinite(canvas.depth[i]);
          others += is_met != (met.face >= 0) || (is_met && met_face(shape, canvas, i) != met.face);
          if (is_met && met_face(shape, canvas, i) == met.face) {
            ASSERT_NEAR(static_cast<double>(canvas.depth[i]), met.depth, 2e-3 * size) << seed;
            ASSERT_EQ(canvas.id[i], 3);
          }
        }
      }
    }
  }
  EXPECT_GT(covered, 20'000);
  EXPECT_LE(others, pixels / 10'000) << "rays that pass an outer edge within rounding";
}

void expect_same(const raster::Canvas& a, const raster::Canvas& b) {
  ASSERT_EQ(a.depth, b.depth);
  ASSERT_EQ(a.id, b.id);
  ASSERT_EQ(a.furthest, b.furthest);
  for (std::size_t p = 0; p < raster::kPixels; ++p) {
    if (std::isinf(a.depth[p])) continue;
    ASSERT_EQ(a.face[p], b.face[p]);
  }
}

void expect_nothing_outside(const raster::Job& job, const raster::Canvas& canvas) {
  for (int y = 0; y < raster::kTile; ++y) {
    for (int x = 0; x < raster::kTile; ++x) {
      if (x >= job.left && x < job.right && y >= job.top && y < job.bottom) continue;
      ASSERT_TRUE(std::isinf(canvas.depth[raster::index_of(x, y)]));
    }
  }
}

// Draws from all directions, one image over the other.
void expect_same_as_plain(const ImpostorFaces::Level& level, double radius, unsigned seed, InstructionSet with) {
  std::mt19937 random(100 + seed);
  std::array<raster::Canvas, 2> canvases;
  for (raster::Canvas& canvas : canvases) canvas.clear();
  for (int round = 0; round < 6; ++round) {
    SCOPED_TRACE(round);
    raster::Aim aim = random_aim(random, radius);
    if (round == 4) aim.centre.z = 1e-30;
    if (round == 5) aim.centre.x = std::numeric_limits<double>::quiet_NaN();
    raster::Job job;
    job.level = &level;
    job.views = ~0U;
    job.id = 9 - round;
    job.left = static_cast<int>(random() % 20), job.right = 32 - static_cast<int>(random() % 10);
    job.top = static_cast<int>(random() % 20), job.bottom = 32 - static_cast<int>(random() % 10);
    raster::set_aim(aim, -15.7, -16.2, job);
    std::size_t i = 0;
    for (const InstructionSet set : {InstructionSet::Plain, with}) {
      const InstructionSetOverride over(set);
      raster::draw()(job, canvases[i++]);
    }
    expect_same(canvases[0], canvases[1]);
    if (round == 0) expect_nothing_outside(job, canvases[0]);
  }
}

class RasterKernel : public testing::TestWithParam<InstructionSet> {};

TEST_P(RasterKernel, MatchesPlainKernelExactly) {
  QUOIN_SKIP_WITHOUT(GetParam());
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Shape shape(seed);
    expect_same_as_plain(shape.level, shape.content.radius, seed, GetParam());
    const ImpostorFaces::Level coarse = shape.coarse();
    EXPECT_FALSE(coarse.reach[0].empty());
    expect_same_as_plain(coarse, shape.content.radius, seed, GetParam());
    if (testing::Test::HasFatalFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, RasterKernel, testing::Values(InstructionSet::Avx2, InstructionSet::Avx512),
                         name_of_set);

TEST(ImpostorSeen, DrawingSeesSameFacesAsRays) {
  const VoxelRegistry types = workloads::three_types();
  for (const workloads::Blocky which : {workloads::Blocky::W4, workloads::Blocky::W2}) {
    Grid grid;
    grid.put_chunk({-1, 0, 0}, workloads::blocky_chunk(which));
    const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
    const ContentSphere content = content_sphere(grid);
    const auto shell = ImpostorShell::build(tree, 1 << 20, 1 << 20);
    ASSERT_TRUE(shell.has_value());
    const auto drawn = faces_seen_of(*shell, {}, tree.bounds(), content, 128);
    MetShapes no_shapes;
    const auto met = faces_seen_by_rays({.grid = &grid, .types = &types, .opaque = &tree}, content, 128, no_shapes);
    ASSERT_GT(drawn.size(), 5'000U);
    const auto key_of = [](const ShellFace& face) {
      return std::tuple(face.voxel.x, face.voxel.y, face.voxel.z, static_cast<int>(face.direction));
    };
    std::map<std::tuple<int, int, int, int>, SeenFace> by_face;
    for (const SeenFace& face : met) by_face[key_of(face.face)] = face;
    std::size_t views = 0;
    std::size_t others = 0;
    for (const SeenFace& face : drawn) {
      const auto found = by_face.find(key_of(face.face));
      const std::uint32_t by_rays = found == by_face.end() ? 0 : found->second.views;
      views += static_cast<std::size_t>(std::popcount(face.views));
      // Faces that rays hit pass their views on to their neighbours.
      others += static_cast<std::size_t>(std::popcount(face.views & ~by_rays));
    }
    EXPECT_GT(views, 20'000U);
    EXPECT_LE(others, views / 500);
  }
}

TEST(RasterDeathTest, RejectsPixelOutsideTile) {
  QUOIN_EXPECT_MISTAKE(static_cast<void>(raster::index_of(raster::kTile, 0)), "a pixel of the tile");
}

TEST(RasterDeathTest, RejectsValuesBeyondPackedWord) {
  QUOIN_EXPECT_MISTAKE(static_cast<void>(raster::Met{1U << 26, 0}.packed()), "a number of 26 bits");
  QUOIN_EXPECT_MISTAKE(static_cast<void>(raster::Met{0, 32}.packed()), "a view of 5 bits");
}

}  // namespace
}  // namespace quoin
