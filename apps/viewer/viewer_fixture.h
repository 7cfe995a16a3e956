#pragma once

// Shared by the viewer's tests.

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>

#include <gtest/gtest.h>
#include <quoin/core/image.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
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

/// Writes a schematic of some stones of Minecraft.
inline std::filesystem::path write_house(const ScratchFolder& folder) {
  Scene scene;
  const auto stone = scene.types.add({.name = "minecraft:stone"});
  EXPECT_TRUE(stone);
  SceneGrid grid;
  for (const IVec3 at : {IVec3(0, 0, 0), IVec3(1, 0, 0), IVec3(2, 0, 1), IVec3(1, 1, 1)}) grid.grid.set(at, *stone);
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  const std::filesystem::path path = folder.file("house.schem");
  EXPECT_TRUE(save_scene(scene, path));
  return path;
}

/// Returns the files of a resource pack whose stone is a box of that height, in sixteenths, by path.
inline std::map<std::string, std::string> stone_pack(int height) {
  AlphaImage red{16, 16, {}};
  for (int i = 0; i < 256; ++i) red.rgba.insert(red.rgba.end(), {200, 40, 40, 255});
  const auto png = write_png(red);
  EXPECT_TRUE(png);
  std::string faces;
  for (const char* const side : {"down", "up", "north", "south", "west", "east"}) {
    faces += std::string(faces.empty() ? "" : ", ") + "\"" + side + R"(": {"texture": "#all"})";
  }
  return {{"assets/minecraft/blockstates/stone.json", R"({"variants": {"": {"model": "block/stone"}}})"},
          {"assets/minecraft/models/block/stone.json",
           R"({"textures": {"all": "block/stone"}, "elements": [{"from": [0, 0, 0], "to": [16, )" +
               std::to_string(height) + R"(, 16], "faces": {)" + faces + "}}]}"},
          {"assets/minecraft/textures/block/stone.png",
           std::string(reinterpret_cast<const char*>(png->data()), png->size())}};
}

/// Writes such a pack as a folder, and returns its path.
inline std::filesystem::path write_stone_pack(const ScratchFolder& folder, const std::string& name, int height) {
  for (const auto& [path, text] : stone_pack(height)) {
    const std::filesystem::path file = folder.file(name) / path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
  }
  return folder.file(name);
}

}  // namespace quoin::viewer
