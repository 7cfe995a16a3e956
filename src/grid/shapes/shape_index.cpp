#include "grid/shapes/shape_index.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

// Returns the shapes' rules of a type, or null if it has none.
const ShapeRules* rules_of(const VoxelRegistry& types, VoxelType type) {
  return types.is_shaped(type) ? &types[type].shapes.rules() : nullptr;
}

// Finds the influence of the neighbours and position of a voxel on its shape. `Voxels` has `get(IVec3)`,
// `state(IVec3)` and `origin()`, the position of its voxel 0 in the grid.
template <class Voxels>
class SurroundingsFinder {
 public:
  SurroundingsFinder(const Voxels& voxels, const VoxelRegistry& types) : voxels_(voxels), types_(types) {}

  [[nodiscard]] const ShapeModel* model(IVec3 voxel, VoxelType type) const {
    if (!types_.is_shaped(type)) return nullptr;
    const VoxelProperties& properties = types_[type];
    const ShapeRules& rules = properties.shapes.rules();
    const std::uint32_t state = properties.state_bits == 0 ? 0 : voxels_.state(voxel);
    const AxisOrientation orientation = properties.orientations.of(state);
    ShapeSurroundings around;
    switch (rules.neighbours) {
      case ShapeNeighbours::None:
        break;
      case ShapeNeighbours::Connected:
        around.connected = connections(voxel, rules, orientation);
        break;
      case ShapeNeighbours::Stairs:
        around.corner = corner(voxel, rules, orientation);
        break;
      case ShapeNeighbours::Fluid:
        around.heights = heights(voxel, rules.groups);
        break;
    }
    if (const std::uint32_t count = properties.shapes.position_count(); count > 1) {
      around.position = static_cast<std::uint16_t>(position_number(voxels_.origin() + voxel) % count);
    }
    return &properties.shapes.model(state, orientation, around);
  }

  [[nodiscard]] InnerFluid fluid(IVec3 voxel, VoxelType type) const {
    const std::uint32_t groups = contained_groups(voxel, type);
    if (groups == 0) return {};
    InnerFluid inner{groups, fluid_type_near(voxel, groups), nullptr};
    if (inner.type == kAir) return inner;
    inner.model = &types_[inner.type].shapes.model(0, {}, {.heights = heights(voxel, groups)});
    return inner;
  }

 private:
  [[nodiscard]] DirectionSet connections(IVec3 voxel, const ShapeRules& rules, const AxisOrientation& turn) const {
    DirectionSet connected;
    for (const Direction direction : kDirections) {
      const Direction outward = turn.apply(direction);
      if (connects(voxel + normal_of(outward), outward, rules)) connected.insert(direction);
    }
    return connected;
  }

  [[nodiscard]] bool connects(IVec3 neighbour, Direction outward, const ShapeRules& rules) const {
    const VoxelType type = voxels_.get(neighbour);
    if (type == kAir) return false;
    const ShapeRules* others = rules_of(types_, type);
    if (others == nullptr) return rules.connects_to_full_sides && types_.is_opaque(type);
    if (others->neighbours == ShapeNeighbours::Connected) return (others->groups & rules.groups) != 0;
    // Other shapes that follow their neighbours are not asked, so that no two shapes wait for each other.
    if (!rules.connects_to_full_sides || others->neighbours != ShapeNeighbours::None) return false;
    return types_[type].visibility == Visibility::Opaque &&
           model(neighbour, type)->covers_side[static_cast<std::size_t>(opposite(outward))];
  }

  // Returns the orientation of stairs of a common group and with the same side up, or nullopt for other voxels.
  [[nodiscard]] std::optional<AxisOrientation> stairs_at(IVec3 voxel, const ShapeRules& rules, Direction up) const {
    const VoxelType type = voxels_.get(voxel);
    const ShapeRules* others = rules_of(types_, type);
    if (others == nullptr || others->neighbours != ShapeNeighbours::Stairs || (others->groups & rules.groups) == 0) {
      return std::nullopt;
    }
    const VoxelProperties& properties = types_[type];
    const AxisOrientation turn = properties.orientations.of(properties.state_bits == 0 ? 0 : voxels_.state(voxel));
    return turn.apply(Direction::PosY) == up ? std::optional(turn) : std::nullopt;
  }

  [[nodiscard]] StairCorner corner(IVec3 voxel, const ShapeRules& rules, const AxisOrientation& turn) const {
    const Direction up = turn.apply(Direction::PosY);
    const Direction front = turn.apply(Direction::PosX);
    const auto front_at = [&](IVec3 at) -> std::optional<Direction> {
      const std::optional<AxisOrientation> stairs = stairs_at(at, rules, up);
      return stairs ? std::optional(stairs->apply(Direction::PosX)) : std::nullopt;
    };
    // A neighbour bends the stairs unless their row goes on next to it.
    const auto bends = [&](Direction side) { return front_at(voxel + normal_of(side)) != front; };
    const AxisOrientation back = turn.inverse();
    const auto turned_to = [&](IVec3 at) -> std::optional<Direction> {  // the unturned direction: +Z or -Z
      const std::optional<Direction> other = front_at(at);
      if (!other) return std::nullopt;
      const Direction unturned = back.apply(*other);
      return frame_of(unturned).axis == 2 ? std::optional(unturned) : std::nullopt;
    };
    if (const auto side = turned_to(voxel + normal_of(front)); side && bends(turn.apply(opposite(*side)))) {
      return *side == Direction::NegZ ? StairCorner::OuterLeft : StairCorner::OuterRight;
    }
    if (const auto side = turned_to(voxel - normal_of(front)); side && bends(turn.apply(*side))) {
      return *side == Direction::NegZ ? StairCorner::InnerLeft : StairCorner::InnerRight;
    }
    return StairCorner::Straight;
  }

  // Returns the groups of the fluid in a voxel next to a shape (ShapeRules::fluid); 0: there is none.
  [[nodiscard]] std::uint32_t contained_groups(IVec3 voxel, VoxelType type) const {
    if (!types_.is_shaped(type)) return 0;
    const VoxelProperties& properties = types_[type];
    const std::optional<ContainedFluid>& fluid = properties.shapes.rules().fluid;
    if (!fluid) return 0;
    const bool is_present = fluid->is_present(properties.state_bits == 0 ? 0 : voxels_.state(voxel));
    return is_present ? fluid->groups : 0;
  }
  [[nodiscard]] bool holds_fluid(IVec3 voxel, std::uint32_t groups) const {
    const VoxelType type = voxels_.get(voxel);
    return ((types_.fluid_groups(type) | contained_groups(voxel, type)) & groups) != 0;
  }
  // Returns the type of a fluid above, next to or below a voxel, else the first one of all.
  [[nodiscard]] VoxelType fluid_type_near(IVec3 voxel, std::uint32_t groups) const {
    constexpr std::array<Direction, 6> kOrder = {Direction::PosY, Direction::PosX, Direction::NegX,
                                                 Direction::PosZ, Direction::NegZ, Direction::NegY};
    for (const Direction direction : kOrder) {
      const VoxelType type = voxels_.get(voxel + normal_of(direction));
      if ((types_.fluid_groups(type) & groups) != 0) return type;
    }
    return types_.first_fluid(groups);
  }

  // Returns the height of a fluid in a voxel in ninths, or nullopt for other voxels. 9: the fluid fills its voxel.
  [[nodiscard]] std::optional<int> ninths(IVec3 voxel, std::uint32_t groups) const {
    const VoxelType type = voxels_.get(voxel);
    const bool is_fluid = (types_.fluid_groups(type) & groups) != 0;
    if (!is_fluid && (contained_groups(voxel, type) & groups) == 0) return std::nullopt;
    if (holds_fluid(voxel + IVec3(0, 1, 0), groups)) return 9;
    const std::uint32_t state = !is_fluid || types_[type].state_bits == 0 ? 0 : voxels_.state(voxel);
    return (state & 8U) != 0 ? 9 : 8 - static_cast<int>(state & 7U);
  }

  // A column of voxels next to a fluid's corner: `ninths`, or one of these.
  static constexpr int kOpen = 0;
  static constexpr int kSolid = -1;

  [[nodiscard]] std::array<std::uint8_t, 4> heights(IVec3 voxel, std::uint32_t groups) const {
    if (ninths(voxel, groups) == 9) return {16, 16, 16, 16};
    std::array<int, 9> columns{};  // (x, z) - 1 from the voxel: x + 3 z
    for (std::size_t i = 0; i < 9; ++i) {
      const IVec3 at = voxel + IVec3(static_cast<int>(i % 3) - 1, 0, static_cast<int>(i / 3) - 1);
      columns[i] = ninths(at, groups).value_or(types_.is_opaque(voxels_.get(at)) ? kSolid : kOpen);
    }
    return {height_at({columns[0], columns[1], columns[3], columns[4]}),
            height_at({columns[1], columns[2], columns[4], columns[5]}),
            height_at({columns[4], columns[5], columns[7], columns[8]}),
            height_at({columns[3], columns[4], columns[6], columns[7]})};
  }

  // Returns the height of a fluid at a corner that four columns share, in sixteenths: their mean, in which full voxels
  // count more, so that a lake is level up to its shore. Solid voxels do not count.
  [[nodiscard]] static std::uint8_t height_at(const std::array<int, 4>& columns) {
    int sum = 0;
    int weights = 0;
    for (const int height : columns) {
      if (height == 9) return kShapeUnits;
      if (height == kSolid) continue;
      const int weight = height == 8 ? 10 : 1;
      sum += weight * height;
      weights += weight;
    }
    return static_cast<std::uint8_t>(weights == 0 ? kShapeUnits
                                                  : (sum * kShapeUnits + 9 * weights / 2) / (9 * weights));
  }

  const Voxels& voxels_;
  const VoxelRegistry& types_;
};

struct NearVoxels {
  const Neighbourhood& chunks;
  [[nodiscard]] VoxelType get(IVec3 at) const { return chunks.get(at); }
  [[nodiscard]] std::uint32_t state(IVec3 at) const { return chunks.data(at).state; }
  [[nodiscard]] IVec3 origin() const { return chunks.origin; }
};

struct GridVoxels {
  const Grid& grid;
  [[nodiscard]] VoxelType get(IVec3 at) const { return grid.get(at); }
  [[nodiscard]] std::uint32_t state(IVec3 at) const { return grid.data(at).state; }
  [[nodiscard]] static IVec3 origin() { return IVec3(0); }
};

bool has_shapes(const Chunk* chunk, const VoxelRegistry& types) {
  if (chunk == nullptr) return false;
  const std::vector<VoxelType> all = chunk->types();
  return std::any_of(all.begin(), all.end(), [&](VoxelType type) { return types.is_shaped(type); });
}

// Returns the number of a voxel in its chunk: x + 64 y + 4096 z.
std::uint32_t number_of(IVec3 local) {
  return static_cast<std::uint32_t>(local.x + kChunkEdge * (local.y + kChunkEdge * local.z));
}

}  // namespace

DBox bounds_of(const ModelBox& box) {
  if (!box.is_turned) return {DVec3(box.min), DVec3(box.max)};
  const glm::dmat3 rows(DVec3(box.inverse[0]), DVec3(box.inverse[1]), DVec3(box.inverse[2]));
  const glm::dmat3 matrix = glm::inverse(glm::transpose(rows));
  DBox bounds;
  for (int corner = 0; corner < 8; ++corner) {
    bounds.extend(DVec3(box.origin) + matrix * box_corner(DBox{DVec3(box.min), DVec3(box.max)}, corner));
  }
  return bounds;
}

const ShapeModel* shape_at(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 local) {
  const NearVoxels voxels{chunks};
  return SurroundingsFinder(voxels, types).model(local, chunks.get(local));
}

const ShapeModel* shape_at(const Grid& grid, const VoxelRegistry& types, IVec3 voxel) {
  const GridVoxels voxels{grid};
  return SurroundingsFinder(voxels, types).model(voxel, grid.get(voxel));
}

InnerFluid fluid_at(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 local) {
  const NearVoxels voxels{chunks};
  return SurroundingsFinder(voxels, types).fluid(local, chunks.get(local));
}

InnerFluid fluid_at(const Grid& grid, const VoxelRegistry& types, IVec3 voxel) {
  const GridVoxels voxels{grid};
  return SurroundingsFinder(voxels, types).fluid(voxel, grid.get(voxel));
}

NearPlanes::NearPlanes(const Neighbourhood& chunks)
    : chunks_(chunks),
      types_(std::size_t{4} * kPlane),
      changes_(std::size_t{4} * kRow),
      is_other_at_end_(changes_.size()) {
  const bool has_data = std::ranges::any_of(
      chunks.chunks, [](const Chunk* chunk) { return chunk != nullptr && chunk->data_count() != 0; });
  if (has_data) states_.resize(types_.size());
}

void NearPlanes::read(int z) {
  QUOIN_ASSERT(z >= -1 && z <= kChunkEdge, "-1 <= z <= 64");
  for (int y = -1; y <= kChunkEdge; ++y) {
    const IVec3 of = chunk_of(IVec3{0, y, z});
    const IVec3 local = local_of(IVec3{0, y, z});
    VoxelType* const row = &types_[place_of({0, y, z})];
    const Chunk* const chunk = chunks_.at(0, of.y, of.z);
    if (chunk == nullptr) {
      std::fill_n(row, kChunkEdge, kAir);
    } else {
      chunk->read_row(local.y, local.z, std::span<VoxelType, kChunkEdge>(row, std::size_t{kChunkEdge}));
    }
    row[-1] = chunks_.get({-1, y, z});
    row[kChunkEdge] = chunks_.get({kChunkEdge, y, z});
    std::uint64_t& changes = changes_[change_of(y, z)];
    changes = changes_in(row);
    std::uint8_t& is_other_at_end = is_other_at_end_[change_of(y, z)];
    is_other_at_end = row[kChunkEdge] != row[kChunkEdge - 1] ? 1 : 0;
    if (states_.empty()) continue;
    std::uint32_t* const states = &states_[place_of({0, y, z})];
    std::fill_n(states, kChunkEdge, 0U);
    states[-1] = chunks_.data({-1, y, z}).state;
    states[kChunkEdge] = chunks_.data({kChunkEdge, y, z}).state;
    if (chunk != nullptr) {
      RowStates known = RowStates::of(*chunk, local.y, local.z);
      for (; known.voxels != 0; known.voxels &= known.voxels - 1) {
        states[std::countr_zero(known.voxels)] = *known.states++;
      }
    }
    for (int x = 0; x < kChunkEdge; ++x) changes |= std::uint64_t{states[x] != states[x - 1]} << x;
    is_other_at_end |= states[kChunkEdge] != states[kChunkEdge - 1] ? 1 : 0;
  }
}

std::uint64_t NearPlanes::changes_in(const VoxelType* row) {
  std::array<std::uint64_t, kChunkEdge / 4> others;
  for (std::size_t i = 0; i < others.size(); ++i) {
    std::uint64_t before = 0;
    std::memcpy(&before, row + 4 * i - 1, sizeof(before));
    std::memcpy(&others[i], row + 4 * i, sizeof(before));
    others[i] ^= before;
  }
  return ~packed_row::equal_mask(others.data(), 16, 0);
}

std::uint64_t NearPlanes::repeated(int y, int z) const {
  std::uint64_t changes = 0;
  for (int i = 0; i < 9; ++i) changes |= changes_[change_of(y + i % 3 - 1, z + i / 3 - 1)];
  constexpr std::uint64_t kEnds = std::uint64_t{1} << 63 | 1U;  // their neighbours are not compared
  return ~(changes | changes << 1 | changes >> 1 | kEnds);
}

std::optional<std::array<std::uint64_t, 9>> NearPlanes::rows_around(int y, int z) const {
  std::array<std::uint64_t, 9> rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const IVec3 at{0, y + static_cast<int>(i % 3) - 1, z + static_cast<int>(i / 3) - 1};
    const std::size_t row = change_of(at.y, at.z);
    if ((changes_[row] | is_other_at_end_[row]) != 0) return std::nullopt;
    rows[i] = std::uint64_t{get(at)} << 32 | state(at);
  }
  return rows;
}

const ShapeModel* shape_at(const NearPlanes& planes, const VoxelRegistry& types, IVec3 local) {
  return SurroundingsFinder(planes, types).model(local, planes.get(local));
}

bool covers(const VoxelRegistry& types, VoxelType neighbour, const ShapeModel* neighbour_model, VoxelType type,
            Direction direction, const SideMask& mask) {
  if (neighbour == kAir) return false;
  if (neighbour_model == nullptr) return types.is_opaque(neighbour);
  const VoxelProperties& properties = types[neighbour];
  if (properties.visibility != Visibility::Opaque) {
    if (!types.joins(neighbour, type)) return false;
    // Both fluids have the same heights at their common corners.
    if (types.fluid_groups(neighbour) != 0) return true;
  }
  const SideMask& side = neighbour_model->sides[static_cast<std::size_t>(opposite(direction))];
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if ((mask[i] & ~side[i]) != 0) return false;
  }
  return true;
}

// Makes the lists of a chunk. Equal lists are made once.
class ShapeIndex::Lists {
 public:
  Lists(const VoxelRegistry& types, ChunkShapes& out) : types_(types), out_(out) {}

  // Adds the shape of a voxel of the chunk, in any order. `touched`: the voxels of the chunk that it touches.
  void add(IVec3 local, VoxelType type, const ShapeModel& model, const IBox& touched) {
    const bool is_inside = kWholeChunk.contains(local);
    if (is_inside) put(local, list_of_one({{}, type, &model, false}));
    if (is_inside && touched == IBox{local, local + 1}) return;
    for (int z = touched.min.z; z < touched.max.z; ++z) {
      for (int y = touched.min.y; y < touched.max.y; ++y) {
        for (int x = touched.min.x; x < touched.max.x; ++x) {
          const IVec3 at{x, y, z};
          if (at != local) others_.push_back({number_of(at), {offset_of(local - at), type, &model, false}});
        }
      }
    }
  }

  // Adds the fluid of a voxel of the chunk, next to its shape.
  void add(IVec3 local, const InnerFluid& fluid) {
    if (kWholeChunk.contains(local)) others_.push_back({number_of(local), {{}, fluid.type, fluid.model, true}});
  }
  // Adds a voxel of the chunk that is a cube.
  void add_cube(IVec3 local) {
    if (cubes_.empty()) cubes_.resize(std::size_t{kChunkEdge} * kChunkEdge);
    cubes_[number_of(local) / kChunkEdge] |= std::uint64_t{1} << local.x;
  }

  // Writes the lists. Returns false if there are none.
  bool finish(IVec3 origin) {
    add_others();
    out_.cubes = std::move(cubes_);
    if (used_ == 0) return !out_.cubes.empty();
    for (std::uint64_t left = used_; left != 0; left &= left - 1) {
      pack_brick(static_cast<std::size_t>(std::countr_zero(left)));
    }
    const auto range = [](std::uint64_t mask) { return std::pair(std::countr_zero(mask), std::bit_width(mask)); };
    for (int axis = 0; axis < 3; ++axis) {
      const auto [first, end] = range(masks_[static_cast<std::size_t>(axis)]);
      out_.bounds.min[axis] = origin[axis] + first;
      out_.bounds.max[axis] = origin[axis] + end;
    }
    out_.blocks.shrink_to_fit();
    out_.cells.shrink_to_fit();
    out_.shapes.shrink_to_fit();
    out_.boxes.shrink_to_fit();
    return true;
  }

 private:
  struct Entry {
    std::array<std::int8_t, 3> offset{};
    VoxelType type = kAir;
    const ShapeModel* model = nullptr;
    bool is_inner = false;  // a fluid next to the voxel's own shape

    // By the order of lists: the own one, z, y, x; then by anything, to find equal lists.
    [[nodiscard]] auto order() const { return std::tuple(!is_inner, offset[2], offset[1], offset[0], type, model); }
    bool operator<(const Entry& other) const { return order() < other.order(); }
  };
  struct Touch {
    std::uint32_t cell = 0;
    Entry entry;
    bool operator<(const Touch& other) const { return cell != other.cell ? cell < other.cell : entry < other.entry; }
  };

  static std::array<std::int8_t, 3> offset_of(IVec3 from) {
    return {static_cast<std::int8_t>(from.x), static_cast<std::int8_t>(from.y), static_cast<std::int8_t>(from.z)};
  }
  static IVec3 local_of_number(std::uint32_t number) {
    const auto n = static_cast<int>(number);
    return {n % kChunkEdge, n / kChunkEdge % kChunkEdge, n / kChunkEdge / kChunkEdge};
  }

  void put(IVec3 local, std::uint32_t list) {
    if (numbers_.empty()) numbers_.resize(kChunkVoxels);  // most chunks next to shapes have none
    numbers_[number_of(local)] = list + 1;
    used_ |= std::uint64_t{1} << ChunkShapes::part_of(local, 4);
  }

  [[nodiscard]] std::uint32_t list_of_one(const Entry& entry) {
    if (last_ != nullptr && last_->first.model == entry.model && last_->first.type == entry.type) return last_->second;
    const auto [found, is_new] = single_.try_emplace(entry, 0);
    if (is_new) found->second = write({&entry, 1});
    last_ = &*found;
    return found->second;
  }

  // Adds the shapes that touch voxels other than their own.
  void add_others() {
    std::sort(others_.begin(), others_.end());
    std::vector<Entry> list;
    for (std::size_t i = 0; i < others_.size();) {
      const std::uint32_t cell = others_[i].cell;
      list.clear();
      if (!numbers_.empty() && numbers_[cell] != 0) {
        const ListedShape& own = out_.shapes[numbers_[cell] - 1];
        list.push_back({{}, own.type, own.model, false});
      }
      for (; i < others_.size() && others_[i].cell == cell; ++i) list.push_back(others_[i].entry);
      const auto [found, is_new] = several_.try_emplace(list, 0);
      if (is_new) found->second = write(list);
      put(local_of_number(cell), found->second);
    }
  }

  // Appends a list. Returns the index of its first shape.
  [[nodiscard]] std::uint32_t write(std::span<const Entry> list) {
    const auto first = static_cast<std::uint32_t>(out_.shapes.size());
    for (const Entry& entry : list) {
      ListedShape& shape = out_.shapes.emplace_back();
      shape.offset = entry.offset;
      shape.type = entry.type;
      shape.is_opaque = types_[entry.type].visibility == Visibility::Opaque;
      shape.is_inner = entry.is_inner;
      shape.model = entry.model;
      shape.first_box = boxes_of(*entry.model);
      shape.box_count = static_cast<std::uint32_t>(entry.model->boxes.size());
    }
    out_.shapes[first].count = static_cast<std::uint8_t>(list.size());
    return first;
  }

  // Returns the index of the first box of a model.
  [[nodiscard]] std::uint32_t boxes_of(const ShapeModel& model) {
    const auto [found, is_new] = models_.try_emplace(&model, static_cast<std::uint32_t>(out_.boxes.size()));
    if (!is_new) return found->second;
    for (const ModelBox& box : model.boxes) {
      out_.boxes.push_back({{box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z}, &box});
    }
    return found->second;
  }

  void pack_brick(std::size_t brick) {
    const IVec3 corner = unit(brick) * 16;
    out_.bricks[brick] = static_cast<std::uint8_t>(out_.blocks.size() / 64 + 1);
    for (std::size_t block = 0; block < 64; ++block) pack_block(corner + unit(block) * 4);
  }

  void pack_block(IVec3 corner) {
    ChunkShapes::Block& block = out_.blocks.emplace_back();
    block.first = static_cast<std::uint32_t>(out_.cells.size());
    bool is_uniform = true;
    for (std::size_t bit = 0; bit < 64; ++bit) {
      const std::uint32_t number = numbers_[number_of(corner + unit(bit))];
      if (number == 0) continue;
      block.touched |= std::uint64_t{1} << bit;
      out_.cells.push_back(number - 1);
      is_uniform &= out_.cells[block.first] == number - 1;
    }
    if (block.touched == 0) return;
    if (is_uniform) out_.cells.resize(block.first + std::size_t{1});
    block.ranks = is_uniform ? 0 : ~std::uint32_t{0};
    for (std::uint64_t left = block.touched; left != 0; left &= left - 1) {
      const IVec3 at = corner + unit(static_cast<std::size_t>(std::countr_zero(left)));
      for (int axis = 0; axis < 3; ++axis) masks_[static_cast<std::size_t>(axis)] |= std::uint64_t{1} << at[axis];
    }
  }

  // Returns the coordinates of a number x + 4 y + 16 z.
  static IVec3 unit(std::size_t number) {
    const auto n = static_cast<int>(number);
    return {n & 3, n >> 2 & 3, n >> 4};
  }

  const VoxelRegistry& types_;
  ChunkShapes& out_;
  std::vector<std::uint64_t> cubes_;      // rows along x, by y + 64 z; empty: none
  std::vector<std::uint32_t> numbers_;    // 1 + the first shape of each voxel's list; 0: none
  std::uint64_t used_ = 0;                // bricks
  std::array<std::uint64_t, 3> masks_{};  // touched coordinates by axis
  std::vector<Touch> others_;
  std::map<Entry, std::uint32_t> single_;
  const std::pair<const Entry, std::uint32_t>* last_ = nullptr;  // in `single_`
  std::map<std::vector<Entry>, std::uint32_t> several_;
  std::unordered_map<const ShapeModel*, std::uint32_t> models_;
};

std::shared_ptr<const ShapeIndex::ChunkShapes> ShapeIndex::made(const Grid& grid, const Types& types, IVec3 chunk) {
  const Neighbourhood near = grid.neighbourhood(chunk);
  std::array<bool, 27> is_read{};
  bool is_any = false;
  for (std::size_t i = 0; i < 27; ++i) is_any |= is_read[i] = has_shapes(near.chunks[i], types.registry);
  if (!is_any) return nullptr;

  auto result = std::make_shared<ChunkShapes>();
  Lists lists(types.registry, *result);
  const NearVoxels voxels{near};
  const SurroundingsFinder finder(voxels, types.registry);
  std::array<VoxelType, kChunkEdge> row;
  // Most voxels of water have the model of the voxel before.
  const ShapeModel* last = nullptr;
  VoxelType last_type = kAir;
  bool is_last_cube = false;
  const auto is_cube = [&](const ShapeModel& model, VoxelType type) {
    if (&model != last || type != last_type) is_last_cube = quoin::is_cube(model, types.registry[type].faces);
    last = &model;
    last_type = type;
    return is_last_cube;
  };
  const auto add = [&](IVec3 local, VoxelType type) {
    const ShapeModel& model = *finder.model(local, type);
    const Types::Kind kind = types.kinds[type];
    if (kind == Types::Kind::Glass && is_cube(model, type)) {
      if (kWholeChunk.contains(local)) lists.add_cube(local);
      return;
    }
    lists.add(local, type, model, intersect({local + model.cells.min, local + model.cells.max}, kWholeChunk));
    if (kind != Types::Kind::HoldsFluid) return;
    if (const InnerFluid fluid = finder.fluid(local, type); fluid.model != nullptr) lists.add(local, fluid);
  };
  // Shapes of neighbouring chunks matter only within one voxel of this chunk.
  for (int z = -1; z <= kChunkEdge; ++z) {
    for (int y = -1; y <= kChunkEdge; ++y) {
      for (int dx = -1; dx <= 1; ++dx) {
        const IVec3 first{dx * kChunkEdge, y, z};
        const IVec3 of = chunk_of(first);
        const std::size_t i = Neighbourhood::index(of.x, of.y, of.z);
        if (!is_read[i]) continue;
        const IVec3 local = local_of(first);
        near.chunks[i]->read_row(local.y, local.z, row);
        const int begin = dx < 0 ? kChunkEdge - 1 : 0;
        const int end = dx > 0 ? 1 : kChunkEdge;
        for (int x = begin; x < end; ++x) {
          const VoxelType type = row[static_cast<std::size_t>(x)];
          if (type < types.kinds.size() && types.kinds[type] != Types::Kind::Cube) add(first + IVec3(x, 0, 0), type);
        }
      }
    }
  }
  return lists.finish(chunk * kChunkEdge) ? result : nullptr;
}

ShapeIndex::Types::Types(const VoxelRegistry& types) : registry(types), kinds(types.has_shapes() ? types.size() : 0) {
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    if (!types.is_shaped(type)) continue;
    const VoxelProperties& properties = types[type];
    const bool is_glass = properties.visibility == Visibility::Transparent &&
                          (properties.faces.empty() || std::ranges::all_of(kDirections, [&](Direction direction) {
                             return properties.faces[direction].alpha == FaceAlpha::Translucent;
                           }));
    kinds[i] = properties.shapes.rules().fluid ? Kind::HoldsFluid : is_glass ? Kind::Glass : Kind::Shaped;
  }
}

void ShapeIndex::build(const Grid& grid, const VoxelRegistry& types) {
  ShapeIndex next;
  next.types_ = Types(types);
  std::set<IVec3, ByZyx> chunks;  // with shapes, and around them
  for (const IVec3 chunk : types.has_shapes() ? grid.chunks() : std::vector<IVec3>()) {
    if (!has_shapes(grid.find_chunk(chunk), types)) continue;
    for (int i = 0; i < 27; ++i) chunks.insert(chunk + Neighbourhood::offset(i));
  }
  for (const IVec3 chunk : chunks) {
    if (std::shared_ptr<const ChunkShapes> shapes = made(grid, next.types_, chunk)) {
      next.chunks_.emplace(chunk, std::move(shapes));
    }
  }
  *this = std::move(next);
}

std::vector<IVec3> ShapeIndex::chunks() const {
  std::vector<IVec3> chunks;
  chunks.reserve(chunks_.size());
  for (const auto& [chunk, shapes] : chunks_) chunks.push_back(chunk);
  std::sort(chunks.begin(), chunks.end(), ByZyx());
  return chunks;
}

std::vector<IVec3> ShapeIndex::update(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes,
                                      const DataChanges& data) {
  std::set<IVec3, ByZyx> chunks;
  if (changes.all || data.all) {
    ShapeIndex next;
    next.build(grid, types);
    for (const auto& [chunk, shapes] : chunks_) chunks.insert(chunk);
    for (const auto& [chunk, shapes] : next.chunks_) chunks.insert(chunk);
    std::vector<IVec3> all(chunks.begin(), chunks.end());
    *this = std::move(next);
    return all;
  }
  // No voxel has a new type except within the changes.
  Types next(types);
  if (next.kinds.empty()) {
    types_ = std::move(next);
    return {};
  }
  const auto add = [&](IVec3 chunk, const IBox& box) {
    // A shape follows its neighbours and reaches one voxel outside.
    const IVec3 origin = chunk * kChunkEdge;
    const IVec3 first = chunk_of(origin + box.min - 2);
    const IVec3 last = chunk_of(origin + box.max + 1);
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) chunks.insert({x, y, z});
      }
    }
  };
  for (const ChunkChange& change : changes.items_unless_all()) add(change.chunk, change.box);
  for (const DataChange& change : data.items_unless_all()) add(change.chunk, change.box);
  Chunks fresh;
  for (const IVec3 chunk : chunks) {
    if (std::shared_ptr<const ChunkShapes> shapes = made(grid, next, chunk)) fresh.emplace(chunk, std::move(shapes));
  }
  std::vector<IVec3> all(chunks.begin(), chunks.end());
  chunks_.reserve(chunks_.size() + fresh.size());
  // From here on nothing throws: there is room, and nodes are moved.
  types_ = std::move(next);
  for (const IVec3 chunk : all) chunks_.erase(chunk);
  chunks_.merge(fresh);
  return all;
}

ShapesAtVoxel ShapeIndex::at(IVec3 voxel) const {
  return Reader(*this).at(voxel);
}

std::uint64_t ShapeIndex::touched_row(IVec3 voxel) const {
  const auto found = chunks_.find(chunk_of(voxel));
  return found == chunks_.end() ? 0 : found->second->row(voxel);
}

std::span<const std::uint64_t> ShapeIndex::cubes_in(IVec3 chunk) const {
  const auto found = chunks_.find(chunk);
  return found == chunks_.end() ? std::span<const std::uint64_t>() : std::span(found->second->cubes);
}

bool ShapeIndex::is_cube(IVec3 voxel) const {
  const std::span<const std::uint64_t> rows = cubes_in(chunk_of(voxel));
  if (rows.empty()) return false;
  const IVec3 local = local_of(voxel);
  return (rows[number_of(local) / kChunkEdge] >> local.x & 1U) != 0;
}

IBox ShapeIndex::bounds() const {
  IBox bounds;
  for (const auto& [chunk, shapes] : chunks_) bounds = unite(bounds, shapes->bounds);
  return bounds;
}

std::size_t ShapeIndex::bytes() const {
  std::size_t bytes = sizeof(*this);
  for (const auto& [chunk, shapes] : chunks_) {
    bytes += sizeof(ChunkShapes) + shapes->blocks.capacity() * sizeof(ChunkShapes::Block) +
             shapes->cells.capacity() * sizeof(std::uint32_t) + shapes->shapes.capacity() * sizeof(ListedShape) +
             shapes->boxes.capacity() * sizeof(ListedBox) + shapes->cubes.capacity() * sizeof(std::uint64_t);
  }
  return bytes;
}

}  // namespace quoin
