// Converts triangles to voxels, to a smooth field that is edited, and to a file for 3D printing.

#include <cmath>
#include <cstdio>
#include <numbers>

#include <quoin/quoin.h>

namespace {
// Makes a ring. To load a file instead, use read_mesh, or load_scene, which does all of the steps below.
quoin::TriangleMesh make_ring() {
  constexpr std::uint32_t kAround = 96;
  constexpr std::uint32_t kAcross = 32;
  quoin::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < kAround * kAcross; ++i) {
    const std::uint32_t around = i / kAcross;
    const double a = 2.0 * std::numbers::pi * around / kAround;
    const double b = 2.0 * std::numbers::pi * (i % kAcross) / kAcross;
    mesh.positions.emplace_back((3.0 + std::cos(b)) * std::cos(a), std::sin(b), -(3.0 + std::cos(b)) * std::sin(a));
    mesh.colours.emplace_back(0.5 + 0.5 * std::cos(a), 0.3, 0.5 + 0.5 * std::sin(b), 1.0F);
    const std::uint32_t on = (i + kAcross) % (kAround * kAcross);
    const auto next = [](std::uint32_t k) { return k - k % kAcross + (k + 1) % kAcross; };
    mesh.triangles.push_back({i, on, next(on)});
    mesh.triangles.push_back({i, next(on), next(i)});
  }
  return mesh;
}

quoin::Status run(const char* output) {
  const quoin::TriangleMesh ring = make_ring();
  const auto lattice = quoin::lattice_of_size(ring, 128);
  if (!lattice) return lattice.error();
  quoin::Scene scene;
  auto voxels = quoin::voxelize(ring, {.lattice = *lattice}, scene.types);
  if (!voxels) return voxels.error();
  auto field = quoin::distance_field(ring, {.lattice = *lattice}, scene.types);
  if (!field) return field.error();
  const std::int64_t bite = field->field.remove_sphere({112.0, 16.0, 64.0}, 20.0, 4.0);
  std::printf("a bite out of the field changed %lld samples\n", static_cast<long long>(bite));
  // For printing: every edge between two triangles, 0.5 mm per voxel, +Z up.
  auto surface = quoin::closed_surface(voxels->grid);
  if (!surface) return surface.error();
  quoin::BlockyMesh blocks;
  blocks.surfaces[0] = std::move(*surface);
  quoin::SceneMeshes meshes;
  meshes.types = scene.types;
  meshes.parts.push_back(quoin::mesh_part("ring", std::move(blocks)));
  meshes.placements.push_back({.part = 0, .name = "ring"});
  const auto written = quoin::write_mesh(meshes, output, {.scale = 0.5, .up = quoin::UpAxis::Z});
  if (!written) return written.error();
  std::printf("%s: %d open edges\n", output, static_cast<int>(quoin::count_open_edges(meshes)));
  return {};
}

}  // namespace
int main(int argc, char** argv) {
  const quoin::Status done = run(argc > 1 ? argv[1] : "ring.3mf");
  if (!done) std::fprintf(stderr, "%s\n", quoin::to_string(done.error()).c_str());
  return done ? 0 : 1;
}
