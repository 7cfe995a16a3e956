#include "mesh/surface/voxel_surface.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "grid/density/density_storage.h"
#include "mesh/nets/sheets.h"
#include "mesh/smooth/level_cells.h"
#include "mesh/surface/face_materials.h"

namespace quoin::smooth {
namespace {

bool holds(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body, bool any_other) {
  const std::vector<VoxelType> materials = chunk.materials().types();
  return std::any_of(materials.begin(), materials.end(), [&](VoxelType material) {
    return material != kAir && (body_of(types, material) == body) != any_other;
  });
}

}  // namespace

bool holds_others(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body) {
  return holds(chunk, types, body, true);
}

// For the opaque body, lists the transparent types, which are the others. For a transparent body, lists its own type.
OtherBodies::OtherBodies(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body)
    : chunk_(chunk), listed_(chunk.materials().types()), listed_are_others_(body == 0) {
  std::erase_if(listed_, [&](VoxelType material) {
    return material == kAir ||
           (listed_are_others_ ? !types.is_transparent(material) : body_of(types, material) != body);
  });
}

std::uint64_t OtherBodies::row(int y, int z) const {
  const std::uint64_t solid = chunk_.solid_row(y, z);
  std::uint64_t listed = 0;
  for (std::size_t i = 0; i < listed_.size() && solid != 0; ++i)
    listed |= chunk_.materials().row_mask(y, z, listed_[i]);
  return solid & (listed_are_others_ ? listed : ~listed);
}

DensityChunk without_others(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body) {
  const OtherBodies bodies(whole, types, body);
  std::array<std::uint64_t, kChunkEdge * kChunkEdge> others;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) others[static_cast<std::size_t>(z * kChunkEdge + y)] = bodies.row(y, z);
  }
  DensityChunk made = whole;
  DensityStorage::turn_outward(made, others);
  return made;
}

std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const std::vector<VoxelType>& materials) {
  std::vector<std::uint32_t> bodies;
  for (const VoxelType material : materials) {
    if (material != kAir) bodies.push_back(body_of(types, material));
  }
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const DensityGrid& field) {
  std::vector<VoxelType> transparent;
  if (types.has_transparent()) {
    for (const IVec3 place : field.chunks()) {
      for (const VoxelType material : field.find_chunk(place)->materials().types()) {
        if (types.is_transparent(material)) transparent.push_back(material);
      }
    }
  }
  std::vector<std::uint32_t> bodies = bodies_of(types, transparent);
  bodies.insert(bodies.begin(), 0);
  return bodies;
}

DensityChunk chunk_of_body(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body) {
  return holds_others(whole, types, body) ? without_others(whole, types, body) : whole;
}

DensityGrid field_of_body(const DensityGrid& whole, const VoxelRegistry& types, std::uint32_t body, Threads threads) {
  DensityGrid field(whole.band());
  std::vector<IVec3> places = whole.chunks();
  if (body != 0) {
    std::vector<IVec3> near;
    for (const IVec3 place : places) {
      if (!holds(*whole.find_chunk(place), types, body, false)) continue;
      for (int i = 0; i < 27; ++i) near.push_back(place + Neighbourhood::offset(i));
    }
    sort_and_unite(near);
    std::erase_if(near, [&](IVec3 place) { return whole.find_chunk(place) == nullptr; });
    places = std::move(near);
  }
  std::vector<std::optional<DensityChunk>> made(places.size());
  parallel_for(places.size(), threads,
               [&](std::size_t i) { made[i] = chunk_of_body(*whole.find_chunk(places[i]), types, body); });
  for (std::size_t i = 0; i < places.size(); ++i) field.put_chunk(places[i], std::move(*made[i]));
  return field;
}

namespace {

/// The share of the way from the middle of its cell that a vertex of a thin feature keeps: a rail of one voxel becomes
/// 0.8 voxels wide instead of 0.37.
constexpr float kThinShare = 1.0F / 3.0F;
/// The minimum share for vertices of cells with several sheets.
constexpr float kLeastShare = 1.0F / 256.0F;

/// Bits of samples along x, of a row from -2 to 65. In each word, all bits except the first and the last have both
/// neighbours.
struct WideRow {
  std::uint64_t low = 0;   ///< bit i: sample i - 2
  std::uint64_t high = 0;  ///< bit i: sample i + 2
};

/// Assembles a row of a chunk's neighbourhood from the rows `row_of(i, y, z)` of its chunks.
template <class RowOf>
WideRow wide_row(int y, int z, const RowOf& row_of) {
  const auto part = [&](int dx) -> std::uint64_t {
    return row_of(Neighbourhood::index(dx, y >> kChunkShift, z >> kChunkShift), y & (kChunkEdge - 1),
                  z & (kChunkEdge - 1));
  };
  const std::uint64_t middle = part(0);
  return {part(-1) >> 62 | middle << 2, middle >> 2 | part(1) << 62};
}

/// Returns samples x and x + 1 in the lowest two bits.
std::uint64_t pair_of(const WideRow& row, int x) {
  QUOIN_ASSERT(x >= -1 && x < kChunkEdge, "-1 <= x < 64");
  return x < kChunkEdge / 2 ? row.low >> (x + 2) : row.high >> (x - 2);
}

/// The number of rows of cells, -1 to 63 on y and z, plus one more row of samples.
constexpr int kCellRows = kChunkEdge + 2;

std::size_t cell_row(int y, int z) {
  QUOIN_ASSERT(std::min(y, z) >= -1 && std::max(y, z) <= kChunkEdge, "-1 <= y, z <= 64");
  return static_cast<std::size_t>((z + 1) * kCellRows + y + 1);
}

/// Adds to each row of samples the other rows at the corners of its cells, [z][y].
void unite_for_cells(std::vector<WideRow>& rows) {
  for (std::size_t row = 0; row + kCellRows + 1 < rows.size(); ++row) {
    for (const std::size_t other : {row + 1, row + kCellRows, row + kCellRows + 1}) {
      rows[row].low |= rows[other].low;
      rows[row].high |= rows[other].high;
    }
  }
}

/// The cells of a chunk with a solid, transparent corner. Only these can have several bodies.
class TransparentCells {
 public:
  TransparentCells(const DensityNeighbourhood& whole, const VoxelRegistry& types) {
    std::array<std::optional<OtherBodies>, 27> transparent;
    for (std::size_t i = 0; i < 27; ++i) {
      if (whole.chunks[i] == nullptr) continue;
      transparent[i].emplace(*whole.chunks[i], types, 0);
      if (transparent[i]->empty()) transparent[i].reset();
    }
    if (std::none_of(transparent.begin(), transparent.end(), [](const auto& each) { return each.has_value(); })) return;
    any_.resize(static_cast<std::size_t>(kCellRows * kCellRows));
    for (int z = -1; z <= kChunkEdge; ++z) {
      for (int y = -1; y <= kChunkEdge; ++y) {
        any_[cell_row(y, z)] = wide_row(y, z, [&](std::size_t i, int local_y, int local_z) {
          return transparent[i] ? transparent[i]->row(local_y, local_z) : 0;
        });
      }
    }
    unite_for_cells(any_);
  }

  [[nodiscard]] bool has(IVec3 cell) const {
    return !any_.empty() && (pair_of(any_[cell_row(cell.y, cell.z)], cell.x) & 3U) != 0;
  }

 private:
  std::vector<WideRow> any_;  // [z][y], by unite_for_cells
};

/// One half of the words of a row and of its neighbours.
struct RowsAround {
  std::uint64_t here;
  std::array<std::uint64_t, 2> y;                  ///< before, after
  std::array<std::uint64_t, 2> z;                  ///< before, after
  std::array<std::array<std::uint64_t, 2>, 2> yz;  ///< [y][z]
};

/// By axis: the solid samples that are thin along it. A side continues diagonally if the diagonal sample is set and the
/// sample between is not.
using ThinRows = std::array<std::uint64_t, 3>;

ThinRows thin_of(const RowsAround& rows) {
  const std::uint64_t s = rows.here;
  const auto along_x = [](std::uint64_t row) { return row << 1 | row >> 1; };
  const auto slanted_x = [](std::uint64_t side, std::uint64_t lead) {
    return ((side << 1) & ~(lead << 1)) | ((side >> 1) & ~(lead >> 1));
  };
  ThinRows thin = {s & ~along_x(s), s & ~(rows.y[0] | rows.y[1]), s & ~(rows.z[0] | rows.z[1])};
  if ((thin[0] | thin[1] | thin[2]) == 0) return thin;
  for (std::size_t i = 0; i < 2; ++i) {
    thin[0] &= ~(along_x(rows.y[i]) & ~rows.y[i]) & ~(along_x(rows.z[i]) & ~rows.z[i]);
    thin[1] &= ~slanted_x(rows.y[i], s);
    thin[2] &= ~slanted_x(rows.z[i], s);
    for (std::size_t k = 0; k < 2; ++k) {
      thin[1] &= ~(rows.yz[i][k] & ~rows.z[k]);
      thin[2] &= ~(rows.yz[k][i] & ~rows.y[k]);
    }
  }
  return thin;
}

/// The axes along which the cells of a chunk, -1 to 63 on each axis, have a thin corner.
class ThinCells {
 public:
  explicit ThinCells(const DensityNeighbourhood& chunks)
      : solid_(kRead * kRead), thin_(kCellRows * kCellRows), any_(kCellRows * kCellRows) {
    for (int z = -2; z < kRead - 2; ++z) {
      for (int y = -2; y < kRead - 2; ++y) solid_[at(y, z)] = read(chunks, y, z);
    }
    for (int z = -1; z <= kChunkEdge; ++z) {
      for (int y = -1; y <= kChunkEdge; ++y) {
        const ThinRows low = find(y, z, &WideRow::low);
        const ThinRows high = find(y, z, &WideRow::high);
        const std::size_t row = cell_row(y, z);
        for (std::size_t axis = 0; axis < 3; ++axis) thin_[row][axis] = {low[axis], high[axis]};
        any_[row] = {low[0] | low[1] | low[2], high[0] | high[1] | high[2]};
      }
    }
    unite_for_cells(any_);
  }

  /// Returns true if `has` is true for any axis.
  [[nodiscard]] bool has_any(IVec3 cell) const { return (pair_of(any_[cell_row(cell.y, cell.z)], cell.x) & 3U) != 0; }

  [[nodiscard]] bool has(IVec3 cell, int axis) const {
    std::uint64_t pair = 0;
    for (int i = 0; i < 4; ++i) {
      const std::size_t row = cell_row(cell.y + (i & 1), cell.z + (i >> 1));
      pair |= pair_of(thin_[row][static_cast<std::size_t>(axis)], cell.x);
    }
    return (pair & 3U) != 0;
  }

 private:
  static constexpr int kRead = kChunkEdge + 4;  // rows, starting at -2

  static std::size_t at(int y, int z) {
    QUOIN_ASSERT(std::min(y, z) >= -2 && std::max(y, z) < kRead - 2, "-2 <= y, z < 66");
    return static_cast<std::size_t>((z + 2) * kRead + y + 2);
  }

  static WideRow read(const DensityNeighbourhood& chunks, int y, int z) {
    return wide_row(y, z, [&](std::size_t i, int local_y, int local_z) -> std::uint64_t {
      const DensityChunk* chunk = chunks.chunks[i];
      if (chunk == nullptr) return DensityChunk::is_solid(chunks.outside) ? ~std::uint64_t{0} : 0;
      return chunk->solid_row(local_y, local_z);
    });
  }

  [[nodiscard]] ThinRows find(int y, int z, std::uint64_t WideRow::*half) const {
    const auto row = [&](int dy, int dz) { return solid_[at(y + dy, z + dz)].*half; };
    RowsAround solid{row(0, 0), {row(-1, 0), row(1, 0)}, {row(0, -1), row(0, 1)}, {}};
    // Most rows are entirely inside the ground or above it.
    const std::uint64_t all = solid.here & solid.y[0] & solid.y[1] & solid.z[0] & solid.z[1];
    const std::uint64_t some = solid.here | solid.y[0] | solid.y[1] | solid.z[0] | solid.z[1];
    if (~all == 0 || some == 0) return {};
    solid.yz = {{{row(-1, -1), row(-1, 1)}, {row(1, -1), row(1, 1)}}};
    RowsAround air{~solid.here, {~solid.y[0], ~solid.y[1]}, {~solid.z[0], ~solid.z[1]}, {}};
    for (std::size_t i = 0; i < 4; ++i) air.yz[i / 2][i % 2] = ~solid.yz[i / 2][i % 2];
    const ThinRows thin = thin_of(solid);
    const ThinRows gaps = thin_of(air);
    return {thin[0] | gaps[0], thin[1] | gaps[1], thin[2] | gaps[2]};
  }

  std::vector<WideRow> solid_;                // [z][y]
  std::vector<std::array<WideRow, 3>> thin_;  // [z][y], by axis
  std::vector<WideRow> any_;                  // [z][y]: along any axis, by unite_for_cells
};

/// Returns true if a cell has one sheet, for both ways to pair crossings.
bool has_one_sheet(std::uint32_t solid) {
  return sheets_of(solid).count == 1 && sheets_of(solid ^ 255U).count == 1;
}

/// A vertex that all bodies in a cell share.
struct SharedVertex {
  Vec3 fraction{0.0F};
  std::optional<Vec3> normal;
};

/// Returns the shared vertex of a cell's bodies; empty if the cell has fewer than two bodies.
std::optional<SharedVertex> vertex_of_bodies(const Shape& shape, const LevelCell& cell) {
  constexpr std::uint32_t kNone = ~0U;
  std::array<std::uint32_t, 8> body{};
  std::uint32_t any = kNone;
  bool several = false;
  for (int i = 0; i < 8; ++i) {
    const IVec3 sample = cell.first + corner_place(i);
    const IVec3 at = chunk_of(sample);
    const DensityChunk* chunk = shape.whole->at(at.x, at.y, at.z);
    const bool solid = DensityChunk::is_solid(shape.whole->get(sample));
    std::uint32_t& own = body[static_cast<std::size_t>(i)];
    own = solid && chunk != nullptr ? body_of(*shape.types, chunk->materials().get(local_of(sample))) : kNone;
    if (own == kNone) continue;
    several |= any != kNone && any != own;
    any = own;
  }
  if (!several) return std::nullopt;
  const Corners corners = corners_of(*shape.whole, cell);
  Vec3 sum{0.0F};
  float count = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t k = i | std::size_t{1} << axis;
      if (k == i || body[i] == body[k]) continue;
      Vec3 crossing(corner_place(static_cast<int>(i)));
      const bool meets_air = body[i] == kNone || body[k] == kNone;
      crossing[axis] = meets_air ? corners[i] / (corners[i] - corners[k]) : 0.5F;
      sum += crossing;
      count += 1.0F;
    }
  }
  SharedVertex shared{sum / count, std::nullopt};
  const std::uint32_t solid = solid_corners(corners);
  if (solid != 0 && solid != 255) shared.normal = unit_normal(trilinear_gradient(corners, shared.fraction));
  return shared;
}

/// Splits quads with shared vertices along the diagonal that is shorter now. Each body chose its own diagonal before
/// these vertices were moved.
void split_quads_again(const ChunkLevels& levels, const std::vector<bool>& is_shared, SmoothChunkMesh& mesh) {
  const std::size_t quads_end = quad_indices_of(mesh);
  for (std::size_t i = 0; i < quads_end; i += 6) {
    std::uint32_t* quad = mesh.indices.data() + i;
    if (std::none_of(quad, quad + 6, [&](std::uint32_t vertex) { return is_shared[vertex]; })) continue;
    const std::array<std::uint32_t, 4> cycle = corners_of_quad(quad, mesh);
    std::array<QuadCorner, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) {
      const LevelCell cell = levels.cell_of(mesh.cells[cycle[k]]);
      corners[k] = quad_corner(cycle[k], mesh.positions[cycle[k]], cell.first, cell.level);
    }
    const std::array<std::uint32_t, 6> triangles = triangles_of(corners);
    std::copy(triangles.begin(), triangles.end(), quad);
  }
}

}  // namespace

void shape_vertices(const DensityNeighbourhood& chunks, const SmoothOptions& options, const Shape& shape,
                    SmoothChunkMesh& mesh) {
  QUOIN_ASSERT(shape.whole == nullptr || shape.types != nullptr, "types of the bodies");
  if (!shape.moves() || mesh.positions.empty()) return;
  const ChunkLevels levels(options.levels);
  std::unique_ptr<const ThinCells> thin;
  if (shape.keep_thin) thin = std::make_unique<const ThinCells>(chunks);
  std::optional<TransparentCells> transparent;
  if (shape.whole != nullptr) transparent.emplace(*shape.whole, *shape.types);
  std::vector<bool> is_shared(shape.whole != nullptr ? mesh.positions.size() : 0);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const LevelCell cell = levels.cell_of(mesh.cells[i]);
    const bool has_thin = thin && cell.level == 0 && thin->has_any(cell.first);
    const bool may_be_shared = transparent && cell.level == 0 && transparent->has(cell.first);
    if (shape.smoothness == 1.0F && !has_thin && !may_be_shared) continue;
    const Vec3 first(cell.first);
    const auto size = static_cast<float>(cell.size());
    Vec3 fraction = (mesh.positions[i] - first) / size;
    std::optional<SharedVertex> shared;
    if (may_be_shared && has_one_sheet(solid_corners_of(chunks, cell))) shared = vertex_of_bodies(shape, cell);
    if (shared) {
      is_shared[i] = true;
      fraction = shared->fraction;
      if (shared->normal) mesh.normals[i] = *shared->normal;
    }
    // The sheets of a cell would otherwise coincide, with edges of four triangles.
    const bool may_meet_others = shape.smoothness < kLeastShare &&
                                 (mesh.cells[i].bridge_axis() >= 0 || !has_one_sheet(solid_corners_of(chunks, cell)));
    const float share = may_meet_others ? kLeastShare : shape.smoothness;
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_thin = thin && cell.level == 0 && (shared || (has_thin && thin->has(cell.first, axis)));
      const float kept = is_thin ? share * kThinShare : share;
      if (kept == 1.0F && !shared) continue;
      // For a bridge, relative to the middle of the face between two cells.
      const float middle = axis == mesh.cells[i].bridge_axis() ? 1.0F : 0.5F;
      const float moved = snap(middle + (fraction[axis] - middle) * kept);
      mesh.positions[i][axis] = first[axis] + moved * size;
    }
  }
  if (shape.whole != nullptr && levels.all_same()) split_quads_again(levels, is_shared, mesh);
}

}  // namespace quoin::smooth
