// The part of voxels with shapes in a chunk's mesh: their faces, and the faces of cubes that they hide or darken.
//
//   listed rows -> voxels, models            by type, state and the neighbours' bits
//   keys of faces                            of cubes behind shapes and next to them: passes leave them out
//   eighths, sides                           a byte per voxel around shapes: who darkens and who covers
//   queries -> answers                       the occlusion of faces of shapes, and of cubes next to them

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <span>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/mesh/occlusion.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"
#include "mesh/blocky/blocky_mesher.h"

namespace quoin::blocky {

bool holds_shapes(const Chunk* chunk, const VoxelRegistry& types) {
  if (chunk == nullptr) return false;
  const ChunkStorage* voxels = ChunkStorage::of(*chunk);
  if (voxels == nullptr) return types.is_shaped(*chunk->uniform());
  if (voxels->direct()) return true;
  for (std::size_t i = 0; i < voxels->palette.size(); ++i) {
    if (voxels->counts[i] != 0 && types.is_shaped(voxels->palette[i])) return true;
  }
  return false;
}

const ShapedVoxel* ShapedVoxels::at(const IVec3& local) const {
  const auto word = static_cast<std::size_t>(word_index(local.z, local.y));
  const std::uint64_t row = rows.words[word];
  const std::uint64_t before = ends.words[word] >> 63;
  if (local.x < 0) return before != 0 ? &voxels[first[row_of(local.y, local.z)]] : nullptr;
  if (local.x < kChunkEdge ? (row >> local.x & 1U) == 0 : (ends.words[word] & 1U) == 0) return nullptr;
  const std::uint64_t lower = local.x < kChunkEdge ? row & ((std::uint64_t{1} << local.x) - 1) : row;
  return &voxels[first[row_of(local.y, local.z)] + before + packed_row::count_bits(lower)];
}

namespace {

// The faces of a cube, by direction.
struct CubeFaces {
  VoxelShapes shapes{VoxelShape::box(IVec3(0), IVec3(kShapeUnits))};
  std::array<const ModelFace*, 6> faces{};
  std::array<PackedFace, 6> packed{};

  CubeFaces() {
    const ShapeModel& model = shapes.model(0, {}, {});
    for (std::size_t i = 0; i < model.faces.size(); ++i) {
      const auto direction = static_cast<std::size_t>(model.faces[i].direction);
      faces[direction] = &model.faces[i];
      packed[direction] = model.packed_faces[i];
    }
  }

  static const CubeFaces& get() {
    static const CubeFaces all;
    return all;
  }
};

// Finds the models of a job's shaped voxels.
class ModelFinder {
 public:
  ModelFinder(const Job& job, bool row_ends, const Scratch& s)
      : job_(job), shapes_(*job.shapes), row_ends_(row_ends), opaque_(s.z.opaque), ends_(s.z.ends) {
    ++shapes_.job;
  }

  // Appends a voxel. Its model is null if it follows the neighbours.
  void add(const IVec3& local, VoxelType type, std::uint32_t state) {
    const ShapedVoxels::KnownType& known = known_type(type);
    ShapedVoxel voxel{.local = local,
                      .type = type,
                      .is_opaque = known.is_opaque,
                      .is_fluid = known.fluid_groups != 0,
                      .fluid = known.fluid_groups};
    if (!known.has_state) state = 0;
    if (known.rules->fluid && known.rules->fluid->is_present(state)) {
      voxel.fluid = known.rules->fluid->groups;
      if (job_.region.contains(local)) {
        shapes_.inner.push_back({.holder = static_cast<std::uint32_t>(shapes_.voxels.size()), .shown = {}});
      }
    }
    if (known.only_model != nullptr) {
      voxel.model = known.only_model;
    } else if (known.rules->neighbours == ShapeNeighbours::None) {
      voxel.model = known.uses_position ? &model_by_position(local, type, state) : model(type, state, {});
    } else {
      shapes_.pending.push_back({static_cast<std::uint32_t>(shapes_.voxels.size()), state});
    }
    shapes_.voxels.push_back(voxel);
  }

  // Finds the models of the voxels that follow their neighbours. Requires: all voxels are added.
  void finish() {
    for (const auto& [number, state] : shapes_.pending) {
      ShapedVoxel& voxel = shapes_.voxels[number];
      const ShapedVoxels::KnownType& known = known_type(voxel.type);
      const bool is_connected = known.rules->neighbours == ShapeNeighbours::Connected;
      // The layers do not have all neighbours, and the list of known models is one for all positions.
      if (!job_.region.contains(voxel.local) || known.uses_position) {
        voxel.model = shape_at(*job_.chunks, *job_.types, voxel.local);
      } else if (is_connected) {
        voxel.model = model(voxel.type, state, {.connected = connections(voxel.local, state, known)});
      } else if (is_below_fluid(voxel)) {
        voxel.model = &(*job_.types)[voxel.type].shapes.model(0, {}, {.heights = {16, 16, 16, 16}});
      } else if (known.rules->neighbours == ShapeNeighbours::Stairs && !has_shaped_neighbours(voxel.local)) {
        voxel.model = model(voxel.type, state, {});
      } else {
        voxel.model = shape_at(*job_.chunks, *job_.types, voxel.local);
      }
    }
    std::erase_if(shapes_.inner, [&](InnerShape& each) { return !find_fluid(each); });
  }

 private:
  // Finds the fluid next to a shape. Returns false if no such fluid is registered.
  [[nodiscard]] bool find_fluid(InnerShape& inner) {
    const IVec3 local = shapes_.voxels[inner.holder].local;
    const InnerFluid fluid = fluid_at(*job_.chunks, *job_.types, local);
    if (fluid.model == nullptr) return false;
    inner.shown = {.local = local,
                   .type = fluid.type,
                   .is_opaque = (*job_.types)[fluid.type].visibility == Visibility::Opaque,
                   .is_fluid = true,
                   .fluid = (*job_.types).fluid_groups(fluid.type),
                   .model = fluid.model};
    return true;
  }

  [[nodiscard]] const ShapedVoxels::KnownType& known_type(VoxelType type) {
    ShapedVoxels::KnownType& known = shapes_.known_types[type % shapes_.known_types.size()];
    if (known.job == shapes_.job && known.type == type) return known;
    const VoxelProperties& properties = (*job_.types)[type];
    known = {.job = shapes_.job,
             .type = type,
             .is_opaque = properties.visibility == Visibility::Opaque,
             .has_state = properties.state_bits != 0,
             .is_turned = !properties.orientations.empty(),
             .uses_position = properties.shapes.position_count() > 1,
             .fluid_groups = (*job_.types).fluid_groups(type),
             .rules = &properties.shapes.rules()};
    if (!known.has_state && !known.uses_position && known.rules->neighbours == ShapeNeighbours::None) {
      known.only_model = model(type, 0, {});
    }
    return known;
  }

  // Requires: the type's shapes follow positions, but no neighbours.
  [[nodiscard]] const ShapeModel& model_by_position(const IVec3& local, VoxelType type, std::uint32_t state) const {
    const VoxelProperties& properties = (*job_.types)[type];
    const std::uint32_t position = position_number(job_.chunks->origin + local) % properties.shapes.position_count();
    return properties.shapes.model(state, properties.orientations.of(state),
                                   {.position = static_cast<std::uint16_t>(position)});
  }

  // Requires: the type's shapes are no fluids.
  [[nodiscard]] const ShapeModel* model(VoxelType type, std::uint32_t state, const ShapeSurroundings& around) {
    const std::uint64_t key = std::uint64_t{type} | std::uint64_t{state} << 16 |
                              std::uint64_t{around.connected.bits()} << 48 |
                              static_cast<std::uint64_t>(around.corner) << 56;
    static_assert(sizeof(shapes_.known_models) / sizeof(shapes_.known_models[0]) == 1 << 8);
    ShapedVoxels::KnownModel& known = shapes_.known_models[key * 0x9E37'79B9'7F4A'7C15U >> 56];
    if (known.job != shapes_.job || known.key != key) {
      const VoxelProperties& properties = (*job_.types)[type];
      known = {shapes_.job, key, &properties.shapes.model(state, properties.orientations.of(state), around)};
    }
    return known.model;
  }

  [[nodiscard]] static bool has_bit(const Layer& rows, const Layer& ends, bool has_ends, const IVec3& at) {
    const auto word = static_cast<std::size_t>(word_index(at.z, at.y));
    if (at.x >= 0 && at.x < kChunkEdge) return (rows.words[word] >> at.x & 1U) != 0;
    return has_ends && (at.x < 0 ? ends.words[word] >> 63 : ends.words[word] & 1U) != 0;
  }
  [[nodiscard]] bool is_opaque_cube(const IVec3& at) const { return has_bit(opaque_, ends_, row_ends_, at); }
  [[nodiscard]] bool is_shaped(const IVec3& at) const { return has_bit(shapes_.rows, shapes_.ends, true, at); }

  [[nodiscard]] bool has_shaped_neighbours(const IVec3& local) const {
    return std::ranges::any_of(kDirections, [&](Direction d) { return is_shaped(local + normal_of(d)); });
  }

  // Returns true for a fluid with a fluid of its kind above, which fills its voxel. Requires: a voxel of the region.
  [[nodiscard]] bool is_below_fluid(const ShapedVoxel& voxel) const {
    if (!voxel.is_fluid) return false;
    const ShapedVoxel* const above = shapes_.at(voxel.local + IVec3(0, 1, 0));
    return above != nullptr && (above->fluid & voxel.fluid) != 0;
  }

  // As ShapeSurroundings::connected.
  [[nodiscard]] DirectionSet connections(const IVec3& local, std::uint32_t state,
                                         const ShapedVoxels::KnownType& known) {
    const ShapeRules& rules = *known.rules;
    DirectionSet outward;  // in the grid's directions
    for (const Direction direction : kDirections) {
      const IVec3 at = local + normal_of(direction);
      if (is_opaque_cube(at)) {
        if (rules.connects_to_full_sides) outward.insert(direction);
      } else if (is_shaped(at)) {
        if (connects(*shapes_.at(at), direction, rules)) outward.insert(direction);
      }
    }
    if (!known.is_turned || outward.empty()) return outward;
    const AxisOrientation turn = (*job_.types)[known.type].orientations.of(state);
    DirectionSet connected;
    for (const Direction direction : kDirections) {
      if (outward.contains(turn.apply(direction))) connected.insert(direction);
    }
    return connected;
  }

  // As ShapeNeighbours::Connected. Shapes that follow their neighbours do not count as full.
  [[nodiscard]] bool connects(const ShapedVoxel& other, Direction outward, const ShapeRules& rules) const {
    const ShapeRules& others = (*job_.types)[other.type].shapes.rules();
    if (others.neighbours == ShapeNeighbours::Connected) return (others.groups & rules.groups) != 0;
    return rules.connects_to_full_sides && others.neighbours == ShapeNeighbours::None && other.is_opaque &&
           other.model->covers_side[static_cast<std::size_t>(opposite(outward))];
  }

  const Job& job_;
  ShapedVoxels& shapes_;
  bool row_ends_;
  const Layer& opaque_;
  const Layer& ends_;
};

// Adds the shaped voxels of a row.
void add_row(const Job& job, int y, int z, ModelFinder& models) {
  const ShapedVoxels& shapes = *job.shapes;
  const auto word = static_cast<std::size_t>(word_index(z, y));
  const auto add_beyond = [&](const IVec3& local) {
    models.add(local, job.chunks->get(local), job.chunks->data(local).state);
  };
  const std::uint64_t ends = shapes.ends.words[word];
  if ((ends >> 63) != 0) add_beyond({-1, y, z});
  if (std::uint64_t left = shapes.rows.words[word]; left != 0) {
    const IVec3 of = chunk_of(IVec3{0, y, z});
    const Chunk& chunk = *job.chunks->at(0, of.y, of.z);
    const ChunkStorage* const voxels = ChunkStorage::of(chunk);
    const IVec3 in_chunk = local_of(IVec3{0, y, z});
    RowStates states = RowStates::of(chunk, in_chunk.y, in_chunk.z);
    for (; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      const VoxelType type = voxels == nullptr ? *chunk.uniform() : voxels->type(x, in_chunk.y, in_chunk.z);
      for (; states.voxels != 0 && std::countr_zero(states.voxels) < x; ++states.states) {
        states.voxels &= states.voxels - 1;
      }
      models.add({x, y, z}, type, (states.voxels >> x & 1U) != 0 ? *states.states : 0);
    }
  }
  if ((ends & 1U) != 0) add_beyond({kChunkEdge, y, z});
}

// Rows of a plane as bits: bit y + 1, of -1 to 64.
struct PlaneRows {
  std::uint64_t low = 0;   // -1 to 62
  std::uint64_t high = 0;  // 63 and 64

  void insert(unsigned row) { (row < 64 ? low : high) |= std::uint64_t{1} << (row & 63U); }
  void insert(const PlaneRows& rows) {
    low |= rows.low;
    high |= rows.high;
  }
  // Returns all rows within two of these. Bits of `high` beyond row 64 have no meaning.
  [[nodiscard]] PlaneRows widened() const {
    return {low | low << 1U | low << 2U | low >> 1U | low >> 2U | high << 63U | high << 62U,
            high | high << 1U | high >> 1U | low >> 63U | low >> 62U};
  }
};

// Lists the rows within two of rows with shaped voxels.
void list_near_rows(ShapedVoxels& shapes) {
  std::array<PlaneRows, ShapedVoxels::kEdge + 4> near{};  // by z + 3
  for (const std::uint16_t row : std::span(shapes.listed, shapes.listed_count))
    near[(row >> 7U) + 2U].insert(row & 127U);
  for (PlaneRows& rows : near) rows = rows.widened();
  shapes.near_rows.clear();
  for (std::size_t z = 0; z < ShapedVoxels::kEdge; ++z) {
    PlaneRows rows = near[z];
    for (std::size_t i = 1; i <= 4; ++i) rows.insert(near[z + i]);
    const auto add = [&](std::uint64_t left, int first) {
      for (; left != 0; left &= left - 1) {
        shapes.near_rows.push_back(
            static_cast<std::uint16_t>(z << 7U | static_cast<unsigned>(first + std::countr_zero(left))));
      }
    };
    add(rows.low, 0);
    add(rows.high & 3U, 64);
  }
}

void fill(const Job& job, bool row_ends, const Scratch& s, std::uint8_t value, BlockVector<std::uint8_t>& cells) {
  const ShapedVoxels& shapes = *job.shapes;
  cells.resize(ShapedVoxels::kRows * ShapedVoxels::kCellStride);
  job.kernel->fill_cells(shapes.near_rows.data(), shapes.near_rows.size(), s.z.opaque, row_ends ? &s.z.ends : nullptr,
                         value, cells.data());
}

}  // namespace

const ModelFace& cube_face(Direction direction) {
  return *CubeFaces::get().faces[static_cast<std::size_t>(direction)];
}

void list_shapes(const Job& job, bool row_ends, Scratch& s) {
  ShapedVoxels& shapes = *job.shapes;
  shapes.voxels.clear();
  shapes.quads.clear();
  shapes.pending.clear();
  shapes.inner.clear();
  shapes.has_cells = false;
  ModelFinder models(job, row_ends, s);
  for (const std::uint16_t row : std::span(shapes.listed, shapes.listed_count)) {
    const int y = (row & 127) - 1;
    const int z = (row >> 7) - 1;
    shapes.first[ShapedVoxels::row_of(y, z)] = static_cast<std::uint32_t>(shapes.voxels.size());
    add_row(job, y, z, models);
  }
  models.finish();
}

void hide_faces_behind_shapes(const Job& job, Scratch& s) {
  for (const ShapedVoxel& voxel : job.shapes->voxels) {
    for (unsigned left = voxel.is_opaque ? voxel.model->covered_sides : 0; left != 0; left &= left - 1) {
      const auto side = static_cast<Direction>(std::countr_zero(left));
      const IVec3 behind = voxel.local + normal_of(side);
      if (!job.region.contains(behind)) continue;
      faces_towards(opposite(side), s).words[word_index(behind.z, behind.y)] &= ~(std::uint64_t{1} << behind.x);
    }
  }
}

void find_covered_sides(const Job& job, bool row_ends, Scratch& s) {
  ShapedVoxels& shapes = *job.shapes;
  if (shapes.voxels.empty()) return;
  list_near_rows(shapes);
  fill(job, row_ends, s, ShapedVoxels::kWhole, shapes.sides);
  for (const ShapedVoxel& voxel : shapes.voxels) {
    const ShapeModel& model = *voxel.model;
    const bool is_partial = !voxel.is_opaque || voxel.fluid != 0 || model.touched_sides != model.covered_sides;
    shapes.sides[ShapedVoxels::cell_at(voxel.local)] = static_cast<std::uint8_t>(
        (voxel.is_opaque ? model.covered_sides : 0) | (is_partial ? ShapedVoxels::kPartly : 0));
  }
}

namespace {

// The place of a face in the mesher's order: direction, plane, row, bit, in 3, 6, 6 and 6 bits.
struct FaceOrder {
  // By axis of the direction: the axes of planes, rows and bits; their places in a quad; and the distances in cells.
  static constexpr std::array<std::array<int, 3>, 3> kAxes = {{{0, 1, 2}, {1, 2, 0}, {2, 1, 0}}};
  static constexpr std::array<std::uint32_t, 3> kCells = {1, ShapedVoxels::kCellStride,
                                                          ShapedVoxels::kEdge* ShapedVoxels::kCellStride};

  static std::uint32_t key(Direction direction, const IVec3& voxel) {
    const auto& [plane, row, bit] = kAxes[frame_of(direction).axis];
    return static_cast<std::uint32_t>(direction) << 18U | static_cast<std::uint32_t>(voxel[plane]) << 12U |
           static_cast<std::uint32_t>(voxel[row]) << 6U | static_cast<std::uint32_t>(voxel[bit]);
  }
  static Direction direction(std::uint32_t key) { return static_cast<Direction>(key >> 18U); }
  // Returns the voxel as in a quad: x, y and z in six bits each.
  static std::uint32_t place(std::uint32_t key) {
    const auto& [plane, row, bit] = kAxes[key >> 19U];
    return (key >> 12U & 63U) << 6 * plane | (key >> 6U & 63U) << 6 * row | (key & 63U) << 6 * bit;
  }
  // Returns ShapedVoxels::cell_at of the voxel.
  static std::uint32_t cell(std::uint32_t place) {
    return static_cast<std::uint32_t>(ShapedVoxels::cell_at(IVec3(0))) + (place & 63U) * kCells[0] +
           (place >> 6U & 63U) * kCells[1] + (place >> 12U) * kCells[2];
  }
};

// The faces of a voxel's 26 neighbours in a direction that touch one of some of its eighths, as bits x + 3 y + 9 z of
// the neighbours: [direction][eighths].
using TouchedFaces = std::array<std::array<std::uint32_t, 256>, 6>;

const TouchedFaces& touched_faces() {
  static const TouchedFaces all = [] {
    TouchedFaces made{};
    for (const Direction direction : kDirections) {
      const FaceFrame& frame = frame_of(direction);
      for (int i = 0; i < 9; ++i) {
        if (i == 4) continue;  // the voxel in front of a face does not darken it
        IVec3 offset = -normal_of(direction);
        offset[frame.u] += i % 3 - 1;
        offset[frame.v] += i / 3 - 1;
        const std::size_t number = Neighbourhood::index(offset.x, offset.y, offset.z);
        for (unsigned eighths = 0; eighths < 256; ++eighths) {
          for (unsigned eighth = 0; eighth < 8; ++eighth) {
            bool touches = (eighths >> eighth & 1U) != 0;
            for (int axis = 0; axis < 3; ++axis) {
              const int side = (eighth >> axis & 1U) != 0 ? 1 : -1;
              touches = touches && (offset[axis] == 0 || offset[axis] == side);
            }
            if (touches) made[static_cast<std::size_t>(direction)][eighths] |= std::uint32_t{1} << number;
          }
        }
      }
    }
    return made;
  }();
  return all;
}

// Returns the set bits among the 27 voxels around a position, as bits x + 3 y + 9 z. `ends`: null: none are set. Bits
// beyond the rows and planes -1 and 64 are 0.
unsigned bits_around(const IVec3& local, const Layer& rows, const Layer* ends) {
  unsigned around = 0;
  for (int z = local.z + 1; z >= local.z - 1; --z) {
    if (z < -1 || z > kChunkEdge) {
      around <<= 9U;
      continue;
    }
    for (int y = local.y + 1; y >= local.y - 1; --y) {
      const auto word = static_cast<std::size_t>(word_index(z, y));
      const std::uint64_t row = rows.words[word];
      std::uint64_t three = local.x > 0 ? row >> (local.x - 1) : row << (1 - local.x);
      if ((local.x < 1 || local.x > kChunkEdge - 2) && ends != nullptr) {
        three |= local.x < 1 ? ends->words[word] >> 63 << -local.x : (ends->words[word] & 1U) << (65 - local.x);
      }
      around = around << 3U | (y < -1 || y > kChunkEdge ? 0U : static_cast<unsigned>(three & 7U));
    }
  }
  return around;
}

// The key of a face that leaves the passes over directions: its place, and bit 0 if it is not seen at all.
std::uint32_t key_of(Direction direction, const IVec3& voxel, bool is_hidden) {
  return FaceOrder::key(direction, voxel) << 1U | (is_hidden ? 1U : 0U);
}

// Collects the faces around a shape whose corners it may darken: some occur again for other shapes.
class FacesAround {
 public:
  FacesAround(const Job& job, bool row_ends, Scratch& s)
      : job_(job), shapes_(*job.shapes), s_(s), ends_(row_ends ? &s.z.ends : nullptr), touched_(touched_faces()) {
    for (const Direction direction : kDirections) {
      layers_[static_cast<std::size_t>(direction)] = faces_towards(direction, s).words;
    }
  }

  // Requires: the voxel is opaque.
  void add(const ShapedVoxel& voxel) {
    // Only cubes have such faces. With layers of faces, these have the last word.
    const unsigned cubes =
        job_.has_faces ? bits_around(voxel.local, s_.solid, nullptr) : bits_around(voxel.local, s_.z.opaque, ends_);
    if (cubes == 0) return;
    for (std::size_t d = 0; d < 6; ++d) {
      constexpr std::array<unsigned, 6> kSteps = {1, 1, 3, 3, 9, 9};
      const unsigned in_front = d % 2 == 0 ? cubes >> kSteps[d] : cubes << kSteps[d];
      const unsigned touched = touched_[d][voxel.model->filled_octants];
      for (unsigned left = touched & cubes & (job_.has_faces ? ~0U : ~in_front); left != 0; left &= left - 1) {
        add_face(static_cast<Direction>(d), voxel.local + Neighbourhood::offset(std::countr_zero(left)));
      }
    }
  }

 private:
  void add_face(Direction direction, const IVec3& at) {
    if (!job_.region.contains(at)) return;
    const auto d = static_cast<std::size_t>(direction);
    if (job_.has_faces) {
      if ((layers_[d][word_index(at.z, at.y)] >> at.x & 1U) == 0) return;
    } else {
      // Another shape may hide the face.
      const std::uint8_t sides = shapes_.sides[ShapedVoxels::cell_at(at + normal_of(direction))];
      if ((sides >> (d ^ 1U) & 1U) != 0) return;
    }
    shapes_.keys.push_back(key_of(direction, at, false));
  }

  const Job& job_;
  ShapedVoxels& shapes_;
  const Scratch& s_;
  const Layer* ends_;
  const TouchedFaces& touched_;
  std::array<const std::uint64_t*, 6> layers_{};
};

// Collects the faces of opaque cubes that a shape covers.
void add_faces_behind(const Job& job, const ShapedVoxel& voxel, const Layer& opaque) {
  for (unsigned left = voxel.model->covered_sides; left != 0; left &= left - 1) {
    const auto side = static_cast<Direction>(std::countr_zero(left));
    const IVec3 behind = voxel.local + normal_of(side);
    if (!job.region.contains(behind) || (opaque.words[word_index(behind.z, behind.y)] >> behind.x & 1U) == 0) continue;
    job.shapes->keys.push_back(key_of(opposite(side), behind, true));
  }
}

// Sorts the keys of faces, in three passes of eight bits, and removes repetitions.
void sort_keys(ShapedVoxels& shapes) {
  BlockVector<std::uint32_t>* from = &shapes.keys;
  BlockVector<std::uint32_t>* to = &shapes.other_keys;
  to->resize(from->size());
  for (int shift = 0; shift < 24; shift += 8) {
    std::array<std::uint32_t, 256> places{};
    for (const std::uint32_t key : *from) ++places[key >> shift & 255U];
    std::uint32_t sum = 0;
    for (std::uint32_t& place : places) sum += std::exchange(place, sum);
    for (const std::uint32_t key : *from) (*to)[places[key >> shift & 255U]++] = key;
    std::swap(from, to);
  }
  std::swap(shapes.keys, shapes.other_keys);  // the third pass wrote the other list
  shapes.keys.erase(std::unique(shapes.keys.begin(), shapes.keys.end()), shapes.keys.end());
}

VoxelType type_in(const ChunkStorage& voxels, std::uint32_t place) {
  return voxels.type(static_cast<int>(place & 63U), static_cast<int>(place >> 6U & 63U),
                     static_cast<int>(place >> 12U));
}

// Makes quads of the faces in `keys` that are seen, with their occlusion in `answers`.
void make_quads(const Job& job, const Scratch& s) {
  ShapedVoxels& shapes = *job.shapes;
  const Chunk& centre = *job.chunks->centre();
  const ChunkStorage* const voxels = ChunkStorage::of(centre);
  QuadBuffer& quads = shapes.quads;
  quads.resize(shapes.keys.size());
  std::size_t count = 0;
  std::size_t answered = 0;
  std::uint32_t last_key = 0;
  for (const std::uint32_t either : shapes.keys) {
    if ((either & 1U) != 0) continue;
    const std::uint32_t key = either >> 1U;
    const Direction direction = FaceOrder::direction(key);
    const std::uint32_t place = FaceOrder::place(key);
    const FaceFrame& frame = frame_of(direction);
    const unsigned occlusion = shapes.answers[answered++];
    const VoxelType type = voxels == nullptr ? *centre.uniform() : type_in(*voxels, place);
    const std::uint64_t flips = s.occlusion.flips[occlusion >> 5U] >> ((occlusion + 6) & 31U) & 1U;
    Quad quad;
    quad.bits = place | std::uint64_t{occlusion} << Quad::kOcclusionShift | flips << Quad::kFlipShift |
                static_cast<std::uint64_t>(direction) << Quad::kDirectionShift |
                std::uint64_t{type} << Quad::kTypeShift;
    const bool is_u = FaceOrder::kAxes[frame.axis][2] == frame.u;  // columns are along u
    // Corners 0 and 1, 3 and 2, or 0 and 3, 1 and 2, are equal.
    const bool is_constant =
        is_u ? ((occlusion ^ occlusion >> 2U) & 0x33U) == 0
             : ((occlusion ^ occlusion >> 6U) & 3U) == 0 && ((occlusion ^ occlusion >> 2U) & 0xCU) == 0;
    const int shift = is_u ? Quad::kSizeUShift : Quad::kSizeVShift;
    constexpr std::uint64_t kLook = ~((std::uint64_t{1} << Quad::kOcclusionShift) - 1);
    const bool continues = count > 0 && key == last_key + 1 && (key & 63U) != 0;
    last_key = key;
    if (job.merge && continues && is_constant && (quads[count - 1].bits & kLook) == (quad.bits & kLook)) {
      quads[count - 1].bits += std::uint64_t{1} << shift;
    } else {
      quads[count++] = quad;
    }
  }
  quads.resize(count);
}

// Answers the first queries.
void answer(const Job& job, std::size_t count) {
  ShapedVoxels& shapes = *job.shapes;
  if (shapes.answers.size() < count) shapes.answers.resize(count);
  job.kernel->find_occlusion(shapes.eighths.data(), shapes.queries.data(), count, shapes.answers.data());
}

}  // namespace

void take_faces_next_to_shapes(const Job& job, bool row_ends, Scratch& s) {
  ShapedVoxels& shapes = *job.shapes;
  shapes.keys.clear();
  shapes.next_key = 0;
  if (shapes.voxels.empty()) return;
  shapes.has_cells = true;
  if (job.occlusion) {
    fill(job, row_ends, s, 0xFF, shapes.eighths);
    for (const ShapedVoxel& voxel : shapes.voxels) {
      shapes.eighths[ShapedVoxels::cell_at(voxel.local)] =
          voxel.is_opaque ? voxel.model->filled_octants : std::uint8_t{0};
    }
  }
  FacesAround around(job, row_ends, s);
  for (const ShapedVoxel& voxel : shapes.voxels) {
    if (!voxel.is_opaque) continue;
    if (job.occlusion && voxel.model->filled_octants != 0) around.add(voxel);
    if (!job.has_faces) add_faces_behind(job, voxel, s.z.opaque);
  }
  sort_keys(shapes);
  if (!job.occlusion) return;
  const CubeFaces& cube = CubeFaces::get();
  if (shapes.queries.size() < shapes.keys.size()) shapes.queries.resize(shapes.keys.size());
  std::size_t count = 0;
  for (const std::uint32_t key : shapes.keys) {
    if ((key & 1U) != 0) continue;
    shapes.queries[count++] = {&cube.packed[static_cast<std::size_t>(FaceOrder::direction(key >> 1U))],
                               FaceOrder::cell(FaceOrder::place(key >> 1U))};
  }
  answer(job, count);
  make_quads(job, s);
}

void append_quads_next_to_shapes(const Job& job, Direction direction, Scratch& s, QuadBuffer& out) {
  const QuadBuffer& quads = job.shapes->quads;
  const auto [begin, end] = std::ranges::equal_range(quads, direction, {}, &Quad::direction);
  const auto count = static_cast<std::size_t>(end - begin);
  if (count == 0) return;
  std::uint64_t* const to = grow_quads(out, s.quads, count);
  std::memcpy(to, &*begin, count * sizeof(Quad));
  s.quads += count;
}

unsigned find_covered_squares(const Job& job, const ShapedVoxel& voxel, const ShapedVoxel& shown, unsigned sides,
                              const SideMask** masks) {
  static constexpr SideMask kAll = {~std::uint64_t{0}, ~std::uint64_t{0}, ~std::uint64_t{0}, ~std::uint64_t{0}};
  unsigned covered = 0;
  for (; sides != 0; sides &= sides - 1) {
    const auto d = static_cast<unsigned>(std::countr_zero(sides));
    // Neighbours along x are next to each other in the list.
    const ShapedVoxel* const other =
        d < 2 ? &voxel + (d == 0 ? 1 : -1) : job.shapes->at(voxel.local + normal_of(static_cast<Direction>(d)));
    QUOIN_ASSERT(other != nullptr && other->local == voxel.local + normal_of(static_cast<Direction>(d)),
                 "a shaped neighbour");
    // Fluids have the same heights at their common corners (`covers`).
    const bool is_joined = shown.is_fluid && !shown.is_opaque && (shown.fluid & other->fluid) != 0;
    if (!is_joined && !other->is_opaque && other->type != shown.type) continue;
    masks[d] = is_joined ? &kAll : &other->model->sides[d ^ 1U];
    covered |= 1U << d;
  }
  return covered;
}

void append_shape_faces(const Job& job, ShapeFaceBuffer& out) {
  const ShapedVoxels& shapes = *job.shapes;
  if (!shapes.has_cells) return out.clear();  // all of the region is opaque
  std::size_t limit = 0;
  for (const ShapedVoxel& voxel : shapes.voxels) limit += voxel.model->packed_faces.size();
  for (const InnerShape& inner : shapes.inner) limit += inner.shown.model->packed_faces.size();
  if (out.size() < limit) out.resize(limit);
  out.resize(static_cast<std::size_t>(job.kernel->write_shape_faces(job, out.data()) - out.data()));
}

}  // namespace quoin::blocky
