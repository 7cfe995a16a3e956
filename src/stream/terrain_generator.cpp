#include "stream/terrain_generator.h"

#include <cstdint>
#include <utility>

#include <nlohmann/json.hpp>

#include <quoin/core/assert.h>
#include <quoin/stream/streamed_world.h>
#include <quoin/terrain/terrain.h>

namespace quoin {
namespace {

// Chunks from the origin, along x and z.
constexpr int kReach = 1 << 18;

class VoxelTerrain final : public ChunkGenerator {
 public:
  VoxelTerrain(const EndlessTerrain& terrain, const TerrainTypes& types) : terrain_(terrain), types_(types) {}

  [[nodiscard]] IBox chunks() const override { return {{-kReach, 0, -kReach}, {kReach, terrain_.height, kReach}}; }
  [[nodiscard]] Result<StoredChunk> make(IVec3 chunk, const Cancellation& /*cancelled*/) const override {
    QUOIN_ASSERT(chunks().contains(chunk), "a chunk of the landscape");
    // Trees end at a piece's sides: the chunk lies in the middle of one.
    constexpr int kUnits = kChunkEdge / kTerrainUnit;
    TerrainOptions piece;
    piece.seed = terrain_.seed;
    piece.size = {3 * kUnits, kUnits * terrain_.height, 3 * kUnits};
    piece.first_x = kUnits * (chunk.x - 1);
    piece.first_z = kUnits * (chunk.z - 1);
    return StoredChunk{generate_terrain_chunk(piece, types_, chunk)};
  }

 private:
  EndlessTerrain terrain_;
  TerrainTypes types_;
};

class SmoothTerrain final : public ChunkGenerator {
 public:
  SmoothTerrain(const EndlessTerrain& terrain, const TerrainTypes& types) : terrain_(terrain), types_(types) {}

  [[nodiscard]] IBox chunks() const override { return {{-kReach, 0, -kReach}, {kReach, terrain_.height, kReach}}; }
  [[nodiscard]] Result<StoredChunk> make(IVec3 chunk, const Cancellation& /*cancelled*/) const override {
    QUOIN_ASSERT(chunks().contains(chunk), "a chunk of the landscape");
    // A piece is closed at its sides: the chunk lies in the middle of one.
    SmoothTerrainOptions piece;
    piece.seed = terrain_.seed;
    piece.size = {3, terrain_.height, 3};
    piece.first_x = chunk.x - 1;
    piece.first_z = chunk.z - 1;
    StoredChunk made;
    made.densities = generate_smooth_terrain_chunk(piece, types_, chunk);
    return made;
  }

 private:
  EndlessTerrain terrain_;
  TerrainTypes types_;
};

}  // namespace

Result<std::shared_ptr<const ChunkGenerator>> make_terrain_generator(const EndlessTerrain& terrain,
                                                                     VoxelRegistry& types) {
  if (terrain.height < 1 || terrain.height > 16) {
    return make_error(ErrorCode::InvalidArgument, "height: must be 1 to 16 chunks");
  }
  const auto filled = add_terrain_types(types);
  if (!filled) return filled.error();
  std::shared_ptr<const ChunkGenerator> made;
  if (terrain.is_smooth) {
    made = std::make_shared<SmoothTerrain>(terrain, *filled);
  } else {
    made = std::make_shared<VoxelTerrain>(terrain, *filled);
  }
  return made;
}

}  // namespace quoin

namespace quoin::stream {

std::string terrain_value(std::uint32_t grid) {
  return "quoin.terrain." + std::to_string(grid);
}

std::vector<std::byte> bytes_of(const EndlessTerrain& terrain) {
  const nlohmann::json json{{"seed", terrain.seed}, {"height", terrain.height}, {"smooth", terrain.is_smooth}};
  const std::string text = json.dump();
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::optional<EndlessTerrain> terrain_from(std::span<const std::byte> bytes) {
  const auto* const text = reinterpret_cast<const char*>(bytes.data());  // NOLINT: UTF-8 as it was written
  const auto json = nlohmann::json::parse(text, text + bytes.size(), nullptr, false);
  if (!json.is_object() || !json.contains("seed") || !json["seed"].is_number_unsigned() || !json.contains("height") ||
      !json["height"].is_number_integer() || !json.contains("smooth") || !json["smooth"].is_boolean()) {
    return std::nullopt;
  }
  const auto height = json["height"].get<std::int64_t>();
  if (height < 1 || height > 16) return std::nullopt;
  return EndlessTerrain{json["seed"].get<std::uint64_t>(), static_cast<int>(height), json["smooth"].get<bool>()};
}

}  // namespace quoin::stream
