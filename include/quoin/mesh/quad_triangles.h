#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>

namespace [[gnu::visibility("default")]] quoin {

// Conversion of quads to vertices and triangles. All meshers, writers and renderers use these functions.

/// The order of a triangle's corners, seen from its front.
enum class Winding : std::uint8_t { CounterClockwise, Clockwise };

/// Returns the number of vertices of `quads` quads, or faces of shapes: four each.
[[nodiscard]] constexpr std::size_t vertices_needed(std::size_t quads) {
  return 4 * quads;
}
/// Returns the number of indices of `quads` quads, or faces of shapes: six each.
[[nodiscard]] constexpr std::size_t indices_needed(std::size_t quads) {
  return 6 * quads;
}

/// Corners by [flipped + 2 * clockwise]: see `triangle_corners`.
inline constexpr std::array<std::array<std::uint8_t, 6>, 4> kTriangleCorners = {
    {{0, 1, 2, 0, 2, 3}, {1, 2, 3, 0, 1, 3}, {0, 2, 1, 0, 3, 2}, {1, 3, 2, 0, 3, 1}}};

/// Returns the corners (0..3, as in FaceOcclusion) of a quad's two triangles, in index order. `flipped` is as in Quad.
[[nodiscard]] constexpr const std::array<std::uint8_t, 6>& triangle_corners(
    bool flipped, Winding winding = Winding::CounterClockwise) {
  return kTriangleCorners[std::size_t{flipped} + 2 * std::size_t{winding == Winding::Clockwise}];
}

/// Returns the positions of all four corners (see Quad::corner), each packed into a word: x in the lowest byte, then y,
/// then z; the highest byte is 0. Branch-free; reads no memory except the direction table.
[[nodiscard]] inline std::array<std::uint32_t, 4> packed_corners_of(const Quad& quad) {
  const FaceFrame& frame = frame_of(quad.direction());
  const auto bits = static_cast<std::uint32_t>(quad.bits);
  const std::uint32_t voxel = (bits & 0x3FU) | (bits << 2 & 0x3F00U) | (bits << 4 & 0x3F'0000U);
  const std::uint32_t first = voxel + (std::uint32_t{frame.sign > 0} << (8 * frame.axis));
  const std::uint32_t along_u = static_cast<std::uint32_t>(quad.size_u()) << (8 * frame.u);
  const std::uint32_t along_v = static_cast<std::uint32_t>(quad.size_v()) << (8 * frame.v);
  return {first, first + along_u, first + along_u + along_v, first + along_v};
}
/// Returns the position in a packed corner word.
[[nodiscard]] inline IVec3 unpacked_corner(std::uint32_t packed) {
  return {static_cast<int>(packed & 255U), static_cast<int>(packed >> 8 & 255U), static_cast<int>(packed >> 16)};
}
/// Returns the positions of all four corners (see Quad::corner).
[[nodiscard]] inline std::array<IVec3, 4> corners_of(const Quad& quad) {
  const std::array<std::uint32_t, 4> packed = packed_corners_of(quad);
  return {unpacked_corner(packed[0]), unpacked_corner(packed[1]), unpacked_corner(packed[2]),
          unpacked_corner(packed[3])};
}

/// One corner of a quad, as a vertex.
struct QuadVertex {
  IVec3 position{0};  ///< chunk coordinates, 0..64
  Direction direction = Direction::PosX;
  std::uint8_t corner = 0;     ///< 0..3
  std::uint8_t occlusion = 0;  ///< 0 (open) to 3 (dark)
  VoxelType type = kAir;
  /// Voxels from corner 0 along the quad's u and v (`frame_of`): texture coordinates that repeat with every voxel. +y
  /// is along u on +X and -Z, and along v on -X and +Z: docs/games.md, "Textures", keeps images upright.
  int u = 0;
  int v = 0;
};

/// Calls `write(vertex_index, const QuadVertex&)` for the four corners of every quad, in the vertex order that
/// `write_indices` expects. Use it to write vertices in a custom layout in place; it inlines to a plain loop.
template <class Write>
void for_each_vertex(std::span<const Quad> quads, Write&& write) {
  std::size_t index = 0;
  for (const Quad& quad : quads) {
    const std::array<IVec3, 4> corners = corners_of(quad);
    QuadVertex vertex;
    vertex.direction = quad.direction();
    vertex.type = quad.type();
    for (std::uint8_t corner = 0; corner < 4; ++corner) {
      vertex.position = corners[corner];
      vertex.corner = corner;
      vertex.occlusion = quad.occlusion(corner);
      vertex.u = corner == 1 || corner == 2 ? quad.size_u() : 0;
      vertex.v = corner >= 2 ? quad.size_v() : 0;
      write(index++, vertex);
    }
  }
}

/// Writes six indices per quad to the front of `out`. The first quad's vertices are `first_vertex` to `first_vertex +
/// 3`, and so on. `Index` is std::uint16_t or std::uint32_t.
///
/// Requires: `out` has `indices_needed(quads.size())` elements; `first_vertex + vertices_needed(quads.size())` is at
///           most the greatest Index. The greatest Index itself is never written: it stays free for primitive restart.
template <class Index>
void write_indices(std::span<const Quad> quads, std::size_t first_vertex, std::span<Index> out,
                   Winding winding = Winding::CounterClockwise) {
  static_assert(std::is_same_v<Index, std::uint16_t> || std::is_same_v<Index, std::uint32_t>);
  QUOIN_ASSERT(out.size() >= indices_needed(quads.size()), "out holds 6 indices per quad");
  QUOIN_ASSERT(first_vertex + vertices_needed(quads.size()) <= std::numeric_limits<Index>::max(),
               "indices fit their type");
  Index* next = out.data();
  auto base = static_cast<Index>(first_vertex);
  for (const Quad& quad : quads) {
    const std::array<std::uint8_t, 6>& corners = triangle_corners(quad.flipped(), winding);
    for (std::size_t i = 0; i < 6; ++i) next[i] = static_cast<Index>(base + corners[i]);
    next += 6;
    base = static_cast<Index>(base + 4);
  }
}

/// Writes six indices per face of a shape, as for quads. The second triangle of a face with three corners
/// (ShapeFace::is_triangle) has no area.
template <class Index>
void write_indices(std::span<const ShapeFace> faces, std::size_t first_vertex, std::span<Index> out,
                   Winding winding = Winding::CounterClockwise) {
  static_assert(std::is_same_v<Index, std::uint16_t> || std::is_same_v<Index, std::uint32_t>);
  QUOIN_ASSERT(out.size() >= indices_needed(faces.size()), "out holds 6 indices per face");
  QUOIN_ASSERT(first_vertex + vertices_needed(faces.size()) <= std::numeric_limits<Index>::max(),
               "indices fit their type");
  Index* next = out.data();
  for (const ShapeFace& face : faces) {
    const bool is_flipped = !face.is_triangle() && flips_diagonal(face.occlusion());
    for (const std::uint8_t corner : triangle_corners(is_flipped, winding)) {
      *next++ = static_cast<Index>(first_vertex + corner);
    }
    first_vertex += 4;
  }
}

/// Writes the indices of an indexed mesh (BlockyTriangles, SmoothChunkMesh, SmoothMesh), each increased by
/// `first_vertex`.
///
/// Requires: `out` is at least as long as `indices`, which has three per triangle; every sum is less than the greatest
///           Index.
template <class Index>
void write_indices(std::span<const std::uint32_t> indices, std::size_t first_vertex, std::span<Index> out,
                   Winding winding = Winding::CounterClockwise) {
  static_assert(std::is_same_v<Index, std::uint16_t> || std::is_same_v<Index, std::uint32_t>);
  QUOIN_ASSERT(indices.size() % 3 == 0 && out.size() >= indices.size(), "whole triangles, and room for them");
  const std::size_t second = winding == Winding::Clockwise ? 2 : 1;
  const auto moved = [&](std::size_t i) {
    const std::size_t index = first_vertex + indices[i];
    QUOIN_ASSERT(index < std::numeric_limits<Index>::max(), "indices fit their type");
    return static_cast<Index>(index);
  };
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    out[i] = moved(i);
    out[i + 1] = moved(i + second);
    out[i + 2] = moved(i + 3 - second);
  }
}

}  // namespace quoin
