// Edits a grid and meshes one of its chunks as merged quads.

#include <cstdio>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/blocky.h>

int main() {
  quoin::VoxelRegistry types;
  quoin::VoxelProperties stone;
  stone.name = "stone";
  stone.colour = {128, 128, 132, 255};
  const auto added = types.add(stone);
  if (!added) return 1;

  quoin::Grid grid;
  grid.fill_box({{0, 0, 0}, {32, 4, 32}}, *added);
  grid.fill_sphere({16.0, 8.0, 16.0}, 5.0, *added);

  quoin::BlockyMesher mesher;
  quoin::QuadBuffer quads;
  for (const quoin::IVec3 chunk : grid.chunks()) {
    mesher.mesh(grid.neighbourhood(chunk), types, {}, quads);
    std::printf("chunk %d %d %d: %lld faces in %zu quads\n", chunk.x, chunk.y, chunk.z,
                static_cast<long long>(quoin::face_count(quads)), quads.size());
  }
  return quads.empty() ? 1 : 0;
}
