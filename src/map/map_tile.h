#pragma once

#include <array>
#include <memory>
#include <optional>

#include <quoin/core/image.h>

#include "map/column_surface.h"

namespace quoin::map {

inline constexpr int kTileEdge = 256;                                  ///< pixels
inline constexpr int kTileSquares = kTileEdge / ColumnSurface::kEdge;  ///< along an edge
/// A pixel's shade depends on columns up to this far away: less than a square.
inline constexpr int kReach = 16;

/// The surfaces of a tile's squares and of those around it, by z, then x; null where there is nothing.
using TileSurfaces = std::array<std::shared_ptr<const ColumnSurface>, (kTileSquares + 2) * (kTileSquares + 2)>;

/// Draws a tile with one pixel per column: colours, darkened by relief (light from the north-west), by higher ground
/// around a column (the share of the sky that it sees within kReach), and with depth below water. Returns nullopt if
/// all of it is transparent.
[[nodiscard]] std::optional<AlphaImage> draw_tile(const TileSurfaces& surfaces);

/// Draws a tile of the next lower zoom from four of this one: upper left, upper right, lower left, lower right. Each
/// pixel is the mean of four, in linear light and weighted by alpha. Returns nullopt if all of it is transparent.
[[nodiscard]] std::optional<AlphaImage> draw_parent(const std::array<std::optional<AlphaImage>, 4>& children);

}  // namespace quoin::map
