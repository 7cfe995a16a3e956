#include <quoin/core/memory.h>
#include <quoin/render/surface_light.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/grid/voxel_field.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth_mesh.h>

#include "render/light/surface/light_world_for_tests.h"
#include "render/light/voxel_light.h"

namespace quoin {
namespace {

bool passes(const LightWorld& world, IVec3 voxel) {
  return !world.types.is_opaque(world.grid.get(voxel));
}

std::array<int, 4> levels_at(const LightWorld& world, IVec3 voxel) {
  const LightLevels levels = world.light.at(voxel);
  return {levels.sky, levels.red, levels.green, levels.blue};
}

// Computes a corner's light by definition: from the voxels around the corner in front that are reachable from the face.
std::array<double, 4> walked_corner(const LightWorld& world, IVec3 voxel, Direction face, IVec3 corner) {
  const FaceFrame& frame = frame_of(face);
  const IVec3 front = voxel + normal_of(face);
  std::vector<IVec3> touching;
  for (int dv = -1; dv <= 0; ++dv) {
    for (int du = -1; du <= 0; ++du) {
      IVec3 at = corner;
      at[frame.axis] = front[frame.axis];
      at[frame.u] += du;
      at[frame.v] += dv;
      touching.push_back(at);
    }
  }
  std::vector<IVec3> reached;
  if (passes(world, front)) reached.push_back(front);
  for (std::size_t i = 0; i < reached.size(); ++i) {
    for (const IVec3 next : touching) {
      const IVec3 way = glm::abs(next - reached[i]);
      const bool is_new = std::find(reached.begin(), reached.end(), next) == reached.end();
      if (way.x + way.y + way.z == 1 && is_new && passes(world, next)) reached.push_back(next);
    }
  }
  std::array<double, 4> mean{};
  for (const IVec3 each : reached) {
    for (std::size_t c = 0; c < 4; ++c) mean[c] += levels_at(world, each)[c] / static_cast<double>(reached.size());
  }
  return mean;
}

void expect_levels(std::uint32_t twelfths, const std::array<double, 4>& wanted) {
  const MeanLevels levels = levels_of_corner(twelfths);
  EXPECT_NEAR(levels.sky, wanted[0], 1e-5);
  EXPECT_NEAR(levels.red, wanted[1], 1e-5);
  EXPECT_NEAR(levels.green, wanted[2], 1e-5);
  EXPECT_NEAR(levels.blue, wanted[3], 1e-5);
}

TEST(SurfaceLight, CornersAverageReachableVoxels) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE(seed);
    const LightWorld world(seed);
    SurfaceLight surface(world.light, world.grid, world.types);
    std::mt19937 random(seed);
    int lit = 0;
    for (int i = 0; i < 4000; ++i) {
      const IVec3 voxel = LightWorld::somewhere(random);
      const Direction face = kDirections[random() % 6];
      if (!passes(world, voxel + normal_of(face))) continue;
      const FaceLight corners = surface.face(voxel, face);
      const FaceFrame& frame = frame_of(face);
      for (std::size_t c = 0; c < 4; ++c) {
        IVec3 corner = voxel;
        corner[frame.u] += c == 1 || c == 2 ? 1 : 0;
        corner[frame.v] += c >= 2 ? 1 : 0;
        expect_levels(corners[c], walked_corner(world, voxel, face, corner));
        lit += corners[c] != 0;
      }
      if (HasFailure()) return;
    }
    EXPECT_GT(lit, 1000);
  }
}

// Returns the light that a quad of several faces shows at a lattice point: a linear function of its corners.
std::array<double, 4> shown_by_quad(const FaceLight& corners, int width, int height, int u, int v) {
  std::array<double, 4> shown{};
  for (std::size_t c = 0; c < 4; ++c) {
    const auto at = [&](std::size_t corner) { return static_cast<double>(corners[corner] >> 8 * c & 255U) / 12.0; };
    // The triangles (0,1,2) and (0,2,3), each with its own slopes.
    const double x = static_cast<double>(u) / width;
    const double y = static_cast<double>(v) / height;
    shown[c] =
        x >= y ? at(0) + x * (at(1) - at(0)) + y * (at(2) - at(1)) : at(0) + y * (at(3) - at(0)) + x * (at(2) - at(3));
  }
  return shown;
}

TEST(SurfaceLight, SplitQuadsMatchSingleFaces) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE(seed);
    const LightWorld world(seed);
    SurfaceLight surface(world.light, world.grid, world.types);
    std::map<LightMerging, std::size_t> counts;
    BlockyMesher mesher;
    QuadBuffer quads;
    QuadBuffer lit;
    BlockVector<FaceLight> corners;
    for (const IVec3 chunk : world.grid.chunks()) {
      mesher.mesh(world.grid.neighbourhood(chunk), world.types, {}, quads);
      for (const LightMerging merging : {LightMerging::Constant, LightMerging::Linear}) {
        surface.split(quads, chunk, merging, lit, corners);
        counts[merging] += lit.size();
        ASSERT_EQ(lit.size(), corners.size());
        ASSERT_EQ(face_count(lit), face_count(quads));
        for (std::size_t i = 0; i < lit.size(); ++i) {
          const FaceFrame& frame = frame_of(lit[i].direction());
          const int width = lit[i].size_u();
          const int height = lit[i].size_v();
          if (merging == LightMerging::Constant) {
            // Faces merge only along edges of equal light.
            ASSERT_TRUE(width == 1 || corners[i][0] == corners[i][1]);
            ASSERT_TRUE(height == 1 || corners[i][0] == corners[i][3]);
          }
          for (int v = 0; v < height; ++v) {
            for (int u = 0; u < width; ++u) {
              IVec3 voxel = chunk * kChunkEdge + lit[i].voxel();
              voxel[frame.u] += u;
              voxel[frame.v] += v;
              const FaceLight own = surface.face(voxel, lit[i].direction());
              for (std::size_t c = 0; c < 4; ++c) {
                const int right = c == 1 || c == 2 ? u + 1 : u;
                const int up = c >= 2 ? v + 1 : v;
                expect_levels(own[c], shown_by_quad(corners[i], width, height, right, up));
              }
              if (HasFailure()) return;
            }
          }
        }
      }
    }
    EXPECT_LT(counts[LightMerging::Linear], counts[LightMerging::Constant]);
  }
}

// Computes the light of a position by definition: shares of the eight voxels around it that are reachable from the
// nearest one.
std::array<double, 4> walked_light(const LightWorld& world, DVec3 place) {
  const IVec3 low(glm::floor(place));
  const auto nearness = [&](IVec3 voxel) {
    const DVec3 away = glm::abs(DVec3(voxel) - place);
    return (1.0 - away.x) * (1.0 - away.y) * (1.0 - away.z);
  };
  std::vector<IVec3> all;
  for (int i = 0; i < 8; ++i) all.push_back(low + IVec3(i & 1, i >> 1 & 1, i >> 2));
  std::vector<IVec3> reached;
  for (const IVec3 each : all) {
    if (!passes(world, each)) continue;
    if (reached.empty()) reached.push_back(each);
    if (static_cast<float>(nearness(each)) > static_cast<float>(nearness(reached[0]))) reached[0] = each;
  }
  for (std::size_t i = 0; i < reached.size(); ++i) {
    for (const IVec3 next : all) {
      const IVec3 way = glm::abs(next - reached[i]);
      const bool is_new = std::find(reached.begin(), reached.end(), next) == reached.end();
      if (way.x + way.y + way.z == 1 && is_new && passes(world, next)) reached.push_back(next);
    }
  }
  std::array<double, 4> sum{};
  double shares = 0.0;
  for (const IVec3 each : reached) {
    shares += nearness(each);
    for (std::size_t c = 0; c < 4; ++c) sum[c] += nearness(each) * levels_at(world, each)[c];
  }
  for (double& each : sum) each = shares > 0.0 ? each / shares : 0.0;
  return sum;
}

TEST(SurfaceLight, VerticesTakeLightInFront) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE(seed);
    const LightWorld world(seed);
    const auto field = field_from_grid(world.grid);
    ASSERT_TRUE(field);
    const auto mesh = build_smooth_mesh(*field, world.types);
    ASSERT_TRUE(mesh);
    SurfaceLight surface(world.light, world.grid, world.types);
    std::vector<MeanLevels> levels(mesh->positions.size());
    surface.read({mesh->positions, mesh->normals}, levels);
    int lit = 0;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const DVec3 before = DVec3(mesh->positions[i]) + 0.5 * DVec3(mesh->normals[i]);
      bool is_near_air = false;
      for (int k = 0; k < 8; ++k) {
        is_near_air |= passes(world, IVec3(glm::floor(before)) + IVec3(k & 1, k >> 1 & 1, k >> 2));
      }
      if (!is_near_air) continue;
      const std::array<double, 4> wanted = walked_light(world, before);
      ASSERT_NEAR(levels[i].sky, wanted[0], 1e-4) << i;
      ASSERT_NEAR(levels[i].red, wanted[1], 1e-4) << i;
      ASSERT_NEAR(levels[i].green, wanted[2], 1e-4) << i;
      ASSERT_NEAR(levels[i].blue, wanted[3], 1e-4) << i;
      lit += levels[i] != MeanLevels{};
    }
    EXPECT_GT(lit, 1000);
  }
}

TEST(SurfaceLight, SharedVerticesMatchAcrossChunks) {
  const LightWorld world(7);
  const auto field = field_from_grid(world.grid);
  ASSERT_TRUE(field);
  SurfaceLight surface(world.light, world.grid, world.types);
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  std::map<std::array<std::int64_t, 6>, MeanLevels> known;  // by position and normal
  std::vector<MeanLevels> levels;
  std::size_t shared = 0;
  for (const IVec3 chunk : field->chunks()) {
    mesher.mesh(field->neighbourhood(chunk), {}, mesh);
    levels.resize(mesh.positions.size());
    surface.read({mesh.positions, mesh.normals, chunk * kChunkEdge}, levels);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      std::array<std::int64_t, 6> key{};
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        key[a] = std::llround(65536.0 * (double{mesh.positions[i][axis]} + chunk[axis] * kChunkEdge));
        key[a + 3] = std::llround(1e5 * double{mesh.normals[i][axis]});
      }
      const auto [found, is_new] = known.emplace(key, levels[i]);
      if (is_new) continue;
      ASSERT_EQ(found->second, levels[i]);
      ++shared;
    }
  }
  EXPECT_GT(shared, 100U);
}

// A house of thin walls surrounded by lamps and sky, and another lamp behind a separate wall.
TEST(SurfaceLight, KeepsClosedRoomBlack) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE(seed);
    LightWorld world;
    std::mt19937 random(seed);
    // A room of any shape, in a shell of one voxel.
    std::vector<IVec3> room{{60, 60, 60}};
    std::set<std::array<int, 3>> inside{{60, 60, 60}};
    while (room.size() < 500) {
      const IVec3 next = room[random() % room.size()] + normal_of(kDirections[random() % 6]);
      if (inside.insert({next.x, next.y, next.z}).second) room.push_back(next);
    }
    for (const IVec3 air : room) {
      for (const Direction direction : kDirections) {
        const IVec3 wall = air + normal_of(direction);
        if (inside.count({wall.x, wall.y, wall.z}) == 0) world.grid.set(wall, LightWorld::kStone);
      }
    }
    world.grid.fill_box({{100, 40, 60}, {101, 80, 61}}, LightWorld::kLamp);
    world.light.update(world.grid, world.types);
    const auto field = field_from_grid(world.grid);
    ASSERT_TRUE(field);
    SmoothMeshOptions options;
    options.keep_thin = true;
    const auto mesh = build_smooth_mesh(*field, world.types, options);
    ASSERT_TRUE(mesh);
    SurfaceLight surface(world.light, world.grid, world.types);
    std::vector<MeanLevels> levels(mesh->positions.size());
    surface.read({mesh->positions, mesh->normals}, levels);
    int dark = 0;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      // The room's own vertices: the air in front of them is in the room.
      const IVec3 before(glm::round(DVec3(mesh->positions[i]) + 0.5 * DVec3(mesh->normals[i])));
      if (inside.count({before.x, before.y, before.z}) == 0) continue;
      ASSERT_EQ(levels[i], MeanLevels{}) << i;
      ++dark;
    }
    EXPECT_GT(dark, 200);
    for (const IVec3 air : room) {
      for (const Direction direction : kDirections) {
        const IVec3 wall = air + normal_of(direction);
        if (inside.count({wall.x, wall.y, wall.z}) != 0) continue;
        const auto opposite = static_cast<Direction>(static_cast<unsigned>(direction) ^ 1U);
        ASSERT_EQ(surface.face(wall, opposite), FaceLight{});
      }
    }
  }
}

// Passes light above the plane y = 0, and at x = 1 in it; levels grow with x.
struct OpaquePlane {
  static bool passes(IVec3 voxel) { return voxel.y > 0 || voxel.x == 1; }
  static std::uint16_t word(IVec3 voxel) { return static_cast<std::uint16_t>(0x4321 + 2 * voxel.x); }
};

TEST(SurfaceLight, IsFiniteAtCentresOfOpaqueVoxels) {
  OpaquePlane voxels;
  for (const double z : {0.0, 0.25}) {
    MeanLevels levels;
    ASSERT_TRUE(light_around(voxels, {0.0, 0.0, z}, levels));
    // Four voxels have x = 1 and two have x = 0.
    EXPECT_NEAR(levels.sky, 1.0 + 2.0 * 4.0 / 6.0, 1e-5);
    EXPECT_FLOAT_EQ(levels.red, 2.0F);
    EXPECT_FLOAT_EQ(levels.green, 3.0F);
    EXPECT_FLOAT_EQ(levels.blue, 4.0F);
  }
}

TEST(SurfaceLight, LinearMergingSplitsFloorIntoFewQuads) {
  LightWorld world;
  VoxelProperties lamp = world.types[LightWorld::kLamp];
  lamp.colour = {255, 255, 255, 255};
  world.types.replace(LightWorld::kLamp, lamp);
  world.grid.fill_box({{0, 0, 0}, {64, 1, 64}}, LightWorld::kStone);
  world.grid.fill_box({{0, 20, 0}, {64, 21, 64}}, LightWorld::kStone);
  for (int i = 0; i < 64; ++i) {
    world.grid.fill_box({{i, 0, -1}, {i + 1, 21, 0}}, LightWorld::kStone);
    world.grid.fill_box({{i, 0, 64}, {i + 1, 21, 65}}, LightWorld::kStone);
    world.grid.fill_box({{-1, 0, i}, {0, 21, i + 1}}, LightWorld::kStone);
    world.grid.fill_box({{64, 0, i}, {65, 21, i + 1}}, LightWorld::kStone);
  }
  world.grid.set({32, 1, 32}, LightWorld::kLamp);
  world.light.update(world.grid, world.types);
  QuadBuffer floor;
  BlockyMesher().mesh(world.grid.neighbourhood({0, 0, 0}), world.types, {}, floor);
  std::erase_if(floor, [](const Quad& quad) { return quad.direction() != Direction::PosY || quad.voxel().y != 0; });
  SurfaceLight surface(world.light, world.grid, world.types);
  QuadBuffer flat;
  QuadBuffer constant;
  QuadBuffer linear;
  std::vector<std::uint16_t> levels;
  BlockVector<FaceLight> corners;
  world.light.split(floor, {0, 0, 0}, flat, levels);
  surface.split(floor, {0, 0, 0}, LightMerging::Constant, constant, corners);
  surface.split(floor, {0, 0, 0}, LightMerging::Linear, linear, corners);
  EXPECT_LT(3 * linear.size(), 2 * flat.size()) << "levels fall evenly along both edges";
  EXPECT_LE(2 * linear.size(), constant.size());
}

}  // namespace
}  // namespace quoin
