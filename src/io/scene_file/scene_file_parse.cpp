#include <algorithm>
#include <array>
#include <atomic>
#include <initializer_list>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/io/scene_file.h>

#include "core/bytes/text.h"
#include "io/scene_file/json_reader.h"
#include "io/scene_file/scene_parts.h"
#include "io/scene_file/voxel_data.h"
#include "io/whole_file.h"

namespace quoin::scene_json {
namespace {

constexpr std::size_t kMaxGrids = std::size_t{1} << 22;

/// The text of a grid's content under one of its keys, with its position in the file.
struct Piece {
  enum class Kind : std::uint8_t { Voxels, Densities, Data };
  std::size_t grid = 0;
  std::size_t index = 0;
  const std::string* text = nullptr;
  Kind kind = Kind::Voxels;
};

constexpr const char* key_of(Piece::Kind kind) {
  constexpr std::array kKeys = {"voxels", "densities", "data"};
  return kKeys[static_cast<std::size_t>(kind)];
}

void read_pieces(const Object& object, Piece::Kind kind, std::size_t grid, std::vector<Piece>& pieces) {
  const char* const key = key_of(kind);
  std::size_t count = 0;
  read_list(object, key, std::numeric_limits<std::size_t>::max(), [&](const Json& piece, const Place& at) {
    if (piece.is_string()) {
      pieces.push_back({grid, count++, &piece.get_ref<const std::string&>(), kind});
    } else {
      object.faults().add(at, "must be a string");
    }
  });
}

SceneGrid grid_of(const Json& json, const Place& place, std::size_t index, std::vector<Piece>& pieces, Faults& faults) {
  const Object object(json, place, {"name", "pivot", "canvas", "voxels", "band", "densities", "data"}, faults);
  SceneGrid grid;
  read_grid_header(object, grid);
  read_pieces(object, Piece::Kind::Voxels, index, pieces);
  if (object.find("densities") != nullptr) {
    read_band(object, grid);
    read_pieces(object, Piece::Kind::Densities, index, pieces);
  }
  // After the voxels that hold it.
  if (object.find("data") != nullptr) read_pieces(object, Piece::Kind::Data, index, pieces);
  return grid;
}

std::string about(IVec3 chunk, std::string_view what) {
  std::string text = "chunk (";
  for (int axis = 0; axis < 3; ++axis) text.append(std::to_string(chunk[axis])).append(axis < 2 ? ", " : ") ");
  return text.append(what);
}

// Adds a piece's chunks to their grid. Returns a fault, or "".
std::string put(std::vector<PlacedChunk> chunks, Grid& grid) {
  for (PlacedChunk& chunk : chunks) {
    if (chunk.voxels.non_air_count() == 0) return about(chunk.place, "is empty");
    if (grid.find_chunk(chunk.place) != nullptr) return about(chunk.place, "is a duplicate");
    grid.put_chunk(chunk.place, std::move(chunk.voxels));
  }
  return "";
}

// As above, for a field.
std::string put(std::vector<PlacedDensities> chunks, DensityGrid& field) {
  for (PlacedDensities& chunk : chunks) {
    if (field.find_chunk(chunk.place) != nullptr) return about(chunk.place, "is a duplicate");
    field.put_chunk(chunk.place, std::move(chunk.samples));
    if (field.find_chunk(chunk.place) == nullptr) return about(chunk.place, "is empty");
  }
  return "";
}

// As above, for data of voxels that were added before.
std::string put(const DataPiece& piece, Grid& grid, const VoxelRegistry& types) {
  std::string fault;
  for_each_data(piece, [&](IVec3 voxel, const VoxelData& data) {
    const VoxelType type = grid.get(voxel);
    if (type == kAir) {
      fault = about(chunk_of(voxel), "has data for an air voxel");
    } else if (!grid.data(voxel).empty()) {
      fault = about(chunk_of(voxel), "has data twice for one voxel");
    } else if (fault = find_state_error(voxel, data, types[type]); fault.empty()) {
      grid.set_data(voxel, data);
    }
    return fault.empty();
  });
  return fault;
}

/// The result of decoding a piece.
struct Decoded {
  Result<std::vector<PlacedChunk>> voxels;
  Result<std::vector<PlacedDensities>> densities;
  Result<DataPiece> data;
};

/// Decodes all pieces; returns nullopt if their chunks need more than `max_bytes`.
std::optional<std::vector<Decoded>> decode(const std::vector<Piece>& pieces, const std::vector<SceneGrid>& grids,
                                           std::size_t type_count, std::size_t max_bytes, Threads threads) {
  std::vector<Decoded> decoded(pieces.size());
  std::atomic<std::size_t> bytes = 0;
  parallel_for(pieces.size(), threads, [&](std::size_t i) {
    if (bytes > max_bytes) return;
    const Piece& piece = pieces[i];
    if (piece.kind == Piece::Kind::Data) {
      auto& data = decoded[i].data;
      data = decode_data(*piece.text);
      if (data) bytes += data->memory;
      return;
    }
    if (piece.kind == Piece::Kind::Densities) {
      auto& densities = decoded[i].densities;
      densities = decode_field(*piece.text, type_count, grids[piece.grid].field.band());
      if (!densities) return;
      for (const PlacedDensities& chunk : *densities) bytes += voxel_bytes(chunk.samples);
      return;
    }
    auto& voxels = decoded[i].voxels;
    voxels = decode_voxels(*piece.text, type_count);
    if (!voxels) return;
    for (const PlacedChunk& chunk : *voxels) bytes += voxel_bytes(chunk.voxels);
  });
  if (bytes > max_bytes) return std::nullopt;
  return decoded;
}

// Adds a piece to its grid, or reports its fault.
template <class Chunks, class... Content>
void put_or_blame(Result<Chunks>& chunks, const Place& place, Faults& faults, Content&&... content) {
  if (!chunks) {
    faults.add(place, chunks.error().message, chunks.error().code);
  } else if (const std::string fault = put(std::move(*chunks), content...); !fault.empty()) {
    faults.add(place, fault);
  }
}

void read_voxels(const std::vector<Piece>& pieces, const VoxelRegistry& types, std::size_t file_bytes,
                 std::vector<SceneGrid>& grids, Threads threads, Faults& faults) {
  auto decoded = decode(pieces, grids, types.size(), max_voxel_bytes(file_bytes), threads);
  if (!decoded) {
    faults.add({nullptr, "grids", std::nullopt}, "the voxels need far more memory than the file has bytes",
               ErrorCode::LimitExceeded);
    return;
  }
  for (std::size_t i = 0; i < pieces.size() && !faults.error(); ++i) {
    const Piece& piece = pieces[i];
    const Place list{nullptr, "grids", std::nullopt};
    const Place grid{&list, {}, piece.grid};
    const Place of_content{&grid, key_of(piece.kind), std::nullopt};
    const Place place{&of_content, {}, piece.index};
    QUOIN_ASSERT(piece.grid < grids.size(), "a grid of the file");
    SceneGrid& into = grids[piece.grid];
    switch (piece.kind) {
      case Piece::Kind::Voxels:
        put_or_blame((*decoded)[i].voxels, place, faults, into.grid);
        break;
      case Piece::Kind::Densities:
        put_or_blame((*decoded)[i].densities, place, faults, into.field);
        break;
      case Piece::Kind::Data:
        put_or_blame((*decoded)[i].data, place, faults, into.grid, types);
        break;
    }
  }
}

/// Reads the list "types" of a scene file, if present: type 1, 2 and so on.
VoxelRegistry read_types(const Object& file) {
  VoxelRegistry types;
  if (file.find("types") == nullptr) return types;
  TexturesOfTypes textures;
  read_list(file, "types", kMaxVoxelTypes, [&](const Json& each, const Place& place) {
    const auto added = types.add(properties_of(each, place, textures, file.faults()));
    if (!added) file.faults().add(place, added.error().message, added.error().code);
  });
  return types;
}

/// Reads the list "grids" of a scene file of `file_bytes`, if present; its voxels use `types`.
std::vector<SceneGrid> read_grids(const Object& file, const VoxelRegistry& types, std::size_t file_bytes,
                                  Threads threads) {
  std::vector<SceneGrid> grids;
  if (file.find("grids") == nullptr) return grids;
  std::vector<Piece> pieces;
  read_list(file, "grids", kMaxGrids, [&](const Json& each, const Place& place) {
    grids.push_back(grid_of(each, place, grids.size(), pieces, file.faults()));
  });
  if (!file.faults().error()) read_voxels(pieces, types, file_bytes, grids, threads, file.faults());
  return grids;
}

}  // namespace
}  // namespace quoin::scene_json

namespace quoin {

namespace {

using namespace scene_json;

// Outside strings, where each byte may become a value of some tens of bytes.
constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxFiles = 65'536;
constexpr std::size_t kMaxInstances = std::size_t{1} << 22;
constexpr int kVersion = 11;
constexpr std::size_t kMaxPacks = 64;  // of a file

/// Reads the key "path", which names a file.
void read_path(const Object& object, std::string& path) {
  if (object.need("path") != nullptr) object.read("path", path);
  if (path.empty() || path.find('\0') != std::string::npos) {
    object.faults().add(object.place_of("path"), "must name a file");
  }
}

SceneFile::Pack pack_of(const Json& json, const Place& place, Faults& faults) {
  constexpr std::size_t kDigits = 16;
  const Object object(json, place, {"path", "hash"}, faults);
  SceneFile::Pack pack;
  read_path(object, pack.file);
  object.read("hash", pack.hash);
  const bool is_hash =
      pack.hash.size() == kDigits && pack.hash.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (object.find("hash") != nullptr && !is_hash) {
    faults.add(object.place_of("hash"), "must be 16 hexadecimal digits in lower case");
  }
  return pack;
}

SceneFile::Source source_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"id", "path", "packs"}, faults);
  SceneFile::Source source;
  if (object.need("id") != nullptr) object.read("id", source.id);
  read_path(object, source.file);
  if (object.find("packs") != nullptr) {
    read_list(object, "packs", kMaxPacks,
              [&](const Json& each, const Place& at) { source.packs.push_back(pack_of(each, at, faults)); });
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
    faults.add(file.place_of("quoin_scene"), "version " + version->dump() + " is not supported (1 to 11 are)",
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
