// Levels of detail: a long road of houses. Near houses are rendered voxel by voxel (green), further ones in coarser
// cells (yellow to orange), the furthest from impostors (blue). Writes OUT.png (default levels_of_detail.png), with the
// normal image above.

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/level_of_detail.h>

namespace {

quoin::Result<quoin::GridHandle> add_house(quoin::Scene& scene) {
  std::array<quoin::VoxelType, 4> types{};
  constexpr std::array<quoin::Rgba8, 4> kColours = {
      {{222, 208, 180, 255}, {160, 62, 48, 255}, {96, 70, 50, 255}, {110, 160, 190, 255}}};
  for (std::size_t i = 0; i < types.size(); ++i) {
    quoin::VoxelProperties properties;
    properties.colour = kColours[i];
    const auto added = scene.types.add(properties);
    if (!added) return added.error();
    types[i] = *added;
  }
  quoin::SceneGrid house;
  quoin::Grid& grid = house.grid;
  grid.fill_box({{0, 0, 0}, {32, 22, 40}}, types[0]);
  for (int i = 0; i < 20; ++i) grid.fill_box({{i - 2, 22 + i, -2}, {34 - i, 23 + i, 42}}, types[1]);
  for (const int z : {6, 18, 30}) {
    for (const int y : {4, 13}) {
      grid.fill_box({{-1, y - 1, z - 1}, {1, y + 6, z + 6}}, types[2]);
      grid.fill_box({{-1, y, z}, {1, y + 5, z + 5}}, types[3]);
      grid.fill_box({{31, y, z}, {33, y + 5, z + 5}}, types[3]);
    }
  }
  grid.fill_box({{13, 0, 39}, {19, 11, 41}}, types[2]);
  return scene.add_grid(std::move(house));
}

void add_road(quoin::Scene& scene, quoin::GridHandle house) {
  for (int i = 0; i < 120; ++i) {
    for (const double x : {-70.0, 38.0}) {
      quoin::Instance instance;
      instance.grid = house;
      instance.position = {x, 0.0, -60.0 * i};
      instance.mirrored = x < 0.0;
      if (instance.mirrored) instance.position.x += 32.0;
      scene.add_instance(instance);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  quoin::Scene scene;
  const auto house = add_house(scene);
  if (!house) return 1;
  add_road(scene, *house);
  const auto camera = quoin::look_at({0.0, 46.0, 130.0}, {0.0, 8.0, -260.0}, 0.9);
  if (!camera) return 1;

  quoin::DetailSelector view;  // one per view; its hysteresis avoids flicker at thresholds
  quoin::RenderOptions options;
  options.width = 640;
  options.height = 240;
  options.samples = 4;
  options.detail.policy.emplace().far_pixels = 24;  // for small models; 128 uses impostors earlier
  options.detail.selector = &view;
  const quoin::CpuRenderer renderer(scene);
  quoin::Image both{options.width, 2 * options.height, {}};
  for (const bool in_colours : {false, true}) {
    options.detail.colours = in_colours;
    const auto image = renderer.render(*camera, options);
    if (!image) return 1;
    both.rgb.insert(both.rgb.end(), image->colour.rgb.begin(), image->colour.rgb.end());
  }
  const auto size = quoin::write_png(both, argc > 1 ? argv[1] : "levels_of_detail.png");
  if (!size) std::fprintf(stderr, "levels_of_detail: %s\n", quoin::to_string(size.error()).c_str());

  std::vector<quoin::SelectedInstance> selected;
  view.select(scene, *camera, options.width, options.height, *options.detail.policy, selected);
  std::array<int, 3> count{};
  for (const quoin::SelectedInstance& each : selected) ++count[static_cast<std::size_t>(each.detail)];
  std::printf("%zu houses in sight: %d near, %d in coarser cells, %d from impostors\n", selected.size(), count[0],
              count[1], count[2]);
  return size && count[0] > 0 && count[1] > 0 && count[2] > 0 ? 0 : 1;
}
