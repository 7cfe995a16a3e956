#include "store/world/part_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/bytes/text.h"
#include "io/scene_file/scene_parts.h"

namespace quoin::store {

namespace {

using scene_json::Faults;
using scene_json::Json;
using scene_json::Object;
using scene_json::OrderedJson;
using scene_json::PartWriter;
using scene_json::Place;

// Parts are flat; deeper nesting could overflow the stack of a recursive reader.
constexpr int kMaxDepth = 32;

VoxelProperties read(const Json& json, const Place& place, Faults& faults, VoxelProperties*) {
  scene_json::TexturesOfTypes none;  // a type's part has all of its textures, since parts change one by one
  return scene_json::properties_of(json, place, none, faults);
}

WorldGrid read(const Json& json, const Place& place, Faults& faults, WorldGrid*) {
  const Object object(json, place, {"name", "pivot", "canvas", "band", "whole"}, faults);
  SceneGrid grid;
  scene_json::read_grid_header(object, grid);
  scene_json::read_band(object, grid);
  object.read("whole", grid.whole);
  return {grid.name, grid.pivot, grid.canvas, grid.field.band(), grid.whole};
}

SceneFile::Placement read(const Json& json, const Place& place, Faults& faults, SceneFile::Placement*) {
  SceneFile::Placement instance = scene_json::placement_of(json, place, faults);
  if (!instance.grid) faults.add(place, "has no grid");
  return instance;
}

SceneFile::Group read(const Json& json, const Place& place, Faults& faults, SceneFile::Group*) {
  return scene_json::group_of(json, place, faults);
}

SceneLayer read(const Json& json, const Place& place, Faults& faults, SceneLayer*) {
  return scene_json::layer_of(json, place, faults);
}

Lamp read(const Json& json, const Place& place, Faults& faults, Lamp*) {
  return scene_json::lamp_of(json, place, faults);
}

Environment read(const Json& json, const Place& place, Faults& faults, Environment*) {
  return scene_json::environment_from(json, place, faults);
}

Camera read(const Json& json, const Place& place, Faults& faults, Camera*) {
  return scene_json::camera_of(json, place, faults);
}

FileCamera read(const Json& json, const Place& place, Faults& faults, FileCamera*) {
  FileCamera camera;
  if (!json.is_object()) {
    faults.add(place, "must be an object");
    return camera;
  }
  Json rest = json;
  Json own = Json::object();
  for (const char* key : {"number", "focus_distance"}) {
    if (rest.contains(key)) own[key] = rest[key];
    rest.erase(key);
  }
  camera.camera = scene_json::camera_of(rest, place, faults);
  const Object object(own, place, {"number", "focus_distance"}, faults);
  if (const Json* number = object.find("number")) {
    constexpr int kLeast = std::numeric_limits<int>::min();
    constexpr int kMost = std::numeric_limits<int>::max();
    camera.number = object.whole_numbers(Json::array({*number}), object.place_of("number"), 1, kLeast, kMost).front();
  }
  object.read("focus_distance", camera.focus_distance);
  return camera;
}

DVec3 read(const Json& json, const Place& place, Faults& faults, DVec3*) {
  const Json holder = {{"value", json}};
  const Object object(holder, place, {"value"}, faults);
  DVec3 vector(0.0);
  object.read("value", vector);
  return vector;
}

// JSON cannot represent numbers that are not finite.
template <class T>
std::string dumped(const T& part) {
  PartWriter writer;
  return writer.json_of(part).dump();
}

template <class Placed>
bool has_readable_frame(const Placed& placed) {
  const DQuat& q = placed.rotation;
  return is_finite(placed.position) && is_finite(DVec3(q.x, q.y, q.z)) && std::isfinite(q.w) &&
         is_readable_name(placed.name);
}

}  // namespace

std::string text_of(const VoxelProperties& type) {
  return dumped(type);
}

std::uint64_t texture_bytes(const VoxelProperties& type) {
  std::uint64_t bytes = 0;
  std::vector<Texture> counted;
  for_each_look(type, [&](const VoxelFace& look) {
    const Texture& texture = look.texture;
    if (texture.is_null() || std::ranges::find(counted, texture) != counted.end()) return;
    counted.push_back(texture);
    const std::uint64_t channels = texture.is_opaque() ? 3 : 4;
    const auto side = static_cast<std::uint64_t>(texture.size());
    bytes += (channels * side * side + 2) / 3 * 4;  // base64
  });
  return bytes;
}

std::string text_of(const WorldGrid& grid) {
  SceneGrid header;
  header.name = grid.name;
  header.pivot = grid.pivot;
  header.canvas = grid.canvas;
  PartWriter writer;
  OrderedJson json = writer.json_of(header);
  json["band"] = grid.band;
  if (grid.whole) json["whole"] = true;
  return json.dump();
}

std::string text_of(const SceneFile::Placement& instance) {
  return dumped(instance);
}

std::string text_of(const SceneFile::Group& group) {
  return dumped(group);
}

std::string text_of(const SceneLayer& layer) {
  return dumped(layer);
}

std::string text_of(const Lamp& lamp) {
  return dumped(lamp);
}

std::string text_of(const Environment& environment) {
  return dumped(environment);
}

std::string text_of(const Camera& camera) {
  return dumped(camera);
}

std::string text_of(const FileCamera& camera) {
  PartWriter writer;
  OrderedJson json = writer.json_of(camera.camera);
  json["number"] = camera.number;
  json["focus_distance"] = camera.focus_distance;
  return json.dump();
}

std::string text_of(DVec3 vector) {
  return OrderedJson{vector.x, vector.y, vector.z}.dump();
}

bool is_readable_name(std::string_view name) {
  constexpr std::size_t kMaxName = std::size_t{1} << 20;  // 6 MiB of text at most
  return name.size() <= kMaxName;
}

bool is_readable(const SceneFile::Placement& instance) {
  const Instance& own = instance.instance;
  return instance.grid.has_value() && has_readable_frame(own) && std::isfinite(own.voxel_size) && own.voxel_size > 0.0;
}

bool is_readable(const SceneFile::Group& group) {
  return has_readable_frame(group.group);
}

template <class T>
Result<T> part_from(std::span<const std::byte> text, const std::string& name) {
  const std::string_view chars(reinterpret_cast<const char*>(text.data()), text.size());
  if (json_extent(chars).depth > kMaxDepth) return make_error(ErrorCode::BadFormat, name + ": nested too deeply");
  Faults faults;
  try {
    const Place place{nullptr, name, std::nullopt};
    T part = read(Json::parse(chars), place, faults, static_cast<T*>(nullptr));
    if (faults.error()) return *faults.error();
    return part;
  } catch (const Json::exception&) {
    return make_error(ErrorCode::BadFormat, name + ": not valid JSON");
  }
}

template Result<VoxelProperties> part_from(std::span<const std::byte> text, const std::string& name);
template Result<WorldGrid> part_from(std::span<const std::byte> text, const std::string& name);
template Result<SceneFile::Placement> part_from(std::span<const std::byte> text, const std::string& name);
template Result<SceneFile::Group> part_from(std::span<const std::byte> text, const std::string& name);
template Result<SceneLayer> part_from(std::span<const std::byte> text, const std::string& name);
template Result<Lamp> part_from(std::span<const std::byte> text, const std::string& name);
template Result<Environment> part_from(std::span<const std::byte> text, const std::string& name);
template Result<Camera> part_from(std::span<const std::byte> text, const std::string& name);
template Result<FileCamera> part_from(std::span<const std::byte> text, const std::string& name);
template Result<DVec3> part_from(std::span<const std::byte> text, const std::string& name);

namespace {

template <class T>
Status check_as(std::span<const std::byte> body, const std::string& name) {
  const Result<T> part = part_from<T>(body, name);
  if (!part) return make_error(ErrorCode::InvalidArgument, part.error().message);
  return {};
}

Status check_thumbnail(std::span<const std::byte> body, const std::string& name) {
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
  constexpr std::array<std::uint8_t, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  const bool is_png =
      body.size() > kPng.size() &&
      std::equal(kPng.begin(), kPng.end(), body.begin(), [](std::uint8_t a, std::byte b) { return std::byte{a} == b; });
  if (!is_png) return make_error(ErrorCode::InvalidArgument, name + " is not a PNG file");
  if (body.size() > kMaxBytes) return make_error(ErrorCode::InvalidArgument, name + " exceeds 16 MiB");
  return {};
}

}  // namespace

Status check_number(const PartKey& key) {
  const auto* const number = std::get_if<std::int64_t>(&key.id);
  const bool is_type = key.kind == part::kType;
  const bool is_grid = key.kind == part::kGrid;
  const std::int64_t least = is_type ? 1 : 0;
  const std::int64_t most = is_type   ? static_cast<std::int64_t>(kMaxVoxelTypes)
                            : is_grid ? kMaxGridNumber
                                      : kMaxPartNumber;
  const bool is_valid = number != nullptr ? *number >= least && *number <= most : !is_type && !is_grid;
  if (!is_valid) return make_error(ErrorCode::InvalidArgument, name_of(key) + " has an invalid number");
  return {};
}

Status check_part(const PartKey& key, std::span<const std::byte> body) {
  const std::string name = name_of(key);
  if (auto numbered = check_number(key); !numbered) return numbered;
  if (key.kind == part::kType) return check_as<VoxelProperties>(body, name);
  if (key.kind == part::kGrid) return check_as<WorldGrid>(body, name);
  if (key.kind == part::kInstance) return check_as<SceneFile::Placement>(body, name);
  if (key.kind == part::kGroup) return check_as<SceneFile::Group>(body, name);
  if (key.kind == part::kLayer) return check_as<SceneLayer>(body, name);
  if (key.kind == part::kLamp) return check_as<Lamp>(body, name);
  if (key.kind == part::kView) return check_as<Camera>(body, name);
  if (key.kind == part::kCamera) return check_as<FileCamera>(body, name);
  if (key.kind == part::kSun) return check_as<DVec3>(body, name);
  if (key.kind == part::kEnvironment) return check_as<Environment>(body, name);
  if (key.kind == part::kThumbnail) return check_thumbnail(body, name);
  return {};
}

}  // namespace quoin::store
