#include <quoin/terrain/terrain.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "terrain/landform.h"
#include "terrain/smooth_ground.h"

namespace quoin {
namespace {

constexpr int kMaxAcross = 512;
constexpr int kMaxUp = 16;
constexpr int kMaxPlace = 1 << 19;
constexpr int kUnitsPerChunk = kChunkEdge / kTerrainUnit;
constexpr float kBand = 8.0F;

// Returns true if all types of a smooth world are set, as by add_terrain_types.
[[maybe_unused]] bool are_filled(const TerrainTypes& t) {
  const VoxelType all[] = {t.grass, t.earth, t.stone, t.sand, t.snow};
  return std::find(std::begin(all), std::end(all), kAir) == std::end(all);
}

Status check(const SmoothTerrainOptions& options) {
  const IVec3 size = options.size;
  if (std::min({size.x, size.y, size.z}) < 1 || size.y > kMaxUp || std::max(size.x, size.z) > kMaxAcross) {
    return make_error(ErrorCode::InvalidArgument,
                      "smooth terrain size: must be 1 to 512 chunks of 64 samples wide and deep, 1 to 16 high");
  }
  if (std::min(options.first_x, options.first_z) < -kMaxPlace ||
      std::max(options.first_x, options.first_z) > kMaxPlace) {
    return make_error(ErrorCode::InvalidArgument, "smooth terrain origin: must be at most 524288 chunks from 0");
  }
  return {};
}

terrain::Landform landform_of(const SmoothTerrainOptions& options) {
  TerrainOptions blocky;
  blocky.seed = options.seed;
  blocky.size = options.size * kUnitsPerChunk;
  blocky.water = false;
  return terrain::Landform(blocky);
}

IBox chunks_of(const SmoothTerrainOptions& options) {
  const IVec3 first{options.first_x, 0, options.first_z};
  return {first, first + options.size};
}

IBox samples_of(const IBox& chunks) {
  return {chunks.min * kChunkEdge, chunks.max * kChunkEdge};
}

}  // namespace

DensityChunk generate_smooth_terrain_chunk(const SmoothTerrainOptions& options, const TerrainTypes& types,
                                           IVec3 chunk) {
  QUOIN_ASSERT(check(options).has_value(), "sizes and origins within their ranges");
  QUOIN_ASSERT(are_filled(types), "types that add_terrain_types filled");
  const IBox chunks = chunks_of(options);
  if (!chunks.contains(chunk)) return DensityChunk(stored_density(kBand, kBand));
  const terrain::Landform land = landform_of(options);
  return terrain::SmoothColumn(land, options, samples_of(chunks), chunk.x, chunk.z).make(types, chunk.y);
}

Result<DensityGrid> generate_smooth_terrain(const SmoothTerrainOptions& options, const TerrainTypes& types,
                                            Threads threads, const Progress& progress) {
  if (auto sound = check(options); !sound) return sound.error();
  QUOIN_ASSERT(are_filled(types), "types that add_terrain_types filled");
  const terrain::Landform land = landform_of(options);
  const IBox chunks = chunks_of(options);
  const auto across = static_cast<std::size_t>(options.size.x);
  const auto up = static_cast<std::size_t>(options.size.y);
  const std::size_t count = across * static_cast<std::size_t>(options.size.z);
  // Batches allow progress reports and store chunks in a fixed order.
  constexpr std::size_t kBatch = 32;
  DensityGrid field(kBand);
  std::vector<std::optional<DensityChunk>> made(std::min(kBatch, count) * up);
  for (std::size_t first = 0; first < count; first += kBatch) {
    if (progress && !progress(static_cast<double>(first) / static_cast<double>(count))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
    const std::size_t batch = std::min(kBatch, count - first);
    const auto place = [&](std::size_t i) {
      return chunks.min + IVec3{static_cast<int>((first + i) % across), 0, static_cast<int>((first + i) / across)};
    };
    parallel_for(batch, threads, [&](std::size_t i) {
      terrain::SmoothColumn column(land, options, samples_of(chunks), place(i).x, place(i).z);
      for (std::size_t y = 0; y < up; ++y) made[i * up + y] = column.make(types, static_cast<int>(y));
    });
    for (std::size_t i = 0; i < batch * up; ++i) {
      field.put_chunk(place(i / up) + IVec3{0, static_cast<int>(i % up), 0}, std::move(*made[i]));
    }
  }
  if (progress) progress(1.0);
  return field;
}

}  // namespace quoin
