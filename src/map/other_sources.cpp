#include "map/other_sources.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/map/world_map.h>

#include "core/bytes/files.h"
#include "core/rows/packed_row.h"
#include "io/placed_grids.h"
#include "map/type_looks.h"

namespace quoin::map {

namespace {

namespace fs = std::filesystem;

/// Parts of chunks: one per column, from its lowest chunk to its highest. There can be wide gaps between.
struct Columns {
  std::vector<IBox> parts;
  std::vector<std::vector<int>> heights;  ///< of each part's chunks, upwards

  explicit Columns(std::vector<IVec3> chunks) {
    std::ranges::sort(chunks, {}, [](IVec3 c) { return std::tuple(c.z, c.x, c.y); });
    for (const IVec3 chunk : chunks) {
      if (parts.empty() || parts.back().min.x != chunk.x || parts.back().min.z != chunk.z) {
        parts.push_back({chunk, chunk + 1});
        heights.emplace_back();
      }
      parts.back().max.y = chunk.y + 1;
      heights.back().push_back(chunk.y);
    }
  }
};

IBox bounds_of(const std::vector<IBox>& parts) {
  IBox bounds;
  for (const IBox& part : parts) bounds = unite(bounds, part);
  return bounds;
}

/// Returns a hash of the looks of all types.
std::uint64_t hash_of_types(const VoxelRegistry& types) {
  std::uint64_t hash = kHashSeed;
  for (std::size_t i = 1; i < types.size(); ++i) {
    const TypeLook look = look_from_above(types, static_cast<VoxelType>(i));
    for (const float value : {look.colour.x, look.colour.y, look.colour.z, look.coverage}) {
      hash = mixed_with(hash, std::bit_cast<std::uint32_t>(value));
    }
    hash = mixed_with(hash, (look.is_fluid ? 1U : 0U) | (look.glows ? 2U : 0U));
  }
  return hash;
}

/// Returns a stamp of chunks that keep their types: worlds and scenes number them in the file.
std::uint64_t stamp_of(const std::vector<SourceChunk>& chunks, std::uint64_t types) {
  std::uint64_t stamp = types;
  for (const SourceChunk& each : chunks) {
    stamp = mixed_with(mixed_with(stamp, static_cast<std::uint32_t>(each.chunk.y)), each.voxels.content_hash());
  }
  return stamp == 0 ? 1 : stamp;
}

/// A source whose types are all known when it is opened.
class FixedTypes : public ChunkSource {
 public:
  VoxelRegistry types() const override { return types_; }
  Result<std::uint64_t> part_stamp(std::size_t part) const override {
    const auto content = read_part(part);
    if (!content) return content.error();
    // A part that cannot be read is drawn again when it can.
    return content->broken.empty() ? stamp_of(content->chunks, types_hash_) : 0;
  }

 protected:
  FixedTypes(ChunkSourceInfo info, std::vector<IBox> parts, VoxelRegistry types)
      : ChunkSource(std::move(info), std::move(parts)), types_(std::move(types)), types_hash_(hash_of_types(types_)) {}

 private:
  VoxelRegistry types_;
  std::uint64_t types_hash_;
};

class WorldSource final : public FixedTypes {
 public:
  WorldSource(ChunkSourceInfo info, Columns columns, VoxelRegistry types, WorldStore world, std::uint32_t grid)
      : FixedTypes(std::move(info), std::move(columns.parts), std::move(types)),
        heights_(std::move(columns.heights)),
        world_(std::move(world)),
        grid_(grid) {}

  Result<SourcePart> read_part(std::size_t part) const override {
    QUOIN_ASSERT(part < parts().size(), "a part of the source");
    SourcePart result;
    for (const int y : heights_[part]) {
      const IVec3 place{parts()[part].min.x, y, parts()[part].min.z};
      auto chunk = world_.load_chunk({.grid = grid_, .chunk = place});
      if (!chunk && chunk.error().code == ErrorCode::BadFormat) {
        result.broken.push_back(chunk.error());
      } else if (!chunk) {
        return chunk.error();
      } else if (*chunk && (*chunk)->voxels.uniform() != kAir) {
        result.chunks.push_back({place, std::move((*chunk)->voxels)});
      }
    }
    return result;
  }

 private:
  std::vector<std::vector<int>> heights_;  // by part
  WorldStore world_;
  std::uint32_t grid_;
};

class SceneSource final : public FixedTypes {
 public:
  SceneSource(ChunkSourceInfo info, Columns columns, VoxelRegistry types, Grid grid)
      : FixedTypes(std::move(info), std::move(columns.parts), std::move(types)),
        heights_(std::move(columns.heights)),
        grid_(std::move(grid)) {}

  Result<SourcePart> read_part(std::size_t part) const override {
    QUOIN_ASSERT(part < parts().size(), "a part of the source");
    SourcePart result;
    for (const int y : heights_[part]) {
      const IVec3 place{parts()[part].min.x, y, parts()[part].min.z};
      if (const Chunk* const chunk = grid_.find_chunk(place)) result.chunks.push_back({place, *chunk});
    }
    return result;
  }

 private:
  std::vector<std::vector<int>> heights_;  // by part
  Grid grid_;
};

}  // namespace

Result<std::unique_ptr<ChunkSource>> source_of_world(WorldStore world) {
  auto types = world.types();
  if (!types) return types.error();
  const auto grids = world.grids();
  if (!grids) return grids.error();
  ChunkSourceInfo info;
  info.format = "quoin";
  info.name = world.path().stem().string();
  std::vector<IVec3> most;
  std::uint32_t chosen = 0;
  for (const auto& [number, grid] : *grids) {
    auto chunks = world.chunks(number, 0);
    if (!chunks) return chunks.error();
    if (chunks->size() <= most.size()) continue;
    most = std::move(*chunks);
    chosen = number;
    if (!grid.name.empty()) info.name = grid.name;
  }
  if (grids->size() > 1) {
    info.warnings.push_back("the map shows the grid with the most chunks, and leaves out " +
                            with_thousands(static_cast<std::int64_t>(grids->size() - 1)) + " other grids");
  }
  Columns columns(std::move(most));
  info.chunks = bounds_of(columns.parts);
  return std::unique_ptr<ChunkSource>(
      new WorldSource(std::move(info), std::move(columns), std::move(*types), std::move(world), chosen));
}

Result<std::unique_ptr<ChunkSource>> source_of_scene(LoadedScene loaded, const fs::path& path) {
  auto merged = models::merge_grids(loaded.scene, {.extension = "maps",
                                                   .names = true,
                                                   .several = true,
                                                   .transparency = true,
                                                   .materials = true,
                                                   .type_names = true,
                                                   .place_in_units = true});
  if (!merged) return with_path(Result<std::unique_ptr<ChunkSource>>(merged.error()), path);
  ChunkSourceInfo info;
  info.format = loaded.format;
  info.name = path.stem().string();
  info.warnings = std::move(loaded.warnings);
  std::ranges::move(merged->warnings, std::back_inserter(info.warnings));
  Columns columns(merged->voxels.chunks());
  info.chunks = bounds_of(columns.parts);
  return std::unique_ptr<ChunkSource>(
      new SceneSource(std::move(info), std::move(columns), loaded.scene.types, std::move(merged->voxels)));
}

}  // namespace quoin::map

namespace quoin {

Result<std::unique_ptr<ChunkSource>> open_map_source(const std::filesystem::path& path, const LoadOptions& options,
                                                     Threads threads, const Progress& progress) {
  auto file = detect_file(path);
  if (!file) return file.error();
  if (can(file->format, FormatCapability::Chunks)) return open_chunk_source(*file, options.dimension);
  if (file->format == FileFormat::World) {
    auto world = WorldStore::open(path, WorldAccess::Read, threads);
    if (!world) return world.error();
    return map::source_of_world(std::move(*world));
  }
  auto loaded = load_scene(*file, options, threads, progress);
  if (!loaded) return loaded.error();
  return map::source_of_scene(std::move(*loaded), path);
}

}  // namespace quoin
