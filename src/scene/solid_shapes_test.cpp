#include "scene/solid_shapes.h"

#include <array>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "core/coordinates/chunk_order.h"
#include "core/work/nightly_for_tests.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

// Stone, water (passable), glass.
VoxelRegistry three_types() {
  VoxelRegistry types;
  VoxelProperties properties;
  EXPECT_TRUE(types.add(properties));
  properties.collides = false;
  properties.visibility = Visibility::Transparent;
  EXPECT_TRUE(types.add(properties));
  properties.collides = true;
  EXPECT_TRUE(types.add(properties));
  return types;
}

bool solid_at(const Grid& grid, const VoxelRegistry& types, IVec3 voxel) {
  const VoxelType type = grid.get(voxel);
  return type != kAir && (type >= types.size() || types[type].collides);
}

IVec3 random_voxel(std::mt19937& random, int low, int high) {
  const auto one = [&] { return low + static_cast<int>(random() % static_cast<unsigned>(high - low)); };
  const int x = one();
  const int y = one();
  return {x, y, one()};
}

// Adds boxes, balls and noise of all types, some of them unregistered, around the corner of eight chunks.
void edit(Grid& grid, std::mt19937& random) {
  const auto type = static_cast<VoxelType>(random() % 6);
  const IVec3 at = random_voxel(random, -70, 70);
  switch (random() % 4) {
    case 0:
      grid.fill_box({at, at + random_voxel(random, 1, 50)}, type);
      break;
    case 1:
      grid.fill_sphere(DVec3(at), 1.0 + static_cast<double>(random() % 20), type);
      break;
    case 2:
      for (int i = 0; i < 200; ++i) grid.set(random_voxel(random, -70, 70), type);
      break;
    default:
      grid.set(at, type);
  }
}

void expect_boxes(const Grid& grid, IVec3 chunk, const VoxelRegistry& types, const std::vector<IBox>& boxes) {
  std::set<std::tuple<int, int, int>> covered;
  IVec3 last{-1};
  for (const IBox& box : boxes) {
    ASSERT_FALSE(box.empty());
    ASSERT_TRUE(by_zyx(last, box.min) || last.z < 0) << "sorted by their lowest voxel";
    last = box.min;
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) ASSERT_TRUE(covered.insert({x, y, z}).second) << "each once";
      }
    }
  }
  std::size_t solid = 0;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) {
        if (!solid_at(grid, types, chunk * kChunkEdge + IVec3(x, y, z))) continue;
        ++solid;
        ASSERT_TRUE(covered.contains({x, y, z})) << x << " " << y << " " << z;
      }
    }
  }
  ASSERT_EQ(covered.size(), solid) << "nothing else";
}

void expect_faces(const Grid& grid, IVec3 chunk, const VoxelRegistry& types, const QuadBuffer& quads) {
  std::set<std::tuple<int, int, int, int>> covered;
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    for (int u = 0; u < quad.size_u(); ++u) {
      for (int v = 0; v < quad.size_v(); ++v) {
        IVec3 at = quad.voxel();
        at[frame.u] += u;
        at[frame.v] += v;
        ASSERT_TRUE(covered.insert({static_cast<int>(quad.direction()), at.x, at.y, at.z}).second) << "each once";
      }
    }
  }
  std::size_t faces = 0;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) {
        const IVec3 voxel = chunk * kChunkEdge + IVec3(x, y, z);
        if (!solid_at(grid, types, voxel)) continue;
        for (const Direction direction : kDirections) {
          if (solid_at(grid, types, voxel + normal_of(direction))) continue;
          ++faces;
          ASSERT_TRUE(covered.contains({static_cast<int>(direction), x, y, z}));
        }
      }
    }
  }
  ASSERT_EQ(covered.size(), faces) << "nothing else";
}

TEST(SolidShapes, MatchGridAfterEdits) {
  for (unsigned seed = 0; seed < static_cast<unsigned>(cases(3, 6)); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    VoxelRegistry types = three_types();
    Grid grid;
    SolidShapes shapes({.boxes = true, .faces = true});
    std::map<std::array<int, 3>, std::pair<std::vector<IBox>, QuadBuffer>> shown;
    for (int step = 0; step < 12; ++step) {
      for (unsigned i = 0; i < 1 + random() % 5; ++i) edit(grid, random);
      if (step == 8) {
        VoxelProperties ice = types[2];
        ice.collides = true;
        types.replace(2, ice);
      }
      if (step == 10) grid = Grid();
      std::vector<IVec3> changed = shapes.update(grid, types, {2});
      EXPECT_TRUE(std::is_sorted(changed.begin(), changed.end(), by_zyx));
      for (const IVec3 chunk : changed) {
        auto& known = shown[{chunk.x, chunk.y, chunk.z}];
        EXPECT_FALSE(known.first == shapes.boxes(chunk) && known.second == shapes.faces(chunk)) << "changed";
        known = {shapes.boxes(chunk), shapes.faces(chunk)};
      }
      EXPECT_TRUE(shapes.update(grid, types).empty());
    }
    for (int i = 0; i < 64; ++i) {
      const IVec3 chunk = IVec3(i & 3, i >> 2 & 3, i >> 4) - 2;
      EXPECT_EQ((shown[{chunk.x, chunk.y, chunk.z}].first), shapes.boxes(chunk)) << "reported";
      EXPECT_EQ((shown[{chunk.x, chunk.y, chunk.z}].second), shapes.faces(chunk)) << "reported";
      expect_boxes(grid, chunk, types, shapes.boxes(chunk));
      expect_faces(grid, chunk, types, shapes.faces(chunk));
      if (HasFatalFailure()) return;
    }
  }
}

TEST(SolidShapes, FullChunkIsBoxAndSixFaces) {
  const VoxelRegistry types = three_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {64, 64, 64}}, 1);
  grid.set({3, 3, 3}, 3);  // also solid, with another type
  SolidShapes shapes({.boxes = true, .faces = true});
  EXPECT_EQ(shapes.update(grid, types), std::vector<IVec3>{IVec3(0)});
  EXPECT_EQ(shapes.boxes({0, 0, 0}), (std::vector<IBox>{{{0, 0, 0}, {64, 64, 64}}}));
  EXPECT_EQ(shapes.faces({0, 0, 0}).size(), 6U);
  // Surrounded by solid voxels.
  grid.fill_box({{-64, -64, -64}, {128, 128, 128}}, 1);
  EXPECT_EQ(shapes.update(grid, types).size(), 27U);
  EXPECT_TRUE(shapes.faces({0, 0, 0}).empty());
  grid.fill_box({{-64, -64, -64}, {128, 128, 128}}, 2);
  EXPECT_EQ(shapes.update(grid, types).size(), 27U);
  EXPECT_TRUE(shapes.boxes({0, 0, 0}).empty());
}

TEST(SolidShapes, TrianglesFaceOutwards) {
  const VoxelRegistry types = three_types();
  Grid grid;
  grid.fill_sphere({32, 32, 32}, 13.3, 1);
  QuadBuffer quads;
  append_solid_faces(grid, {0, 0, 0}, types, quads);
  const SolidMesh mesh = solid_mesh(quads);
  ASSERT_EQ(mesh.positions.size(), 4 * quads.size());
  ASSERT_EQ(mesh.indices.size(), 6 * quads.size());
  EXPECT_NEAR(oracle::signed_volume(mesh), static_cast<double>(grid.voxel_count()), 1e-6);
}

TEST(SolidShapes, AreFewForTerrain) {
  const VoxelRegistry types = three_types();
  Grid grid;
  for (int z = 0; z < 64; ++z) {
    for (int x = 0; x < 64; ++x) {
      const int height = 20 + (x / 8 + z / 8) % 3;
      grid.fill_box({{x, 0, z}, {x + 1, height, z + 1}}, 1);
    }
  }
  std::vector<IBox> boxes;
  append_solid_boxes(*grid.find_chunk({0, 0, 0}), types, boxes);
  EXPECT_LE(boxes.size(), 128U) << "64 plateaus on a block";
}

}  // namespace
}  // namespace quoin
