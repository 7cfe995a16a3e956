#pragma once

// A town of 9x9 chunks: hills, streets with fences, plants, steps and torches along them, and houses. With shapes, or
// the same voxels as cubes.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/scene/scene.h>

#include "grid/shapes/shape_types_for_tests.h"

namespace quoin::workloads {

inline constexpr int kTownEdge = 9 * kChunkEdge;
inline constexpr int kLotEdge = 24;

struct TownTypes {
  VoxelType ground, street, wall, roof;
  VoxelType slab, stairs, fence, torch, flower, door, pane;

  TownTypes(VoxelRegistry& types, bool with_shapes) {
    const auto add = [&](VoxelProperties properties, VoxelShapes shapes = {}) {
      if (with_shapes) properties.shapes = std::move(shapes);
      const auto type = types.add(std::move(properties));
      QUOIN_ASSERT(type.has_value(), "valid properties");
      return *type;
    };
    ground = add({.name = "ground", .colour = {96, 140, 70}});
    street = add({.name = "street", .colour = {150, 145, 135}});
    wall = add({.name = "wall", .colour = {205, 195, 175}});
    roof = add({.name = "roof", .colour = {150, 70, 55}});
    slab = add({.name = "slab", .colour = {170, 170, 175}}, shapes_for_tests::slab());
    VoxelProperties of_stairs{.name = "stairs", .colour = {165, 80, 60}, .state_bits = 3};
    of_stairs.orientations = StateOrientations::about_y_and_upside_down();
    stairs = add(of_stairs, shapes_for_tests::straight_stairs());
    fence = add({.name = "fence", .colour = {125, 90, 55}}, shapes_for_tests::fence(2));
    torch = add({.name = "torch", .colour = {250, 215, 120}}, VoxelShape::box({7, 0, 7}, {9, 10, 9}));
    flower = add({.name = "flower", .colour = {210, 60, 130}}, VoxelShape::crossed_plates(14));
    VoxelProperties of_door{.name = "door", .colour = {100, 70, 40}, .state_bits = 2};
    of_door.orientations = StateOrientations::about_y();
    door = add(of_door, VoxelShape::box({0, 0, 0}, {3, 16, 16}));
    pane = add({.name = "pane", .colour = {170, 210, 230}}, VoxelShape::box({0, 0, 7}, {16, 16, 9}));
  }
};

// Returns a pseudo-random number below `limit` for a place.
inline std::uint32_t town_number(int x, int z, std::uint32_t limit) {
  std::uint32_t hash = static_cast<std::uint32_t>(x) * 0x9E37'79B1U ^ static_cast<std::uint32_t>(z) * 0x85EB'CA77U;
  hash = (hash ^ hash >> 15) * 0x2C1B'3C6DU;
  return (hash ^ hash >> 13) % limit;
}

inline int town_height(int x, int z) {
  return 24 + static_cast<int>(std::lround(6.0 * std::sin(x / 41.0) + 5.0 * std::cos(z / 33.0)));
}

// Places a block next to a street, in 40 % of the places.
inline void place_beside_street(Grid& grid, const TownTypes& types, IVec3 at) {
  const std::uint32_t number = town_number(at.x, at.z, 1'000);
  if (number >= 400) return;
  const std::array<std::pair<std::uint32_t, VoxelType>, 6> shares = {{{140, types.fence},
                                                                      {240, types.flower},
                                                                      {300, types.slab},
                                                                      {360, types.stairs},
                                                                      {385, types.torch},
                                                                      {400, types.door}}};
  std::size_t i = 0;
  while (number >= shares[i].first) ++i;
  grid.set(at, shares[i].second, {number % 4, {}});
}

// A house of 8x5x8 voxels with a door, windows and a roof of steps.
inline void place_house(Grid& grid, const TownTypes& types, IVec3 at) {
  grid.fill_box({at, at + IVec3(8, 5, 8)}, types.wall);
  grid.fill_box({at + 1, at + IVec3(7, 5, 7)}, kAir);
  for (const int x : {2, 5}) {
    for (const int z : {0, 7}) grid.fill_box({at + IVec3(x, 2, z), at + IVec3(x + 1, 4, z + 1)}, types.pane);
  }
  for (const int y : {0, 1}) grid.set(at + IVec3(0, y, 4), types.door, {0, {}});
  for (int i = 0; i < 4; ++i) {
    const int y = 5 + i;
    for (int z = 0; z < 8; ++z) {
      grid.set(at + IVec3(i, y, z), types.stairs, {0, {}});
      grid.set(at + IVec3(7 - i, y, z), types.stairs, {2, {}});
      for (int x = i + 1; x < 7 - i; ++x) {
        if (z == 0 || z == 7) grid.set(at + IVec3(x, y, z), types.wall);
      }
    }
  }
}

inline Grid town_grid(const TownTypes& types) {
  Grid grid;
  for (int z = 0; z < kTownEdge; ++z) {
    for (int x = 0; x < kTownEdge; ++x) {
      const int height = town_height(x, z);
      const int in_lot = std::min(x % kLotEdge, z % kLotEdge);
      grid.fill_box({{x, 0, z}, {x + 1, height, z + 1}}, in_lot < 3 ? types.street : types.ground);
      if (in_lot == 3 || in_lot == 4) place_beside_street(grid, types, {x, height, z});
    }
  }
  for (int z = 10; z + 8 < kTownEdge; z += kLotEdge) {
    for (int x = 10; x + 8 < kTownEdge; x += kLotEdge) {
      if (town_number(x, z, 4) != 0) place_house(grid, types, {x, town_height(x + 4, z + 4), z});
    }
  }
  return grid;
}

/// Returns the town, with one instance at the origin.
inline Scene town_scene(bool with_shapes) {
  Scene scene;
  SceneGrid town;
  town.grid = town_grid(TownTypes(scene.types, with_shapes));
  Instance instance;
  instance.grid = scene.add_grid(std::move(town));
  scene.add_instance(instance);
  return scene;
}

}  // namespace quoin::workloads
