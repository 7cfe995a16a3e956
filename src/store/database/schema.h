#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/store/world_store.h>

#include "core/bytes/files.h"
#include "core/database/connection.h"

// The tables of a world; docs/formats/world.md documents them.
//
//   parts    kind, id -> body     the scene except its chunks, one JSON text per part; a game's values
//   regions  id <- grid, level, position of 32^3 chunks
//   chunks   key = region * 32768 + Morton code within it -> body (store/chunk/chunk_body.h); its keys have their own
//            index, since reading keys from the table would read the bodies

namespace quoin::store {

inline constexpr int kSchemaVersion = 6;
inline constexpr int kPageBytes = 8192;
/// Chunks along a region's edge.
inline constexpr int kRegionShift = 5;
inline constexpr int kRegionEdge = 1 << kRegionShift;
inline constexpr int kRegionBits = 3 * kRegionShift;

/// Makes the tables of an empty database.
[[nodiscard]] Status create_schema(Connection& database);
/// Checks that the tables exist, in a version that this program reads (from 1 on). `migrate` (world/world_open.h)
/// upgrades earlier versions before they are written.
/// Errors: BadFormat (another program's database), Unsupported (a later version).
[[nodiscard]] Status check_schema(Connection& database);

/// Returns `result`; its error names the world's file, as `with_path`, and the remedy for a damaged database.
template <class T>
[[nodiscard]] Result<T> with_world(Result<T> result, const std::filesystem::path& path) {
  if (!result && result.error().message == kDamagedDatabase) result.error().message += "; run quoin world repair";
  return with_path(std::move(result), path);
}

struct RegionPlace {
  std::uint32_t grid = 0;
  std::uint8_t level = 0;
  IVec3 region{0};
  bool operator==(const RegionPlace&) const = default;
  bool operator<(const RegionPlace& b) const {
    return std::tie(grid, level, region.z, region.y, region.x) <
           std::tie(b.grid, b.level, b.region.z, b.region.y, b.region.x);
  }
};

/// The range of possible chunks.
inline constexpr IBox kAllChunks{{-(1 << 26), -(1 << 26), -(1 << 26)}, {1 << 26, 1 << 26, 1 << 26}};

[[nodiscard]] RegionPlace region_of(const ChunkAddress& place);
[[nodiscard]] std::int64_t key_of(std::int64_t region, IVec3 chunk);
/// Returns the chunk of a key in a region. Ignores the upper bits of the key.
[[nodiscard]] IVec3 chunk_of_key(const RegionPlace& region, std::int64_t key);
/// Maximum region id: keys of larger ids would overflow int64.
inline constexpr std::int64_t kMaxRegion = (std::int64_t{1} << (62 - kRegionBits)) - 1;
/// Returns the first key of a region; of the number after the last region, the end of all keys.
[[nodiscard]] inline std::int64_t first_key(std::int64_t region) {
  QUOIN_ASSERT(region >= 0 && region <= kMaxRegion + 1, "a region's id");
  return region << kRegionBits;
}

/// The id of a part: a number or a name.
using PartId = std::variant<std::int64_t, std::string>;
struct PartKey {
  std::string kind;
  PartId id;
  bool operator<(const PartKey& b) const { return std::tie(kind, id) < std::tie(b.kind, b.id); }
  bool operator==(const PartKey& b) const = default;
};
struct Part {
  PartKey key;
  std::uint64_t revision = 0;
  std::span<const std::byte> body;
};

/// Maximum number of a part: far more parts than possible, and safe to increment.
inline constexpr std::int64_t kMaxPartNumber = std::int64_t{1} << 53;
/// Maximum number of a grid. Leaves one number above it.
inline constexpr std::int64_t kMaxGridNumber = 0xFFFF'FFFE;

/// Kinds of parts.
namespace part {
inline constexpr const char* kType = "type";
inline constexpr const char* kGrid = "grid";
inline constexpr const char* kInstance = "instance";
inline constexpr const char* kGroup = "group";
inline constexpr const char* kLayer = "layer";
inline constexpr const char* kLamp = "lamp";
inline constexpr const char* kCamera = "camera";
/// Id 0: the initial camera; the others are the "camera" parts.
inline constexpr const char* kView = "view";
/// Id 0: the direction of the sun in a scene whose environment has no other settings.
inline constexpr const char* kSun = "sun";
/// Id 0: the environment of any other scene with one.
inline constexpr const char* kEnvironment = "environment";
/// Id 0: a PNG.
inline constexpr const char* kThumbnail = "thumbnail";
inline constexpr const char* kValue = "value";
/// Properties of the world: id "revision", the number of its last commit as decimal digits; id "next_grid", in the same
/// form.
inline constexpr const char* kWorld = "world";
}  // namespace part

/// Converts a text to the body of a part.
[[nodiscard]] std::vector<std::byte> body_of(std::string_view text);
/// Parses a body of decimal digits; returns 0 if it is none.
[[nodiscard]] std::uint64_t number_in(std::span<const std::byte> digits);
/// Binds the id of a part.
void bind(Statement& statement, int parameter, const PartId& id);

/// Returns the XXH3 (64 bits) of kind, id, revision and body.
[[nodiscard]] std::uint64_t sum_of(const Part& part);
/// Returns a text such as "type 7" or "value \"inventory\"".
[[nodiscard]] std::string name_of(const PartKey& key);

}  // namespace quoin::store
