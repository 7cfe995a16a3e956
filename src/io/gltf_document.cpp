#include "io/gltf_document.h"

#include <algorithm>

#include "io/gltf_arrays.h"
#include "io/placement.h"

namespace quoin {

namespace {

using namespace gltf;

constexpr int kNearest = 9728;
constexpr int kClampToEdge = 33071;

constexpr const char* kEmissiveStrength = "KHR_materials_emissive_strength";

Json primitive_json(const GltfPrimitive& primitive, Arrays& arrays) {
  const std::uint64_t vertices = primitive.vertex_count();
  Json attributes;
  attributes["POSITION"] = arrays.add(primitive.positions, kArrayBuffer, kFloat, "VEC3", vertices);
  arrays.accessors.back()["min"] = json_from(primitive.min);
  arrays.accessors.back()["max"] = json_from(primitive.max);
  attributes["NORMAL"] = arrays.add(primitive.normals, kArrayBuffer, kFloat, "VEC3", vertices);
  attributes["TEXCOORD_0"] = arrays.add(primitive.texture_coordinates, kArrayBuffer, kFloat, "VEC2", vertices);
  if (primitive.colours.bytes > 0) {
    attributes["COLOR_0"] = arrays.add(primitive.colours, kArrayBuffer, kUnsignedByte, "VEC4", vertices);
    arrays.accessors.back()["normalized"] = true;
  }
  const std::size_t indices =
      arrays.add(primitive.indices, kElementArrayBuffer, primitive.wide_indices ? kUnsignedInt : kUnsignedShort,
                 "SCALAR", primitive.triangles->indices.size());
  return {{"attributes", std::move(attributes)}, {"indices", indices}, {"material", primitive.material}};
}

Json meshes_json(const GltfLayout& layout, Arrays& arrays) {
  Json meshes = Json::array();
  for (const GltfMesh& mesh : layout.meshes) {
    Json primitives = Json::array();
    for (const GltfPrimitive& primitive : mesh.primitives) primitives.push_back(primitive_json(primitive, arrays));
    Json entry = Json::object();
    if (!mesh.name.empty()) entry["name"] = mesh.name;
    entry["primitives"] = std::move(primitives);
    meshes.push_back(std::move(entry));
  }
  return meshes;
}

/// The factor goes up to 1, the extension beyond it, so that clients without the extension get weak lights right.
void add_emission(const SurfaceMaterial& material, Json& entry) {
  const float factor = std::min(material.emission, 1.0F);
  entry["emissiveTexture"] = {{"index", 2}};
  entry["emissiveFactor"] = {factor, factor, factor};
  entry["extensions"][kEmissiveStrength] = {{"emissiveStrength", std::max(material.emission, 1.0F)}};
}

Json materials_json(const MaterialPalette& palette) {
  Json materials = Json::array();
  for (const SurfaceMaterial& material : palette.materials()) {
    Json entry = {{"name", material.name}};
    entry["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", 0}}},
                                     {"metallicFactor", 1.0},
                                     {"roughnessFactor", 1.0},
                                     {"metallicRoughnessTexture", {{"index", 1}}}};
    if (material.is_emissive()) add_emission(material, entry);
    if (material.is_transparent()) entry["alphaMode"] = "BLEND";
    materials.push_back(std::move(entry));
  }
  return materials;
}

void add_textures(const GltfLayout& layout, Arrays& arrays, Json& document) {
  document["samplers"] = Json::array(
      {{{"magFilter", kNearest}, {"minFilter", kNearest}, {"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}}});
  Json images = Json::array();
  Json textures = Json::array();
  for (const GltfImage& image : layout.images) {
    textures.push_back({{"sampler", 0}, {"source", images.size()}});
    images.push_back({{"name", image.name}, {"mimeType", "image/png"}, {"bufferView", arrays.add_view(image.view, 0)}});
  }
  document["textures"] = std::move(textures);
  document["images"] = std::move(images);
}

Json node_json(const Instance& instance, const SceneGrid& grid, const GltfLayout& layout) {
  Json node = Json::object();
  const std::string& name = instance.name.empty() ? grid.name : instance.name;
  if (!name.empty()) node["name"] = name;
  const auto mesh = layout.mesh_of.find({instance.grid, instance.mirrored});
  if (mesh != layout.mesh_of.end()) node["mesh"] = mesh->second;
  if (instance.position != DVec3(0.0)) node["translation"] = json_from(instance.position);
  const DQuat q = glm::normalize(instance.rotation);
  if (q != DQuat(1, 0, 0, 0)) node["rotation"] = json_from(q);
  const double size = instance.voxel_size;
  if (size != 1.0) node["scale"] = {size, size, size};
  if (mesh == layout.mesh_of.end()) node["extras"] = {{"voxels", 0}};
  return node;
}

Json nodes_json(const Scene& scene, const SceneMeshes& meshes, const GltfLayout& layout) {
  Json nodes = Json::array();
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, meshes.hidden))
      nodes.push_back(node_json(instance, scene.grids()[instance.grid], layout));
  }
  return nodes;
}

void add_meshes(const GltfLayout& layout, std::string_view buffer_uri, Json& document) {
  Arrays arrays;
  document["meshes"] = meshes_json(layout, arrays);
  document["materials"] = materials_json(layout.palette);
  add_textures(layout, arrays, document);
  add_buffer(std::move(arrays), layout.buffer_bytes, buffer_uri, document);
}

}  // namespace

Result<std::string> gltf_json(const Scene& scene, const SceneMeshes& meshes, const GltfLayout& layout,
                              std::string_view buffer_uri) {
  if (auto sound = check_placements(scene, meshes.hidden); !sound) return tl::unexpected<Error>(sound.error());
  std::vector<const char*> extensions;
  if (layout.palette.has_emission()) extensions.push_back(kEmissiveStrength);
  Json document = document_of(nodes_json(scene, meshes, layout), extensions);
  if (!layout.meshes.empty()) add_meshes(layout, buffer_uri, document);
  return text_of(document);
}

}  // namespace quoin
