#include "render/light/corner_light.h"

#include <array>
#include <random>

#include <gtest/gtest.h>

#include "mesh/blocky/blocky_mesher.h"

namespace quoin {
namespace {

// Interpolates by barycentric coordinates in the mesh triangle that contains the point.
double occlusion_by_triangles(const FaceOcclusion& corners, double u, double v) {
  constexpr double kU[] = {0, 1, 1, 0};
  constexpr double kV[] = {0, 0, 1, 1};
  const std::array<std::array<std::size_t, 3>, 2> triangles =
      flips_diagonal(corners) ? std::array<std::array<std::size_t, 3>, 2>{{{1, 2, 3}, {0, 1, 3}}}
                              : std::array<std::array<std::size_t, 3>, 2>{{{0, 1, 2}, {0, 2, 3}}};
  for (const auto& [a, b, c] : triangles) {
    const double area = (kU[b] - kU[a]) * (kV[c] - kV[a]) - (kU[c] - kU[a]) * (kV[b] - kV[a]);
    const double at_b = ((u - kU[a]) * (kV[c] - kV[a]) - (kU[c] - kU[a]) * (v - kV[a])) / area;
    const double at_c = ((kU[b] - kU[a]) * (v - kV[a]) - (u - kU[a]) * (kV[b] - kV[a])) / area;
    if (at_b < -1e-9 || at_c < -1e-9 || at_b + at_c > 1.0 + 1e-9) continue;
    return corners[a] * (1.0 - at_b - at_c) + corners[b] * at_b + corners[c] * at_c;
  }
  ADD_FAILURE() << "no triangle holds the point";
  return 0.0;
}

TEST(CornerLight, MatchesMeshOcclusionEverywhere) {
  VoxelRegistry types;
  VoxelProperties properties;
  ASSERT_TRUE(types.add(properties).has_value());
  properties.visibility = Visibility::Transparent;
  ASSERT_TRUE(types.add(properties).has_value());
  ASSERT_TRUE(types.add({.name = "an opaque type that does not occlude", .occludes = false}).has_value());
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Grid grid;
  // Spans the corner of eight chunks.
  const IBox box{IVec3{-6}, IVec3{6}};
  grid.edit(box, [&](IVec3, VoxelType) { return static_cast<VoxelType>(random() % 4 < 2 ? random() % 4 : 0); });
  GridReader reader(grid);
  double sum = 0.0;
  for (int i = 0; i < 50'000; ++i) {
    const auto coordinate = [&] { return static_cast<int>(random() % 12) - 6; };
    const IVec3 voxel{coordinate(), coordinate(), coordinate()};
    const Direction face = kDirections[random() % 6];
    const FaceFrame& frame = frame_of(face);
    const double u = share(random);
    const double v = share(random);
    DVec3 position(voxel);
    position[frame.u] += u;
    position[frame.v] += v;
    if (frame.sign > 0) position[frame.axis] += 1.0;
    const IVec3 chunk = chunk_of(voxel);
    const FaceOcclusion corners = face_occlusion(grid.neighbourhood(chunk), types, local_of(voxel), face);
    ASSERT_EQ(corner_occlusion(reader, types, voxel, face), corners);
    const float occlusion = occlusion_at(corners, voxel, face, position);
    ASSERT_NEAR(occlusion, occlusion_by_triangles(corners, u, v), 1e-5);
    sum += occlusion;
  }
  EXPECT_GT(sum, 10'000.0) << "the world has occlusion at all";
}

TEST(CornerLight, IsExactAtCorners) {
  for (int code = 0; code < 256; ++code) {
    const FaceOcclusion corners = {static_cast<std::uint8_t>(code & 3), static_cast<std::uint8_t>(code >> 2 & 3),
                                   static_cast<std::uint8_t>(code >> 4 & 3), static_cast<std::uint8_t>(code >> 6)};
    EXPECT_EQ(interpolated_occlusion(corners, 0, 0), corners[0]);
    EXPECT_EQ(interpolated_occlusion(corners, 1, 0), corners[1]);
    EXPECT_EQ(interpolated_occlusion(corners, 1, 1), corners[2]);
    EXPECT_EQ(interpolated_occlusion(corners, 0, 1), corners[3]);
  }
}

}  // namespace
}  // namespace quoin
