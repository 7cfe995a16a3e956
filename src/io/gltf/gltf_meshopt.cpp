#include "io/gltf/gltf_meshopt.h"

#ifdef QUOIN_HAVE_TINYGLTF

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

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

}  // namespace quoin::triangles

#endif
