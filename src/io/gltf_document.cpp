#include "io/gltf_document.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/placement.h"

namespace quoin {

namespace {

using Json = nlohmann::ordered_json;

// glTF 2.0's numbers for what it borrows from OpenGL.
constexpr int kUnsignedByte = 5121;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kNearest = 9728;
constexpr int kClampToEdge = 33071;

constexpr const char* kEmissiveStrength = "KHR_materials_emissive_strength";

/// Collects buffer views and accessors, which refer to each other by number.
struct Arrays {
  Json views = Json::array();
  Json accessors = Json::array();

  std::size_t add_view(const GltfView& view, int target) {
    Json entry = {{"buffer", 0}, {"byteOffset", view.offset}, {"byteLength", view.bytes}};
    if (target != 0) entry["target"] = target;
    views.push_back(std::move(entry));
    return views.size() - 1;
  }

  std::size_t add(const GltfView& view, int target, int component, const char* type, std::uint64_t count) {
    accessors.push_back(
        {{"bufferView", add_view(view, target)}, {"componentType", component}, {"count", count}, {"type", type}});
    return accessors.size() - 1;
  }
};

Json json_from(const Vec3& v) {
  return {v.x, v.y, v.z};
}

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
  // Adding zero turns -0 into 0.
  const DVec3 position = instance.position + 0.0;
  if (position != DVec3(0.0)) node["translation"] = {position.x, position.y, position.z};
  const DQuat q = glm::normalize(instance.rotation);
  if (q != DQuat(1, 0, 0, 0)) node["rotation"] = {q.x + 0.0, q.y + 0.0, q.z + 0.0, q.w + 0.0};
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

Json scene_json(const Json& nodes) {
  Json entry = Json::object();
  if (!nodes.empty()) {
    entry["nodes"] = Json::array();
    for (std::size_t i = 0; i < nodes.size(); ++i) entry["nodes"].push_back(i);
  }
  return Json::array({std::move(entry)});
}

void add_meshes(const GltfLayout& layout, std::string_view buffer_uri, Json& document) {
  Arrays arrays;
  document["meshes"] = meshes_json(layout, arrays);
  document["materials"] = materials_json(layout.palette);
  add_textures(layout, arrays, document);
  document["accessors"] = std::move(arrays.accessors);
  document["bufferViews"] = std::move(arrays.views);
  Json buffer = Json::object();
  if (!buffer_uri.empty()) buffer["uri"] = buffer_uri;
  buffer["byteLength"] = layout.buffer_bytes;
  document["buffers"] = Json::array({std::move(buffer)});
}

}  // namespace

Result<std::string> gltf_json(const Scene& scene, const SceneMeshes& meshes, const GltfLayout& layout,
                              std::string_view buffer_uri) {
  if (auto sound = check_placements(scene, meshes.hidden); !sound) return tl::unexpected<Error>(sound.error());
  Json nodes = nodes_json(scene, meshes, layout);
  Json document;
  document["asset"] = {{"version", "2.0"}, {"generator", "Quoin " QUOIN_VERSION}};
  if (layout.palette.has_emission()) document["extensionsUsed"] = {kEmissiveStrength};
  document["scene"] = 0;
  document["scenes"] = scene_json(nodes);
  if (!nodes.empty()) document["nodes"] = std::move(nodes);
  if (!layout.meshes.empty()) add_meshes(layout, buffer_uri, document);
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string percent_encoded(std::string_view name) {
  constexpr std::string_view unreserved = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : name) {
    if (unreserved.find(c) != std::string_view::npos) {
      encoded += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    encoded += '%';
    encoded += digits[byte >> 4];
    encoded += digits[byte & 15];
  }
  return encoded;
}

}  // namespace quoin
