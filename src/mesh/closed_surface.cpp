// Faces of single voxels, with corners that depend on the eight voxels around them:
//
//        6 ---- 7      a corner's voxels, by bits x, y, z. Between two voxels that differ in one bit is one of its
//       /|     /|      twelve faces. Faces that share an edge at the corner are joined to sheets. A corner has one
//      2 ---- 3 |      vertex per sheet. On an edge with four faces, the two faces of the same solid voxel are
//      | 4 ---| 5      joined.
//      0 ---- 1

#include <quoin/mesh/blocky.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include <glm/common.hpp>
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

/// The sixteenths of a voxel that shapes fill: bit x of [y + 16 z].
struct FilledCell {
  VoxelType type = kAir;
  std::array<std::uint16_t, 256> bits{};
};
using FilledCells = std::unordered_map<IVec3, FilledCell, CoordinateHash>;

bool has_volume(const ModelBox& box) {
  return box.max.x > box.min.x && box.max.y > box.min.y && box.max.z > box.min.z;
}

/// Fills the sixteenths whose centres lie in a box of a shape at a voxel.
void fill(const ModelBox& box, const ShapeModel& model, IVec3 voxel, VoxelType type, FilledCells& cells) {
  constexpr float kUnit = kShapeUnits;
  const auto contains = [&](const Vec3& p) {
    const Vec3 from = p - box.origin;
    const Vec3 own = box.is_turned ? Vec3(glm::dot(box.inverse[0], from), glm::dot(box.inverse[1], from),
                                          glm::dot(box.inverse[2], from))
                                   : p;
    return glm::all(glm::greaterThanEqual(own, box.min)) && glm::all(glm::lessThanEqual(own, box.max));
  };
  const IVec3 first(glm::floor((box.is_turned ? model.min : box.min) * kUnit));
  const IVec3 last(glm::ceil((box.is_turned ? model.max : box.max) * kUnit));
  for (int z = first.z; z < last.z; ++z) {
    for (int y = first.y; y < last.y; ++y) {
      for (int x = first.x; x < last.x; ++x) {
        if (!contains((Vec3(x, y, z) + 0.5F) / kUnit)) continue;
        const IVec3 at = IVec3(x, y, z) + kShapeUnits;  // not negative
        FilledCell& cell = cells[voxel + at / kShapeUnits - 1];
        if (cell.type == kAir) cell.type = type;
        const IVec3 in = at % kShapeUnits;
        cell.bits[static_cast<std::size_t>(in.y + kShapeUnits * in.z)] |= static_cast<std::uint16_t>(1U << in.x);
      }
    }
  }
}

/// Finds the sixteenths that shapes fill. Voxels with shapes have an entry, even if nothing is filled.
FilledCells filled_cells(const Grid& grid, const VoxelRegistry& types, std::int64_t& flat) {
  FilledCells cells;
  if (!types.has_shapes()) return cells;
  grid.for_each([&](IVec3 voxel, VoxelType type) {
    if (!types.is_shaped(type)) return;
    const ShapeModel& model = *shape_at(grid, types, voxel);
    FilledCell& own = cells[voxel];
    own.type = type;
    for (std::size_t i = 0; i < own.bits.size(); ++i) own.bits[i] |= model.bits[i];  // of fluids, too
    bool is_flat = false;
    for (const ModelBox& box : model.boxes) {
      if (has_volume(box)) fill(box, model, voxel, type, cells);
      is_flat |= !has_volume(box);
    }
    flat += is_flat ? 1 : 0;
  });
  // Cubes stay whole where shapes reach into them.
  std::erase_if(cells, [&](const auto& cell) {
    const VoxelType type = grid.get(cell.first);
    return type != kAir && !types.is_shaped(type);
  });
  return cells;
}

/// Makes the surface of cubes and filled sixteenths. Positions are in sixteenths, except those of voxels.
///
/// Each point of the lattice of sixteenths has the offsets of its eight cells, as corners of voxels have. A cube's face
/// next to air is one face. Where an edge of it touches a voxel with shapes, its outline has all points of the lattice.
class ShapedSurfaceMaker {
 public:
  ShapedSurfaceMaker(const Grid& grid, const FilledCells& cells) : reader_(grid), cells_(cells) {}

  void add_cube(IVec3 voxel, VoxelType type) {
    for (const Face& face : kFaces) {
      const IVec3 beyond = voxel + outward(face);
      if (!is_divided(beyond)) {
        if (reader_.get(beyond) == kAir) add_face(voxel * kShapeUnits, kShapeUnits, type, face);
        continue;
      }
      IVec3 size(kShapeUnits);
      size[face.axis] = 1;
      IVec3 first = voxel * kShapeUnits;
      first[face.axis] += face.side * (kShapeUnits - 1);
      for_box(first, size, [&](const IVec3& cell) { add_if_open(cell, type, face); });
    }
  }

  void add_filled(IVec3 voxel, const FilledCell& filled) {
    for_box(voxel * kShapeUnits, IVec3(kShapeUnits), [&](const IVec3& cell) {
      if (!is_solid(cell)) return;
      for (const Face& face : kFaces) add_if_open(cell, filled.type, face);
    });
  }

  [[nodiscard]] bool is_full() const { return made_.positions.size() > std::numeric_limits<std::uint32_t>::max() / 2; }
  [[nodiscard]] BlockyTriangles take() { return std::move(made_); }

 private:
  static IVec3 outward(const Face& face) {
    IVec3 out(0);
    out[face.axis] = 2 * face.side - 1;
    return out;
  }
  template <class Visit>
  static void for_box(const IVec3& first, const IVec3& size, const Visit& visit) {
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) visit(first + IVec3(x, y, z));
      }
    }
  }

  [[nodiscard]] const FilledCell* filled_at(const IVec3& voxel) {
    if (!is_known_ || voxel != last_) {
      const auto found = cells_.find(voxel);
      last_filled_ = found == cells_.end() ? nullptr : &found->second;
      last_is_solid_ = last_filled_ == nullptr && reader_.get(voxel) != kAir;
      last_ = voxel;
      is_known_ = true;
    }
    return last_filled_;
  }
  [[nodiscard]] bool is_divided(const IVec3& voxel) { return filled_at(voxel) != nullptr; }
  [[nodiscard]] bool is_solid(const IVec3& cell) {
    static_assert(kShapeUnits == 16, "a voxel is a shift away");
    const FilledCell* const filled = filled_at({cell.x >> 4, cell.y >> 4, cell.z >> 4});
    if (filled == nullptr) return last_is_solid_;
    const IVec3 in(cell.x & 15, cell.y & 15, cell.z & 15);
    return (filled->bits[static_cast<std::size_t>(in.y + kShapeUnits * in.z)] >> in.x & 1U) != 0;
  }
  void add_if_open(const IVec3& cell, VoxelType type, const Face& face) {
    if (!is_solid(cell + outward(face))) add_face(cell, 1, type, face);
  }

  /// Returns the position of a point of the lattice on a face. `cell`: the face's solid cell there, as in `Around`.
  [[nodiscard]] Vec3 vertex_at(const IVec3& point, unsigned cell, const Face& face) {
    unsigned solid = 0;
    for (int i = 0; i < 8; ++i) {
      const IVec3 at = point - 1 + IVec3(i & 1, i >> 1 & 1, i >> 2);
      solid |= static_cast<unsigned>(is_solid(at)) << static_cast<unsigned>(i);
    }
    // All faces at a point compute the same bits: sixteenths are exact.
    return Vec3(point) / static_cast<float>(kShapeUnits) +
           print::corner_offsets()[solid][corner_face(cell, static_cast<unsigned>(face.axis))];
  }

  /// Adds a face of the cells from `first`, `size` wide.
  void add_face(const IVec3& first, int size, VoxelType type, const Face& face) {
    const auto start = static_cast<std::uint32_t>(made_.positions.size());
    const IVec3 out = outward(face);
    const auto put = [&](Vec3 at) {
      made_.positions.push_back(at);
      made_.directions.push_back(face.direction);
      made_.types.push_back(type);
    };
    for (int i = 0; i < 4; ++i) {
      const IVec3 corner = corner_of(face, i);
      const IVec3 step = corner_of(face, (i + 1) % 4) - corner;
      IVec3 side(0);  // from the face across this edge
      for (int axis = 0; axis < 3; ++axis) {
        if (axis != face.axis && step[axis] == 0) side[axis] = 2 * corner[axis] - 1;
      }
      // The face's own cell ahead of each point of the edge, by its place around the point.
      const unsigned cell = static_cast<unsigned>((1 - corner.x) | (1 - corner.y) << 1 | (1 - corner.z) << 2);
      const int parts = size > 1 && touches_divided(first, side, out) ? size : 1;
      for (int part = 0; part < parts; ++part) {
        const IVec3 at = first + corner * size + step * (part * (size / parts));
        const IVec3 next = at + step * (size / parts);
        put(vertex_at(at, cell, face));
        // A cell of the face at the edge, then those beyond it.
        const IVec3 own = at - 1 + IVec3(cell & 1U, cell >> 1U & 1U, cell >> 2U);
        if (is_solid(own + side) || !is_solid(own + side + out)) continue;
        put(Vec3(at + next) / static_cast<float>(2 * kShapeUnits) - glm::normalize(Vec3(side + out)) * kSheetOffset);
      }
    }
    const auto count = static_cast<std::uint32_t>(made_.positions.size()) - start;
    if (count == 4) {
      for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) made_.indices.push_back(start + i);
      return;
    }
    put(Vec3(2 * first + (corner_of(face, 0) + corner_of(face, 2)) * size) / static_cast<float>(2 * kShapeUnits));
    for (std::uint32_t i = 0; i < count; ++i) {
      for (const std::uint32_t j : {i, (i + 1) % count, count}) made_.indices.push_back(start + j);
    }
  }

  /// Returns true if shapes fill sixteenths beyond an edge of a cube's face.
  [[nodiscard]] bool touches_divided(const IVec3& first, const IVec3& side, const IVec3& out) {
    const IVec3 voxel = first / kShapeUnits;  // a multiple
    return is_divided(voxel + side) || is_divided(voxel + side + out);
  }

  GridReader reader_;
  const FilledCells& cells_;
  IVec3 last_{0};
  bool is_known_ = false;
  const FilledCell* last_filled_ = nullptr;
  bool last_is_solid_ = false;
  BlockyTriangles made_;
};

/// Meshes the voxels of a grid that `add(voxel, type)` takes, chunk by chunk.
template <class Maker, class Add>
Status add_voxels(const Grid& grid, const Progress& progress, Maker& maker, const Add& add) {
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
          if (type != kAir) add(chunks[i] * kChunkEdge + IVec3(x, y, z), type);
        }
        if (maker.is_full()) return make_error(ErrorCode::LimitExceeded, "the surface has more than 2^32 vertices");
      }
    }
    if (progress && !progress(static_cast<double>(i + 1) / static_cast<double>(chunks.size()))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
  }
  return {};
}

}  // namespace

Result<BlockyTriangles> closed_surface(const Grid& grid, const Progress& progress) {
  SurfaceMaker maker(grid);
  const auto add = [&](IVec3 voxel, VoxelType type) { maker.add(voxel, type); };
  if (auto done = add_voxels(grid, progress, maker, add); !done) return done.error();
  return maker.take();
}

Result<BlockyTriangles> closed_surface(const Grid& grid, const VoxelRegistry& types, const Progress& progress,
                                       std::int64_t* flat_shapes) {
  std::int64_t flat = 0;
  const FilledCells cells = filled_cells(grid, types, flat);
  if (flat_shapes != nullptr) *flat_shapes = flat;
  if (cells.empty()) return closed_surface(grid, progress);
  ShapedSurfaceMaker maker(grid, cells);
  const auto add = [&](IVec3 voxel, VoxelType type) {
    if (const auto filled = cells.find(voxel); filled != cells.end()) {
      maker.add_filled(voxel, filled->second);
    } else {
      maker.add_cube(voxel, type);
    }
  };
  if (auto done = add_voxels(grid, progress, maker, add); !done) return done.error();
  // Sixteenths in voxels of air, in an order that does not depend on the table.
  std::vector<IVec3> outside;
  for (const auto& [voxel, filled] : cells) {
    if (grid.get(voxel) == kAir) outside.push_back(voxel);
  }
  std::sort(outside.begin(), outside.end(), ByZyx());
  for (const IVec3 voxel : outside) maker.add_filled(voxel, cells.at(voxel));
  if (maker.is_full()) return make_error(ErrorCode::LimitExceeded, "the surface has more than 2^32 vertices");
  return maker.take();
}

}  // namespace quoin
