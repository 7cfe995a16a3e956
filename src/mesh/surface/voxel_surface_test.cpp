// Smooth surfaces of voxels: colours, thin parts, roundness, bodies.

#include <quoin/mesh/smooth_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include <quoin/grid/voxel_field.h>
#include <quoin/mesh/visible_faces.h>

#include "mesh/smooth/surface_check_for_tests.h"
#include "mesh/surface/smooth_surface.h"
#include "mesh/surface/voxel_surface.h"
#include "mesh/surface/welded_for_tests.h"

namespace quoin {
namespace {

using oracle::count_surface;
using oracle::signed_volume;

/// Types 1 to 4 are opaque in different colours, 5 and 6 are transparent.
VoxelRegistry six_types() {
  VoxelRegistry types;
  for (int i = 1; i <= 6; ++i) {
    VoxelProperties look;
    look.name = std::to_string(i);
    look.colour = {static_cast<std::uint8_t>(40 * i), static_cast<std::uint8_t>(255 - 40 * i), 90, 255};
    if (i > 4) {
      look.visibility = Visibility::Transparent;
      look.colour.a = 100;
    }
    EXPECT_TRUE(types.add(look).has_value());
  }
  return types;
}

SmoothMeshOptions voxels() {
  SmoothMeshOptions options;
  options.colours = SurfaceColours::Sharp;
  options.keep_thin = true;
  return options;
}

SmoothMesh mesh_of(const Grid& grid, const SmoothMeshOptions& options) {
  auto mesh = build_smooth_mesh(*field_from_grid(grid), six_types(), options, {1});
  EXPECT_TRUE(mesh.has_value());
  return mesh ? std::move(*mesh) : SmoothMesh{};
}

using Place = std::array<std::uint32_t, 3>;

Place place_of(Vec3 position) {
  Place place;
  position += 0.0F;  // avoids -0
  std::memcpy(place.data(), &position, sizeof place);
  return place;
}

DBox bounds_of(const SmoothMesh& mesh) {
  DBox box;
  for (const Vec3& position : mesh.positions) box.extend(DVec3(position));
  return box;
}

Grid random_grid(unsigned seed, const IBox& box, double share, const std::vector<VoxelType>& types) {
  Grid grid;
  grid.edit(box, [&](IVec3 voxel, VoxelType) -> VoxelType {
    const std::uint64_t random = oracle::hash_of(seed, voxel);
    if (static_cast<double>(random >> 40) / 16777216.0 >= share) return kAir;
    return types[random % types.size()];
  });
  return grid;
}

TEST(SmoothVoxels, HaveOneColouredQuadPerVisibleFace) {
  const VoxelRegistry types = six_types();
  for (const unsigned seed : {1U, 2U, 3U}) {
    const IBox box{{55, -7, 60}, {75, 9, 70}};
    const Grid grid = random_grid(seed, box, 0.4, {1, 2, 3, 4});
    const SmoothMesh mesh = mesh_of(grid, voxels());
    std::map<VoxelType, std::int64_t> quads;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const VoxelType type = mesh.types[mesh.indices[i]];
      ASSERT_EQ(mesh.types[mesh.indices[i + 1]], type) << "a triangle has one colour";
      ASSERT_EQ(mesh.types[mesh.indices[i + 2]], type);
      ++quads[type];
    }
    std::map<VoxelType, std::int64_t> faces;
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) {
          const VoxelType type = grid.get({x, y, z});
          if (type == kAir) continue;
          for (const Direction direction : kDirections) {
            if (grid.get(IVec3{x, y, z} + normal_of(direction)) == kAir) faces[type] += 2;
          }
        }
      }
    }
    // A bridge gives two faces one additional triangle each.
    for (const auto& [type, count] : faces) {
      EXPECT_GE(quads[type], count);
      EXPECT_LE(quads[type], count + count / 4);
    }
    SmoothMeshOptions separate = voxels();
    separate.keep_thin = false;
    const SmoothMesh beads = mesh_of(grid, separate);
    quads.clear();
    for (std::size_t i = 0; i < beads.indices.size(); i += 3) ++quads[beads.types[beads.indices[i]]];
    EXPECT_EQ(quads, faces) << "two triangles per face";
    for (std::size_t i = 0; i < mesh.types.size(); ++i) {
      const Rgba8 colour = types[mesh.types[i]].colour;
      EXPECT_EQ(mesh.albedo[i][3], 65'535);
      EXPECT_GT(mesh.albedo[i][0], 0);
      EXPECT_EQ(mesh.albedo[i][0] < mesh.albedo[i][1], colour.r < colour.g);
    }
    SmoothMeshOptions blended = voxels();
    blended.colours = SurfaceColours::Blended;
    const SmoothMesh other = mesh_of(grid, blended);
    EXPECT_EQ(welded(mesh).indices.size(), other.indices.size());
    EXPECT_GT(mesh.positions.size(), other.positions.size());
    oracle::expect_manifold(count_surface(other, true));
  }
}

TEST(SmoothVoxels, KeepThicknessOfThinParts) {
  struct Case {
    const char* name;
    IBox box;
    IVec3 thin;  // axes to test
    double least;
  };
  const std::array<Case, 4> cases = {{{"rail", {{0, 0, 0}, {40, 1, 1}}, {0, 1, 1}, 0.75},
                                      {"rail over a chunk's border", {{63, 20, -20}, {64, 21, 30}}, {1, 1, 0}, 0.75},
                                      {"sheet", {{0, 64, 0}, {30, 65, 30}}, {0, 1, 0}, 0.9},
                                      {"lone voxel", {{-1, -1, -1}, {0, 0, 0}}, {1, 1, 1}, 0.7}}};
  for (const Case& thing : cases) {
    SCOPED_TRACE(thing.name);
    Grid grid;
    grid.fill_box(thing.box, 1);
    const DBox kept = bounds_of(mesh_of(grid, voxels()));
    SmoothMeshOptions plain = voxels();
    plain.keep_thin = false;
    const DBox shrunk = bounds_of(mesh_of(grid, plain));
    for (int axis = 0; axis < 3; ++axis) {
      if (thing.thin[axis] == 0) continue;
      EXPECT_GE(kept.max[axis] - kept.min[axis], thing.least);
      EXPECT_LE(kept.max[axis] - kept.min[axis], 1.0);
      EXPECT_LT(shrunk.max[axis] - shrunk.min[axis], kept.max[axis] - kept.min[axis]);
    }
  }
}

TEST(SmoothVoxels, KeepOneVoxelGapsOpen) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {21, 20, 20}}, 1);
  grid.fill_box({{10, 10, 0}, {11, 20, 20}}, kAir);
  const auto width = [&](const SmoothMeshOptions& options) {
    float left = -1e9F;
    float right = 1e9F;
    for (const Vec3& p : mesh_of(grid, options).positions) {
      if (p.y < 12.0F || p.y > 18.0F || p.z < 2.0F || p.z > 17.0F || p.x < 5.0F || p.x > 15.0F) continue;
      (p.x < 10.0F ? left : right) = p.x < 10.0F ? std::max(left, p.x) : std::min(right, p.x);
    }
    return right - left;
  };
  SmoothMeshOptions plain = voxels();
  plain.keep_thin = false;
  EXPECT_GE(width(voxels()), 0.75F);
  EXPECT_LT(width(plain), 0.3F);
}

/// Returns the number of connected pieces of a closed mesh.
std::size_t pieces_of(const SmoothMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.positions.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
  const auto find = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    parent[find(mesh.indices[i])] = find(mesh.indices[i / 3 * 3]);
  }
  std::set<std::uint32_t> roots;
  for (const std::uint32_t index : mesh.indices) roots.insert(find(index));
  return roots.size();
}

TEST(SmoothVoxels, SlantedRailsAreConnectedAndManifold) {
  for (const IVec3 step : {IVec3(1, 1, 0), IVec3(1, -1, 0), IVec3(0, 1, -1), IVec3(-1, 0, 1)}) {
    SCOPED_TRACE(testing::Message() << step.x << step.y << step.z);
    Grid grid;
    for (int i = -6; i < 8; ++i) grid.set(IVec3(62, 1, 2) + step * i, 1);
    SmoothMeshOptions options = voxels();
    const SmoothMesh whole = mesh_of(grid, options);
    EXPECT_EQ(pieces_of(whole), 1U);
    oracle::expect_manifold(count_surface(whole, true));
    options.keep_thin = false;
    EXPECT_EQ(pieces_of(mesh_of(grid, options)), 14U) << "beads";
  }
}

TEST(SmoothVoxels, AreManifoldWithJoinedDiagonals) {
  for (const double share : {0.15, 0.5, 0.8}) {
    const Grid grid = random_grid(9, {{50, 50, 50}, {80, 80, 80}}, share, {1});
    oracle::expect_manifold(count_surface(mesh_of(grid, voxels()), true));
  }
}

TEST(SmoothVoxels, AreBlocksWithoutSmoothness) {
  const Grid grid = random_grid(4, {{58, 60, -5}, {70, 70, 9}}, 0.5, {1, 2});
  SmoothMeshOptions options = voxels();
  options.smoothness = 0.0F;
  const SmoothMesh mesh = mesh_of(grid, options);
  ASSERT_FALSE(mesh.indices.empty());
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 a = mesh.positions[mesh.indices[i]];
    const Vec3 b = mesh.positions[mesh.indices[i + 1]];
    const Vec3 c = mesh.positions[mesh.indices[i + 2]];
    const Vec3 normal = glm::cross(b - a, c - a);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = mesh.positions[mesh.indices[i + k]] * 2.0F;
      EXPECT_LT(glm::length(p - glm::round(p)), 0.01F) << "corners of voxels, or middles of edges where bridges are";
      if (glm::length(normal) > 0.1F) {
        EXPECT_GT(glm::dot(mesh.normals[mesh.indices[i + k]], glm::normalize(normal)), 0.99F) << "of the face";
      }
    }
  }
  std::int64_t solid = 0;
  for (const IVec3 chunk : grid.chunks()) {
    const Chunk& voxels_of_chunk = *grid.find_chunk(chunk);
    solid += kChunkEdge * kChunkEdge * kChunkEdge - static_cast<std::int64_t>(voxels_of_chunk.count(kAir));
  }
  EXPECT_NEAR(signed_volume(mesh), static_cast<double>(solid), 1e-2 * static_cast<double>(solid));
  const SmoothMesh whole = welded(mesh);
  oracle::SurfaceCount count = count_surface(whole);
  EXPECT_EQ(count.crowded_edges, 0) << "no two sheets lie in one place";
  oracle::expect_closed(count);
}

TEST(SmoothVoxels, AreRounderWithMoreSmoothness) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {6, 6, 6}}, 1);
  double last = 216.001;
  for (const float smoothness : {0.0F, 0.25F, 0.5F, 0.75F, 1.0F}) {
    SmoothMeshOptions options = voxels();
    options.smoothness = smoothness;
    const SmoothMesh mesh = mesh_of(grid, options);
    const double volume = signed_volume(mesh);
    EXPECT_LT(volume, last);
    last = volume - 0.5;
    for (const Vec3& normal : mesh.normals) EXPECT_NEAR(glm::length(normal), 1.0F, 1e-5F);
    oracle::expect_closed(count_surface(welded(mesh)));
  }
  SmoothMeshOptions whole = voxels();
  SmoothMeshOptions odd = whole;
  odd.smoothness = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(mesh_of(grid, odd).positions, mesh_of(grid, whole).positions);
  odd.smoothness = 7.0F;
  EXPECT_EQ(mesh_of(grid, odd).positions, mesh_of(grid, whole).positions);
  odd.smoothness = -7.0F;
  whole.smoothness = 0.0F;
  EXPECT_EQ(mesh_of(grid, odd).positions, mesh_of(grid, whole).positions);
}

TEST(SmoothVoxels, MeetAtChunkBorders) {
  const Grid grid = random_grid(12, {{40, 40, 40}, {90, 90, 90}}, 0.4, {1, 5});
  const VoxelRegistry types = six_types();
  const DensityGrid whole = *field_from_grid(grid);
  const DensityGrid field = smooth::field_of_body(whole, types, 0, {});
  SmoothMesher mesher;
  SmoothOptions options;
  options.split_sheets = true;
  options.join_diagonals = true;
  std::map<std::array<int, 5>, std::pair<Vec3, Vec3>> known;
  std::size_t shared = 0;
  for (const IVec3 chunk : field.chunks()) {
    SmoothChunkMesh mesh;
    const DensityNeighbourhood around = field.neighbourhood(chunk);
    const DensityNeighbourhood all = whole.neighbourhood(chunk);
    mesher.mesh(around, options, mesh);
    smooth::shape_vertices(around, options, {0.6F, true, &all, &types}, mesh);
    for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
      const SmoothCell cell = mesh.cells[i];
      const IVec3 at = (chunk + cell.chunk_offset()) * kChunkEdge + cell.cell();
      const Vec3 place = mesh.positions[i] + Vec3(chunk * kChunkEdge);
      const auto [found, is_new] =
          known.try_emplace({at.x, at.y, at.z, cell.sheet(), cell.bridge_axis()}, std::pair(place, mesh.normals[i]));
      shared += is_new ? 0 : 1;
      EXPECT_EQ(found->second.first, place);
      EXPECT_EQ(found->second.second, mesh.normals[i]);
    }
  }
  EXPECT_GT(shared, 1000U);
}

TEST(SmoothVoxels, CoarseLevelsHaveColoursAndAreClosed) {
  const IBox box{{0, 0, 0}, {130, 60, 70}};
  DensityGrid field(8.0F);
  field.edit(box, [](IVec3 p, DensitySample) {
    const double d = static_cast<double>(p.y) - 30.0 + 6.0 * std::sin(p.x * 0.11) * std::cos(p.z * 0.13);
    return DensitySample{static_cast<float>(d), static_cast<VoxelType>(p.x < 64 ? 1 : 2)};
  });
  SmoothMeshOptions options;
  options.colours = SurfaceColours::Sharp;
  options.smoothness = 0.7F;
  options.level_of = [](IVec3 chunk) { return chunk.x & 1; };
  const auto mesh = build_smooth_mesh(field, six_types(), options, {1});
  ASSERT_TRUE(mesh);
  oracle::expect_closed(count_surface(welded(*mesh)));
  for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
    const VoxelType type = mesh->types[mesh->indices[i]];
    ASSERT_TRUE(type == 1 || type == 2);
    const Vec3 at = mesh->positions[mesh->indices[i]];
    if (at.y > 10.0F && std::abs(at.x - 63.5F) > 6.0F) {
      EXPECT_EQ(type, at.x < 63.5F ? 1 : 2);
    }
  }
}

TEST(SmoothBodies, GlassIsClosedAndMeetsFrameExactly) {
  const VoxelRegistry types = six_types();
  Grid grid;
  grid.fill_box({{50, 0, 10}, {80, 30, 12}}, 1);  // a wall across a chunk border
  grid.fill_box({{58, 8, 10}, {72, 22, 12}}, 5);  // a window
  grid.fill_box({{64, 8, 10}, {65, 22, 12}}, 2);  // its bar
  const DensityGrid whole = *field_from_grid(grid);
  SmoothMeshOptions options = voxels();
  std::array<SmoothMesh, 2> bodies;
  const std::vector<std::uint32_t> ids = smooth::bodies_of(types, grid.types());
  ASSERT_EQ(ids, (std::vector<std::uint32_t>{0, 6}));
  for (std::size_t i = 0; i < 2; ++i) {
    const DensityGrid field = smooth::field_of_body(whole, types, ids[i], {});
    auto surface = smooth::build_surface(field, types, options, {&whole, true}, {1}, {});
    ASSERT_TRUE(surface);
    oracle::expect_manifold(count_surface(surface->mesh, true));
    bodies[i] = std::move(surface->mesh);
  }
  // Both bodies contain the triangles between them, in opposite orientation.
  using Triangle = std::array<Place, 3>;
  const auto triangles = [](const SmoothMesh& mesh, bool turned) {
    std::set<Triangle> all;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      Triangle triangle{};
      for (std::size_t k = 0; k < 3; ++k) triangle[turned ? 2 - k : k] = place_of(mesh.positions[mesh.indices[i + k]]);
      std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
      all.insert(triangle);
    }
    return all;
  };
  const std::set<Triangle> frame = triangles(bodies[0], false);
  std::int64_t common = 0;
  for (const Triangle& triangle : triangles(bodies[1], true)) common += frame.count(triangle) != 0 ? 1 : 0;
  // Around both panes: 2 deep, 14 high, 6 and 7 wide.
  EXPECT_EQ(common, 2 * 2 * (2 * (14 + 6) + 2 * (14 + 7)));
  // All other glass triangles are its outside, flush with the outside of the wall.
  EXPECT_EQ(static_cast<std::int64_t>(bodies[1].indices.size() / 3) - common, 2 * 2 * 14 * 13);
  SmoothMeshOptions united = options;
  const double all = signed_volume(mesh_of(grid, united));
  EXPECT_NEAR(signed_volume(bodies[0]) + signed_volume(bodies[1]), all, 0.02 * all);
  EXPECT_NEAR(signed_volume(bodies[1]), 2.0 * 14.0 * 13.0, 0.15 * 2.0 * 14.0 * 13.0);
}

// Checks every sample of one body's densities, in rock with water and two kinds of glass.
TEST(SmoothBodies, NegateDensitiesOfOtherBodies) {
  const VoxelRegistry types = six_types();
  std::mt19937 random(11);
  for (int round = 0; round < 6; ++round) {
    Grid grid;
    if (round != 0) grid.fill_box({{0, 0, 0}, {64, 30, 64}}, 1);  // deep slabs of one density
    for (int i = 0; i < 30 * round; ++i) {
      const IVec3 at(static_cast<int>(random() % 56), static_cast<int>(random() % 56), static_cast<int>(random() % 56));
      const IVec3 size(1 + static_cast<int>(random() % 8), 1 + static_cast<int>(random() % 8), 1);
      grid.fill_box({at, at + size}, static_cast<VoxelType>(random() % 7));
    }
    if (round == 0) grid.fill_box({{-64, -64, -64}, {128, 128, 128}}, 5);  // only the other body
    const DensityGrid field = *field_from_grid(grid);
    const DensityChunk& whole = *field.find_chunk({0, 0, 0});
    const DensityChunk before = whole;
    for (const std::uint32_t body : {0U, 6U, 7U}) {
      const DensityChunk made = smooth::without_others(whole, types, body);
      int wrong = 0;
      for (int i = 0; i < kChunkEdge * kChunkEdge * kChunkEdge; ++i) {
        const IVec3 p(i % kChunkEdge, i / kChunkEdge % kChunkEdge, i / kChunkEdge / kChunkEdge);
        const bool is_solid = DensityChunk::is_solid(whole.get(p));
        const bool is_other = is_solid && smooth::body_of(types, whole.materials().get(p)) != body;
        const Half expected = is_other ? static_cast<Half>(whole.get(p) ^ 0x8000U) : whole.get(p);
        const bool says_solid = (made.solid_row(p.y, p.z) >> p.x & 1U) != 0;
        if (made.get(p) != expected || says_solid != DensityChunk::is_solid(expected)) ++wrong;
      }
      EXPECT_EQ(wrong, 0) << "round " << round << ", body " << body;
    }
    EXPECT_TRUE(whole == before);
  }
}

TEST(SmoothBodies, SeparateGlassTypes) {
  const VoxelRegistry types = six_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {4, 4, 1}}, 5);
  grid.fill_box({{4, 0, 0}, {8, 4, 1}}, 6);
  const DensityGrid whole = *field_from_grid(grid);
  EXPECT_EQ(smooth::bodies_of(types, grid.types()), (std::vector<std::uint32_t>{6, 7}));
  for (const std::uint32_t body : {6U, 7U}) {
    const DensityGrid field = smooth::field_of_body(whole, types, body, {});
    EXPECT_EQ(field.solid_count(), 16);
    const auto surface = smooth::build_surface(field, types, voxels(), {&whole, true}, {1}, {});
    ASSERT_TRUE(surface);
    oracle::expect_manifold(count_surface(surface->mesh, true));
    const DBox bounds = bounds_of(surface->mesh);
    EXPECT_FLOAT_EQ(static_cast<float>(body == 6 ? bounds.max.x : bounds.min.x), 3.5F) << "where they meet";
  }
}

}  // namespace
}  // namespace quoin
