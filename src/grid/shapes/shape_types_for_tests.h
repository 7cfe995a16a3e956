#pragma once

// Types with shapes: slab, stairs, fence, torch, flower, door, and more. For tests and benchmarks.

#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>

namespace quoin::shapes_for_tests {

inline VoxelShape slab() {
  return VoxelShape::box({0, 0, 0}, {16, 8, 16});
}

// Stairs of one box below and quarters above it, as ShapeNeighbours::Stairs describes.
inline VoxelShapes stairs() {
  const auto quarter = [](int x, int z) { return VoxelShape::box({x, 8, z}, {x + 8, 16, z + 8}); };
  const auto at = [](StairCorner corner) { return ShapeCondition{.corner = corner}; };
  using enum StairCorner;
  return *VoxelShapes::from_rules(
      {.parts = {{.shape = slab()},
                 {.shape = quarter(8, 0), .when = {at(Straight), at(OuterLeft), at(InnerLeft), at(InnerRight)}},
                 {.shape = quarter(8, 8), .when = {at(Straight), at(OuterRight), at(InnerLeft), at(InnerRight)}},
                 {.shape = quarter(0, 0), .when = {at(InnerLeft)}},
                 {.shape = quarter(0, 8), .when = {at(InnerRight)}}},
       .neighbours = ShapeNeighbours::Stairs});
}

// The same without corners.
inline VoxelShape straight_stairs() {
  return VoxelShape::boxes({{{0, 0, 0}, {16, 8, 16}}, {{8, 8, 0}, {16, 16, 16}}});
}

// A post with one or two rails to each side that is connected.
inline VoxelShapes fence(int rails = 1) {
  const IBox lower{{10, 6, 7}, {16, 9, 9}};
  const IBox upper{{10, 12, 7}, {16, 15, 9}};
  const VoxelShape arm = rails == 1 ? VoxelShape::boxes({lower}) : VoxelShape::boxes({upper, lower});
  std::vector<ShapePart> parts = {{.shape = VoxelShape::box({6, 0, 6}, {10, 16, 10})}};
  for (int turns = 0; turns < 4; ++turns) {
    const AxisOrientation turn = AxisOrientation::quarter_turns(1, turns);
    parts.push_back({.shape = arm, .orientation = turn, .when = {{.connected = {turn.apply(Direction::PosX)}}}});
  }
  return *VoxelShapes::from_rules({.parts = std::move(parts), .neighbours = ShapeNeighbours::Connected});
}

// A low slab in a quarter of all positions, a post in half of them, else a wall that covers the side +Z.
inline VoxelShapes rubble() {
  const auto at = [](std::uint16_t first, std::uint16_t end) {
    return std::vector{ShapeCondition{.positions = {4, first, end}}};
  };
  return *VoxelShapes::from_rules({.parts = {{.shape = VoxelShape::box({0, 0, 0}, {16, 6, 16}), .when = at(0, 1)},
                                             {.shape = VoxelShape::box({2, 0, 2}, {10, 16, 10}), .when = at(1, 3)},
                                             {.shape = VoxelShape::box({0, 0, 13}, {16, 16, 16}), .when = at(3, 4)}}});
}

}  // namespace quoin::shapes_for_tests

namespace quoin {

/// Registers types with shapes.
struct ShapeTypes {
  VoxelType stone = kAir;  ///< cubes
  VoxelType slab = kAir;
  VoxelType stairs = kAir;  ///< turned by bits 0 to 2 of the state
  VoxelType fence = kAir;
  VoxelType torch = kAir;   ///< on a wall, turned by bits 0 to 2
  VoxelType flower = kAir;  ///< crossed plates
  VoxelType door = kAir;    ///< turned by bits 0 and 1
  VoxelType beam = kAir;    ///< reaches outside its voxel, up to a voxel away
  VoxelType water = kAir;   ///< fluid
  VoxelType pane = kAir;    ///< of glass, without textures
  VoxelType rubble = kAir;  ///< of different shapes by position

  explicit ShapeTypes(VoxelRegistry& types) {
    const auto add = [&](VoxelProperties properties) {
      const auto type = types.add(std::move(properties));
      QUOIN_ASSERT(type.has_value(), "valid properties");
      return *type;
    };
    stone = add({.name = "stone", .colour = {140, 140, 140}});
    slab = add({.name = "slab", .colour = {200, 60, 50}, .shapes = shapes_for_tests::slab()});
    VoxelProperties of_stairs{.name = "stairs", .colour = {200, 160, 90}, .state_bits = 3};
    of_stairs.orientations = StateOrientations::about_y_and_upside_down();
    of_stairs.shapes = shapes_for_tests::straight_stairs();
    stairs = add(of_stairs);
    fence = add({.name = "fence", .colour = {120, 80, 40}, .shapes = shapes_for_tests::fence(2)});
    VoxelProperties of_torch{.name = "torch", .colour = {250, 220, 120}, .emission = 1.0F, .state_bits = 3};
    of_torch.orientations = StateOrientations::to_directions();
    of_torch.shapes =
        *VoxelShape::from_elements({{.min = {7, 0, 7},
                                     .max = {9, 10, 9},
                                     .turn = ElementTurn{.origin = {8, 0, 8}, .axis = 2, .degrees = -22.5F}}});
    torch = add(of_torch);
    VoxelProperties of_flower{.name = "flower", .colour = {220, 40, 160}};
    of_flower.shapes = VoxelShape::crossed_plates();
    flower = add(of_flower);
    VoxelProperties of_door{.name = "door", .colour = {90, 60, 30}, .state_bits = 2};
    of_door.orientations = StateOrientations::about_y();
    of_door.shapes = VoxelShape::box({0, 0, 0}, {3, 16, 16});
    door = add(of_door);
    beam = add({.name = "beam",
                .colour = {60, 120, 200},
                .shapes = *VoxelShape::from_elements(
                    {{.min = {-14, 5, 6}, .max = {30, 9, 9}, .turn = ElementTurn{.axis = 1, .degrees = 30.0F}},
                     {.min = {7, -16, 7}, .max = {9, 32, 9}, .collides = false}})});
    VoxelProperties of_water{.name = "water", .colour = {40, 90, 200, 120}, .visibility = Visibility::Transparent};
    of_water.state_bits = 4;
    of_water.shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid});
    water = add(of_water);
    VoxelProperties of_pane{.name = "pane", .colour = {255, 60, 60, 128}, .visibility = Visibility::Transparent};
    of_pane.shapes = VoxelShape::box({0, 0, 7}, {16, 16, 9});
    pane = add(of_pane);
    rubble = add({.name = "rubble", .colour = {110, 120, 90}, .shapes = shapes_for_tests::rubble()});
  }
};

}  // namespace quoin
