#include <quoin/mesh/smooth_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>

#include <quoin/grid/voxel_field.h>

#include "core/death_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/surface_check_for_tests.h"
#include "mesh/surface/simplify.h"
#include "mesh/surface/welded_for_tests.h"

namespace quoin {

namespace {

using oracle::signed_volume;

using Field = std::function<float(Vec3)>;

/// Returns Surface Nets over the cells of a cube of `edge` samples, one vertex per cell; occlusion, albedo and types
/// identify the vertices.
SmoothMesh surface_of(const Field& field, int edge) {
  SmoothMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> vertex_of;
  const auto at = [&](IVec3 p) { return field(Vec3(p)); };
  for (int i = 0; i < edge * edge * edge; ++i) {
    const IVec3 cell{i % edge, i / edge % edge, i / (edge * edge)};
    smooth::Corners corners{};
    for (int c = 0; c < 8; ++c) corners[static_cast<std::size_t>(c)] = at(cell + IVec3(c & 1, c >> 1 & 1, c >> 2));
    const std::uint32_t solid = smooth::solid_corners(corners);
    if (solid == 0 || solid == 255) continue;
    const smooth::CellVertex vertex = smooth::cell_vertex(corners);
    const auto number = static_cast<std::uint32_t>(mesh.positions.size());
    vertex_of[{cell.x, cell.y, cell.z}] = number;
    mesh.positions.push_back(Vec3(cell) + vertex.snapped);
    mesh.normals.push_back(vertex.normal);
    mesh.occlusion.push_back(static_cast<float>(number % 1000) / 1000.0F);
    mesh.albedo.push_back({static_cast<std::uint16_t>(number), static_cast<std::uint16_t>(number >> 16), 0, 65'535});
    mesh.types.push_back(static_cast<VoxelType>(number % 7 + 1));
  }
  for (int i = 0; i < edge * edge * edge * 3; ++i) {
    const int axis = i % 3;
    const IVec3 p{i / 3 % edge, i / 3 / edge % edge, i / 3 / (edge * edge)};
    IVec3 step(0), u(0), v(0);
    step[axis] = u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
    const bool inside = at(p) < 0.0F;
    if (inside == (at(p + step) < 0.0F)) continue;
    std::array<std::uint32_t, 4> quad{};
    const std::array<IVec3, 4> cells = {p - u - v, p - v, p, p - u};
    for (std::size_t k = 0; k < 4; ++k) quad[k] = vertex_of.at({cells[k].x, cells[k].y, cells[k].z});
    if (!inside) std::swap(quad[1], quad[3]);
    for (const std::size_t k : {0, 1, 2, 0, 2, 3}) mesh.indices.push_back(quad[k]);
  }
  return mesh;
}

/// Counts the edges without exactly one triangle on each side.
std::size_t open_edges(const SmoothMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    ++uses[{mesh.indices[i], mesh.indices[i / 3 * 3 + (i + 1) % 3]}];
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : uses) {
    const auto back = uses.find({edge.second, edge.first});
    open += count == 1 && back != uses.end() && back->second == 1 && edge.first != edge.second ? 0 : 1;
  }
  return open;
}

/// Applies the manifold repair of the simplifier, for meshes whose vertices all have distinct positions.
void make_one_manifold(SmoothMesh& mesh) {
  Triangulation triangles{mesh.positions, mesh.indices, mesh.indices};
  make_manifold(triangles, 0.0F);
  SmoothMesh made = mesh;
  made.indices = triangles.indices;
  made.positions = triangles.positions;
  const std::size_t before = mesh.positions.size();
  std::vector<std::uint32_t> from(made.positions.size());
  for (std::size_t i = 0; i < triangles.indices.size(); ++i) from[triangles.indices[i]] = triangles.corners[i];
  for (std::size_t i = before; i < made.positions.size(); ++i) {
    made.normals.push_back(mesh.normals[from[i]]);
    if (!mesh.occlusion.empty()) made.occlusion.push_back(mesh.occlusion[from[i]]);
    made.albedo.push_back(mesh.albedo[from[i]]);
    made.types.push_back(mesh.types[from[i]]);
  }
  mesh = std::move(made);
}

float sphere(Vec3 p) {
  return glm::length(p - Vec3(20.3F, 20.1F, 19.8F)) - 15.7F;
}

/// Returns several balls that merge.
Field blob(std::mt19937& random) {
  std::uniform_real_distribution<float> place(10.0F, 30.0F);
  std::uniform_real_distribution<float> radius(3.0F, 6.0F);
  std::vector<std::pair<Vec3, float>> balls;
  for (int i = 0; i < 6; ++i) balls.push_back({{place(random), place(random), place(random)}, radius(random)});
  return [balls](Vec3 p) {
    float sum = 0.0F;
    for (const auto& [centre, size] : balls) sum += size * size / (glm::dot(p - centre, p - centre) + 0.01F);
    return 1.0F - sum;
  };
}

/// Noise in a cube of `edge` samples with air at its sides, including every kind of cell with several sheets.
Field random_samples(std::uint32_t seed, int edge) {
  const float last = static_cast<float>(edge) - 2.5F;
  return [=](Vec3 p) {
    const bool is_inside = std::min({p.x, p.y, p.z}) > 0.5F && std::max({p.x, p.y, p.z}) < last;
    std::mt19937 random(seed + static_cast<std::uint32_t>(p.x + 100.0F * p.y + 10'000.0F * p.z));
    return is_inside ? std::uniform_real_distribution<float>(-1.0F, 1.0F)(random) : 1.0F;
  };
}

class Simplify : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!can_simplify()) GTEST_SKIP() << "this build has no meshoptimizer";
  }
};

TEST_F(Simplify, KeepsSphereClosedWithinError) {
  for (const float error : {0.01F, 0.03F, 0.1F, 0.3F, 1.0F}) {
    SmoothMesh mesh = surface_of(sphere, 41);
    ASSERT_EQ(open_edges(mesh), 0U);
    const std::size_t before = mesh.indices.size();
    const auto reached = simplify_smooth_mesh(mesh, error);
    ASSERT_TRUE(reached);
    EXPECT_LE(*reached, error);
    EXPECT_GT(*reached, 0.0F);
    EXPECT_EQ(open_edges(mesh), 0U) << error;
    EXPECT_LT(mesh.indices.size(), error > 0.05F ? before / 2 : before) << error;
    float farthest = 0.0F;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const Vec3 centre = (mesh.positions[mesh.indices[i]] + mesh.positions[mesh.indices[i + 1]] +
                           mesh.positions[mesh.indices[i + 2]]) /
                          3.0F;
      farthest = std::max(farthest, std::abs(sphere(centre)));
    }
    EXPECT_LT(farthest, 0.05F + 3.0F * error) << "the mesh itself is off by some 0.04";
  }
}

/// Simplifies copies of a closed mesh with several errors and expects closed meshes.
void expect_stays_closed(const SmoothMesh& whole) {
  ASSERT_EQ(open_edges(whole), 0U);
  for (const float error : {0.0F, 0.02F, 0.2F, 1.0F, 5.0F}) {
    SmoothMesh mesh = whole;
    ASSERT_TRUE(simplify_smooth_mesh(mesh, error));
    EXPECT_EQ(open_edges(mesh), 0U) << "error " << error << " triangles " << mesh.indices.size() / 3;
  }
}

TEST_F(Simplify, KeepsRandomBlobsClosed) {
  // The nightly run takes a random seed.
  const std::uint32_t seed = is_nightly() ? std::random_device{}() : 20U;
  std::mt19937 random(seed);
  int tried = 0;
  const int blobs = cases(6, 20);
  for (int i = 0; i < blobs; ++i) {
    const SmoothMesh whole = surface_of(blob(random), 41);
    if (open_edges(whole) != 0) continue;  // two sheets in a cell
    ++tried;
    SCOPED_TRACE("seed " + std::to_string(seed) + " blob " + std::to_string(i));
    expect_stays_closed(whole);
  }
  EXPECT_GT(tried, blobs / 4);
}

/// Returns the number of vertices at the position of an earlier vertex.
std::size_t coincident_vertices(const SmoothMesh& mesh) {
  std::set<std::array<float, 3>> positions;
  for (const Vec3& p : mesh.positions) positions.insert({p.x, p.y, p.z});
  return mesh.positions.size() - positions.size();
}

TEST_F(Simplify, StaysClosedAtZeroLengthEdge) {
  std::mt19937 random(1'548'743'885U);
  for (int i = 0; i < 15; ++i) blob(random);
  const SmoothMesh whole = surface_of(blob(random), 41);
  EXPECT_EQ(coincident_vertices(whole), 1U);
  expect_stays_closed(whole);
}

TEST_F(Simplify, StaysClosedAtManyZeroLengthEdges) {
  std::mt19937 random(1);
  for (const float step : {0.5F, 1.0F}) {
    SCOPED_TRACE(step);
    SmoothMesh whole = surface_of(blob(random), 41);
    for (Vec3& position : whole.positions) position = glm::round(position / step) * step;
    EXPECT_GT(coincident_vertices(whole), 20U);
    expect_stays_closed(whole);
  }
}

TEST_F(Simplify, KeepsTouchingSurfacesClosed) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    SmoothMesh whole = surface_of(random_samples(seed, 16), 16);
    make_one_manifold(whole);
    EXPECT_GT(coincident_vertices(whole), whole.positions.size() / 10);
    expect_stays_closed(whole);
  }
}

/// Tests every triangle separately.
float distance_from(const SmoothMesh& mesh, Vec3 p) {
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    // A tree of one triangle tests only that triangle.
    const TriangleTree one(mesh.positions, std::span(mesh.indices).subspan(i, 3));
    nearest = std::min(nearest, one.distance(p, 1e6F));
  }
  return nearest;
}

TEST(TriangleTree, MatchesDistanceToSampledPoints) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-1.0F, 1.0F);
  const auto point = [&] { return Vec3(any(random), any(random), any(random)); };
  for (int round = 0; round < 200; ++round) {
    const std::vector<Vec3> corners = {point(), point(), point()};
    const std::vector<std::uint32_t> indices = {0, 1, 2};
    const Vec3 p = point() * 2.0F;
    float expected = std::numeric_limits<float>::infinity();
    for (int i = 0; i <= 100; ++i) {
      for (int k = 0; i + k <= 100; ++k) {
        const float u = static_cast<float>(i) / 100.0F;
        const float v = static_cast<float>(k) / 100.0F;
        expected = std::min(expected, glm::length(corners[0] * (1.0F - u - v) + corners[1] * u + corners[2] * v - p));
      }
    }
    const float found = TriangleTree(corners, indices).distance(p, 100.0F);
    EXPECT_LE(found, expected + 1e-5F);
    EXPECT_GE(found, expected - 0.03F);
    EXPECT_EQ(TriangleTree(corners, indices).distance(p, found * 0.5F), found * 0.5F) << "no farther than asked";
  }
  EXPECT_EQ(TriangleTree({}, {}).distance(Vec3(1.0F), 4.0F), 4.0F);
}

TEST_F(Simplify, KeepsVerticesWithinError) {
  std::mt19937 random(21);
  for (int i = 0; i < 3; ++i) {
    const SmoothMesh whole = surface_of(blob(random), 41);
    if (open_edges(whole) != 0) continue;
    for (const float error : {0.05F, 0.3F, 1.5F}) {
      SmoothMesh mesh = whole;
      const auto reached = simplify_smooth_mesh(mesh, error);
      ASSERT_TRUE(reached);
      float farthest = 0.0F;
      for (std::size_t v = 0; v < whole.positions.size(); v += 3) {
        farthest = std::max(farthest, distance_from(mesh, whole.positions[v]));
      }
      EXPECT_LE(farthest, *reached + 1e-5F);
      EXPECT_LE(*reached, error);
      EXPECT_LT(mesh.indices.size(), whole.indices.size());
    }
  }
}

TEST_F(Simplify, MoreErrorLeavesFewerTriangles) {
  std::mt19937 random(4);
  const SmoothMesh whole = surface_of(blob(random), 41);
  std::size_t last = whole.indices.size();
  for (const float error : {0.1F, 0.5F, 2.0F, 8.0F}) {
    SmoothMesh mesh = whole;
    ASSERT_TRUE(simplify_smooth_mesh(mesh, error));
    EXPECT_LT(mesh.indices.size(), last) << error;
    last = mesh.indices.size();
  }
}

TEST_F(Simplify, SlightlyMoreErrorLeavesFewerTriangles) {
  const Field ball = [](Vec3 p) { return glm::length(p - 45.1F) - 40.5F; };
  const Field waves = [](Vec3 p) {
    const Vec3 q = p * 0.5236F;
    const Vec3 away = glm::abs(p - 18.0F);
    const float wave = std::sin(q.x) * std::cos(q.y) + std::sin(q.y) * std::cos(q.z) + std::sin(q.z) * std::cos(q.x);
    return std::max(wave, std::max({away.x, away.y, away.z}) - 16.5F);
  };
  struct Case {
    const Field& field;
    int edge;
    float less;
    float more;
  };
  for (const Case& each : {Case{ball, 90, 0.04F, 0.06F}, Case{waves, 36, 0.4F, 0.5F}, Case{waves, 36, 0.1F, 0.12F}}) {
    const SmoothMesh whole = surface_of(each.field, each.edge);
    SmoothMesh of_less = whole;
    SmoothMesh of_more = whole;
    ASSERT_TRUE(simplify_smooth_mesh(of_less, each.less) && simplify_smooth_mesh(of_more, each.more));
    EXPECT_LT(of_less.indices.size(), whole.indices.size());
    EXPECT_LT(of_more.indices.size(), of_less.indices.size()) << each.more;
  }
}

// The lower error would remove less than 1 % of the triangles of this noise.
TEST_F(Simplify, LeavesLargeMeshThatHardlyShrinks) {
  std::mt19937 random(3);
  std::vector<float> values(std::size_t{27} * 27 * 27);
  for (float& value : values) value = static_cast<float>(random()) * 0x1p-31F - 1.0F;
  const auto noise = [&](Vec3 p) {
    const IVec3 at = glm::min(IVec3(p), IVec3(26));
    const bool is_border = at.x % 26 == 0 || at.y % 26 == 0 || at.z % 26 == 0;
    return is_border ? 1.0F : values[static_cast<std::size_t>((at.z * 27 + at.y) * 27 + at.x)];
  };
  const SmoothMesh whole = surface_of(noise, 26);
  ASSERT_GT(whole.indices.size() / 3, 48'000U);
  SmoothMesh mesh = whole;
  EXPECT_EQ(simplify_smooth_mesh(mesh, 0.02F).value(), 0.0F);
  EXPECT_EQ(mesh.indices.size(), whole.indices.size());
  mesh = whole;
  EXPECT_GT(simplify_smooth_mesh(mesh, 0.3F).value(), 0.0F);
  EXPECT_LT(mesh.indices.size(), whole.indices.size() * 9 / 10);
}

// A third of the mesh is noise, the rest flat plates. Its position does not affect how much it shrinks.
TEST_F(Simplify, ShrinksPartlyRoughMeshAtAnyPosition) {
  std::mt19937 random(3);
  std::vector<float> values(std::size_t{23} * 23 * 23);
  for (float& value : values) value = static_cast<float>(random()) * 0x1p-31F - 1.0F;
  const auto rough = [&](Vec3 p) {
    const IVec3 at(p);
    if (at.y < 1 || at.y > 22 || at.z < 1 || at.z > 22) return 1.0F;
    if (at.x >= 1 && at.x < 23 && at.y < 23 && at.z < 23) {
      return values[static_cast<std::size_t>((at.z * 23 + at.y) * 23 + at.x)];
    }
    if (at.x >= 26 && at.x <= 70) return std::abs(static_cast<float>((at.y + 1) % 4) - 2.0F) - 0.6F;
    return 1.0F;
  };
  const SmoothMesh whole = surface_of(rough, 74);
  ASSERT_GT(whole.indices.size() / 3, 48'000U);
  for (int i = 0; i < 4; ++i) {
    SmoothMesh moved = whole;
    for (Vec3& position : moved.positions) position.x += 24.0F * static_cast<float>(i);
    ASSERT_TRUE(simplify_smooth_mesh(moved, 0.02F));
    EXPECT_LT(moved.indices.size(), whole.indices.size() * 7 / 10) << i;
  }
}

TEST_F(Simplify, KeepsColourBordersAndStaysClosed) {
  // A voxel ball in two halves; the smaller half has a checkerboard of small fields.
  Grid grid;
  grid.edit({{-16, -16, -16}, {17, 17, 17}}, [](IVec3 p, VoxelType) -> VoxelType {
    if (glm::length(DVec3(p)) > 14.3) return kAir;
    if (p.x >= 0) return 1;
    return ((p.y + 32) / 8 + (p.z + 32) / 8) % 2 == 0 ? 2 : 3;
  });
  VoxelRegistry types;
  for (int i = 1; i <= 3; ++i) {
    VoxelProperties look;
    look.colour = {static_cast<std::uint8_t>(60 * i), 9, 9, 255};
    ASSERT_TRUE(types.add(look).has_value());
  }
  SmoothMeshOptions options;
  options.colours = SurfaceColours::Sharp;
  auto whole = build_smooth_mesh(*field_from_grid(grid), types, options);
  ASSERT_TRUE(whole);
  for (const float error : {0.1F, 0.4F, 1.0F}) {
    SmoothMesh mesh = *whole;
    ASSERT_TRUE(simplify_smooth_mesh(mesh, error));
    EXPECT_LT(mesh.indices.size(), whole->indices.size());
    EXPECT_EQ(open_edges(welded(mesh)), 0U) << error;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const VoxelType type = mesh.types[mesh.indices[i]];
      ASSERT_EQ(mesh.types[mesh.indices[i + 1]], type);
      ASSERT_EQ(mesh.types[mesh.indices[i + 2]], type);
      const Vec3 middle = (mesh.positions[mesh.indices[i]] + mesh.positions[mesh.indices[i + 1]] +
                           mesh.positions[mesh.indices[i + 2]]) /
                          3.0F;
      if (std::abs(middle.x) > 1.0F + 2.0F * error) {
        EXPECT_EQ(type == 1, middle.x > 0.0F);
      }
    }
  }
}

TEST_F(Simplify, KeepsTheAttributesOfRemainingVertices) {
  const SmoothMesh whole = surface_of(sphere, 41);
  SmoothMesh mesh = whole;
  ASSERT_TRUE(simplify_smooth_mesh(mesh, 0.1F));
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  std::vector<bool> used(mesh.positions.size());
  for (const std::uint32_t index : mesh.indices) used[index] = true;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_TRUE(used[i]) << "no vertex is left that nothing uses";
    const std::size_t source = mesh.albedo[i][0] | std::size_t{mesh.albedo[i][1]} << 16;
    EXPECT_EQ(mesh.positions[i], whole.positions[source]);
    EXPECT_EQ(mesh.normals[i], whole.normals[source]);
    EXPECT_EQ(mesh.occlusion[i], whole.occlusion[source]);
    EXPECT_EQ(mesh.types[i], whole.types[source]);
  }
}

TEST_F(Simplify, KeepsTagsWithTheirVertices) {
  SmoothMesh mesh = surface_of(sphere, 41);
  std::vector<std::uint32_t> tags(mesh.positions.size());
  for (std::size_t i = 0; i < tags.size(); ++i) tags[i] = static_cast<std::uint32_t>(i);
  ASSERT_TRUE(simplify_smooth_mesh(mesh, 0.2F, tags).has_value());
  ASSERT_EQ(tags.size(), mesh.positions.size());
  for (std::size_t i = 0; i < tags.size(); ++i) {
    EXPECT_EQ(tags[i], mesh.albedo[i][0] | std::uint32_t{mesh.albedo[i][1]} << 16) << i;
  }
}

TEST_F(Simplify, ZeroErrorSimplifiesOnlyFlatParts) {
  const SmoothMesh whole = surface_of(sphere, 41);
  SmoothMesh mesh = whole;
  mesh.occlusion.clear();
  const auto reached = simplify_smooth_mesh(mesh, 0.0F);
  ASSERT_TRUE(reached);
  EXPECT_EQ(*reached, 0.0F);
  EXPECT_GT(mesh.indices.size(), whole.indices.size() * 9 / 10);
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_NEAR(signed_volume(mesh), signed_volume(whole), 1e-3 * signed_volume(whole));
  EXPECT_TRUE(mesh.occlusion.empty());
}

TEST(Manifold, SeparatesSheetsThatShareEdge) {
  SmoothMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}, {0, 0, -1}};
  mesh.normals.resize(6, Vec3(0, 1, 0));
  mesh.albedo.resize(6);
  mesh.types.resize(6, 3);
  // Two tetrahedra on the edge 0-1, and a pair of triangles back to back.
  mesh.indices = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3, 0, 4, 1, 0, 1, 5, 0, 5, 4, 1, 4, 5, 2, 3, 4, 4, 3, 2};
  EXPECT_GT(open_edges(mesh), 0U);
  const double before = signed_volume(mesh);
  make_one_manifold(mesh);
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(mesh.indices.size(), 24U);
  EXPECT_EQ(mesh.positions.size(), 8U) << "both ends of the edge twice";
  EXPECT_EQ(mesh.types.size(), 8U);
  EXPECT_TRUE(mesh.occlusion.empty());
  EXPECT_EQ(signed_volume(mesh), before);
}

TEST(Manifold, SeparatesSolidsThatShareVertex) {
  SmoothMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}, {9, 9, 9}};
  mesh.normals.resize(8, Vec3(0, 1, 0));
  mesh.albedo.resize(8);
  mesh.types.resize(8);
  // Two tetrahedra; neither uses the last vertex.
  mesh.indices = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3, 0, 4, 5, 0, 6, 4, 0, 5, 6, 4, 6, 5};
  ASSERT_EQ(open_edges(mesh), 0U);
  const double before = signed_volume(mesh);
  make_one_manifold(mesh);
  ASSERT_EQ(mesh.positions.size(), 9U) << "the common vertex twice";
  EXPECT_EQ(mesh.positions[8], Vec3(0));
  EXPECT_EQ(std::count(mesh.indices.begin(), mesh.indices.end(), 0U), 3);
  EXPECT_EQ(std::count(mesh.indices.begin(), mesh.indices.end(), 8U), 3);
  EXPECT_EQ(mesh.normals.size(), 9U);
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(signed_volume(mesh), before);
}

TEST(Manifold, LeavesSoundMeshesUnchanged) {
  SmoothMesh mesh = surface_of(sphere, 41);
  const SmoothMesh whole = mesh;
  make_one_manifold(mesh);
  EXPECT_EQ(mesh.indices, whole.indices);
  EXPECT_EQ(mesh.positions, whole.positions);
  mesh.indices.resize(3000);  // open now
  const std::vector<std::uint32_t> open = mesh.indices;
  make_one_manifold(mesh);
  EXPECT_EQ(mesh.indices, open);
}

TEST(Manifold, ClosesSurfacesThatTouchAtManyEdges) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  for (std::uint32_t i = 0; i < 5; ++i) {
    SmoothMesh mesh = surface_of(random_samples(seed + i, 16), 16);
    EXPECT_GT(open_edges(mesh), 100U);
    const double before = signed_volume(mesh);
    make_one_manifold(mesh);
    EXPECT_EQ(open_edges(mesh), 0U);
    EXPECT_NEAR(signed_volume(mesh), before, 1e-6 * before);
  }
}

TEST(SimplifyErrors, RefusedSimplificationLeavesTheMesh) {
  SmoothMesh mesh = surface_of(sphere, 41);
  const std::size_t before = mesh.indices.size();
  for (const float error : {-1.0F, std::numeric_limits<float>::quiet_NaN()}) {
    const auto refused = simplify_smooth_mesh(mesh, error);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  }
  const auto done = simplify_smooth_mesh(mesh, 0.5F);
  EXPECT_EQ(done.has_value(), can_simplify());
  if (!done) {
    EXPECT_EQ(done.error().code, ErrorCode::Unsupported);
    EXPECT_NE(done.error().message.find("libmeshoptimizer-dev"), std::string::npos);
    EXPECT_EQ(mesh.indices.size(), before);
  }
  SmoothMesh empty;
  EXPECT_EQ(simplify_smooth_mesh(empty, 1.0F).value_or(-1.0F), can_simplify() ? 0.0F : -1.0F);
}

TEST(SimplifyDeathTest, AssertsOnInvalidMesh) {
  if (!can_simplify()) GTEST_SKIP() << "this build cannot simplify";
  const SmoothMesh mesh = surface_of([](Vec3 p) { return glm::length(p - Vec3(6.0F)) - 4.2F; }, 12);
  [[maybe_unused]] const auto simplify = [](SmoothMesh broken) {
    static_cast<void>(simplify_smooth_mesh(broken, 0.1F));
  };
  SmoothMesh fewer = mesh;
  fewer.types.pop_back();
  QUOIN_EXPECT_MISTAKE(simplify(fewer), "has_arrays_of_one_length");
  SmoothMesh beyond = mesh;
  beyond.indices[4] = static_cast<std::uint32_t>(mesh.positions.size());
  QUOIN_EXPECT_MISTAKE(simplify(beyond), "names_vertices");
  SmoothMesh endless = mesh;
  endless.positions[2].y = std::numeric_limits<float>::infinity();
  QUOIN_EXPECT_MISTAKE(simplify(endless), "has_finite_positions");
}

TEST(TriangleTreeDeathTest, RejectsPartOfTriangle) {
  [[maybe_unused]] const std::vector<Vec3> positions(3);
  [[maybe_unused]] const std::vector<std::uint32_t> indices = {0, 1, 2, 0};
  QUOIN_EXPECT_MISTAKE((void)TriangleTree(positions, indices), "whole triangles");
}

}  // namespace

}  // namespace quoin
