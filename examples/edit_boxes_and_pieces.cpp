// Copies a box of voxels, rotated and mirrored; finds pieces that come loose when voxels are removed; and writes
// triangles in the caller's own vertex layout.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <quoin/grid/connected.h>
#include <quoin/grid/copy_box.h>
#include <quoin/grid/grid.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/vertex_writer.h>

namespace {

using quoin::AxisOrientation;

// The vertex layout of this program's graphics card.
struct Vertex {
  quoin::Vec3 position;
  std::array<std::uint8_t, 4> colour;
  std::array<std::int8_t, 4> normal;
  std::uint8_t brightness;
};

std::size_t write_mesh(const quoin::Grid& grid, const quoin::VoxelRegistry& types) {
  using quoin::VertexAttribute;
  using quoin::VertexFormat;
  const quoin::VertexLayout layout = {
      sizeof(Vertex),
      {{VertexAttribute::Position, VertexFormat::Float32x3, offsetof(Vertex, position)},
       {VertexAttribute::Colour, VertexFormat::Unorm8x4Srgb, offsetof(Vertex, colour)},
       {VertexAttribute::Normal, VertexFormat::Snorm8x4, offsetof(Vertex, normal)},
       {VertexAttribute::Brightness, VertexFormat::Unorm8, offsetof(Vertex, brightness)}}};
  const quoin::VertexWriter writer(layout, types);
  quoin::BlockyMesher mesher;
  quoin::QuadBuffer quads;
  std::vector<std::byte> vertices;     // or mapped device memory of the sizes that are requested here
  std::vector<std::uint32_t> indices;  // per chunk, counted from 0
  std::size_t triangles = 0;
  for (const quoin::IVec3 chunk : grid.chunks()) {
    mesher.mesh(grid.neighbourhood(chunk), types, {}, quads);
    vertices.resize(writer.bytes_needed(quoin::vertices_needed(quads.size())));
    indices.resize(quoin::indices_needed(quads.size()));
    writer.write(quads, quoin::Vec3(chunk * quoin::kChunkEdge), vertices);
    quoin::write_indices<std::uint32_t>(quads, 0, indices);
    triangles += indices.size() / 3;
  }
  return triangles;
}

}  // namespace

int main() {
  quoin::VoxelRegistry types;
  quoin::VoxelProperties stone;
  stone.colour = {128, 128, 132, 255};
  const auto type = types.add(stone);
  if (!type) return 1;

  // Half an arch; its mirror image next to it; then a copy of both, rotated by 90 degrees about y.
  quoin::Grid world;
  world.fill_box({{-60, 0, -60}, {61, 2, 61}}, *type);
  world.fill_box({{0, 2, 0}, {4, 21, 4}}, *type);
  world.fill_box({{0, 21, 0}, {10, 24, 4}}, *type);
  quoin::CopyOptions solid_only;
  solid_only.copy_air = false;
  const quoin::IBox half{{0, 2, 0}, {10, 24, 4}};
  quoin::copy_box(world, half, world, {10, 2, 0}, AxisOrientation::mirror(0), solid_only);
  const quoin::IBox arch{{0, 2, 0}, {20, 24, 4}};
  quoin::copy_box(world, arch, world, {30, 2, 30}, AxisOrientation::quarter_turns(1, 1), solid_only);

  // Removes one foot of an arch, then the other: the arch falls.
  quoin::ConnectedPieces pieces;
  const quoin::IBox ground{{-60, 0, -60}, {61, 1, 61}};
  std::size_t loose = 0;
  for (const double x : {2.0, 18.0}) {
    world.fill_sphere({x, 5.0, 2.0}, 4.0, quoin::kAir);
    pieces.update(world);
    loose = 0;
    for (const std::size_t piece : pieces.not_touching(ground)) {
      const quoin::Grid body = pieces.extract(piece);  // a separate grid for a falling instance
      std::printf("%lld voxels come loose\n", static_cast<long long>(body.voxel_count()));
      pieces.remove_from(world, piece);
      ++loose;
    }
  }
  const std::size_t triangles = write_mesh(world, types);
  std::printf("%zu piece fell, %zu triangles of %zu bytes per vertex\n", loose, triangles, sizeof(Vertex));
  return loose == 1 && triangles > 0 ? 0 : 1;
}
