// The part of voxels with shapes in halved grids.

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/core/memory.h>

#include "grid/halving/chunk_halver.h"
#include "grid/shapes/shape_index.h"

namespace quoin {
namespace {

// The faces of the cubes in a cell.
struct CellCubes {
  int count = 0;
  int open_faces = 0;  // that meet air or shapes
};

CellCubes cubes_in(const HalvingMasks& masks, IVec3 cell) {
  CellCubes cubes;
  for (int i = 0; i < 4; ++i) {
    const IVec3 at = 2 * cell + IVec3{0, i & 1, i >> 1};
    const int half = at.x / kChunkEdge;
    const int x = at.x % kChunkEdge;
    const std::uint64_t pair = masks.voxels(half, at.y, at.z) >> x & 3U;
    if (pair == 0) continue;
    cubes.count += std::popcount(pair);
    const auto exposed = masks.exposed_faces(half, at.y, at.z);
    for (std::size_t digit = 0; digit < exposed.size(); ++digit) {
      cubes.open_faces += std::popcount(exposed[digit] >> x & pair) << digit;
    }
  }
  return cubes;
}

// The shapes of one type in and around a cell.
struct CellShapes {
  VoxelType type = kAir;
  bool is_opaque = true;
  float filled = 0.0F;   // sum of the coverages of those in the cell
  float covered = 0.0F;  // faces of the cell's cubes that they cover

  [[nodiscard]] bool comes_before(const CellShapes& other, bool in_solid) const {
    if (is_opaque != other.is_opaque) return is_opaque;
    const float own = in_solid ? filled + covered : filled;
    const float others = in_solid ? other.filled + other.covered : other.filled;
    return own != others ? own > others : type < other.type;
  }
};

// A model of a type as halving counts it.
struct ShapeKind {
  VoxelType type = kAir;
  bool is_opaque = true;
  std::uint8_t touched_sides = 0;  // ShapeModel::touched_sides
  Vec3 coverage{0.0F};
  std::array<float, 6> covered{};  // share of each side
  float filled = 0.0F;             // by a voxel without cubes next to it
  float filled_cell = 0.0F;        // by eight of them
};

float filled_by(const Vec3& coverage, const Vec3& hidden) {
  const Vec3 seen = glm::max(coverage - hidden, Vec3(0.0F));
  return (seen.x + seen.y + seen.z) / 3.0F;
}

// The shapes around one chunk of a halved grid, by cell.
//
//   planes of types -> kinds of voxels     rows of one kind are found by comparison
//   kinds -> cells                         a number if all eight voxels are of a kind and no cube is next to them
//                                          a list of types for other cells, added up in the order of voxels
class ShapeCounter {
 public:
  ShapeCounter(const Grid& grid, const VoxelRegistry& types, const HalvingMasks& masks, IVec3 chunk)
      : grid_(&grid), types_(&types), masks_(&masks), chunk_(chunk), known_types_(types.size()), kinds_(1) {
    for (std::size_t type = 0; types.has_shapes() && type < types.size() && !any_by_position_; ++type) {
      const auto number = static_cast<VoxelType>(type);
      any_by_position_ = types.is_shaped(number) && types[number].shapes.position_count() > 1;
    }
  }

  // Requires: chunks are taken in the order of their octants. -1 <= octant <= 2.
  void take_chunk(IVec3 octant) {
    const Chunk* const chunk = masks_->octant(octant);
    if (chunk == nullptr) return;
    const std::vector<VoxelType> all = chunk->types();
    if (std::ranges::none_of(all, [&](VoxelType type) { return types_->is_shaped(type); })) return;
    if (cells_.empty()) cells_.resize(kChunkVoxels);
    const Neighbourhood near = grid_->neighbourhood(2 * chunk_ + octant);
    if ((IBox{IVec3(0), IVec3(2)}.contains(octant))) {
      take_inside(octant, near);
    } else {
      take_border(octant, near);
    }
  }

  // Returns true if any cells of a row have shapes.
  [[nodiscard]] bool has_row(int y, int z) const { return (rows_[static_cast<std::size_t>(z)] >> y & 1U) != 0; }
  // Returns the kind of all voxels of a cell without cubes in it or next to it; null for other cells.
  [[nodiscard]] const ShapeKind* kind_of_cell(IVec3 cell) const {
    const std::uint32_t number = cells_[number_of(cell)];
    return (number & kOneKind) != 0 ? &kinds_[number & ~kOneKind] : nullptr;
  }
  // Writes the shapes of a cell that is not of one kind.
  void list_cell(IVec3 cell, std::vector<CellShapes>& out) const {
    out.clear();
    for (std::uint32_t i = cells_[number_of(cell)]; i != 0; i = entries_[i - 1].next) {
      out.push_back(entries_[i - 1].shapes);
    }
  }

 private:
  static constexpr std::uint32_t kOneKind = 0x8000'0000U;
  static constexpr std::uint32_t kSeveral = ~std::uint32_t{0};
  static constexpr std::size_t kRows = std::size_t{2} * kChunkEdge;  // of two planes

  // The way to find the shape of a type's voxels.
  struct KnownType {
    enum class Rule : std::uint8_t { Unknown, NoShape, OneShape, Fluid, ByVoxel, ByPosition };
    Rule rule = Rule::Unknown;
    std::uint32_t kind = 0;  // OneShape: of all voxels; Fluid: of those below others
  };
  struct KnownModel {
    const ShapeModel* model = nullptr;
    VoxelType type = kAir;
    std::uint32_t kind = 0;
  };
  struct Entry {
    CellShapes shapes;
    std::uint32_t next = 0;  // 1 + the cell's next entry; 0: none
  };

  void take_inside(IVec3 octant, const Neighbourhood& near) {
    NearPlanes planes(near);
    planes.read(-1);
    planes.read(0);
    for (int z = 0; z < kChunkEdge; z += 2) {
      planes.read(z + 1);
      planes.read(z + 2);
      take_planes(planes, octant * kChunkEdge, z);
    }
  }

  // Counts the planes z and z + 1 of a chunk whose corner is at `first`.
  void take_planes(const NearPlanes& planes, IVec3 first, int z) {
    plane_kinds_.resize(kRows * kChunkEdge);
    std::array<std::uint32_t, kRows> row_kinds{};  // of all voxels of a row, or kSeveral
    std::array<std::uint64_t, kRows> left{};       // voxels to count one by one
    std::array<std::uint64_t, kRows> next_to{};    // voxels next to cubes
    for (std::size_t row = 0; row < kRows; ++row) {
      const int y = static_cast<int>(row) % kChunkEdge;
      const int at_z = z + static_cast<int>(row) / kChunkEdge;
      row_kinds[row] = find_kinds(planes, y, at_z, &plane_kinds_[row * kChunkEdge], left[row]);
      if (left[row] != 0) next_to[row] = next_to_cubes(first.x / kChunkEdge, first.y + y, first.z + at_z);
    }
    for (std::size_t y = 0; y < kChunkEdge; y += 2) {
      const std::array<std::size_t, 4> rows = {y, y + 1, y + kChunkEdge, y + kChunkEdge + 1};
      if ((left[rows[0]] | left[rows[1]] | left[rows[2]] | left[rows[3]]) == 0) continue;
      const std::uint64_t near_cubes = next_to[rows[0]] | next_to[rows[1]] | next_to[rows[2]] | next_to[rows[3]];
      const std::uint64_t whole = find_whole_cells(rows, row_kinds, near_cubes, first / 2 + IVec3(0, y / 2, z / 2));
      for (const std::size_t row : rows) left[row] &= ~whole;
    }
    for (std::size_t row = 0; row < kRows; ++row) {
      const IVec3 of_row = first + IVec3(0, row % kChunkEdge, z + static_cast<int>(row) / kChunkEdge);
      for (; left[row] != 0; left[row] &= left[row] - 1) {
        const int x = std::countr_zero(left[row]);
        const ShapeKind& kind = kinds_[plane_kinds_[row * kChunkEdge + static_cast<std::size_t>(x)]];
        take_voxel(of_row + IVec3(x, 0, 0), kind, (next_to[row] >> x & 1U) != 0);
      }
    }
  }

  // Writes the kinds of a row's voxels, 0 for those without shapes, and the voxels with shapes. Returns the kind of
  // all, or kSeveral.
  std::uint32_t find_kinds(const NearPlanes& planes, int y, int z, std::uint32_t* kinds, std::uint64_t& shaped) {
    const auto row = planes.row(y, z);
    if (std::equal(row.begin(), row.end() - 1, row.begin() + 1)) {
      const KnownType& known = known_type(row[0]);
      const bool is_known = known.rule == KnownType::Rule::NoShape || known.rule == KnownType::Rule::OneShape ||
                            (known.rule == KnownType::Rule::Fluid && std::ranges::equal(row, planes.row(y + 1, z)));
      std::optional<std::uint32_t> kind;
      if (is_known) {
        kind = known.kind;
      } else if (const auto around =
                     known.rule == KnownType::Rule::ByPosition ? std::nullopt : planes.rows_around(y, z)) {
        if (around != known_around_) {
          kind_between_ = kind_of(planes, {0, y, z}, row[0]);
          known_around_ = around;
        }
        kind = kind_between_;
      }
      if (kind) {
        std::fill_n(kinds, kChunkEdge, *kind);
        shaped = *kind == 0 ? 0 : ~std::uint64_t{0};
        return *kind;
      }
    }
    shaped = 0;
    const std::uint64_t repeated = planes.repeated(y, z);
    bool is_one = true;
    for (int x = 0; x < kChunkEdge; ++x) {
      const VoxelType type = row[static_cast<std::size_t>(x)];
      const bool is_repeated = (repeated >> x & 1U) != 0 && known_type(type).rule != KnownType::Rule::ByPosition;
      kinds[x] = is_repeated ? kinds[x - 1] : kind_of(planes, {x, y, z}, type);
      is_one &= kinds[x] == kinds[0];
      shaped |= std::uint64_t{kinds[x] != 0} << x;
    }
    return is_one ? kinds[0] : kSeveral;
  }

  // Returns the voxels of half a row that share a face with a cube.
  [[nodiscard]] std::uint64_t next_to_cubes(int half, int y, int z) const {
    const auto [ones, twos, fours] = masks_->exposed_faces(half, y, z);
    return ones | ~twos | ~fours;  // fewer than six faces are exposed
  }

  // Numbers the cells of one kind that are not next to cubes. Returns their voxels. `first`: the first cell.
  std::uint64_t find_whole_cells(const std::array<std::size_t, 4>& rows,
                                 const std::array<std::uint32_t, kRows>& row_kinds, std::uint64_t near_cubes,
                                 IVec3 first) {
    std::uint32_t* const cells = &cells_[number_of(first)];
    rows_[static_cast<std::size_t>(first.z)] |= std::uint64_t{1} << first.y;
    const std::uint32_t kind = row_kinds[rows[0]];
    const bool is_one = std::ranges::all_of(rows, [&](std::size_t row) { return row_kinds[row] == kind; });
    if (is_one && kind != kSeveral && near_cubes == 0) {
      std::fill_n(cells, kChunkEdge / 2, kind | kOneKind);
      return ~std::uint64_t{0};
    }
    std::uint64_t whole = 0;
    for (std::size_t x = 0; x < kChunkEdge / 2; ++x) {
      const std::uint32_t of_cell = plane_kinds_[rows[0] * kChunkEdge + 2 * x];
      std::uint32_t others = 0;
      for (const std::size_t row : rows) {
        const std::uint32_t* const pair = &plane_kinds_[row * kChunkEdge + 2 * x];
        others |= (pair[0] ^ of_cell) | (pair[1] ^ of_cell);
      }
      const std::uint64_t voxels = std::uint64_t{3} << (2 * x);
      if (of_cell == 0 || others != 0 || (near_cubes & voxels) != 0) continue;
      cells[x] = of_cell | kOneKind;
      whole |= voxels;
    }
    return whole;
  }

  // Counts the faces of cubes inside that shapes of a chunk next to the inside cover.
  void take_border(IVec3 octant, const Neighbourhood& near) {
    int axis = 0;
    while (octant[axis] == 0 || octant[axis] == 1) ++axis;
    const bool is_lower = octant[axis] < 0;
    const auto inwards = static_cast<Direction>(2 * axis + (is_lower ? 0 : 1));
    IVec3 low(0);
    IVec3 high(kChunkEdge);
    low[axis] = is_lower ? kChunkEdge - 1 : 0;
    high[axis] = low[axis] + 1;
    for (int z = low.z; z < high.z; ++z) {
      for (int y = low.y; y < high.y; ++y) {
        const IVec3 first = octant * kChunkEdge + IVec3(0, y, z);
        const IVec3 inside = axis == 0 ? first : first + normal_of(inwards);
        std::uint64_t left = 0;  // voxels with a cube inside next to them
        if (axis == 0) {
          left = is_lower ? masks_->voxels(0, inside.y, inside.z) << 63 : masks_->voxels(1, inside.y, inside.z) >> 63;
        } else {
          left = masks_->voxels(octant.x, inside.y, inside.z);
        }
        for (; left != 0; left &= left - 1) {
          const IVec3 local{std::countr_zero(left), y, z};
          const std::uint32_t number = kind_of(near, local, near.get(local));
          if (number != 0) cover(octant * kChunkEdge + local + normal_of(inwards), kinds_[number], inwards);
        }
      }
    }
  }

  void take_voxel(IVec3 fine, const ShapeKind& kind, bool is_next_to_cubes) {
    float filled = kind.filled;
    if (is_next_to_cubes) {
      Vec3 hidden(0.0F);  // on faces of cubes, along each axis
      for (unsigned left = kind.touched_sides; left != 0; left &= left - 1) {
        const auto direction = static_cast<Direction>(std::countr_zero(left));
        const IVec3 next = fine + normal_of(direction);
        if (!masks_->is_cube(next)) continue;
        float& along = hidden[frame_of(direction).axis];
        along = std::max(along, kind.covered[static_cast<std::size_t>(direction)]);
        if (kInside.contains(next)) cover(next, kind, direction);
      }
      filled = filled_by(kind.coverage, hidden);
    }
    if (filled > 0.0F) shapes_in(fine, kind).filled += filled;
  }

  // Counts the part of a cube's face that a shape covers in a direction.
  void cover(IVec3 cube, const ShapeKind& kind, Direction direction) {
    const float share = kind.covered[static_cast<std::size_t>(direction)];
    if (share > 0.0F && kind.is_opaque) shapes_in(cube, kind).covered += share;
  }

  [[nodiscard]] CellShapes& shapes_in(IVec3 fine, const ShapeKind& kind) {
    const IVec3 cell = fine / 2;
    rows_[static_cast<std::size_t>(cell.z)] |= std::uint64_t{1} << cell.y;
    std::uint32_t* to = &cells_[number_of(cell)];
    QUOIN_ASSERT((*to & kOneKind) == 0, "a cell with cubes in it or next to it, or of several kinds");
    for (; *to != 0; to = &entries_[*to - 1].next) {
      if (entries_[*to - 1].shapes.type == kind.type) return entries_[*to - 1].shapes;
    }
    *to = static_cast<std::uint32_t>(entries_.size()) + 1;
    return entries_.push_back({.shapes = {.type = kind.type, .is_opaque = kind.is_opaque}}), entries_.back().shapes;
  }

  [[nodiscard]] const KnownType& known_type(VoxelType type) {
    static constexpr KnownType kNone{.rule = KnownType::Rule::NoShape};
    if (type >= known_types_.size()) return kNone;
    KnownType& known = known_types_[type];
    if (known.rule == KnownType::Rule::Unknown) known = rule_of(type);
    return known;
  }

  [[nodiscard]] KnownType rule_of(VoxelType type) {
    if (!types_->is_shaped(type)) return {.rule = KnownType::Rule::NoShape};
    const VoxelProperties& properties = (*types_)[type];
    const VoxelShapes& shapes = properties.shapes;
    if (shapes.rules().neighbours == ShapeNeighbours::Fluid) {
      return {KnownType::Rule::Fluid, kind_of_model(type, shapes.model(0, {}, {.heights = {16, 16, 16, 16}}))};
    }
    // Equal neighbourhoods can have different shapes, also by the positions of neighbours.
    const bool follows_others = shapes.rules().neighbours == ShapeNeighbours::Connected && any_by_position_;
    if (shapes.position_count() > 1 || follows_others) return {.rule = KnownType::Rule::ByPosition};
    const bool uses_state =
        properties.state_bits != 0 && (shapes.state_mask() != 0 || !properties.orientations.empty());
    if (shapes.rules().neighbours != ShapeNeighbours::None || uses_state) return {.rule = KnownType::Rule::ByVoxel};
    return {KnownType::Rule::OneShape, kind_of_model(type, shapes.model(0, properties.orientations.of(0), {}))};
  }

  // Returns the kind of a voxel; 0 if it has no shape. `Voxels`: NearPlanes or Neighbourhood.
  template <class Voxels>
  [[nodiscard]] std::uint32_t kind_of(const Voxels& voxels, IVec3 local, VoxelType type) {
    const KnownType& known = known_type(type);
    if (known.rule == KnownType::Rule::NoShape || known.rule == KnownType::Rule::OneShape) return known.kind;
    // A fluid below the same fluid fills its voxel.
    if (known.rule == KnownType::Rule::Fluid && voxels.get(local + IVec3(0, 1, 0)) == type) return known.kind;
    return kind_of_model(type, *shape_at(voxels, *types_, local));
  }

  [[nodiscard]] std::uint32_t kind_of_model(VoxelType type, const ShapeModel& model) {
    KnownModel& known = known_models_[(std::bit_cast<std::uintptr_t>(&model) >> 4) * 0x9E37'79B9'7F4A'7C15U >> 56];
    if (known.model == &model && known.type == type) return known.kind;
    const auto [found, is_new] = kind_numbers_.try_emplace({type, &model}, static_cast<std::uint32_t>(kinds_.size()));
    if (is_new) kinds_.push_back(made(type, model));
    known = {&model, type, found->second};
    return found->second;
  }

  [[nodiscard]] ShapeKind made(VoxelType type, const ShapeModel& model) const {
    const VoxelProperties& properties = (*types_)[type];
    ShapeKind kind{.type = type, .is_opaque = !has_glass_parts(properties), .touched_sides = model.touched_sides};
    kind.coverage = coverage_of(model, properties.faces);
    for (std::size_t side = 0; side < kind.covered.size(); ++side) {
      int squares = 0;
      for (const std::uint64_t word : model.sides[side]) squares += std::popcount(word);
      kind.covered[side] = static_cast<float>(squares) / 256.0F;
    }
    kind.filled = filled_by(kind.coverage, Vec3(0.0F));
    for (int i = 0; i < 8; ++i) kind.filled_cell += kind.filled;
    return kind;
  }

  static constexpr IBox kInside{IVec3(0), IVec3(2 * kChunkEdge)};

  const Grid* grid_;
  const VoxelRegistry* types_;
  const HalvingMasks* masks_;
  IVec3 chunk_;
  bool any_by_position_ = false;  // any type's shapes follow positions
  std::vector<KnownType> known_types_;
  std::array<KnownModel, 256> known_models_{};
  std::map<std::pair<VoxelType, const ShapeModel*>, std::uint32_t> kind_numbers_;
  std::optional<std::array<std::uint64_t, 9>> known_around_;  // the last one of NearPlanes::rows_around
  std::uint32_t kind_between_ = 0;                            // of the row between those
  BlockVector<ShapeKind> kinds_;                              // 0: no shape
  BlockVector<std::uint32_t> plane_kinds_;                    // of two planes
  BlockVector<std::uint32_t> cells_;                          // kOneKind | kind, or 1 + the first entry; 0: no shapes
  BlockVector<Entry> entries_;
  std::array<std::uint64_t, kChunkEdge> rows_{};  // [z], bit y: rows of cells with shapes
};

// Returns a number from 0 up to, but not including, 1, that depends only on the cell of the halved grid.
float number_of_cell(IVec3 cell) {
  std::uint32_t hash = mix_bits(static_cast<std::uint32_t>(cell.x));
  hash = mix_bits(hash ^ static_cast<std::uint32_t>(cell.y));
  hash = mix_bits(hash ^ static_cast<std::uint32_t>(cell.z));
  return static_cast<float>(hash >> 8) / static_cast<float>(1U << 24);
}

// Returns the shape's type that a cell becomes; air if it stays. `number`: of the cell. `present`: its type by its
// cubes.
VoxelType shape_of_cell(const std::vector<CellShapes>& shapes, const CellCubes& cubes, float number, VoxelType present,
                        const VoxelRegistry& types) {
  const bool is_solid = present != kAir;
  const auto best = std::ranges::min_element(
      shapes, [&](const CellShapes& a, const CellShapes& b) { return a.comes_before(b, is_solid); });
  float filled = 0.0F;
  float covered = 0.0F;
  for (const CellShapes& each : shapes) {
    // Glass hides no cubes.
    if (is_solid && each.is_opaque != best->is_opaque) continue;
    filled += each.filled;
    covered += each.covered;
  }
  if (!is_solid) {
    const bool is_kept = best->filled > 0.0F && number * static_cast<float>(4 - cubes.count) < filled;
    return is_kept ? best->type : kAir;
  }
  if (!best->is_opaque && types.is_opaque(present)) return kAir;
  const float seen_cubes = std::max(static_cast<float>(cubes.open_faces) - covered, 0.0F);
  const float seen_shapes = filled + covered;
  return number * (seen_shapes + seen_cubes) < seen_shapes ? best->type : kAir;
}

}  // namespace

void ChunkHalver::add_shapes(Chunk& made) const {
  ShapeCounter shapes(*grid_, *types_, masks_, chunk_);
  for (int i = 0; i < 64; ++i) shapes.take_chunk(IVec3{i & 3, i >> 2 & 3, i >> 4} - 1);
  std::array<VoxelType, kChunkEdge> row;
  std::vector<CellShapes> of_cell;
  for (int i = 0; i < kChunkEdge * kChunkEdge; ++i) {
    const IVec3 first{0, i % kChunkEdge, i / kChunkEdge};
    if (!shapes.has_row(first.y, first.z)) continue;
    made.read_row(first.y, first.z, row);
    std::uint64_t changed = 0;
    for (int x = 0; x < kChunkEdge; ++x) {
      const IVec3 cell = first + IVec3(x, 0, 0);
      VoxelType& type = row[static_cast<std::size_t>(x)];
      VoxelType chosen = kAir;
      if (const ShapeKind* const kind = shapes.kind_of_cell(cell)) {
        const bool is_kept =
            kind->filled_cell >= 4.0F || 4.0F * number_of_cell(chunk_ * kChunkEdge + cell) < kind->filled_cell;
        if (is_kept) chosen = kind->type;
      } else {
        shapes.list_cell(cell, of_cell);
        if (of_cell.empty()) continue;
        chosen =
            shape_of_cell(of_cell, cubes_in(masks_, cell), number_of_cell(chunk_ * kChunkEdge + cell), type, *types_);
      }
      if (chosen == kAir) continue;
      type = chosen;
      changed |= std::uint64_t{1} << x;
    }
    made.write_row(first.y, first.z, changed, row);
  }
}

}  // namespace quoin
