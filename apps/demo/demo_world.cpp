// Writes the demo world, a castle on an island, to the .vox file named on the command line.

#include <cstdio>

#include <quoin/io/vox.h>

#include "demo_scenes.h"

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::fprintf(stderr, "usage: quoin_demo_world OUT.vox\n");
    return 2;
  }
  const auto scene = demo::make_castle();
  const auto written = scene ? quoin::write_vox(*scene, argv[1]) : scene.error();
  if (!written) {
    std::fprintf(stderr, "quoin_demo_world: %s\n", quoin::to_string(written.error()).c_str());
    return 1;
  }
  return 0;
}
