#include <cstdio>
#include <cstdlib>
#include <memory>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/impostor.h>
#include <quoin/scene/level_of_detail.h>

#include "bench/image_workload.h"
#include "counted.h"

namespace quoin::counts {
namespace {

struct World {
  Scene scene = workloads::image_scene();
  CpuRenderer renderer{scene, InstanceFilter::Visible, {1}};
};

RenderOptions small_image(bool lit) {
  RenderOptions options;
  options.width = 128;
  options.height = 72;
  options.light.shading = lit ? Shading::Lit : Shading::Unlit;
  return options;
}

void take(const World& world, bool lit) {
  if (world.renderer.render(workloads::over_the_terrain(), small_image(lit), {1})) return;
  std::fprintf(stderr, "counts: a render failed\n");
  std::exit(1);
}

}  // namespace

std::vector<Counted> scene_work() {
  const auto world = std::make_shared<World>();
  Grid* const grid = &world->scene.edit(world->scene.grids().handles().front()).grid;  // its address is stable
  return {{"image/lit", [=] { take(*world, true); }},
          {"image/unlit", [=] { take(*world, false); }},
          {"grid/get",
           [=] {
             GridReader reader(*grid);
             std::int64_t sum = 0;
             for (int z = 0; z < 64; ++z) {
               for (int y = 0; y < 64; ++y) {
                 for (int x = 0; x < 64; ++x) sum += reader.get({x, y, z});
               }
             }
             if (sum == 0) std::exit(1);
           }},
          {"grid/set",
           [] {
             Grid edited;
             for (int i = 0; i < 20'000; ++i) {
               edited.set({i * 7 % 61, i * 11 % 59, i * 13 % 53}, static_cast<VoxelType>(1 + i % 3));
             }
           }},
          {"grid/fill_sphere",
           [] {
             Grid edited;
             edited.fill_sphere({40, 40, 40}, 37.5, 1);
           }},
          {"scene/update_after_one_voxel", [=] {
             Grid& edited = *grid;
             edited.set({100, 60, 100}, edited.get({100, 60, 100}) == kAir ? VoxelType{1} : kAir);
             world->renderer.update({1});
           }}};
}

}  // namespace quoin::counts
