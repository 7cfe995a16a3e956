#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/function_ref.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/scene/volume_scene.h>

#include "io/format_driver.h"
#include "io/vdb/vdb.h"
#include "io/whole_file.h"

namespace quoin::vdb {

namespace {

constexpr float kMaxBand = 8.0F;
constexpr std::size_t kMaxFilledChunks = std::size_t{1} << 20;
constexpr double kMaxFog = 0x1p27;
constexpr VoxelType kMaterial = 1;

/// Returns the placement of an index space in the world, if its voxels are cubes.
std::optional<Instance> place_of(const glm::dmat4& world_from_index) {
  constexpr double kTolerance = 1e-4;
  Instance placed;
  placed.position = DVec3(world_from_index[3]);
  glm::dmat3 axes(world_from_index);
  placed.voxel_size = glm::length(axes[0]);
  if (!(placed.voxel_size > 0.0) || !std::isfinite(placed.voxel_size) || !is_finite(placed.position))
    return std::nullopt;
  for (int axis = 0; axis < 3; ++axis) axes[axis] /= placed.voxel_size;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::abs(glm::length(axes[axis]) - 1.0) < kTolerance)) return std::nullopt;
    if (!(std::abs(glm::dot(axes[axis], axes[(axis + 1) % 3])) < kTolerance)) return std::nullopt;
  }
  placed.mirrored = glm::determinant(axes) < 0.0;
  if (placed.mirrored) axes[0] = -axes[0];
  placed.rotation = glm::normalize(glm::quat_cast(axes));
  return placed;
}

/// A leaf or a tile in a chunk, or a tile that fills the chunk.
struct Piece {
  IVec3 chunk{0};
  std::uint32_t index = 0;
  bool is_tile = false;
};

/// Returns a tree's content by chunk, with the tiles that satisfy `is_wanted`.
Result<std::vector<Piece>> pieces_of(const Grid& grid, FunctionRef<bool(const Tile&)> is_wanted) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < grid.leaves.size(); ++i) {
    pieces.push_back({chunk_of(grid.leaves[i].origin), static_cast<std::uint32_t>(i), false});
  }
  std::size_t filled = 0;
  for (std::size_t i = 0; i < grid.tiles.size(); ++i) {
    const Tile& tile = grid.tiles[i];
    if (!is_wanted(tile)) continue;
    const IVec3 first = chunk_of(tile.origin);
    const int edge = std::max(tile.edge / kChunkEdge, 1);
    const auto count = static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
    if (tile.edge > kLeafEdge) filled += count;
    if (filled > kMaxFilledChunks) {
      return make_error(ErrorCode::LimitExceeded, "the tiles fill more than 2^20 chunks");
    }
    for (int z = 0; z < edge; ++z) {
      for (int y = 0; y < edge; ++y) {
        for (int x = 0; x < edge; ++x) {
          pieces.push_back({first + IVec3{x, y, z}, static_cast<std::uint32_t>(i), true});
        }
      }
    }
  }
  std::ranges::stable_sort(pieces, {}, [](const Piece& p) { return std::tuple(p.chunk.z, p.chunk.y, p.chunk.x); });
  return pieces;
}

/// Calls `make(pieces of a chunk)` on several threads, then `put(chunk, result)` in order.
template <class Made>
Status for_chunks(const std::vector<Piece>& pieces, Threads threads, const Progress& progress,
                  FunctionRef<Made(std::span<const Piece>)> make, FunctionRef<void(IVec3, Made)> put) {
  constexpr std::size_t kBatch = 64;
  std::vector<std::span<const Piece>> batch;
  std::vector<std::optional<Made>> made(kBatch);
  for (std::size_t at = 0; at < pieces.size();) {
    if (progress && !progress(static_cast<double>(at) / static_cast<double>(pieces.size()))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
    batch.clear();
    while (at < pieces.size() && batch.size() < kBatch) {
      const std::size_t begin = at;
      while (at < pieces.size() && pieces[at].chunk == pieces[begin].chunk) ++at;
      batch.push_back(std::span(pieces).subspan(begin, at - begin));
    }
    parallel_for(batch.size(), threads, [&](std::size_t i) { made[i] = make(batch[i]); });
    for (std::size_t i = 0; i < batch.size(); ++i) put(batch[i].front().chunk, std::move(*made[i]));
  }
  return {};
}

/// Calls `set(index in a chunk's rows, index in a leaf)` for all voxels of a leaf.
template <class Set>
void for_leaf(IVec3 origin, Set set) {
  QUOIN_ASSERT(((origin.x | origin.y | origin.z) & (kLeafEdge - 1)) == 0, "a multiple of 8");
  const IVec3 corner = local_of(origin);
  for (int x = 0; x < kLeafEdge; ++x) {
    for (int y = 0; y < kLeafEdge; ++y) {
      for (int z = 0; z < kLeafEdge; ++z) {
        const IVec3 at = corner + IVec3{x, y, z};
        set(static_cast<std::size_t>((at.z * kChunkEdge + at.y) * kChunkEdge + at.x), place_in_leaf(x, y, z));
      }
    }
  }
}

DensityChunk level_set_chunk(const Grid& grid, std::span<const Piece> pieces, float samples_of_world, float band) {
  const auto stored = [&](float value) { return stored_density(value * samples_of_world, band); };
  DensityChunk chunk(stored_density(band, band), kMaterial);
  if (pieces.size() == 1 && pieces[0].is_tile && grid.tiles[pieces[0].index].edge > kLeafEdge) {
    return DensityChunk(stored(grid.tiles[pieces[0].index].value), kMaterial);
  }
  std::vector<Half> dense(kChunkVoxels, stored_density(band, band));
  for (const Piece& piece : pieces) {
    if (piece.is_tile) {
      const Tile& tile = grid.tiles[piece.index];
      const Half value = stored(tile.value);
      if (tile.edge > kLeafEdge) {
        std::ranges::fill(dense, value);
      } else {
        for_leaf(tile.origin, [&](std::size_t at, std::size_t) { dense[at] = value; });
      }
      continue;
    }
    QUOIN_ASSERT(grid.values.size() >= (std::size_t{piece.index} + 1) * kLeafVoxels, "the values of the leaf");
    const float* const values = grid.values.data() + std::size_t{piece.index} * kLeafVoxels;
    for_leaf(grid.leaves[piece.index].origin, [&](std::size_t at, std::size_t i) { dense[at] = stored(values[i]); });
  }
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::size_t row = static_cast<std::size_t>(z * kChunkEdge + y) * kChunkEdge;
      chunk.write_row(y, z, std::span<const Half, kChunkEdge>(dense.data() + row, kChunkEdge));
    }
  }
  chunk.compact();
  return chunk;
}

Chunk mask_chunk(const Grid& grid, std::span<const Piece> pieces) {
  std::vector<VoxelType> dense(kChunkVoxels, kAir);
  for (const Piece& piece : pieces) {
    if (piece.is_tile) {
      if (grid.tiles[piece.index].edge > kLeafEdge) return Chunk(kMaterial);
      for_leaf(grid.tiles[piece.index].origin, [&](std::size_t at, std::size_t) { dense[at] = kMaterial; });
      continue;
    }
    QUOIN_ASSERT(piece.index < grid.leaves.size(), "a leaf of the grid");
    const LeafMask& there = grid.leaves[piece.index].active;
    for_leaf(grid.leaves[piece.index].origin, [&](std::size_t at, std::size_t i) {
      if ((there[i >> 6] >> (i & 63U) & 1U) != 0) dense[at] = kMaterial;
    });
  }
  return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
}

class SceneMaker {
 public:
  SceneMaker(File& file, const LoadOptions& options, Threads threads, const Progress& progress)
      : file_(file), options_(options), threads_(threads), progress_(progress) {}

  Result<LoadedScene> make() {
    VoxelProperties look;
    look.colour = VolumeSceneOptions{}.colour;
    if (const auto type = loaded_.scene.types.add(look); !type) return type.error();
    loaded_.format = "vdb";
    loaded_.warnings = std::move(file_.warnings);
    handles_.resize(file_.grids.size());
    origins_.resize(file_.grids.size(), IVec3(0));
    for (std::size_t i = 0; i < file_.grids.size(); ++i) {
      if (file_.grids[i].same_as != SIZE_MAX) continue;
      if (auto done = add(i); !done) return done.error();
    }
    for (std::size_t i = 0; i < file_.grids.size(); ++i) {
      const std::size_t first = file_.grids[i].same_as;
      QUOIN_ASSERT(first == SIZE_MAX || first < handles_.size(), "a grid of the file");
      if (first == SIZE_MAX || !handles_[first]) continue;
      place_again(file_.grids[i], *handles_[first], first);
    }
    if (loaded_.scene.instances().handles().empty() && !loaded_.warnings.empty()) {
      return make_error(ErrorCode::Unsupported, loaded_.warnings.front());
    }
    return std::move(loaded_);
  }

 private:
  Status add(std::size_t i) {
    Grid& grid = file_.grids[i];
    const bool is_empty = grid.leaves.empty() && grid.tiles.empty();
    if (grid.meaning == Meaning::Fog && !is_empty) return add_fog(i);
    auto placed = place_of(grid.world_from_index);
    if (!placed) {
      loaded_.warnings.push_back("left out: the grid \"" + grid.name + "\", whose voxels are not cubes");
      return {};
    }
    const double band = double{grid.background} / placed->voxel_size;
    if (grid.meaning == Meaning::LevelSet && !(band > 0.0)) {
      loaded_.warnings.push_back("left out: the grid \"" + grid.name + "\", a level set without an outside");
      return {};
    }
    SceneGrid content;
    content.name = grid.name;
    Status filled = grid.meaning == Meaning::LevelSet ? fill_field(grid, *placed, band, content.field)
                                                      : fill_voxels(grid, content.grid);
    if (!filled) return filled;
    handles_[i] = loaded_.scene.add_grid(std::move(content));
    place(*placed, *handles_[i], grid);
    return {};
  }

  void place(Instance placed, GridHandle handle, const Grid& grid) {
    // Voxels are centred at their indices; samples are at them.
    if (grid.meaning == Meaning::Mask) {
      placed.position -= DVec3(glm::dmat3(grid.world_from_index) * DVec3(0.5));
    }
    placed.name = grid.name;
    placed.grid = handle;
    loaded_.scene.add_instance(std::move(placed));
  }

  void place_again(const Grid& grid, GridHandle handle, std::size_t first) {
    // A fog grid begins at the minimum corner of its box.
    glm::dmat4 matrix = grid.world_from_index;
    const DVec3 corner = DVec3(origins_[first]);
    matrix[3] = matrix * glm::dvec4(corner, 1.0);
    if (auto placed = place_of(matrix)) {
      place(std::move(*placed), handle, grid);
    } else {
      loaded_.warnings.push_back("left out: the grid \"" + grid.name + "\", whose voxels are not cubes");
    }
  }

  Status fill_field(const Grid& grid, const Instance& placed, double band, DensityGrid& field) const {
    const float kept = static_cast<float>(std::clamp(band, 1.0, double{kMaxBand}));
    field = DensityGrid(kept);
    const float stored_band = field.band();
    const auto pieces = pieces_of(grid, [](const Tile& tile) { return tile.value < 0.0F; });
    if (!pieces) return pieces.error();
    const auto samples_of_world = static_cast<float>(1.0 / placed.voxel_size);
    return for_chunks<DensityChunk>(
        *pieces, threads_, progress_,
        [&](std::span<const Piece> each) { return level_set_chunk(grid, each, samples_of_world, stored_band); },
        [&](IVec3 chunk, DensityChunk made) { field.put_chunk(chunk, std::move(made)); });
  }

  Status fill_voxels(const Grid& grid, quoin::Grid& voxels) const {
    const auto pieces = pieces_of(grid, [](const Tile& tile) { return tile.is_active && tile.value != 0.0F; });
    if (!pieces) return pieces.error();
    return for_chunks<Chunk>(
        *pieces, threads_, progress_, [&](std::span<const Piece> each) { return mask_chunk(grid, each); },
        [&](IVec3 chunk, Chunk made) { voxels.put_chunk(chunk, std::move(made)); });
  }

  Status add_fog(std::size_t i);
  void place_fog(const Scene& made, std::size_t i);

  File& file_;
  const LoadOptions& options_;
  Threads threads_;
  const Progress& progress_;
  LoadedScene loaded_;
  std::vector<std::optional<GridHandle>> handles_;  // by index in the file
  std::vector<IVec3> origins_;                      // minimum corners of the boxes of fog grids, in the same order
};

// Returns the smallest box around the content of a grid.
IBox box_of(const Grid& grid) {
  IBox box;
  const auto extend = [&](IVec3 origin, int edge) {
    const IBox cube{origin, origin + edge};
    box = box.empty() ? cube : IBox{glm::min(box.min, cube.min), glm::max(box.max, cube.max)};
  };
  for (const Leaf& leaf : grid.leaves) extend(leaf.origin, kLeafEdge);
  for (const Tile& tile : grid.tiles) extend(tile.origin, tile.edge);
  return box;
}

// Requires: the grid's content is in the box, which has values.size() voxels.
void fill_values(const Grid& grid, const IBox& box, std::vector<float>& values) {
  const IVec3 size = box.size();
  QUOIN_ASSERT(values.size() == static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                                    static_cast<std::size_t>(size.z),
               "a value for each voxel of the box");
  const auto at = [&](IVec3 place) -> float& {
    QUOIN_ASSERT(box.contains(place), "a voxel of the box");
    const IVec3 local = place - box.min;
    return values[static_cast<std::size_t>(local.x) +
                  static_cast<std::size_t>(size.x) *
                      (static_cast<std::size_t>(local.y) +
                       static_cast<std::size_t>(size.y) * static_cast<std::size_t>(local.z))];
  };
  for (const Tile& tile : grid.tiles) {
    for (int z = 0; z < tile.edge; ++z) {
      for (int y = 0; y < tile.edge; ++y) {
        std::fill_n(&at(tile.origin + IVec3{0, y, z}), tile.edge, tile.value);
      }
    }
  }
  for (std::size_t leaf = 0; leaf < grid.leaves.size(); ++leaf) {
    for (std::size_t k = 0; k < kLeafVoxels; ++k) {
      const auto place = static_cast<int>(k);
      at(grid.leaves[leaf].origin + IVec3{place >> 6, place >> 3 & 7, place & 7}) = grid.values[leaf * kLeafVoxels + k];
    }
  }
}

// Finds the minimum and maximum of the finite values (0 if there are none), and counts the others.
void find_range(Volume& volume) {
  std::tie(volume.min, volume.max) = std::pair(0.0F, 0.0F);
  bool has_finite = false;
  for (const float value : volume.values) {
    volume.nan_count += std::isnan(value) ? 1 : 0;
    volume.infinite_count += std::isinf(value) ? 1 : 0;
    if (!std::isfinite(value)) continue;
    volume.min = has_finite ? std::min(volume.min, value) : value;
    volume.max = has_finite ? std::max(volume.max, value) : value;
    has_finite = true;
  }
}

// Converts fog to a volume: the box around its content.
Status SceneMaker::add_fog(std::size_t i) {
  const Grid& grid = file_.grids[i];
  const IBox box = box_of(grid);
  const DVec3 size = DVec3(box.max) - DVec3(box.min);
  if (size.x * size.y * size.z > kMaxFog) {
    return make_error(ErrorCode::LimitExceeded, "the fog volume \"" + grid.name + "\" has more than 2^27 values");
  }
  Volume volume;
  volume.size = box.size();
  volume.format = "vdb";
  volume.values.assign(static_cast<std::size_t>(size.x * size.y * size.z), grid.background);
  fill_values(grid, box, volume.values);
  find_range(volume);
  if (volume.min == volume.max) {
    loaded_.warnings.push_back("the fog volume \"" + grid.name +
                               "\" has the same density everywhere, so none of it is solid");
  }
  origins_[i] = box.min;
  volume.world_from_voxel = grid.world_from_index;
  volume.world_from_voxel[3] = grid.world_from_index * glm::dvec4(DVec3(box.min), 1.0);
  const auto iso = surface_value(volume, options_.iso);
  if (!iso) return iso.error();
  VolumeSceneOptions wanted;
  wanted.iso = *iso;
  const auto made = scene_from_volume(volume, wanted, threads_, progress_);
  if (!made) {
    if (made.error().code == ErrorCode::Cancelled) return made.error();
    loaded_.warnings.push_back("left out: the grid \"" + grid.name + "\": " + made.error().message);
    return {};
  }
  place_fog(*made, i);
  return {};
}

// Adds the grid of a volume's scene to the loaded scene.
void SceneMaker::place_fog(const Scene& made, std::size_t i) {
  const std::string& name = file_.grids[i].name;
  SceneGrid content;
  content.name = name;
  content.field = made.grids()[made.grids().handles().front()].field.snapshot();
  handles_[i] = loaded_.scene.add_grid(std::move(content));
  Instance placed = made.instances()[made.instances().handles().front()];
  placed.name = name;
  placed.grid = *handles_[i];
  loaded_.scene.add_instance(std::move(placed));
}

}  // namespace

Result<LoadedScene> read_vdb(std::span<const std::byte> bytes, const LoadOptions& options, Threads threads,
                             const Progress& progress) {
  auto file = is_nvdb(bytes) ? read_nvdb_file(bytes) : read_vdb_file(bytes);
  if (!file) return file.error();
  return SceneMaker(*file, options, threads, progress).make();
}

}  // namespace quoin::vdb

namespace quoin {

extern constinit const FormatDriver kVdbFormat = {
    .info = {FileFormat::Vdb, ".vdb", "OpenVDB grids, also NanoVDB (.nvdb)",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Fields, ".nvdb"},
    .detect = [](std::span<const std::byte> beginning) { return vdb::is_vdb(beginning) || vdb::is_nvdb(beginning); },
    .read = [](const FormatInput& input) -> Result<LoadedScene> {
      return vdb::read_vdb(input.bytes, input.options, input.threads, input.progress);
    },
    .write = [](const FormatOutput& output, const std::filesystem::path& path) -> Result<SavedScene> {
      const auto written = write_whole(path, vdb::write_vdb(output.scene));
      if (!written) return written.error();
      return SavedScene{*written, vdb::vdb_unsupported_features(output.scene)};
    },
    .unsupported_features = [](const FormatOutput& output) -> Result<std::vector<std::string>> {
      return vdb::vdb_unsupported_features(output.scene);
    },
};

}  // namespace quoin
