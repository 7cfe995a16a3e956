#include "scene/meshes/occlusion_atlas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include <quoin/grid/grid.h>
#include <quoin/mesh/occlusion.h>

#include "core/srgb.h"

namespace quoin {
namespace {

constexpr std::size_t kOpaque = static_cast<std::size_t>(SurfaceClass::Opaque);

/// A grid's opaque faces with and without occlusion, and their atlas.
struct Baked {
  BlockyTriangles split;
  BlockyTriangles merged;
  Image image;
  std::vector<std::array<float, 2>> coordinates;
};

Baked bake(const Grid& grid, const VoxelRegistry& types) {
  Baked baked;
  baked.split = build_blocky_mesh(grid, types, {}).value().surfaces[kOpaque];
  baked.merged = build_blocky_mesh(grid, types, {.bake_occlusion = false}).value().surfaces[kOpaque];
  OcclusionAtlas atlas;
  const std::size_t addition = atlas.add(baked.split, baked.merged, types);
  baked.image = atlas.draw().value();
  baked.coordinates = atlas.coordinates(addition);
  return baked;
}

VoxelRegistry three_types() {
  VoxelRegistry types;
  for (const Rgba8 colour : {Rgba8{200, 40, 10, 255}, Rgba8{30, 220, 90, 255}, Rgba8{30, 220, 90, 255}}) {
    VoxelProperties properties;
    properties.colour = colour;
    EXPECT_TRUE(types.add(properties).has_value());
  }
  return types;
}

/// Returns the result of a linear filter at a position in the texture.
std::array<double, 3> filtered(const Image& image, double u, double v) {
  const double x = u * image.width - 0.5;
  const double y = v * image.height - 0.5;
  std::array<double, 3> sum{};
  for (int i = 0; i < 4; ++i) {
    const double column = std::floor(x) + (i & 1);
    const double row = std::floor(y) + (i >> 1);
    const double share = (1.0 - std::abs(x - column)) * (1.0 - std::abs(y - row));
    if (share < 1e-4) continue;  // rounding only
    EXPECT_TRUE(column >= 0 && row >= 0 && column < image.width && row < image.height);
    const auto at =
        3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(column));
    for (std::size_t c = 0; c < 3; ++c) sum[c] += share * static_cast<double>(linear_from_srgb(image.rgb[at + c]));
  }
  return sum;
}

using FaceCorner = std::tuple<int, int, int, int>;  // position, and direction of the face

/// Calls `visit(voxel corner, occlusion level, type)` for every corner of every voxel face.
template <class Visit>
void for_corners(const BlockyTriangles& mesh, Visit visit) {
  for (std::size_t at = 0; at < mesh.positions.size(); at += 4) {
    const FaceFrame& frame = frame_of(mesh.directions[at]);
    const Vec3 lowest = mesh.positions[at];
    const Vec3 size = mesh.positions[at + 2] - lowest;
    for (int u = 0; u <= static_cast<int>(size[frame.u]); ++u) {
      for (int v = 0; v <= static_cast<int>(size[frame.v]); ++v) {
        IVec3 place(lowest);
        place[frame.u] += u;
        place[frame.v] += v;
        visit(at, static_cast<double>(u) / static_cast<double>(size[frame.u]),
              static_cast<double>(v) / static_cast<double>(size[frame.v]),
              FaceCorner{place.x, place.y, place.z, static_cast<int>(mesh.directions[at])});
      }
    }
  }
}

/// Returns the corner occlusion of the split faces, which is equal wherever two faces meet.
std::map<FaceCorner, double> levels_of(const BlockyTriangles& split) {
  std::map<FaceCorner, double> levels;
  for_corners(split, [&](std::size_t at, double u, double v, const FaceCorner& corner) {
    const auto level = [&](std::size_t i) { return static_cast<double>(split.occlusion[at + i]); };
    const double here =
        (1 - u) * (1 - v) * level(0) + u * (1 - v) * level(1) + u * v * level(2) + (1 - u) * v * level(3);
    const auto [known, is_new] = levels.emplace(corner, here);
    EXPECT_TRUE(is_new || known->second == here) << "coplanar neighbours agree";
  });
  return levels;
}

Grid random_grid(unsigned seed, int types) {
  Grid grid;
  std::mt19937 random(seed);
  for (int i = 0; i < 40; ++i) {
    const auto number = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most)); };
    const IVec3 low(number(100) - 50, number(100) - 50, number(100) - 50);
    const IVec3 size(1 + number(30), 1 + number(6), 1 + number(30));
    grid.fill_box({low, low + size}, static_cast<VoxelType>(number(types + 1)));
  }
  return grid;
}

// At every corner of every voxel, the texture has the colour times the occlusion, for any merging.
TEST(OcclusionAtlas, StoresColourTimesOcclusionAtCorners) {
  const VoxelRegistry types = three_types();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Baked baked = bake(random_grid(seed, 3), types);
    ASSERT_LT(baked.merged.positions.size(), baked.split.positions.size());
    const std::map<FaceCorner, double> levels = levels_of(baked.split);
    std::size_t checked = 0;
    double largest = 0.0;
    for_corners(baked.merged, [&](std::size_t at, double u, double v, const FaceCorner& corner) {
      const auto uv = [&](std::size_t axis) {
        const auto of = [&](std::size_t i) { return static_cast<double>(baked.coordinates[at + i][axis]); };
        return (1 - u) * (1 - v) * of(0) + u * (1 - v) * of(1) + u * v * of(2) + (1 - u) * v * of(3);
      };
      const auto shown = filtered(baked.image, uv(0), uv(1));
      const double brightness = 1.0 - 0.25 * levels.at(corner);
      const Rgba8 colour = types[baked.merged.types[at]].colour;
      const std::array<std::uint8_t, 3> channels = {colour.r, colour.g, colour.b};
      for (std::size_t c = 0; c < 3; ++c) {
        largest =
            std::max(largest, std::abs(shown[c] - brightness * static_cast<double>(linear_from_srgb(channels[c]))));
      }
      ++checked;
    });
    EXPECT_GT(checked, 1000U);
    EXPECT_LT(largest, 0.005) << "a byte of sRGB";
  }
}

TEST(OcclusionAtlas, SharesEqualPatchesAndPlainTexels) {
  const VoxelRegistry types = three_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {60, 3, 60}}, 1);
  const Baked plain = bake(grid, types);
  EXPECT_EQ(plain.merged.positions.size(), 24U);
  for (const auto& uv : plain.coordinates) EXPECT_EQ(uv, plain.coordinates.front());
  EXPECT_EQ(plain.image.height, 1);
  grid.fill_box({{30, 3, 20}, {31, 8, 40}}, 2);
  const Baked one = bake(grid, types);
  EXPECT_GT(one.image.height, 1);
  grid.fill_box({{128, 64, 0}, {188, 67, 60}}, 1);
  grid.fill_box({{158, 67, 20}, {159, 72, 40}}, 2);
  const Baked two = bake(grid, types);
  EXPECT_GT(two.coordinates.size(), one.coordinates.size());
  EXPECT_EQ(two.image.rgb, one.image.rgb) << "a second model of the same patches";
}

TEST(OcclusionAtlas, TypesOfSameColourShareTexels) {
  const VoxelRegistry types = three_types();
  Grid grid;
  grid.set({0, 0, 0}, 2);
  grid.set({5, 0, 0}, 3);
  const Baked baked = bake(grid, types);
  EXPECT_EQ(baked.coordinates.front(), baked.coordinates.back());
  grid.set({9, 0, 0}, 1);
  const Baked other = bake(grid, types);
  EXPECT_NE(other.coordinates.front(), other.coordinates.back());
}

TEST(OcclusionAtlas, EmptyGridHasNoCoordinates) {
  const Baked baked = bake(Grid(), three_types());
  EXPECT_TRUE(baked.coordinates.empty());
  EXPECT_EQ(baked.image.height, 1);
}

TEST(OcclusionAtlas, IsDeterministicWithPowerOfTwoSides) {
  const Grid grid = random_grid(9, 3);
  const Baked first = bake(grid, three_types());
  const Baked second = bake(grid, three_types());
  EXPECT_EQ(first.image.rgb, second.image.rgb);
  EXPECT_EQ(first.coordinates, second.coordinates);
  for (const int side : {first.image.width, first.image.height}) EXPECT_EQ(side & (side - 1), 0);
}

}  // namespace
}  // namespace quoin
