#include "voxelize/nearest.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "voxelize/nearest_kernel.h"

namespace quoin::voxelizing {

namespace {

/// An edge, and the direction within the triangle's plane that points inwards from it.
struct Edge {
  Vec3 from{0.0F};
  Vec3 along{0.0F};
  Vec3 inwards{0.0F};
  float per_square = 0.0F;  // 1 / squared length; 0 for an edge of length 0
};

/// A triangle relative to a chunk.
struct Solid {
  std::array<Edge, 3> edges;
  Vec3 normal{0.0F};  // unit, or 0 for a triangle without area
  Vec3 low{0.0F};
  Vec3 high{0.0F};

  explicit Solid(const Corners& corners) {
    DVec3 n = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    const double length = glm::length(n);
    n = length > 1e-12 ? n / length : DVec3(0.0);
    normal = Vec3(n);
    for (std::size_t i = 0; i < 3; ++i) {
      const DVec3 along = corners[i == 2 ? 0 : i + 1] - corners[i];
      const double square = glm::dot(along, along);
      edges[i] = {Vec3(corners[i]), Vec3(along), Vec3(glm::cross(n, along)),
                  square > 1e-24 ? static_cast<float>(1.0 / square) : 0.0F};
    }
    low = Vec3(glm::min(glm::min(corners[0], corners[1]), corners[2]));
    high = Vec3(glm::max(glm::max(corners[0], corners[1]), corners[2]));
  }
};

/// A row of centres (i + 0.5, y, z).
TriangleInRow in_row(const Solid& solid, float y, float z, std::uint32_t number) {
  TriangleInRow row{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Edge& edge = solid.edges[i];
    const Vec3 at = Vec3(0.5F, y, z) - edge.from;
    row.edges[i] = {at.x,
                    at.y,
                    at.z,
                    edge.along.x,
                    edge.along.y,
                    edge.along.z,
                    edge.per_square,
                    at.x * edge.along.x + at.y * edge.along.y + at.z * edge.along.z,
                    at.x * edge.inwards.x + at.y * edge.inwards.y + at.z * edge.inwards.z,
                    edge.inwards.x};
  }
  const EdgeInRow& first = row.edges[0];
  row.plane = first.at_x * solid.normal.x + first.at_y * solid.normal.y + first.at_z * solid.normal.z;
  row.plane_x = solid.normal.x;
  row.flat = solid.normal == Vec3(0.0F) ? 1.0F : 0.0F;
  row.number = static_cast<std::int32_t>(number);
  return row;
}

/// Returns the range along x in which the plane is within reach of a row, clipped to [first, end).
void cut_by_plane(const Solid& solid, float y, float z, float reach, int& first, int& end) {
  const Vec3 n = solid.normal;
  const float rest =
      (y - solid.edges[0].from.y) * n.y + (z - solid.edges[0].from.z) * n.z - solid.edges[0].from.x * n.x;
  if (std::abs(n.x) < 1e-3F) {
    // Parallel to the plane: takes all or none of the row, with a margin for the slope.
    if (std::abs(rest) > reach + 0.1F + std::abs(n.x) * 2.0F * kChunkEdge) end = first;
    return;
  }
  const float one = (-reach - rest) / n.x;
  const float other = (reach - rest) / n.x;
  const float low = std::clamp(std::min(one, other) - 1.0F, -1.0F, kChunkEdge + 1.0F);
  const float high = std::clamp(std::max(one, other) + 1.0F, -1.0F, kChunkEdge + 1.0F);
  first = std::max(first, static_cast<int>(std::floor(low)));
  end = std::min(end, static_cast<int>(std::ceil(high)));
}

/// As the kernel's function, only at points with a surface.
template <class HasSurface>
void update_with_holes(const TriangleInRow& row, int first, int end, float* squared, std::int32_t* numbers,
                       const HasSurface& has_surface) {
  QUOIN_ASSERT(first >= 0 && first < end && end <= kChunkEdge, "0 <= first < end <= 64");
  std::array<float, kChunkEdge> own;
  std::array<std::int32_t, kChunkEdge> own_numbers;
  std::copy_n(squared, kChunkEdge, own.begin());
  std::copy_n(numbers, kChunkEdge, own_numbers.begin());
  kernel().update_row(row, first, end, own.data(), own_numbers.data());
  for (int x = 0; x < kChunkEdge; ++x) {
    const auto at = static_cast<std::size_t>(x);
    if (!(own[at] < squared[x]) || !has_surface(x)) continue;
    squared[x] = own[at];
    numbers[x] = own_numbers[at];
  }
}

float gap(float at, float low, float high) {
  return at < low ? low - at : (at > high ? at - high : 0.0F);
}

}  // namespace

DVec3 nearest_shares(const Corners& corners, DVec3 point) {
  const DVec3 ab = corners[1] - corners[0];
  const DVec3 ac = corners[2] - corners[0];
  const DVec3 ap = point - corners[0];
  const double d1 = glm::dot(ab, ap);
  const double d2 = glm::dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
  const DVec3 bp = point - corners[1];
  const double d3 = glm::dot(ab, bp);
  const double d4 = glm::dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double share = d1 / (d1 - d3);
    return {1.0 - share, share, 0.0};
  }
  const DVec3 cp = point - corners[2];
  const double d5 = glm::dot(ab, cp);
  const double d6 = glm::dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double share = d2 / (d2 - d6);
    return {1.0 - share, 0.0, share};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0, 1.0 - share, share};
  }
  const double whole = va + vb + vc;
  return {va / whole, vb / whole, vc / whole};
}

void find_nearest(const Frame& frame, IVec3 chunk, std::span<const std::uint32_t> triangles, const Wanted& wanted,
                  const Holes& holes, Nearest& nearest) {
  QUOIN_ASSERT(wanted.reach > 0.0F && std::isfinite(wanted.reach), "a positive, finite reach");
  nearest.squared.assign(kChunkVoxels, wanted.reach * wanted.reach);
  nearest.triangles.assign(kChunkVoxels, kNoTriangle);
  const DVec3 origin = DVec3(chunk) * static_cast<double>(kChunkEdge);
  const float reach = wanted.reach;
  const Kernel& use = kernel();
  for (const std::uint32_t triangle : triangles) {
    const Corners placed = frame.corners(triangle);
    const Solid solid({placed[0] - origin, placed[1] - origin, placed[2] - origin});
    const bool has_holes = holes.may_have_holes(triangle);
    // Centres are half a voxel beyond the voxels' corners.
    const IVec3 least = glm::max(voxel_of(DVec3(solid.low - reach - 0.5F)), IVec3(0));
    const IVec3 end = glm::min(voxel_of(DVec3(solid.high + reach - 0.5F)) + 1, IVec3(kChunkEdge));
    for (int z = least.z; z < end.z; ++z) {
      const float at_z = static_cast<float>(z) + 0.5F;
      const float gap_z = gap(at_z, solid.low.z, solid.high.z);
      for (int y = least.y; y < end.y; ++y) {
        const float at_y = static_cast<float>(y) + 0.5F;
        const float gap_y = gap(at_y, solid.low.y, solid.high.y);
        if (gap_y * gap_y + gap_z * gap_z > reach * reach) continue;
        int first_x = least.x;
        int end_x = end.x;
        cut_by_plane(solid, at_y, at_z, reach, first_x, end_x);
        if (first_x >= end_x) continue;
        if (wanted.voxels != nullptr && ((*wanted.voxels)[row_of(y, z)] & bits_between(first_x, end_x)) == 0) continue;
        float* squared = nearest.squared.data() + row_of(y, z) * kChunkEdge;
        std::int32_t* numbers = nearest.triangles.data() + row_of(y, z) * kChunkEdge;
        const TriangleInRow row = in_row(solid, at_y, at_z, triangle);
        if (!has_holes) {
          use.update_row(row, first_x, end_x, squared, numbers);
          continue;
        }
        update_with_holes(row, first_x, end_x, squared, numbers, [&](int x) {
          return holes.has_surface(triangle, nearest_shares(placed, origin + DVec3(x + 0.5, y + 0.5, z + 0.5)));
        });
      }
    }
  }
}

}  // namespace quoin::voxelizing
