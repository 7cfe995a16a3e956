// Writes one of the scenes of docs/gallery.md, or the box that ./dev blender compares, to the .vox file named on the
// command line.

#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include <quoin/io/vox.h>
#include <quoin/scene/scene.h>

namespace {

using quoin::Grid;
using quoin::IVec3;
using quoin::Rgba8;
using quoin::Scene;
using quoin::VoxelProperties;
using quoin::VoxelType;

struct Look {
  float roughness = 1.0F;
  float metalness = 0.0F;
  float emission = 0.0F;
  float ior = 0.0F;         // more than 0: glass
  float scattering = 0.0F;  // more than 0: a cloud
};

VoxelType add(Scene& scene, const char* name, Rgba8 colour, Look look = {}) {
  VoxelProperties properties;
  properties.name = name;
  properties.colour = colour;
  properties.roughness = look.roughness;
  properties.metalness = look.metalness;
  properties.emission = look.emission;
  if (look.ior > 0.0F) {
    properties.visibility = quoin::Visibility::Transparent;
    properties.ior = look.ior;
  }
  if (look.scattering > 0.0F) {
    properties.visibility = quoin::Visibility::Transparent;
    properties.scattering = look.scattering;
    properties.anisotropy = 0.4F;
  }
  return scene.types.add(properties).value_or(quoin::kAir);
}

void place(Scene& scene, Grid grid) {
  quoin::SceneGrid entry;
  entry.name = "room";
  entry.canvas = grid.bounds();
  entry.grid = std::move(grid);
  quoin::Instance instance;
  instance.name = "room";
  instance.grid = scene.add_grid(std::move(entry));
  scene.add_instance(std::move(instance));
}

void ball(Grid& grid, IVec3 middle, int radius, VoxelType type) {
  for (int z = -radius; z <= radius; ++z) {
    for (int y = -radius; y <= radius; ++y) {
      for (int x = -radius; x <= radius; ++x) {
        if (x * x + y * y + z * z <= radius * radius + radius / 2) grid.set(middle + IVec3{x, y, z}, type);
      }
    }
  }
}

void column(Grid& grid, IVec3 foot, int radius, int height, VoxelType type) {
  for (int z = -radius; z <= radius; ++z) {
    for (int x = -radius; x <= radius; ++x) {
      if (x * x + z * z > radius * radius + radius / 2) continue;
      grid.fill_box({foot + IVec3{x, 0, z}, foot + IVec3{x + 1, height, z + 1}}, type);
    }
  }
}

struct RoomTypes {
  explicit RoomTypes(Scene& scene)
      : white(add(scene, "white", {236, 232, 224, 255})),
        red(add(scene, "red", {186, 44, 36, 255})),
        green(add(scene, "green", {38, 124, 66, 255})),
        oak(add(scene, "oak", {168, 116, 70, 255}, {0.45F})),
        walnut(add(scene, "walnut", {140, 92, 54, 255}, {0.45F})),
        dark(add(scene, "dark wood", {74, 48, 32, 255}, {0.5F})),
        cloth(add(scene, "cloth", {52, 92, 140, 255})),
        cushion(add(scene, "cushion", {232, 176, 64, 255})),
        rug(add(scene, "rug", {212, 200, 178, 255})),
        rug_edge(add(scene, "rug's edge", {150, 60, 50, 255})),
        gold(add(scene, "gold", {255, 196, 90, 255}, {0.22F, 1.0F})),
        leaf(add(scene, "leaf", {54, 128, 50, 255})),
        clay(add(scene, "clay", {190, 98, 62, 255})),
        glow(add(scene, "lamp", {255, 206, 140, 255}, {1.0F, 0.0F, 10.0F})),
        glass(add(scene, "glass", {205, 235, 230, 20}, {0.0F, 0.0F, 0.0F, 1.5F})) {}

  VoxelType white, red, green, oak, walnut, dark, cloth, cushion, rug, rug_edge, gold, leaf, clay, glow, glass;
};

// Walls, a window in the red one, a floor of planks and a rug.
void build_room(Grid& grid, const RoomTypes& types) {
  grid.fill_box({{-2, -2, -2}, {98, 62, 74}}, types.white);
  grid.fill_box({{0, 0, 0}, {96, 60, 74}}, quoin::kAir);
  grid.fill_box({{-2, -2, -2}, {0, 62, 74}}, types.red);
  grid.fill_box({{96, -2, -2}, {98, 62, 74}}, types.green);
  for (int z = 0; z < 74; ++z) {
    for (int x = 0; x < 96; ++x) {
      const int plank = z / 6;
      const bool is_seam = z % 6 == 5 || (x + plank * 17) % 32 == 31;
      grid.set({x, -1, z}, is_seam ? types.dark : plank % 2 == 0 ? types.oak : types.walnut);
    }
  }
  grid.fill_box({{-2, 18, 20}, {0, 48, 52}}, types.dark);
  grid.fill_box({{-2, 20, 22}, {0, 46, 35}}, quoin::kAir);
  grid.fill_box({{-2, 20, 37}, {0, 46, 50}}, quoin::kAir);
  grid.fill_box({{24, 0, 16}, {78, 1, 58}}, types.rug_edge);
  grid.fill_box({{26, 0, 18}, {76, 1, 56}}, types.rug);
}

// A sofa at the back, a table with a golden ball and a vase.
void furnish(Grid& grid, const RoomTypes& types) {
  grid.fill_box({{28, 2, 3}, {72, 10, 19}}, types.cloth);
  grid.fill_box({{28, 10, 3}, {72, 21, 8}}, types.cloth);
  grid.fill_box({{25, 2, 3}, {29, 15, 20}}, types.cloth);
  grid.fill_box({{71, 2, 3}, {75, 15, 20}}, types.cloth);
  grid.fill_box({{32, 10, 9}, {41, 18, 12}}, types.cushion);
  grid.fill_box({{60, 10, 9}, {69, 18, 12}}, types.cushion);
  for (const int x : {36, 62}) {
    for (const int z : {30, 46}) grid.fill_box({{x, 1, z}, {x + 2, 9, z + 2}}, types.dark);
  }
  grid.fill_box({{34, 9, 28}, {66, 11, 50}}, types.oak);
  ball(grid, {42, 17, 38}, 6, types.gold);
  column(grid, {57, 11, 38}, 4, 13, types.glass);
}

// A painting, a plant and a lamp.
void decorate(Grid& grid, const RoomTypes& types) {
  grid.fill_box({{36, 28, 0}, {64, 48, 1}}, types.dark);
  for (int y = 30; y < 46; ++y) {
    for (int x = 38; x < 62; ++x) {
      grid.set({x, y, 1}, y < 36 + (x % 11) / 3 ? types.green : y < 41 ? types.cushion : types.cloth);
    }
  }
  column(grid, {86, 0, 12}, 5, 9, types.clay);
  for (int i = 0; i < 26; ++i) {
    const double turn = i * 2.4;
    const int reach = 3 + i % 6;
    const IVec3 tip{86 + static_cast<int>(std::lround(reach * std::cos(turn))), 14 + i,
                    12 + static_cast<int>(std::lround(reach * std::sin(turn)))};
    ball(grid, tip, 2, types.leaf);
    grid.set({86, 9 + i, 12}, types.dark);
  }
  grid.fill_box({{10, 0, 10}, {16, 1, 16}}, types.dark);
  grid.fill_box({{12, 1, 12}, {14, 32, 14}}, types.dark);
  grid.fill_box({{9, 32, 9}, {17, 39, 17}}, types.glow);
}

// Open towards +z: a red and a green wall reflect their colours onto white surfaces.
Scene living_room() {
  Scene scene;
  const RoomTypes types(scene);
  Grid grid;
  build_room(grid, types);
  furnish(grid, types);
  decorate(grid, types);
  place(scene, std::move(grid));
  return scene;
}

// A basin of water with glass and metal objects in it.
Scene basin() {
  Scene scene;
  const VoxelType tile = add(scene, "tile", {226, 232, 232, 255}, {0.35F});
  const VoxelType tile_dark = add(scene, "dark tile", {40, 110, 132, 255}, {0.35F});
  const VoxelType sand = add(scene, "sand", {222, 200, 156, 255});
  const VoxelType water = add(scene, "water", {120, 205, 215, 24}, {0.0F, 0.0F, 0.0F, 1.333F});
  const VoxelType amber = add(scene, "amber glass", {255, 150, 40, 40}, {0.0F, 0.0F, 0.0F, 1.5F});
  const VoxelType blue = add(scene, "blue glass", {70, 110, 255, 40}, {0.0F, 0.0F, 0.0F, 1.5F});
  const VoxelType clear = add(scene, "clear glass", {240, 250, 250, 6}, {0.0F, 0.0F, 0.0F, 1.5F});
  const VoxelType copper = add(scene, "copper", {240, 150, 110, 255}, {0.25F, 1.0F});
  const VoxelType chrome = add(scene, "chrome", {235, 235, 240, 255}, {0.0F, 1.0F});
  const VoxelType coral = add(scene, "coral", {230, 80, 70, 255});
  const VoxelType weed = add(scene, "weed", {60, 140, 60, 255});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {112, 26, 84}}, tile);
  grid.fill_box({{6, 2, 6}, {106, 26, 78}}, quoin::kAir);
  grid.fill_box({{6, 2, 6}, {106, 5, 78}}, sand);
  for (int z = 0; z < 84; ++z) {
    for (int x = 0; x < 112; ++x) {
      const bool is_rim = x < 6 || z < 6 || x >= 106 || z >= 78;
      if (is_rim && (x / 6 + z / 6) % 2 == 0) grid.set({x, 25, z}, tile_dark);
    }
  }
  unsigned random = 5;
  for (int i = 0; i < 60; ++i) {
    random = random * 1'664'525U + 1'013'904'223U;
    const int x = 10 + static_cast<int>(random >> 9) % 92;
    random = random * 1'664'525U + 1'013'904'223U;
    const int z = 10 + static_cast<int>(random >> 9) % 64;
    const int height = 2 + static_cast<int>(random >> 28) % 9;
    for (int y = 5; y < 5 + height; ++y) grid.set({x + (y / 3) % 2, y, z}, i % 3 == 0 ? coral : weed);
  }
  ball(grid, {30, 12, 52}, 8, coral);
  ball(grid, {84, 10, 24}, 6, copper);
  for (int z = 6; z < 78; ++z) {
    for (int x = 6; x < 106; ++x) {
      for (int y = 5; y < 21; ++y) {
        if (grid.get({x, y, z}) == quoin::kAir) grid.set({x, y, z}, water);
      }
    }
  }
  column(grid, {28, 5, 24}, 7, 40, amber);
  column(grid, {60, 5, 40}, 7, 52, clear);
  column(grid, {88, 5, 54}, 7, 34, blue);
  ball(grid, {60, 66, 40}, 11, chrome);
  ball(grid, {28, 52, 24}, 8, clear);
  ball(grid, {88, 47, 54}, 9, copper);
  place(scene, std::move(grid));
  return scene;
}

// The box of Cornell University's graphics laboratory, as closely as voxels allow; tests/blender/check_light.py builds
// the same.
Scene cornell_box() {
  Scene scene;
  const VoxelType white = add(scene, "white", {222, 222, 222, 255});
  const VoxelType red = add(scene, "red", {200, 40, 36, 255});
  const VoxelType green = add(scene, "green", {60, 160, 60, 255});
  const VoxelType lamp = add(scene, "lamp", {255, 255, 255, 255}, {1.0F, 0.0F, 12.0F});
  Grid grid;
  grid.fill_box({{-1, -1, -1}, {33, 33, 32}}, white);
  grid.fill_box({{-1, -1, -1}, {0, 33, 32}}, red);
  grid.fill_box({{32, -1, -1}, {33, 33, 32}}, green);
  grid.fill_box({{0, 0, 0}, {32, 32, 32}}, quoin::kAir);
  grid.fill_box({{12, 32, 12}, {20, 33, 20}}, lamp);
  grid.fill_box({{5, 0, 5}, {14, 19, 14}}, white);
  grid.fill_box({{18, 0, 16}, {28, 9, 26}}, white);
  place(scene, std::move(grid));
  return scene;
}

// Returns a number in [0, 1).
double drawn(unsigned& random) {
  random = random * 1'664'525U + 1'013'904'223U;
  return (random >> 8U) / 16'777'216.0;
}

// A flat heap of balls.
void cloud(Grid& grid, IVec3 middle, double width, VoxelType type, unsigned& random) {
  for (int i = 0; i < 14; ++i) {
    const double out = width * std::sqrt(drawn(random)) * 0.5;
    const double turn = drawn(random) * 6.283;
    const int radius = 3 + static_cast<int>((1.0 - out / width) * width * 0.22);
    const IVec3 at =
        middle + IVec3{static_cast<int>(out * std::cos(turn)), static_cast<int>(drawn(random) * radius * 0.6),
                       static_cast<int>(out * std::sin(turn))};
    for (int z = -radius; z <= radius; ++z) {
      for (int y = -radius / 2; y <= radius; ++y) {
        for (int x = -radius; x <= radius; ++x) {
          if (x * x + y * y * 2 + z * z > radius * radius) continue;
          if (grid.get(at + IVec3{x, y, z}) == quoin::kAir) grid.set(at + IVec3{x, y, z}, type);
        }
      }
    }
  }
}

void tree(Grid& grid, IVec3 foot, int height, VoxelType trunk, VoxelType leaf) {
  grid.fill_box({foot, foot + IVec3{1, height, 1}}, trunk);
  for (int y = height / 3; y <= height + 2; ++y) {
    const int radius = (height + 3 - y) / 3;
    for (int z = -radius; z <= radius; ++z) {
      for (int x = -radius; x <= radius; ++x) {
        if (x * x + z * z <= radius * radius + 1) grid.set(foot + IVec3{x, y, z}, leaf);
      }
    }
  }
}

struct IslandTypes {
  explicit IslandTypes(Scene& scene)
      : rock(add(scene, "rock", {122, 108, 98, 255})),
        dark_rock(add(scene, "dark rock", {92, 80, 76, 255})),
        soil(add(scene, "soil", {126, 88, 58, 255})),
        grass(add(scene, "grass", {104, 156, 60, 255})),
        meadow(add(scene, "meadow", {134, 176, 70, 255})),
        trunk(add(scene, "trunk", {92, 66, 46, 255})),
        leaf(add(scene, "leaf", {46, 104, 58, 255})),
        wall(add(scene, "wall", {236, 226, 206, 255})),
        roof(add(scene, "roof", {176, 66, 48, 255})),
        window(add(scene, "window", {255, 190, 96, 255}, {1.0F, 0.0F, 5.0F})),
        path(add(scene, "path", {204, 184, 146, 255})),
        puff(add(scene, "cloud", {252, 252, 252, 200}, {1.0F, 0.0F, 0.0F, 0.0F, 0.22F})) {}

  VoxelType rock, dark_rock, soil, grass, meadow, trunk, leaf, wall, roof, window, path, puff;
};

constexpr IVec3 kIslandMiddle{150, 90, 120};

void raise_island(Grid& grid, const IslandTypes& types) {
  for (int z = -46; z <= 46; ++z) {
    for (int x = -60; x <= 60; ++x) {
      const double turn = std::atan2(z * 1.3, x);
      const double edge = 50.0 + 6.0 * std::sin(3.0 * turn + 1.0) + 3.0 * std::sin(7.0 * turn);
      const double share = std::hypot(x, z * 1.3) / edge;
      if (share >= 1.0) continue;
      const int top = static_cast<int>(7.0 * std::cos(x * 0.06) * std::cos(z * 0.07) * (1.0 - share));
      const int depth =
          4 + static_cast<int>(52.0 * std::pow(1.0 - share, 0.8) + 5.0 * std::sin(x * 0.5) * std::cos(z * 0.43));
      for (int y = -depth; y <= top; ++y) {
        const VoxelType type = y == top              ? ((x * 7 + z * 13) % 5 == 0 ? types.meadow : types.grass)
                               : y > top - 4         ? types.soil
                               : (y + x / 3) % 7 < 2 ? types.dark_rock
                                                     : types.rock;
        grid.set(kIslandMiddle + IVec3{x, y, z}, type);
      }
    }
  }
}

// Returns the first air voxel above the island's ground, relative to its middle.
int top_at(const Grid& grid, int x, int z) {
  int y = 20;
  while (y > -20 && grid.get(kIslandMiddle + IVec3{x, y, z}) == quoin::kAir) --y;
  return y + 1;
}

// A house with a path to its door.
void build_house(Grid& grid, const IslandTypes& types) {
  const IVec3 house = kIslandMiddle + IVec3{0, top_at(grid, 6, 0), -6};
  grid.fill_box({house - IVec3{0, 6, 0}, house + IVec3{18, 12, 13}}, types.wall);
  for (int step = 0; step < 9; ++step) {
    grid.fill_box({house + IVec3{-2, 12 + step, step - 2}, house + IVec3{20, 13 + step, 15 - step}}, types.roof);
  }
  grid.fill_box({house + IVec3{13, 14, 2}, house + IVec3{16, 25, 5}}, types.dark_rock);
  for (const int x : {2, 12}) grid.fill_box({house + IVec3{x, 4, 12}, house + IVec3{x + 4, 9, 13}}, types.window);
  grid.fill_box({house + IVec3{18 - 1, 4, 4}, house + IVec3{18, 9, 9}}, types.window);
  grid.fill_box({house + IVec3{7, 0, 12}, house + IVec3{11, 8, 13}}, types.trunk);
  for (int i = 0; i < 22; ++i) {
    for (int w = 0; w < 4; ++w) {
      const int x = 7 + w + static_cast<int>(3.0 * std::sin(i * 0.2));
      grid.set(kIslandMiddle + IVec3{x, top_at(grid, x, 7 + i) - 1, 7 + i}, types.path);
    }
  }
}

void plant_trees(Grid& grid, const IslandTypes& types, unsigned& random) {
  for (int i = 0; i < 26; ++i) {
    const int x = static_cast<int>((drawn(random) - 0.5) * 92.0);
    const int z = static_cast<int>((drawn(random) - 0.5) * 62.0);
    const bool is_free = std::hypot(x, z * 1.3) < 40.0 && (x < -6 || x > 26 || z < -10 || z > 32);
    if (is_free) tree(grid, kIslandMiddle + IVec3{x, top_at(grid, x, z), z}, 10 + i % 9, types.trunk, types.leaf);
  }
}

// An island that floats above a sea of clouds, with a house on it.
Scene island() {
  Scene scene;
  const IslandTypes types(scene);
  Grid grid;
  unsigned random = 11;
  raise_island(grid, types);
  build_house(grid, types);
  plant_trees(grid, types, random);
  for (int i = 0; i < 230; ++i) {
    const int x = -190 + static_cast<int>(drawn(random) * 680.0);
    const int z = -300 + static_cast<int>(drawn(random) * 600.0);
    cloud(grid, {x, 4 + static_cast<int>(drawn(random) * 12.0), z}, 38.0 + 30.0 * drawn(random), types.puff, random);
  }
  cloud(grid, {52, 104, 84}, 40.0, types.puff, random);
  cloud(grid, {248, 122, 70}, 46.0, types.puff, random);
  cloud(grid, {232, 66, 150}, 34.0, types.puff, random);
  place(scene, std::move(grid));
  return scene;
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, Scene (*)()> scenes = {
      {"room", living_room}, {"basin", basin}, {"cornell", cornell_box}, {"island", island}};
  const auto made = scenes.find(argc == 3 ? argv[1] : "");
  if (made == scenes.end()) {
    std::fprintf(stderr, "usage: quoin_demo_gallery room|basin|cornell|island OUT.vox\n");
    return 2;
  }
  const auto written = quoin::write_vox(made->second(), argv[2]);
  if (!written) {
    std::fprintf(stderr, "quoin_demo_gallery: %s\n", quoin::to_string(written.error()).c_str());
    return 1;
  }
  for (const std::string& warning : written->warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());
  return 0;
}
