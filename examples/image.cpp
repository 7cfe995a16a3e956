// Renders a scene with sun, shadows and ambient occlusion. Writes OUT.png (default staircase.png).

#include <cstdio>
#include <string>

#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace {

quoin::Result<quoin::Scene> make_staircase() {
  quoin::Scene scene;
  quoin::VoxelProperties properties;
  properties.name = "stone";
  properties.colour = {150, 140, 128, 255};
  const auto stone = scene.types.add(properties);
  if (!stone) return stone.error();
  quoin::SceneGrid stairs;
  for (int step = 0; step < 12; ++step)
    stairs.grid.fill_box({{0, 0, -2 * step - 1}, {10, step + 1, 1 - 2 * step}}, *stone);
  quoin::Instance placed;
  placed.grid = scene.add_grid(std::move(stairs));
  scene.add_instance(placed);
  return scene;
}

quoin::Status draw(const quoin::Scene& scene, const std::string& path) {
  quoin::RenderOptions options;
  options.width = 320;
  options.height = 240;
  options.samples = 4;
  const quoin::CpuRenderer renderer(scene);
  const quoin::Camera camera = quoin::frame_scene(scene, quoin::View::Iso, 320.0 / 240.0);
  const auto image = renderer.render(camera, options);
  if (!image) return image.error();
  const auto size = quoin::write_png(image->colour, path);
  if (!size) return size.error();
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  const auto scene = make_staircase();
  const std::string path = argc > 1 ? argv[1] : "staircase.png";
  const quoin::Status status = scene ? draw(*scene, path) : scene.error();
  if (!status) {
    std::fprintf(stderr, "image: %s\n", quoin::to_string(status.error()).c_str());
    return 1;
  }
  std::printf("drew %s\n", path.c_str());
  return 0;
}
