#include "store/database/schema.h"
#include "store/store_formats.h"

#include <algorithm>
#include <array>
#include <charconv>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace quoin::store {

namespace {

// Spreads bits 0 to 4 of a number to every third bit.
std::uint32_t spread(std::uint32_t bits) {
  QUOIN_ASSERT(bits < 32, "5 bits");
  bits = (bits | bits << 8) & 0x100FU;
  bits = (bits | bits << 4) & 0x10C3U;
  return (bits | bits << 2) & 0x1249U;
}

std::uint32_t gather(std::uint32_t bits) {
  bits &= 0x1249U;
  bits = (bits | bits >> 2) & 0x10C3U;
  bits = (bits | bits >> 4) & 0x100FU;
  return (bits | bits >> 8) & 0x1FU;
}

template <class Number>
void hash_number(XXH3_state_t& state, Number number) {
  std::array<std::uint8_t, sizeof(Number)> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(number) >> (8 * i));
  }
  XXH3_64bits_update(&state, bytes.data(), bytes.size());
}

void hash_text(XXH3_state_t& state, std::string_view text) {
  hash_number(state, std::uint64_t{text.size()});
  XXH3_64bits_update(&state, text.data(), text.size());
}

}  // namespace

Status create_schema(Connection& database) {
  static_assert(kWorldApplicationId == 0x51756F6E && kSchemaVersion == 6, "as in the statements");
  return database.run(
      "BEGIN;"
      "PRAGMA application_id=0x51756F6E;"
      "PRAGMA user_version=6;"
      "CREATE TABLE parts(kind TEXT NOT NULL, id NOT NULL, revision INTEGER NOT NULL, sum INTEGER NOT NULL,"
      " body BLOB NOT NULL);"
      "CREATE UNIQUE INDEX parts_by_id ON parts(kind, id);"
      "CREATE TABLE regions(id INTEGER PRIMARY KEY AUTOINCREMENT, grid INTEGER NOT NULL, level INTEGER NOT NULL,"
      " x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL);"
      "CREATE UNIQUE INDEX regions_by_place ON regions(grid, level, x, y, z);"
      "CREATE TABLE chunks(key INTEGER PRIMARY KEY, body BLOB NOT NULL);"
      "CREATE INDEX chunk_keys ON chunks(key);"
      "COMMIT");
}

Status check_schema(Connection& database) {
  const auto id = database.number("PRAGMA application_id");
  if (!id) return id.error();
  if (static_cast<std::uint32_t>(*id) != kWorldApplicationId) {
    return make_error(ErrorCode::BadFormat, "not a Quoin world (an SQLite database of another program)");
  }
  const auto version = database.number("PRAGMA user_version");
  if (!version) return version.error();
  if (*version > kSchemaVersion) {
    return make_error(ErrorCode::Unsupported, "world version " + std::to_string(*version) +
                                                  " needs a later Quoin; this one reads up to version " +
                                                  std::to_string(kSchemaVersion));
  }
  if (*version < 1) return make_error(ErrorCode::BadFormat, "the world has no version");
  const auto tables = database.number(
      "SELECT count(*) FROM sqlite_schema WHERE type='table' AND name IN ('parts', 'regions', 'chunks')");
  if (!tables) return tables.error();
  if (*tables != 3) return make_error(ErrorCode::BadFormat, "world tables are missing");
  return {};
}

RegionPlace region_of(const ChunkAddress& place) {
  const IVec3 c = place.chunk;
  return {place.grid, place.level, {c.x >> kRegionShift, c.y >> kRegionShift, c.z >> kRegionShift}};
}

std::int64_t key_of(std::int64_t region, IVec3 chunk) {
  QUOIN_ASSERT(region >= 0 && region <= kMaxRegion, "a region's id");
  const auto within = [](int i) { return static_cast<std::uint32_t>(i & (kRegionEdge - 1)); };
  const std::uint32_t code = spread(within(chunk.x)) | spread(within(chunk.y)) << 1 | spread(within(chunk.z)) << 2;
  return first_key(region) | code;
}

IVec3 chunk_of_key(const RegionPlace& region, std::int64_t key) {
  const auto code = static_cast<std::uint32_t>(key & ((1 << kRegionBits) - 1));
  const auto along = [&](int axis) {
    return static_cast<int>(static_cast<std::uint32_t>(region.region[axis]) << kRegionShift | gather(code >> axis));
  };
  return {along(0), along(1), along(2)};
}

std::vector<std::byte> body_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::uint64_t number_in(std::span<const std::byte> digits) {
  std::uint64_t number = 0;
  const char* const text = reinterpret_cast<const char*>(digits.data());
  std::from_chars(text, text + digits.size(), number);
  return number;
}

void bind(Statement& statement, int parameter, const PartId& id) {
  if (const auto* const number = std::get_if<std::int64_t>(&id)) {
    statement.bind(parameter, *number);
  } else {
    statement.bind(parameter, std::string_view(std::get<std::string>(id)));
  }
}

std::uint64_t sum_of(const Part& part) {
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  hash_text(state, part.key.kind);
  if (const auto* const number = std::get_if<std::int64_t>(&part.key.id)) {
    hash_number(state, *number);
  } else {
    hash_text(state, std::get<std::string>(part.key.id));
  }
  hash_number(state, part.revision);
  XXH3_64bits_update(&state, part.body.data(), part.body.size());
  return XXH3_64bits_digest(&state);
}

std::string name_of(const PartKey& key) {
  if (const auto* const number = std::get_if<std::int64_t>(&key.id)) return key.kind + " " + std::to_string(*number);
  return key.kind + " \"" + printable(std::get<std::string>(key.id)) + "\"";
}

}  // namespace quoin::store
