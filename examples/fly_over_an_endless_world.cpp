// A game loop in an endless world. Only chunks around the player are in memory: they are generated, edited, saved and
// released on the way, and rendered at the end. The next run loads the edits. The player keeps above the ground, which
// rays find: a LiveTracer prepares them on a worker, so that frames never wait for it.
//
// usage: example_fly_over_an_endless_world [WORLD [IMAGE]]
//   WORLD is created or continued. Without arguments, it replaces endless.quoin, and writes endless.png.

#include <algorithm>
#include <cstdio>
#include <string>

#include <quoin/quoin.h>

namespace {

constexpr int kFrames = 240;

quoin::Status draw(const quoin::Scene& scene, const quoin::Viewer& viewer, const std::string& path) {
  quoin::RenderOptions options;
  options.width = 480;
  options.height = 270;
  const auto camera = quoin::look_along(viewer.position, viewer.direction, 1.1);
  if (!camera) return camera.error();
  const quoin::CpuRenderer renderer(scene);
  const auto image = renderer.render(*camera, options);
  if (!image) return image.error();
  const auto written = quoin::write_png(image->colour, path);
  return written ? quoin::Status() : quoin::Status(written.error());
}

quoin::Status run(const std::string& path, const std::string& image) {
  quoin::StreamOptions options;
  options.budget_bytes = std::size_t{128} << 20;
  auto world = quoin::StreamedWorld::open_or_create(path, options);
  if (!world) return world.error();
  if (world->is_new()) {
    if (const auto land = world->add_terrain({.seed = 11}); !land) return land.error();
  }
  quoin::Viewer player;
  player.position = {0.5, 110.0, 0.5};
  player.direction = {1.0, -0.35, 0.3};
  player.radius = 320.0;
  // Loads the chunks around the player before the first frame.
  if (auto loaded = world->load_all({&player, 1}); !loaded) return loaded;

  quoin::LiveTracer tracer;
  tracer.finish(world->scene());

  std::int64_t dug = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    player.position.x += 2.0;
    if (frame % 20 == 0) {
      quoin::Scene& scene = world->scene();
      quoin::Grid& land = scene.edit(scene.grids().handles().front()).grid;
      dug += land.fill_sphere(player.position + quoin::DVec3(30.0, -60.0, 10.0), 9.0, quoin::kAir);
    }
    if (auto saved = world->update({&player, 1}); !saved) return saved;  // edits are kept: the next update retries
    tracer.update(world->scene());
    tracer.take();
    const auto ground = first_hit(tracer.shown(), {player.position, {0.0, -1.0, 0.0}});
    if (ground) player.position.y += std::clamp(70.0 - ground->t, -0.5, 0.5);
    // A game renders here: LiveMeshes, VulkanRenderer and others follow world->scene() like any scene.
  }
  for (const std::string& problem : world->take_problems()) std::fprintf(stderr, "%s\n", problem.c_str());
  if (auto loaded = world->load_all({&player, 1}); !loaded) return loaded;
  if (auto drawn = draw(world->scene(), player, image); !drawn) return drawn;
  if (auto safe = world->flush(); !safe) return safe;
  const quoin::StreamStats stats = world->stats();
  std::printf("%lld voxels dug; %llu chunks generated, %llu loaded, %llu released; %zu in memory, %.1f MB\n",
              static_cast<long long>(dug), static_cast<unsigned long long>(stats.chunks_made),
              static_cast<unsigned long long>(stats.chunks_read),
              static_cast<unsigned long long>(stats.chunks_unloaded), stats.loaded_chunks,
              static_cast<double>(stats.loaded_bytes) / 1e6);
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : "endless.quoin";
  const std::string image = argc > 2 ? argv[2] : "endless.png";
  if (argc <= 1) std::remove(path.c_str());
  quoin::return_freed_memory();  // so that resident memory also stays within the budget
  for (int day = 1; day <= 2; ++day) {
    if (const auto flown = run(path, image); !flown) {
      std::fprintf(stderr, "%s\n", quoin::to_string(flown.error()).c_str());
      return 1;
    }
  }
  return 0;
}
