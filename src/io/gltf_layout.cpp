#include "io/gltf_layout.h"

#include <set>

namespace quoin {

namespace {

void measure(const GltfMesh& mesh, GltfPrimitive& primitive) {
  const auto& positions = primitive.triangles->positions;
  primitive.min = primitive.max = position_in_mesh(mesh, positions.front());
  for (const Vec3& position : positions) {
    const Vec3 p = position_in_mesh(mesh, position);
    primitive.min = glm::min(primitive.min, p);
    primitive.max = glm::max(primitive.max, p);
  }
}

GltfPrimitive lay_out_primitive(const GltfMesh& mesh, const SurfacePart& part, bool occlusion, std::uint64_t& end) {
  GltfPrimitive primitive;
  primitive.triangles = part.triangles;
  primitive.material = part.material;
  measure(mesh, primitive);
  const std::uint64_t vertices = primitive.vertex_count();
  primitive.wide_indices = needs_wide_indices(vertices);
  primitive.positions = reserve_view(vertices * 12, end);
  primitive.normals = reserve_view(vertices * 12, end);
  primitive.texture_coordinates = reserve_view(vertices * 8, end);
  if (occlusion) primitive.colours = reserve_view(vertices * 4, end);
  primitive.indices = reserve_view(part.triangles->indices.size() * (primitive.wide_indices ? 4 : 2), end);
  return primitive;
}

Status add_images(GltfLayout& layout) {
  std::vector<std::pair<const char*, PngImage>> images;
  images.emplace_back("palette", layout.palette.base_colour());
  images.emplace_back("palette metallic-roughness", layout.palette.metallic_roughness());
  if (layout.palette.has_emission()) images.emplace_back("palette emissive", layout.palette.emissive());
  for (auto& [name, image] : images) {
    auto png = encode_png(image);
    if (!png) return tl::unexpected<Error>(png.error());
    const GltfView view = reserve_view(png->size(), layout.buffer_bytes);
    layout.images.push_back({name, std::move(*png), view});
  }
  return {};
}

/// The grids and reflections that drawn instances ask for.
std::set<std::pair<GridHandle, bool>> wanted_meshes(const Scene& scene, const SceneMeshes& meshes) {
  std::set<std::pair<GridHandle, bool>> wanted;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, meshes.hidden)) wanted.emplace(instance.grid, instance.mirrored);
  }
  return wanted;
}

}  // namespace

Result<GltfLayout> lay_out_gltf(const Scene& scene, const SceneMeshes& meshes) {
  GltfLayout layout{.palette = MaterialPalette(scene.types, meshes),
                    .meshes = {},
                    .mesh_of = {},
                    .images = {},
                    .parts = {},
                    .occlusion = meshes.occlusion};
  const auto wanted = wanted_meshes(scene, meshes);
  layout.parts.reserve(wanted.size());
  for (const auto& [grid, mirrored] : wanted) {
    const BlockyMesh* mesh = meshes.find(grid);
    if (mesh == nullptr) continue;
    const SurfaceParts& parts = layout.parts.emplace_back(*mesh, layout.palette);
    if (parts.parts().empty()) continue;
    const SceneGrid& source = scene.grids()[grid];
    GltfMesh entry{source.name + (mirrored ? " (mirrored)" : ""), source.pivot, mirrored, {}};
    for (const SurfacePart& part : parts.parts()) {
      entry.primitives.push_back(lay_out_primitive(entry, part, layout.occlusion, layout.buffer_bytes));
    }
    layout.mesh_of[{grid, mirrored}] = layout.meshes.size();
    layout.meshes.push_back(std::move(entry));
  }
  if (!layout.meshes.empty()) {
    if (auto added = add_images(layout); !added) return tl::unexpected<Error>(added.error());
  }
  return layout;
}

}  // namespace quoin
