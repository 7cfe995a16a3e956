#include <algorithm>
#include <bit>
#include <map>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <quoin/io/scene_file.h>

#include "core/progress_steps.h"
#include "io/base64.h"
#include "io/scene_file/voxel_data.h"
#include "io/text.h"
#include "io/whole_file.h"

namespace quoin {
namespace {

// Keys in the order in which they are put.
using Json = nlohmann::ordered_json;

Json triple(DVec3 v) {
  return {v.x, v.y, v.z};
}

// -0 is another number than 0.
bool is_same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
bool is_same(DVec3 a, DVec3 b) {
  return is_same(a.x, b.x) && is_same(a.y, b.y) && is_same(a.z, b.z);
}
bool is_same(const DQuat& a, const DQuat& b) {
  return is_same(a.w, b.w) && is_same(a.x, b.x) && is_same(a.y, b.y) && is_same(a.z, b.z);
}

/// Writes a scene file, and knows which version of the format it needs.
class SceneText {
 public:
  using Texts = std::vector<std::vector<std::string>>;
  /// By grid.
  struct Pieces {
    Texts voxels;
    Texts densities;
    Texts data;
  };

  /// Errors: InvalidArgument.
  Result<std::string> write(const SceneFile& scene, const Pieces& pieces) {
    try {
      for (std::size_t type = 1; type < scene.types.size(); ++type) {
        types_.push_back(json_of(scene.types[static_cast<VoxelType>(type)]));
        const VoxelProperties& properties = scene.types[static_cast<VoxelType>(type)];
        is_fifth_ |= properties.state_bits != 0 || !is_same(properties.scattering, 0.0F) ||
                     !is_same(properties.anisotropy, 0.0F);
      }
      for (std::size_t i = 0; i < scene.grids.size(); ++i) {
        grids_.push_back(json_of(scene.grids[i], pieces.voxels[i], pieces.densities[i], pieces.data[i]));
        is_third_ |= !pieces.densities[i].empty();
        is_fifth_ |= !pieces.data[i].empty();
      }
      for (const SceneLayer& layer : scene.layers) layers_.push_back(json_of(layer));
      for (const SceneFile::Group& group : scene.groups) groups_.push_back(json_of(group));
      for (const SceneFile::Placement& placement : scene.placements) instances_.push_back(json_of(placement));
      for (const Lamp& lamp : scene.lamps) lamps_.push_back(json_of(lamp));
      is_second_ = is_second_ || !lamps_.empty();
      if (scene.camera) camera_ = json_of(*scene.camera);
      return text_of(scene);
    } catch (const Json::type_error&) {  // of text: numbers that are not finite become null
      return make_error(ErrorCode::InvalidArgument, "an id or path is not UTF-8");
    }
  }

 private:
  Json text(const std::string& bytes) {
    if (is_utf8(bytes)) return bytes;
    is_second_ = true;
    return {{"base64", to_base64(std::as_bytes(std::span(bytes)))}};
  }

  Json json_of(const VoxelProperties& type) {
    const VoxelProperties plain;
    Json json = Json::object();
    if (!type.name.empty()) json["name"] = text(type.name);
    json["colour"] = {type.colour.r, type.colour.g, type.colour.b, type.colour.a};
    if (type.visibility == Visibility::Transparent) json["visibility"] = "transparent";
    if (!type.collides) json["collides"] = false;
    const auto put = [&](const char* key, float value, float usual) {
      if (!is_same(value, usual)) json[key] = value;
    };
    put("roughness", type.roughness, plain.roughness);
    put("metalness", type.metalness, plain.metalness);
    put("emission", type.emission, plain.emission);
    put("ior", type.ior, plain.ior);
    put("scattering", type.scattering, plain.scattering);
    put("anisotropy", type.anisotropy, plain.anisotropy);
    if (type.state_bits != 0) json["state_bits"] = type.state_bits;
    for (const auto& [key, value] : type.attributes) json["attributes"].push_back({text(key), text(value)});
    return json;
  }

  Json json_of(const SceneGrid& grid, const std::vector<std::string>& voxels, const std::vector<std::string>& densities,
               const std::vector<std::string>& data) {
    Json json = Json::object();
    if (!grid.name.empty()) json["name"] = text(grid.name);
    if (!is_same(grid.pivot, DVec3(0.0))) json["pivot"] = triple(grid.pivot);
    const IBox& canvas = grid.canvas;
    if (canvas != IBox{}) {
      json["canvas"] = {canvas.min.x, canvas.min.y, canvas.min.z, canvas.max.x, canvas.max.y, canvas.max.z};
    }
    json["voxels"] = voxels;
    if (!densities.empty()) {
      json["band"] = grid.field.band();
      json["densities"] = densities;
    }
    if (!data.empty()) json["data"] = data;
    return json;
  }

  Json json_of(const SceneFile::Placement& placement) {
    const SceneFile::Placement plain;
    Json json = placement.grid ? Json{{"grid", *placement.grid}} : Json{{"file", placement.source}};
    if (!placement.name.empty()) json["name"] = text(placement.name);
    if (!is_same(placement.position, plain.position)) json["position"] = triple(placement.position);
    const DQuat& q = placement.rotation;
    if (!is_same(q, plain.rotation)) json["rotation"] = {q.x, q.y, q.z, q.w};
    if (!is_same(placement.scale, plain.scale)) json["scale"] = placement.scale;
    if (placement.mirrored) json["mirrored"] = true;
    if (!placement.visible) json["visible"] = false;
    if (placement.group) json["group"] = *placement.group;
    if (placement.layer) json["layer"] = *placement.layer;
    if (placement.categories) json["categories"] = *placement.categories;
    return json;
  }

  Json json_of(const SceneFile::Group& group) {
    const SceneFile::Group plain;
    Json json = Json::object();
    if (!group.name.empty()) json["name"] = text(group.name);
    if (group.parent) json["parent"] = *group.parent;
    if (group.layer) json["layer"] = *group.layer;
    if (!is_same(group.position, plain.position)) json["position"] = triple(group.position);
    const DQuat& q = group.rotation;
    if (!is_same(q, plain.rotation)) json["rotation"] = {q.x, q.y, q.z, q.w};
    if (group.mirrored) json["mirrored"] = true;
    if (!group.visible) json["visible"] = false;
    return json;
  }

  Json json_of(const SceneLayer& layer) {
    Json json = Json::object();
    if (!layer.name.empty()) json["name"] = text(layer.name);
    if (!layer.visible) json["visible"] = false;
    return json;
  }

  Json json_of(const Lamp& lamp) {
    const Lamp plain;
    const bool is_spot = lamp.kind == Lamp::Kind::Spot;
    Json json = {{"kind", is_spot ? "spot" : "point"}};
    if (!lamp.name.empty()) json["name"] = text(lamp.name);
    json["position"] = triple(lamp.position);
    json["colour"] = {lamp.colour.x, lamp.colour.y, lamp.colour.z};
    json["intensity"] = lamp.intensity;
    const auto put = [&](const char* key, double value, double usual) {
      if (!is_same(value, usual)) json[key] = value;
    };
    put("range", lamp.range, plain.range);
    if (!is_same(lamp.direction, plain.direction)) json["direction"] = triple(lamp.direction);
    put("inner_angle", lamp.inner_angle_radians, plain.inner_angle_radians);
    put("outer_angle", lamp.outer_angle_radians, plain.outer_angle_radians);
    return json;
  }

  // An upright perspective camera is said by a point that it looks at and an angle in degrees, where these give it to
  // the last bit; any other by its axes.
  Json json_of(const Camera& camera) {
    // So far that the sum's rounding turns nothing.
    const DVec3 reach = glm::abs(camera.position);
    const DVec3 target = camera.position + camera.forward * std::max({1.0, reach.x, reach.y, reach.z});
    const double degrees = camera.vertical_fov_radians * 180.0 / std::numbers::pi;
    const auto again = look_at(camera.position, target, degrees * std::numbers::pi / 180.0);
    const bool is_flat = camera.projection == Camera::Projection::Orthographic;
    if (!is_flat && again && is_same(again->forward, camera.forward) && is_same(again->up, camera.up) &&
        is_same(again->right, camera.right) && is_same(again->vertical_fov_radians, camera.vertical_fov_radians)) {
      return {{"position", triple(camera.position)}, {"look_at", triple(target)}, {"fov", degrees}};
    }
    is_second_ = true;
    Json json = {{"position", triple(camera.position)},
                 {"right", triple(camera.right)},
                 {"up", triple(camera.up)},
                 {"forward", triple(camera.forward)}};
    json[is_flat ? "view_height" : "fov_radians"] = is_flat ? camera.view_height : camera.vertical_fov_radians;
    return json;
  }

  // A line an entry: what people look for is found.
  void put_list(std::string& text, const char* key, const std::vector<Json>& entries) const {
    text.append(",\n  \"").append(key).append("\": [");
    const char* before = "\n    ";
    for (const Json& entry : entries) {
      text.append(std::exchange(before, ",\n    ")).append(entry.dump());
    }
    text += entries.empty() ? "]" : "\n  ]";
  }

  [[nodiscard]] std::string text_of(const SceneFile& scene) const {
    const bool has_models = !types_.empty() || !grids_.empty();
    const bool is_fourth = !layers_.empty() || !groups_.empty();
    std::string text = "{\n  \"quoin_scene\": ";
    text += is_fifth_ ? "5" : is_fourth ? "4" : is_third_ ? "3" : has_models || is_second_ ? "2" : "1";
    if (has_models) put_list(text, "types", types_);
    if (has_models) put_list(text, "grids", grids_);
    std::vector<Json> files;
    files.reserve(scene.sources.size());
    for (const SceneFile::Source& source : scene.sources) files.push_back({{"id", source.id}, {"path", source.file}});
    if (!has_models || !files.empty()) put_list(text, "files", files);
    if (!layers_.empty()) put_list(text, "layers", layers_);
    if (!groups_.empty()) put_list(text, "groups", groups_);
    put_list(text, "instances", instances_);
    if (!lamps_.empty()) put_list(text, "lamps", lamps_);
    if (scene.sun) text.append(",\n  \"sun\": ").append(triple(*scene.sun).dump());
    if (scene.camera) text.append(",\n  \"camera\": ").append(camera_.dump());
    return text + "\n}\n";
  }

  std::vector<Json> types_;
  std::vector<Json> grids_;
  std::vector<Json> layers_;
  std::vector<Json> groups_;
  std::vector<Json> instances_;
  std::vector<Json> lamps_;
  Json camera_;
  bool is_second_ = false;
  bool is_third_ = false;
  bool is_fifth_ = false;
};

Status check_types(const SceneFile& scene) {
  for (std::size_t i = 0; i < scene.grids.size(); ++i) {
    VoxelType greatest = kAir;
    for (const VoxelType type : scene.grids[i].grid.types()) greatest = std::max(greatest, type);
    const DensityGrid& field = scene.grids[i].field;
    for (const IVec3 chunk : field.chunks()) {
      for (const VoxelType type : field.find_chunk(chunk)->materials().types()) greatest = std::max(greatest, type);
    }
    if (greatest == kAir || greatest < scene.types.size()) continue;
    return make_error(ErrorCode::InvalidArgument, "grids[" + std::to_string(i) + "] has voxels of type " +
                                                      std::to_string(greatest) + ", which is not registered");
  }
  return {};
}

Status check_data(const SceneFile& scene) {
  for (std::size_t i = 0; i < scene.grids.size(); ++i) {
    std::string fault;
    scene.grids[i].grid.for_each_data([&](IVec3 voxel, VoxelType type, const VoxelData& data) {
      if (fault.empty()) fault = fault_of_state(voxel, data, scene.types[type]);
    });
    if (!fault.empty()) return make_error(ErrorCode::InvalidArgument, "grids[" + std::to_string(i) + "]: " + fault);
  }
  return {};
}

// What there is of voxels, of densities and of data in the grids of a file.
class Contents {
 public:
  explicit Contents(const SceneFile& scene) {
    for (const SceneGrid& grid : scene.grids) {
      grids_.push_back(&grid.grid);
      fields_.push_back(&grid.field);
    }
  }

  [[nodiscard]] std::size_t bytes() const {
    std::size_t bytes = 0;
    for (const Grid* grid : grids_) {
      for (const IVec3 chunk : grid->chunks()) bytes += voxel_bytes(*grid->find_chunk(chunk));
    }
    for (const DensityGrid* field : fields_) {
      for (const IVec3 chunk : field->chunks()) bytes += voxel_bytes(*field->find_chunk(chunk));
    }
    return bytes;
  }

  Result<SceneText::Pieces> pieces(VoxelCompression compression, Threads threads, const Progress& progress) const {
    const double share = share_of_voxels();
    const bool has_data = std::ranges::any_of(grids_, [](const Grid* grid) { return grid->data_count() != 0; });
    const double end = has_data ? 0.9 : 1.0;
    auto voxels = encode_voxels(grids_, compression, threads, part_of(progress, 0.0, share * end));
    if (!voxels) return voxels.error();
    auto densities = encode_fields(fields_, compression, threads, part_of(progress, share * end, end));
    if (!densities) return densities.error();
    auto data = encode_data(grids_, compression, threads, part_of(progress, end, 1.0));
    if (!data) return data.error();
    return SceneText::Pieces{std::move(*voxels), std::move(*densities), std::move(*data)};
  }

 private:
  // Of the work; a chunk of a field is twice as large.
  [[nodiscard]] double share_of_voxels() const {
    double voxels = 0.0;
    double densities = 0.0;
    for (const Grid* grid : grids_) voxels += static_cast<double>(grid->chunk_count());
    for (const DensityGrid* field : fields_) densities += 2.0 * static_cast<double>(field->chunk_count());
    return densities == 0.0 ? 1.0 : voxels / (voxels + densities);
  }

  std::vector<const Grid*> grids_;
  std::vector<const DensityGrid*> fields_;
};

Result<std::string> text_of(const SceneFile& scene, const Contents& contents, VoxelCompression compression,
                            Threads threads, const Progress& progress) {
  const auto pieces = contents.pieces(compression, threads, progress);
  if (!pieces) return pieces.error();
  return SceneText().write(scene, *pieces);
}

// Whatever the reader refuses is not written. Voxels, which it takes as they are written, are left out here.
Status check_readable(const SceneFile& scene) {
  const SceneText::Texts none(scene.grids.size());
  const auto text = SceneText().write(scene, {none, none, none});
  if (!text) return text.error();
  const auto read = parse_scene_file(std::as_bytes(std::span(*text)));
  if (read) return {};
  const bool is_limit = read.error().code == ErrorCode::LimitExceeded;
  return make_error(is_limit ? ErrorCode::LimitExceeded : ErrorCode::InvalidArgument, read.error().message);
}

template <class T>
std::optional<std::size_t> place_of(const std::map<Handle<T>, std::size_t>& places, Handle<T> handle) {
  const auto found = places.find(handle);
  return found == places.end() ? std::nullopt : std::optional(found->second);
}

// Where a scene's elements are in the lists of its file.
struct PlacesInFile {
  std::map<GridHandle, std::size_t> grids;
  std::map<LayerHandle, std::size_t> layers;
  std::map<GroupHandle, std::size_t> groups;
};

PlacesInFile put_grids_and_groups(const Scene& scene, SceneFile& file) {
  PlacesInFile places;
  scene.grids().for_each([&](GridHandle handle, const SceneGrid& grid) {
    places.grids[handle] = file.grids.size();
    file.grids.push_back({grid.name, grid.grid.snapshot(), grid.pivot, grid.canvas, grid.field.snapshot()});
  });
  scene.layers().for_each([&](LayerHandle handle, const SceneLayer& layer) {
    places.layers[handle] = file.layers.size();
    file.layers.push_back(layer);
  });
  for (const GroupHandle handle : groups_from_top(scene)) {
    const SceneGroup& group = scene.groups()[handle];
    places.groups[handle] = file.groups.size();
    file.groups.push_back({group.name, place_of(places.groups, parent_of(scene, handle)),
                           place_of(places.layers, group.layer), group.position, group.rotation, group.mirrored,
                           group.visible});
  }
  return places;
}

}  // namespace

Result<SceneFile> scene_file_of(const Scene& scene) {
  SceneFile file;
  file.types = scene.types;
  file.lamps = scene.lamps;
  const PlacesInFile places = put_grids_and_groups(scene, file);
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const std::optional<std::size_t> grid = place_of(places.grids, instance.grid);
    if (!grid) {
      return make_error(ErrorCode::InvalidArgument, "the grid of instance \"" + instance.name + "\" is not there");
    }
    file.placements.push_back({.source = {},
                               .grid = grid,
                               .name = instance.name,
                               .position = instance.position,
                               .rotation = instance.rotation,
                               .scale = instance.voxel_size,
                               .mirrored = instance.mirrored,
                               .visible = instance.visible,
                               .group = place_of(places.groups, instance.group),
                               .layer = place_of(places.layers, instance.layer),
                               .categories = instance.categories == Instance().categories
                                                 ? std::nullopt
                                                 : std::optional<std::uint32_t>(instance.categories)});
  }
  return file;
}

Result<std::vector<std::byte>> write_scene_file(const SceneFile& scene, Threads threads, const Progress& progress) {
  if (auto sound = check_types(scene); !sound) return sound.error();
  if (auto sound = check_data(scene); !sound) return sound.error();
  if (auto sound = check_readable(scene); !sound) return sound.error();
  const Contents contents(scene);
  auto text = text_of(scene, contents, VoxelCompression::Small, threads, progress);
  if (text && contents.bytes() > max_voxel_bytes(text->size())) {
    // By now it is all but done: whoever listens may still cancel it.
    text = text_of(scene, contents, VoxelCompression::Stored, threads, part_of(progress, 1.0, 1.0));
  }
  if (!text) return text.error();
  const auto bytes = std::as_bytes(std::span(*text));
  if (bytes.size() > kMaxSceneFileBytes) {
    return make_error(ErrorCode::LimitExceeded, "a scene file of more than 2 GiB");
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::uint64_t> write_scene_file(const SceneFile& scene, const std::filesystem::path& path, Threads threads,
                                       const Progress& progress) {
  return write_whole(path, write_scene_file(scene, threads, progress));
}

}  // namespace quoin
