// Makes a fleet of voxel ships over a generated terrain, writes it as a scene file, reads that file and renders it
// twice: in its own colours, and coloured by level of detail. The command line names the files.

#include <cstdio>
#include <vector>

#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>

#include "demo_scenes.h"

namespace {

quoin::Result<quoin::LoadedScene> written_and_read(const char* file) {
  const auto fleet = demo::make_fleet();
  if (!fleet) return fleet.error();
  const auto saved = quoin::save_scene(*fleet, file);
  if (!saved) return saved.error();
  return quoin::load_scene(file);
}

quoin::Status draw(const char* scene_file, const std::vector<const char*>& images) {
  const auto fleet = written_and_read(scene_file);
  if (!fleet) return fleet.error();
  const quoin::CpuRenderer renderer(fleet->scene);
  quoin::RenderOptions options = demo::fleet_options(*fleet);
  for (const char* file : images) {
    const auto image = renderer.render(*fleet->camera, options);
    if (!image) return image.error();
    const auto written = quoin::write_png(image->colour, file);
    if (!written) return written.error();
    options.detail.colours = true;
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: quoin_demo_fleet FLEET.json OUT.png LEVELS.png\n");
    return 2;
  }
  if (const auto drawn = draw(argv[1], {argv[2], argv[3]}); !drawn) {
    std::fprintf(stderr, "quoin_demo_fleet: %s\n", quoin::to_string(drawn.error()).c_str());
    return 1;
  }
  return 0;
}
