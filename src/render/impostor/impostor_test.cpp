// The snapshots of an impostor: their viewpoints and contents.

#include <quoin/render/impostor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <tuple>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/trace/ray.h>

#include "core/death_for_tests.h"
#include "mesh/blocky/blocky_mesher.h"
#include "render/cpu/render_test_support.h"
#include "render/impostor/raster/impostor_faces.h"
#include "render/impostor/snapshot.h"
#include "render/light/corner_light.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

VoxelRegistry two_types() {
  VoxelRegistry types;
  for (const Rgba8 colour : {Rgba8{0, 0, 0, 255}, Rgba8{200, 90, 60, 255}}) {
    VoxelProperties properties;
    properties.colour = colour;
    EXPECT_TRUE(types.add(properties).has_value());
  }
  return types;
}

Grid blobs(unsigned seed) {
  std::mt19937 random(seed);
  Grid grid;
  for (int i = 0; i < 20; ++i) {
    const auto coordinate = [&] { return static_cast<int>(random() % 30); };
    const IVec3 at{coordinate(), coordinate(), coordinate()};
    grid.fill_box({at, at + IVec3(static_cast<int>(random() % 6)) + 1}, static_cast<VoxelType>(1 + random() % 2));
  }
  return grid;
}

Ray ray_of_texel(const SnapshotCamera& camera, int x, int y) {
  const double half = 0.5 * ImpostorOptions{}.edge;
  const DVec3 direction =
      camera.right * (x + 0.5 - half) + camera.up * (half - y - 0.5) + camera.forward * camera.focal;
  return {camera.position, glm::normalize(direction)};
}

TEST(ImpostorViews, FollowSpecifiedOrder) {
  const std::array<IVec3, 10> first = {IVec3{1, 0, 0}, {-1, 0, 0},  {0, 1, 0},   {0, -1, 0},  {0, 0, 1},
                                       {0, 0, -1},     {-1, -1, 0}, {-1, 0, -1}, {0, -1, -1}, {-1, 1, 0}};
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_LT(glm::length(impostor_view(static_cast<int>(i)) - glm::normalize(DVec3(first[i]))), 1e-15) << i;
  }
  for (int i = 0; i < 8; ++i) {
    const DVec3 corner{(i & 4) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 1) != 0 ? 1 : -1};
    EXPECT_LT(glm::length(impostor_view(18 + i) - glm::normalize(corner)), 1e-15) << i;
  }
}

TEST(ImpostorViews, AreDistinctUnitVectors) {
  std::set<std::tuple<int, int, int>> sides;  // signs: a face, edge or corner of a cube
  const auto sign = [](double value) { return (value > 0.0 ? 1 : 0) - (value < 0.0 ? 1 : 0); };
  for (int i = 0; i < kImpostorViews; ++i) {
    const DVec3 view = impostor_view(i);
    EXPECT_NEAR(glm::length(view), 1.0, 1e-12);
    sides.insert({sign(view.x), sign(view.y), sign(view.z)});
    for (int j = 0; j < i; ++j) EXPECT_LT(glm::dot(view, impostor_view(j)), 0.9);
  }
  EXPECT_EQ(sides.size(), 26U) << "one view for each face, edge and corner";
}

TEST(ImpostorViews, NearestViewHasLargestDotProduct) {
  EXPECT_EQ(nearest_impostor_view({1, 0, 0}), 0);
  EXPECT_EQ(nearest_impostor_view({0, 0, -1}), 5);
  EXPECT_EQ(nearest_impostor_view({1, 1, 1}), 25);
  EXPECT_EQ(nearest_impostor_view({1e300, 0, 0}), 0);
  EXPECT_EQ(nearest_impostor_view({0, -1e-300, 0}), 3);
  for (const DVec3 none : {DVec3(0.0), DVec3(kNotANumber, 0, 0), DVec3(0, kInfinity, 0)}) {
    EXPECT_EQ(nearest_impostor_view(none), std::nullopt);
  }
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  double worst = 1.0;
  for (int i = 0; i < 200'000; ++i) {
    const DVec3 direction = glm::normalize(DVec3(normal(random), normal(random), normal(random)));
    const double found = glm::dot(direction, impostor_view(nearest_impostor_view(direction).value_or(0)));
    for (int view = 0; view < kImpostorViews; ++view)
      ASSERT_LE(glm::dot(direction, impostor_view(view)), found + 1e-15);
    worst = std::min(worst, found);
  }
  EXPECT_NEAR(std::acos(worst) * 180.0 / 3.14159265358979, 27.57, 0.1);
}

TEST(ImpostorViews, CamerasFitWholeSphere) {
  const ContentSphere content{{3, -7, 1e6}, 35.5};
  for (int view = 0; view < kImpostorViews; ++view) {
    const SnapshotCamera camera = snapshot_camera(content, view, 128);
    EXPECT_NEAR(glm::length(camera.position - content.centre), 8 * 35.5, 1e-6);
    EXPECT_LT(glm::length(glm::cross(camera.forward, camera.up) - camera.right), 1e-12);
    EXPECT_NEAR(glm::dot(camera.up, camera.forward), 0.0, 1e-12);
    const DVec3 upright = std::abs(camera.forward.y) > 0.99 ? DVec3(1, 0, 0) : DVec3(0, 1, 0);
    EXPECT_GT(glm::dot(camera.up, upright), 0.5);
    const double sine = 1.0 / 8.0;  // for the cone around the sphere
    EXPECT_NEAR(camera.focal * sine / std::sqrt(1.0 - sine * sine), 64.0, 1e-9);
    EXPECT_NEAR(camera.half_size(), 35.5 * 8.0 / std::sqrt(63.0), 1e-9);
  }
  EXPECT_EQ(snapshot_camera({{0, 0, 0}, 0.2}, 0, 128).distance, 8.0) << "a radius of 1 at least";
}

// Returns the occlusion of the corners of all faces of a grid's impostor, compared with the mesh's.
std::vector<std::uint8_t> occlusion_of_faces(const Grid& grid, const VoxelRegistry& types) {
  std::vector<std::uint8_t> all;
  const Impostor impostor = Impostor::build(grid, types);
  for (const ImpostorFaces::Face& face : impostor.faces().faces) {
    const FaceOcclusion corners = unpacked_corners(face.occlusion);
    EXPECT_EQ(corners,
              face_occlusion(grid.neighbourhood(chunk_of(face.voxel)), types, local_of(face.voxel), face.direction));
    all.insert(all.end(), corners.begin(), corners.end());
  }
  EXPECT_FALSE(all.empty());
  return all;
}

TEST(Impostor, MatchesSingleRays) {
  const VoxelRegistry types = two_types();
  const Grid grid = blobs(4);
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
  GridReader reader(grid);
  for (int view = 0; view < kImpostorViews; ++view) {
    const Snapshot snapshot = take_snapshot({&grid, &types, &tree}, view);
    for (std::size_t i = 0; i < snapshot.types.size(); i += 37) {
      const Ray ray = ray_of_texel(snapshot.camera, static_cast<int>(i % 128), static_cast<int>(i / 128));
      const auto hit = first_hit(tree, ray);
      ASSERT_EQ(snapshot.types[i], hit ? reader.get(hit->voxel) : kAir);
      if (!hit) {
        ASSERT_EQ(snapshot.depth[i], kInfinity);
        continue;
      }
      ASSERT_NEAR(snapshot.depth[i], hit->t, 1e-4);
      ASSERT_EQ(snapshot.faces[i], hit->face);
      const float occlusion = occlusion_at(corner_occlusion(reader, types, hit->voxel, hit->face), hit->voxel,
                                           hit->face, ray.origin + ray.direction * hit->t);
      ASSERT_NEAR(snapshot.occlusion[i], occlusion * 85.0F, 0.51F);
    }
  }
}

TEST(Impostor, FacesHaveCornerOcclusionOfMeshes) {
  VoxelRegistry types = two_types();
  const auto lamp = types.add({.name = "lamp", .occludes = false});
  ASSERT_TRUE(lamp);
  Grid grid = blobs(4);
  const std::vector<std::uint8_t> before = occlusion_of_faces(grid, types);
  // Some of the voxels no longer occlude.
  grid.edit(grid.bounds(), [&](IVec3 at, VoxelType type) { return type == 1 && at.x % 2 == 0 ? *lamp : type; });
  const std::vector<std::uint8_t> after = occlusion_of_faces(grid, types);
  EXPECT_LT(std::accumulate(after.begin(), after.end(), 0), std::accumulate(before.begin(), before.end(), 0));
}

TEST(Impostor, ShowsBlackVoxels) {
  const VoxelRegistry types = two_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 10, 10}}, 1);
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
  for (int view = 0; view < kImpostorViews; ++view) {
    const Snapshot snapshot = take_snapshot({&grid, &types, &tree}, view);
    for (int y = 60; y < 68; ++y) {
      for (int x = 60; x < 68; ++x) EXPECT_EQ(snapshot.types[static_cast<std::size_t>(y * 128 + x)], 1);
    }
  }
}

TEST(Impostor, IsEmptyForEmptyGrid) {
  EXPECT_TRUE(Impostor().empty());
  const VoxelRegistry types = two_types();
  const Grid grid;
  EXPECT_TRUE(Impostor::build(grid, types).empty());
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
  for (int view = 0; view < kImpostorViews; ++view) {
    const Snapshot snapshot = take_snapshot({&grid, &types, &tree}, view);
    ASSERT_EQ(snapshot.types.size(), 128U * 128U);
    EXPECT_TRUE(std::all_of(snapshot.types.begin(), snapshot.types.end(), [](auto type) { return type == kAir; }));
    EXPECT_TRUE(std::all_of(snapshot.depth.begin(), snapshot.depth.end(), [](auto d) { return d == kInfinity; }));
  }
}

TEST(Impostor, CropsNothingInAnyView) {
  const VoxelRegistry types = two_types();
  std::mt19937 random(7);
  for (int round = 0; round < 12; ++round) {
    Grid grid;
    for (int i = 0; i <= round; ++i) {
      const auto coordinate = [&] { return static_cast<int>(random() % 41) - 20; };
      grid.set({coordinate(), coordinate(), coordinate()}, 2);
    }
    const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
    for (int view = 0; view < kImpostorViews; ++view) {
      const Snapshot snapshot = take_snapshot({&grid, &types, &tree}, view);
      EXPECT_NE(std::count(snapshot.types.begin(), snapshot.types.end(), VoxelType{2}), 0) << round << " " << view;
      for (std::size_t i = 0; i < 128; ++i) {  // no snapshot is cropped
        ASSERT_LE(snapshot.types[i] + snapshot.types[128 * i] + snapshot.types[128 * i + 127], round == 0 ? 6 : 3);
      }
    }
  }
}

TEST(Impostor, LeavesOutTransparentVoxels) {
  Scene scene;
  const VoxelType glass = add_type(scene, {90, 120, 220, 120}, Visibility::Transparent);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {5, 5, 5}}, glass);
  EXPECT_TRUE(Impostor::build(grid, scene.types).empty());
}

void expect_same_level(const ImpostorFaces::Level& a, const ImpostorFaces::Level& b) {
  EXPECT_EQ(a.centre, b.centre);
  EXPECT_EQ(a.views, b.views);
  EXPECT_EQ(a.face, b.face);
  EXPECT_EQ(a.begin, b.begin);
  EXPECT_EQ(a.reach, b.reach);
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.step, b.step);
  EXPECT_EQ(a.groups.centre, b.groups.centre);
  EXPECT_EQ(a.groups.half, b.groups.half);
  EXPECT_EQ(a.groups.views, b.groups.views);
}

void expect_same(const Impostor& a, const Impostor& b) {
  ASSERT_EQ(a.empty(), b.empty());
  EXPECT_EQ(a.bounds().min, b.bounds().min);
  EXPECT_EQ(a.bounds().max, b.bounds().max);
  EXPECT_EQ(a.content().centre, b.content().centre);
  const ImpostorFaces& x = a.faces();
  const ImpostorFaces& y = b.faces();
  EXPECT_EQ(x.edge, y.edge);
  ASSERT_EQ(x.faces.size(), y.faces.size());
  int different = 0;
  for (std::size_t i = 0; i < x.faces.size(); ++i) {
    const ImpostorFaces::Face& f = x.faces[i];
    const ImpostorFaces::Face& g = y.faces[i];
    different += f.voxel != g.voxel || f.direction != g.direction || f.type != g.type || f.occlusion != g.occlusion ||
                 f.open_rays != g.open_rays;
  }
  EXPECT_EQ(different, 0);
  for (std::size_t level = 0; level < x.levels.size(); ++level) {
    SCOPED_TRACE(level);
    expect_same_level(x.levels[level], y.levels[level]);
  }
  expect_same_level(x.unseen, y.unseen);
}

void edit_a_little(Grid& grid, VoxelType types, std::mt19937& random) {
  const IBox content = grid.bounds();
  const auto within = [&](int axis) {
    const int size = content.max[axis] - content.min[axis];
    return content.min[axis] + static_cast<int>(random() % static_cast<unsigned>(size));
  };
  const IVec3 at{within(0), within(1), within(2)};
  const auto type = static_cast<VoxelType>(random() % types);
  const int size = random() % 3 == 0 ? 1 + static_cast<int>(random() % 4) : 1;
  grid.fill_box({at, at + size}, type);
}

TEST(Impostor, RebuildAfterEditEqualsNewImpostor) {
  for (unsigned seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    VoxelRegistry types = two_types();
    VoxelProperties glass;
    glass.visibility = Visibility::Transparent;
    ASSERT_TRUE(types.add(glass));
    const ImpostorOptions options{seed % 4 == 0 ? 64 : 128};
    Grid grid = blobs(seed);
    grid.fill_box({{-30, -30, -30}, {-28, -28, -28}}, 1);  // so that few edits move the content's sphere
    grid.fill_box({{60, 60, 60}, {62, 62, 62}}, 1);
    Impostor impostor = Impostor::build(grid, types, options);
    ChangeCursor cursor = grid.cursor();
    for (int round = 0; round < 6; ++round) {
      for (unsigned edits = 1 + random() % 3; edits > 0; --edits) edit_a_little(grid, 4, random);
      const Grid snapshot = grid.snapshot();
      const GridChanges changes = snapshot.changes_since(cursor);
      impostor = impostor.rebuilt(snapshot, types, changes);
      expect_same(impostor, Impostor::build(grid, types, options));
      if (HasFailure()) return;
    }
  }
}

TEST(Impostor, RebuildMatchesAfterLargeChanges) {
  const VoxelRegistry types = two_types();
  Grid grid = blobs(3);
  Impostor impostor = Impostor::build(grid, types);
  ChangeCursor cursor = grid.cursor();
  const auto expect_right = [&] {
    const GridChanges changes = grid.changes_since(cursor);
    impostor = impostor.rebuilt(grid, types, changes);
    expect_same(impostor, Impostor::build(grid, types));
  };
  expect_right();
  grid.set({90, 3, 3}, 1);  // another sphere
  expect_right();
  grid.fill_box({{0, 0, 0}, {40, 40, 40}}, kAir);
  expect_right();
  grid.set({90, 3, 3}, kAir);  // the last voxel
  expect_right();
  EXPECT_TRUE(impostor.empty());
  grid.fill_box({{0, 0, 0}, {4, 4, 4}}, 2);
  expect_right();
  GridChanges all;
  all.all = true;
  expect_same(impostor.rebuilt(grid, types, all), impostor);
}

TEST(Impostor, SmallerFacesNeedMoreTexels) {
  VoxelRegistry types = two_types();
  Grid grid;
  for (int x = 0; x < 200; x += 2) grid.fill_box({{x, 0, 0}, {x + 1, 200, 3}}, 2);
  grid.fill_box({{0, 0, 0}, {200, 200, 1}}, 1);
  const auto unseen = [&](int edge) {
    return Impostor::build(grid, types, ImpostorOptions{edge}).faces().unseen.count();
  };
  EXPECT_GT(unseen(64), unseen(512));
  // With 32 texels per side there are too many faces to store them one by one.
  const auto bytes = [&](int edge) { return Impostor::build(grid, types, ImpostorOptions{edge}).bytes(); };
  EXPECT_LT(bytes(16), bytes(64));
}

TEST(Impostor, ImagesMatchRenderer) {
  Scene scene;
  scene.types = two_types();
  place(scene, blobs(5));
  const Grid& grid = scene.grids()[scene.grids().handles()[0]].grid;
  const std::vector<ImpostorImage> images = impostor_images(grid, scene.types, ImpostorOptions{96});
  ASSERT_EQ(images.size(), 26U);
  RenderOptions options = sized(96, 96);
  options.light.shading = Shading::Unlit;
  for (std::size_t view = 0; view < images.size(); ++view) {
    const ImpostorImage& image = images[view];
    const RenderedImage truth = taken(scene, image.camera, options);
    int different = 0;
    int covered = 0;
    for (std::size_t i = 0; i < image.coverage.size(); ++i) {
      covered += image.coverage[i] == 255;
      ASSERT_EQ(image.coverage[i] == 255, std::isfinite(image.depth.values[i]));
      different += std::isfinite(truth.depth.values[i]) != (image.coverage[i] == 255);
      if (image.coverage[i] == 0 || !std::isfinite(truth.depth.values[i])) continue;
      different += std::abs(truth.depth.values[i] - image.depth.values[i]) > 1e-3F;
      different += truth.colour.rgb[3 * i] != image.colour.rgb[3 * i];
    }
    EXPECT_GT(covered, 500);
    EXPECT_LE(different, 4) << view << ": only rounding at edges may differ";
  }
  const std::vector<ImpostorImage> none = impostor_images(Grid(), scene.types, ImpostorOptions{16});
  ASSERT_EQ(none.size(), 26U);
  for (const ImpostorImage& image : none) {
    EXPECT_EQ(image.coverage, std::vector<std::uint8_t>(256, 0));
  }
}

TEST(ImpostorDeathTest, RejectsInvalidViewsAndEdges) {
  const VoxelRegistry types = two_types();
  const Grid grid = blobs(1);
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(impostor_view(kImpostorViews)), "index < kImpostorViews");
  QUOIN_EXPECT_MISTAKE(static_cast<void>(take_snapshot({&grid, &types, &tree}, -1)), "view >= 0");
  QUOIN_EXPECT_MISTAKE(static_cast<void>(take_snapshot({&grid, &types, &tree}, 0, 0)), "edge >= 1");
  QUOIN_EXPECT_MISTAKE(static_cast<void>(Impostor::build(grid, types, ImpostorOptions{8})), "edge >= 16");
}

}  // namespace
}  // namespace quoin
