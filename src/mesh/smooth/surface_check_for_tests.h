#pragma once

// Test fields, and checks of a mesh as a surface.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <ostream>
#include <random>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/density_grid.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin::oracle {

using Field = std::function<double(DVec3)>;

/// A grid with `field` sampled in a box, far air around it. All solid samples are of type 1.
inline DensityGrid grid_of(const IBox& box, const Field& field, float band = 8.0F) {
  DensityGrid grid(band);
  grid.edit(box, [&](IVec3 sample, DensitySample) {
    return DensitySample{static_cast<float>(field(DVec3(sample))), VoxelType{1}};
  });
  return grid;
}

inline Field sphere(DVec3 centre, double radius) {
  return [=](DVec3 p) { return glm::length(p - centre) - radius; };
}

inline IBox box_around(DVec3 centre, double radius) {
  return {IVec3(glm::floor(centre - radius)) - 2, IVec3(glm::ceil(centre + radius)) + 3};
}

/// Smooth noise of about unit slope: a few waves of random direction, `wavelength` samples long or somewhat less.
inline Field waves(unsigned seed, double wavelength, double offset = 0.0) {
  struct Wave {
    DVec3 direction;
    double phase;
  };
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Wave> all(6);
  for (Wave& wave : all) {
    DVec3 d{unit(random), unit(random), unit(random)};
    while (glm::length(d) < 0.1) d = {unit(random), unit(random), unit(random)};
    wave = {glm::normalize(d) * (6.28318530718 / wavelength * (1.5 + 0.5 * unit(random))), unit(random) * 3.2};
  }
  const double amplitude = wavelength / 8.0;
  return [=](DVec3 p) {
    double sum = offset;
    for (const Wave& wave : all) sum += amplitude * std::sin(glm::dot(wave.direction, p) + wave.phase);
    return sum;
  };
}

/// A number that looks random, of a seed and a place.
inline std::uint64_t hash_of(unsigned seed, IVec3 p) {
  std::uint64_t h = seed;
  for (int axis = 0; axis < 3; ++axis) {
    h = (h ^ static_cast<std::uint32_t>(p[axis])) * 0x9E37'79B9'7F4A'7C15U;
    h ^= h >> 29;
  }
  h *= 0xBF58'476D'1CE4'E5B9U;
  return h ^ h >> 32;
}

/// An independent random value for every sample.
inline Field scatter(unsigned seed, double solid_share = 0.5) {
  return [=](DVec3 p) {
    const std::uint64_t random = hash_of(seed, IVec3(p));
    const double size = 0.05 + 3.0 * static_cast<double>(random & 0xFFFFU) / 65536.0;
    return static_cast<double>(random >> 40) / 16777216.0 < solid_share ? -size : size;
  };
}

/// A mesh as a surface: how its triangles meet.
struct SurfaceCount {
  std::int64_t vertices = 0;  ///< vertices that a triangle uses
  std::int64_t unused_vertices = 0;
  std::int64_t edges = 0;
  std::int64_t triangles = 0;
  std::int64_t degenerate_triangles = 0;
  std::int64_t doubled_triangles = 0;  ///< with the same three vertices as another
  std::int64_t odd_edges = 0;          ///< of an odd number of triangles
  std::int64_t unbalanced_edges = 0;   ///< with not as many triangles in one direction as in the other
  std::int64_t crowded_edges = 0;      ///< of more than two triangles
  std::int64_t split_fans = 0;         ///< vertices around which the triangles form more than one fan

  [[nodiscard]] std::int64_t euler() const { return vertices - edges + triangles; }
};

inline std::ostream& operator<<(std::ostream& out, const SurfaceCount& count) {
  return out << count.triangles << " triangles, degenerate " << count.degenerate_triangles << ", doubled "
             << count.doubled_triangles << ", odd edges " << count.odd_edges << ", unbalanced "
             << count.unbalanced_edges << ", crowded " << count.crowded_edges << ", split fans " << count.split_fans
             << ", unused vertices " << count.unused_vertices << ", Euler " << count.euler();
}

namespace detail {

/// The edges along which triangles run: the lesser vertex, the other, 1 when from the other to it. Sorted.
using DirectedEdge = std::tuple<std::uint32_t, std::uint32_t, int>;

inline std::vector<DirectedEdge> edges_of(std::span<const std::uint32_t> indices) {
  std::vector<DirectedEdge> edges;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = indices[i + k];
      const std::uint32_t to = indices[i + (k + 1) % 3];
      edges.emplace_back(std::min(from, to), std::max(from, to), from > to);
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

inline void count_edges(std::span<const std::uint32_t> indices, SurfaceCount& count) {
  const std::vector<DirectedEdge> edges = edges_of(indices);
  for (std::size_t first = 0; first < edges.size();) {
    const auto [a, b, direction] = edges[first];
    std::size_t end = first;
    int backwards = 0;
    while (end < edges.size() && std::get<0>(edges[end]) == a && std::get<1>(edges[end]) == b) {
      backwards += std::get<2>(edges[end++]);
    }
    const auto uses = static_cast<int>(end - first);
    ++count.edges;
    count.odd_edges += uses % 2;
    count.unbalanced_edges += 2 * backwards != uses;
    count.crowded_edges += uses > 2;
    first = end;
  }
}

/// Vertices whose triangles are not all connected by edges at the vertex.
inline std::int64_t count_split_fans(std::span<const std::uint32_t> indices, std::size_t vertices) {
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> opposite(vertices);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      opposite[indices[i + k]].emplace_back(indices[i + (k + 1) % 3], indices[i + (k + 2) % 3]);
    }
  }
  std::int64_t split = 0;
  for (const auto& sides : opposite) {
    if (sides.empty()) continue;
    std::set<std::uint32_t> reached = {sides[0].first};
    for (bool grown = true; grown;) {
      grown = false;
      for (const auto& [a, b] : sides) {
        if (reached.count(a) == reached.count(b)) continue;
        reached.insert({a, b});
        grown = true;
      }
    }
    split += std::any_of(sides.begin(), sides.end(), [&](const auto& side) { return reached.count(side.first) == 0; });
  }
  return split;
}

}  // namespace detail

inline SurfaceCount count_surface(std::span<const std::uint32_t> indices, std::size_t vertices,
                                  bool with_fans = false) {
  SurfaceCount count;
  count.triangles = static_cast<std::int64_t>(indices.size() / 3);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<bool> used(vertices);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    std::array<std::uint32_t, 3> triangle = {indices[i], indices[i + 1], indices[i + 2]};
    for (const std::uint32_t vertex : triangle) used.at(vertex) = true;
    std::sort(triangle.begin(), triangle.end());
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2]) ++count.degenerate_triangles;
    triangles.push_back(triangle);
  }
  std::sort(triangles.begin(), triangles.end());
  count.doubled_triangles = triangles.end() - std::unique(triangles.begin(), triangles.end());
  count.vertices = std::count(used.begin(), used.end(), true);
  count.unused_vertices = static_cast<std::int64_t>(vertices) - count.vertices;
  detail::count_edges(indices, count);
  if (with_fans) count.split_fans = detail::count_split_fans(indices, vertices);
  return count;
}

inline SurfaceCount count_surface(const SmoothMesh& mesh, bool with_fans = false) {
  return count_surface(mesh.indices, mesh.positions.size(), with_fans);
}

/// Expects no open edge, and no unused vertex or degenerate triangle.
inline void expect_closed(const SurfaceCount& count) {
  EXPECT_GT(count.triangles, 0);
  EXPECT_EQ(count.odd_edges, 0) << count;
  EXPECT_EQ(count.unbalanced_edges, 0) << count;
  EXPECT_EQ(count.degenerate_triangles, 0) << count;
  EXPECT_EQ(count.unused_vertices, 0) << count;
}

/// Every edge has two triangles.
inline void expect_manifold(const SurfaceCount& count) {
  expect_closed(count);
  EXPECT_EQ(count.crowded_edges, 0) << count;
  EXPECT_EQ(count.doubled_triangles, 0) << count;
  EXPECT_EQ(count.split_fans, 0) << count;
}

/// The volume that a closed mesh encloses, positive when it faces outwards.
template <class Mesh>
double signed_volume(const Mesh& mesh) {
  double volume = 0.0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const DVec3 a(mesh.positions[mesh.indices[i]]);
    const DVec3 b(mesh.positions[mesh.indices[i + 1]]);
    const DVec3 c(mesh.positions[mesh.indices[i + 2]]);
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  return volume;
}

/// One type, of a mid-grey.
inline VoxelRegistry one_type() {
  VoxelRegistry types;
  VoxelProperties properties;
  properties.colour = {128, 128, 128, 255};
  EXPECT_TRUE(types.add(properties).has_value());
  return types;
}

/// Meshes a field or fails.
inline SmoothMesh mesh_of(const DensityGrid& grid, const SmoothMeshOptions& options) {
  auto mesh = build_smooth_mesh(grid, one_type(), options, {1});
  EXPECT_TRUE(mesh.has_value());
  return mesh ? std::move(*mesh) : SmoothMesh{};
}

}  // namespace quoin::oracle
