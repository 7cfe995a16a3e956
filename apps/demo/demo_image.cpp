// Renders the demo world to the PNG file named on the command line, in 1280x720 pixels or the given number. Needs only
// the renderer's part of the library: `./dev demo` shows its image before the tool is built.

#include <cstdio>
#include <cstdlib>
#include <numbers>

#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>

#include "demo_scenes.h"

namespace {

quoin::Status draw(const char* file, int width, int height) {
  const auto scene = demo::make_castle();
  if (!scene) return scene.error();
  // The options of `quoin render` in `./dev demo`.
  const auto camera = quoin::look_at({95, 84, 214}, {1, 20, 6}, 33 * std::numbers::pi / 180);
  if (!camera) return camera.error();
  quoin::RenderOptions options;
  options.width = width;
  options.height = height;
  options.samples = 8;
  options.light = quoin::natural_light();
  options.environment = quoin::Environment::natural({-0.4, 0.8, 0.75});
  options.environment->exposure = 1.15;
  const auto image = quoin::CpuRenderer(*scene).render(*camera, options);
  if (!image) return image.error();
  const auto written = quoin::write_png(image->colour, file);
  return written ? quoin::Status{} : written.error();
}

}  // namespace

int main(int argc, char** argv) {
  const int width = argc == 4 ? std::atoi(argv[2]) : 1280;
  const int height = argc == 4 ? std::atoi(argv[3]) : 720;
  if ((argc != 2 && argc != 4) || argv[1][0] == '-') {
    std::fprintf(stderr, "usage: quoin_demo_image OUT.png [WIDTH HEIGHT]\n");
    return 2;
  }
  if (const auto drawn = draw(argv[1], width, height); !drawn) {
    std::fprintf(stderr, "quoin_demo_image: %s\n", quoin::to_string(drawn.error()).c_str());
    return 1;
  }
  return 0;
}
