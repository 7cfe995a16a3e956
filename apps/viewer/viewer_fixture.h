#pragma once

// Shared by the viewer's tests.

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>

#include <quoin/io/vox.h>

#include "document.h"

namespace quoin::viewer {

/// A hill with a glass block, and a second instance of it that is mirrored and rotated.
inline LoadedScene small_scene() {
  LoadedScene loaded;
  Scene& scene = loaded.scene;
  for (const Rgba8 colour : {Rgba8{90, 160, 60, 255}, Rgba8{150, 110, 70, 255}, Rgba8{200, 40, 40, 255}}) {
    VoxelProperties properties;
    properties.colour = colour;
    (void)scene.types.add(properties).value();
  }
  VoxelProperties glass;
  glass.colour = {120, 180, 255, 90};
  glass.visibility = Visibility::Transparent;
  (void)scene.types.add(glass).value();
  SceneGrid hill;
  hill.name = "hill";
  hill.grid.fill_box({{0, 0, 0}, {71, 4, 41}}, 1);
  hill.grid.fill_sphere({30.0, 4.0, 20.0}, 9.0, 2);
  hill.grid.fill_box({{50, 4, 10}, {56, 10, 16}}, 4);
  hill.canvas = hill.grid.bounds();
  const GridHandle grid = scene.add_grid(std::move(hill));
  Instance instance;
  instance.grid = grid;
  scene.add_instance(instance);
  instance.position = {100.0, 0.0, 0.0};
  instance.rotation = {0.70710678118654752440, 0.0, 0.70710678118654752440, 0.0};
  instance.mirrored = true;
  scene.add_instance(instance);
  return loaded;
}

/// Returns the fraction of pixels that differ by more than `most` in a channel.
inline double differing(const Image& a, const Image& b, int most) {
  EXPECT_EQ(a.rgb.size(), b.rgb.size());
  if (a.rgb.size() != b.rgb.size() || a.rgb.empty()) return 1.0;
  int count = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    bool differs = false;
    for (std::size_t c = i; c < i + 3; ++c) differs |= std::abs(a.rgb[c] - b.rgb[c]) > most;
    count += differs ? 1 : 0;
  }
  return 3.0 * count / static_cast<double>(a.rgb.size());
}

inline Document small_document() {
  return {small_scene(), "hill.vox"};
}

/// A folder that is removed when the test ends.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / ("quoin_viewer_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::filesystem::path file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace quoin::viewer
