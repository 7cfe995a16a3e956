#include <algorithm>
#include <map>
#include <utility>

#include <nlohmann/json.hpp>
#include <quoin/io/scene_file.h>

#include "io/scene_file/scene_parts.h"
#include "io/scene_file/voxel_data.h"
#include "io/whole_file.h"

namespace quoin {
namespace {

using scene_json::is_same;
using scene_json::OrderedJson;
using scene_json::PartWriter;

/// Writes a scene file, and finds the format version that it needs.
class SceneText {
 public:
  using Texts = std::vector<std::vector<std::string>>;
  /// The encoded pieces, by grid.
  struct Pieces {
    Texts voxels;
    Texts densities;
    Texts data;
  };

  /// Errors: InvalidArgument.
  Result<std::string> write(const SceneFile& scene, const Pieces& pieces) {
    try {
      for (std::size_t type = 1; type < scene.types.size(); ++type) {
        types_.push_back(parts_.json_of(scene.types[static_cast<VoxelType>(type)]));
        const VoxelProperties& properties = scene.types[static_cast<VoxelType>(type)];
        is_fifth_ |= properties.state_bits != 0 || !is_same(properties.scattering, 0.0F) ||
                     !is_same(properties.anisotropy, 0.0F);
        is_seventh_ |=
            properties.blocks_light || properties.occludes || properties.light_cost != 0 || properties.remesh_on_data;
        is_eighth_ |= !properties.faces.empty();
        is_ninth_ |= !properties.orientations.empty() || !properties.shapes.empty() ||
                     !(properties.field_textures == FieldTextures{});
        is_tenth_ |= are_of_tenth(properties.shapes);
        for_each_look(properties, [&](const VoxelFace& look) {
          is_eleventh_ |= look.emission_share != VoxelFace{}.emission_share;
        });
      }
      for (std::size_t i = 0; i < scene.grids.size(); ++i) {
        put_grid(scene.grids[i], pieces.voxels[i], pieces.densities[i], pieces.data[i]);
        is_third_ |= !pieces.densities[i].empty();
        is_fifth_ |= !pieces.data[i].empty();
      }
      for (const SceneLayer& layer : scene.layers) layers_.push_back(parts_.json_of(layer));
      for (const SceneFile::Group& group : scene.groups) groups_.push_back(parts_.json_of(group));
      for (const SceneFile::Placement& placement : scene.placements) instances_.push_back(parts_.json_of(placement));
      for (const Lamp& lamp : scene.lamps) lamps_.push_back(parts_.json_of(lamp));
      if (scene.camera) camera_ = parts_.json_of(*scene.camera);
      is_sixth_ = scene.environment && !is_only_sun(*scene.environment);
      if (is_sixth_) environment_ = parts_.json_of(*scene.environment);
      return text_of(scene);
    } catch (const OrderedJson::type_error&) {  // from text; numbers that are not finite become null
      return make_error(ErrorCode::InvalidArgument, "an id or path is not UTF-8");
    }
  }

 private:
  void put_grid(const SceneGrid& grid, const std::vector<std::string>& voxels,
                const std::vector<std::string>& densities, const std::vector<std::string>& data) {
    OrderedJson json = parts_.json_of(grid);
    json["voxels"] = voxels;
    if (!densities.empty()) {
      json["band"] = grid.field.band();
      json["densities"] = densities;
    }
    if (!data.empty()) json["data"] = data;
    grids_.push_back(std::move(json));
  }

  [[nodiscard]] static OrderedJson json_of(const SceneFile::Source& source) {
    OrderedJson json = {{"id", source.id}, {"path", source.file}};
    for (const SceneFile::Pack& pack : source.packs) {
      OrderedJson entry = {{"path", pack.file}};
      if (!pack.hash.empty()) entry["hash"] = pack.hash;
      json["packs"].push_back(std::move(entry));
    }
    return json;
  }

  // One entry per line, so that people can search the file.
  void put_list(std::string& text, const char* key, const std::vector<OrderedJson>& entries) const {
    text.append(",\n  \"").append(key).append("\": [");
    const char* before = "\n    ";
    for (const OrderedJson& entry : entries) {
      text.append(std::exchange(before, ",\n    ")).append(entry.dump());
    }
    text += entries.empty() ? "]" : "\n  ]";
  }

  // Returns true if shapes have shares of positions or contain a fluid, which readers of version 9 do not know.
  [[nodiscard]] static bool are_of_tenth(const VoxelShapes& shapes) {
    if (shapes.empty()) return false;
    const auto has_share = [](const ShapeCondition& when) { return !(when.positions == PositionShare{}); };
    return shapes.rules().fluid.has_value() || std::ranges::any_of(shapes.rules().parts, [&](const ShapePart& part) {
             return std::ranges::any_of(part.when, has_share);
           });
  }

  [[nodiscard]] std::string text_of(const SceneFile& scene) const {
    const bool has_models = !types_.empty() || !grids_.empty();
    const bool is_fourth = !layers_.empty() || !groups_.empty();
    std::string text = "{\n  \"quoin_scene\": ";
    const bool is_tenth =
        is_tenth_ || std::ranges::any_of(scene.sources, [](const auto& source) { return !source.packs.empty(); });
    text += is_eleventh_                                             ? "11"
            : is_tenth                                               ? "10"
            : is_ninth_                                              ? "9"
            : is_eighth_                                             ? "8"
            : is_seventh_                                            ? "7"
            : is_sixth_                                              ? "6"
            : is_fifth_                                              ? "5"
            : is_fourth                                              ? "4"
            : is_third_                                              ? "3"
            : has_models || !lamps_.empty() || parts_.needs_second() ? "2"
                                                                     : "1";
    if (has_models) put_list(text, "types", types_);
    if (has_models) put_list(text, "grids", grids_);
    std::vector<OrderedJson> files;
    files.reserve(scene.sources.size());
    for (const SceneFile::Source& source : scene.sources) files.push_back(json_of(source));
    if (!has_models || !files.empty()) put_list(text, "files", files);
    if (!layers_.empty()) put_list(text, "layers", layers_);
    if (!groups_.empty()) put_list(text, "groups", groups_);
    put_list(text, "instances", instances_);
    if (!lamps_.empty()) put_list(text, "lamps", lamps_);
    if (is_sixth_) {
      text.append(",\n  \"environment\": ").append(environment_.dump());
    } else if (scene.environment) {
      const DVec3 sun = scene.environment->sun.direction;
      text.append(",\n  \"sun\": ").append(OrderedJson{sun.x, sun.y, sun.z}.dump());
    }
    if (scene.camera) text.append(",\n  \"camera\": ").append(camera_.dump());
    return text + "\n}\n";
  }

  std::vector<OrderedJson> types_;
  std::vector<OrderedJson> grids_;
  std::vector<OrderedJson> layers_;
  std::vector<OrderedJson> groups_;
  std::vector<OrderedJson> instances_;
  std::vector<OrderedJson> lamps_;
  OrderedJson camera_;
  OrderedJson environment_;
  PartWriter parts_;
  bool is_third_ = false;
  bool is_fifth_ = false;
  bool is_sixth_ = false;
  bool is_seventh_ = false;
  bool is_eighth_ = false;
  bool is_ninth_ = false;
  bool is_tenth_ = false;
  bool is_eleventh_ = false;
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
      if (fault.empty()) fault = find_state_error(voxel, data, scene.types[type]);
    });
    if (!fault.empty()) return make_error(ErrorCode::InvalidArgument, "grids[" + std::to_string(i) + "]: " + fault);
  }
  return {};
}

// The encoded voxels, densities and data of a file's grids.
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
  // Weights for progress; a chunk of a field is twice as large.
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

// Rejects scenes that the reader would reject. Voxels are omitted here, since the reader accepts all written voxels.
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

// The positions of a scene's elements in the lists of its file.
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
    file.groups.push_back(
        {group, place_of(places.groups, parent_of(scene, handle)), place_of(places.layers, group.layer)});
  }
  return places;
}

}  // namespace

Result<SceneFile> scene_file_of(const Scene& scene) {
  SceneFile file;
  file.types = scene.types;
  file.lamps = scene.lamps;
  file.environment = scene.environment;
  const PlacesInFile places = put_grids_and_groups(scene, file);
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const std::optional<std::size_t> grid = place_of(places.grids, instance.grid);
    if (!grid) {
      return make_error(ErrorCode::InvalidArgument,
                        "instance \"" + instance.name + "\" refers to a grid that does not exist");
    }
    file.placements.push_back(
        {instance, grid, place_of(places.groups, instance.group), place_of(places.layers, instance.layer)});
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
    // Almost done; the caller may still cancel.
    text = text_of(scene, contents, VoxelCompression::Stored, threads, part_of(progress, 1.0, 1.0));
  }
  if (!text) return text.error();
  const auto bytes = std::as_bytes(std::span(*text));
  if (bytes.size() > kMaxSceneFileBytes) {
    return make_error(ErrorCode::LimitExceeded, "the scene file would have more than 2 GiB");
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::uint64_t> write_scene_file(const SceneFile& scene, const std::filesystem::path& path, Threads threads,
                                       const Progress& progress) {
  return write_whole(path, write_scene_file(scene, threads, progress));
}

}  // namespace quoin
