// A cave lit only by lamps: glowing voxels, a point and a spot, all with shadows, without sun and sky. Writes OUT.png
// (default cave.png).

#include <array>
#include <cstdio>
#include <string>

#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>

namespace {

struct Types {
  quoin::VoxelType rock = quoin::kAir;
  quoin::VoxelType pillar = quoin::kAir;
  quoin::VoxelType crystal = quoin::kAir;
};

quoin::Result<Types> add_types(quoin::Scene& scene) {
  Types types;
  for (const auto& [type, colour, emission] : {std::tuple{&types.rock, quoin::Rgba8{132, 124, 118, 255}, 0.0F},
                                               {&types.pillar, {176, 160, 136, 255}, 0.0F},
                                               {&types.crystal, {90, 220, 200, 255}, 9.0F}}) {
    quoin::VoxelProperties properties;
    properties.colour = colour;
    properties.emission = emission;  // radiance, as a multiple of the colour; lights other voxels
    const auto added = scene.types.add(properties);
    if (!added) return added.error();
    *type = *added;
  }
  return types;
}

void dig_cave(quoin::Scene& scene, const Types& types) {
  quoin::SceneGrid cave;
  quoin::Grid& grid = cave.grid;
  grid.fill_box({{0, 0, 0}, {96, 48, 64}}, types.rock);
  for (int i = 0; i < 9; ++i) {
    grid.fill_sphere({22.0 + 8.0 * i, 20.0 + i * 5 % 4, 36.0 + i * 7 % 9}, 15.0 + i % 3, quoin::kAir);
  }
  grid.fill_box({{0, 0, 0}, {96, 12, 64}}, types.rock);
  for (const quoin::IVec3 foot : {quoin::IVec3{28, 12, 30}, {52, 12, 40}, {70, 12, 28}}) {
    grid.fill_box({foot, foot + quoin::IVec3{4, 30, 4}}, types.pillar);
  }
  for (const quoin::IVec3 at : {quoin::IVec3{20, 12, 40}, {40, 12, 47}, {78, 12, 44}}) {
    grid.fill_box({at, at + quoin::IVec3{2, 3, 2}}, types.crystal);
  }
  scene.add_instance({"", scene.add_grid(std::move(cave))});
}

void hang_lamps(quoin::Scene& scene) {
  quoin::Lamp lantern;
  lantern.position = {62.5, 19.5, 37.5};
  lantern.colour = {1.0F, 0.62F, 0.30F};
  lantern.intensity = 60.0;  // light received by a white surface facing it at 1 unit
  lantern.range = 50.0;
  scene.lamps.push_back(lantern);
  quoin::Lamp spot;
  spot.kind = quoin::Lamp::Kind::Spot;
  spot.position = {34.0, 33.0, 42.0};
  spot.direction = {-0.25, -1.0, -0.1};
  spot.colour = {0.75F, 0.8F, 1.0F};
  spot.intensity = 500.0;
  spot.inner_angle_radians = 0.15;
  spot.outer_angle_radians = 0.4;
  scene.lamps.push_back(spot);
}

}  // namespace

int main(int argc, char** argv) {
  quoin::Scene scene;
  const auto types = add_types(scene);
  if (!types) return 1;
  dig_cave(scene, *types);
  hang_lamps(scene);

  quoin::RenderOptions options;
  options.width = 480;
  options.height = 270;
  options.samples = 4;
  options.light.max_lamps = 64;  // the library's default is 0: lamps light nothing
  scene.environment = quoin::Environment::reference();
  scene.environment->lamp_brightness = 2.0;
  scene.environment->sun.brightness = 0.0;
  scene.environment->sky.brightness = 0.2;
  const auto camera = quoin::look_at({93.0, 24.0, 33.0}, {20.0, 17.0, 40.0}, 1.0);
  if (!camera) return 1;
  const auto image = quoin::CpuRenderer(scene).render(*camera, options);
  if (!image) return 1;
  const auto size = quoin::write_png(image->colour, argc > 1 ? argv[1] : "cave.png");
  if (!size) std::fprintf(stderr, "lamps: %s\n", quoin::to_string(size.error()).c_str());
  std::printf("%lld rays, most of them to lamps\n", static_cast<long long>(image->rays));
  return size ? 0 : 1;
}
