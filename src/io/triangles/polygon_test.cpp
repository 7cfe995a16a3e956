#include "io/triangles/triangles.h"

#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin::triangles {

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

Triangles cut(const std::vector<DVec3>& corners) {
  Triangles triangles;
  EXPECT_TRUE(cut_polygon(corners, triangles));
  EXPECT_EQ(triangles.size(), corners.size() - 2);
  return triangles;
}

DVec3 area_of(const std::vector<DVec3>& p, const std::array<std::uint32_t, 3>& t) {
  return 0.5 * glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
}

/// Returns the sum of the triangle areas, each positive: overlaps make it larger than the polygon's own area.
double total_area(const std::vector<DVec3>& corners) {
  double sum = 0.0;
  for (const auto& triangle : cut(corners)) sum += glm::length(area_of(corners, triangle));
  return sum;
}

TEST(Polygon, KeepsAreaOfConcavePolygon) {
  const std::vector<DVec3> arrow = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 2, 0}, {0, 4, 0}};
  EXPECT_NEAR(total_area(arrow), 12.0, 1e-12);
  for (const auto& triangle : cut(arrow)) EXPECT_GE(area_of(arrow, triangle).z, 0.0);
}

TEST(Polygon, KeepsHoleOfKeyhole) {
  const std::vector<DVec3> keyhole = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 0},
                                      {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}};
  EXPECT_NEAR(total_area(keyhole), 12.0, 1e-12);
}

TEST(Polygon, KeepsAreaAndEdgesOfStars) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> radius(0.2, 3.0);
  for (int run = 0; run < 200; ++run) {
    const int count = 4 + run % 40;
    std::vector<DVec3> star;
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / count;
      const double r = radius(random);
      star.emplace_back(r * std::cos(angle), r * std::sin(angle) * 0.5, r * std::sin(angle));
    }
    if (run % 2 != 0) std::reverse(star.begin(), star.end());
    DVec3 whole(0.0);
    for (std::size_t i = 0; i < star.size(); ++i) whole += 0.5 * glm::cross(star[i], star[(i + 1) % star.size()]);
    EXPECT_NEAR(total_area(star), glm::length(whole), 1e-9) << run;
    DVec3 sum(0.0);
    for (const auto& triangle : cut(star)) sum += area_of(star, triangle);
    EXPECT_LT(glm::length(sum - whole), 1e-9) << run;
  }
}

TEST(Polygon, CutsDegenerateAndCrossingPolygons) {
  (void)cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
  (void)cut({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}});
  (void)cut({{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2, 0}});
  (void)cut({{0, 0, 0}, {4, 0, 0}, {1, 3, 0}, {2, -1, 0}, {3, 3, 0}});
}

TEST(Polygon, CutsLargePolygonsAsFan) {
  std::vector<DVec3> comb;
  for (std::size_t i = 0; i <= kMostCornersOfConcave; ++i) comb.emplace_back(double(i), i % 2 == 0 ? 0.0 : 9.0, 0.0);
  Triangles triangles;
  EXPECT_FALSE(cut_polygon(comb, triangles));
  EXPECT_EQ(triangles.size(), comb.size() - 2);
}

}  // namespace

}  // namespace quoin::triangles
