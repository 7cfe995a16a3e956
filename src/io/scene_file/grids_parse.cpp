#include "io/scene_file/grids_parse.h"

#include <array>
#include <atomic>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>

#include "io/scene_file/scene_parts.h"
#include "io/scene_file/voxel_data.h"

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

}  // namespace

VoxelRegistry read_types(const Object& file) {
  VoxelRegistry types;
  if (file.find("types") == nullptr) return types;
  read_list(file, "types", kMaxVoxelTypes, [&](const Json& each, const Place& place) {
    const auto added = types.add(properties_of(each, place, file.faults()));
    if (!added) file.faults().add(place, added.error().message, added.error().code);
  });
  return types;
}

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

}  // namespace quoin::scene_json
