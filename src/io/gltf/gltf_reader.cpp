// glTF 2.0, by tinygltf. Source: Khronos, "glTF 2.0 Specification"; KHR_texture_transform,
// KHR_materials_emissive_strength.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <new>
#include <string>
#include <string_view>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/srgb.h"
#include "io/format_driver.h"
#include "io/gltf/gltf_decoders.h"
#include "io/gltf/gltf_layout.h"
#include "io/triangles/triangles.h"

#ifdef QUOIN_HAVE_TINYGLTF
#include <nlohmann/json.hpp>
#include <tiny_gltf.h>
#endif

namespace quoin::triangles {

namespace {

bool is_gltf(std::span<const std::byte> beginning) {
  const std::string_view text = text_of(beginning);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || text[first] != '{') return false;
  const auto has = [&](std::string_view key) { return text.find(key) != std::string_view::npos; };
  return has("\"asset\"") || (has("\"accessors\"") && has("\"bufferViews\"")) ||
         (has("\"nodes\"") && has("\"meshes\""));
}

#ifdef QUOIN_HAVE_TINYGLTF

constexpr FormatCapability kReading = FormatCapability::Read;

constexpr int kMaxDepth = 128;  // of brackets: tinygltf parses recursively

/// The data for tinygltf's callbacks, and the bytes of the images by number.
struct Asked {
  SidecarReader* sidecars = nullptr;
  std::vector<std::vector<std::byte>> images{};
};

// GltfReader finds images in buffer views: tinygltf passes them on without checking the end of the buffer.
bool keep_image(tinygltf::Image* image, const int index, std::string*, std::string*, int, int,
                const unsigned char* bytes, int size, void* user) {
  auto& images = static_cast<Asked*>(user)->images;
  if (image->bufferView >= 0 || index < 0 || size < 0) return true;
  if (images.size() <= static_cast<std::size_t>(index)) images.resize(static_cast<std::size_t>(index) + 1);
  const auto* const first = reinterpret_cast<const std::byte*>(bytes);
  images[static_cast<std::size_t>(index)].assign(first, first + size);
  return true;
}

bool is_there(const std::string&, void*) {
  return true;  // reading reports the reason
}

std::string as_it_is(const std::string& path, void*) {
  return path;
}

bool read_beside(std::vector<unsigned char>* out, std::string* error, const std::string& path, void* user) {
  const std::string_view name = path.starts_with("./") ? std::string_view(path).substr(2) : std::string_view(path);
  const auto bytes = static_cast<Asked*>(user)->sidecars->read(std::string(name));
  if (!bytes) {
    if (error != nullptr) *error += bytes.error().message;
    return false;
  }
  const auto* const first = reinterpret_cast<const unsigned char*>(bytes->data());
  out->assign(first, first + bytes->size());
  return true;
}

bool write_nothing(std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
  return false;
}

std::string first_line(const std::string& text) {
  const std::size_t first = text.find_first_not_of("\n ");
  if (first == std::string::npos) return "the file cannot be parsed";
  return text.substr(first, text.find('\n', first) - first);
}

/// Returns an entry of a list, or null.
template <class T>
const T* entry(const std::vector<T>& list, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < list.size() ? &list[static_cast<std::size_t>(index)] : nullptr;
}

/// Reads numbers of an accessor by element and component: integers as they are, or normalized.
class Accessor {
 public:
  /// Opens an accessor. Errors: BadFormat if it extends past the end of its buffer.
  static Result<Accessor> open(const tinygltf::Model& model, int index, int components) {
    const tinygltf::Accessor* const of = entry(model.accessors, index);
    if (of == nullptr) return make_error(ErrorCode::BadFormat, "an accessor does not exist");
    Accessor made;
    made.components_ = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(of->type));
    if (made.components_ < components) return make_error(ErrorCode::BadFormat, "an accessor has the wrong type");
    made.is_normalized_ = of->normalized;
    made.count_ = of->count;
    const std::size_t size = made.count_ * static_cast<std::size_t>(made.components_);
    if (made.count_ > kMost || size > kMost) {
      return make_error(ErrorCode::BadFormat,
                        "accessor " + std::to_string(index) + " claims " + std::to_string(of->count) + " elements");
    }
    if (of->bufferView >= 0) {
      if (Status done =
              made.view_.open(model, of->bufferView, of->byteOffset, of->componentType, made.components_, made.count_);
          !done) {
        return make_error(ErrorCode::BadFormat, "accessor " + std::to_string(index) + ": " + done.error().message);
      }
    }
    if (of->sparse.isSparse) {
      if (Status done = made.open_sparse(model, *of); !done) return done.error();
    } else if (of->bufferView < 0 && made.count_ > 0) {
      return make_error(ErrorCode::BadFormat, "accessor " + std::to_string(index) + " has no values");
    }
    return made;
  }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] int components() const { return components_; }
  [[nodiscard]] double at(std::size_t element, int component) const {
    if (!replaced_.empty()) {
      const auto found = std::lower_bound(replaced_.begin(), replaced_.end(), element);
      if (found != replaced_.end() && *found == element) {
        return values_.at(static_cast<std::size_t>(found - replaced_.begin()), component, is_normalized_);
      }
    }
    return view_.at(element, component, is_normalized_);
  }

 private:
  // Above three times the maximum number of triangles.
  static constexpr std::size_t kMost = std::size_t{1} << 30;

  /// Reads elements within a buffer; without a buffer, zeros.
  class View {
   public:
    Status open(const tinygltf::Model& model, int view, std::size_t offset, int type, int components,
                std::size_t count) {
      const tinygltf::BufferView* const of = entry(model.bufferViews, view);
      const tinygltf::Buffer* const buffer = of != nullptr ? entry(model.buffers, of->buffer) : nullptr;
      if (buffer == nullptr) return make_error(ErrorCode::BadFormat, "a buffer view does not exist");
      type_ = type;
      const int size = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(type));
      if (size <= 0) return make_error(ErrorCode::BadFormat, "unknown component type");
      component_ = static_cast<std::size_t>(size);
      const std::size_t element = component_ * static_cast<std::size_t>(components);
      stride_ = of->byteStride != 0 ? of->byteStride : element;
      const std::size_t total = buffer->data.size();
      const bool fits = of->byteOffset <= total && of->byteLength <= total - of->byteOffset &&
                        offset <= of->byteLength && stride_ >= element && stride_ <= 65'536 &&
                        (count == 0 || (element <= of->byteLength - offset &&
                                        (count - 1) <= (of->byteLength - offset - element) / stride_));
      if (!fits) return make_error(ErrorCode::BadFormat, "it extends past its buffer");
      data_ = buffer->data.data() + of->byteOffset + offset;
      return {};
    }
    [[nodiscard]] double at(std::size_t element, int component, bool is_share) const {
      if (data_ == nullptr) return 0.0;
      const unsigned char* from = data_ + element * stride_ + static_cast<std::size_t>(component) * component_;
      switch (type_) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
          return number<std::int8_t>(from, is_share);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
          return number<std::uint8_t>(from, is_share);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
          return number<std::int16_t>(from, is_share);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
          return number<std::uint16_t>(from, is_share);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
          return number<std::uint32_t>(from, is_share);
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
          return number<float>(from, false);
        case TINYGLTF_COMPONENT_TYPE_DOUBLE:
          return number<double>(from, false);
        default:
          return 0.0;
      }
    }

   private:
    template <class T>
    static double number(const unsigned char* from, bool is_share) {
      T value;
      std::memcpy(&value, from, sizeof(T));
      const auto whole = static_cast<double>(value);
      return is_share ? std::max(whole / static_cast<double>(std::numeric_limits<T>::max()), -1.0) : whole;
    }
    const unsigned char* data_ = nullptr;
    std::size_t stride_ = 0;
    std::size_t component_ = 0;
    int type_ = 0;
  };

  Status open_sparse(const tinygltf::Model& model, const tinygltf::Accessor& of) {
    const auto& sparse = of.sparse;
    if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > count_) {
      return make_error(ErrorCode::BadFormat, "a sparse accessor replaces more elements than it has");
    }
    const auto count = static_cast<std::size_t>(sparse.count);
    View places;
    const auto offset = [](int bytes) { return static_cast<std::size_t>(std::max(bytes, 0)); };
    if (Status done = places.open(model, sparse.indices.bufferView, offset(sparse.indices.byteOffset),
                                  sparse.indices.componentType, 1, count);
        !done) {
      return done;
    }
    for (std::size_t i = 0; i < count; ++i) replaced_.push_back(static_cast<std::size_t>(places.at(i, 0, false)));
    if (!std::is_sorted(replaced_.begin(), replaced_.end())) {
      return make_error(ErrorCode::BadFormat, "the indices of a sparse accessor are not in ascending order");
    }
    return values_.open(model, sparse.values.bufferView, offset(sparse.values.byteOffset), of.componentType,
                        components_, count);
  }

  std::size_t count_ = 0;
  int components_ = 0;
  bool is_normalized_ = false;
  View view_;
  std::vector<std::size_t> replaced_;  // of sparse accessors
  View values_;
};

glm::dmat4 matrix_of(const tinygltf::Node& node) {
  glm::dmat4 matrix(1.0);
  if (node.matrix.size() == 16) {
    for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
    return matrix;
  }
  DQuat rotation(1.0, 0.0, 0.0, 0.0);
  if (node.rotation.size() == 4) {
    rotation = {node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]};
  }
  DVec3 scale(1.0);
  if (node.scale.size() == 3) scale = {node.scale[0], node.scale[1], node.scale[2]};
  matrix = glm::mat4_cast(rotation);
  for (int axis = 0; axis < 3; ++axis) matrix[axis] *= scale[axis];
  if (node.translation.size() == 3) {
    matrix[3] = glm::dvec4(node.translation[0], node.translation[1], node.translation[2], 1.0);
  }
  return matrix;
}

double number_in(const tinygltf::Value& object, const char* key, double otherwise) {
  if (!object.IsObject() || !object.Has(key) || !object.Get(key).IsNumber()) return otherwise;
  return object.Get(key).GetNumberAsDouble();
}

/// Returns an index; -1, or one that is too large for any list, if the number is out of range.
int index_in(const tinygltf::Value& object, const char* key, int otherwise) {
  return static_cast<int>(std::clamp(number_in(object, key, otherwise), -1.0, 1e9));
}

glm::vec2 pair_in(const tinygltf::Value& object, const char* key, glm::vec2 otherwise) {
  if (!object.IsObject() || !object.Has(key) || !object.Get(key).IsArray() || object.Get(key).ArrayLen() < 2)
    return otherwise;
  const tinygltf::Value& list = object.Get(key);
  if (!list.Get(0).IsNumber() || !list.Get(1).IsNumber()) return otherwise;
  return {static_cast<float>(list.Get(0).GetNumberAsDouble()), static_cast<float>(list.Get(1).GetNumberAsDouble())};
}

/// KHR_texture_transform.
struct PlaceTransform {
  int set = 0;  // TEXCOORD_...
  glm::vec2 offset{0.0F};
  glm::vec2 scale{1.0F};
  float rotation = 0.0F;

  [[nodiscard]] glm::vec2 of(glm::vec2 place) const {
    const glm::vec2 p = place * scale;
    const float c = std::cos(rotation);
    const float s = std::sin(rotation);
    return offset + glm::vec2(c * p.x + s * p.y, c * p.y - s * p.x);
  }
};

class GltfReader {
 public:
  GltfReader(const tinygltf::Model& model, const Asked& asked) : model_(model), asked_(asked) {}

  Result<LoadedMesh> read() {
    if (Status done = check_extensions(); !done) return done.error();
    take_materials();
    if (Status done = take_scene(); !done) return done.error();
    finish();
    return std::move(loaded_);
  }

 private:
  Status check_extensions() {
    constexpr std::string_view kKnown[] = {"KHR_mesh_quantization", "KHR_texture_transform",
                                           "KHR_materials_unlit",   "KHR_materials_emissive_strength",
                                           "KHR_lights_punctual",   "EXT_texture_webp"};
    for (const std::string& name : model_.extensionsRequired) {
      if (name == "EXT_meshopt_compression" && has_meshopt()) continue;
      if (name == "KHR_draco_mesh_compression") continue;  // decode_draco refuses it without Draco
      const bool is_look = name.starts_with("KHR_materials_");
      if (is_look || std::find(std::begin(kKnown), std::end(kKnown), name) != std::end(kKnown)) continue;
      return make_error(ErrorCode::Unsupported, "unsupported required glTF extension " + name);
    }
    return {};
  }
  void take_materials() {
    for (const tinygltf::Material& from : model_.materials) take_material(from);
    no_material_ = loaded_.mesh.materials.size();
    loaded_.mesh.materials.emplace_back();
    places_.emplace_back();
    glow_places_.emplace_back();
  }
  void take_material(const tinygltf::Material& from) {
    const auto& pbr = from.pbrMetallicRoughness;
    MeshMaterial material;
    material.name = from.name;
    if (pbr.baseColorFactor.size() == 4) {
      for (int i = 0; i < 4; ++i) {
        material.colour[i] = static_cast<float>(std::clamp(pbr.baseColorFactor[static_cast<std::size_t>(i)], 0.0, 1.0));
      }
    }
    material.roughness = static_cast<float>(pbr.roughnessFactor);
    material.metalness = static_cast<float>(pbr.metallicFactor);
    // Metallic-roughness textures are not read: their factors alone would make everything a mirror.
    if (pbr.metallicRoughnessTexture.index >= 0) {
      material.roughness = 1.0F;
      material.metalness = 0.0F;
    }
    material.alpha_mode = from.alphaMode == "MASK"    ? AlphaMode::Mask
                          : from.alphaMode == "BLEND" ? AlphaMode::Blend
                                                      : AlphaMode::Opaque;
    material.alpha_cutoff = static_cast<float>(from.alphaCutoff);
    PlaceTransform place;
    if (pbr.baseColorTexture.index >= 0) {
      place = place_of(pbr.baseColorTexture);
      material.texture = texture_of(pbr.baseColorTexture.index);
    }
    const auto specular = from.extensions.find("KHR_materials_pbrSpecularGlossiness");
    if (specular != from.extensions.end()) take_specular(specular->second, material, place);
    glow_places_.push_back(take_emission(from, material));
    loaded_.mesh.materials.push_back(std::move(material));
    places_.push_back(place);
  }
  /// Takes the diffuse colour and texture and the glossiness in place of metallic-roughness. Voxel types have no
  /// specular colour.
  void take_specular(const tinygltf::Value& from, MeshMaterial& material, PlaceTransform& place) {
    material.colour = glm::vec4(1.0F);
    if (from.Has("diffuseFactor") && from.Get("diffuseFactor").IsArray()) {
      const tinygltf::Value& factor = from.Get("diffuseFactor");
      for (int i = 0; i < static_cast<int>(std::min<std::size_t>(factor.ArrayLen(), 4)); ++i) {
        if (!factor.Get(i).IsNumber()) continue;
        material.colour[i] = static_cast<float>(std::clamp(factor.Get(i).GetNumberAsDouble(), 0.0, 1.0));
      }
    }
    material.metalness = 0.0F;
    material.roughness = 1.0F;
    if (!from.Has("specularGlossinessTexture")) {
      material.roughness = static_cast<float>(1.0 - std::clamp(number_in(from, "glossinessFactor", 1.0), 0.0, 1.0));
    }
    material.texture.reset();
    if (!from.Has("diffuseTexture") || !from.Get("diffuseTexture").IsObject()) return;
    const tinygltf::TextureInfo info = info_of(from.Get("diffuseTexture"));
    place = place_of(info);
    material.texture = texture_of(info.index);
  }
  static tinygltf::TextureInfo info_of(const tinygltf::Value& from) {
    tinygltf::TextureInfo info;
    info.index = index_in(from, "index", -1);
    info.texCoord = index_in(from, "texCoord", 0);
    if (from.Has("extensions") && from.Get("extensions").Has("KHR_texture_transform")) {
      info.extensions["KHR_texture_transform"] = from.Get("extensions").Get("KHR_texture_transform");
    }
    return info;
  }
  /// Takes the emissive factor and texture. Returns the texture's transform.
  PlaceTransform take_emission(const tinygltf::Material& from, MeshMaterial& material) {
    material.emission = emission_of(from);
    if (from.emissiveTexture.index < 0 || !(material.emission > 0.0F)) return {};
    // A texture that cannot be read has left a warning: with the factor alone everything would glow.
    material.emissive_texture = texture_of(from.emissiveTexture.index);
    if (!material.emissive_texture) {
      material.emission = 0.0F;
      return {};
    }
    const double most = *std::max_element(from.emissiveFactor.begin(), from.emissiveFactor.end());
    for (int i = 0; i < 3; ++i) {
      material.emissive_tint[i] = static_cast<float>(from.emissiveFactor[static_cast<std::size_t>(i)] / most);
    }
    return place_of(from.emissiveTexture);
  }
  static float emission_of(const tinygltf::Material& from) {
    double most = 0.0;
    for (const double channel : from.emissiveFactor) most = std::max(most, channel);
    const auto strength = from.extensions.find("KHR_materials_emissive_strength");
    if (strength != from.extensions.end()) most *= number_in(strength->second, "emissiveStrength", 1.0);
    return std::isfinite(most) ? static_cast<float>(most) : 0.0F;
  }
  static PlaceTransform place_of(const tinygltf::TextureInfo& info) {
    PlaceTransform place;
    place.set = info.texCoord;
    const auto found = info.extensions.find("KHR_texture_transform");
    if (found == info.extensions.end()) return place;
    place.offset = pair_in(found->second, "offset", place.offset);
    place.scale = pair_in(found->second, "scale", place.scale);
    place.rotation = static_cast<float>(number_in(found->second, "rotation", 0.0));
    place.set = static_cast<int>(std::clamp(number_in(found->second, "texCoord", place.set), 0.0, 99.0));
    return place;
  }
  static TextureWrap wrap_of(int wrap) {
    if (wrap == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return TextureWrap::Clamp;
    return wrap == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? TextureWrap::Mirror : TextureWrap::Repeat;
  }
  std::optional<std::size_t> texture_of(int index) {
    const tinygltf::Texture* const texture = entry(model_.textures, index);
    if (texture == nullptr) {
      loaded_.warnings.push_back("left out: texture " + std::to_string(index) + ", which does not exist");
      return std::nullopt;
    }
    const auto [known, is_new] = textures_.try_emplace(index);
    if (!is_new) return known->second;
    int source = texture->source;
    const auto webp = texture->extensions.find("EXT_texture_webp");
    if (webp != texture->extensions.end()) source = index_in(webp->second, "source", source);
    const tinygltf::Image* const image = entry(model_.images, source);
    const std::string name = image == nullptr      ? "texture " + std::to_string(index)
                             : !image->uri.empty() ? image->uri
                             : image->name.empty() ? "image " + std::to_string(source)
                                                   : image->name;
    const std::span<const std::byte> file_bytes =
        image == nullptr ? std::span<const std::byte>() : file_bytes_of(*image, static_cast<std::size_t>(source));
    if (file_bytes.empty()) {
      loaded_.warnings.push_back("left out: the texture " + name + ", whose image does not exist");
      return std::nullopt;
    }
    known->second = add_texture(file_bytes, name, loaded_);
    const tinygltf::Sampler* const sampler = entry(model_.samplers, texture->sampler);
    if (known->second && sampler != nullptr) {
      MeshTexture& made = loaded_.mesh.textures[*known->second];
      made.wrap_u = wrap_of(sampler->wrapS);
      made.wrap_v = wrap_of(sampler->wrapT);
      made.is_smooth = sampler->magFilter != TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    return known->second;
  }

  /// Returns the file of an image; nullopt if it does not exist or extends past its buffer.
  [[nodiscard]] std::span<const std::byte> file_bytes_of(const tinygltf::Image& image, std::size_t index) const {
    if (image.bufferView < 0) {
      return index < asked_.images.size() ? asked_.images[index] : std::span<const std::byte>();
    }
    const tinygltf::BufferView* const view = entry(model_.bufferViews, image.bufferView);
    const tinygltf::Buffer* const buffer = view != nullptr ? entry(model_.buffers, view->buffer) : nullptr;
    if (buffer == nullptr) return {};
    const auto bytes = std::as_bytes(std::span(buffer->data));
    const bool fits = view->byteOffset <= bytes.size() && view->byteLength <= bytes.size() - view->byteOffset;
    return fits ? bytes.subspan(view->byteOffset, view->byteLength) : std::span<const std::byte>();
  }

  Status take_scene() {
    const tinygltf::Scene* const scene = entry(model_.scenes, std::max(model_.defaultScene, 0));
    std::vector<int> roots;
    if (scene != nullptr) roots = scene->nodes;
    if (scene == nullptr) {
      std::vector<bool> is_child(model_.nodes.size());
      for (const tinygltf::Node& node : model_.nodes) {
        for (const int child : node.children) {
          if (entry(model_.nodes, child) != nullptr) is_child[static_cast<std::size_t>(child)] = true;
        }
      }
      for (std::size_t i = 0; i < is_child.size(); ++i) {
        if (!is_child[i]) roots.push_back(static_cast<int>(i));
      }
    }
    seen_.resize(model_.nodes.size());
    struct Waiting {
      int node;
      glm::dmat4 world_from_parent;
    };
    std::vector<Waiting> waiting;
    waiting.reserve(roots.size());
    for (const int root : roots) waiting.push_back({root, glm::dmat4(1.0)});
    std::reverse(waiting.begin(), waiting.end());
    while (!waiting.empty()) {
      const Waiting at = waiting.back();
      waiting.pop_back();
      const tinygltf::Node* const node = entry(model_.nodes, at.node);
      if (node == nullptr)
        return make_error(ErrorCode::BadFormat, "node " + std::to_string(at.node) + " does not exist");
      // A node has one parent, so a second visit is a cycle or a duplicate.
      if (seen_[static_cast<std::size_t>(at.node)]) {
        return make_error(ErrorCode::BadFormat, "node " + std::to_string(at.node) + " has several parents");
      }
      seen_[static_cast<std::size_t>(at.node)] = true;
      const glm::dmat4 world_from_node = at.world_from_parent * matrix_of(*node);
      if (node->mesh >= 0) {
        if (Status done = take_mesh(node->mesh, world_from_node); !done) return done;
      }
      has_skins_ |= node->skin >= 0;
      for (auto child = node->children.rbegin(); child != node->children.rend(); ++child) {
        waiting.push_back({*child, world_from_node});
      }
    }
    return {};
  }
  Status take_mesh(int index, const glm::dmat4& world_from_mesh) {
    const tinygltf::Mesh* const mesh = entry(model_.meshes, index);
    if (mesh == nullptr) return make_error(ErrorCode::BadFormat, "mesh " + std::to_string(index) + " does not exist");
    for (const tinygltf::Primitive& primitive : mesh->primitives) {
      if (Status done = take_primitive(primitive, world_from_mesh); !done) {
        return make_error(done.error().code, "mesh " + std::to_string(index) + ": " + done.error().message);
      }
    }
    return {};
  }
  [[nodiscard]] static int attribute(const tinygltf::Primitive& primitive, const std::string& name) {
    const auto found = primitive.attributes.find(name);
    return found != primitive.attributes.end() ? found->second : -1;
  }

  Status take_primitive(const tinygltf::Primitive& primitive, const glm::dmat4& world_from_mesh) {
    const int mode = primitive.mode == -1 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES || mode > TINYGLTF_MODE_TRIANGLE_FAN) {
      has_others_ = true;
      return {};
    }
    const int position = attribute(primitive, "POSITION");
    if (position < 0) return {};
    const auto positions = Accessor::open(model_, position, 3);
    if (!positions) return positions.error();
    const std::size_t material = entry(model_.materials, primitive.material) != nullptr
                                     ? static_cast<std::size_t>(primitive.material)
                                     : no_material_;
    const std::size_t first = loaded_.mesh.positions.size();
    if (first + positions->count() > 3 * kMostTriangles)
      return make_error(ErrorCode::LimitExceeded, "too many vertices");
    for (std::size_t i = 0; i < positions->count(); ++i) {
      const glm::dvec4 p(positions->at(i, 0), positions->at(i, 1), positions->at(i, 2), 1.0);
      loaded_.mesh.positions.emplace_back(world_from_mesh * p);
    }
    if (Status done = take_colours(primitive, first, positions->count()); !done) return done;
    const MeshMaterial& look = loaded_.mesh.materials[material];
    const PlaceTransform& colour_place = places_[material];
    const PlaceTransform& glow_place = glow_places_[material];
    const auto places = uvs(primitive, look.texture.has_value(), colour_place, positions->count());
    if (!places) return places.error();
    const auto glows = uvs(primitive, look.emissive_texture.has_value(), glow_place, positions->count());
    if (!glows) return glows.error();
    has_textures_ |= places->has_value();
    has_glows_ |= glows->has_value();
    const auto place_at = [](const std::optional<Accessor>& at, const PlaceTransform& place, std::size_t vertex) {
      if (!at) return glm::vec2(0.0F);
      return place.of({static_cast<float>(at->at(vertex, 0)), static_cast<float>(at->at(vertex, 1))});
    };
    const bool is_mirrored = glm::determinant(glm::dmat3(world_from_mesh)) < 0.0;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) -> Status {
      if (is_mirrored) std::swap(b, c);
      const auto added = is_known(a, b, c, positions->count()) ? builder_.add(first + a, first + b, first + c)
                                                               : builder_.add(kNowhere, kNowhere, kNowhere);
      if (!added) return added.error();
      if (!*added) return {};
      loaded_.mesh.material_of.push_back(static_cast<std::uint32_t>(material));
      for (const std::size_t vertex : {a, b, c}) {
        loaded_.mesh.uvs.push_back(place_at(*places, colour_place, vertex));
        loaded_.mesh.emissive_uvs.push_back(place_at(*glows, glow_place, vertex));
      }
      return {};
    };
    if (primitive.indices < 0) {
      return add_all(
          mode, positions->count(), [](std::size_t i) { return i; }, add);
    }
    const auto indices = Accessor::open(model_, primitive.indices, 1);
    if (!indices) return indices.error();
    return add_all(
        mode, indices->count(),
        [&](std::size_t i) { return static_cast<std::size_t>(std::max(indices->at(i, 0), 0.0)); }, add);
  }
  /// Returns the texture coordinates of the vertices; nullopt without a texture or coordinates.
  Result<std::optional<Accessor>> uvs(const tinygltf::Primitive& primitive, bool has_texture,
                                      const PlaceTransform& transform, std::size_t vertices) const {
    const int place = attribute(primitive, "TEXCOORD_" + std::to_string(transform.set));
    if (!has_texture || place < 0) return std::optional<Accessor>();
    auto opened = Accessor::open(model_, place, 2);
    if (!opened) return opened.error();
    if (opened->count() < vertices) {
      return make_error(ErrorCode::BadFormat, "fewer texture coordinates than vertices");
    }
    return std::optional(std::move(*opened));
  }
  static bool is_known(std::size_t a, std::size_t b, std::size_t c, std::size_t count) {
    return a < count && b < count && c < count;
  }
  template <class At, class Add>
  static Status add_all(int mode, std::size_t count, const At& at, const Add& add) {
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      for (std::size_t i = 0; i + 2 < count; i += 3) {
        if (Status done = add(at(i), at(i + 1), at(i + 2)); !done) return done;
      }
      return {};
    }
    for (std::size_t i = 0; i + 2 < count; ++i) {
      const bool is_fan = mode == TINYGLTF_MODE_TRIANGLE_FAN;
      const std::size_t odd = i % 2;
      Status done = is_fan ? add(at(i + 1), at(i + 2), at(0)) : add(at(i), at(i + 1 + odd), at(i + 2 - odd));
      if (!done) return done;
    }
    return {};
  }
  /// Returns true for the vertex colours that Quoin writes for blocks: ambient occlusion, not a surface colour.
  [[nodiscard]] bool is_baked_occlusion(const tinygltf::Primitive& primitive, int index) const {
    const tinygltf::Accessor* const of = entry(model_.accessors, index);
    const bool may_be = of != nullptr && model_.asset.generator.starts_with("Quoin ") &&
                        of->componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && of->normalized &&
                        attribute(primitive, "TEXCOORD_0") >= 0;
    if (!may_be) return false;
    const auto colours = Accessor::open(model_, index, 3);
    if (!colours) return false;
    for (std::size_t i = 0; i < colours->count(); ++i) {
      const double grey = colours->at(i, 0);
      if (!is_occlusion_grey(grey) || colours->at(i, 1) != grey || colours->at(i, 2) != grey) return false;
    }
    return true;
  }
  /// Vertices without colours are white once any primitive has colours.
  Status take_colours(const tinygltf::Primitive& primitive, std::size_t first, std::size_t count) {
    auto& all = loaded_.mesh.colours;
    const int index = attribute(primitive, "COLOR_0");
    if (index < 0 || is_baked_occlusion(primitive, index)) {
      if (!all.empty()) all.resize(first + count, glm::vec4(1.0F));
      return {};
    }
    const auto colours = Accessor::open(model_, index, 3);
    if (!colours) return colours.error();
    if (colours->count() < count) return make_error(ErrorCode::BadFormat, "fewer colours than vertices");
    all.resize(first, glm::vec4(1.0F));
    for (std::size_t i = 0; i < count; ++i) {
      glm::vec4 colour(1.0F);
      for (int channel = 0; channel < std::min(colours->components(), 4); ++channel) {
        const auto value = static_cast<float>(colours->at(i, channel));
        colour[channel] = value >= 0.0F ? std::min(value, 1.0F) : 0.0F;
      }
      all.push_back(colour);
    }
    return {};
  }
  void finish() {
    if (!has_textures_) loaded_.mesh.uvs.clear();
    if (!has_glows_) loaded_.mesh.emissive_uvs.clear();
    if (has_others_) loaded_.warnings.emplace_back("left out: points and lines");
    if (has_skins_) loaded_.warnings.emplace_back("left out: skins; the mesh keeps its bind pose");
    if (!model_.animations.empty()) loaded_.warnings.emplace_back("left out: animations; the mesh keeps its rest pose");
    builder_.finish();
  }

  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
  const tinygltf::Model& model_;
  const Asked& asked_;
  LoadedMesh loaded_;
  MeshBuilder builder_{loaded_};
  std::vector<PlaceTransform> places_;                  // texture transforms of base colours
  std::vector<PlaceTransform> glow_places_;             // texture transforms of emission
  std::map<int, std::optional<std::size_t>> textures_;  // by index in the file
  std::vector<bool> seen_;
  std::size_t no_material_ = 0;
  bool has_textures_ = false;
  bool has_glows_ = false;
  bool has_others_ = false;
  bool has_skins_ = false;
};

/// Returns the JSON of a file. In a GLB it is the first chunk.
std::string_view json_of(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  if (!is_glb(bytes)) return text;
  constexpr std::size_t kJsonAt = 20;
  ByteReader reader(bytes);
  (void)reader.take(12);
  const std::uint32_t length = reader.u32();
  return text.size() <= kJsonAt ? std::string_view() : text.substr(kJsonAt, length);
}

/// Returns the file's version if it is not 2; nullopt for version 2 and for files without a version.
std::optional<std::string> other_version(std::span<const std::byte> bytes, std::string_view json) {
  if (is_glb(bytes) && bytes.size() >= 8) {
    ByteReader reader(bytes);
    (void)reader.take(4);
    if (const std::uint32_t container = reader.u32(); container != 2) return std::to_string(container) + ".0";
  }
  const auto document = nlohmann::json::parse(json, nullptr, false);
  if (!document.is_object() || !document.contains("asset") || !document["asset"].is_object()) return std::nullopt;
  const auto version = document["asset"].find("version");
  if (version == document["asset"].end()) return std::nullopt;
  const std::string text = version->is_string() ? version->get<std::string>() : version->dump();
  return text.starts_with("2") ? std::nullopt : std::optional(printable(text));
}

Result<tinygltf::Model> parse(std::span<const std::byte> bytes, Asked& asked) {
  if (bytes.size() > std::numeric_limits<unsigned>::max()) {
    return make_error(ErrorCode::LimitExceeded, "the glTF file has more than 4 GiB");
  }
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_image, &asked);
  loader.SetFsCallbacks({is_there, as_it_is, read_beside, write_nothing, &asked});
  tinygltf::Model model;
  std::string error;
  std::string warning;
  bool done = false;
  const auto size = static_cast<unsigned>(bytes.size());
  try {
    done = is_glb(bytes) ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                                       reinterpret_cast<const unsigned char*>(bytes.data()), size, "")
                         : loader.LoadASCIIFromString(&model, &error, &warning,
                                                      reinterpret_cast<const char*>(bytes.data()), size, "");
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  if (!done) return make_error(ErrorCode::BadFormat, first_line(error));
  return model;
}

Result<LoadedMesh> read_gltf(std::span<const std::byte> bytes, SidecarReader& sidecars) {
  Asked asked{&sidecars};
  const std::string_view json = json_of(bytes);
  if (json_extent(json).depth > kMaxDepth) return make_error(ErrorCode::BadFormat, "the JSON is nested too deeply");
  const auto rewritten = readable_by_tinygltf(bytes, json);
  auto model = parse(rewritten.empty() ? bytes : rewritten, asked);
  if (sidecars.refused()) return *sidecars.refused();
  if (!model || !model->asset.version.starts_with("2")) {
    if (const auto version = other_version(bytes, json)) {
      return make_error(ErrorCode::Unsupported, "glTF " + *version + " is not supported (version 2 is)");
    }
  }
  if (!model) return model.error();
  if (Status done = decode_draco(*model); !done) return done.error();
  if (has_meshopt()) {
    if (Status done = decode_views(*model); !done) return done.error();
  }
  return GltfReader(*model, asked).read();
}

#else

constexpr FormatCapability kReading{};

Result<LoadedMesh> read_gltf(std::span<const std::byte>, SidecarReader&) {
  return make_error(ErrorCode::Unsupported, "cannot read glTF: Quoin was built without tinygltf");
}

#endif

}  // namespace

}  // namespace quoin::triangles

namespace quoin {

namespace {

constexpr FormatCapability kGltfCapabilities =
    triangles::kReading | FormatCapability::Write | FormatCapability::Meshes | FormatCapability::Textures |
    FormatCapability::Faces | FormatCapability::OcclusionAttribute | FormatCapability::VertexLight |
    FormatCapability::Lamps | FormatCapability::Animation | FormatCapability::Compression | FormatCapability::Metres;

}  // namespace

extern constinit const FormatDriver kGlbFormat = {
    .info = {FileFormat::Glb, ".glb", "glTF 2.0, one file", kGltfCapabilities},
    .detect = triangles::is_glb,
    .read_mesh = triangles::read_gltf,
    .plan_mesh = plan_glb,
};

extern constinit const FormatDriver kGltfFormat = {
    .info = {FileFormat::Gltf, ".gltf", "glTF 2.0, JSON and .bin", kGltfCapabilities},
    .detect = triangles::is_gltf,
    .read_mesh = triangles::read_gltf,
    .plan_mesh = plan_gltf,
    .mesh_companions = gltf_companions,
};

}  // namespace quoin
