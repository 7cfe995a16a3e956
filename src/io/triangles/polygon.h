#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/vec.h>

namespace quoin::triangles {

/// Polygons of more corners that are not convex are cut as convex ones are.
inline constexpr std::size_t kMostCornersOfConcave = std::size_t{1} << 14;

/// Cuts a polygon into `corners.size() - 2` triangles of its corners, which turn as it does.
///
/// Convex polygons become a fan from corner 0, others lose their ears: concave ones, and ones with a hole that an edge
/// connects with the outline (a keyhole). Corners may coincide or lie on a line; such triangles have no area. Of a
/// polygon that crosses itself, or is not flat, the triangles still use each edge once.
/// Requires: finite corners. Cost: O(n) for a convex polygon, else about O(n^2).
/// Returns false where it was too large to be cut other than as a fan.
/// Source: G. Meisters, "Polygons have ears" (1975).
bool cut_polygon(std::span<const DVec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace quoin::triangles
