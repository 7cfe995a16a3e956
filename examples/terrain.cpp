// Generates a world from a seed, and measures the depth of its water.

#include <algorithm>
#include <cstdio>

#include <quoin/terrain/terrain.h>

int main() {
  quoin::VoxelRegistry registry;
  const auto types = quoin::add_terrain_types(registry);
  if (!types) return 1;
  quoin::TerrainOptions options;
  options.seed = 7;
  options.size = {8, 2, 8};
  const auto grid = quoin::generate_terrain(options, *types);
  if (!grid) {
    std::fprintf(stderr, "%s\n", quoin::to_string(grid.error()).c_str());
    return 1;
  }
  const quoin::IBox box = grid->bounds();
  int deepest = 0;
  quoin::GridReader reader(*grid);
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int x = box.min.x; x < box.max.x; ++x) {
      int depth = 0;
      for (int y = box.min.y; y < box.max.y; ++y) depth += reader.get({x, y, z}) == types->water;
      deepest = std::max(deepest, depth);
    }
  }
  std::printf("%lld voxels in %zu bytes; the water is up to %d voxels deep\n",
              static_cast<long long>(grid->voxel_count()), grid->bytes(), deepest);
  return deepest > 0 ? 0 : 1;
}
