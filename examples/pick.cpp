// Picks the voxel under the cursor, traces packets of sixteen rays, and updates the traversal structure after an edit.

#include <cstdio>
#include <limits>
#include <optional>

#include <quoin/grid/grid.h>
#include <quoin/scene/camera.h>
#include <quoin/trace/packet.h>

namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

// Counts the pixels of a 4x4 block that see a voxel.
int count_hits(const quoin::OccupancyTree& tree, const quoin::Camera& camera) {
  quoin::RayPacket rays;
  for (int lane = 0; lane < quoin::RayPacket::kSize; ++lane) {
    const int column = 158 + lane % 4;
    const int row = 118 + lane / 4;
    rays.set(lane, quoin::ray_through(camera, {column + 0.5, row + 0.5, 320, 240}), kEndless);
  }
  quoin::PacketHits hits;
  quoin::first_hits(tree, rays, hits);
  int count = 0;
  for (int lane = 0; lane < quoin::RayPacket::kSize; ++lane) count += static_cast<int>(hits.hit >> lane & 1U);
  return count;
}

// Prints the voxel in the middle of a 320x240 image.
std::optional<quoin::RayHit> look(const quoin::OccupancyTree& tree, const quoin::Camera& camera) {
  const quoin::Ray ray = quoin::ray_through(camera, {160.5, 120.5, 320, 240});
  const auto hit = quoin::first_hit(tree, ray);
  if (hit) std::printf("voxel %d %d %d, %.2f away\n", hit->voxel.x, hit->voxel.y, hit->voxel.z, hit->t);
  return hit;
}

}  // namespace

int main() {
  quoin::VoxelRegistry types;
  quoin::VoxelProperties properties;
  properties.name = "stone";
  const auto stone = types.add(properties);
  const auto camera = quoin::look_at({40, 60, 40}, {0, 0, 0}, 0.8);
  if (!stone || !camera) return 1;
  quoin::Grid grid;
  grid.fill_sphere({0, 0, 0}, 20.0, *stone);
  quoin::ChangeCursor followed = grid.cursor();
  auto tree = quoin::OccupancyTree::build(grid, types);

  const auto before = look(tree, *camera);
  if (!before) return 1;
  grid.set(before->voxel, quoin::kAir);
  // The same changes list the chunks to mesh again.
  tree.update(grid, types, grid.changes_since(followed));
  const auto after = look(tree, *camera);
  std::printf("%d of 16 rays hit\n", count_hits(tree, *camera));
  return after && after->t > before->t ? 0 : 1;
}
