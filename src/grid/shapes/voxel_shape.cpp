#include <quoin/grid/voxel_shape.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <ranges>
#include <span>
#include <string>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/grid/voxel_registry.h>

#include "grid/shapes/shape_index.h"

namespace quoin {
namespace {

bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Returns the mean share of positions of a part's conditions, 0 to 1.
float share_of_positions(const ShapePart& part) {
  if (part.when.empty()) return 1.0F;
  float sum = 0.0F;
  for (const ShapeCondition& condition : part.when) {
    const PositionShare& share = condition.positions;
    sum += share.count == 0 ? 1.0F : static_cast<float>(share.end - share.first) / static_cast<float>(share.count);
  }
  return sum / static_cast<float>(part.when.size());
}

// Returns true if all corners of an element are within the range of corners after its turn, except for rounding.
bool stays_near(const ShapeElement& element) {
  constexpr double kRounding = 1e-3;
  const ElementTurn& turn = *element.turn;
  const double angle = double{turn.degrees} * std::numbers::pi / 180.0;
  const double scale = turn.rescales ? 1.0 / std::abs(std::cos(angle)) : 1.0;
  const int u = (turn.axis + 1) % 3;
  const int v = (turn.axis + 2) % 3;
  for (int corner = 0; corner < 4; ++corner) {
    const double along_u = double{((corner & 1) != 0 ? element.max : element.min)[u]} - double{turn.origin[u]};
    const double along_v = double{((corner & 2) != 0 ? element.max : element.min)[v]} - double{turn.origin[v]};
    const double at_u = turn.origin[u] + scale * (std::cos(angle) * along_u - std::sin(angle) * along_v);
    const double at_v = turn.origin[v] + scale * (std::sin(angle) * along_u + std::cos(angle) * along_v);
    for (const double at : {at_u, at_v}) {
      if (!(at >= kMinShapeUnit - kRounding && at <= kMaxShapeUnit + kRounding)) return false;
    }
  }
  return true;
}

// Returns the reason if an element is not valid, or an empty string.
std::string error_of(const ShapeElement& element) {
  if (!is_finite(element.min) || !is_finite(element.max)) return "a corner is not finite";
  int plates = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (element.min[axis] < static_cast<float>(kMinShapeUnit) ||
        element.max[axis] > static_cast<float>(kMaxShapeUnit)) {
      return "a corner is outside -16 to 32 sixteenths";
    }
    if (element.max[axis] < element.min[axis]) return "the upper corner is below the lower one";
    if (element.max[axis] == element.min[axis]) ++plates;
  }
  if (plates > 1) return "the box has no extent along two axes";
  if (element.turn) {
    if (element.turn->axis < 0 || element.turn->axis > 2) return "the axis of the turn is not 0, 1 or 2";
    if (!is_finite(element.turn->origin) || !std::isfinite(element.turn->degrees)) return "the turn is not finite";
    if (std::abs(element.turn->degrees) > 360.0F) return "the turn is not between -360 and 360 degrees";
    if (element.turn->rescales && std::abs(std::cos(element.turn->degrees * 0.01745329252F)) < 0.1F) {
      return "the turn cannot be rescaled";
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(element.turn->origin[axis]) > 1'024.0F) return "the origin of the turn is beyond 1,024 sixteenths";
    }
    if (!stays_near(element)) return "the turn moves a corner outside -16 to 32 sixteenths";
  }
  for (const ElementFace& face : element.faces) {
    if (!face.part) continue;
    for (const float at : *face.part) {
      if (!std::isfinite(at) || std::abs(at) > 1'024.0F) return "a part of a texture is not finite";
    }
  }
  return {};
}

}  // namespace

Result<VoxelShape> VoxelShape::from_elements(std::vector<ShapeElement> elements) {
  if (elements.empty()) return make_error(ErrorCode::InvalidArgument, "cannot make a shape without elements");
  if (elements.size() > kMaxShapeElements) {
    return make_error(ErrorCode::InvalidArgument, "cannot make a shape of " + std::to_string(elements.size()) +
                                                      " elements: at most " + std::to_string(kMaxShapeElements));
  }
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (const std::string reason = error_of(elements[i]); !reason.empty()) {
      return make_error(ErrorCode::InvalidArgument,
                        "cannot use element " + std::to_string(i) + " of a shape: " + reason);
    }
  }
  VoxelShape shape;
  shape.elements_ = std::make_shared<const std::vector<ShapeElement>>(std::move(elements));
  return shape;
}

VoxelShape VoxelShape::box(IVec3 lower, IVec3 upper) {
  return boxes({{lower, upper}});
}

VoxelShape VoxelShape::boxes(std::initializer_list<IBox> boxes) {
  std::vector<ShapeElement> elements;
  elements.reserve(boxes.size());
  for (const IBox& box : boxes) {
    for (int axis = 0; axis < 3; ++axis) {
      QUOIN_ASSERT(box.min[axis] >= 0 && box.min[axis] < box.max[axis] && box.max[axis] <= kShapeUnits,
                   "0 <= lower < upper <= 16 on each axis");
    }
    elements.push_back({.min = Vec3(box.min), .max = Vec3(box.max)});
  }
  Result<VoxelShape> shape = from_elements(std::move(elements));
  QUOIN_ASSERT(shape, "1 to kMaxShapeElements boxes");
  return *std::move(shape);
}

VoxelShape VoxelShape::crossed_plates(float height) {
  QUOIN_ASSERT(height > 0.0F && height <= static_cast<float>(kShapeUnits), "0 < height <= 16");
  std::vector<ShapeElement> elements;
  for (const float degrees : {45.0F, -45.0F}) {
    ShapeElement plate{.min = Vec3(0.0F, 0.0F, 8.0F), .max = Vec3(16.0F, height, 8.0F)};
    plate.turn = ElementTurn{.degrees = degrees};
    plate.collides = false;
    elements.push_back(std::move(plate));
  }
  return *from_elements(std::move(elements));
}

StateOrientations StateOrientations::about_y(std::uint8_t first_bit) {
  StateOrientations orientations{.first_bit = first_bit};
  for (int turns = 0; turns < 4; ++turns) orientations.by_value.push_back(AxisOrientation::quarter_turns(1, turns));
  return orientations;
}

StateOrientations StateOrientations::along_axes(std::uint8_t first_bit) {
  return {.first_bit = first_bit,
          .by_value = {AxisOrientation(), AxisOrientation::quarter_turns(2, -1), AxisOrientation::quarter_turns(0, 1)}};
}

StateOrientations StateOrientations::to_directions(std::uint8_t first_bit) {
  using Orientation = AxisOrientation;
  return {.first_bit = first_bit,
          .by_value = {Orientation::quarter_turns(2, -1), Orientation::quarter_turns(2, 1), Orientation(),
                       Orientation::quarter_turns(0, 2), Orientation::quarter_turns(0, 1),
                       Orientation::quarter_turns(0, -1)}};
}

StateOrientations StateOrientations::about_y_and_upside_down(std::uint8_t first_bit) {
  StateOrientations orientations = about_y(first_bit);
  for (int turns = 0; turns < 4; ++turns) {
    orientations.by_value.push_back(AxisOrientation::quarter_turns(1, turns) * AxisOrientation::quarter_turns(0, 2));
  }
  return orientations;
}

int StateOrientations::bit_count() const {
  return by_value.size() < 2 ? 0 : std::bit_width(by_value.size() - 1);
}

std::uint32_t StateOrientations::turned(std::uint32_t state, const AxisOrientation& turn) const {
  if (by_value.empty()) return state;
  const AxisOrientation wanted = turn * of(state);
  // Prefers the orientation itself, then equal directions of up and of the front, then equal axes.
  const auto likeness = [&](const AxisOrientation& orientation, Direction direction) {
    const Direction is = orientation.apply(direction);
    const Direction should = wanted.apply(direction);
    return is == should ? 2 : frame_of(is).axis == frame_of(should).axis ? 1 : 0;
  };
  const auto fit_of = [&](const AxisOrientation& orientation) {
    if (orientation == wanted) return 9;
    const int up = likeness(orientation, Direction::PosY);
    return up == 0 ? 0 : 3 * up + likeness(orientation, front);
  };
  std::optional<std::size_t> best;
  int best_fit = 0;
  for (std::size_t value = 0; value < by_value.size(); ++value) {
    if (const int fit = fit_of(by_value[value]); fit > best_fit) {
      best = value;
      best_fit = fit;
    }
  }
  return best ? with_value(state, *best) : state;
}

namespace {

// Returns the wanted direction of +Y after the turn: up or down, or away from the face that was hit if any orientation
// turns +Y sideways.
Direction up_of_placed(const StateOrientations& orientations, const PlacingHit& hit) {
  const bool has_sideways = std::ranges::any_of(orientations.by_value, [](const AxisOrientation& orientation) {
    return frame_of(orientation.apply(Direction::PosY)).axis != 1;
  });
  if (has_sideways || frame_of(hit.face).axis == 1) return hit.face;
  return hit.point.y > 0.5F ? Direction::NegY : Direction::PosY;
}

// Returns the default of `PlacingHit::front`, by the middle of the surface of the unturned shape.
PlacedFront front_of_shape(const VoxelProperties& type, std::uint32_t state) {
  if (type.shapes.empty()) return PlacedFront::TowardsPlayer;
  const ShapeModel& model = type.shapes.model(state, AxisOrientation(), {});
  const FaceFrame& frame = frame_of(type.orientations.front);
  float area = 0.0F;
  float moment = 0.0F;  // about the middle of the voxel
  for (const ModelFace& face : model.faces) {
    const auto& c = face.corners;
    const float share = glm::length(glm::cross(c[2] - c[0], c[3] - c[1]));
    const float middle = (c[0][frame.axis] + c[1][frame.axis] + c[2][frame.axis] + c[3][frame.axis]) / 4.0F;
    area += share;
    moment += share * (middle - 0.5F) * static_cast<float>(frame.sign);
  }
  constexpr float kBalanced = 1.0F / 64.0F;  // voxels
  if (std::abs(moment) <= kBalanced * area) return PlacedFront::TowardsPlayer;
  return moment > 0.0F ? PlacedFront::AwayFromPlayer : PlacedFront::AwayFromWall;
}

}  // namespace

std::uint32_t placed_state(const VoxelProperties& type, const PlacingHit& hit, std::uint32_t state) {
  const StateOrientations& orientations = type.orientations;
  if (orientations.empty()) return state;
  const DVec3 up(normal_of(up_of_placed(orientations, hit)));
  const PlacedFront wanted = hit.front.value_or(front_of_shape(type, state));
  // Divided by its greatest component first, so that squares of long and short vectors stay in range.
  const DVec3 look = hit.look / std::max({std::abs(hit.look.x), std::abs(hit.look.y), std::abs(hit.look.z)});
  const double length = glm::length(look);
  DVec3 front = std::isfinite(length) ? look / length : DVec3(0.0);  // else 0, infinite or no number
  if (wanted != PlacedFront::AwayFromPlayer) front = -front;
  const DVec3 wall(normal_of(hit.face));
  if (wanted == PlacedFront::AwayFromWall && glm::dot(wall, up) == 0.0) front = wall;
  std::size_t best = 0;
  double best_fit = -1.0;
  for (std::size_t value = 0; value < orientations.by_value.size(); ++value) {
    const AxisOrientation& orientation = orientations.by_value[value];
    // +Y matters most: the direction itself, then at least its axis, as for logs; then the front.
    const double likeness = glm::dot(DVec3(normal_of(orientation.apply(Direction::PosY))), up);
    const double fit = 4.0 * (2.0 * std::abs(likeness) + likeness) + 1.0 +
                       glm::dot(DVec3(normal_of(orientation.apply(orientations.front))), front);
    if (fit <= best_fit + 1e-9) continue;
    best = value;
    best_fit = fit;
  }
  return orientations.with_value(state, best);
}

namespace {

// Returns the share of a side that is visible.
float visible_share(const VoxelFace* look) {
  const bool is_cutout = look != nullptr && !look->texture.is_null() && look->alpha == FaceAlpha::Cutout;
  return is_cutout ? look->texture.coverage() : 1.0F;
}

}  // namespace

Vec3 coverage_of(const ShapeModel& model, const VoxelFaces& type_faces) {
  if (model.is_full) return Vec3(1.0F);
  Vec3 seen(0.0F);
  for (const ModelFace& face : model.faces) {
    if (face.is_inner) continue;
    const auto& at = face.corners;
    // Each axis shows a front and a back.
    const Vec3 area = 0.5F * glm::cross(at[2] - at[0], at[3] - at[1]);
    seen += 0.5F * visible_share(look_of(model, face, type_faces)) * glm::abs(area);
  }
  return glm::min(seen, Vec3(1.0F));
}

namespace {

// A drawn side of a type's shapes.
struct DrawnSide {
  const ShapeElement& element;
  Direction direction = Direction::PosX;
  const VoxelFace* look = nullptr;  // null: the type's colour
  float area = 0.0F;                // times the share of positions
};

// Calls `visit` for each drawn side of all shapes of a type.
void for_each_side(const VoxelProperties& type, FunctionRef<void(const DrawnSide& side)> visit) {
  const auto add_element = [&](const ShapeElement& element, float number) {
    const Vec3 size = element.max - element.min;
    for (const Direction side : kDirections) {
      const ElementFace& face = element.faces[static_cast<std::size_t>(side)];
      if (!face.is_drawn) continue;
      const VoxelFace* const look = face.face ? &*face.face : type.faces.empty() ? nullptr : &type.faces[side];
      const FaceFrame& frame = frame_of(side);
      visit({element, side, look, number * size[frame.u] * size[frame.v]});
    }
  };
  const ShapeRules& rules = type.shapes.rules();
  if (rules.neighbours == ShapeNeighbours::Fluid) {
    add_element({}, 1.0F);  // fluids do not use their parts
  } else {
    for (const ShapePart& part : rules.parts) {
      for (const ShapeElement& element : part.shape.elements()) add_element(element, share_of_positions(part));
    }
  }
}

Vec3 mean_colour_of_side(const VoxelProperties& type, const VoxelFace* look) {
  const Vec3 colour = linear_colour(look == nullptr ? type.colour : look->tint);
  return look == nullptr || look->texture.is_null() ? colour : colour * look->texture.mean();
}

float emission_factor_of(const DrawnSide& side) {
  return side.look == nullptr ? 1.0F : emission_factor(*side.look);
}

// Returns the part of its texture that a side shows: left, top, right, bottom, from 0 to 1 at the texture's edges.
// Requires: the side has a texture.
std::array<float, 4> part_of(const DrawnSide& side) {
  constexpr auto kUnits = static_cast<float>(kShapeUnits);
  if (const auto& part = side.element.faces[static_cast<std::size_t>(side.direction)].part) {
    return {(*part)[0] / kUnits, (*part)[1] / kUnits, (*part)[2] / kUnits, (*part)[3] / kUnits};
  }
  const TextureFrame frame = texture_frame(*side.look, side.direction);
  const auto along = [&](const IVec3& axis, const Vec3& corner) {
    const int i = axis.x != 0 ? 0 : axis.y != 0 ? 1 : 2;
    return axis[i] > 0 ? corner[i] / kUnits : 1.0F - corner[i] / kUnits;
  };
  const Vec3& a = side.element.min;
  const Vec3& b = side.element.max;
  return {along(frame.right, a), along(frame.down, a), along(frame.right, b), along(frame.down, b)};
}

// The texels that a side shows.
struct SeenTexels {
  float coverage = 1.0F;  // the visible share; 1 unless the side is cutout
  Vec3 mean{1.0F};        // linear, without the tint, weighted by alpha
};

SeenTexels seen_texels(const DrawnSide& side) {
  if (side.look == nullptr || side.look->texture.is_null()) return {};
  const Texture& texture = side.look->texture;
  const bool is_cutout = side.look->alpha == FaceAlpha::Cutout;
  const std::array<float, 4> part = part_of(side);
  SeenTexels seen{is_cutout ? texture.coverage() : 1.0F, texture.mean()};
  const auto is_whole = [](float a, float b) { return std::min(a, b) == 0.0F && std::max(a, b) == 1.0F; };
  if (is_whole(part[0], part[2]) && is_whole(part[1], part[3])) return seen;
  // A sample per texel, but at most 64 per axis.
  const int size = texture.size();
  const auto count = [&](float extent) {
    return std::clamp(static_cast<int>(std::ceil(std::abs(extent) * static_cast<float>(size) - 1e-3F)), 1, 64);
  };
  const int columns = count(part[2] - part[0]);
  const int rows = count(part[3] - part[1]);
  const auto number = [&](float from, float to, int i, int samples) {
    const float at = from + (to - from) * (static_cast<float>(i) + 0.5F) / static_cast<float>(samples);
    return static_cast<std::size_t>(std::clamp(at * static_cast<float>(size), 0.0F, static_cast<float>(size - 1)));
  };
  const std::span<const Rgba8> texels = texture.level(0);
  Vec3 sum(0.0F);
  float weights = 0.0F;
  for (int y = 0; y < rows; ++y) {
    const std::size_t row = number(part[1], part[3], y, rows);
    for (int x = 0; x < columns; ++x) {
      const std::size_t column = number(part[0], part[2], x, columns);
      const Rgba8 texel = texels[row * static_cast<std::size_t>(size) + column];
      const float weight = is_cutout ? (texel.a >= kCutoutAlpha ? 1.0F : 0.0F) : static_cast<float>(texel.a) / 255.0F;
      sum += weight * linear_colour(texel);
      weights += weight;
    }
  }
  if (is_cutout) seen.coverage = weights / static_cast<float>(columns * rows);
  if (weights > 0.0F) seen.mean = sum / weights;
  return seen;
}

}  // namespace

Vec3 mean_of_shapes(const VoxelProperties& type) {
  Vec3 sum(0.0F);
  float total = 0.0F;
  for_each_side(type, [&](const DrawnSide& side) {
    const float weight = side.area * visible_share(side.look);
    sum += weight * mean_colour_of_side(type, side.look);
    total += weight;
  });
  return total > 0.0F ? sum / total : linear_colour(type.colour);
}

float emission_share_of_shapes(const VoxelProperties& type) {
  // Texels are read only where shares differ.
  bool has_shares = false;
  for_each_side(type, [&](const DrawnSide& side) { has_shares = has_shares || emission_factor_of(side) < 1.0F; });
  if (!has_shares) return 1.0F;
  float sum = 0.0F;
  float total = 0.0F;
  for_each_side(type, [&](const DrawnSide& side) {
    const bool is_cutout = side.look != nullptr && side.look->alpha == FaceAlpha::Cutout;
    const float weight = is_cutout ? side.area * seen_texels(side).coverage : side.area;
    sum += weight * emission_factor_of(side);
    total += weight;
  });
  return total > 0.0F ? sum / total : 1.0F;
}

Vec3 glow_of_shapes(const VoxelProperties& type) {
  Vec3 sum(0.0F);
  float total = 0.0F;
  float greatest = 0.0F;
  for_each_side(type, [&](const DrawnSide& side) {
    const float share = emission_factor_of(side);
    if (!(share > 0.0F)) return;
    const SeenTexels seen = seen_texels(side);
    const float weight = side.area * seen.coverage;
    const Vec3 colour = linear_colour(side.look == nullptr ? type.colour : side.look->tint) * seen.mean;
    sum += weight * share * colour;
    total += weight * share;
    greatest = std::max(greatest, weight > 0.0F ? share : 0.0F);
  });
  return total > 0.0F ? sum * (greatest / total) : Vec3(0.0F);
}

bool has_glass_parts(const VoxelProperties& type) {
  if (type.visibility != Visibility::Transparent) return false;
  const auto is_glass = [](const VoxelFace* look) {
    return look == nullptr || look->texture.is_null() || look->alpha == FaceAlpha::Translucent;
  };
  const auto has_glass_side = [&](const ShapeElement& element) {
    return std::ranges::any_of(kDirections, [&](Direction side) {
      const ElementFace& face = element.faces[static_cast<std::size_t>(side)];
      if (face.face) return face.is_drawn && is_glass(&*face.face);
      return face.is_drawn && is_glass(type.faces.empty() ? nullptr : &type.faces[side]);
    });
  };
  const ShapeRules& rules = type.shapes.rules();
  if (rules.neighbours == ShapeNeighbours::Fluid) return has_glass_side({});
  return std::ranges::any_of(
      rules.parts, [&](const ShapePart& part) { return std::ranges::any_of(part.shape.elements(), has_glass_side); });
}

}  // namespace quoin
