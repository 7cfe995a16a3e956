#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/core/direction.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/texture.h>

namespace [[gnu::visibility("default")]] quoin {

/// Number of units per voxel in which shapes are described: a voxel spans 0 to 16 on each axis.
inline constexpr int kShapeUnits = 16;
/// Range of an element's corners, in sixteenths, before and after its turn: an element may reach one voxel outside its
/// own.
inline constexpr int kMinShapeUnit = -16;
inline constexpr int kMaxShapeUnit = 32;
/// Maximum number of elements of a shape.
inline constexpr std::size_t kMaxShapeElements = 128;
/// Maximum number of parts of a type's shapes (ShapeRules::parts).
inline constexpr std::size_t kMaxShapeParts = 64;
/// Reach of a change with shapes: the type or state of a voxel affects faces of shapes, and of cubes next to shapes, at
/// most this many voxels away on each axis. A shape follows its neighbours, and covers and darkens theirs.
inline constexpr int kShapeReach = 2;

/// One side of an element.
struct ElementFace {
  bool is_drawn = true;
  /// The face's texture; nullopt: the type's face of this direction (VoxelProperties::faces), or the type's colour. A
  /// face without a texture has the colour of its tint.
  std::optional<VoxelFace> face{};
  /// The part of the texture that the side shows: left, top, right, bottom, in sixteenths. Right and left, or bottom
  /// and top, may be exchanged. nullopt: the part that a full cube would show at this place.
  std::optional<std::array<float, 4>> part{};

  bool operator==(const ElementFace&) const = default;
};

/// A turn of an element about an axis through a point.
struct ElementTurn {
  Vec3 origin{8.0F};      ///< in sixteenths
  int axis = 1;           ///< 0 x, 1 y, 2 z
  float degrees = 0.0F;   ///< counter-clockwise, seen from the positive end of the axis
  bool rescales = false;  ///< stretches the element across the axis by 1 / cos(degrees), so that it keeps its outline

  bool operator==(const ElementTurn&) const = default;
};

/// A box of a shape, with a texture per side. A plate has no thickness along one axis.
struct ShapeElement {
  Vec3 min{0.0F};         ///< in sixteenths
  Vec3 max{kShapeUnits};  ///< in sixteenths
  std::optional<ElementTurn> turn{};
  std::array<ElementFace, 6> faces{};  ///< by Direction, before the turn
  bool collides = true;  ///< false: bodies pass, if the type stops them at all (VoxelProperties::collides)

  bool operator==(const ShapeElement&) const = default;
};

/// The content of a voxel that is no full cube: a list of boxes. A handle to elements that never change: copies
/// share them. Null by default.
///
///   const VoxelShape slab = VoxelShape::box({0, 0, 0}, {16, 8, 16});
///   const VoxelShape flower = VoxelShape::crossed_plates();
///
/// Threads: different copies may be used on several threads at once.
class VoxelShape {
 public:
  VoxelShape() = default;
  /// Makes a shape from its elements.
  ///
  /// Errors: InvalidArgument if there are no or more than kMaxShapeElements elements, a corner is not finite or outside
  ///         kMinShapeUnit to kMaxShapeUnit, also after the element's turn, an upper corner is below the lower one, an
  ///         element has no extent along two axes, a turn, its axis or a part of a texture is not finite, or a turn's
  ///         origin is farther than 1,024 sixteenths away. The message names the element's index.
  [[nodiscard]] static Result<VoxelShape> from_elements(std::vector<ShapeElement> elements);
  /// Makes a box, in sixteenths. Requires: 0 <= lower < upper <= 16 on each axis.
  [[nodiscard]] static VoxelShape box(IVec3 lower, IVec3 upper);
  /// Makes a shape of several boxes, in sixteenths. Requires: as `box`; 1 to kMaxShapeElements boxes.
  [[nodiscard]] static VoxelShape boxes(std::initializer_list<IBox> boxes);
  /// Makes two upright plates that cross along the voxel's diagonals, as plants have. They show the type's face +Z and
  /// do not stop bodies. Requires: 0 < height <= 16, in sixteenths.
  [[nodiscard]] static VoxelShape crossed_plates(float height = kShapeUnits);

  [[nodiscard]] bool is_null() const { return elements_ == nullptr; }
  /// Returns the elements; none if the shape is null.
  [[nodiscard]] std::span<const ShapeElement> elements() const {
    return elements_ == nullptr ? std::span<const ShapeElement>() : std::span(*elements_);
  }
  bool operator==(const VoxelShape& other) const {
    return elements_ == other.elements_ ||
           (elements_ != nullptr && other.elements_ != nullptr && *elements_ == *other.elements_);
  }

 private:
  std::shared_ptr<const std::vector<ShapeElement>> elements_;
};

/// The orientations that a type's state selects: a furnace turned four ways, a log along three axes. They turn the
/// type's faces and shapes.
///
///   VoxelProperties furnace{.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()};
///   world.set(at, furnace_type, {.state = 1});  // turned by a quarter
struct StateOrientations {
  std::uint8_t first_bit = 0;  ///< lowest bit of the state that selects
  /// The unturned direction that stays exact when a mirrored voxel needs a rotation: the door of a furnace, the high
  /// side of stairs.
  Direction front = Direction::PosX;
  std::vector<AxisOrientation> by_value{};  ///< by the value of those bits; empty: never turned; at most 48

  /// Returns the four turns about y: 0, 1, 2 and 3 quarter turns, counter-clockwise seen from above.
  [[nodiscard]] static StateOrientations about_y(std::uint8_t first_bit = 0);
  /// Returns the orientations that turn +Y to +Y, +X and +Z, in this order: a log along an axis.
  [[nodiscard]] static StateOrientations along_axes(std::uint8_t first_bit = 0);
  /// Returns the orientations that turn +Y to each direction, in the order of kDirections: a torch on a wall.
  [[nodiscard]] static StateOrientations to_directions(std::uint8_t first_bit = 0);
  /// Returns the four turns about y, then the same after a half turn about x: stairs, also upside down.
  [[nodiscard]] static StateOrientations about_y_and_upside_down(std::uint8_t first_bit = 0);

  [[nodiscard]] bool empty() const { return by_value.empty(); }
  /// Returns the number of bits that select.
  [[nodiscard]] int bit_count() const;
  /// Returns a state with the bits that select set to `value`, and the other bits as they were. Requires:
  /// `value < by_value.size()`.
  [[nodiscard]] std::uint32_t with_value(std::uint32_t state, std::size_t value) const {
    QUOIN_ASSERT(value < by_value.size(), "value < by_value.size()");
    const std::uint32_t mask = ((std::uint32_t{1} << bit_count()) - 1) << first_bit;
    return (state & ~mask) | static_cast<std::uint32_t>(value) << first_bit;
  }
  /// Returns the orientation of a state: the identity if there are none, or for a value without an orientation.
  [[nodiscard]] AxisOrientation of(std::uint32_t state) const {
    if (by_value.empty()) return {};
    const std::size_t value = state >> first_bit & ((std::uint32_t{1} << bit_count()) - 1);
    return value < by_value.size() ? by_value[value] : AxisOrientation();
  }
  /// Returns the state of a voxel after it was turned or mirrored, with the other bits as they were: the value whose
  /// orientation is `turn * of(state)`; if there is none, one that turns +Y, then the front, to the same directions, or
  /// at least to the same axes (a log has no front); the state itself if +Y has none of them.
  [[nodiscard]] std::uint32_t turned(std::uint32_t state, const AxisOrientation& turn) const;

  bool operator==(const StateOrientations&) const = default;
};

/// The corner that stairs form with their neighbours (ShapeNeighbours::Stairs). Left and right are those of a person
/// who walks up.
enum class StairCorner : std::uint8_t { Straight, OuterLeft, OuterRight, InnerLeft, InnerRight };

/// Maximum number of values that the positions of voxels can have for a type (VoxelShapes::position_count).
inline constexpr std::uint32_t kMaxPositionCount = 4'096;
/// Maximum number of different PositionShare values of a type.
inline constexpr std::size_t kMaxPositionShares = 1'024;

/// Returns a number below 2^31 that depends only on a voxel's position in its grid, and looks random. Games choose
/// among the models of a block by it.
///
/// Source: the seed of a block's position in Minecraft (Java) and the generator of java.util.Random, a linear
///         congruential one of 48 bits; the number is the magnitude of the lower half of its first 64-bit result.
[[nodiscard]] std::uint32_t position_number(IVec3 voxel);

/// A share of all voxels, selected by their positions as if at random: those whose position_number modulo `count` is at
/// least `first` and less than `end`. Parts with the shares 0 to 1 and 1 to 4 of 4 are present in a quarter of all
/// voxels, and in the others.
struct PositionShare {
  std::uint16_t count = 0;  ///< 0: all voxels; at most kMaxPositionCount
  std::uint16_t first = 0;
  std::uint16_t end = 0;

  bool operator==(const PositionShare&) const = default;
};

/// A condition of a voxel's state, neighbours and position. Directions are those of the unturned type
/// (StateOrientations).
struct ShapeCondition {
  std::uint32_t state_mask = 0;  ///< bits of the state that are compared
  std::uint32_t state = 0;       ///< their values
  DirectionSet connected{};      ///< sides with a connection (ShapeNeighbours::Connected)
  DirectionSet unconnected{};    ///< sides without one
  std::optional<StairCorner> corner{};
  PositionShare positions{};

  bool operator==(const ShapeCondition&) const = default;
};

/// A part of a type's shape, and the conditions under which it is present.
struct ShapePart {
  VoxelShape shape{};
  AxisOrientation orientation{};       ///< turns this part, before the state's orientation
  std::vector<ShapeCondition> when{};  ///< present if any of them holds; empty: always

  bool operator==(const ShapePart&) const = default;
};

/// The influence of the voxels around a shape.
enum class ShapeNeighbours : std::uint8_t {
  None,
  /// Fences, walls, panes, wires: a side is connected if the neighbour is of a type of a common group
  /// (ShapeRules::groups), or covers the whole side (ShapeRules::connects_to_full_sides).
  Connected,
  /// Stairs, whose unturned high side is at +X and whose left is at -Z: next to stairs of a common group that are
  /// turned by a quarter, they form a corner (StairCorner).
  Stairs,
  /// Fluids: the surface is inclined towards lower neighbours. The three lowest bits of the state are the level: 0 is a
  /// source, 1 to 7 are lower; bit 3 means that the fluid falls and fills its voxel. `parts` are not used. A
  /// fluid has exactly one group (ShapeRules::groups, 1 by default). Fluids of different types and the same group are
  /// one: their heights join, they hide their common faces, and rays see one body. Give unrelated fluids, such as water
  /// and lava, different groups.
  Fluid,
};

/// A fluid in the rest of a voxel that has a shape: the water around a fence. It is a source, with the surface that a
/// fluid of its groups has there. Rays and meshes show it with the type of a fluid next to the voxel, else of the first
/// registered one (VoxelRegistry::first_fluid). Bodies and queries do not meet it.
struct ContainedFluid {
  std::uint32_t groups = 0;  ///< as ShapeRules::groups of the fluid: exactly one bit
  /// Present if any of them holds; empty: always. They depend on the state only.
  std::vector<ShapeCondition> when{};

  bool operator==(const ContainedFluid&) const = default;
  /// Returns true if a voxel with this state contains the fluid.
  [[nodiscard]] bool is_present(std::uint32_t state) const;
};

/// The shapes of a voxel type, selected by state, neighbours and position. All parts whose conditions hold are present
/// together.
struct ShapeRules {
  std::vector<ShapePart> parts{};
  ShapeNeighbours neighbours = ShapeNeighbours::None;
  std::uint32_t groups = 1;            ///< a bit per group; neighbours connect if they have one in common
  bool connects_to_full_sides = true;  ///< for ShapeNeighbours::Connected
  std::optional<ContainedFluid> fluid{};

  bool operator==(const ShapeRules&) const = default;
};

/// A voxel's neighbours and position as far as they matter to its shape, in the directions of the unturned type.
struct ShapeSurroundings {
  DirectionSet connected{};
  StairCorner corner = StairCorner::Straight;
  std::uint16_t position = 0;  ///< position_number of the voxel modulo VoxelShapes::position_count
  /// Heights of a fluid at the corners (x, z) = (0,0) (1,0) (1,1) (0,1), in sixteenths.
  std::array<std::uint8_t, 4> heights{14, 14, 14, 14};

  bool operator==(const ShapeSurroundings&) const = default;
};

/// A set of the 16x16 squares on a side of a voxel: bit u + 16 v, where u is the lower and v the higher of the two axes
/// along the side (for +X and -X: y and z), so that opposite sides agree. Four words of four rows each.
using SideMask = std::array<std::uint64_t, 4>;

/// ModelFace::occluders of faces that no voxel darkens.
inline constexpr std::uint8_t kNoOccluder = 255;

/// A side of a box of a model, or a free surface: flat and convex. A triangle repeats its last corner.
struct ModelFace {
  /// In voxels; the voxel spans 0 to 1. Counter-clockwise seen from outside.
  std::array<Vec3, 4> corners{};
  /// Texture coordinates of the corners, rightwards and downwards; 0 to 1 within the texture. See `texture_uv`.
  std::array<std::array<float, 2>, 4> uv{};
  Vec3 normal{0.0F};  ///< unit vector
  /// The look: below 6, the type's face of the unturned Direction of this number; else ShapeModel::looks[look - 6].
  std::uint16_t look = 0;
  /// The direction nearest to the normal.
  Direction direction = Direction::PosX;
  /// True if the face lies in the voxel's side `direction`, so that a neighbour can cover it (`mask`).
  bool on_side = false;
  /// True if sixteenths of the same model fill the whole space in front of the face, so that it cannot be seen.
  bool is_inner = false;
  SideMask mask{};  ///< for faces on a side: the squares that it touches
  /// The eighths of voxels that darken each corner, in the order of `vertex_occlusion`: side, side, diagonal. They
  /// touch the corner, moved to the nearest half of a voxel, in front of the face. A number is 8 (x + 3 y + 9 z) + the
  /// bit of ShapeModel::filled_octants, for the voxel at (x, y, z) - 1 from the own one. kNoOccluder: of inclined
  /// faces.
  std::array<std::array<std::uint8_t, 3>, 4> occluders{};
};

/// A box of a model.
struct ModelBox {
  Vec3 min{0.0F};  ///< in voxels
  Vec3 max{1.0F};
  /// If the box is turned: a point p of the voxel is `inverse * (p - origin)` in the space of `min` and `max`.
  bool is_turned = false;
  Vec3 origin{0.0F};
  std::array<Vec3, 3> inverse{};  ///< rows of the matrix
  bool collides = true;
  /// Index in ShapeModel::faces of the side per Direction, in the box's space; -1 for sides that are not drawn.
  std::array<std::int16_t, 6> faces{-1, -1, -1, -1, -1, -1};
};

/// A face of a model as loops over many voxels read it: ModelFace::occluders, `on_side` and `is_inner`.
struct alignas(16) PackedFace {
  static constexpr std::uint8_t kAlwaysSeen = 6;
  static constexpr std::uint8_t kNeverSeen = 7;

  /// The number of the voxel, x + 3 y + 9 z, and the bit in ShapeModel::filled_octants of occluder 0 of each corner,
  /// then of occluders 1 and 2. The bits are 0 for kNoOccluder. The last four entries are unused.
  std::array<std::uint8_t, 16> voxels{};
  std::array<std::uint8_t, 16> eighths{};
  /// The Direction in which a neighbour can cover the face, kAlwaysSeen, or kNeverSeen for inner faces.
  std::uint8_t side = kAlwaysSeen;
};

/// A shape ready for use: boxes and faces of one state and surrounding, turned. Immutable.
struct ShapeModel {
  std::vector<ModelBox> boxes;
  std::vector<ModelFace> faces;           ///< of boxes, then free surfaces (fluids)
  std::uint16_t free_faces = 0;           ///< number of free surfaces at the end of `faces`
  std::vector<VoxelFace> looks;           ///< see ModelFace::look
  std::array<std::uint16_t, 256> bits{};  ///< bit x of [y + 16 z]: sixteenths inside untilted boxes
  std::array<SideMask, 6> sides{};        ///< by Direction: squares of the side that boxes cover
  std::array<bool, 6> covers_side{};      ///< the side is covered wholly
  /// Bit x + 2 y + 4 z: at least half of this eighth of the voxel is filled, so that it darkens the corner there.
  std::uint8_t filled_octants = 0;
  bool is_full = false;            ///< all sixteenths are filled: a cube
  IBox cells{IVec3{0}, IVec3{1}};  ///< voxels that boxes and faces touch, relative to the own one
  Vec3 min{0.0F};                  ///< bounds, in voxels
  Vec3 max{0.0F};
  std::vector<PackedFace> packed_faces;  ///< as `faces`
  std::uint8_t covered_sides = 0;        ///< `covers_side` as bits, by Direction
  std::uint8_t touched_sides = 0;        ///< by Direction: boxes cover a part of the side, or all
  std::uint64_t hash = 0;                ///< of `faces` and `looks`, the same in every process

  [[nodiscard]] bool empty() const { return faces.empty() && boxes.empty(); }
};

/// Returns true if a model is exactly the cube of its type: one box that fills the voxel, with the type's faces. Cost:
/// for most models one comparison.
[[nodiscard]] bool is_cube(const ShapeModel& model, const VoxelFaces& type_faces);

/// Returns the look of a face of a model, or null if the face has the type's colour. A look without a texture has the
/// colour of its tint. `type_faces`: VoxelProperties::faces of the voxel's type.
[[nodiscard]] const VoxelFace* look_of(const ShapeModel& model, const ModelFace& face, const VoxelFaces& type_faces);

/// Returns the texture coordinates of a point of a face from its coordinates as in `ModelFace::uv`: applies turn and
/// mirror of the type's face, which a model does not know. `look`: of the face, from `look_of`, not null.
[[nodiscard]] std::array<float, 2> texture_uv(const ModelFace& face, const VoxelFace& look, std::array<float, 2> uv);

/// The shapes of a voxel type, or none: the type is a cube. Copies share them.
///
/// Threads: any number may use it at once; models are made at their first use, one thread at a time.
class VoxelShapes {
 public:
  /// Creates no shapes.
  VoxelShapes() = default;
  /// Creates shapes that have one form. Requires: the shape is not null.
  VoxelShapes(VoxelShape shape);
  /// Creates shapes from rules.
  ///
  /// Errors: InvalidArgument if there are no or more than kMaxShapeParts parts (except for fluids), a part has no
  ///         shape, all parts together have more than 4 * kMaxShapeElements elements, a share of positions is empty or
  ///         not within its count, there are more than kMaxPositionShares of them, their counts have no common multiple
  ///         up to kMaxPositionCount, a fluid or `fluid` does not have exactly one group, or `fluid` is in a fluid, or
  ///         has a condition of neighbours or positions.
  [[nodiscard]] static Result<VoxelShapes> from_rules(ShapeRules rules);

  [[nodiscard]] bool empty() const { return content_ == nullptr; }
  /// Requires: not empty.
  [[nodiscard]] const ShapeRules& rules() const;
  /// Returns the bits of the state that select shapes. Requires: not empty.
  [[nodiscard]] std::uint32_t state_mask() const;
  /// Returns the number of values that positions are reduced to: the least common multiple of PositionShare::count of
  /// all conditions; 1 if shapes do not depend on positions. Requires: not empty.
  [[nodiscard]] std::uint32_t position_count() const;
  /// Returns the model of a state. A voxel without any present part has an empty model. Lifetime: that of any copy of
  /// these shapes. Cost: a lookup; microseconds at the first use of a combination. Memory: kilobytes for each set of
  /// present parts and orientation (fluids: set of heights) that was used. Requires: not empty;
  /// `around.position < position_count()`.
  [[nodiscard]] const ShapeModel& model(std::uint32_t state, const AxisOrientation& orientation,
                                        const ShapeSurroundings& around) const;

  bool operator==(const VoxelShapes& other) const;

 private:
  struct [[gnu::visibility("hidden")]] Content;
  std::shared_ptr<Content> content_;
};

}  // namespace quoin
