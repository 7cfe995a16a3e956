#include "io/gltf/gltf_decoders.h"

#ifdef QUOIN_HAVE_TINYGLTF

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#ifdef QUOIN_HAVE_DRACO
#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#endif
#ifdef QUOIN_HAVE_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif
#include <nlohmann/json.hpp>
#include <tiny_gltf.h>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "io/triangles/triangles.h"

namespace quoin::triangles {

bool is_glb(std::span<const std::byte> beginning) {
  return text_of(beginning).starts_with("glTF");
}

namespace {

constexpr const char* kExtension = "EXT_meshopt_compression";
constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr const char* kOneByte = "data:application/octet-stream;base64,AA==";

using Json = nlohmann::json;

bool is_fallback(const Json& buffer) {
  if (!buffer.is_object() || buffer.contains("uri")) return false;
  const auto extensions = buffer.find("extensions");
  if (extensions == buffer.end() || !extensions->is_object()) return false;
  const auto extension = extensions->find(kExtension);
  return extension != extensions->end() && extension->is_object() && extension->value("fallback", Json()) == true;
}

/// Returns true if any buffer was replaced.
bool replace_fallback_buffers(Json& document) {
  if (!document.contains("buffers") || !document["buffers"].is_array()) return false;
  bool is_changed = false;
  for (Json& buffer : document["buffers"]) {
    if (!is_fallback(buffer)) continue;
    buffer["uri"] = kOneByte;
    buffer["byteLength"] = 1;
    is_changed = true;
  }
  return is_changed;
}

/// Moves the indices of one primitive. Returns true if it had any.
bool move_indices_of(Json& primitive) {
  if (!primitive.is_object() || !primitive.contains("extensions") || !primitive.contains("indices")) return false;
  Json& extensions = primitive["extensions"];
  if (!extensions.is_object() || !extensions.contains(kDraco) || !extensions[kDraco].is_object()) return false;
  extensions[kDraco]["indices"] = primitive["indices"];
  primitive.erase("indices");
  return true;
}

/// Returns true if any were moved.
bool move_draco_indices(Json& document) {
  if (!document.contains("meshes") || !document["meshes"].is_array()) return false;
  bool is_changed = false;
  for (Json& mesh : document["meshes"]) {
    if (!mesh.is_object() || !mesh.contains("primitives") || !mesh["primitives"].is_array()) continue;
    for (Json& primitive : mesh["primitives"]) is_changed |= move_indices_of(primitive);
  }
  return is_changed;
}

/// Returns a file with other JSON in place of `old`, which is within the file. In a GLB the rest is unchanged.
std::vector<std::byte> with_json(std::span<const std::byte> file, std::string_view old, std::string json) {
  ByteWriter out;
  if (!is_glb(file)) {
    out.text(json);
    return out.take();
  }
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto at = static_cast<std::size_t>(old.data() - text_of(file).data());
  QUOIN_ASSERT(at >= 20 && at <= file.size() && old.size() <= file.size() - at, "the JSON of the file");
  const auto rest = file.subspan(at + old.size());
  const std::size_t size = at + json.size() + rest.size();
  out.reserve(size);
  out.raw(file.first(at));
  out.patch(8, size);
  out.patch(12, json.size());
  out.text(json);
  out.raw(rest);
  return out.take();
}

#ifdef QUOIN_HAVE_MESHOPTIMIZER

/// Maximum number of output bytes per encoded byte: of 64 equal bytes one is stored, and one-byte indices become four
/// bytes.
constexpr std::size_t kMostPacked = 256;

/// The content of a view's extension.
struct CodedView {
  std::span<const unsigned char> coded;
  std::size_t count = 0;
  std::size_t stride = 0;
  std::string mode;
  std::string filter;
};

/// Returns nullopt if it is not a whole number.
std::optional<std::size_t> whole_in(const tinygltf::Value& object, const char* key) {
  if (!object.Has(key) || !object.Get(key).IsNumber()) return std::nullopt;
  const double number = object.Get(key).GetNumberAsDouble();
  if (!(number >= 0.0 && number < 0x1p40) || number != std::floor(number)) return std::nullopt;
  return static_cast<std::size_t>(number);
}

std::string text_in(const tinygltf::Value& object, const char* key) {
  return object.Has(key) && object.Get(key).IsString() ? object.Get(key).Get<std::string>() : std::string();
}

Result<CodedView> coded_view(const tinygltf::Model& model, const tinygltf::Value& extension) {
  const auto bad = [](const char* what) { return make_error(ErrorCode::BadFormat, what); };
  if (!extension.IsObject()) return bad("its compression extension is not an object");
  const auto buffer = whole_in(extension, "buffer");
  const auto offset = extension.Has("byteOffset") ? whole_in(extension, "byteOffset") : std::size_t{0};
  const auto length = whole_in(extension, "byteLength");
  const auto count = whole_in(extension, "count");
  const auto stride = whole_in(extension, "byteStride");
  if (!buffer || !offset || !length || !count || !stride) return bad("its compression extension lacks a number");
  CodedView view;
  view.count = *count;
  view.stride = *stride;
  view.mode = text_in(extension, "mode");
  view.filter = text_in(extension, "filter");
  if (*buffer >= model.buffers.size()) return bad("the buffer of its compressed data does not exist");
  const auto& bytes = model.buffers[*buffer].data;
  if (*offset > bytes.size() || *length > bytes.size() - *offset)
    return bad("its compressed data extends past the buffer");
  view.coded = std::span(bytes).subspan(*offset, *length);
  const bool is_attributes = view.mode == "ATTRIBUTES";
  const bool has_stride = is_attributes ? view.stride != 0 && view.stride % 4 == 0 && view.stride <= 256
                                        : view.stride == 2 || view.stride == 4;
  if (!has_stride) return bad("unsupported element size");
  if (view.count > (*length + 1) * kMostPacked / view.stride)
    return bad("more elements than its compressed data can hold");
  return view;
}

Result<std::vector<unsigned char>> decoded(const CodedView& view) {
  std::vector<unsigned char> bytes(view.count * view.stride);
  int failed = 1;
  if (view.mode == "ATTRIBUTES") {
    failed = meshopt_decodeVertexBuffer(bytes.data(), view.count, view.stride, view.coded.data(), view.coded.size());
  } else if (view.mode == "TRIANGLES" && view.count % 3 == 0) {
    failed = meshopt_decodeIndexBuffer(bytes.data(), view.count, view.stride, view.coded.data(), view.coded.size());
  } else if (view.mode == "INDICES") {
    failed = meshopt_decodeIndexSequence(bytes.data(), view.count, view.stride, view.coded.data(), view.coded.size());
  }
  if (failed != 0) return make_error(ErrorCode::BadFormat, "its compressed data cannot be decoded");
  if (view.filter.empty() || view.filter == "NONE") return bytes;
  if (view.mode != "ATTRIBUTES") return make_error(ErrorCode::BadFormat, "indices must not have a filter");
  if (view.filter == "OCTAHEDRAL" && (view.stride == 4 || view.stride == 8)) {
    meshopt_decodeFilterOct(bytes.data(), view.count, view.stride);
  } else if (view.filter == "QUATERNION" && view.stride == 8) {
    meshopt_decodeFilterQuat(bytes.data(), view.count, view.stride);
  } else if (view.filter == "EXPONENTIAL") {
    meshopt_decodeFilterExp(bytes.data(), view.count, view.stride);
  } else {
    return make_error(ErrorCode::BadFormat, "unknown filter");
  }
  return bytes;
}

#endif

}  // namespace

std::vector<std::byte> readable_by_tinygltf(std::span<const std::byte> file, std::string_view text) {
  const bool may_be_coded =
      text.find(kExtension) != std::string_view::npos || text.find(kDraco) != std::string_view::npos;
  if (!may_be_coded) return {};
  Json document = Json::parse(text, nullptr, false);
  if (!document.is_object()) return {};
  const bool has_fallback = replace_fallback_buffers(document);
  if (!move_draco_indices(document) && !has_fallback) return {};
  return with_json(file, text, document.dump(-1, ' ', false, Json::error_handler_t::replace));
}

#ifdef QUOIN_HAVE_MESHOPTIMIZER

bool has_meshopt() {
  return true;
}

Status decode_views(tinygltf::Model& model) {
  // Any number of views may share the same encoded bytes.
  std::size_t most = kMostPacked;
  for (const tinygltf::Buffer& buffer : model.buffers) most += kMostPacked * buffer.data.size();
  for (std::size_t i = 0; i < model.bufferViews.size(); ++i) {
    tinygltf::BufferView& view = model.bufferViews[i];
    const auto extension = view.extensions.find(kExtension);
    if (extension == view.extensions.end()) continue;
    const auto fail = [&](const Error& why) {
      return make_error(why.code, "buffer view " + std::to_string(i) + ": " + why.message);
    };
    const auto coded = coded_view(model, extension->second);
    if (!coded) return fail(coded.error());
    const std::size_t size = coded->count * coded->stride;
    if (size > most) return fail(make_error(ErrorCode::BadFormat, "more elements than the compressed data can hold"));
    most -= size;
    auto bytes = decoded(*coded);
    if (!bytes) return fail(bytes.error());
    tinygltf::Buffer buffer;
    buffer.data = std::move(*bytes);
    view.buffer = static_cast<int>(model.buffers.size());
    view.byteOffset = 0;
    view.byteLength = buffer.data.size();
    model.buffers.push_back(std::move(buffer));
  }
  return {};
}

#else

bool has_meshopt() {
  return false;
}

Status decode_views(tinygltf::Model&) {
  return make_error(ErrorCode::Unsupported, "cannot read compressed glTF: Quoin was built without meshoptimizer");
}

#endif

namespace {

#ifdef QUOIN_HAVE_DRACO

/// Draco's densest codes use a few bits per hundred vertices, so larger counts are invalid.
constexpr std::size_t kMostPointsPerByte = 4'096;

Error bad(std::string why) {
  return make_error(ErrorCode::BadFormat, std::move(why));
}

std::optional<std::size_t> index_in(const tinygltf::Value& object, const std::string& key) {
  if (!object.IsObject() || !object.Has(key) || !object.Get(key).IsNumber()) return std::nullopt;
  const double number = object.Get(key).GetNumberAsDouble();
  if (!(number >= 0.0 && number < 0x1p31) || number != std::floor(number)) return std::nullopt;
  return static_cast<std::size_t>(number);
}

/// Returns the bytes that an extension refers to.
Result<std::pair<const char*, std::size_t>> coded_bytes(const tinygltf::Model& model,
                                                        const tinygltf::Value& extension) {
  const auto view = index_in(extension, "bufferView");
  if (!view || *view >= model.bufferViews.size()) return bad("the buffer view of its Draco data does not exist");
  const tinygltf::BufferView& of = model.bufferViews[*view];
  if (of.buffer < 0 || static_cast<std::size_t>(of.buffer) >= model.buffers.size()) {
    return bad("the buffer of its Draco data does not exist");
  }
  const auto& bytes = model.buffers[static_cast<std::size_t>(of.buffer)].data;
  if (of.byteOffset > bytes.size() || of.byteLength > bytes.size() - of.byteOffset) {
    return bad("its Draco data extends past the buffer");
  }
  return std::pair(reinterpret_cast<const char*>(bytes.data()) + of.byteOffset, of.byteLength);
}

Result<std::unique_ptr<draco::Mesh>> decoded_mesh(const char* bytes, std::size_t size) {
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes, size);
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    if (!type.ok() || type.value() != draco::TRIANGULAR_MESH) return bad("its data is not a Draco mesh");
    draco::Decoder decoder;
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) return bad("Draco cannot decode it: " + mesh.status().error_msg_string());
    return std::move(mesh).value();
  } catch (const std::bad_alloc&) {
    return bad("its Draco data needs more memory than is available");
  } catch (const std::exception& thrown) {
    return bad("Draco cannot decode it: " + std::string(thrown.what()));
  }
}

/// Adds a buffer with a view of it. Returns the view's number.
int add_view(tinygltf::Model& model, std::vector<unsigned char> bytes) {
  tinygltf::BufferView view;
  view.buffer = static_cast<int>(model.buffers.size());
  view.byteLength = bytes.size();
  tinygltf::Buffer buffer;
  buffer.data = std::move(bytes);
  model.buffers.push_back(std::move(buffer));
  model.bufferViews.push_back(std::move(view));
  return static_cast<int>(model.bufferViews.size()) - 1;
}

template <class T>
void put(const T& value, unsigned char*& at) {
  std::memcpy(at, &value, sizeof(T));
  at += sizeof(T);
}

/// Reads an attribute of all points as floats, normalized integers as fractions.
Result<std::vector<unsigned char>> floats_of(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                                             const tinygltf::Accessor& accessor, int components) {
  double most = 1.0;
  if (accessor.normalized || attribute.normalized()) {
    const bool is_short = accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                          accessor.componentType == TINYGLTF_COMPONENT_TYPE_SHORT;
    const bool is_signed = accessor.componentType == TINYGLTF_COMPONENT_TYPE_BYTE ||
                           accessor.componentType == TINYGLTF_COMPONENT_TYPE_SHORT;
    most = (is_short ? 65'535.0 : 255.0) / (is_signed ? 2.0 : 1.0);
    most = std::floor(most);
  }
  const bool is_float = !draco::IsDataTypeIntegral(attribute.data_type());
  std::vector<unsigned char> bytes(std::size_t{4} * static_cast<std::size_t>(components) * mesh.num_points());
  unsigned char* at = bytes.data();
  std::array<float, 16> values{};
  std::array<std::int32_t, 16> wholes{};
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    const draco::AttributeValueIndex index = attribute.mapped_index(point);
    const auto count = static_cast<std::int8_t>(components);
    const bool done = is_float ? attribute.ConvertValue<float>(index, count, values.data())
                               : attribute.ConvertValue<std::int32_t>(index, count, wholes.data());
    if (!done) return bad("cannot convert an attribute");
    for (std::size_t i = 0; i < static_cast<std::size_t>(components); ++i) {
      put(is_float ? values[i] : static_cast<float>(wholes[i] / most), at);
    }
  }
  return bytes;
}

Status take_attribute(const draco::Mesh& mesh, std::size_t id, int accessor_index, tinygltf::Model& model) {
  if (accessor_index < 0 || static_cast<std::size_t>(accessor_index) >= model.accessors.size()) {
    return bad("an accessor does not exist");
  }
  const draco::PointAttribute* const attribute = mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
  if (attribute == nullptr) return bad("an attribute is missing from its Draco data");
  tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(accessor_index)];
  const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  if (components < 1 || components > 4 || components > attribute->num_components()) {
    return bad("an attribute has the wrong type");
  }
  if (accessor.count != mesh.num_points()) return bad("an accessor's count differs from the Draco data's vertices");
  auto bytes = floats_of(mesh, *attribute, accessor, components);
  if (!bytes) return bytes.error();
  accessor.bufferView = add_view(model, std::move(*bytes));
  accessor.byteOffset = 0;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  accessor.normalized = false;
  return {};
}

Status take_indices(const draco::Mesh& mesh, int accessor_index, tinygltf::Model& model) {
  if (accessor_index < 0 || static_cast<std::size_t>(accessor_index) >= model.accessors.size()) {
    return bad("Draco triangles need indices");
  }
  std::vector<unsigned char> bytes(std::size_t{12} * mesh.num_faces());
  unsigned char* at = bytes.data();
  for (draco::FaceIndex face(0); face < mesh.num_faces(); ++face) {
    for (int corner = 0; corner < 3; ++corner) put(mesh.face(face)[corner].value(), at);
  }
  tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(accessor_index)];
  if (accessor.count != std::size_t{3} * mesh.num_faces())
    return bad("the number of indices differs from the Draco data's triangles");
  accessor.bufferView = add_view(model, std::move(bytes));
  accessor.byteOffset = 0;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  return {};
}

Status decode(const tinygltf::Primitive& primitive, const tinygltf::Value& extension, tinygltf::Model& model) {
  const auto coded = coded_bytes(model, extension);
  if (!coded) return coded.error();
  for (const auto& [name, accessor] : primitive.attributes) {
    if (accessor >= 0 && static_cast<std::size_t>(accessor) < model.accessors.size() &&
        model.accessors[static_cast<std::size_t>(accessor)].count / kMostPointsPerByte > coded->second) {
      return bad("more vertices than the Draco data can hold");
    }
  }
  const auto mesh = decoded_mesh(coded->first, coded->second);
  if (!mesh) return mesh.error();
  const auto indices = index_in(extension, "indices");
  if (!indices) return bad("Draco triangles need indices");
  if (Status done = take_indices(**mesh, static_cast<int>(*indices), model); !done) return done;
  if (!extension.Has("attributes") || !extension.Get("attributes").IsObject())
    return bad("the Draco extension has no attributes");
  const tinygltf::Value& ids = extension.Get("attributes");
  for (const auto& [name, accessor] : primitive.attributes) {
    if (!ids.Has(name)) continue;  // stored without Draco
    const auto id = index_in(ids, name);
    if (!id) return bad("a Draco attribute has no id");
    if (Status done = take_attribute(**mesh, *id, accessor, model); !done) return done;
  }
  return {};
}

#else

Status decode(const tinygltf::Primitive&, const tinygltf::Value&, tinygltf::Model&) {
  return make_error(ErrorCode::Unsupported,
                    "cannot read Draco compression: Quoin was built without Draco (Debian: libdraco-dev)");
}

#endif

}  // namespace

bool has_draco() {
#ifdef QUOIN_HAVE_DRACO
  return true;
#else
  return false;
#endif
}

Status decode_draco(tinygltf::Model& model) {
  for (std::size_t i = 0; i < model.meshes.size(); ++i) {
    for (std::size_t k = 0; k < model.meshes[i].primitives.size(); ++k) {
      const tinygltf::Primitive primitive = model.meshes[i].primitives[k];
      const auto extension = primitive.extensions.find(kDraco);
      if (extension == primitive.extensions.end()) continue;
      if (Status done = decode(primitive, extension->second, model); !done) {
        return make_error(done.error().code, "mesh " + std::to_string(i) + ", primitive " + std::to_string(k) + ": " +
                                                 done.error().message);
      }
      // readable_by_tinygltf moved them.
      model.meshes[i].primitives[k].indices = static_cast<int>(extension->second.Get("indices").GetNumberAsDouble());
    }
  }
  return {};
}

}  // namespace quoin::triangles

#endif
