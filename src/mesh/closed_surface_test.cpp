#include <quoin/mesh/blocky.h>

#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/grid/voxel_shape.h>

#include "core/death_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "mesh/nets/sheets.h"

namespace quoin {
namespace {

using Place = std::tuple<float, float, float>;

Place place_of(const Vec3& v) {
  return {v.x, v.y, v.z};
}

BlockyTriangles surface_of(const Grid& grid) {
  auto surface = closed_surface(grid);
  if (!surface) {
    ADD_FAILURE() << to_string(surface.error());
    return {};
  }
  return std::move(*surface);
}

struct Soundness {
  std::size_t bad_edges = 0;     ///< not in two triangles, once in each direction
  std::size_t bad_vertices = 0;  ///< without one fan of triangles around them
  std::size_t flat = 0;          ///< triangles without an area
  double volume = 0.0;
};

/// Checks a mesh after welding vertices by position.
Soundness soundness_of(const BlockyTriangles& mesh) {
  Soundness found;
  std::map<Place, std::uint32_t> numbers;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    std::array<std::uint32_t, 3> triangle{};
    std::array<DVec3, 3> corner{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& at = mesh.positions[mesh.indices[i + k]];
      triangle[k] = numbers.try_emplace(place_of(at), static_cast<std::uint32_t>(numbers.size())).first->second;
      corner[k] = DVec3(at);
    }
    found.volume += glm::dot(corner[0], glm::cross(corner[1], corner[2])) / 6.0;
    found.flat += glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0])) < 1e-6 ? 1 : 0;
    triangles.push_back(triangle);
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  // Walks around each vertex, from each neighbour to the next.
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> next;
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++uses[{t[k], t[(k + 1) % 3]}];
      next[t[k]][t[(k + 1) % 3]] = t[(k + 2) % 3];
    }
  }
  for (const auto& [edge, count] : uses) {
    const auto back = uses.find({edge.second, edge.first});
    if (count != 1 || back == uses.end() || back->second != 1) ++found.bad_edges;
  }
  for (const auto& [vertex, ring] : next) {
    std::size_t steps = 0;
    std::uint32_t at = ring.begin()->first;
    do {
      const auto following = ring.find(at);
      if (following == ring.end()) break;
      at = following->second;
      ++steps;
    } while (at != ring.begin()->first && steps <= ring.size());
    if (steps != ring.size()) ++found.bad_vertices;
  }
  return found;
}

void expect_sound(const Grid& grid, double volume_error = 0.0) {
  const Soundness found = soundness_of(surface_of(grid));
  EXPECT_EQ(found.bad_edges, 0U);
  EXPECT_EQ(found.bad_vertices, 0U);
  EXPECT_EQ(found.flat, 0U);
  EXPECT_NEAR(found.volume, static_cast<double>(grid.voxel_count()), 1e-3 + volume_error);
}

TEST(ClosedSurface, SingleVoxelIsCube) {
  Grid grid;
  grid.set({5, -3, 7}, 2);
  const BlockyTriangles mesh = surface_of(grid);
  EXPECT_EQ(mesh.positions.size(), 24U);
  EXPECT_EQ(mesh.indices.size(), 36U);
  EXPECT_EQ(mesh.types, std::vector<VoxelType>(24, 2));
  expect_sound(grid);
}

TEST(ClosedSurface, CrossesChunksWithoutSeam) {
  Grid grid;
  grid.fill_box({IVec3(-3), IVec3(70, 66, 5)}, 1);
  grid.fill_box({IVec3(0, 70, 0), IVec3(3, 72, 2)}, 2);
  expect_sound(grid);
  EXPECT_EQ(surface_of(grid).indices.size(),
            6U * static_cast<std::size_t>(2 * (73 * 69 + 73 * 8 + 69 * 8) + 2 * (6 + 6 + 4)));
}

TEST(ClosedSurface, SeparatesVoxelsThatShareOnlyAnEdgeOrCorner) {
  Grid edge;
  edge.set({0, 0, 0}, 1);
  edge.set({1, 1, 0}, 1);
  expect_sound(edge, 0.1);
  Grid corner;
  corner.set({0, 0, 0}, 1);
  corner.set({1, 1, 1}, 1);
  expect_sound(corner, 0.1);
  // The edge of two voxels that are joined above and below it: no assignment of corners to sides separates it.
  Grid joined;
  joined.fill_box({IVec3(0), IVec3(2, 2, 3)}, 1);
  joined.set({1, 0, 1}, kAir);
  joined.set({0, 1, 1}, kAir);
  expect_sound(joined, 0.1);
}

TEST(ClosedSurface, IsManifoldForAllSetsOfEightVoxels) {
  for (unsigned solid = 1; solid < 256; ++solid) {
    Grid grid;
    // The same as hollows in a block.
    Grid block;
    block.fill_box({IVec3(-1), IVec3(3)}, 1);
    for (int cell = 0; cell < 8; ++cell) {
      if ((solid >> cell & 1U) == 0) continue;
      const IVec3 at(cell & 1, cell >> 1 & 1, cell >> 2);
      grid.set(at, 1);
      block.set(at, kAir);
    }
    for (const Grid* each : {&grid, &block}) {
      const Soundness found = soundness_of(surface_of(*each));
      EXPECT_EQ(found.bad_edges, 0U) << solid;
      EXPECT_EQ(found.bad_vertices, 0U) << solid;
      EXPECT_EQ(found.flat, 0U) << solid;
      EXPECT_NEAR(found.volume, static_cast<double>(each->voxel_count()), 0.4) << solid;
    }
  }
}

// Returns the 24 rotations by quarter turns.
std::vector<AxisOrientation> rotations() {
  std::vector<AxisOrientation> all;
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    if (!AxisOrientation::at(i).is_mirrored()) all.push_back(AxisOrientation::at(i));
  }
  return all;
}

// Expects a sound surface of cubes and shapes within their voxels. `error`: of the volume, where parts touch.
void expect_sound_shapes(const Grid& grid, const VoxelRegistry& types, double error) {
  const auto surface = closed_surface(grid, types);
  ASSERT_TRUE(surface.has_value());
  double volume = 0.0;
  grid.for_each([&](IVec3 voxel, VoxelType) {
    const ShapeModel* const model = shape_at(grid, types, voxel);
    if (model == nullptr) volume += 1.0;
    for (std::size_t i = 0; model != nullptr && i < model->bits.size(); ++i) {
      volume += std::popcount(static_cast<unsigned>(model->bits[i])) / 4'096.0;
    }
  });
  const Soundness found = soundness_of(*surface);
  EXPECT_EQ(found.bad_edges, 0U);
  EXPECT_EQ(found.bad_vertices, 0U);
  EXPECT_NEAR(found.volume, volume, error);
}

// Returns a shape of several boxes that overlap, touch or lie apart.
VoxelShape random_shape(std::mt19937& random, std::size_t boxes) {
  std::vector<ShapeElement> elements(boxes);
  for (ShapeElement& element : elements) {
    for (int axis = 0; axis < 3; ++axis) {
      const int size = 1 + static_cast<int>(random() % 10);
      element.min[axis] = static_cast<float>(random() % static_cast<unsigned>(17 - size));
      element.max[axis] = element.min[axis] + static_cast<float>(size);
    }
  }
  return *VoxelShape::from_elements(std::move(elements));
}

TEST(ClosedSurface, IsManifoldForFortyShapesInAllTurns) {
  std::mt19937 random(5);
  for (std::size_t i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    VoxelShapes shapes = random_shape(random, 1 + i % 5);
    if (i == 0) shapes = shapes_for_tests::slab();
    if (i == 1) shapes = shapes_for_tests::stairs();
    if (i == 2) shapes = shapes_for_tests::fence();
    VoxelRegistry types;
    const VoxelType stone = *types.add({.name = "stone"});
    const VoxelType shaped = *types.add(
        {.name = "shape", .state_bits = 5, .orientations = {.by_value = rotations()}, .shapes = std::move(shapes)});
    Grid grid;
    for (int turn = 0; turn < 24; ++turn) {
      const IVec3 at(3 * (turn % 6), 0, 3 * (turn / 6));
      grid.set(at, shaped, {.state = static_cast<std::uint32_t>(turn)});
      if (turn % 2 == 0) grid.set(at - IVec3(0, 1, 0), stone);
      if (turn % 3 == 0) grid.set(at + IVec3(1, 1, 0), stone);
    }
    expect_sound_shapes(grid, types, 0.1);
  }
}

TEST(ClosedSurface, IsManifoldForRandomShapesAmongVoxels) {
  VoxelRegistry types;
  (void)*types.add({.name = "stone"});
  const auto turns = StateOrientations::about_y_and_upside_down();
  (void)*types.add({.name = "slab", .state_bits = 3, .orientations = turns, .shapes = shapes_for_tests::slab()});
  (void)*types.add({.name = "stairs", .state_bits = 3, .orientations = turns, .shapes = shapes_for_tests::stairs()});
  (void)*types.add({.name = "fence", .shapes = shapes_for_tests::fence()});
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    Grid grid;
    for (int i = 0; i < 60; ++i) {
      const auto part = [&] { return 60 + static_cast<int>(random() % 7); };
      const auto type = static_cast<VoxelType>(random() % 5);
      grid.set({part(), part(), part()}, type,
               {.state = type == 2 || type == 3 ? static_cast<std::uint32_t>(random() % 8) : 0});
    }
    expect_sound_shapes(grid, types, 1.0);
  }
}

TEST(ClosedSurface, HasPartsOfShapesInOtherVoxelsAndNoPlates) {
  VoxelRegistry types;
  const VoxelType stone = *types.add({.name = "stone"});
  const VoxelType tall = *types.add(
      {.name = "tall", .shapes = *VoxelShape::from_elements({{.min = Vec3(4, 0, 4), .max = Vec3(12, 24, 12)}})});
  const VoxelType flower = *types.add({.name = "flower", .shapes = VoxelShape::crossed_plates()});
  Grid grid;
  grid.fill_box({IVec3(0), IVec3(3, 1, 3)}, stone);
  grid.set({1, 1, 1}, tall);
  grid.set({0, 1, 0}, flower);
  std::int64_t flat = 0;
  const auto surface = closed_surface(grid, types, {}, &flat);
  ASSERT_TRUE(surface.has_value());
  EXPECT_EQ(flat, 1);
  const Soundness found = soundness_of(*surface);
  EXPECT_EQ(found.bad_edges + found.bad_vertices, 0U);
  EXPECT_NEAR(found.volume, 9.0 + 0.25 * 1.5, 1e-3);
  // Without shapes both functions give the same.
  Grid cubes;
  cubes.fill_box({IVec3(0), IVec3(3, 1, 3)}, stone);
  EXPECT_EQ(closed_surface(cubes, types)->positions, closed_surface(cubes)->positions);
}

TEST(ClosedSurface, IsManifoldForRandomVoxels) {
  for (const unsigned percent : {10U, 30U, 50U, 70U, 90U}) {
    std::mt19937 random(percent);
    Grid grid;
    grid.edit({IVec3(58), IVec3(72)},
              [&](IVec3, VoxelType) { return static_cast<VoxelType>(random() % 100 < percent); });
    const Soundness found = soundness_of(surface_of(grid));
    EXPECT_EQ(found.bad_edges, 0U) << percent;
    EXPECT_EQ(found.bad_vertices, 0U) << percent;
    EXPECT_EQ(found.flat, 0U) << percent;
  }
}

TEST(ClosedSurface, MovesOnlyTouchingVertices) {
  const auto& offsets = print::corner_offsets();
  for (unsigned solid : {0b1U, 0b11U, 0b1111U, 0b111U, 0b10111U, 0b11111110U}) {
    for (const Vec3& offset : offsets[solid]) EXPECT_EQ(offset, Vec3(0.0F)) << solid;
  }
  // Two voxels that touch at a corner: each vertex moves a hundredth into its own voxel.
  const Vec3 into = offsets[0b10000001][print::corner_face(0, 0)];
  EXPECT_NEAR(glm::length(into), kSheetOffset, 1e-6F);
  EXPECT_LT(into.x, 0.0F);
}

TEST(ClosedSurface, RejectsDistantVoxels) {
  Grid grid;
  grid.set({70'000, 0, 0}, 1);
  EXPECT_EQ(closed_surface(grid).error().code, ErrorCode::LimitExceeded);
}

TEST(ClosedSurfaceDeathTest, RejectsUnknownVoxelOfCorner) {
  QUOIN_EXPECT_MISTAKE((void)print::corner_face(8, 0), "one of eight voxels, and an axis");
  QUOIN_EXPECT_MISTAKE((void)print::corner_face(0, 3), "one of eight voxels, and an axis");
}

}  // namespace
}  // namespace quoin
