#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/vec.h>

namespace quoin::triangles {

/// Larger polygons that are not convex are cut as if they were convex.
inline constexpr std::size_t kMostCornersOfConcave = std::size_t{1} << 14;

/// Cuts a polygon into `corners.size() - 2` triangles of its corners with the same orientation.
///
/// Convex polygons become a fan from corner 0. Others are cut ear by ear: concave polygons, and polygons whose hole is
/// connected to the outline by an edge (a keyhole). Corners may coincide or be collinear; such triangles have no area.
/// The triangles of polygons that cross themselves, or are not flat, still use each edge once.
/// Requires: finite corners. Cost: O(n) for a convex polygon, else about O(n^2).
/// Returns false if the polygon was too large and was cut as a fan.
/// Source: G. Meisters, "Polygons have ears" (1975).
bool cut_polygon(std::span<const DVec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace quoin::triangles
