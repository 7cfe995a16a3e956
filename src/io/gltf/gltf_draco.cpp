#include "io/gltf/gltf_draco.h"

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
#include <utility>
#include <vector>

#include <tiny_gltf.h>

#ifdef QUOIN_HAVE_DRACO
#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#endif

namespace quoin::triangles {

namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

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
