#include <algorithm>
#include <numbers>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <quoin/io/file.h>
#include <quoin/io/scene_file.h>

namespace quoin {
namespace {

// Keys in the order in which they are put: the version comes first, by which files are recognised.
using Json = nlohmann::ordered_json;

Json triple(DVec3 v) {
  return {v.x, v.y, v.z};
}

Json json_of(const SceneFile::Placement& placement) {
  const SceneFile::Placement plain;
  Json json = {{"file", placement.source}};
  if (!placement.name.empty()) json["name"] = placement.name;
  if (placement.position != plain.position) json["position"] = triple(placement.position);
  const DQuat& q = placement.rotation;
  if (q != plain.rotation) json["rotation"] = {q.x, q.y, q.z, q.w};
  if (placement.scale != plain.scale) json["scale"] = placement.scale;
  if (placement.mirrored) json["mirrored"] = true;
  if (!placement.visible) json["visible"] = false;
  return json;
}

// A camera of the file is upright: a point that it looks at and an angle say all of it.
Result<Json> json_of(const Camera& camera) {
  // So far that the sum's rounding turns nothing.
  const DVec3 reach = glm::abs(camera.position);
  const DVec3 target = camera.position + camera.forward * std::max({1.0, reach.x, reach.y, reach.z});
  if (camera.projection != Camera::Projection::Perspective) {
    return make_error(ErrorCode::Unsupported, "a scene file holds perspective cameras only");
  }
  const auto again = look_at(camera.position, target, camera.vertical_fov);
  if (!again) return again.error();
  if (glm::distance(again->up, camera.up) > 1e-6) {
    return make_error(ErrorCode::Unsupported, "a scene file holds upright cameras only");
  }
  return Json{{"position", triple(camera.position)},
              {"look_at", triple(target)},
              {"fov", camera.vertical_fov * 180.0 / std::numbers::pi}};
}

}  // namespace

Result<std::vector<std::byte>> write_scene_file(const SceneFile& scene) {
  Json json = {{"quoin_scene", 1}};
  json["files"] = Json::array();
  for (const SceneFile::Source& source : scene.sources) {
    json["files"].push_back({{"id", source.id}, {"path", source.file}});
  }
  json["instances"] = Json::array();
  for (const SceneFile::Placement& placement : scene.placements) json["instances"].push_back(json_of(placement));
  if (scene.sun) json["sun"] = triple(*scene.sun);
  if (scene.camera) {
    auto camera = json_of(*scene.camera);
    if (!camera) return camera.error();
    json["camera"] = std::move(*camera);
  }
  std::string text;
  try {
    text = json.dump(2) + "\n";
  } catch (const Json::type_error&) {  // of text: numbers that are not finite become null
    return make_error(ErrorCode::InvalidArgument, "a name, id or path is not UTF-8");
  }
  const auto bytes = std::as_bytes(std::span(text));
  // Whatever the reader refuses is not written.
  if (const auto read = parse_scene_file(bytes); !read) {
    return make_error(
        read.error().code == ErrorCode::LimitExceeded ? ErrorCode::LimitExceeded : ErrorCode::InvalidArgument,
        read.error().message);
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::uint64_t> write_scene_file(const SceneFile& scene, const std::filesystem::path& path) {
  auto bytes = write_scene_file(scene);
  if (!bytes) {
    Error error = bytes.error();
    error.path = path.string();
    return error;
  }
  if (Status written = write_file(path, *bytes); !written) return written.error();
  return bytes->size();
}

}  // namespace quoin
