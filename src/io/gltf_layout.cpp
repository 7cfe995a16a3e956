#include "io/gltf_layout.h"

#include <limits>
#include <set>

namespace quoin {

namespace {

constexpr std::uint64_t kAlignment = 4;
/// 65,535 restarts a strip, so the largest 16-bit index is 65,534; one less for clients that count it among the
/// vertices.
constexpr std::uint64_t kShortIndexVertices = 65'535;

GltfView reserve(std::uint64_t bytes, std::uint64_t& end) {
  const GltfView view{end, bytes};
  end += (bytes + kAlignment - 1) / kAlignment * kAlignment;
  return view;
}

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
  primitive.wide_indices = vertices >= kShortIndexVertices;
  primitive.positions = reserve(vertices * 12, end);
  primitive.normals = reserve(vertices * 12, end);
  primitive.texture_coordinates = reserve(vertices * 8, end);
  if (occlusion) primitive.colours = reserve(vertices * 4, end);
  primitive.indices = reserve(part.triangles->indices.size() * (primitive.wide_indices ? 4 : 2), end);
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
    const GltfView view = reserve(png->size(), layout.buffer_bytes);
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

Result<std::uint64_t> glb_file_bytes(std::uint64_t json_bytes, std::uint64_t buffer_bytes) {
  constexpr std::uint64_t kHeaderBytes = 12;
  constexpr std::uint64_t kChunkHeaderBytes = 8;
  std::uint64_t total = kHeaderBytes + kChunkHeaderBytes + json_bytes;
  if (buffer_bytes > 0) total += kChunkHeaderBytes + buffer_bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::LimitExceeded,
                "the meshes take " + std::to_string(total) + " bytes, and a GLB holds 4294967295 at most");
  }
  return total;
}

}  // namespace quoin
