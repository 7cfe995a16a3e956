#include "fleet.h"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <quoin/terrain/terrain.h>

#include "ships.h"

namespace demo {

namespace {

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
