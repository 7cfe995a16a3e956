// Meshes smooth terrain with coarser far chunks as one closed mesh with occlusion. Writes smooth_terrain.glb.

#include <algorithm>
#include <cstdio>

#include <quoin/io/mesh_file.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/terrain/terrain.h>

namespace {

int fail(const quoin::Error& error) {
  std::fprintf(stderr, "%s\n", quoin::to_string(error).c_str());
  return 1;
}

}  // namespace

int main() {
  quoin::VoxelRegistry registry;
  const auto types = quoin::add_terrain_types(registry);
  if (!types) return fail(types.error());
  quoin::SmoothTerrainOptions terrain;
  terrain.seed = 7;
  terrain.size = {5, 2, 5};
  const auto field = quoin::generate_smooth_terrain(terrain, *types);
  if (!field) return fail(field.error());

  // Cells of one sample in the chunks at a corner; the cell size doubles with every further ring.
  quoin::SmoothMeshOptions options;
  options.level_of = [](quoin::IVec3 chunk) {
    return std::clamp(std::max(chunk.x, chunk.z) - 1, 0, quoin::kMaxSmoothLevel);
  };
  auto mesh = quoin::build_smooth_mesh(*field, registry, options);
  if (!mesh) return fail(mesh.error());
  quoin::SceneMeshes meshes;
  meshes.parts = {{"terrain", {quoin::view_of(*mesh)}}};
  meshes.placements = {{}};
  const auto bytes = quoin::write_mesh(meshes, "smooth_terrain.glb");
  if (!bytes) return fail(bytes.error());
  std::printf("%zu vertices, %zu triangles: smooth_terrain.glb, %llu bytes\n", mesh->positions.size(),
              mesh->indices.size() / 3, static_cast<unsigned long long>(*bytes));
  return mesh->indices.empty() ? 1 : 0;
}
