#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include <unistd.h>

#include <quoin/io/image_files.h>
#include <quoin/io/mesh_file.h>
#include <quoin/io/vox.h>
#include <quoin/terrain/terrain.h>

#include "counted.h"

namespace quoin::counts {
namespace {

[[noreturn]] void give_up(const char* what) {
  std::fprintf(stderr, "counts: %s failed\n", what);
  std::exit(1);
}

Scene small_terrain() {
  Scene scene;
  const auto types = add_terrain_types(scene.types);
  if (!types) give_up("adding types");
  auto grid = generate_terrain({.size = {2, 2, 2}}, *types, {1});
  if (!grid) give_up("a terrain");
  SceneGrid placed;
  placed.grid = std::move(*grid);
  placed.canvas = {IVec3{0}, IVec3{64}};
  scene.add_instance({"terrain", scene.add_grid(std::move(placed))});
  return scene;
}

Image gradient() {
  Image image{160, 90, {}};
  for (int i = 0; i < 160 * 90; ++i) {
    for (const int shift : {0, 3, 5}) image.rgb.push_back(static_cast<std::uint8_t>(i * 7 >> shift));
  }
  return image;
}

}  // namespace

std::vector<Counted> file_work() {
  const auto scene = std::make_shared<Scene>(small_terrain());
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::string stem = "quoin_counts_" + std::to_string(::getpid());
  const auto written = write_vox(*scene);
  const auto meshes = mesh_scene(*scene, {}, {1});
  if (!written || !meshes) give_up("preparing files");
  const auto file = std::make_shared<std::vector<std::byte>>(written->bytes);
  const auto meshed = std::make_shared<SceneMeshes>(*meshes);
  const auto image = std::make_shared<Image>(gradient());
  return {{"files/terrain", [] { (void)small_terrain(); }},
          {"files/read_vox",
           [=] {
             if (!read_vox(*file)) give_up("reading .vox");
           }},
          {"files/write_vox",
           [=] {
             if (!write_vox(*scene)) give_up("writing .vox");
           }},
          {"files/mesh_scene",
           [=] {
             if (!mesh_scene(*scene, {}, {1})) give_up("meshing");
           }},
          {"files/write_glb",
           [=] {
             const auto path = folder / (stem + ".glb");
             const bool is_written = write_mesh(*meshed, path).has_value();
             std::filesystem::remove(path);
             if (!is_written) give_up("writing .glb");
           }},
          {"files/write_png", [=] {
             const auto path = folder / (stem + ".png");
             const bool is_written = write_png(*image, path).has_value();
             std::filesystem::remove(path);
             if (!is_written) give_up("writing .png");
           }}};
}

}  // namespace quoin::counts
