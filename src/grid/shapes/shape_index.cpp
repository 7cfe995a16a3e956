#include "grid/shapes/shape_index.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

// Returns the shapes' rules of a type, or null if it has none.
const ShapeRules* rules_of(const VoxelRegistry& types, VoxelType type) {
  return types.is_shaped(type) ? &types[type].shapes.rules() : nullptr;
}

// Finds the influence of the neighbours of a voxel on its shape. `Voxels` has `get(IVec3)` and `state(IVec3)`.
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
        around.heights = heights(voxel, type);
        break;
    }
    return &properties.shapes.model(state, orientation, around);
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

  static Direction opposite(Direction direction) { return static_cast<Direction>(static_cast<int>(direction) ^ 1); }

  // Returns the height of a fluid in a voxel in ninths, or nullopt for other voxels. 9: the fluid fills its voxel.
  [[nodiscard]] std::optional<int> ninths(IVec3 voxel, VoxelType fluid) const {
    if (voxels_.get(voxel) != fluid) return std::nullopt;
    if (voxels_.get(voxel + IVec3(0, 1, 0)) == fluid) return 9;
    const std::uint32_t state = types_[fluid].state_bits == 0 ? 0 : voxels_.state(voxel);
    return (state & 8U) != 0 ? 9 : 8 - static_cast<int>(state & 7U);
  }

  [[nodiscard]] std::array<std::uint8_t, 4> heights(IVec3 voxel, VoxelType fluid) const {
    if (ninths(voxel, fluid) == 9) return {16, 16, 16, 16};
    std::array<std::uint8_t, 4> result{};
    constexpr std::array<std::array<int, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (std::size_t i = 0; i < 4; ++i) result[i] = height_at(voxel + IVec3(kCorners[i][0], 0, kCorners[i][1]), fluid);
    return result;
  }

  // Returns the height of a fluid at a corner that four voxels share, the greatest being `corner`, in sixteenths: their
  // mean, in which full voxels count more, so that a lake is level up to its shore. Solid voxels do not count.
  [[nodiscard]] std::uint8_t height_at(IVec3 corner, VoxelType fluid) const {
    int sum = 0;
    int weights = 0;
    for (int i = 0; i < 4; ++i) {
      const IVec3 at = corner - IVec3(i & 1, 0, i >> 1);
      if (const std::optional<int> height = ninths(at, fluid)) {
        if (*height == 9) return kShapeUnits;
        const int weight = *height == 8 ? 10 : 1;
        sum += weight * *height;
        weights += weight;
      } else if (!types_.is_opaque(voxels_.get(at))) {
        ++weights;
      }
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
};

struct GridVoxels {
  const Grid& grid;
  [[nodiscard]] VoxelType get(IVec3 at) const { return grid.get(at); }
  [[nodiscard]] std::uint32_t state(IVec3 at) const { return grid.data(at).state; }
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

std::size_t row_of(IVec3 local) {
  return static_cast<std::size_t>(local.y + kChunkEdge * local.z);
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

bool covers(const VoxelRegistry& types, VoxelType neighbour, const ShapeModel* neighbour_model, VoxelType type,
            Direction direction, const SideMask& mask) {
  if (neighbour == kAir) return false;
  if (neighbour_model == nullptr) return types.is_opaque(neighbour);
  const VoxelProperties& properties = types[neighbour];
  if (properties.visibility != Visibility::Opaque) {
    if (neighbour != type) return false;
    // Both fluids have the same heights at their common corners.
    if (properties.shapes.rules().neighbours == ShapeNeighbours::Fluid) return true;
  }
  const SideMask& side = neighbour_model->sides[static_cast<std::size_t>(direction) ^ 1U];
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if ((mask[i] & ~side[i]) != 0) return false;
  }
  return true;
}

std::shared_ptr<const ShapeIndex::ChunkShapes> ShapeIndex::made(const Grid& grid, IVec3 chunk) const {
  const Neighbourhood near = grid.neighbourhood(chunk);
  std::array<bool, 27> is_read{};
  bool is_any = false;
  for (std::size_t i = 0; i < 27; ++i) is_any |= is_read[i] = has_shapes(near.chunks[i], types_);
  if (!is_any) return nullptr;

  struct Touch {
    std::uint32_t cell;
    PlacedShape shape;  // `voxel` relative to the chunk
  };
  std::vector<Touch> touches;
  const NearVoxels voxels{near};
  const SurroundingsFinder finder(voxels, types_);
  std::array<VoxelType, kChunkEdge> row;
  const auto add = [&](IVec3 local, VoxelType type) {
    const ShapeModel* model = finder.model(local, type);
    const IBox cells = intersect({local + model->cells.min, local + model->cells.max}, kWholeChunk);
    for (int z = cells.min.z; z < cells.max.z; ++z) {
      for (int y = cells.min.y; y < cells.max.y; ++y) {
        for (int x = cells.min.x; x < cells.max.x; ++x) {
          touches.push_back({number_of({x, y, z}), {local, type, model}});
        }
      }
    }
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
          if (type < is_shaped_.size() && is_shaped_[type] != 0) add(first + IVec3(x, 0, 0), type);
        }
      }
    }
  }
  if (touches.empty()) return nullptr;
  const auto order = [](const Touch& t) {
    const IVec3 v = t.shape.voxel;
    return std::tuple(t.cell, number_of(v) != t.cell, v.z, v.y, v.x);
  };
  std::sort(touches.begin(), touches.end(), [&](const Touch& a, const Touch& b) { return order(a) < order(b); });

  auto result = std::make_shared<ChunkShapes>();
  result->touched.assign(kChunkEdge * kChunkEdge, 0);
  result->first.assign(kChunkEdge * kChunkEdge, 0);
  const IVec3 origin = chunk * kChunkEdge;
  std::optional<std::uint32_t> last;
  for (const Touch& touch : touches) {
    if (touch.cell != last) {
      last = touch.cell;
      result->starts.push_back(static_cast<std::uint32_t>(result->shapes.size()));
      result->touched[touch.cell / kChunkEdge] |= std::uint64_t{1} << (touch.cell % kChunkEdge);
      const auto cell = static_cast<int>(touch.cell);
      const IVec3 at =
          origin + IVec3(cell % kChunkEdge, cell / kChunkEdge % kChunkEdge, cell / kChunkEdge / kChunkEdge);
      result->bounds = unite(result->bounds, {at, at + 1});
    }
    result->shapes.push_back(touch.shape);
    result->shapes.back().voxel += origin;
  }
  result->starts.push_back(static_cast<std::uint32_t>(result->shapes.size()));
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < result->touched.size(); ++i) {
    result->first[i] = count;
    count += static_cast<std::uint32_t>(std::popcount(result->touched[i]));
  }
  return result;
}

void ShapeIndex::rebuild(const Grid& grid, IVec3 chunk) {
  if (std::shared_ptr<const ChunkShapes> shapes = made(grid, chunk)) {
    chunks_[chunk] = std::move(shapes);
  } else {
    chunks_.erase(chunk);
  }
}

void ShapeIndex::take_types(const VoxelRegistry& types) {
  types_ = types;
  is_shaped_.assign(types.has_shapes() ? types.size() : 0, 0);
  for (std::size_t type = 0; type < is_shaped_.size(); ++type) {
    is_shaped_[type] = types.is_shaped(static_cast<VoxelType>(type)) ? 1 : 0;
  }
}

void ShapeIndex::build(const Grid& grid, const VoxelRegistry& types) {
  chunks_.clear();
  take_types(types);
  if (is_shaped_.empty()) return;
  std::set<IVec3, ByZyx> chunks;  // with shapes, and around them
  for (const IVec3 chunk : grid.chunks()) {
    if (!has_shapes(grid.find_chunk(chunk), types_)) continue;
    for (int i = 0; i < 27; ++i) chunks.insert(chunk + Neighbourhood::offset(i));
  }
  for (const IVec3 chunk : chunks) rebuild(grid, chunk);
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
    for (const auto& [chunk, shapes] : chunks_) chunks.insert(chunk);
    build(grid, types);
    for (const auto& [chunk, shapes] : chunks_) chunks.insert(chunk);
    return {chunks.begin(), chunks.end()};
  }
  // No voxel has a new type except within the changes.
  take_types(types);
  if (is_shaped_.empty()) return {};
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
  for (const IVec3 chunk : chunks) rebuild(grid, chunk);
  return {chunks.begin(), chunks.end()};
}

std::span<const PlacedShape> ShapeIndex::at(IVec3 voxel) const {
  return Reader(*this).at(voxel);
}

std::uint64_t ShapeIndex::touched_row(IVec3 voxel) const {
  const auto found = chunks_.find(chunk_of(voxel));
  return found == chunks_.end() ? 0 : found->second->touched[row_of(local_of(voxel))];
}

IBox ShapeIndex::bounds() const {
  IBox bounds;
  for (const auto& [chunk, shapes] : chunks_) bounds = unite(bounds, shapes->bounds);
  return bounds;
}

std::size_t ShapeIndex::bytes() const {
  std::size_t bytes = sizeof(*this);
  for (const auto& [chunk, shapes] : chunks_) {
    bytes += sizeof(ChunkShapes) + shapes->touched.capacity() * sizeof(std::uint64_t) +
             (shapes->first.capacity() + shapes->starts.capacity()) * sizeof(std::uint32_t) +
             shapes->shapes.capacity() * sizeof(PlacedShape);
  }
  return bytes;
}

}  // namespace quoin
