#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>

#include "grid/shapes/shape_index.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "live/allocations_for_tests.h"

namespace quoin {
namespace {

using shapes_for_tests::fence;
using shapes_for_tests::slab;
using shapes_for_tests::stairs;

const ShapeModel& model_of(const VoxelShapes& shapes, const AxisOrientation& orientation = {}) {
  return shapes.model(0, orientation, {});
}

int filled(const ShapeModel& model) {
  int count = 0;
  for (const std::uint16_t bits : model.bits) count += __builtin_popcount(bits);
  return count;
}

TEST(VoxelShape, SlabCoversItsSides) {
  const VoxelShapes shapes(slab());
  const ShapeModel& model = model_of(shapes);
  EXPECT_EQ(filled(model), 16 * 16 * 8);
  ASSERT_EQ(model.faces.size(), 6U);
  EXPECT_TRUE(model.covers_side[3]);
  EXPECT_FALSE(model.covers_side[0] || model.covers_side[2]);
  EXPECT_EQ(model.filled_octants, 0b0011'0011);
  EXPECT_FALSE(model.is_full);
  for (const ModelFace& face : model.faces) {
    EXPECT_EQ(face.on_side, face.direction != Direction::PosY);
    const Vec3 normal = glm::cross(face.corners[1] - face.corners[0], face.corners[2] - face.corners[0]);
    EXPECT_EQ(nearest_direction(DVec3(normal)), face.direction);
  }
}

TEST(VoxelShape, TurnsKeepFacesOutwardAndBoxesEqual) {
  const VoxelShapes shapes(VoxelShape::box({1, 2, 3}, {7, 5, 16}));
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    const ShapeModel& model = model_of(shapes, AxisOrientation::at(i));
    EXPECT_EQ(filled(model), 6 * 3 * 13);
    ASSERT_EQ(model.faces.size(), 6U);
    const ModelBox& box = model.boxes[0];
    for (const Direction direction : kDirections) {
      const ModelFace& face = model.faces[static_cast<std::size_t>(box.faces[static_cast<std::size_t>(direction)])];
      EXPECT_EQ(face.direction, direction);
      EXPECT_GT(glm::dot(glm::cross(face.corners[1] - face.corners[0], face.corners[3] - face.corners[0]),
                         Vec3(normal_of(direction))),
                0.0F);
      const FaceFrame& frame = frame_of(direction);
      EXPECT_EQ(face.corners[0][frame.axis], (frame.sign > 0 ? box.max : box.min)[frame.axis]);
    }
  }
}

TEST(VoxelShape, PackedFacesHaveTheSameContent) {
  const std::array<VoxelShapes, 3> all = {VoxelShapes(slab()), VoxelShapes(VoxelShape::crossed_plates()), stairs()};
  for (const VoxelShapes& shapes : all) {
    for (int i = 0; i < AxisOrientation::kCount; ++i) {
      const ShapeModel& model = model_of(shapes, AxisOrientation::at(i));
      ASSERT_EQ(model.packed_faces.size(), model.faces.size());
      for (std::size_t f = 0; f < model.faces.size(); ++f) {
        const ModelFace& face = model.faces[f];
        const PackedFace& packed = model.packed_faces[f];
        for (std::size_t k = 0; k < 12; ++k) {
          const std::uint8_t number = face.occluders[k % 4][k / 4];
          EXPECT_EQ(packed.eighths[k], number == kNoOccluder ? 0 : 1 << (number & 7));
          if (number != kNoOccluder) {
            EXPECT_EQ(packed.voxels[k], number / 8);
          }
        }
        const auto side = face.on_side ? static_cast<std::uint8_t>(face.direction) : PackedFace::kAlwaysSeen;
        EXPECT_EQ(packed.side, face.is_inner ? PackedFace::kNeverSeen : side);
      }
      for (std::size_t side = 0; side < 6; ++side) {
        EXPECT_EQ((model.covered_sides >> side & 1) != 0, model.covers_side[side]);
        EXPECT_EQ((model.touched_sides >> side & 1) != 0, model.sides[side] != SideMask{});
      }
    }
  }
}

TEST(VoxelShape, CrossedPlatesHaveFourFacesAndNoBits) {
  const VoxelShapes shapes(VoxelShape::crossed_plates());
  const ShapeModel& model = model_of(shapes);
  ASSERT_EQ(model.faces.size(), 4U);
  EXPECT_EQ(filled(model), 0);
  for (const ModelFace& face : model.faces) {
    EXPECT_NEAR(std::abs(face.normal.x), std::sqrt(0.5F), 1e-6F);
    EXPECT_FALSE(face.on_side);
  }
  // A turned box maps its corners back to itself.
  const ModelBox& box = model.boxes[0];
  const ModelFace& face = model.faces[static_cast<std::size_t>(box.faces[4])];
  for (const Vec3& corner : face.corners) {
    const Vec3 p = corner - box.origin;
    const Vec3 own(glm::dot(box.inverse[0], p), glm::dot(box.inverse[1], p), glm::dot(box.inverse[2], p));
    EXPECT_NEAR(own.z, 0.5F, 1e-6F);
    EXPECT_NEAR(std::abs(own.x - 0.5F), 0.5F, 1e-6F);
  }
}

TEST(VoxelShape, StatesWithTheSamePartsShareAModel) {
  // A piston, say: many bits are compared, few of their values matter.
  const VoxelShapes shapes = *VoxelShapes::from_rules(
      {.parts = {{.shape = slab()},
                 {.shape = VoxelShape::box({0, 8, 0}, {8, 16, 8}), .when = {{.state_mask = 0xFFFF, .state = 7}}}}});
  const ShapeModel& lower = shapes.model(0, {}, {});
  for (std::uint32_t state = 0; state < 1'000; ++state) {
    EXPECT_EQ(&shapes.model(state, {}, {}) == &lower, state != 7) << state;
  }
  EXPECT_EQ(shapes.model(7, {}, {}).boxes.size(), 2U);
}

TEST(VoxelShape, TextureCoordinatesAgreeWithCubes) {
  const VoxelShapes shapes(VoxelShape::box({0, 0, 0}, {16, 16, 16}));
  const ShapeModel& model = model_of(shapes);
  EXPECT_TRUE(model.is_full);
  for (const ModelFace& face : model.faces) {
    for (const bool mirrored : {false, true}) {
      for (std::uint8_t turn = 0; turn < 4; ++turn) {
        VoxelFace look;
        look.turn = turn;
        look.mirrored = mirrored;
        const TextureFrame frame = texture_frame(look, face.direction);
        for (std::size_t i = 0; i < 4; ++i) {
          const std::array<float, 2> uv = texture_uv(face, look, face.uv[i]);
          std::array<float, 2> cube = texture_coordinates(frame, face.corners[i]);
          const auto is_negative = [](const IVec3& axis) { return axis.x + axis.y + axis.z < 0; };
          if (is_negative(frame.right)) cube[0] += 1.0F;
          if (is_negative(frame.down)) cube[1] += 1.0F;
          EXPECT_EQ(uv, cube) << name_of(face.direction) << " turn " << int{turn} << " mirrored " << mirrored;
        }
      }
    }
  }
}

TEST(VoxelShape, RejectsBadElementsByIndex) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto reason = [](ShapeElement element) {
    const auto shape = VoxelShape::from_elements({ShapeElement{}, std::move(element)});
    return shape ? std::string() : shape.error().message;
  };
  EXPECT_EQ(reason({.min = Vec3(nan)}), "cannot use element 1 of a shape: a corner is not finite");
  EXPECT_EQ(reason({.min = Vec3(-17.0F)}), "cannot use element 1 of a shape: a corner is outside -16 to 32 sixteenths");
  EXPECT_EQ(reason({.min = Vec3(9.0F), .max = Vec3(8.0F)}),
            "cannot use element 1 of a shape: the upper corner is below the lower one");
  EXPECT_EQ(reason({.turn = ElementTurn{.degrees = nan}}), "cannot use element 1 of a shape: the turn is not finite");
  // No consumer looks for shapes farther than a voxel away.
  EXPECT_EQ(reason({.min = Vec3(-16.0F), .max = Vec3(32.0F), .turn = ElementTurn{.degrees = 45.0F}}),
            "cannot use element 1 of a shape: the turn moves a corner outside -16 to 32 sixteenths");
  EXPECT_EQ(reason({.turn = ElementTurn{.origin = Vec3(1e6F), .degrees = 180.0F}}),
            "cannot use element 1 of a shape: the origin of the turn is beyond 1,024 sixteenths");
  EXPECT_EQ(reason({.min = Vec3(-16.0F), .max = Vec3(32.0F), .turn = ElementTurn{.degrees = 90.0F}}), "");
  EXPECT_FALSE(VoxelShape::from_elements(std::vector<ShapeElement>(200)));
  EXPECT_FALSE(VoxelShape::from_elements({}));
  EXPECT_FALSE(VoxelShapes::from_rules({}));
}

TEST(VoxelShape, RegistryChecksStatesAndTexturesOfShapes) {
  VoxelRegistry types;
  EXPECT_FALSE(types.add({.name = "furnace", .state_bits = 1, .orientations = StateOrientations::about_y()}));
  const auto furnace = types.add({.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()});
  ASSERT_TRUE(furnace);
  EXPECT_TRUE(types.is_opaque(*furnace));
  EXPECT_TRUE(types.is_turned_by_state(*furnace));
  const auto half = types.add({.name = "slab", .shapes = slab()});
  ASSERT_TRUE(half);
  EXPECT_TRUE(types.is_shaped(*half));
  EXPECT_TRUE(types.is_transparent(*half));
  EXPECT_FALSE(types.occludes(*half));
  EXPECT_FALSE(types.blocks_light(*half));
  EXPECT_TRUE(types.remeshes_on_data(*half));
  VoxelRegistry copy = types;
  copy.replace(*half, {.name = "slab"});
  EXPECT_FALSE(copy.has_shapes());
  EXPECT_FALSE(copy.has_transparent());
  EXPECT_TRUE(types.has_shapes());
}

TEST(VoxelShape, RegistryReportsChangesOfAllThatShapesDependOn) {
  VoxelRegistry types;
  const VoxelShapes fluid = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid});
  const VoxelType half = *types.add({.name = "slab", .shapes = slab()});
  const VoxelType water = *types.add({.name = "water", .visibility = Visibility::Transparent, .shapes = fluid});
  ChangeCursor cursor = types.cursor();
  types.replace(half, {.name = "slab", .visibility = Visibility::Transparent, .shapes = slab()});
  types.replace(water, {.name = "water", .visibility = Visibility::Transparent, .state_bits = 4, .shapes = fluid});
  const TypeChanges changes = types.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 2U);
  EXPECT_TRUE(changes.items_unless_all()[0].visibility_changed) << "shapes of glass hide no faces";
  EXPECT_TRUE(changes.items_unless_all()[1].shape_changed) << "levels count only with bits for them";
}

TEST(VoxelShape, RegistryRejectsOrientationsBeyondTheState) {
  StateOrientations one{.first_bit = 32, .by_value = {AxisOrientation::quarter_turns(1, 1)}};
  EXPECT_FALSE(validate_type({.name = "stone", .state_bits = 32, .orientations = one}));
  one.first_bit = 31;
  EXPECT_TRUE(validate_type({.name = "stone", .state_bits = 32, .orientations = one}));
}

TEST(VoxelShape, StatesTurn) {
  const StateOrientations turns = StateOrientations::about_y(1);
  EXPECT_EQ(turns.bit_count(), 2);
  EXPECT_EQ(turns.of(0b111).apply(Direction::PosX), AxisOrientation::quarter_turns(1, 3).apply(Direction::PosX));
  EXPECT_EQ(turns.turned(0b101, AxisOrientation::quarter_turns(1, 1)), 0b111U);
  // A log has no front: any turn about its axis keeps its state.
  EXPECT_EQ(StateOrientations::along_axes().turned(0, AxisOrientation::quarter_turns(1, 1)), 0U);
  EXPECT_EQ(StateOrientations::along_axes().turned(0, AxisOrientation::quarter_turns(2, 1)), 1U);
  // A mirror across x leaves a front at +Z, and turns one at +X.
  StateOrientations furnace = StateOrientations::about_y();
  EXPECT_EQ(furnace.turned(0, AxisOrientation::mirror(0)), 2U);
  furnace.front = Direction::PosZ;
  EXPECT_EQ(furnace.turned(0, AxisOrientation::mirror(0)), 0U);
}

TEST(PlacedState, FollowsTheFaceOfTorchesAndLogs) {
  VoxelProperties torch{.name = "torch", .state_bits = 4, .orientations = StateOrientations::to_directions(1)};
  VoxelProperties log{.name = "log", .state_bits = 2, .orientations = StateOrientations::along_axes()};
  for (const Direction face : kDirections) {
    for (const Direction look : kDirections) {
      const PlacingHit hit{.face = face, .look = 3.0 * DVec3(normal_of(look))};
      const std::uint32_t state = placed_state(torch, hit, 0b1);
      EXPECT_EQ(torch.orientations.of(state).apply(Direction::PosY), face);
      EXPECT_EQ(state & 1U, 1U) << "a bit of another meaning stays";
      const Direction along = log.orientations.of(placed_state(log, hit)).apply(Direction::PosY);
      EXPECT_EQ(frame_of(along).axis, frame_of(face).axis);
    }
  }
}

TEST(PlacedState, TurnsFrontsByShapeAndPlayer) {
  VoxelProperties furnace{.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()};
  VoxelProperties steps = furnace;
  steps.shapes = shapes_for_tests::stairs();
  VoxelProperties torch = furnace;  // at a wall behind it
  torch.shapes = *VoxelShape::from_elements(
      {{.min = {-1, 3, 7}, .max = {1, 13, 9}, .turn = ElementTurn{.origin = {0, 3, 8}, .axis = 2, .degrees = -22.5F}}});
  const auto front = [](const VoxelProperties& type, const PlacingHit& hit) {
    return type.orientations.of(placed_state(type, hit)).apply(type.orientations.front);
  };
  for (const Direction way : {Direction::PosX, Direction::NegX, Direction::PosZ, Direction::NegZ}) {
    const DVec3 look = DVec3(normal_of(way)) + DVec3(0.2, -0.7, 0.3);
    const auto back = AxisOrientation::quarter_turns(1, 2).apply(way);
    for (const Direction face : kDirections) {
      PlacingHit hit{.face = face, .look = look};
      EXPECT_EQ(front(furnace, hit), back);
      EXPECT_EQ(front(steps, hit), way) << "the high side is away from the player";
      EXPECT_EQ(front(torch, hit), frame_of(face).axis == 1 ? back : face);
      hit.front = PlacedFront::AwayFromPlayer;
      EXPECT_EQ(front(torch, hit), way);
    }
    furnace.orientations.front = Direction::NegZ;
    EXPECT_EQ(front(furnace, {.face = Direction::PosY, .look = look}), back);
    furnace.orientations.front = Direction::PosX;
  }
}

TEST(PlacedState, PutsSlabsAndStairsIntoTheHalfThatWasHit) {
  VoxelProperties slabs{.name = "slab", .state_bits = 1, .shapes = slab()};
  slabs.orientations.by_value = {AxisOrientation(), AxisOrientation::quarter_turns(0, 2)};
  VoxelProperties steps{.name = "stairs", .state_bits = 3, .shapes = shapes_for_tests::stairs()};
  steps.orientations = StateOrientations::about_y_and_upside_down();
  const auto is_upper = [&](Direction face, float height) {
    const PlacingHit hit{.face = face, .point = {0.5F, height, 0.5F}, .look = {0.1, 0.3, -1.0}};
    const std::uint32_t turned = placed_state(steps, hit);
    EXPECT_EQ(steps.orientations.of(turned).apply(Direction::PosX), Direction::NegZ);
    const std::uint32_t state = placed_state(slabs, hit);
    EXPECT_EQ(state, turned >> 2U);
    return state == 1;
  };
  EXPECT_FALSE(is_upper(Direction::PosY, 1.0F));
  EXPECT_TRUE(is_upper(Direction::NegY, 0.0F));
  for (const Direction side : {Direction::PosX, Direction::NegX, Direction::PosZ, Direction::NegZ}) {
    EXPECT_FALSE(is_upper(side, 0.4F));
    EXPECT_TRUE(is_upper(side, 0.6F));
  }
}

TEST(PlacedState, ToleratesViewsWithoutDirectionAndTypesWithoutOrientations) {
  const VoxelProperties stone{.name = "stone", .state_bits = 4};
  EXPECT_EQ(placed_state(stone, {}, 9), 9U);
  const VoxelProperties furnace{.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const DVec3& look : {DVec3(0.0), DVec3(nan, 0.0, 0.0), DVec3(0.0, -1.0, 0.0)}) {
    EXPECT_EQ(placed_state(furnace, {.point = Vec3(static_cast<float>(nan)), .look = look}, 3), 0U);
  }
}

TEST(PlacedState, TakesViewsOfAnyLength) {
  const VoxelProperties furnace{.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()};
  for (const double length : {1e-300, 1.0, 1e300}) {
    EXPECT_EQ(placed_state(furnace, {.look = DVec3(length, 0.0, 0.0)}), 2U) << length;
  }
}

TEST(ShapeAt, FencesConnectToFencesAndFullSides) {
  VoxelRegistry types;
  const VoxelType stone = *types.add({.name = "stone"});
  const VoxelType post = *types.add({.name = "fence", .shapes = fence()});
  const VoxelType half = *types.add({.name = "slab", .shapes = slab()});
  Grid grid;
  grid.set({0, 0, 0}, post);
  EXPECT_EQ(filled(*shape_at(grid, types, {0, 0, 0})), 4 * 4 * 16);
  grid.set({1, 0, 0}, post);
  grid.set({0, 0, -1}, stone);
  grid.set({-1, 0, 0}, half);
  EXPECT_EQ(filled(*shape_at(grid, types, {0, 0, 0})), 4 * 4 * 16 + 2 * 6 * 3 * 2);
  EXPECT_EQ(filled(*shape_at(grid, types, {1, 0, 0})), 4 * 4 * 16 + 6 * 3 * 2);
  EXPECT_EQ(shape_at(grid, types, {0, 0, -1}), nullptr);
}

TEST(ShapeAt, StairsFormCornersInAllTurns) {
  VoxelRegistry types;
  const VoxelType type = *types.add({.name = "stairs",
                                     .state_bits = 3,
                                     .orientations = StateOrientations::about_y_and_upside_down(),
                                     .shapes = stairs()});
  constexpr int kStraight = 2048 + 1024;
  for (std::uint32_t state = 0; state < 8; ++state) {
    const AxisOrientation turn = types[type].orientations.of(state);
    const IVec3 front = normal_of(turn.apply(Direction::PosX));
    const std::uint32_t quarter = types[type].orientations.turned(state, AxisOrientation::quarter_turns(1, 1));
    Grid grid;
    grid.set({0, 0, 0}, type, {.state = state});
    EXPECT_EQ(filled(*shape_at(grid, types, {0, 0, 0})), kStraight);
    grid.set(front, type, {.state = quarter});
    EXPECT_EQ(filled(*shape_at(grid, types, {0, 0, 0})), kStraight - 512) << "an outer corner, state " << state;
    grid.set(front, kAir);
    grid.set(-front, type, {.state = quarter});
    EXPECT_EQ(filled(*shape_at(grid, types, {0, 0, 0})), kStraight + 512) << "an inner corner, state " << state;
  }
}

VoxelType add_water(VoxelRegistry& types) {
  return *types.add({.name = "water",
                     .visibility = Visibility::Transparent,
                     .state_bits = 4,
                     .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid})});
}

TEST(ShapeAt, FluidsInclineTowardsLowerNeighbours) {
  VoxelRegistry types;
  const VoxelType water = add_water(types);
  Grid grid;
  for (int x = 0; x < 4; ++x) grid.set({x, 0, 0}, water, {.state = static_cast<std::uint32_t>(2 * x)});
  const ShapeModel* source = shape_at(grid, types, {0, 0, 0});
  const ShapeModel* next = shape_at(grid, types, {1, 0, 0});
  EXPECT_GT(source->free_faces, 0);
  const auto height = [](const ShapeModel& model, float x, float z) {
    float highest = 0.0F;
    for (const ModelFace& face : model.faces) {
      for (const Vec3& corner : face.corners) {
        if (corner.x == x && corner.z == z) highest = std::max(highest, corner.y);
      }
    }
    return highest;
  };
  // Common corners have equal heights.
  EXPECT_EQ(height(*source, 1, 0), height(*next, 0, 0));
  EXPECT_EQ(height(*source, 1, 1), height(*next, 0, 1));
  EXPECT_GT(height(*source, 1, 0), height(*next, 1, 0));
  grid.set({1, 1, 0}, water);
  EXPECT_TRUE(shape_at(grid, types, {1, 0, 0})->is_full);
}

TEST(ShapeAt, SurfacesOfFluidsFaceOutwardForAllHeights) {
  const VoxelShapes fluid = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid});
  constexpr std::array<std::uint8_t, 3> kHeights = {0, 5, 16};
  for (int i = 0; i < 81; ++i) {
    const auto height = [&](int digit) { return kHeights[static_cast<std::size_t>(digit % 3)]; };
    ShapeSurroundings around;
    around.heights = {height(i), height(i / 3), height(i / 9), height(i / 27)};
    const ShapeModel& model = fluid.model(0, {}, around);
    for (std::size_t f = model.faces.size() - model.free_faces; f < model.faces.size(); ++f) {
      const ModelFace& face = model.faces[f];
      const Vec3 area = glm::cross(face.corners[1] - face.corners[0], face.corners[2] - face.corners[0]);
      EXPECT_GT(glm::dot(area, face.normal), 0.0F) << "heights " << i << ", face " << f;
      const FaceFrame& frame = frame_of(face.direction);
      if (face.normal.y != 0.0F) continue;
      EXPECT_TRUE(face.on_side) << "heights " << i << ", face " << f;
      for (const Vec3& corner : face.corners) EXPECT_EQ(corner[frame.axis], frame.sign > 0 ? 1.0F : 0.0F);
    }
  }
}

TEST(ShapeAt, FallingFluidsMeetTheirNeighboursAtEqualHeights) {
  VoxelRegistry types;
  const VoxelType water = add_water(types);
  Grid grid;
  grid.set({0, 0, 0}, water, {.state = 8});
  grid.set({1, 0, 0}, water);
  EXPECT_TRUE(shape_at(grid, types, {0, 0, 0})->is_full);
  // The faces between the two are hidden, so that a step between them would be a hole.
  EXPECT_EQ(shape_at(grid, types, {1, 0, 0})->max.y, 1.0F);
}

VoxelProperties fluid_of(const char* name, std::uint32_t groups, std::uint8_t red = 40) {
  return {.name = name,
          .colour = {red, 90, 200, 120},
          .visibility = Visibility::Transparent,
          .state_bits = 4,
          .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = groups})};
}

// A slab that contains a fluid if bit 0 of its state is set.
VoxelProperties wet_slab(std::uint32_t groups) {
  ShapeRules rules{.parts = {{.shape = slab()}}};
  rules.fluid = ContainedFluid{.groups = groups, .when = {{.state_mask = 1, .state = 1}}};
  return {.name = "wet slab", .state_bits = 1, .shapes = *VoxelShapes::from_rules(std::move(rules))};
}

TEST(ShapeAt, FluidsOfOneKindJoinAndHideTheirFaces) {
  VoxelRegistry types;
  const VoxelType lake = *types.add(fluid_of("lake", 2));
  const VoxelType sea = *types.add(fluid_of("sea", 2, 90));
  const VoxelType oil = *types.add(fluid_of("oil", 8));
  Grid grid;
  grid.set({0, 0, 0}, lake);
  grid.set({1, 0, 0}, sea);
  grid.set({2, 0, 0}, oil);
  const auto at = [&](int x) { return shape_at(grid, types, {x, 0, 0}); };
  SideMask whole;
  whole.fill(~std::uint64_t{0});
  EXPECT_TRUE(covers(types, sea, at(1), lake, Direction::PosX, whole));
  EXPECT_TRUE(covers(types, lake, at(0), sea, Direction::NegX, whole));
  EXPECT_FALSE(covers(types, oil, at(2), sea, Direction::PosX, whole));
  EXPECT_TRUE(types.joins(lake, sea));
  EXPECT_FALSE(types.joins(oil, sea));
  grid.set({0, 1, 0}, sea);
  EXPECT_TRUE(at(0)->is_full) << "below another type of its kind";
  EXPECT_EQ(at(1)->max.y, 1.0F) << "as high as the full voxel next to it";
  grid.set({0, 1, 0}, oil);
  EXPECT_FALSE(at(0)->is_full);
}

TEST(ShapeAt, ShapesContainFluids) {
  VoxelRegistry types;
  const VoxelType half = *types.add(wet_slab(2));
  Grid grid;
  grid.set({0, 0, 0}, half, {.state = 1});
  EXPECT_EQ(fluid_at(grid, types, {0, 0, 0}).groups, 2U);
  EXPECT_EQ(fluid_at(grid, types, {0, 0, 0}).type, kAir) << "no fluid is registered";
  EXPECT_EQ(fluid_at(grid, types, {0, 0, 0}).model, nullptr);
  const VoxelType sea = *types.add(fluid_of("sea", 2));
  const VoxelType lake = *types.add(fluid_of("lake", 2, 90));
  EXPECT_EQ(fluid_at(grid, types, {0, 0, 0}).type, sea) << "the first one";
  grid.set({1, 0, 0}, lake);
  const InnerFluid fluid = fluid_at(grid, types, {0, 0, 0});
  EXPECT_EQ(fluid.type, lake) << "that of its neighbour";
  ASSERT_NE(fluid.model, nullptr);
  const auto corner_height = [](const ShapeModel& model, float x) {
    float highest = 0.0F;
    for (const ModelFace& face : model.faces) {
      for (const Vec3& corner : face.corners) highest = corner.x == x ? std::max(highest, corner.y) : highest;
    }
    return highest;
  };
  const float joined = corner_height(*shape_at(grid, types, {1, 0, 0}), 0.0F);
  EXPECT_EQ(corner_height(*fluid.model, 1.0F), joined) << "their common corners";
  grid.set_data({0, 0, 0}, {.state = 0});
  EXPECT_EQ(fluid_at(grid, types, {0, 0, 0}).groups, 0U);
  EXPECT_LT(corner_height(*shape_at(grid, types, {1, 0, 0}), 0.0F), joined) << "next to a dry slab";
  grid.set_data({0, 0, 0}, {.state = 1});
  grid.set({0, 1, 0}, half, {.state = 1});
  EXPECT_TRUE(fluid_at(grid, types, {0, 0, 0}).model->is_full) << "below a wet slab";
  EXPECT_EQ(shape_at(grid, types, {0, 0, 0})->max.y, 0.5F);
}

TEST(VoxelShape, RejectsFluidsWithoutOneGroupAndWithNeighbours) {
  const auto error_of = [](ShapeRules rules) {
    const auto made = VoxelShapes::from_rules(std::move(rules));
    return made ? std::string() : made.error().message;
  };
  const std::string start = "cannot use the shapes of a type: ";
  const auto with = [](ContainedFluid fluid) {
    ShapeRules rules{.parts = {{.shape = slab()}}};
    rules.fluid = std::move(fluid);
    return rules;
  };
  EXPECT_EQ(error_of(with({.groups = 2})), "");
  EXPECT_EQ(error_of(with({})), start + "the fluid that voxels contain has no group");
  EXPECT_EQ(error_of(with({.groups = 3})), start + "the fluid that voxels contain has more than one group");
  EXPECT_EQ(error_of(with({.groups = 2, .when = {{.connected = {Direction::PosX}}}})),
            start + "the fluid that voxels contain depends on neighbours");
  EXPECT_EQ(error_of(with({.groups = 2, .when = {{.corner = StairCorner::Straight}}})),
            start + "the fluid that voxels contain depends on neighbours");
  EXPECT_EQ(error_of(with({.groups = 2, .when = {{.positions = {2, 0, 1}}}})),
            start + "the fluid that voxels contain depends on positions");
  ShapeRules fluid = with({.groups = 2});
  fluid.neighbours = ShapeNeighbours::Fluid;
  EXPECT_EQ(error_of(fluid), start + "a fluid contains a fluid");
  EXPECT_EQ(error_of({.neighbours = ShapeNeighbours::Fluid, .groups = 0}), start + "a fluid has no group");
  EXPECT_EQ(error_of({.neighbours = ShapeNeighbours::Fluid, .groups = 6}), start + "a fluid has more than one group");
  EXPECT_EQ(error_of({.neighbours = ShapeNeighbours::Fluid, .groups = 1U << 31}), "");
  VoxelProperties type = wet_slab(2);
  type.state_bits = 0;
  EXPECT_FALSE(validate_type(type)) << "its state does not have the bit";
}

TEST(ShapeIndex, CubesOfGlassAreNotListed) {
  VoxelRegistry types;
  const VoxelType water = *types.add(fluid_of("water", 2));
  VoxelProperties of_lava = fluid_of("lava", 4);
  of_lava.visibility = Visibility::Opaque;
  const VoxelType lava = *types.add(of_lava);
  const VoxelType glass = *types.add({.name = "glass",
                                      .colour = {9, 9, 9, 99},
                                      .visibility = Visibility::Transparent,
                                      .shapes = VoxelShape::box(IVec3(0), IVec3(16))});
  ShapeElement tinted;
  tinted.faces[2].face = VoxelFace{.tint = {1, 2, 3}};
  const VoxelType other = *types.add(
      {.name = "tinted glass", .visibility = Visibility::Transparent, .shapes = *VoxelShape::from_elements({tinted})});
  const VoxelType half = *types.add(wet_slab(2));
  Grid grid;
  grid.fill_box({{0, 0, 0}, {4, 3, 4}}, water);
  grid.fill_box({{10, 0, 0}, {14, 3, 4}}, lava);
  grid.set({20, 0, 0}, glass);
  grid.set({22, 0, 0}, other);
  grid.set({1, 0, 1}, half, {.state = 1});
  ChangeCursor cursor = grid.cursor();
  ChangeCursor data_cursor = grid.cursor();
  ShapeIndex index;
  index.build(grid, types);
  EXPECT_TRUE(index.is_cube({0, 1, 0}));
  EXPECT_TRUE(index.at({0, 1, 0}).empty());
  EXPECT_FALSE(index.is_cube({0, 2, 0})) << "the surface";
  EXPECT_EQ(index.at({0, 2, 0}).size(), 1U);
  EXPECT_TRUE(index.is_cube({20, 0, 0}));
  EXPECT_FALSE(index.is_cube({22, 0, 0})) << "a side with another look";
  EXPECT_TRUE(index.at({22, 0, 0}).has_own());
  EXPECT_FALSE(index.is_cube({11, 1, 1})) << "opaque";
  EXPECT_TRUE(index.at({11, 1, 1}).has_own());
  const ShapesAtVoxel wet = index.at({1, 0, 1});
  ASSERT_EQ(wet.size(), 2U);
  EXPECT_TRUE(wet.has_own());
  EXPECT_EQ(wet[0].type, half);
  EXPECT_FALSE(wet.listed()[0].is_inner);
  EXPECT_EQ(wet[1].type, water);
  EXPECT_TRUE(wet.listed()[1].is_inner);
  EXPECT_TRUE(wet[1].model->is_full);

  // The water above is gone, so that a cube becomes a surface; and the slab is dry.
  grid.set({0, 2, 0}, kAir);
  grid.set_data({1, 0, 1}, {.state = 0});
  index.update(grid, types, grid.changes_since(cursor), grid.data_changes_since(data_cursor));
  EXPECT_FALSE(index.is_cube({0, 1, 0}));
  EXPECT_TRUE(index.at({0, 1, 0}).has_own());
  EXPECT_EQ(index.at({1, 0, 1}).size(), 1U);
}

TEST(ShapeIndex, ListsShapesInVoxelsThatTheyTouchAndFollowsEdits) {
  VoxelRegistry types;
  const VoxelType half = *types.add({.name = "slab", .shapes = slab()});
  const VoxelType post = *types.add({.name = "fence", .shapes = fence()});
  const VoxelType tall = *types.add(
      {.name = "tall", .shapes = *VoxelShape::from_elements({{.min = Vec3(0.0F), .max = Vec3(16, 24, 16)}})});
  Grid grid;
  grid.set({63, 63, 0}, tall);
  grid.set({64, 63, 0}, post);
  grid.set({5, 5, 5}, half);
  grid.set({5, 6, 5}, half);
  grid.set({5, 7, 5}, tall);
  ChangeCursor cursor = grid.cursor();
  ChangeCursor data_cursor = grid.cursor();
  ShapeIndex index;
  index.build(grid, types);
  ASSERT_EQ(index.at({63, 64, 0}).size(), 1U);
  EXPECT_EQ(index.at({63, 64, 0})[0].voxel, IVec3(63, 63, 0));
  EXPECT_TRUE(index.at({63, 65, 0}).empty());
  EXPECT_EQ(index.at({5, 6, 5})[0].type, half);
  EXPECT_EQ(index.touched_row({0, 8, 5}), std::uint64_t{1} << 5);
  int count = 0;
  index.for_each_in({0, 0, 0}, [&](const PlacedShape&) { ++count; });
  EXPECT_EQ(count, 4);

  // The fence connects to a fence in the next chunk, and its shape changes although its own voxel does not.
  grid.set({63, 63, 0}, post);
  index.update(grid, types, grid.changes_since(cursor), grid.data_changes_since(data_cursor));
  EXPECT_TRUE(index.at({63, 64, 0}).empty());
  EXPECT_EQ(filled(*index.at({64, 63, 0})[0].model), 4 * 4 * 16 + 6 * 3 * 2);
  ShapeIndex fresh;
  fresh.build(grid, types);
  EXPECT_EQ(index.bounds(), fresh.bounds());
}

// A state turns a beam away from a chunk that it touched before.
TEST(ShapeIndex, FailedUpdateChangesNothing) {
  VoxelRegistry types;
  VoxelProperties of_beam{.name = "beam", .state_bits = 2};
  of_beam.orientations = StateOrientations::about_y();
  of_beam.shapes = *VoxelShape::from_elements({{.min = {0, 4, 4}, .max = {32, 8, 8}}});
  const VoxelType beam = *types.add(of_beam);
  Grid grid;
  grid.set({63, 5, 5}, beam);
  grid.set({200, 5, 5}, beam);
  for (const bool is_all : {false, true}) {
    ASSERT_TRUE(grid.set_data({63, 5, 5}, {.state = 0}) == is_all);
    ShapeIndex index;
    index.build(grid, types);
    ASSERT_TRUE(index.touches({64, 5, 5}));
    ASSERT_TRUE(index.at({199, 5, 5}).empty());
    const std::vector<IVec3> before = index.chunks();
    ChangeCursor cursor = grid.cursor();
    grid.set_data({63, 5, 5}, {.state = 2});
    DataChanges changes;
    if (is_all) {
      changes.all = true;
    } else {
      changes = grid.data_changes_since(cursor);
      ASSERT_FALSE(changes.empty());
    }
    std::vector<IVec3> changed;
    const int failures = fail_each_allocation([&] { changed = index.update(grid, types, {}, changes); },
                                              [&] {
                                                EXPECT_EQ(index.chunks(), before);
                                                EXPECT_TRUE(index.touches({64, 5, 5}));
                                                EXPECT_TRUE(index.touches({200, 5, 5}));
                                              });
    EXPECT_GT(failures, 10);
    EXPECT_FALSE(index.touches({64, 5, 5}));
    EXPECT_TRUE(index.touches({62, 5, 5}));
    EXPECT_TRUE(index.touches({200, 5, 5}));
    EXPECT_NE(std::ranges::find(changed, IVec3(1, 0, 0)), changed.end())
        << "it is listed although it has no shapes left";
  }
}

// Lists the shapes that touch a voxel, as ShapeIndex::at does. Those of full water are cubes.
std::vector<PlacedShape> touching(const Grid& grid, const VoxelRegistry& types, IVec3 at) {
  std::vector<PlacedShape> result;
  for (int i = -1; i < 27; ++i) {
    if (i == 13) continue;
    const IVec3 voxel = i < 0 ? at : at + IVec3(i % 3, i / 3 % 3, i / 9) - 1;
    const ShapeModel* const model = shape_at(grid, types, voxel);
    const IVec3 offset = at - voxel;
    if (model == nullptr || !model->cells.contains(offset)) continue;
    const VoxelType type = grid.get(voxel);
    if (types[type].visibility == Visibility::Transparent && model->is_full) continue;
    result.push_back({voxel, type, model});
    const InnerFluid fluid = i < 0 ? fluid_at(grid, types, voxel) : InnerFluid{};
    if (fluid.model != nullptr) result.push_back({voxel, fluid.type, fluid.model});
  }
  return result;
}

TEST(ShapeIndex, ListsEqualThoseOfEachVoxel) {
  VoxelRegistry types;
  const VoxelType stone = *types.add({.name = "stone"});
  const VoxelType half = *types.add({.name = "slab", .shapes = slab()});
  const VoxelType post = *types.add({.name = "fence", .shapes = fence()});
  const VoxelType wide = *types.add(
      {.name = "wide", .shapes = *VoxelShape::from_elements({{.min = Vec3(-16, 0, -8), .max = Vec3(24, 24, 32)}})});
  const VoxelType water = add_water(types);
  const VoxelType rubble = *types.add({.name = "rubble", .shapes = shapes_for_tests::rubble()});
  const VoxelType wet = *types.add(wet_slab(1));
  const std::array<VoxelType, 8> all = {stone, half, post, wide, water, water, rubble, wet};
  std::mt19937 random(5);
  Grid grid;
  for (int i = 0; i < 260; ++i) {
    const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
    grid.set(IVec3(below(12), below(12), below(12)) - 6, all[random() % all.size()],
             {static_cast<std::uint32_t>(random() % 4), {}});
  }
  grid.fill_box({{20, 20, 20}, {29, 29, 29}}, water);
  ShapeIndex index;
  index.build(grid, types);
  IBox bounds;
  std::size_t touched = 0;
  std::size_t shaped = 0;
  ShapeIndex::Reader reader(index);
  const auto expect_at = [&](IVec3 at) {
    const std::vector<PlacedShape> wanted = touching(grid, types, at);
    const ShapesAtVoxel found = reader.at(at);
    ASSERT_EQ(found.size(), wanted.size()) << at.x << ' ' << at.y << ' ' << at.z;
    EXPECT_EQ(found.empty(), wanted.empty());
    const ShapeModel* const own = shape_at(grid, types, at);
    EXPECT_EQ(index.is_cube(at), own != nullptr && grid.get(at) == water && own->is_full);
    EXPECT_EQ(found.has_own(), own != nullptr && !index.is_cube(at));
    EXPECT_EQ((index.touched_row(at) >> (at.x & (kChunkEdge - 1)) & 1U) != 0, !wanted.empty());
    std::size_t i = 0;
    for (const PlacedShape& shape : found) {
      EXPECT_EQ(shape.voxel, wanted[i].voxel);
      EXPECT_EQ(shape.type, wanted[i].type);
      EXPECT_EQ(shape.model, wanted[i].model);
      ASSERT_EQ(found.boxes(found.listed()[i]).size(), shape.model->boxes.size());
      ++i;
    }
    if (!wanted.empty()) bounds = unite(bounds, {at, at + 1});
    touched += wanted.empty() ? 0 : 1;
    shaped += found.has_own() ? 1 : 0;
  };
  for (const IBox& box : {IBox{IVec3(-9), IVec3(9)}, IBox{IVec3(18), IVec3(31)}}) {
    for (int i = 0; i < box.size().x * box.size().y * box.size().z; ++i) {
      const IVec3 size = box.size();
      expect_at(box.min + IVec3(i % size.x, i / size.x % size.y, i / size.x / size.y));
    }
  }
  EXPECT_EQ(index.bounds(), bounds);
  EXPECT_GT(touched, shaped + 100);
  std::size_t visited = 0;
  for (const IVec3 chunk : index.chunks()) index.for_each_in(chunk, [&](const PlacedShape&) { ++visited; });
  EXPECT_EQ(visited, shaped);
}

// java.util.Random, as its documentation states it.
class JavaRandom {
 public:
  explicit JavaRandom(std::int64_t seed) : seed_((seed ^ 0x5DEECE66D) & kMask) {}
  [[nodiscard]] std::int64_t next_long() {
    const std::int64_t upper = std::int64_t{next()} * (std::int64_t{1} << 32);
    return upper + next();
  }

 private:
  static constexpr std::int64_t kMask = (std::int64_t{1} << 48) - 1;
  std::int32_t next() {
    seed_ = static_cast<std::int64_t>(static_cast<std::uint64_t>(seed_) * 0x5DEECE66DU + 0xBU) & kMask;
    return static_cast<std::int32_t>(seed_ >> 16);
  }
  std::int64_t seed_;
};

TEST(ShapePositions, NumbersFollowThePublishedGenerator) {
  ASSERT_EQ(JavaRandom(0).next_long(), -4962768465676381896) << "the published first number of seed 0";
  std::mt19937 random(3);
  for (int i = 0; i < 1'000; ++i) {
    const auto coordinate = [&] { return static_cast<int>(random() % 60'000'000U) - 30'000'000; };
    const IVec3 at = i == 0 ? IVec3(0) : IVec3(coordinate(), coordinate() % 320, coordinate());
    const auto x = std::int64_t{static_cast<std::int32_t>(static_cast<std::uint32_t>(at.x) * 3'129'871U)};
    const std::uint64_t mixed = static_cast<std::uint64_t>(x) ^
                                static_cast<std::uint64_t>(std::int64_t{at.z} * 116'129'781) ^
                                static_cast<std::uint64_t>(std::int64_t{at.y});
    const std::uint64_t squared = mixed * mixed * 42'317'861U + mixed * 11U;
    const auto number = static_cast<std::int32_t>(JavaRandom(static_cast<std::int64_t>(squared) >> 16).next_long());
    if (number == std::numeric_limits<std::int32_t>::min()) continue;
    EXPECT_EQ(position_number(at), static_cast<std::uint32_t>(std::abs(number))) << at.x << ' ' << at.y << ' ' << at.z;
  }
}

TEST(ShapePositions, EachVoxelHasTheModelOfItsShare) {
  VoxelRegistry types;
  const VoxelType rubble = *types.add({.name = "rubble", .shapes = shapes_for_tests::rubble()});
  EXPECT_EQ(types[rubble].shapes.position_count(), 4U);
  EXPECT_EQ(VoxelShapes(slab()).position_count(), 1U);
  Grid grid;
  grid.fill_box({{-16, -16, -16}, {16, 16, 16}}, rubble);
  std::map<int, int> count;  // by the sixteenths of the model
  for (int i = 0; i < 32 * 32 * 32; ++i) {
    const IVec3 at = IVec3(i & 31, i >> 5 & 31, i >> 10) - 16;
    const ShapeModel* const model = shape_at(grid, types, at);
    const std::uint32_t share = position_number(at) % 4;
    const int expected = share == 0 ? 16 * 6 * 16 : share == 3 ? 16 * 16 * 3 : 8 * 16 * 8;
    ASSERT_EQ(filled(*model), expected);
    ++count[expected];
    // A chunk's neighbourhood knows where it lies.
    const IVec3 chunk = chunk_of(at);
    EXPECT_EQ(shape_at(grid.neighbourhood(chunk), types, local_of(at)), model);
    EXPECT_EQ(shape_at(grid.neighbourhood(chunk + IVec3(1, 0, 0)), types, at - (chunk + IVec3(1, 0, 0)) * kChunkEdge),
              model)
        << "seen from the next chunk";
  }
  ASSERT_EQ(count.size(), 3U);
  EXPECT_NEAR(count[8 * 16 * 8], 32 * 32 * 32 / 2, 1'000);
  EXPECT_NEAR(count[16 * 6 * 16], 32 * 32 * 32 / 4, 1'000);
}

TEST(ShapePositions, SharesOfSeveralCountsCombine) {
  const auto part = [](int height, PositionShare share) {
    return ShapePart{.shape = VoxelShape::box({0, 0, 0}, {16, height, 16}), .when = {{.positions = share}}};
  };
  const VoxelShapes shapes = *VoxelShapes::from_rules({.parts = {part(1, {3, 0, 1}), part(2, {4, 1, 3})}});
  EXPECT_EQ(shapes.position_count(), 12U);
  for (std::uint16_t position = 0; position < 12; ++position) {
    const std::size_t boxes = (position % 3 == 0 ? 1U : 0U) + (position % 4 == 1 || position % 4 == 2 ? 1U : 0U);
    EXPECT_EQ(shapes.model(0, {}, {.position = position}).boxes.size(), boxes) << position;
  }
  EXPECT_EQ(&shapes.model(0, {}, {.position = 4}), &shapes.model(0, {}, {.position = 8}));
}

// The most shares that a file can have. The last 12 put each position into its own class. Classifying costs little more
// than to find the shares of each position.
TEST(ShapePositions, MostSharesAreClassifiedFast) {
  ShapeRules rules{.parts = {{.shape = slab()}, {.shape = slab()}}};
  std::vector<PositionShare> shares;
  constexpr std::size_t kSingles = kMaxPositionShares - 12;
  for (std::size_t i = 0; i < kMaxPositionShares; ++i) {
    const auto at = static_cast<std::uint16_t>(i);
    const auto bit = static_cast<std::uint16_t>(i < kSingles ? 0U : 1U << (i - kSingles));
    const auto twice = static_cast<std::uint16_t>(2 * bit);
    shares.push_back(i < kSingles ? PositionShare{4'096, at, static_cast<std::uint16_t>(at + 1)}
                                  : PositionShare{twice, bit, twice});
    rules.parts[i < kSingles ? 0 : 1].when.push_back({.positions = shares.back()});
  }
  const auto seconds_of = [](auto&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  double least = std::numeric_limits<double>::infinity();
  VoxelShapes shapes;
  for (int i = 0; i < 3; ++i) {
    std::size_t found = 0;
    const double least_work = seconds_of([&] {
      for (std::uint32_t position = 0; position < kMaxPositionCount; ++position) {
        for (const PositionShare& share : shares) {
          const std::uint32_t reduced = position % share.count;
          found += static_cast<std::size_t>(reduced >= share.first && reduced < share.end);
        }
      }
    });
    EXPECT_EQ(found, kSingles + std::size_t{12} * 2'048);
    const double ratio = seconds_of([&] { shapes = *VoxelShapes::from_rules(rules); }) / least_work;
    RecordProperty("ratio", std::to_string(ratio));
    least = std::min(least, ratio);
  }
  EXPECT_LT(least, 5.0);
  ASSERT_EQ(shapes.position_count(), kMaxPositionCount);
  for (std::uint16_t position = 0; position < kMaxPositionCount; ++position) {
    const std::size_t boxes = (position < kSingles ? 1U : 0U) + (position != 0 ? 1U : 0U);
    ASSERT_EQ(shapes.model(0, {}, {.position = position}).boxes.size(), boxes) << position;
  }
}

TEST(ShapePositions, WrongSharesAreRefused) {
  const auto error_of = [](std::vector<PositionShare> shares) {
    ShapeRules rules;
    for (const PositionShare& share : shares) {
      rules.parts.push_back({.shape = slab(), .when = {{.positions = share}}});
    }
    const auto made = VoxelShapes::from_rules(std::move(rules));
    return made ? "" : made.error().message;
  };
  EXPECT_EQ(error_of({{4, 0, 4}}), "");
  EXPECT_EQ(error_of({{4, 2, 2}}), "cannot use the shapes of a type: a share of positions is empty");
  EXPECT_EQ(error_of({{4, 3, 5}}), "cannot use the shapes of a type: a share of positions is empty");
  EXPECT_EQ(error_of({{0, 0, 1}}), "cannot use the shapes of a type: a share of positions is empty");
  EXPECT_EQ(error_of({{4'096, 0, 1}, {64, 0, 1}}), "");
  EXPECT_EQ(error_of({{4'096, 0, 1}, {3, 0, 1}}),
            "cannot use the shapes of a type: the shares of positions have no common count up to 4096");
  ShapeRules rules{.parts = {{.shape = slab()}}};
  for (std::uint16_t i = 0; i < 1'025; ++i) {
    rules.parts[0].when.push_back({.positions = {2'048, i, static_cast<std::uint16_t>(i + 1)}});
  }
  EXPECT_FALSE(VoxelShapes::from_rules(std::move(rules)));
}

TEST(ShapePositions, MeansCountShares) {
  VoxelRegistry types;
  const auto part = [](Rgba8 colour, std::uint16_t first, std::uint16_t end) {
    ShapeElement box;
    for (ElementFace& face : box.faces) face.face = VoxelFace{.tint = colour};
    return ShapePart{.shape = *VoxelShape::from_elements({box}), .when = {{.positions = {4, first, end}}}};
  };
  const VoxelType type = *types.add(
      {.name = "t", .shapes = *VoxelShapes::from_rules({.parts = {part({255, 0, 0}, 0, 1), part({0, 255, 0}, 1, 4)}})});
  const Vec3 mean = mean_of_shapes(types[type]);
  EXPECT_NEAR(mean.x, 0.25F, 1e-6F);
  EXPECT_NEAR(mean.y, 0.75F, 1e-6F);
}

// Blocks of equal voxels share their list.
TEST(ShapeIndex, OceanTakesLessThanOneBytePerVoxel) {
  VoxelRegistry types;
  const VoxelType water = add_water(types);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {2 * kChunkEdge, kChunkEdge, kChunkEdge}}, water);
  ShapeIndex index;
  index.build(grid, types);
  EXPECT_LT(static_cast<double>(index.bytes()), 0.6 * kChunkVoxels * 2);
  EXPECT_EQ(index.at({70, 63, 5})[0].model, shape_at(grid, types, {70, 63, 5}));
  EXPECT_TRUE(index.at({70, 62, 5}).empty());
  EXPECT_TRUE(index.is_cube({70, 62, 5}));
}

}  // namespace
}  // namespace quoin
