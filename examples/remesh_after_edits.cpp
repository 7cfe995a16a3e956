// A game loop: edits the world, then meshes only the chunks whose mesh may have changed.

#include <cstdio>
#include <map>
#include <tuple>

#include <quoin/grid/grid.h>
#include <quoin/mesh/blocky.h>

namespace {

using ChunkKey = std::tuple<int, int, int>;

// The caller's meshes, keyed by chunk.
class MeshCache {
 public:
  int update(const quoin::Grid& grid, const quoin::VoxelRegistry& types) {
    const quoin::GridChanges changes = grid.changes_since(followed_);
    if (changes.all) quads_.clear();
    int meshed = 0;
    for (const quoin::IVec3 chunk : quoin::chunks_to_mesh(grid, changes)) {
      const ChunkKey key{chunk.x, chunk.y, chunk.z};
      if (grid.find_chunk(chunk) == nullptr) {
        quads_.erase(key);
        continue;
      }
      mesher_.mesh(grid.neighbourhood(chunk), types, {}, quads_[key]);
      ++meshed;
    }
    return meshed;
  }

 private:
  quoin::BlockyMesher mesher_;
  quoin::ChangeCursor followed_;  // position in the grid's journal
  std::map<ChunkKey, quoin::QuadBuffer> quads_;
};

}  // namespace

int main() {
  quoin::VoxelRegistry types;
  quoin::VoxelProperties soil;
  soil.name = "soil";
  soil.colour = {121, 88, 58, 255};
  const auto type = types.add(soil);
  if (!type) return 1;

  quoin::Grid world;
  world.fill_box({{-128, -64, -128}, {128, 21, 128}}, *type);
  MeshCache meshes;
  const int all = meshes.update(world, types);

  world.set({10, 20, 10}, quoin::kAir);  // in the middle of a chunk's top
  const int one = meshes.update(world, types);

  world.fill_sphere({0.0, 20.0, 0.0}, 9.0, quoin::kAir);  // a crater where four columns of chunks meet
  const int crater = meshes.update(world, types);
  std::printf("meshed %d chunks at first, %d after a voxel, %d after a crater\n", all, one, crater);
  return all == 32 && one == 1 && crater == 4 ? 0 : 1;
}
