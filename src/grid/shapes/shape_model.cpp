#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <quoin/grid/voxel_shape.h>

#include "core/rows/packed_row.h"

namespace quoin {
namespace {

constexpr float kUnit = static_cast<float>(kShapeUnits);
constexpr Vec3 kCentre(0.5F);

// An affine map of points of a voxel. `orientation` is set if it is exact: a signed permutation about the centre of the
// voxel, and a shift.
struct Placement {
  glm::mat3 matrix{1.0F};
  Vec3 shift{0.0F};

  [[nodiscard]] Vec3 apply(const Vec3& p) const { return matrix * p + shift; }
};

Placement placement_of(const AxisOrientation& orientation) {
  Placement placement;
  placement.matrix = glm::mat3(orientation.matrix());
  placement.shift = kCentre - placement.matrix * kCentre;
  return placement;
}

Placement operator*(const Placement& second, const Placement& first) {
  return {second.matrix * first.matrix, second.matrix * first.shift + second.shift};
}

// Returns the number of quarter turns, or nullopt for other angles.
std::optional<int> quarters_of(float degrees) {
  const float turns = degrees / 90.0F;
  if (turns != std::round(turns)) return std::nullopt;
  return static_cast<int>(turns);
}

Placement placement_of(const ElementTurn& turn) {
  Placement placement;
  const int u = (turn.axis + 1) % 3;
  const int v = (turn.axis + 2) % 3;
  if (const std::optional<int> quarters = quarters_of(turn.degrees)) {
    placement.matrix = glm::mat3(AxisOrientation::quarter_turns(turn.axis, *quarters).matrix());
  } else {
    const double angle = static_cast<double>(turn.degrees) * std::numbers::pi / 180.0;
    const double scale = turn.rescales ? 1.0 / std::abs(std::cos(angle)) : 1.0;
    placement.matrix[u][u] = static_cast<float>(std::cos(angle) * scale);
    placement.matrix[u][v] = static_cast<float>(std::sin(angle) * scale);
    placement.matrix[v][u] = static_cast<float>(-std::sin(angle) * scale);
    placement.matrix[v][v] = static_cast<float>(std::cos(angle) * scale);
  }
  const Vec3 origin = turn.origin / kUnit;
  placement.shift = origin - placement.matrix * origin;
  return placement;
}

// Returns the corners of a side of a box, counter-clockwise seen from outside (FaceFrame).
std::array<Vec3, 4> corners_of(const Vec3& lower, const Vec3& upper, Direction direction) {
  const FaceFrame& frame = frame_of(direction);
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    Vec3& corner = corners[i];
    corner[frame.axis] = frame.sign > 0 ? upper[frame.axis] : lower[frame.axis];
    corner[frame.u] = i == 1 || i == 2 ? upper[frame.u] : lower[frame.u];
    corner[frame.v] = i >= 2 ? upper[frame.v] : lower[frame.v];
  }
  return corners;
}

// Returns the coordinate of a point along an axis of a texture, from 0 at the texture's edge to 1.
float along(const IVec3& axis, const Vec3& point) {
  const int i = axis.x != 0 ? 0 : axis.y != 0 ? 1 : 2;
  return axis[i] > 0 ? point[i] : 1.0F - point[i];
}

std::array<float, 2> uv_of(const ElementFace& face, const ShapeElement& element, Direction direction,
                           const Vec3& corner) {
  const TextureFrame frame = texture_frame(face.face.value_or(VoxelFace{}), direction);
  if (!face.part) return {along(frame.right, corner / kUnit), along(frame.down, corner / kUnit)};
  Vec3 share(0.0F);
  for (int axis = 0; axis < 3; ++axis) {
    const float extent = element.max[axis] - element.min[axis];
    if (extent > 0.0F) share[axis] = (corner[axis] - element.min[axis]) / extent;
  }
  const auto [left, top, right, bottom] = *face.part;
  return {(left + (right - left) * along(frame.right, share)) / kUnit,
          (top + (bottom - top) * along(frame.down, share)) / kUnit};
}

std::size_t index_of(Direction direction) {
  return static_cast<std::size_t>(direction);
}

// Marks the squares of a side that a rectangle touches.
SideMask squares_of(const std::array<Vec3, 4>& corners, int axis) {
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  Vec3 lower = corners[0];
  Vec3 upper = corners[0];
  for (const Vec3& corner : corners) {
    lower = glm::min(lower, corner);
    upper = glm::max(upper, corner);
  }
  SideMask mask{};
  const auto first = [&](int i) { return std::clamp(static_cast<int>(std::floor(lower[i] * kUnit)), 0, 16); };
  const auto last = [&](int i) { return std::clamp(static_cast<int>(std::ceil(upper[i] * kUnit)), 0, 16); };
  for (int y = first(v); y < last(v); ++y) {
    for (int x = first(u); x < last(u); ++x) {
      mask[static_cast<std::size_t>(y / 4)] |= std::uint64_t{1} << (16 * (y % 4) + x);
    }
  }
  return mask;
}

// Returns the number of an eighth of a voxel by its position in halves of voxels (ModelFace::occluders).
std::uint8_t octant_number(const IVec3& half) {
  const IVec3 voxel = (half + 2) / 2;  // the own voxel: (1, 1, 1)
  return static_cast<std::uint8_t>(8 * (voxel.x + 3 * voxel.y + 9 * voxel.z) + (half.x & 1) + 2 * (half.y & 1) +
                                   4 * (half.z & 1));
}

// Fills ModelFace::occluders of a face along the axes.
void find_occluders(ModelFace& face) {
  const FaceFrame& frame = frame_of(face.direction);
  Vec3 lower = face.corners[0];
  Vec3 upper = face.corners[0];
  for (const Vec3& corner : face.corners) {
    lower = glm::min(lower, corner);
    upper = glm::max(upper, corner);
  }
  const Vec3 middle = (lower + upper) * 0.5F;
  for (std::size_t i = 0; i < 4; ++i) {
    IVec3 corner;
    for (int axis = 0; axis < 3; ++axis) {
      corner[axis] = std::clamp(static_cast<int>(std::lround(2.0F * face.corners[i][axis])), -1, 3);
    }
    const auto octant = [&](bool is_beyond_u, bool is_beyond_v) {
      const auto lies_before = [&](int axis, bool is_beyond) {
        return (face.corners[i][axis] > middle[axis]) != is_beyond ? 1 : 0;
      };
      IVec3 half = corner;
      if (frame.sign < 0) --half[frame.axis];
      half[frame.u] -= lies_before(frame.u, is_beyond_u);
      half[frame.v] -= lies_before(frame.v, is_beyond_v);
      return octant_number(half);
    };
    face.occluders[i] = {octant(true, false), octant(false, true), octant(true, true)};
  }
}

// Returns a hash of the faces of a model and their looks.
std::uint64_t hash_of(const ShapeModel& model) {
  std::uint64_t hash = kHashSeed;
  const auto mix = [&](std::uint64_t word) { hash = mixed_with(hash, word); };
  const auto mix_floats = [&](float a, float b) {
    mix(std::uint64_t{std::bit_cast<std::uint32_t>(a)} << 32 | std::bit_cast<std::uint32_t>(b));
  };
  for (const ModelFace& face : model.faces) {
    mix(std::uint64_t{face.look} << 8 | static_cast<std::uint64_t>(face.direction));
    for (std::size_t i = 0; i < 4; ++i) {
      mix_floats(face.corners[i].x, face.corners[i].y);
      mix_floats(face.corners[i].z, face.uv[i][0]);
      mix_floats(face.uv[i][1], face.normal[static_cast<int>(i % 3)]);
    }
  }
  for (const VoxelFace& look : model.looks) {
    mix(look.texture.is_null() ? 0 : look.texture.hash());
    mix(std::uint64_t{look.turn} << 40 | std::uint64_t{look.mirrored} << 48 |
        static_cast<std::uint64_t>(look.alpha) << 56 | std::uint64_t{std::bit_cast<std::uint32_t>(look.tint)});
    if (look.emission_share != 255) mix(look.emission_share);
  }
  return hash;
}

PackedFace packed(const ModelFace& face) {
  PackedFace made;
  for (std::size_t corner = 0; corner < 4; ++corner) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint8_t number = face.occluders[corner][i];
      if (number == kNoOccluder) continue;
      made.voxels[4 * i + corner] = number >> 3U;
      made.eighths[4 * i + corner] = static_cast<std::uint8_t>(1U << (number & 7U));
    }
  }
  if (face.on_side) made.side = static_cast<std::uint8_t>(face.direction);
  if (face.is_inner) made.side = PackedFace::kNeverSeen;
  return made;
}

class ModelBuilder {
 public:
  void add(const ShapeElement& element, const AxisOrientation& orientation) {
    const Placement turned = placement_of(orientation);
    const Placement placement = element.turn ? turned * placement_of(*element.turn) : turned;
    const bool is_tilted = element.turn && !quarters_of(element.turn->degrees);
    ModelBox box;
    const Vec3 lower = element.min / kUnit;
    const Vec3 upper = element.max / kUnit;
    if (is_tilted) {
      box.min = lower;
      box.max = upper;
      box.is_turned = true;
      box.origin = placement.shift;
      const glm::mat3 inverse = glm::inverse(placement.matrix);
      for (int row = 0; row < 3; ++row) {
        box.inverse[static_cast<std::size_t>(row)] = {inverse[0][row], inverse[1][row], inverse[2][row]};
      }
    } else {
      const Vec3 a = snapped(placement.apply(lower));
      const Vec3 b = snapped(placement.apply(upper));
      box.min = glm::min(a, b);
      box.max = glm::max(a, b);
    }
    box.collides = element.collides;
    const bool is_mirrored = glm::determinant(placement.matrix) < 0.0F;
    for (const Direction direction : kDirections) {
      const ElementFace& face = element.faces[index_of(direction)];
      const FaceFrame& frame = frame_of(direction);
      if (!face.is_drawn || lower[frame.u] == upper[frame.u] || lower[frame.v] == upper[frame.v]) continue;
      ModelFace made;
      const std::array<Vec3, 4> corners = corners_of(element.min, element.max, direction);
      for (std::size_t i = 0; i < 4; ++i) {
        // A mirror would turn the corners clockwise.
        const Vec3& corner = corners[is_mirrored ? (4 - i) % 4 : i];
        made.corners[i] = placement.apply(corner / kUnit);
        if (!is_tilted) made.corners[i] = snapped(made.corners[i]);
        made.uv[i] = uv_of(face, element, direction, corner);
      }
      made.look = look_number(face, direction);
      // The number of the side in the box's space: the box of an element that is not tilted is the turned one.
      finish(made, is_tilted);
      const Direction side = is_tilted ? direction : made.direction;
      box.faces[index_of(side)] = static_cast<std::int16_t>(model_.faces.size());
      model_.faces.push_back(made);
    }
    if (!is_tilted) fill(box);
    grow(box, placement);
    model_.boxes.push_back(box);
  }

  // Adds the surface of a fluid whose heights differ (ShapeSurroundings::heights).
  void add_fluid(const std::array<std::uint8_t, 4>& heights) {
    std::array<Vec3, 4> top;
    constexpr std::array<std::array<float, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (std::size_t i = 0; i < 4; ++i)
      top[i] = {kCorners[i][0], static_cast<float>(heights[i]) / kUnit, kCorners[i][1]};
    const auto bottom = [&](std::size_t i) { return Vec3(top[i].x, 0.0F, top[i].z); };
    // Counter-clockwise from above: x and z run clockwise there.
    add_free({top[0], top[3], top[2], top[2]}, Direction::PosY);
    add_free({top[0], top[2], top[1], top[1]}, Direction::PosY);
    add_free({bottom(0), bottom(1), bottom(2), bottom(3)}, Direction::NegY);
    constexpr std::array<Direction, 4> kSides = {Direction::NegZ, Direction::PosX, Direction::PosZ, Direction::NegX};
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t next = (i + 1) % 4;
      if (heights[i] == 0 && heights[next] == 0) continue;
      // A triangle where a corner of the surface is at the bottom.
      const Vec3& third = heights[i] == 0 ? top[next] : top[i];
      add_free({bottom(next), bottom(i), third, heights[next] == 0 ? third : top[next]}, kSides[i]);
    }
    for (int z = 0; z < kShapeUnits; ++z) {
      for (int x = 0; x < kShapeUnits; ++x) {
        const int filled = static_cast<int>(std::floor(lowest_at(top, x, z) * kUnit));
        for (int y = 0; y < filled; ++y) model_.bits[row(y, z)] |= static_cast<std::uint16_t>(1U << x);
      }
    }
  }

  [[nodiscard]] ShapeModel finish() {
    ShapeModel& m = model_;
    m.is_full = std::all_of(m.bits.begin(), m.bits.end(), [](std::uint16_t bits) { return bits == 0xFFFF; });
    std::array<int, 8> filled{};
    for (int z = 0; z < kShapeUnits; ++z) {
      for (int y = 0; y < kShapeUnits; ++y) {
        const std::uint16_t bits = m.bits[row(y, z)];
        const auto octant = static_cast<std::size_t>(2 * (y / 8) + 4 * (z / 8));
        filled[octant] += std::popcount(static_cast<unsigned>(bits & 0xFF));
        filled[octant + 1] += std::popcount(static_cast<unsigned>(bits >> 8));
        mark(Direction::NegX, y, z, (bits & 1U) != 0);
        mark(Direction::PosX, y, z, (bits >> 15 & 1U) != 0);
        for (int x = 0; x < kShapeUnits; ++x) {
          const bool is_set = (bits >> x & 1U) != 0;
          if (y == 0) mark(Direction::NegY, x, z, is_set);
          if (y == kShapeUnits - 1) mark(Direction::PosY, x, z, is_set);
          if (z == 0) mark(Direction::NegZ, x, y, is_set);
          if (z == kShapeUnits - 1) mark(Direction::PosZ, x, y, is_set);
        }
      }
    }
    for (ModelFace& face : m.faces) face.is_inner = is_inner(face);
    for (std::size_t i = 0; i < 8; ++i) {
      if (filled[i] >= 256) m.filled_octants |= static_cast<std::uint8_t>(1U << i);
    }
    for (std::size_t i = 0; i < 6; ++i) {
      m.covers_side[i] = std::all_of(m.sides[i].begin(), m.sides[i].end(),
                                     [](std::uint64_t word) { return word == ~std::uint64_t{0}; });
      m.covered_sides |= static_cast<std::uint8_t>(unsigned{m.covers_side[i]} << i);
      m.touched_sides |= static_cast<std::uint8_t>(unsigned{m.sides[i] != SideMask{}} << i);
    }
    m.hash = hash_of(m);
    for (const ModelFace& face : m.faces) m.packed_faces.push_back(packed(face));
    if (is_bounded_) {
      for (int axis = 0; axis < 3; ++axis) {
        m.cells.min[axis] = std::min(0, static_cast<int>(std::floor(m.min[axis])));
        m.cells.max[axis] = std::max(1, static_cast<int>(std::ceil(m.max[axis])));
      }
    }
    return std::move(model_);
  }

 private:
  // Returns true if all sixteenths in front of a face are filled: of a face along the axes within the voxel.
  [[nodiscard]] bool is_inner(const ModelFace& face) const {
    if (face.on_side || face.occluders[0][0] == kNoOccluder) return false;
    const FaceFrame& frame = frame_of(face.direction);
    const float plane = face.corners[0][frame.axis] * kUnit;
    IVec3 first(glm::floor(glm::min(face.corners[0], face.corners[2]) * kUnit));
    IVec3 last(glm::ceil(glm::max(face.corners[0], face.corners[2]) * kUnit));
    first[frame.axis] = static_cast<int>(plane) - (frame.sign > 0 ? 0 : 1);
    last[frame.axis] = first[frame.axis] + 1;
    if (plane != std::floor(plane) || intersect({first, last}, {IVec3(0), IVec3(kShapeUnits)}) != IBox{first, last}) {
      return false;
    }
    for (int z = first.z; z < last.z; ++z) {
      for (int y = first.y; y < last.y; ++y) {
        for (int x = first.x; x < last.x; ++x) {
          if ((model_.bits[row(y, z)] >> x & 1U) == 0) return false;
        }
      }
    }
    return true;
  }

  static std::size_t row(int y, int z) { return static_cast<std::size_t>(y + kShapeUnits * z); }

  // Removes the rounding of turns about points of the lattice: 1/4096 voxels is below what any format stores.
  static Vec3 snapped(const Vec3& p) {
    constexpr float kSteps = 4'096.0F;
    return {std::round(p.x * kSteps) / kSteps, std::round(p.y * kSteps) / kSteps, std::round(p.z * kSteps) / kSteps};
  }

  static float lowest_at(const std::array<Vec3, 4>& top, int x, int z) {
    float lowest = 1.0F;
    for (const int dz : {0, 1}) {
      for (const int dx : {0, 1}) {
        const float u = static_cast<float>(x + dx) / kUnit;
        const float v = static_cast<float>(z + dz) / kUnit;
        // The surface is two triangles that share the diagonal from corner 0 to corner 2.
        const float height = u >= v ? top[0].y + u * (top[1].y - top[0].y) + v * (top[2].y - top[1].y)
                                    : top[0].y + v * (top[3].y - top[0].y) + u * (top[2].y - top[3].y);
        lowest = std::min(lowest, height);
      }
    }
    return lowest;
  }

  void mark(Direction direction, int u, int v, bool is_set) {
    if (!is_set) return;
    model_.sides[index_of(direction)][static_cast<std::size_t>(v / 4)] |= std::uint64_t{1} << (16 * (v % 4) + u);
  }

  std::uint16_t look_number(const ElementFace& face, Direction direction) {
    if (!face.face) return static_cast<std::uint16_t>(direction);
    const auto known = std::find(model_.looks.begin(), model_.looks.end(), *face.face);
    const auto number = static_cast<std::uint16_t>(6 + (known - model_.looks.begin()));
    if (known == model_.looks.end()) model_.looks.push_back(*face.face);
    return number;
  }

  static void finish(ModelFace& face, bool is_tilted) {
    const Vec3 normal = glm::cross(face.corners[1] - face.corners[0], face.corners[2] - face.corners[0]);
    const float length = glm::length(normal);
    if (length > 0.0F) face.normal = normal / length;
    face.direction = nearest_direction(DVec3(face.normal));
    for (auto& corner : face.occluders) corner.fill(kNoOccluder);
    if (is_tilted) return;
    const FaceFrame& frame = frame_of(face.direction);
    face.normal = Vec3(normal_of(face.direction));
    face.on_side = face.corners[0][frame.axis] == (frame.sign > 0 ? 1.0F : 0.0F);
    for (const Vec3& corner : face.corners) {
      for (int axis = 0; axis < 3; ++axis) face.on_side = face.on_side && corner[axis] >= 0.0F && corner[axis] <= 1.0F;
    }
    if (face.on_side) face.mask = squares_of(face.corners, frame.axis);
    find_occluders(face);
  }

  void add_free(const std::array<Vec3, 4>& corners, Direction direction) {
    ModelFace face;
    face.corners = corners;
    const TextureFrame frame = texture_frame(VoxelFace{}, direction);
    for (std::size_t i = 0; i < 4; ++i) face.uv[i] = {along(frame.right, corners[i]), along(frame.down, corners[i])};
    face.look = static_cast<std::uint16_t>(direction);
    const bool is_inclined = direction == Direction::PosY;
    finish(face, is_inclined);
    model_.faces.push_back(face);
    ++model_.free_faces;
    for (const Vec3& corner : corners) grow(corner);
  }

  void fill(const ModelBox& box) {
    const auto first = [&](int i) { return std::clamp(static_cast<int>(std::ceil(box.min[i] * kUnit)), 0, 16); };
    const auto last = [&](int i) { return std::clamp(static_cast<int>(std::floor(box.max[i] * kUnit)), 0, 16); };
    for (int z = first(2); z < last(2); ++z) {
      for (int y = first(1); y < last(1); ++y) {
        for (int x = first(0); x < last(0); ++x) model_.bits[row(y, z)] |= static_cast<std::uint16_t>(1U << x);
      }
    }
  }

  void grow(const ModelBox& box, const Placement& placement) {
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Vec3 p((corner & 1U) != 0 ? box.max.x : box.min.x, (corner & 2U) != 0 ? box.max.y : box.min.y,
                   (corner & 4U) != 0 ? box.max.z : box.min.z);
      grow(box.is_turned ? snapped(placement.apply(p)) : p);
    }
  }

  void grow(const Vec3& p) {
    model_.min = is_bounded_ ? glm::min(model_.min, p) : p;
    model_.max = is_bounded_ ? glm::max(model_.max, p) : p;
    is_bounded_ = true;
  }

  ShapeModel model_;
  bool is_bounded_ = false;
};

}  // namespace

bool is_cube(const ShapeModel& model, const VoxelFaces& type_faces) {
  if (!model.is_full || model.boxes.size() != 1 || model.faces.size() != 6) return false;
  if (model.min != Vec3(0.0F) || model.max != Vec3(1.0F)) return false;
  return std::ranges::all_of(model.faces, [&](const ModelFace& face) {
    const VoxelFace* const look = look_of(model, face, type_faces);
    if (type_faces.empty()) return look == nullptr;
    const VoxelFace& of_cube = type_faces[face.direction];
    if (look == nullptr || !(*look == of_cube)) return false;
    const TextureFrame frame = texture_frame(of_cube, face.direction);
    for (std::size_t i = 0; i < 4; ++i) {
      const std::array<float, 2> uv{along(frame.right, face.corners[i]), along(frame.down, face.corners[i])};
      if (texture_uv(face, *look, face.uv[i]) != uv) return false;
    }
    return true;
  });
}

bool ContainedFluid::is_present(std::uint32_t state) const {
  return when.empty() || std::ranges::any_of(when, [&](const ShapeCondition& condition) {
           return ((state ^ condition.state) & condition.state_mask) == 0;
         });
}

const VoxelFace* look_of(const ShapeModel& model, const ModelFace& face, const VoxelFaces& type_faces) {
  if (face.look >= 6) return &model.looks[face.look - std::size_t{6}];
  return type_faces.empty() ? nullptr : &type_faces[static_cast<Direction>(face.look)];
}

std::array<float, 2> texture_uv(const ModelFace& face, const VoxelFace& look, std::array<float, 2> uv) {
  if (face.look >= 6) return uv;
  for (int i = 0; i < look.turn; ++i) uv = {uv[1], 1.0F - uv[0]};
  if (look.mirrored) uv[0] = 1.0F - uv[0];
  return uv;
}

namespace {

// Returns true if a share has the voxels with a reduced position.
bool has_position(const PositionShare& share, std::uint32_t position) {
  if (share.count == 0) return true;
  const std::uint32_t reduced = position % share.count;
  return reduced >= share.first && reduced < share.end;
}

}  // namespace

std::uint32_t position_number(IVec3 voxel) {
  // All steps are modulo powers of two.
  const auto widened = [](int coordinate) { return static_cast<std::uint64_t>(std::int64_t{coordinate}); };
  const auto x = static_cast<std::int32_t>(static_cast<std::uint32_t>(voxel.x) * 3'129'871U);
  std::uint64_t seed = widened(x) ^ widened(voxel.z) * 116'129'781U ^ widened(voxel.y);
  seed = seed * seed * 42'317'861U + seed * 11U;
  seed = static_cast<std::uint64_t>(static_cast<std::int64_t>(seed) >> 16);
  constexpr std::uint64_t kMultiplier = 0x5'DEEC'E66DU;
  std::uint64_t generator = seed ^ kMultiplier;
  for (int i = 0; i < 2; ++i) generator = generator * kMultiplier + 0xBU;
  const auto lower = static_cast<std::int32_t>(static_cast<std::uint32_t>(generator >> 16));
  return lower < 0 ? (0U - static_cast<std::uint32_t>(lower)) & 0x7FFF'FFFFU : static_cast<std::uint32_t>(lower);
}

struct VoxelShapes::Content {
  struct Key {
    std::uint32_t state = 0;  // only the bits that conditions compare
    std::array<std::uint8_t, 4> heights{};
    std::uint8_t orientation = 0;
    std::uint8_t connected = 0;
    std::uint8_t corner = 0;
    std::uint16_t position_class = 0;

    auto operator<=>(const Key&) const = default;
    [[nodiscard]] std::size_t slot() const {
      const std::uint64_t word = std::uint64_t{state} | std::uint64_t{orientation} << 32 |
                                 std::uint64_t{connected} << 40 | std::uint64_t{corner} << 48;
      const std::uint64_t rest = std::bit_cast<std::uint32_t>(heights) + std::uint64_t{position_class};
      return (word * 0x9E37'79B9'7F4A'7C15U + rest * 0xC2B2'AE3D'27D4'EB4FU) >> 56;
    }
  };
  using Entry = std::pair<const Key, const ShapeModel*>;
  // The content of a model. All states in which the same parts are present share one.
  struct Look {
    std::uint64_t parts = 0;  // bit per part
    std::array<std::uint8_t, 4> heights{};
    std::uint8_t orientation = 0;

    auto operator<=>(const Look&) const = default;
  };

  ShapeRules rules;
  std::uint32_t state_mask = 0;  // bits that select parts
  std::uint32_t fluid_mask = 0;  // bits that select `rules.fluid`
  std::uint32_t position_count = 1;
  // By reduced position: the number of its class. All positions of a class belong to the same shares. Empty: one class.
  std::vector<std::uint16_t> class_of_position;
  std::vector<std::uint16_t> position_of_class;         // any of the class
  std::mutex mutex;                                     // guards `models` and `known`
  std::map<Look, ShapeModel> models;                    // entries never move
  std::map<Key, const ShapeModel*> known;               // entries never move
  std::array<std::atomic<const Entry*>, 256> recent{};  // by Key::slot

  [[nodiscard]] Status add_positions();
  [[nodiscard]] std::uint64_t parts_of(const Key& key) const;
  [[nodiscard]] ShapeModel make(const Look& look, const AxisOrientation& orientation) const;
};

// Finds the classes of positions. Errors: InvalidArgument.
Status VoxelShapes::Content::add_positions() {
  const auto wrong = [](const std::string& reason) { return make_error(ErrorCode::InvalidArgument, reason); };
  std::vector<PositionShare> shares;
  for (const ShapePart& part : rules.parts) {
    for (const ShapeCondition& condition : part.when) {
      const PositionShare& share = condition.positions;
      if (share == PositionShare{}) continue;
      if (share.first >= share.end || share.end > share.count) return wrong("a share of positions is empty");
      if (std::ranges::find(shares, share) != shares.end()) continue;
      if (shares.size() == kMaxPositionShares) {
        return wrong("more than " + std::to_string(kMaxPositionShares) + " shares of positions");
      }
      shares.push_back(share);
      position_count = std::lcm(position_count, std::uint32_t{share.count});
      if (position_count > kMaxPositionCount) {
        return wrong("the shares of positions have no common count up to " + std::to_string(kMaxPositionCount));
      }
    }
  }
  if (position_count == 1) return {};
  std::map<std::vector<std::uint64_t>, std::uint16_t> classes;  // by the shares that have a position: a bit each
  for (std::uint32_t position = 0; position < position_count; ++position) {
    std::vector<std::uint64_t> in((shares.size() + 63) / 64);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      in[i / 64] |= std::uint64_t{has_position(shares[i], position)} << i % 64;
    }
    const auto [found, is_new] = classes.emplace(std::move(in), static_cast<std::uint16_t>(classes.size()));
    if (is_new) position_of_class.push_back(static_cast<std::uint16_t>(position));
    class_of_position.push_back(found->second);
  }
  return {};
}

// Returns the parts that are present.
std::uint64_t VoxelShapes::Content::parts_of(const Key& key) const {
  const DirectionSet connected = DirectionSet::from_bits(key.connected);
  const std::uint32_t position = position_of_class.empty() ? 0 : position_of_class[key.position_class];
  const auto holds = [&](const ShapeCondition& condition) {
    if ((key.state & condition.state_mask) != (condition.state & condition.state_mask)) return false;
    if (condition.corner && static_cast<std::uint8_t>(*condition.corner) != key.corner) return false;
    if (!has_position(condition.positions, position)) return false;
    return (condition.connected.bits() & ~connected.bits()) == 0 &&
           (condition.unconnected.bits() & connected.bits()) == 0;
  };
  static_assert(kMaxShapeParts <= 64, "a bit per part");
  std::uint64_t present = 0;
  for (std::size_t i = 0; i < rules.parts.size(); ++i) {
    const std::vector<ShapeCondition>& when = rules.parts[i].when;
    if (when.empty() || std::any_of(when.begin(), when.end(), holds)) present |= std::uint64_t{1} << i;
  }
  return present;
}

ShapeModel VoxelShapes::Content::make(const Look& look, const AxisOrientation& orientation) const {
  ModelBuilder builder;
  if (rules.neighbours == ShapeNeighbours::Fluid) {
    if (std::ranges::count(look.heights, look.heights[0]) == 4) {
      builder.add({.max = Vec3(kUnit, static_cast<float>(std::max<std::uint8_t>(look.heights[0], 1)), kUnit)}, {});
    } else {
      builder.add_fluid(look.heights);
    }
    return builder.finish();
  }
  for (std::size_t i = 0; i < rules.parts.size(); ++i) {
    if ((look.parts >> i & 1U) == 0) continue;
    const ShapePart& part = rules.parts[i];
    for (const ShapeElement& element : part.shape.elements()) builder.add(element, orientation * part.orientation);
  }
  return builder.finish();
}

VoxelShapes::VoxelShapes(VoxelShape shape) {
  QUOIN_ASSERT(!shape.is_null(), "a shape that is not null");
  ShapeRules rules;
  rules.parts.push_back({.shape = std::move(shape)});
  *this = *from_rules(std::move(rules));
}

Result<VoxelShapes> VoxelShapes::from_rules(ShapeRules rules) {
  const auto wrong = [](const std::string& reason) {
    return make_error(ErrorCode::InvalidArgument, "cannot use the shapes of a type: " + reason);
  };
  if (rules.neighbours > ShapeNeighbours::Fluid) return wrong("unknown use of neighbours");
  // Fluids of one kind are one body. With several groups, two kinds could both join a third one.
  if (rules.neighbours == ShapeNeighbours::Fluid && !std::has_single_bit(rules.groups)) {
    return wrong(rules.groups == 0 ? "a fluid has no group" : "a fluid has more than one group");
  }
  if (rules.parts.empty() && rules.neighbours != ShapeNeighbours::Fluid) return wrong("there is no part");
  if (rules.parts.size() > kMaxShapeParts) return wrong("more than " + std::to_string(kMaxShapeParts) + " parts");
  auto content = std::make_shared<Content>();
  std::size_t elements = 0;
  for (const ShapePart& part : rules.parts) {
    if (part.shape.is_null()) return wrong("a part has no shape");
    elements += part.shape.elements().size();
    for (const ShapeCondition& condition : part.when) {
      content->state_mask |= condition.state_mask;
      if (condition.corner && *condition.corner > StairCorner::InnerRight) return wrong("unknown corner of stairs");
    }
  }
  if (elements > 4 * kMaxShapeElements)
    return wrong("more than " + std::to_string(4 * kMaxShapeElements) + " elements");
  if (rules.fluid) {
    if (!std::has_single_bit(rules.fluid->groups)) {
      const std::string fluid = "the fluid that voxels contain has ";
      return wrong(fluid + (rules.fluid->groups == 0 ? "no group" : "more than one group"));
    }
    if (rules.neighbours == ShapeNeighbours::Fluid) return wrong("a fluid contains a fluid");
    for (const ShapeCondition& condition : rules.fluid->when) {
      if (condition.corner || !condition.connected.empty() || !condition.unconnected.empty()) {
        return wrong("the fluid that voxels contain depends on neighbours");
      }
      if (condition.positions.count != 0) return wrong("the fluid that voxels contain depends on positions");
      content->fluid_mask |= condition.state_mask;
    }
  }
  content->rules = std::move(rules);
  if (const Status added = content->add_positions(); !added) return wrong(added.error().message);
  VoxelShapes shapes;
  shapes.content_ = std::move(content);
  return shapes;
}

const ShapeRules& VoxelShapes::rules() const {
  QUOIN_ASSERT(content_ != nullptr, "shapes");
  return content_->rules;
}

std::uint32_t VoxelShapes::state_mask() const {
  QUOIN_ASSERT(content_ != nullptr, "shapes");
  return content_->state_mask | content_->fluid_mask |
         (content_->rules.neighbours == ShapeNeighbours::Fluid ? 15U : 0U);
}

std::uint32_t VoxelShapes::position_count() const {
  QUOIN_ASSERT(content_ != nullptr, "shapes");
  return content_->position_count;
}

const ShapeModel& VoxelShapes::model(std::uint32_t state, const AxisOrientation& orientation,
                                     const ShapeSurroundings& around) const {
  QUOIN_ASSERT(content_ != nullptr, "shapes");
  Content& c = *content_;
  Content::Key key;
  if (c.rules.neighbours == ShapeNeighbours::Fluid) {
    key.heights = around.heights;
  } else {
    key.state = state & c.state_mask;
    key.orientation = static_cast<std::uint8_t>(orientation.index());
    key.connected = around.connected.bits();
    key.corner = static_cast<std::uint8_t>(around.corner);
    QUOIN_ASSERT(around.position < c.position_count, "around.position < position_count()");
    if (!c.class_of_position.empty()) key.position_class = c.class_of_position[around.position];
  }
  std::atomic<const Content::Entry*>& recent = c.recent[key.slot()];
  if (const Content::Entry* entry = recent.load(std::memory_order_acquire); entry != nullptr && entry->first == key) {
    return *entry->second;
  }
  const std::scoped_lock lock(c.mutex);
  auto known = c.known.find(key);
  if (known == c.known.end()) {
    const bool is_fluid = c.rules.neighbours == ShapeNeighbours::Fluid;
    const Content::Look look{is_fluid ? 0 : c.parts_of(key), key.heights, key.orientation};
    auto model = c.models.find(look);
    if (model == c.models.end()) model = c.models.emplace(look, c.make(look, orientation)).first;
    known = c.known.emplace(key, &model->second).first;
  }
  recent.store(&*known, std::memory_order_release);
  return *known->second;
}

bool VoxelShapes::operator==(const VoxelShapes& other) const {
  return content_ == other.content_ ||
         (content_ != nullptr && other.content_ != nullptr && content_->rules == other.content_->rules);
}

}  // namespace quoin
