// Meshes smooth terrain with coarser far chunks as one closed mesh with occlusion. Grass, earth, stone, sand and snow
// have textures, which blend by the weights of vertices. Writes smooth_terrain.glb.

#include <algorithm>
#include <cstdint>
#include <cstdio>

#include <quoin/io/mesh_file.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/terrain/terrain.h>

namespace {

int fail(const quoin::Error& error) {
  std::fprintf(stderr, "%s\n", quoin::to_string(error).c_str());
  return 1;
}

// Gives a type a speckled texture of its colour, 8 voxels wide. Programs usually read images from files.
quoin::Status add_texture(quoin::VoxelType type, quoin::VoxelRegistry& registry) {
  quoin::VoxelProperties properties = registry[type];
  const quoin::Rgba8 colour = properties.colour;
  quoin::AlphaImage image{16, 16, {}};
  for (int i = 0; i < 16 * 16; ++i) {
    const int shade = 160 + (i * i * 31 + i * 17) % 96;
    for (const int channel : {colour.r, colour.g, colour.b}) {
      image.rgba.push_back(static_cast<std::uint8_t>(channel * shade / 255));
    }
    image.rgba.push_back(255);
  }
  const auto texture = quoin::Texture::from_image(properties.name, image);
  if (!texture) return texture.error();
  properties.faces = *texture;
  properties.field_textures.voxels = 8.0F;
  registry.replace(type, properties);
  return {};
}

}  // namespace

int main() {
  quoin::VoxelRegistry registry;
  const auto types = quoin::add_terrain_types(registry);
  if (!types) return fail(types.error());
  for (const quoin::VoxelType type : {types->grass, types->earth, types->stone, types->sand, types->snow}) {
    if (const quoin::Status done = add_texture(type, registry); !done) return fail(done.error());
  }
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
  options.materials = true;
  auto mesh = quoin::build_smooth_mesh(*field, registry, options);
  if (!mesh) return fail(mesh.error());
  quoin::align_materials(*mesh);
  quoin::SceneMeshes meshes;
  meshes.types = registry;
  meshes.parts = {{"terrain", {quoin::view_of(*mesh)}}};
  meshes.placements = {{}};
  const auto bytes = quoin::write_mesh(meshes, "smooth_terrain.glb");
  if (!bytes) return fail(bytes.error());
  std::printf("%zu vertices, %zu triangles: smooth_terrain.glb, %llu bytes\n", mesh->positions.size(),
              mesh->indices.size() / 3, static_cast<unsigned long long>(*bytes));
  return mesh->indices.empty() ? 1 : 0;
}
