// A game that resumes where it stopped: a loop with edits and saves. The next run loads the saved world.
//
// usage: example_keep_a_world [WORLD]
//   WORLD is created or continued. Without arguments, it replaces kept.quoin.

#include <cstdio>
#include <cstring>
#include <string>
#include <utility>

#include <quoin/quoin.h>

namespace {

struct Player {
  quoin::DVec3 position{64.0, 56.0, 64.0};
  int voxels_dug = 0;
};

// Creates the landscape of the first run.
quoin::Status make_land(quoin::Scene& scene) {
  const auto types = quoin::add_terrain_types(scene.types);
  if (!types) return types.error();
  auto land = quoin::generate_terrain({.seed = 4, .size = {4, 4, 4}}, *types);
  if (!land) return land.error();
  quoin::SceneGrid grid;
  grid.name = "land";
  grid.grid = std::move(*land);
  scene.add_instance({.name = "land", .grid = scene.add_grid(std::move(grid))});
  return {};
}

// Saves the changes since the last save together with the player: a crash keeps both or neither.
quoin::Status save(quoin::WorldStore& world, quoin::WorldSaver& saver, const quoin::Scene& scene,
                   const Player& player) {
  quoin::WorldChanges more;
  std::vector<std::byte> bytes(sizeof(Player));
  std::memcpy(bytes.data(), &player, sizeof(Player));
  more.put_value("player", std::move(bytes));
  const auto begun = saver.save(world, scene, std::move(more), [](const quoin::Status& saved) {
    if (!saved) std::fprintf(stderr, "cannot save: %s\n", quoin::to_string(saved.error()).c_str());
  });
  return begun ? quoin::Status() : quoin::Status(begun.error());
}

// The player's action per frame: dig deeper.
void play(quoin::Scene& scene, Player& player) {
  quoin::Grid& land = scene.edit(scene.grids().handles().front()).grid;
  player.voxels_dug += static_cast<int>(land.fill_sphere(player.position, 2.5, quoin::kAir));
  player.position += quoin::DVec3(0.05, -0.25, 0.02);
}

quoin::Status run(const std::string& path) {
  auto world = quoin::WorldStore::open_or_create(path);
  if (!world) return world.error();
  auto loaded = quoin::load_world(*world);
  if (!loaded) return loaded.error();
  for (const std::string& warning : loaded->loaded.warnings) std::fprintf(stderr, "%s\n", warning.c_str());
  quoin::Scene& scene = loaded->loaded.scene;
  if (scene.grids().empty()) {
    if (auto made = make_land(scene); !made) return made;
  }
  // Exists only while the game runs.
  const quoin::GridHandle torch = scene.add_grid({.name = "torch", .saved = false});
  scene.add_instance({.name = "torch", .grid = torch});
  scene.edit(torch).grid.set({0, 0, 0}, 1);
  Player player;
  const auto kept = world->value("player");
  if (kept && *kept && (*kept)->size() == sizeof(Player)) std::memcpy(&player, (*kept)->data(), sizeof(Player));

  for (int frame = 1; frame <= 120; ++frame) {
    play(scene, player);
    if (frame % 30 == 0) {  // another thread writes to disk
      if (auto saved = save(*world, loaded->saver, scene, player); !saved) return saved;
    }
  }
  if (auto safe = world->flush(); !safe) return safe;
  const quoin::WorldStats stats = world->stats();
  std::printf("%d voxels dug, the player is at height %.1f; saved %llu chunks in %llu commits\n", player.voxels_dug,
              player.position.y, static_cast<unsigned long long>(stats.saved_chunks),
              static_cast<unsigned long long>(stats.commits));
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : "kept.quoin";
  if (argc <= 1) std::remove(path.c_str());
  for (int day = 1; day <= 2; ++day) {
    if (const auto played = run(path); !played) {
      std::fprintf(stderr, "%s\n", quoin::to_string(played.error()).c_str());
      return 1;
    }
  }
  return 0;
}
