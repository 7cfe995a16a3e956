// Writes the demo world, a castle on an island, to the .vox file named on the command line.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <quoin/io/vox.h>
#include <quoin/scene/scene.h>

#include "castle.h"

namespace {

quoin::GridHandle add_grid(quoin::Scene& scene, std::string name, quoin::Grid grid, quoin::DVec3 pivot) {
  quoin::SceneGrid entry;
  entry.name = std::move(name);
  entry.grid = std::move(grid);
  entry.canvas = entry.grid.bounds();
  entry.pivot = pivot;
  return scene.add_grid(std::move(entry));
}

quoin::Instance instance(std::string name, quoin::GridHandle grid, quoin::DVec3 position, int quarter_turns = 0) {
  quoin::Instance placed;
  placed.name = std::move(name);
  placed.grid = grid;
  placed.position = position;
  constexpr double kRootHalf = 0.70710678118654752440;
  const quoin::DQuat turns[] = {
      {1, 0, 0, 0}, {kRootHalf, 0, kRootHalf, 0}, {0, 0, 1, 0}, {kRootHalf, 0, -kRootHalf, 0}};
  placed.rotation = turns[quarter_turns & 3];
  return placed;
}

// The island about the world's origin, trees where the ground is grass, two ships at sea.
quoin::Result<quoin::Scene> make_scene() {
  quoin::Scene scene;
  const auto palette = demo::add_palette(scene.types);
  if (!palette) return palette.error();
  constexpr int kHalf = demo::kIslandEdge / 2;
  const auto island = add_grid(scene, "island", demo::make_island(*palette), {kHalf, 0, kHalf});
  scene.add_instance(instance("island", island, {0, 0, 0}));
  const quoin::GridHandle trees[] = {add_grid(scene, "oak", demo::make_tree(*palette, 19), {0, 0, 0}),
                                     add_grid(scene, "ash", demo::make_tree(*palette, 14), {0, 0, 0})};
  unsigned random = 7;
  for (int planted = 0, tries = 0; planted < 46 && tries < 2'000; ++tries) {
    random = random * 1'664'525U + 1'013'904'223U;
    const int x = static_cast<int>(random >> 8) % (2 * kHalf);
    random = random * 1'664'525U + 1'013'904'223U;
    const int z = static_cast<int>(random >> 8) % (2 * kHalf);
    const int edge = std::max(std::abs(x - kHalf), std::abs(z - kHalf));
    const bool is_on_path = z > kHalf && std::abs(x - kHalf) < 14;
    const int ground = demo::ground_height(x, z);
    if (edge < 44 || is_on_path || ground < demo::kSeaLevel + 3) continue;
    const auto turn = static_cast<int>(random >> 20 & 3U);
    scene.add_instance(instance("tree " + std::to_string(++planted), trees[random >> 16 & 1U],
                                {x - kHalf, ground + 1, z - kHalf}, turn));
  }
  const auto ship = add_grid(scene, "ship", demo::make_ship(*palette), {0, 0, 17});
  scene.add_instance(instance("Swift", ship, {46, demo::kSeaLevel - 2, 71}, 1));
  scene.add_instance(instance("Heron", ship, {-73, demo::kSeaLevel - 2, 36}, 0));
  return scene;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::fprintf(stderr, "usage: quoin_demo_world OUT.vox\n");
    return 2;
  }
  const auto scene = make_scene();
  const auto written = scene ? quoin::write_vox(*scene, argv[1]) : scene.error();
  if (!written) {
    std::fprintf(stderr, "quoin_demo_world: %s\n", quoin::to_string(written.error()).c_str());
    return 1;
  }
  return 0;
}
