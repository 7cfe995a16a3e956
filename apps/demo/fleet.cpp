#include "demo_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <quoin/grid/grid.h>
#include <quoin/scene/scene.h>
#include <quoin/terrain/terrain.h>

namespace demo {

namespace {

using quoin::DVec3;
using quoin::Grid;
using quoin::IVec3;
using quoin::Rgba8;
using quoin::VoxelType;

struct Paint {
  VoxelType hull, plate, stripe, dark, window, engine;
};

quoin::Result<VoxelType> add_type(quoin::Scene& scene, Rgba8 colour, float emission = 0.0F) {
  quoin::VoxelProperties properties;
  properties.colour = colour;
  properties.emission = emission;
  return scene.types.find_or_add(properties);
}

quoin::Result<Paint> add_paint(quoin::Scene& scene, Rgba8 stripe) {
  Paint paint{};
  for (const auto& [type, colour, emission] : {std::tuple{&paint.hull, Rgba8{196, 200, 206, 255}, 0.0F},
                                               {&paint.plate, Rgba8{150, 156, 166, 255}, 0.0F},
                                               {&paint.stripe, stripe, 0.0F},
                                               {&paint.dark, Rgba8{62, 66, 76, 255}, 0.0F},
                                               {&paint.window, Rgba8{255, 226, 150, 255}, 0.6F},
                                               {&paint.engine, Rgba8{110, 200, 255, 255}, 0.8F}}) {
    const auto added = add_type(scene, colour, emission);
    if (!added) return added.error();
    *type = *added;
  }
  return paint;
}

// A hull along z with a round cross-section, pointed at the bow and blunt at the stern.
void add_hull(Grid& grid, const Paint& paint, IVec3 bow, int length, double half_width, double half_height) {
  for (int z = 0; z < length; ++z) {
    const double share = static_cast<double>(z) / length;
    const double taper = share < 0.45 ? std::pow(share / 0.45, 0.6) : 1.0 - 0.25 * (share - 0.45) / 0.55;
    const double width = std::max(0.6, half_width * taper);
    const double height = std::max(0.6, half_height * taper);
    for (int y = -static_cast<int>(height) - 1; y <= static_cast<int>(height) + 1; ++y) {
      const double rest = 1.0 - std::pow(std::abs(y) / height, 2.6);
      if (rest <= 0.0) continue;
      const int half = static_cast<int>(width * std::pow(rest, 1.0 / 2.6));
      const bool is_panel = (z / 9 + y / 5) % 3 == 0;
      VoxelType type = is_panel ? paint.plate : paint.hull;
      if (y == 0 || y == 1) type = paint.stripe;
      if (y < -static_cast<int>(height * 0.7)) type = paint.dark;
      grid.fill_box({bow + IVec3{-half, y, z}, bow + IVec3{half + 1, y + 1, z + 1}}, type);
      if (y == 3 && half > 4 && z % 4 < 2) {
        for (const int side : {-half, half}) grid.set(bow + IVec3{side, y, z}, paint.window);
      }
    }
  }
}

void add_engine(Grid& grid, const Paint& paint, IVec3 front, int length, int radius) {
  for (int z = 0; z < length; ++z) {
    for (int y = -radius; y <= radius; ++y) {
      const int half = static_cast<int>(std::sqrt(static_cast<double>(radius * radius - y * y) + 0.5));
      const bool is_nozzle = z >= length - 2;
      grid.fill_box({front + IVec3{-half, y, z}, front + IVec3{half + 1, y + 1, z + 1}},
                    is_nozzle ? paint.engine : paint.dark);
    }
  }
}

void add_wings(Grid& grid, const Paint& paint, IVec3 root, int span, int chord, int thickness) {
  for (int x = 0; x < span; ++x) {
    const int front = x * chord / (2 * span);
    for (const int side : {-1, 1}) {
      const IVec3 at = root + IVec3{side * x, -x / 6, front};
      const VoxelType type = x > span - 5 ? paint.stripe : paint.plate;
      grid.fill_box({at, at + IVec3{1, thickness, chord - front + 1}}, type);
    }
  }
}

// A tower of decks, each smaller than the one below.
void add_bridge(Grid& grid, const Paint& paint, IVec3 foot, int half, int decks) {
  for (int deck = 0; deck < decks; ++deck) {
    const int h = half - 2 * deck;
    if (h < 1) break;
    const IVec3 low = foot + IVec3{-h, 5 * deck, -h - 2};
    grid.fill_box({low, low + IVec3{2 * h + 1, 5, 2 * h + 5}}, paint.hull);
    grid.fill_box({low + IVec3{0, 2, 0}, low + IVec3{2 * h + 1, 4, 1}}, paint.window);
  }
}

Grid scout(const Paint& paint) {
  Grid grid;
  add_hull(grid, paint, {0, 0, 0}, 40, 7.0, 5.0);
  add_wings(grid, paint, {0, 0, 14}, 20, 18, 2);
  for (const int x : {-6, 6}) add_engine(grid, paint, {x, 0, 32}, 12, 3);
  grid.fill_box({{-2, 4, 14}, {3, 7, 21}}, paint.window);
  return grid;
}

Grid freighter(const Paint& paint) {
  Grid grid;
  add_hull(grid, paint, {0, 0, 0}, 110, 12.0, 11.0);
  for (int z = 34; z < 96; z += 16) {
    for (const int x : {-22, 13}) {
      grid.fill_box({{x, -8, z}, {x + 10, 8, z + 14}}, z % 32 == 2 ? paint.stripe : paint.plate);
      grid.fill_box({{x, -8, z + 6}, {x + 10, 8, z + 8}}, paint.dark);
    }
  }
  add_bridge(grid, paint, {0, 9, 88}, 8, 3);
  for (const int x : {-8, 8}) add_engine(grid, paint, {x, -2, 104}, 16, 6);
  return grid;
}

Grid cruiser(const Paint& paint) {
  Grid grid;
  add_hull(grid, paint, {0, 0, 0}, 200, 24.0, 15.0);
  add_wings(grid, paint, {0, 0, 96}, 62, 70, 4);
  add_bridge(grid, paint, {0, 13, 140}, 12, 4);
  for (const int x : {-15, 0, 15}) add_engine(grid, paint, {x, 0, 190}, 24, 7);
  for (int z = 60; z < 130; z += 24) {
    grid.fill_box({{-5, 12, z}, {6, 19, z + 11}}, paint.dark);
    grid.fill_box({{-2, 15, z - 14}, {2, 17, z + 1}}, paint.dark);
  }
  return grid;
}

Grid carrier(const Paint& paint) {
  Grid grid;
  add_hull(grid, paint, {0, 0, 0}, 420, 46.0, 26.0);
  grid.fill_box({{-60, 20, 90}, {60, 28, 410}}, paint.plate);  // the flight deck
  for (int z = 100; z < 400; z += 20) grid.fill_box({{-2, 27, z}, {2, 28, z + 10}}, paint.window);
  for (const int x : {-58, 54}) grid.fill_box({{x, 27, 92}, {x + 4, 28, 408}}, paint.stripe);
  add_bridge(grid, paint, {42, 28, 280}, 15, 6);
  for (const int x : {-32, -11, 11, 32}) add_engine(grid, paint, {x, -4, 396}, 40, 10);
  return grid;
}

/// The designs of the fleet, each with its pivot in the middle: a scout, a freighter, a cruiser and a carrier, 40 to
/// 420 voxels long, their bows towards -z.
quoin::Result<std::vector<quoin::GridHandle>> add_ships(quoin::Scene& scene) {
  struct Design {
    const char* name;
    Grid (*make)(const Paint&);
    Rgba8 stripe;
  };
  std::vector<quoin::GridHandle> ships;
  for (const Design& design : {Design{"scout", scout, {214, 62, 48, 255}},
                               {"freighter", freighter, {232, 150, 40, 255}},
                               {"cruiser", cruiser, {44, 96, 190, 255}},
                               {"carrier", carrier, {40, 150, 120, 255}}}) {
    const auto paint = add_paint(scene, design.stripe);
    if (!paint) return paint.error();
    quoin::SceneGrid grid;
    grid.name = design.name;
    grid.grid = design.make(*paint);
    const quoin::IBox box = grid.grid.bounds();
    grid.pivot = 0.5 * (DVec3(box.min) + DVec3(box.max));
    ships.push_back(scene.add_grid(std::move(grid)));
  }
  return ships;
}

// Gives the same numbers on every machine.
class Random {
 public:
  double between(double low, double high) {
    state_ = state_ * 1'664'525U + 1'013'904'223U;
    return low + (high - low) * (state_ >> 8) / 16'777'216.0;
  }

 private:
  unsigned state_ = 7;
};

quoin::Status add_terrain(quoin::Scene& scene) {
  const auto types = quoin::add_terrain_types(scene.types);
  if (!types) return types.error();
  constexpr int kUnits = 24;
  auto grid = quoin::generate_terrain({.seed = 42, .size = {kUnits, 4, kUnits}}, *types);
  if (!grid) return grid.error();
  quoin::SceneGrid terrain;
  terrain.name = "terrain";
  terrain.grid = std::move(*grid);
  terrain.pivot = {kUnits * 16.0, 128.0, kUnits * 16.0};
  quoin::Instance instance{"terrain", scene.add_grid(std::move(terrain))};
  instance.position = {0, -160, -500};
  instance.voxel_size = 4.0;
  scene.add_instance(instance);
  return {};
}

// Places the ships in rows, each further back and wider, all flying in about the same direction.
void add_fleet(quoin::Scene& scene, const std::vector<quoin::GridHandle>& ships) {
  Random random;
  for (int row = 0; row < 16; ++row) {
    const double depth = 170.0 + 50.0 * row + 6.5 * row * row;
    for (int column = 0; column < 12; ++column) {
      const double across = (column - 5.5 + random.between(-0.3, 0.3)) / 5.5;
      const double share = random.between(0.0, 1.0);
      // Large ships stay at the back, because the first rows have no room for them.
      const std::size_t largest = row < 1 ? 1 : row < 4 ? 2 : 3;
      const std::size_t design = std::min<std::size_t>(share < 0.5    ? 0
                                                       : share < 0.8  ? 1
                                                       : share < 0.94 ? 2
                                                                      : 3,
                                                       largest);
      quoin::Instance ship;
      ship.grid = ships[design];
      ship.name = "ship " + std::to_string(row * 12 + column);
      ship.position = {across * depth * 0.75, random.between(-0.12, 0.22) * depth, -depth};
      ship.rotation = glm::angleAxis(0.7 + random.between(-0.4, 0.4), quoin::DVec3{0, 1, 0}) *
                      glm::angleAxis(random.between(-0.25, 0.25), quoin::DVec3{0, 0, 1}) *
                      glm::angleAxis(random.between(-0.1, 0.1), quoin::DVec3{1, 0, 0});
      ship.voxel_size = 0.45;
      scene.add_instance(ship);
    }
  }
}

}  // namespace

quoin::Result<quoin::LoadedScene> make_fleet() {
  quoin::LoadedScene fleet;
  if (auto added = add_terrain(fleet.scene); !added) return added.error();
  const auto ships = add_ships(fleet.scene);
  if (!ships) return ships.error();
  add_fleet(fleet.scene, *ships);
  const auto camera = quoin::look_at({0, 30, 60}, {0, -10, -400}, std::numbers::pi / 4);
  if (!camera) return camera.error();
  fleet.camera = *camera;
  fleet.scene.environment = quoin::Environment::natural(glm::normalize(quoin::DVec3{-0.4, 0.8, 0.75}));
  return fleet;
}

quoin::RenderOptions fleet_options(const quoin::LoadedScene& fleet) {
  quoin::RenderOptions options;
  options.samples = 4;
  options.detail.policy.emplace();
  options.environment = quoin::Environment::reference();
  options.environment->sun.direction = fleet.scene.environment->sun.direction;
  options.environment->exposure = 1.15;
  return options;
}

}  // namespace demo
