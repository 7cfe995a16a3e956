// Faces of single voxels, with corners that depend on the eight voxels around them:
//
//        6 ---- 7      a corner's voxels, by bits x, y, z. Between two voxels that differ in one bit is one of its
//       /|     /|      twelve faces. Faces that share an edge at the corner are joined to sheets. A corner has one
//      2 ---- 3 |      vertex per sheet. On an edge with four faces, the two faces of the same solid voxel are
//      | 4 ---| 5      joined.
//      0 ---- 1

#include <quoin/mesh/blocky.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "mesh/nets/sheets.h"

namespace quoin {

namespace print {

namespace {

constexpr unsigned kCells = 8;

bool is_set(unsigned bits, unsigned cell) {
  return (bits >> cell & 1U) != 0;
}

/// Sheets of the faces around a corner, as disjoint sets.
class Sheets {
 public:
  Sheets() { std::iota(parent_.begin(), parent_.end(), 0U); }
  unsigned of(unsigned face) {
    while (parent_[face] != face) face = parent_[face];
    return face;
  }
  void join(unsigned a, unsigned b) { parent_[of(a)] = of(b); }

 private:
  std::array<unsigned, kCornerFaces> parent_{};
};

/// Joins the faces at one of the six edges from a corner: the edge towards the greater or lesser side of an axis.
void join_at_edge(unsigned solid, unsigned axis, unsigned side, Sheets& sheets) {
  const unsigned u = 1U << ((axis + 1) % 3);
  const unsigned v = 1U << ((axis + 2) % 3);
  const unsigned first = side << axis;
  // The four voxels around the edge, in order; face i is between voxels i and i + 1.
  const std::array<unsigned, 4> cells = {first, first | u, first | u | v, first | v};
  const auto face = [&](unsigned i) { return corner_face(cells[i % 4], i % 2 == 0 ? (axis + 1) % 3 : (axis + 2) % 3); };
  std::array<unsigned, 4> shown{};
  unsigned count = 0;
  for (unsigned i = 0; i < 4; ++i) {
    if (is_set(solid, cells[i]) != is_set(solid, cells[(i + 1) % 4])) shown[count++] = i;
  }
  if (count == 2) sheets.join(face(shown[0]), face(shown[1]));
  if (count != 4) return;
  // Voxel i has the faces i - 1 and i.
  for (unsigned i = 0; i < 4; ++i) {
    if (is_set(solid, cells[i])) sheets.join(face(i + 3), face(i));
  }
}

/// Returns the direction from a corner to the middle of a cell around it.
Vec3 towards(unsigned cell) {
  return {is_set(cell, 0) ? 1.0F : -1.0F, is_set(cell, 1) ? 1.0F : -1.0F, is_set(cell, 2) ? 1.0F : -1.0F};
}

/// The solid voxels and the open voxels adjacent to a sheet.
struct Sides {
  unsigned solid = 0;
  unsigned open = 0;
};

Vec3 mean_of(unsigned cells) {
  Vec3 sum(0.0F);
  for (unsigned cell = 0; cell < kCells; ++cell) {
    if (is_set(cells, cell)) sum += towards(cell);
  }
  return sum;
}

CornerOffsets offsets_of(unsigned solid) {
  Sheets sheets;
  for (unsigned axis = 0; axis < 3; ++axis) {
    for (unsigned side = 0; side < 2; ++side) join_at_edge(solid, axis, side, sheets);
  }
  std::array<Sides, kCornerFaces> sides{};
  for (unsigned cell = 0; cell < kCells; ++cell) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned other = cell ^ (1U << axis);
      if (!is_set(solid, cell) || is_set(solid, other)) continue;
      Sides& of = sides[sheets.of(corner_face(cell, axis))];
      of.solid |= 1U << cell;
      of.open |= 1U << other;
    }
  }
  unsigned count = 0;
  unsigned seen = 0;
  bool shares_solid = false;
  for (const Sides& each : sides) {
    if (each.solid == 0) continue;
    ++count;
    shares_solid |= (seen & each.solid) != 0;
    seen |= each.solid;
  }
  CornerOffsets offsets{};
  if (count < 2) return offsets;
  for (unsigned face = 0; face < kCornerFaces; ++face) {
    const Sides& of = sides[sheets.of(face)];
    if (of.solid == 0) continue;
    // Moves the sheets apart, each towards the voxels that belong to it alone.
    const Vec3 away = mean_of(shares_solid ? of.open : of.solid);
    offsets[face] = glm::length(away) > 0.0F ? glm::normalize(away) * kSheetOffset : Vec3(0.0F);
  }
  return offsets;
}

}  // namespace

const std::array<CornerOffsets, 256>& corner_offsets() {
  static const std::array<CornerOffsets, 256> all = [] {
    std::array<CornerOffsets, 256> made{};
    for (unsigned solid = 0; solid < made.size(); ++solid) made[solid] = offsets_of(solid);
    return made;
  }();
  return all;
}

}  // namespace print

namespace {

using print::corner_face;
using print::CornerOffsets;

/// The voxels around a voxel: bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1) is set for voxels that are not air.
class Around {
 public:
  Around(GridReader& reader, IVec3 voxel) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 at = voxel + IVec3(i % 3, i / 3 % 3, i / 9) - 1;
      if (reader.get(at) != kAir) bits_ |= 1U << static_cast<unsigned>(i);
    }
  }
  [[nodiscard]] bool is_solid(IVec3 from) const {
    QUOIN_ASSERT((IBox{IVec3(-1), IVec3(2)}.contains(from)), "the voxel or one of its 26 neighbours");
    return (bits_ >> static_cast<unsigned>((from.x + 1) + 3 * (from.y + 1) + 9 * (from.z + 1)) & 1U) != 0;
  }
  /// Returns the eight voxels around a corner of the voxel; the corner is 0 or 1 along each axis.
  [[nodiscard]] unsigned corner(IVec3 corner) const {
    unsigned solid = 0;
    for (int cell = 0; cell < 8; ++cell) {
      const IVec3 from = corner - 1 + IVec3(cell & 1, cell >> 1 & 1, cell >> 2);
      solid |= static_cast<unsigned>(is_solid(from)) << static_cast<unsigned>(cell);
    }
    return solid;
  }

 private:
  std::uint32_t bits_ = 0;
};

struct Face {
  Direction direction;
  int axis;
  int side;  // 1: greater
};

constexpr std::array<Face, 6> kFaces = {{{Direction::NegX, 0, 0},
                                         {Direction::PosX, 0, 1},
                                         {Direction::NegY, 1, 0},
                                         {Direction::PosY, 1, 1},
                                         {Direction::NegZ, 2, 0},
                                         {Direction::PosZ, 2, 1}}};

/// Returns corner i of a face, counter-clockwise from outside: 0 or 1 along each axis.
IVec3 corner_of(const Face& face, int i) {
  QUOIN_ASSERT(i >= 0 && i < 4, "0 <= i < 4");
  const int u = (face.axis + 1) % 3;
  const int v = (face.axis + 2) % 3;
  const int step = face.side == 1 ? i : 3 - i;
  IVec3 corner(0);
  corner[face.axis] = face.side;
  corner[u] = step == 1 || step == 2 ? 1 : 0;
  corner[v] = step >= 2 ? 1 : 0;
  return corner;
}

class SurfaceMaker {
 public:
  explicit SurfaceMaker(const Grid& grid) : reader_(grid) {}

  void add(IVec3 voxel, VoxelType type) {
    const Around around(reader_, voxel);
    for (const Face& face : kFaces) {
      IVec3 out(0);
      out[face.axis] = 2 * face.side - 1;
      if (!around.is_solid(out)) add_face(voxel, type, face, out, around);
    }
  }
  [[nodiscard]] bool is_full() const { return made_.positions.size() > std::numeric_limits<std::uint32_t>::max() - 64; }
  [[nodiscard]] BlockyTriangles take() { return std::move(made_); }

 private:
  void add_face(IVec3 voxel, VoxelType type, const Face& face, IVec3 out, const Around& around) {
    const auto first = static_cast<std::uint32_t>(made_.positions.size());
    std::uint32_t count = 0;
    const auto put = [&](Vec3 at) {
      made_.positions.push_back(at);
      made_.directions.push_back(face.direction);
      made_.types.push_back(type);
      ++count;
    };
    for (int i = 0; i < 4; ++i) {
      const IVec3 corner = corner_of(face, i);
      const IVec3 next = corner_of(face, (i + 1) % 4);
      // This voxel is on the lesser side of its greater corners.
      const unsigned cell = static_cast<unsigned>((1 - corner.x) | (1 - corner.y) << 1 | (1 - corner.z) << 2);
      const CornerOffsets& offsets = print::corner_offsets()[around.corner(corner)];
      // Adds integers first, so that all voxels around a corner compute the same bits.
      put(Vec3(voxel + corner) + offsets[corner_face(cell, static_cast<unsigned>(face.axis))]);
      // The side of the face with the edge to the next corner.
      IVec3 side(0);
      for (int axis = 0; axis < 3; ++axis) {
        if (axis != face.axis && corner[axis] == next[axis]) side[axis] = 2 * corner[axis] - 1;
      }
      if (around.is_solid(side) || !around.is_solid(side + out)) continue;
      put(0.5F * Vec3(2 * voxel + corner + next) - glm::normalize(Vec3(side + out)) * kSheetOffset);
    }
    if (count == 4) {
      for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) made_.indices.push_back(first + i);
      return;
    }
    put(0.5F * Vec3(2 * voxel + corner_of(face, 0) + corner_of(face, 2)));
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
      for (const std::uint32_t j : {i, (i + 1) % (count - 1), count - 1}) made_.indices.push_back(first + j);
    }
  }

  GridReader reader_;
  BlockyTriangles made_;
};

}  // namespace

Result<BlockyTriangles> closed_surface(const Grid& grid, const Progress& progress) {
  // The range in which floats are precise enough for the small offsets.
  constexpr int kFarthest = 1 << 16;
  const IBox bounds = grid.bounds();
  for (int axis = 0; axis < 3; ++axis) {
    if (bounds.min[axis] < -kFarthest || bounds.max[axis] > kFarthest) {
      return make_error(
          ErrorCode::LimitExceeded,
          "voxel coordinates must be -65,536 to 65,536: floats cannot separate touching parts beyond that");
    }
  }
  SurfaceMaker maker(grid);
  std::array<VoxelType, kChunkEdge> row{};
  const std::vector<IVec3> chunks = grid.chunks();
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    const Chunk& chunk = *grid.find_chunk(chunks[i]);
    const IBox solid = chunk.bounds();
    for (int z = solid.min.z; z < solid.max.z; ++z) {
      for (int y = solid.min.y; y < solid.max.y; ++y) {
        chunk.read_row(y, z, row);
        for (int x = solid.min.x; x < solid.max.x; ++x) {
          const VoxelType type = row[static_cast<std::size_t>(x)];
          if (type != kAir) maker.add(chunks[i] * kChunkEdge + IVec3(x, y, z), type);
        }
      }
      if (maker.is_full()) return make_error(ErrorCode::LimitExceeded, "the surface has more than 2^32 vertices");
    }
    if (progress && !progress(static_cast<double>(i + 1) / static_cast<double>(chunks.size()))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
  }
  return maker.take();
}

}  // namespace quoin
