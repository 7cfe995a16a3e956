#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include <quoin/core/vec.h>

#include "io/gltf_views.h"

namespace quoin::gltf {

using Json = nlohmann::ordered_json;

// glTF 2.0's numbers for what it borrows from OpenGL.
inline constexpr int kUnsignedByte = 5121;
inline constexpr int kUnsignedShort = 5123;
inline constexpr int kUnsignedInt = 5125;
inline constexpr int kFloat = 5126;
inline constexpr int kArrayBuffer = 34962;
inline constexpr int kElementArrayBuffer = 34963;

[[nodiscard]] inline Json json_from(const Vec3& v) {
  return {v.x, v.y, v.z};
}
/// Adding zero turns -0 into 0.
[[nodiscard]] inline Json json_from(const DVec3& v) {
  return {v.x + 0.0, v.y + 0.0, v.z + 0.0};
}
/// In glTF's order: x, y, z, w.
[[nodiscard]] inline Json json_from(const DQuat& q) {
  return {q.x + 0.0, q.y + 0.0, q.z + 0.0, q.w + 0.0};
}

/// Collects buffer views and accessors, which refer to each other by number.
struct Arrays {
  Json views = Json::array();
  Json accessors = Json::array();

  /// `target` 0: none. Answers the view's number.
  std::size_t add_view(const GltfView& view, int target);
  /// A view and the accessor of all of it; answers the accessor's number.
  std::size_t add(const GltfView& view, int target, int component, const char* type, std::uint64_t count);
};

/// What every document begins with: the asset, the extensions used, one scene of all the nodes, and the nodes.
[[nodiscard]] Json document_of(Json nodes, const std::vector<const char*>& extensions = {});

/// Adds accessors, views and the buffer they lie in. `uri` names its file; empty for a GLB's own.
void add_buffer(Arrays arrays, std::uint64_t bytes, std::string_view uri, Json& document);

/// Compact text; names that are no UTF-8 are made such.
[[nodiscard]] std::string text_of(const Json& document);

}  // namespace quoin::gltf
