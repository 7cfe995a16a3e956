#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include <quoin/core/assert.h>
#include <quoin/version.h>

#include "io/gltf/gltf_layout.h"

namespace quoin {

namespace {

using Json = nlohmann::ordered_json;

// OpenGL constants used by glTF 2.0.
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kNearest = 9728;
constexpr int kLinear = 9729;
constexpr int kNearestLinearMipmaps = 9986;
constexpr int kRepeat = 10497;
constexpr int kClampToEdge = 33071;

constexpr const char* kEmissiveStrength = "KHR_materials_emissive_strength";
constexpr const char* kCompression = "EXT_meshopt_compression";
constexpr const char* kQuantization = "KHR_mesh_quantization";
constexpr const char* kLights = "KHR_lights_punctual";
constexpr const char* kIor = "KHR_materials_ior";
constexpr const char* kTransmission = "KHR_materials_transmission";
constexpr const char* kUnlit = "KHR_materials_unlit";
constexpr const char* kVolume = "KHR_materials_volume";

Json json_from(const Vec3& v) {
  return {v.x, v.y, v.z};
}
/// Adding zero turns -0 into 0.
Json json_from(const DVec3& v) {
  return {v.x + 0.0, v.y + 0.0, v.z + 0.0};
}
/// In glTF order: x, y, z, w.
Json json_from(const DQuat& q) {
  return {q.x + 0.0, q.y + 0.0, q.z + 0.0, q.w + 0.0};
}

const char* type_name(int components) {
  QUOIN_ASSERT(components >= 1 && components <= 4, "1 to 4 components");
  constexpr std::array<const char*, 4> names = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  return names[static_cast<std::size_t>(components - 1)];
}

std::uint32_t tight_stride(const GltfArray& array) {
  const bool is_byte = array.component == GltfComponent::Byte || array.component == GltfComponent::UnsignedByte;
  const bool is_short = array.component == GltfComponent::Short || array.component == GltfComponent::UnsignedShort;
  return static_cast<std::uint32_t>(array.components) * (is_byte ? 1 : is_short ? 2 : 4);
}

/// Collects buffer views and accessors, which refer to each other by number.
struct Arrays {
  Json views = Json::array();
  Json accessors = Json::array();
  bool is_compressed = false;

  std::size_t add_view(const GltfView& view) {
    views.push_back({{"buffer", 0}, {"byteOffset", view.offset}, {"byteLength", view.bytes}});
    return views.size() - 1;
  }

  /// Adds floats in a buffer view of their own. Returns the accessor's number.
  std::size_t add_floats(const GltfView& view, std::uint64_t count, int components) {
    accessors.push_back({{"bufferView", add_view(view)},
                         {"componentType", static_cast<int>(GltfComponent::Float)},
                         {"count", count},
                         {"type", type_name(components)}});
    return accessors.size() - 1;
  }

  /// Adds a view and an accessor for all of it. Returns the accessor's number.
  std::size_t add(const GltfArray& array) {
    const bool is_index = array.kind == GltfArrayKind::Index;
    add_view(array.view);
    Json& view = views.back();
    if (!is_index && array.stride != tight_stride(array)) view["byteStride"] = array.stride;
    view["target"] = is_index ? kElementArrayBuffer : kArrayBuffer;
    if (is_compressed) {
      view["buffer"] = 1;
      view["extensions"][kCompression] = {{"buffer", 0},
                                          {"byteOffset", array.packed_view.offset},
                                          {"byteLength", array.packed_view.bytes},
                                          {"byteStride", array.stride},
                                          {"count", array.count()},
                                          {"mode", is_index ? "TRIANGLES" : "ATTRIBUTES"}};
    }
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", static_cast<int>(array.component)},
                         {"count", array.count()},
                         {"type", type_name(array.components)}});
    return accessors.size() - 1;
  }
};

/// Empty of indices.
const char* attribute_name(const GltfPrimitive& primitive, GltfArrayKind kind) {
  switch (kind) {
    case GltfArrayKind::Position:
      return "POSITION";
    case GltfArrayKind::Normal:
      return "NORMAL";
    case GltfArrayKind::AtlasCoordinate:
    case GltfArrayKind::FaceCoordinate:
      return "TEXCOORD_0";
    case GltfArrayKind::PaletteCoordinate:
      return primitive.view.atlas.empty() ? "TEXCOORD_0" : "TEXCOORD_1";
    case GltfArrayKind::Colour:
      return "COLOR_0";
    case GltfArrayKind::Occlusion:
      return "_AO";
    case GltfArrayKind::Materials:
      return "_MATERIALS_0";
    case GltfArrayKind::Weights:
      return "_WEIGHTS_0";
    case GltfArrayKind::Index:
      break;
  }
  return "";
}

Json primitive_json(const GltfPrimitive& primitive, Arrays& arrays) {
  Json attributes;
  std::size_t indices = 0;
  for (const GltfArray& array : primitive.arrays) {
    const std::size_t number = arrays.add(array);
    Json& accessor = arrays.accessors.back();
    if (array.normalized) accessor["normalized"] = true;
    if (array.kind == GltfArrayKind::Index) {
      indices = number;
      continue;
    }
    if (array.kind == GltfArrayKind::Position) {
      accessor["min"] = json_from(primitive.min);
      accessor["max"] = json_from(primitive.max);
    }
    attributes[attribute_name(primitive, array.kind)] = number;
  }
  return {{"attributes", std::move(attributes)}, {"indices", indices}, {"material", primitive.material}};
}

bool has_materials(const GltfPrimitive& primitive) {
  return std::ranges::find(primitive.arrays, GltfArrayKind::Materials, &GltfArray::kind) != primitive.arrays.end();
}

/// In glTF order: column by column.
Json json_from(const glm::dmat4& matrix) {
  Json numbers = Json::array();
  for (int i = 0; i < 16; ++i) numbers.push_back(matrix[i / 4][i % 4] + 0.0);
  return numbers;
}

Json meshes_json(const GltfLayout& layout, Arrays& arrays) {
  Json meshes = Json::array();
  for (const GltfMesh& mesh : layout.meshes) {
    Json primitives = Json::array();
    for (const GltfPrimitive& primitive : mesh.primitives) primitives.push_back(primitive_json(primitive, arrays));
    Json entry = Json::object();
    if (!mesh.name.empty()) entry["name"] = mesh.name;
    entry["primitives"] = std::move(primitives);
    if (std::ranges::any_of(mesh.primitives, has_materials)) {
      entry["extras"]["voxels_from_mesh"] = json_from(mesh.transform.part_from_position());
    }
    meshes.push_back(std::move(entry));
  }
  return meshes;
}

/// The emissive factor is at most 1 and the extension multiplies it, so clients without the extension still show weak
/// lights correctly.
void add_emission(const GltfLayout& layout, const SurfaceMaterial& material, Json& entry) {
  QUOIN_ASSERT(layout.texture(GltfImageKind::Emissive).has_value(), "an image for emission");
  const float factor = std::min(material.emission, 1.0F);
  entry["emissiveTexture"] = {{"index", *layout.texture(GltfImageKind::Emissive)}};
  entry["emissiveFactor"] = {factor, factor, factor};
  entry["extensions"][kEmissiveStrength] = {{"emissiveStrength", std::max(material.emission, 1.0F)}};
}

/// Adds the glass extensions to the texel's alpha, from GlassMaterial. Thickness is in mesh units, distance in world
/// units.
void add_glass(const SurfaceMaterial& material, const VoxelProperties& properties, Json& entry) {
  const GlassMaterial& glass = material.glass;
  entry["alphaMode"] = "BLEND";
  Json& extensions = entry["extensions"];
  extensions[kTransmission] = {{"transmissionFactor", glass.transmission}};
  extensions[kVolume] = {{"thicknessFactor", glass.thickness},
                         {"attenuationDistance", glass.thickness * material.unit},
                         {"attenuationColor", json_from(glass.attenuation)}};
  if (const auto ior = glass_ior(properties)) extensions[kIor] = {{"ior", *ior}};
}

/// Returns a material that shows its colours directly, without lighting properties.
Json unlit_json(const std::string& name, bool transparent, std::optional<std::size_t> texture) {
  Json entry = {{"name", name}, {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}};
  if (texture) entry["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", *texture}};
  if (transparent) entry["alphaMode"] = "BLEND";
  entry["extensions"][kUnlit] = Json::object();
  return entry;
}

/// Returns a material for smooth surfaces, whose colours are in the vertices.
Json smooth_json(const SurfaceMaterial& material, const MaterialPalette& palette) {
  Json entry = {
      {"name", material.name},
      {"pbrMetallicRoughness", {{"metallicFactor", material.metalness}, {"roughnessFactor", material.roughness}}}};
  if (material.is_emissive()) {
    entry["emissiveFactor"] = json_from(material.emission_colour * std::min(material.emission, 1.0F));
    entry["extensions"][kEmissiveStrength] = {{"emissiveStrength", std::max(material.emission, 1.0F)}};
  }
  if (material.is_transparent() && material.type != kAir) {
    add_glass(material, palette.types()[material.type], entry);
  } else if (material.is_transparent()) {
    entry["alphaMode"] = "BLEND";
  }
  return entry;
}

/// Returns a material of textured faces. Its emission has the colours of the texture.
Json textured_json(const SurfaceMaterial& material, const GltfLayout& layout) {
  const bool has_texture = material.texture.has_value();  // else a tint only
  QUOIN_ASSERT(!has_texture || layout.texture(GltfImageKind::Face).has_value(), "images of faces");
  Json texture;
  if (has_texture) texture = {{"index", *layout.texture(GltfImageKind::Face) + *material.texture}};
  Json entry = layout.is_unlit ? unlit_json(material.name, false, std::nullopt) : Json{{"name", material.name}};
  Json& surface = entry["pbrMetallicRoughness"];
  if (has_texture) surface["baseColorTexture"] = texture;
  if (material.tint != Vec3(1.0F)) {
    surface["baseColorFactor"] = {material.tint.x, material.tint.y, material.tint.z, 1.0F};
  }
  if (!layout.is_unlit) {
    surface["metallicFactor"] = material.metalness;
    surface["roughnessFactor"] = material.roughness;
    if (material.is_emissive()) {
      if (has_texture) entry["emissiveTexture"] = texture;
      entry["emissiveFactor"] = json_from(material.tint * std::min(material.emission, 1.0F));
      entry["extensions"][kEmissiveStrength] = {{"emissiveStrength", std::max(material.emission, 1.0F)}};
    }
  }
  if (material.alpha == FaceAlpha::Translucent) entry["alphaMode"] = "BLEND";
  if (material.alpha == FaceAlpha::Cutout) {
    entry["alphaMode"] = "MASK";
    // Between two bytes, so that rounding decides for no texel.
    static_assert(kCutoutAlpha == 128, "the first byte above half");
    entry["alphaCutoff"] = 0.5;
    entry["doubleSided"] = true;
  }
  return entry;
}

Json materials_json(const GltfLayout& layout) {
  Json materials = Json::array();
  for (const SurfaceMaterial& material : layout.palette.materials()) {
    if (layout.is_unlit) {
      materials.push_back(unlit_json(material.name, material.is_transparent(), layout.texture(GltfImageKind::Palette)));
      continue;
    }
    Json entry = {{"name", material.name}};
    const auto atlas = material.surface == SurfaceClass::Opaque ? layout.texture(GltfImageKind::Atlas) : std::nullopt;
    QUOIN_ASSERT(layout.texture(GltfImageKind::MetallicRoughness).has_value(), "an image for roughness");
    Json roughness = {{"index", *layout.texture(GltfImageKind::MetallicRoughness)}};
    if (atlas) roughness["texCoord"] = 1;
    entry["pbrMetallicRoughness"] = {
        {"baseColorTexture", {{"index", atlas ? *atlas : *layout.texture(GltfImageKind::Palette)}}},
        {"metallicFactor", 1.0},
        {"roughnessFactor", 1.0},
        {"metallicRoughnessTexture", std::move(roughness)}};
    if (material.is_emissive()) add_emission(layout, material, entry);
    if (material.is_transparent()) add_glass(material, layout.palette.types()[material.type], entry);
    materials.push_back(std::move(entry));
  }
  for (const SurfaceMaterial& material : layout.palette.smooth_materials()) {
    materials.push_back(layout.is_unlit ? unlit_json(material.name, material.is_transparent(), std::nullopt)
                                        : smooth_json(material, layout.palette));
  }
  for (const SurfaceMaterial& material : layout.palette.textured_materials()) {
    materials.push_back(textured_json(material, layout));
  }
  return materials;
}

void add_textures(const GltfLayout& layout, Arrays& arrays, Json& document) {
  const auto sampler = [](int filter, int far_filter, int wrap) {
    return Json{{"magFilter", filter}, {"minFilter", far_filter}, {"wrapS", wrap}, {"wrapT", wrap}};
  };
  // Linear filtering interpolates between the corners of voxels, never across patches. Textures of faces repeat, except
  // in an atlas.
  const int wrap_of_faces = layout.palette.has_face_atlas() ? kClampToEdge : kRepeat;
  const std::array<std::pair<GltfImageKind, Json>, 4> samplers = {
      {{GltfImageKind::Palette, sampler(kNearest, kNearest, kClampToEdge)},
       {GltfImageKind::Atlas, sampler(kLinear, kLinear, kClampToEdge)},
       {GltfImageKind::Face, sampler(kNearest, kNearestLinearMipmaps, wrap_of_faces)},
       {GltfImageKind::Field, sampler(kNearest, kNearestLinearMipmaps, kRepeat)}}};
  const auto kind_of = [](GltfImageKind kind) {
    const bool is_own = kind == GltfImageKind::Atlas || kind == GltfImageKind::Face || kind == GltfImageKind::Field;
    return is_own ? kind : GltfImageKind::Palette;
  };
  document["samplers"] = Json::array();
  std::map<GltfImageKind, std::size_t> number_of;
  for (const auto& [kind, sampler_of_kind] : samplers) {
    const bool is_default = kind == GltfImageKind::Palette &&
                            kind_of(layout.images.front().kind) != GltfImageKind::Face &&
                            kind_of(layout.images.front().kind) != GltfImageKind::Field;
    const auto has_kind = [&](const GltfImage& image) { return kind_of(image.kind) == kind; };
    if (!is_default && std::ranges::none_of(layout.images, has_kind)) continue;
    number_of[kind] = document["samplers"].size();
    document["samplers"].push_back(sampler_of_kind);
  }
  Json images = Json::array();
  Json textures = Json::array();
  for (const GltfImage& image : layout.images) {
    textures.push_back({{"sampler", number_of.at(kind_of(image.kind))}, {"source", images.size()}});
    images.push_back({{"name", image.name}, {"mimeType", "image/png"}, {"bufferView", arrays.add_view(image.view)}});
  }
  document["textures"] = std::move(textures);
  document["images"] = std::move(images);
}

/// Returns the materials of smooth vertices, for clients that show their textures: docs/formats/meshes.md.
Json field_materials_json(const GltfLayout& layout) {
  Json materials = Json::array();
  for (const VoxelType number : layout.field_types) {
    const VoxelProperties& type = layout.palette.types()[number];
    Json& entry = materials.emplace_back(Json{{"type", number}, {"name", type.name}});
    if (type.faces.empty()) {
      entry["color"] = json_from(linear_colour(type.colour));
      continue;
    }
    Json faces = Json::array();
    for (const Direction direction : kDirections) {
      const VoxelFace& face = type.faces[direction];
      const auto texture = std::ranges::find(layout.field_textures, face.texture) - layout.field_textures.begin();
      QUOIN_ASSERT(texture < std::ssize(layout.field_textures), "a texture of the file");
      Json& each = faces.emplace_back(Json{{"texture", *layout.texture(GltfImageKind::Field) + texture}});
      if (face.turn != 0) each["turn"] = face.turn;
      if (face.mirrored) each["mirrored"] = true;
      if (const Vec3 tint = linear_colour(face.tint); tint != Vec3(1.0F)) each["tint"] = json_from(tint);
    }
    entry["faces"] = std::move(faces);
    entry["voxels"] = type.field_textures.voxels;
    entry["flat_degrees"] = type.field_textures.flat_degrees;
    entry["steep_degrees"] = type.field_textures.steep_degrees;
  }
  return materials;
}

Json node_json(const GltfNode& node) {
  Json entry = Json::object();
  if (!node.name.empty()) entry["name"] = node.name;
  if (node.mesh) entry["mesh"] = *node.mesh;
  const GltfTransform& transform = node.transform;
  if (transform.translation != DVec3(0.0)) entry["translation"] = json_from(transform.translation);
  if (transform.rotation != DQuat(1, 0, 0, 0)) entry["rotation"] = json_from(transform.rotation);
  if (transform.scale != DVec3(1.0)) entry["scale"] = json_from(transform.scale);
  if (!node.children.empty()) entry["children"] = node.children;
  if (!node.mesh && !node.is_group) entry["extras"]["voxels"] = 0;
  if (!node.layer.empty()) entry["extras"]["layer"] = node.layer;
  return entry;
}

/// Returns a node that looks or shines along its -Z. `right` and `up` need not be unit vectors.
Json node_along(const std::string& name, const DVec3& position, const glm::dmat3& axes) {
  Json entry = Json::object();
  if (!name.empty()) entry["name"] = name;
  if (position != DVec3(0.0)) entry["translation"] = json_from(position);
  const DQuat rotation = glm::normalize(glm::quat_cast(axes));
  if (rotation != DQuat(1, 0, 0, 0)) entry["rotation"] = json_from(rotation);
  return entry;
}

/// Returns any axes with -Z along `direction`. Requires: `direction` is not 0.
glm::dmat3 axes_along(const DVec3& direction) {
  QUOIN_ASSERT(direction != DVec3(0.0), "direction is not 0");
  const DVec3 back = -glm::normalize(direction);
  const DVec3 aside = std::abs(back.y) < 0.9 ? DVec3(0, 1, 0) : DVec3(1, 0, 0);
  const DVec3 right = glm::normalize(glm::cross(aside, back));
  return {right, glm::cross(back, right), back};
}

/// A white surface facing a lamp of 1 candela at distance 1 reflects 1 / pi.
Json lamp_json(const Lamp& lamp) {
  const float most = std::max({lamp.colour.r, lamp.colour.g, lamp.colour.b});
  QUOIN_ASSERT(most > 0.0F && lamp.intensity > 0.0, "a lamp that gives light");
  const bool is_spot = lamp.kind == Lamp::Kind::Spot;
  Json entry = Json::object();
  if (!lamp.name.empty()) entry["name"] = lamp.name;
  entry["type"] = is_spot ? "spot" : "point";
  entry["color"] = json_from(glm::max(lamp.colour, Vec3(0.0F)) / most);
  entry["intensity"] = lamp.intensity * double{most} * std::numbers::pi;
  if (std::isfinite(lamp.range)) entry["range"] = lamp.range;
  if (!is_spot) return entry;
  constexpr double kLeast = 1e-4;
  const double outer = std::clamp(lamp.outer_angle_radians, kLeast, std::numbers::pi / 2.0);
  const double inner = std::clamp(lamp.inner_angle_radians, 0.0, outer - kLeast / 2.0);
  entry["spot"] = {{"innerConeAngle", inner}, {"outerConeAngle", outer}};
  return entry;
}

Json camera_json(const MeshCamera& each) {
  // Clients clip everything nearer, and with parallel projection also everything farther.
  constexpr double kNear = 0.01;
  constexpr double kFar = 1e6;
  const Camera& camera = each.camera;
  Json entry = Json::object();
  if (!each.name.empty()) entry["name"] = each.name;
  if (camera.projection == Camera::Projection::Perspective) {
    entry["type"] = "perspective";
    entry["perspective"] = {{"yfov", camera.vertical_fov_radians}, {"znear", kNear}};
  } else {
    const double half = camera.view_height / 2.0;
    entry["type"] = "orthographic";
    entry["orthographic"] = {{"xmag", half}, {"ymag", half}, {"znear", 0.0}, {"zfar", kFar}};
  }
  return entry;
}

void add_lights(const GltfLayout& layout, Json& nodes, Json& numbers, Json& document) {
  for (std::size_t i = 0; i < layout.lamps.size(); ++i) {
    const Lamp& lamp = layout.lamps[i];
    const bool is_spot = lamp.kind == Lamp::Kind::Spot;
    Json node = node_along(lamp.name, lamp.position, is_spot ? axes_along(lamp.direction) : glm::dmat3(1.0));
    node["extensions"][kLights] = {{"light", i}};
    document["extensions"][kLights]["lights"].push_back(lamp_json(lamp));
    numbers.push_back(nodes.size());
    nodes.push_back(std::move(node));
  }
  for (std::size_t i = 0; i < layout.cameras.size(); ++i) {
    const Camera& camera = layout.cameras[i].camera;
    Json node = node_along(layout.cameras[i].name, camera.position, {camera.right, camera.up, -camera.forward});
    node["camera"] = i;
    document["cameras"].push_back(camera_json(layout.cameras[i]));
    numbers.push_back(nodes.size());
    nodes.push_back(std::move(node));
  }
}

void add_nodes(const GltfLayout& layout, Json& document) {
  Json nodes = Json::array();
  Json numbers = Json::array();
  for (const GltfNode& node : layout.nodes) {
    if (node.is_at_top) numbers.push_back(nodes.size());
    nodes.push_back(node_json(node));
  }
  add_lights(layout, nodes, numbers, document);
  Json scene = Json::object();
  document["scene"] = 0;
  if (!nodes.empty()) scene["nodes"] = std::move(numbers);
  document["scenes"] = Json::array({std::move(scene)});
  if (!nodes.empty()) document["nodes"] = std::move(nodes);
}

const char* name_of(GltfChannel::Path path) {
  constexpr std::array<const char*, 3> names = {"translation", "rotation", "scale"};
  return names[static_cast<std::size_t>(path)];
}

/// Returns one animation without interpolation.
void add_animation(const GltfLayout& layout, Arrays& arrays, Json& document) {
  if (layout.channels.empty()) return;
  Json channels = Json::array();
  Json samplers = Json::array();
  for (const GltfChannel& channel : layout.channels) {
    const auto count = static_cast<std::uint64_t>(channel.seconds.size());
    QUOIN_ASSERT(!channel.seconds.empty(), "at least one time");
    const std::size_t times = arrays.add_floats(channel.seconds_view, count, 1);
    arrays.accessors.back()["min"] = Json::array({channel.seconds.front()});
    arrays.accessors.back()["max"] = Json::array({channel.seconds.back()});
    const int components = channel.path == GltfChannel::Path::Rotation ? 4 : 3;
    QUOIN_ASSERT(channel.values.size() == static_cast<std::size_t>(components) * channel.seconds.size(),
                 "a value for each time");
    const std::size_t values = arrays.add_floats(channel.values_view, count, components);
    channels.push_back(
        {{"sampler", samplers.size()}, {"target", {{"node", channel.node}, {"path", name_of(channel.path)}}}});
    samplers.push_back({{"input", times}, {"interpolation", "STEP"}, {"output", values}});
  }
  document["animations"] =
      Json::array({{{"name", "frames"}, {"channels", std::move(channels)}, {"samplers", std::move(samplers)}}});
}

void add_meshes(const GltfLayout& layout, std::string_view buffer_uri, Json& document) {
  Arrays arrays;
  arrays.is_compressed = layout.is_compressed();
  document["meshes"] = meshes_json(layout, arrays);
  document["materials"] = materials_json(layout);
  if (!layout.images.empty()) add_textures(layout, arrays, document);
  add_animation(layout, arrays, document);
  document["accessors"] = std::move(arrays.accessors);
  document["bufferViews"] = std::move(arrays.views);
  Json buffer = Json::object();
  if (!buffer_uri.empty()) buffer["uri"] = buffer_uri;
  buffer["byteLength"] = layout.buffer_bytes;
  document["buffers"] = Json::array({std::move(buffer)});
  if (!layout.is_compressed()) return;
  document["buffers"].push_back(
      {{"byteLength", layout.decoded_bytes}, {"extensions", {{kCompression, {{"fallback", true}}}}}});
}

void add_extensions(const GltfLayout& layout, Json& document) {
  const MaterialPalette& palette = layout.palette;
  Json used = Json::array();
  if (layout.is_unlit) used.push_back(kUnlit);
  bool has_emission = false;
  bool has_ior = false;
  bool has_glass = false;
  for (const auto* const materials :
       {&palette.materials(), &palette.smooth_materials(), &palette.textured_materials()}) {
    for (const SurfaceMaterial& material : *materials) {
      const bool is_glass = material.is_transparent() && material.type != kAir;
      has_emission |= !layout.is_unlit && material.is_emissive();
      has_glass |= !layout.is_unlit && is_glass;
      has_ior |= !layout.is_unlit && is_glass && glass_ior(palette.types()[material.type]).has_value();
    }
  }
  if (has_emission) used.push_back(kEmissiveStrength);
  if (!layout.lamps.empty()) used.push_back(kLights);
  if (has_glass) used.insert(used.end(), {kTransmission, kVolume});
  if (has_ior) used.push_back(kIor);
  Json required = Json::array();
  const auto is_quantized = [](const GltfMesh& mesh) {
    QUOIN_ASSERT(!mesh.primitives.empty(), "a mesh with triangles");
    const auto& arrays = mesh.primitives.front().arrays;
    return std::ranges::any_of(arrays, [](const GltfArray& array) {
      return array.kind == GltfArrayKind::Normal && array.component != GltfComponent::Float;
    });
  };
  if (std::ranges::any_of(layout.meshes, is_quantized)) required.push_back(kQuantization);
  if (layout.is_compressed()) required.push_back(kCompression);
  used.insert(used.end(), required.begin(), required.end());
  if (!used.empty()) document["extensionsUsed"] = std::move(used);
  if (!required.empty()) document["extensionsRequired"] = std::move(required);
}

}  // namespace

std::string gltf_json(const GltfLayout& layout, std::string_view buffer_uri) {
  Json document;
  document["asset"] = {{"version", "2.0"}, {"generator", "Quoin " + std::string(version())}};
  add_extensions(layout, document);
  add_nodes(layout, document);
  if (!layout.meshes.empty()) add_meshes(layout, buffer_uri, document);
  if (!layout.field_types.empty()) document["extras"]["field_materials"] = field_materials_json(layout);
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace quoin
