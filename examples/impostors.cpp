// Impostors: writes the 26 views of a model as one sheet of images, and uses impostors in a game loop while the model
// is edited. Writes OUT.png (default impostors.png).

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include <quoin/io/image_files.h>
#include <quoin/render/impostor_cache.h>

namespace {

constexpr int kEdge = 96;

quoin::Result<quoin::GridHandle> add_rocket(quoin::Scene& scene) {
  std::vector<quoin::VoxelType> types;
  for (const quoin::Rgba8 colour :
       {quoin::Rgba8{228, 230, 234, 255}, {206, 52, 44, 255}, {40, 44, 52, 255}, {86, 170, 214, 255}}) {
    quoin::VoxelProperties properties;
    properties.colour = colour;
    const auto added = scene.types.add(properties);
    if (!added) return added.error();
    types.push_back(*added);
  }
  quoin::SceneGrid rocket;
  quoin::Grid& grid = rocket.grid;
  for (int y = 0; y < 60; ++y) {
    const int half = y < 40 ? 7 : std::max(1, 7 - (y - 40) * (y - 40) / 55);
    grid.fill_box({{-half, y, -half}, {half, y + 1, half}}, y % 20 < 3 || y > 50 ? types[1] : types[0]);
  }
  grid.fill_box({{-4, -4, -4}, {4, 0, 4}}, types[2]);
  grid.fill_box({{-2, 30, 7}, {2, 34, 8}}, types[3]);
  for (int y = 0; y < 16; ++y) {
    const int reach = 7 + (16 - y) * 2 / 3;
    grid.fill_box({{-reach, y, -1}, {reach, y + 1, 1}}, types[1]);
    grid.fill_box({{-1, y, -reach}, {1, y + 1, reach}}, types[1]);
  }
  rocket.pivot = quoin::content_sphere(grid).centre;
  return scene.add_grid(std::move(rocket));
}

// Nine images per row; uncovered pixels stay grey.
quoin::Image sheet_of(const std::vector<quoin::ImpostorImage>& images) {
  constexpr int kAcross = 9;
  const int rows = (static_cast<int>(images.size()) + kAcross - 1) / kAcross;
  quoin::Image sheet{kAcross * kEdge, rows * kEdge, {}};
  sheet.rgb.assign(std::size_t{3} * static_cast<std::size_t>(sheet.width * sheet.height), 150);
  for (int i = 0; i < static_cast<int>(images.size()); ++i) {
    const quoin::ImpostorImage& image = images[static_cast<std::size_t>(i)];
    for (int texel = 0; texel < kEdge * kEdge; ++texel) {
      if (image.coverage[static_cast<std::size_t>(texel)] == 0) continue;
      const int x = i % kAcross * kEdge + texel % kEdge;
      const int y = i / kAcross * kEdge + texel / kEdge;
      std::copy_n(image.colour.rgb.begin() + 3 * texel, 3, sheet.rgb.begin() + 3 * (y * sheet.width + x));
    }
  }
  return sheet;
}

// Twenty frames with one edit each. No frame waits: workers build, and the old impostor is used until they finish.
bool play(quoin::Scene& scene, quoin::GridHandle rocket) {
  quoin::ImpostorCache cache;
  int without = 0;
  for (int frame = 0; frame < 20; ++frame) {
    scene.edit(rocket).grid.set({7, frame, 0}, quoin::kAir);
    const auto impostor = cache.find(scene, rocket);
    without += static_cast<int>(impostor == nullptr);  // render the rocket by rays or as a mesh
    cache.wait(scene, 0.0);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // the rest of the frame
  }
  // Programs that need the current impostor, for example for a screenshot, can wait.
  static_cast<void>(cache.find(scene, rocket));
  cache.wait(scene);
  const auto newest = cache.find(scene, rocket);
  const quoin::ImpostorCache::Stats stats = cache.stats();
  std::printf("%d frames without an impostor; built %llu times, %llu of them from the previous one; %zu kB\n", without,
              static_cast<unsigned long long>(stats.built), static_cast<unsigned long long>(stats.rebuilt),
              newest == nullptr ? 0 : newest->bytes() / 1000);
  return newest != nullptr && stats.waiting == 0;
}

}  // namespace

int main(int argc, char** argv) {
  quoin::Scene scene;
  const auto rocket = add_rocket(scene);
  if (!rocket) return 1;
  const quoin::ImpostorOptions options{kEdge};
  const auto images = quoin::impostor_images(scene.grids()[*rocket].grid, scene.types, options);
  const auto size = quoin::write_png(sheet_of(images), argc > 1 ? argv[1] : "impostors.png");
  if (!size) std::fprintf(stderr, "impostors: %s\n", quoin::to_string(size.error()).c_str());
  return size && play(scene, *rocket) ? 0 : 1;
}
