#include "demo_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

namespace demo {
namespace {

using quoin::DVec3;
using quoin::Grid;
using quoin::IBox;
using quoin::IVec3;
using quoin::Rgba8;
using quoin::VoxelType;

constexpr int kCentre = kIslandEdge / 2;
constexpr int kCourt = 24;     // height of the castle's court
constexpr int kHalfWall = 30;  // distance from the middle to a curtain wall

// A small integer hash for speckles of colour, the same on all platforms.
unsigned speckle(int x, int y, int z) {
  unsigned h = static_cast<unsigned>(x) * 374'761'393U + static_cast<unsigned>(y) * 668'265'263U +
               static_cast<unsigned>(z) * 2'147'483'647U;
  h = (h ^ (h >> 13)) * 1'274'126'177U;
  return h ^ (h >> 16);
}

void add_tower(Grid& grid, const Palette& p, IVec3 foot, int radius, int height, bool has_roof) {
  for (int y = 0; y <= height; ++y) {
    const bool is_ledge = y >= height - 2;
    const double r = radius + (is_ledge ? 1.3 : 0.3);
    for (int z = -radius - 2; z <= radius + 2; ++z) {
      for (int x = -radius - 2; x <= radius + 2; ++x) {
        const double d = std::sqrt(static_cast<double>(x * x + z * z));
        const bool is_hollow = y > height - 1 && d < r - 1.5;
        const bool is_gap = y == height && ((x + z) & 2) != 0;
        if (d > r || is_hollow || is_gap) continue;
        const VoxelType stone = speckle(foot.x + x, y / 2, foot.z + z) % 7 == 0 ? p.wall_dark : p.wall;
        grid.set(foot + IVec3{x, y, z}, is_ledge ? p.trim : stone);
      }
    }
  }
  for (int y = 6; y < height - 6; y += 9) {
    for (const IVec3 side : {IVec3{1, 0, 0}, IVec3{-1, 0, 0}, IVec3{0, 0, 1}, IVec3{0, 0, -1}}) {
      grid.fill_box({foot + side * radius + IVec3{0, y, 0}, foot + side * radius + IVec3{1, y + 3, 1}}, p.lamp);
    }
  }
  if (!has_roof) return;
  const int roof = radius * 2 + 3;
  for (int y = 0; y <= roof; ++y) {
    const double r = (radius + 2.0) * (roof - y) / roof;
    for (int z = -radius - 2; z <= radius + 2; ++z) {
      for (int x = -radius - 2; x <= radius + 2; ++x) {
        if (x * x + z * z > r * r) continue;
        grid.set(foot + IVec3{x, height + 1 + y, z}, y % 4 == 3 ? p.roof_dark : p.roof);
      }
    }
  }
  grid.fill_box({foot + IVec3{0, height + roof, 0}, foot + IVec3{1, height + roof + 8, 1}}, p.wood);
  grid.fill_box({foot + IVec3{1, height + roof + 4, 0}, foot + IVec3{7, height + roof + 8, 1}}, p.flag);
}

void add_curtain_wall(Grid& grid, const Palette& p, IVec3 from, IVec3 to, int height) {
  const IVec3 along = glm::sign(to - from);
  const IVec3 across{along.z != 0 ? 1 : 0, 0, along.x != 0 ? 1 : 0};
  for (IVec3 at = from; at != to + along; at += along) {
    for (int w = -2; w <= 2; ++w) {
      const bool is_parapet = w == -2 || w == 2;
      const int step = std::abs((at.x - from.x) + (at.z - from.z));
      const int top = height + (is_parapet ? (step % 4 < 2 ? 3 : 1) : 0);
      for (int y = -4; y <= top; ++y) {
        const IVec3 voxel = at + across * w + IVec3{0, y, 0};
        const bool is_dark = speckle(voxel.x / 2, voxel.y, voxel.z / 2) % 6 == 0;
        grid.set(voxel, y == height ? p.trim : is_dark ? p.wall_dark : p.wall);
      }
    }
  }
}

void add_keep(Grid& grid, const Palette& p) {
  const IVec3 low{kCentre - 11, kCourt, kCentre - 15};
  const IVec3 high{kCentre + 11, kCourt + 24, kCentre + 7};
  grid.fill_box({low, high + 1}, p.wall);
  grid.fill_box({low + IVec3{2, 1, 2}, high - IVec3{1, 0, 1}}, quoin::kAir);
  for (const int y : {8, 16, 24})
    grid.fill_box({low + IVec3{-1, y, -1}, {high.x + 2, kCourt + y + 1, high.z + 2}}, p.trim);
  for (int x = low.x + 3; x < high.x - 1; x += 5) {
    for (const int y : {kCourt + 3, kCourt + 11, kCourt + 19}) {
      for (const int z : {low.z, high.z}) {
        grid.fill_box({{x, y, z}, {x + 2, y + 4, z + 1}}, p.lamp);
      }
    }
  }
  for (int i = 0; i <= 12; ++i) {
    const VoxelType tile = i % 3 == 2 ? p.roof_dark : p.roof;
    grid.fill_box({{low.x - 1 + i, high.y + 1 + i, low.z - 1}, {high.x + 2 - i, high.y + 2 + i, high.z + 2}}, tile);
  }
  grid.fill_box({{kCentre - 2, kCourt, high.z - 2}, {kCentre + 3, kCourt + 8, high.z + 1}}, quoin::kAir);
  grid.fill_box({{kCentre - 2, kCourt, high.z - 1}, {kCentre + 3, kCourt + 7, high.z}}, p.plank);
  grid.fill_box({{kCentre - 2, high.y + 4, high.z + 1}, {kCentre + 3, high.y + 9, high.z + 2}}, p.glass);
}

void add_castle(Grid& grid, const Palette& p) {
  const int low = kCentre - kHalfWall;
  const int high = kCentre + kHalfWall;
  add_curtain_wall(grid, p, {low, kCourt, low}, {high, kCourt, low}, 11);
  add_curtain_wall(grid, p, {low, kCourt, high}, {high, kCourt, high}, 11);
  add_curtain_wall(grid, p, {low, kCourt, low}, {low, kCourt, high}, 11);
  add_curtain_wall(grid, p, {high, kCourt, low}, {high, kCourt, high}, 11);
  for (const int x : {low, high}) {
    for (const int z : {low, high}) add_tower(grid, p, {x, kCourt - 6, z}, 6, 26, true);
  }
  add_tower(grid, p, {kCentre - 7, kCourt - 4, high}, 4, 20, false);
  add_tower(grid, p, {kCentre + 7, kCourt - 4, high}, 4, 20, false);
  grid.fill_box({{kCentre - 3, kCourt, high - 3}, {kCentre + 4, kCourt + 9, high + 4}}, quoin::kAir);
  for (int y = kCourt; y <= kCourt + 8; ++y) {
    for (int x = kCentre - 3; x <= kCentre + 3; x += 2) grid.set({x, y, high}, p.wood);
  }
  add_keep(grid, p);
}

struct PaletteEntry {
  VoxelType Palette::*slot;
  const char* name;
  Rgba8 colour;
};

constexpr PaletteEntry kEntries[] = {{&Palette::grass, "grass", {106, 153, 66, 255}},
                                     {&Palette::meadow, "meadow", {132, 172, 78, 255}},
                                     {&Palette::soil, "soil", {121, 88, 58, 255}},
                                     {&Palette::rock, "rock", {128, 124, 120, 255}},
                                     {&Palette::sand, "sand", {222, 204, 150, 255}},
                                     {&Palette::path, "path", {178, 152, 112, 255}},
                                     {&Palette::wall, "wall", {201, 190, 170, 255}},
                                     {&Palette::wall_dark, "old wall", {180, 168, 148, 255}},
                                     {&Palette::trim, "trim", {226, 217, 198, 255}},
                                     {&Palette::roof, "roof", {166, 62, 48, 255}},
                                     {&Palette::roof_dark, "roof shade", {140, 48, 40, 255}},
                                     {&Palette::wood, "wood", {98, 68, 44, 255}},
                                     {&Palette::plank, "plank", {142, 102, 64, 255}},
                                     {&Palette::leaf, "leaf", {64, 116, 56, 255}},
                                     {&Palette::leaf_light, "young leaf", {92, 142, 62, 255}},
                                     {&Palette::water, "water", {52, 140, 186, 84}},
                                     {&Palette::glass, "glass", {190, 226, 236, 110}},
                                     {&Palette::lamp, "lamp", {255, 204, 110, 255}},
                                     {&Palette::flag, "flag", {40, 74, 150, 255}},
                                     {&Palette::sail, "sail", {240, 234, 220, 255}}};

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

}  // namespace

quoin::Result<Palette> add_palette(quoin::VoxelRegistry& types) {
  Palette p{};
  for (const PaletteEntry& entry : kEntries) {
    quoin::VoxelProperties properties;
    properties.name = entry.name;
    properties.colour = entry.colour;
    if (entry.colour.a < 255) {
      properties.visibility = quoin::Visibility::Transparent;
      properties.roughness = 0.1F;
    }
    if (entry.slot == &Palette::lamp) properties.emission = 1.0F;
    const auto type = types.add(properties);
    if (!type) return type.error();
    p.*entry.slot = *type;
  }
  return p;
}

int ground_height(int x, int z) {
  const double dx = (x - kCentre) / 92.0;
  const double dz = (z - kCentre) / 88.0;
  const double waves = 2.6 * std::sin(0.093 * x + 0.7) * std::cos(0.081 * z) + 1.7 * std::sin(0.21 * x + 0.13 * z);
  const double hill = 27.0 * (1.0 - std::pow(std::sqrt(dx * dx + dz * dz), 2.2)) + waves;
  const int edge = std::max(std::abs(x - kCentre), std::abs(z - kCentre));
  const double natural = std::clamp(hill, 2.0, 30.0);
  const double flat = std::clamp((edge - kHalfWall - 4) / 12.0, 0.0, 1.0);  // the castle's ground is level
  return static_cast<int>(std::floor(natural * flat + (kCourt - 1) * (1.0 - flat)));
}

Grid make_island(const Palette& p) {
  Grid grid;
  grid.edit({IVec3{0}, IVec3{kIslandEdge, 32, kIslandEdge}}, [&](IVec3 v, VoxelType) {
    const int h = ground_height(v.x, v.z);
    const double r = std::hypot(v.x - kCentre, v.z - kCentre);
    if (r > kIslandEdge / 2.0 - 1) return quoin::kAir;
    if (v.y > h) return v.y <= kSeaLevel ? p.water : quoin::kAir;
    const double bend = 5.0 * std::sin(v.z * 0.11);
    const bool on_path =
        v.z > kCentre + kHalfWall - 4 && std::abs(v.x - kCentre - bend * (v.z - kCentre - 30) / 60) < 3;
    if (v.y < h - 3) return speckle(v.x, v.y, v.z) % 5 == 0 ? p.soil : p.rock;
    if (v.y < h) return p.soil;
    if (on_path && h > kSeaLevel) return p.path;
    if (h <= kSeaLevel + 1) return p.sand;
    const int edge = std::max(std::abs(v.x - kCentre), std::abs(v.z - kCentre));
    if (edge < kHalfWall) return speckle(v.x, 1, v.z) % 4 == 0 ? p.sand : p.path;
    return speckle(v.x / 3, 0, v.z / 3) % 3 == 0 ? p.meadow : p.grass;
  });
  add_castle(grid, p);
  for (int i = 0; i < 5; ++i) {
    const int z = kCentre + kHalfWall + 8 + i * 9;
    for (const int side : {-6, 6}) {
      const int x = kCentre + side + static_cast<int>(5.0 * std::sin(z * 0.11) * (z - kCentre - 30) / 60);
      const int h = ground_height(x, z);
      if (h <= kSeaLevel) continue;
      grid.fill_box({{x, h, z}, {x + 1, h + 5, z + 1}}, p.wood);
      grid.set({x, h + 5, z}, p.lamp);
    }
  }
  return grid;
}

Grid make_tree(const Palette& p, int height) {
  Grid grid;
  const double r = height / 3.2;
  grid.fill_sphere({0.5, height * 0.72, 0.5}, r, p.leaf);
  grid.fill_sphere({0.5 + r * 0.4, height * 0.55, 0.5 - r * 0.3}, r * 0.75, p.leaf);
  grid.fill_sphere({0.5 - r * 0.5, height * 0.62, 0.5 + r * 0.4}, r * 0.7, p.leaf);
  const IBox box = grid.bounds();
  grid.edit(box, [&](IVec3 v, VoxelType type) {
    if (type == quoin::kAir) return type;
    const unsigned h = speckle(v.x, v.y, v.z);
    if (h % 11 == 0) return quoin::kAir;
    return h % 3 == 0 ? p.leaf_light : type;
  });
  grid.fill_box({{0, 0, 0}, {1, height / 2 + 1, 1}}, p.wood);
  grid.fill_box({{1, 0, 0}, {2, height / 3 + 1, 1}}, p.wood);
  return grid;
}

Grid make_ship(const Palette& p) {
  Grid grid;
  for (int z = 0; z < 34; ++z) {
    const double taper = z < 12 ? std::sqrt(z / 12.0) : 1.0;
    const int half = static_cast<int>(std::lround(5.5 * taper));
    const int rail = 6 + (z < 6 ? 2 : z > 26 ? 3 : 0);
    for (int y = 0; y <= rail; ++y) {
      const int width = std::max(0, half - std::max(0, 3 - y));
      grid.fill_box({{-width, y, z}, {width + 1, y + 1, z + 1}}, y == rail || y % 3 == 2 ? p.plank : p.wood);
      const int inside = std::abs(width - 1);
      if (y > 4) grid.fill_box({{-inside, y, z}, {inside + 1, y + 1, z + 1}}, quoin::kAir);
    }
  }
  for (const int z : {11, 23}) {
    grid.fill_box({{0, 4, z}, {1, 31, z + 1}}, p.wood);
    for (int y = 10; y <= 27; ++y) {
      const int bulge = static_cast<int>(std::lround(2.5 * std::sin((y - 10) / 17.0 * 3.14159265)));
      grid.fill_box({{-7, y, z - 1 - bulge}, {8, y + 1, z - bulge}}, p.sail);
    }
    grid.fill_box({{1, 29, z}, {6, 31, z + 1}}, p.flag);
  }
  grid.fill_box({{-1, 9, 33}, {2, 11, 34}}, p.lamp);
  return grid;
}

quoin::Result<quoin::Scene> make_castle() {
  quoin::Scene scene;
  const auto palette = add_palette(scene.types);
  if (!palette) return palette.error();
  constexpr int kHalf = kIslandEdge / 2;
  const auto island = add_grid(scene, "island", make_island(*palette), {kHalf, 0, kHalf});
  scene.add_instance(instance("island", island, {0, 0, 0}));
  const quoin::GridHandle trees[] = {add_grid(scene, "oak", make_tree(*palette, 19), {0, 0, 0}),
                                     add_grid(scene, "ash", make_tree(*palette, 14), {0, 0, 0})};
  unsigned random = 7;
  for (int planted = 0, tries = 0; planted < 46 && tries < 2'000; ++tries) {
    random = random * 1'664'525U + 1'013'904'223U;
    const int x = static_cast<int>(random >> 8) % (2 * kHalf);
    random = random * 1'664'525U + 1'013'904'223U;
    const int z = static_cast<int>(random >> 8) % (2 * kHalf);
    const int edge = std::max(std::abs(x - kHalf), std::abs(z - kHalf));
    const bool is_on_path = z > kHalf && std::abs(x - kHalf) < 14;
    const int ground = ground_height(x, z);
    if (edge < 44 || is_on_path || ground < kSeaLevel + 3) continue;
    const auto turn = static_cast<int>(random >> 20 & 3U);
    scene.add_instance(instance("tree " + std::to_string(++planted), trees[random >> 16 & 1U],
                                {x - kHalf, ground + 1, z - kHalf}, turn));
  }
  const auto ship = add_grid(scene, "ship", make_ship(*palette), {0, 0, 17});
  scene.add_instance(instance("Swift", ship, {46, kSeaLevel - 2, 71}, 1));
  scene.add_instance(instance("Heron", ship, {-73, kSeaLevel - 2, 36}, 0));
  return scene;
}

}  // namespace demo
