#pragma once

// The rays of all benchmarks, of Quoin and its peers. All mathematics in double.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

#include "bench/workloads.h"

namespace quoin::workloads {

struct RayQuery {
  Ray ray;
  double max_t = std::numeric_limits<double>::infinity();
};

/// The workload's expected hits and their tolerance: a plain tracer in double precision counts 118,583, 86,210 and
/// 242,778.
inline constexpr int kPrimaryHits = 118'582;
inline constexpr int kShadowHits = 86'217;
inline constexpr int kOcclusionHits = 242'773;
/// Expected hits of rays/random600, counted by a dense tracer in double.
inline constexpr int kRandomHits = 11'153;
inline constexpr int kHitTolerance = 30;

/// rays/{primary,shadow,ao}: an image of the 256x128x256 terrain, and its shading rays. Each 16 consecutive rays of
/// `primary` are a tile of 4x4 pixels.
struct RayWorkload {
  Grid grid;
  VoxelRegistry types = three_types();
  OccupancyTree tree;
  std::vector<RayQuery> primary;
  std::vector<RayQuery> shadow;
  std::vector<RayQuery> occlusion;
};

/// Terrain of one type with the given width and depth.
inline Grid terrain_grid(int width, int depth) {
  std::vector<int> heights;
  for (int z = 0; z < depth; ++z) {
    for (int x = 0; x < width; ++x) heights.push_back(static_cast<int>(height(x, z)));
  }
  Grid grid;
  grid.edit({IVec3{0}, IVec3{width, 128, depth}}, [&](IVec3 v, VoxelType) {
    return static_cast<VoxelType>(v.y <= heights[static_cast<std::size_t>(v.z * width + v.x)]);
  });
  return grid;
}

namespace detail {

inline constexpr int kRayColumns = 640;
inline constexpr int kRayRows = 360;

inline std::vector<RayQuery> camera_rays() {
  const DVec3 eye{20, 90, 20};
  const DVec3 forward = glm::normalize(DVec3{128, 40, 128} - eye);
  const DVec3 right = glm::normalize(glm::cross(forward, DVec3{0, 1, 0}));
  const DVec3 up = glm::cross(right, forward);
  const double half = std::tan(70.0 * std::numbers::pi / 360.0);
  std::vector<RayQuery> rays;
  for (int tile = 0; tile < kRayColumns * kRayRows / 16; ++tile) {
    for (int i = 0; i < 16; ++i) {
      const int column = tile % (kRayColumns / 4) * 4 + i % 4;
      const int row = tile / (kRayColumns / 4) * 4 + i / 4;
      const double x = ((column + 0.5) / kRayColumns * 2 - 1) * half * kRayColumns / kRayRows;
      const double y = (1 - (row + 0.5) / kRayRows * 2) * half;
      rays.push_back({{eye, glm::normalize(forward + right * x + up * y)}});
    }
  }
  return rays;
}

/// A shadow ray and six occlusion rays from the surface point of a pixel of `camera_rays`.
inline void add_rays_from(const Ray& ray, double t, const DVec3& n, std::size_t index, std::vector<RayQuery>& shadow,
                          std::vector<RayQuery>& occlusion) {
  // The normal's largest axis, and the next two made perpendicular to the normal.
  int axis = std::abs(n.y) > std::abs(n.x) ? 1 : 0;
  if (std::abs(n.z) > std::abs(n[axis])) axis = 2;
  DVec3 tangent{0};
  tangent[(axis + 1) % 3] = 1;
  tangent = glm::normalize(tangent - n * glm::dot(n, tangent));
  const DVec3 bitangent = glm::cross(n, tangent) * (n[axis] > 0 ? 1.0 : -1.0);
  const DVec3 origin = ray.origin + ray.direction * t + n * 0.001;
  shadow.push_back({{origin, glm::normalize(DVec3{0.371, 0.743, 0.223})}});
  const std::size_t tile = index / 16;
  const std::size_t column = tile % (kRayColumns / 4) * 4 + index % 4;
  const std::size_t row = tile / (kRayColumns / 4) * 4 + index % 16 / 4;
  const auto pixel = static_cast<std::uint32_t>(row * kRayColumns + column);
  const double xi = static_cast<double>(pixel * 2654435761U) / 4294967296.0;
  for (int s = 0; s < 6; ++s) {
    const double sin2 = (s + 0.5) / 6;
    const double phi = 2 * std::numbers::pi * (s + xi) / 6;
    const double r = std::sqrt(sin2);
    const DVec3 d = n * std::sqrt(1 - sin2) + tangent * (r * std::cos(phi)) + bitangent * (r * std::sin(phi));
    occlusion.push_back({{origin, d}, 6.0});
  }
}

}  // namespace detail

/// Created on the first call, then shared.
inline const RayWorkload& ray_workload() {
  static const RayWorkload shared = [] {
    RayWorkload w;
    w.grid = terrain_grid(256, 256);
    w.tree = OccupancyTree::build(w.grid, w.types);
    w.primary = detail::camera_rays();
    for (std::size_t i = 0; i < w.primary.size(); ++i) {
      const Ray& ray = w.primary[i].ray;
      const auto hit = first_hit(w.tree, ray);
      if (hit) detail::add_rays_from(ray, hit->t, DVec3(normal_of(hit->face)), i, w.shadow, w.occlusion);
    }
    return w;
  }();
  return shared;
}

/// The rays of `ray_workload`, shuffled so that neighbours are unrelated. Created on the first call.
struct ShuffledRays {
  std::vector<RayQuery> primary;
  std::vector<RayQuery> shadow;
  std::vector<RayQuery> occlusion;
};

/// rays/random600: the same terrain with 2048x2048 columns, and rays from just above it in all directions.
struct RandomRayWorkload {
  static constexpr int kWidth = 2'048;
  Grid grid = terrain_grid(kWidth, kWidth);
  VoxelRegistry types = three_types();
  OccupancyTree tree = OccupancyTree::build(grid, types);
  std::vector<RayQuery> rays;
};

namespace detail {

/// xorshift64: integers, and doubles from 0 to 1.
class FixedRandom {
 public:
  double next() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    state_ ^= state_ << 17;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_ = 42;
};

/// Returns a random unit vector: the first point of the cube that lies in the ball, normalised.
inline DVec3 random_direction(FixedRandom& random) {
  for (;;) {
    const double x = 2 * random.next() - 1;
    const double y = 2 * random.next() - 1;
    const double z = 2 * random.next() - 1;
    const double square = x * x + y * y + z * z;
    if (square <= 1.0 && square > 1e-6) return DVec3{x, y, z} / std::sqrt(square);
  }
}

}  // namespace detail

inline const ShuffledRays& shuffled_rays() {
  static const ShuffledRays shared = [] {
    const RayWorkload& in_order = ray_workload();
    ShuffledRays rays{in_order.primary, in_order.shadow, in_order.occlusion};
    detail::FixedRandom random;
    for (std::vector<RayQuery>* each : {&rays.primary, &rays.shadow, &rays.occlusion}) {
      for (std::size_t left = each->size(); left > 1; --left) {
        std::swap((*each)[left - 1], (*each)[static_cast<std::size_t>(random.next() * static_cast<double>(left))]);
      }
    }
    return rays;
  }();
  return shared;
}

/// 20,000 rays from 1 to 20 units above the surface, up to 600 units long. Created on the first call, then shared.
inline const RandomRayWorkload& random_ray_workload() {
  static const RandomRayWorkload shared = [] {
    RandomRayWorkload w;
    detail::FixedRandom random;
    for (int i = 0; i < 20'000; ++i) {
      const double x = random.next() * RandomRayWorkload::kWidth;
      const double z = random.next() * RandomRayWorkload::kWidth;
      const double surface = height(std::floor(x), std::floor(z)) + 1;
      const DVec3 origin{x, surface + 1 + 19 * random.next(), z};
      w.rays.push_back({{origin, detail::random_direction(random)}, 600.0});
    }
    return w;
  }();
  return shared;
}

/// Splits the rays into packets of 16, in order.
inline std::vector<RayPacket> ray_packets(const std::vector<RayQuery>& rays) {
  std::vector<RayPacket> packets((rays.size() + 15) / 16);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    packets[i / 16].set(static_cast<int>(i % 16), rays[i].ray, rays[i].max_t);
  }
  return packets;
}

}  // namespace quoin::workloads
