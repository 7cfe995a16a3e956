// Voxel data: stairs with a direction and a chest with contents, in a house that is copied, rotated and saved.

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>

#include <quoin/quoin.h>

namespace {

constexpr std::uint32_t kNorth = 1;  // one of four directions, in two bits

quoin::Result<int> run(const std::string& path) {
  quoin::Scene scene;
  const auto stairs = scene.types.add({.name = "stairs",
                                       .colour = {150, 110, 70, 255},
                                       .state_bits = 2,
                                       .orientations = quoin::StateOrientations::about_y()});
  if (!stairs) return stairs.error();
  const auto chest = scene.types.add({.name = "chest", .colour = {120, 80, 30, 255}});
  if (!chest) return chest.error();

  quoin::SceneGrid entry;
  quoin::Grid& world = entry.grid;
  const quoin::IBox house{{0, 0, 0}, {20, 10, 20}};
  const quoin::IVec3 step{3, 0, 4};
  const quoin::IVec3 box{5, 0, 6};
  const std::string apples = "three apples";
  const std::span<const std::byte> inventory = std::as_bytes(std::span(apples));

  quoin::ChangeCursor seen = world.cursor();
  world.set(step, *stairs, {.state = kNorth});
  world.set(box, *chest, {.bytes = inventory});
  quoin::CopyOptions turned;
  turned.types = &scene.types;  // turns the states of types with `orientations`
  quoin::copy_box(world, house, world, {40, 0, 0}, quoin::AxisOrientation::quarter_turns(1, 1), turned);

  // Renderers follow voxel changes. Code that manages chests also follows data changes, even if no voxel changed.
  world.set_data(box, {});
  for (const quoin::IVec3 chunk : world.data_changes_since(seen).chunks(world)) {
    std::printf("data changed in chunk %d %d %d\n", chunk.x, chunk.y, chunk.z);
  }
  world.for_each_data([&](quoin::IVec3 voxel, quoin::VoxelType type, const quoin::VoxelData& data) {
    std::printf("%s at %d %d %d: state %u, %zu bytes\n", scene.types[type].name.c_str(), voxel.x, voxel.y, voxel.z,
                data.state, data.bytes.size());
  });

  scene.add_instance({.name = "world", .grid = scene.add_grid(std::move(entry))});
  const auto saved = quoin::save_scene(scene, path);
  if (!saved) return saved.error();
  const auto loaded = quoin::load_scene(path);
  if (!loaded) return loaded.error();
  const quoin::Grid& again = loaded->scene.grids()[loaded->scene.grids().handles().front()].grid;
  return again.data_count() == 3 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const auto result = run(argc > 1 ? argv[1] : "data_at_voxels.json");
  if (result) return *result;
  std::fprintf(stderr, "%s\n", to_string(result.error()).c_str());
  return 1;
}
