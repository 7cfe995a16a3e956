// A game in miniature, linked with quoin::core only: streams land, meshes and lights it, digs the voxel that a ray
// hits, saves, and finds the hole when it opens the world again.

#include <cstdio>
#include <optional>

#include <quoin/quoin.h>

namespace {

// Digs below the player. Returns the height of the voxel.
quoin::Result<int> dig(const char* path) {
  auto world = quoin::StreamedWorld::open_or_create(path);
  if (!world) return world.error();
  if (world->is_new()) {
    if (const auto land = world->add_terrain({.seed = 11}); !land) return land.error();
  }
  quoin::Viewer player;
  player.position = {0.5, 110.0, 0.5};
  player.radius = 150.0;
  if (const auto loaded = world->load_all({&player, 1}); !loaded) return loaded.error();
  quoin::LiveLight light;
  quoin::LiveMeshes meshes;
  quoin::LiveTracer tracer;
  meshes.use_light(light);
  tracer.finish(world->scene());
  meshes.finish(world->scene(), player.position);
  const auto hit = quoin::first_hit(tracer.shown(), {player.position, {0.0, -1.0, 0.0}}, 500.0);
  if (meshes.take().empty() || !hit) return quoin::make_error(quoin::ErrorCode::BadFormat, "there is no land");
  const quoin::GridHandle land = tracer.shown().scene().instances()[hit->instance].grid;
  world->scene().edit(land).grid.set(hit->voxel, quoin::kAir);
  if (const auto saved = world->flush(); !saved) return saved.error();
  return hit->voxel.y;
}

}  // namespace

int main(int argc, char** argv) {
  const char* const path = argc > 1 ? argv[1] : "streams.quoin";
  std::remove(path);
  std::optional<int> before;
  for (int run = 0; run < 2; ++run) {
    const auto height = dig(path);
    if (!height) std::fprintf(stderr, "%s\n", quoin::to_string(height.error()).c_str());
    if (!height || (before && *height >= *before)) return 1;
    std::printf("dug at y = %d\n", *height);
    before = *height;
  }
  return 0;
}
