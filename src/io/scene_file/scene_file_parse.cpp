#include <algorithm>
#include <initializer_list>
#include <set>

#include <quoin/io/scene_file.h>

#include "core/bytes/text.h"
#include "io/scene_file/grids_parse.h"
#include "io/scene_file/json_reader.h"
#include "io/scene_file/scene_file.h"
#include "io/scene_file/scene_parts.h"
#include "io/scene_file/voxel_data.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

using namespace scene_json;

// Outside strings, where each byte may become a value of some tens of bytes.
constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxFiles = 65'536;
constexpr std::size_t kMaxInstances = std::size_t{1} << 22;
constexpr int kVersion = 6;

SceneFile::Source source_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"id", "path"}, faults);
  SceneFile::Source source;
  if (object.need("id") != nullptr) object.read("id", source.id);
  if (object.need("path") != nullptr) object.read("path", source.file);
  if (source.file.empty() || source.file.find('\0') != std::string::npos) {
    faults.add(object.place_of("path"), "must name a file");
  }
  return source;
}

// Reports unknown references to entries of other lists.
class NameCheck {
 public:
  NameCheck(const SceneFile& scene, Faults& faults) : scene_(scene), faults_(faults) {}

  // Checks that source ids differ, and that placements, groups and layers refer to existing entries.
  void check() {
    for (std::size_t i = 0; i < scene_.sources.size(); ++i) {
      if (!ids_.insert(scene_.sources[i].id).second) {
        add("files", i, "id", excerpt(scene_.sources[i].id) + " is a duplicate");
      }
    }
    for (std::size_t i = 0; i < scene_.groups.size(); ++i) {
      const SceneFile::Group& group = scene_.groups[i];
      if (group.parent && *group.parent >= i) {
        add("groups", i, "parent", "group " + std::to_string(*group.parent) + " does not come before it");
      }
      check_layer("groups", i, group.layer);
    }
    for (std::size_t i = 0; i < scene_.placements.size(); ++i) check_placement(i, scene_.placements[i]);
  }

 private:
  void check_placement(std::size_t i, const SceneFile::Placement& placement) {
    if (const auto& grid = placement.grid) {
      if (*grid >= scene_.grids.size())
        add("instances", i, "grid", "grid " + std::to_string(*grid) + " does not exist");
    } else if (!ids_.contains(placement.source)) {
      add("instances", i, "file", "no file has the id " + excerpt(placement.source));
    }
    if (placement.group && *placement.group >= scene_.groups.size()) {
      add("instances", i, "group", "group " + std::to_string(*placement.group) + " does not exist");
    }
    check_layer("instances", i, placement.layer);
  }
  void check_layer(std::string_view list, std::size_t i, const std::optional<std::size_t>& layer) {
    if (layer && *layer >= scene_.layers.size())
      add(list, i, "layer", "layer " + std::to_string(*layer) + " does not exist");
  }
  void add(std::string_view list, std::size_t i, std::string_view key, const std::string& what) {
    const Place whole{nullptr, list, std::nullopt};
    const Place entry{&whole, {}, i};
    faults_.add({&entry, key, std::nullopt}, what);
  }

  const SceneFile& scene_;
  Faults& faults_;
  std::set<std::string_view> ids_;
};

void read_file_object(const Json& json, std::size_t file_bytes, Threads threads, SceneFile& scene, Faults& faults) {
  const Place root;
  const Object file(json, root,
                    {"quoin_scene", "types", "grids", "files", "layers", "groups", "instances", "lamps", "sun",
                     "environment", "camera"},
                    faults);
  const Json* version = file.need("quoin_scene");
  if (version != nullptr && !version->is_number_unsigned())
    faults.add(file.place_of("quoin_scene"), "must be the version, a whole number");
  if (version != nullptr && version->is_number_unsigned() && (*version < 1 || *version > kVersion)) {
    faults.add(file.place_of("quoin_scene"), "version " + version->dump() + " is not supported (1 to 6 are)",
               ErrorCode::Unsupported);
  }
  scene.types = read_types(file);
  scene.grids = read_grids(file, scene.types, file_bytes, threads);
  if (file.find("grids") == nullptr || file.find("files") != nullptr) {
    read_list(file, "files", kMaxFiles,
              [&](const Json& each, const Place& place) { scene.sources.push_back(source_of(each, place, faults)); });
  }
  if (file.find("layers") != nullptr) {
    read_list(file, "layers", kMaxInstances,
              [&](const Json& each, const Place& place) { scene.layers.push_back(layer_of(each, place, faults)); });
  }
  if (file.find("groups") != nullptr) {
    read_list(file, "groups", kMaxInstances,
              [&](const Json& each, const Place& place) { scene.groups.push_back(group_of(each, place, faults)); });
  }
  read_list(file, "instances", kMaxInstances, [&](const Json& each, const Place& place) {
    scene.placements.push_back(placement_of(each, place, faults));
  });
  if (file.find("lamps") != nullptr) {
    read_list(file, "lamps", kMaxInstances,
              [&](const Json& each, const Place& place) { scene.lamps.push_back(lamp_of(each, place, faults)); });
  }
  if (const Json* sun = file.find("sun")) {
    const std::vector<double> v = unit(file.numbers(*sun, file.place_of("sun"), 3), file.place_of("sun"), faults);
    scene.environment = Environment::natural({v[0], v[1], v[2]});
  }
  if (const Json* environment = file.find("environment")) {
    const Place place = file.place_of("environment");
    if (scene.environment) faults.add(place, "must not stand next to \"sun\"; give the direction in it");
    scene.environment = environment_from(*environment, place, faults);
  }
  if (const Json* camera = file.find("camera")) scene.camera = camera_of(*camera, file.place_of("camera"), faults);
  if (!faults.error()) NameCheck(scene, faults).check();
}

}  // namespace

Result<SceneFile> parse_scene_file(std::span<const std::byte> text, Threads threads) {
  if (text.size() > kMaxSceneFileBytes) {
    return make_error(ErrorCode::LimitExceeded, "the scene file has more than 2 GiB");
  }
  const std::string_view chars(reinterpret_cast<const char*>(text.data()), text.size());
  const JsonExtent extent = json_extent(chars);
  if (extent.bytes_outside_strings > kMaxBytes) {
    return make_error(ErrorCode::LimitExceeded, "the scene file has more than 64 MiB outside its strings");
  }
  if (extent.depth > kMaxDepth) {
    return make_error(ErrorCode::LimitExceeded, "nested more than " + std::to_string(kMaxDepth) + " levels deep");
  }
  SceneFile scene;
  Faults faults;
  try {
    read_file_object(Json::parse(chars), chars.size(), threads, scene, faults);
  } catch (const Json::parse_error& error) {
    return make_error(ErrorCode::BadFormat, "not valid JSON", {}, error.byte == 0 ? 0 : error.byte - 1);
  } catch (const Json::exception&) {
    return make_error(ErrorCode::BadFormat, "a number is out of range");
  }
  if (faults.error()) return *faults.error();
  return scene;
}

bool is_scene_file(std::span<const std::byte> beginning) {
  const std::string_view text(reinterpret_cast<const char*>(beginning.data()),
                              std::min<std::size_t>(beginning.size(), 4096));
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{' &&
         text.find("\"quoin_scene\"") != std::string_view::npos;
}

Result<SceneFile> parse_scene_file(const std::filesystem::path& path, Threads threads) {
  return read_whole(path, [&](std::span<const std::byte> text) { return parse_scene_file(text, threads); });
}

}  // namespace quoin
