#include "io/gltf_arrays.h"

#include <utility>

namespace quoin::gltf {

namespace {

Json scene_json(std::size_t nodes) {
  Json entry = Json::object();
  if (nodes > 0) {
    entry["nodes"] = Json::array();
    for (std::size_t i = 0; i < nodes; ++i) entry["nodes"].push_back(i);
  }
  return Json::array({std::move(entry)});
}

}  // namespace

std::size_t Arrays::add_view(const GltfView& view, int target) {
  Json entry = {{"buffer", 0}, {"byteOffset", view.offset}, {"byteLength", view.bytes}};
  if (target != 0) entry["target"] = target;
  views.push_back(std::move(entry));
  return views.size() - 1;
}

std::size_t Arrays::add(const GltfView& view, int target, int component, const char* type, std::uint64_t count) {
  accessors.push_back(
      {{"bufferView", add_view(view, target)}, {"componentType", component}, {"count", count}, {"type", type}});
  return accessors.size() - 1;
}

Json document_of(Json nodes, const std::vector<const char*>& extensions) {
  Json document;
  document["asset"] = {{"version", "2.0"}, {"generator", "Quoin " QUOIN_VERSION}};
  if (!extensions.empty()) document["extensionsUsed"] = extensions;
  document["scene"] = 0;
  document["scenes"] = scene_json(nodes.size());
  if (!nodes.empty()) document["nodes"] = std::move(nodes);
  return document;
}

void add_buffer(Arrays arrays, std::uint64_t bytes, std::string_view uri, Json& document) {
  document["accessors"] = std::move(arrays.accessors);
  document["bufferViews"] = std::move(arrays.views);
  Json buffer = Json::object();
  if (!uri.empty()) buffer["uri"] = uri;
  buffer["byteLength"] = bytes;
  document["buffers"] = Json::array({std::move(buffer)});
}

std::string text_of(const Json& document) {
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace quoin::gltf
