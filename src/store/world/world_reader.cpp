#include "store/world/world_reader.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <glm/common.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "store/world/world_changes.h"

namespace quoin::store {

namespace {

constexpr const char* kSelectChunk = "SELECT body FROM chunks WHERE key=?";
constexpr const char* kSelectRegionsIn =
    "SELECT id, x, y, z FROM regions WHERE grid=? AND level=? AND x BETWEEN ? AND ? AND y BETWEEN ? AND ?"
    " AND z BETWEEN ? AND ?";
constexpr const char* kSelectKeys = "SELECT key FROM chunks WHERE key BETWEEN ? AND ?";
constexpr const char* kSelectBodies = "SELECT key, body FROM chunks WHERE key BETWEEN ? AND ?";
constexpr const char* kSelectPart = "SELECT id, revision, sum, body FROM parts WHERE kind=? AND id=?";
constexpr const char* kSelectParts = "SELECT id, revision, sum, body FROM parts WHERE kind=? ORDER BY id";

// Returns true for few enough chunks to look each up. A range query reads the chunks' keys from their index; in a
// version 1 world it also reads the chunks.
bool is_small(const IBox& box) {
  const IVec3 size = box.size();
  return size.x * size.y * size.z <= 512;
}

IBox regions_of(const IBox& chunks) {
  QUOIN_ASSERT(!chunks.empty(), "a box with chunks");
  const IVec3 last = chunks.max - IVec3(1);
  return {{chunks.min.x >> kRegionShift, chunks.min.y >> kRegionShift, chunks.min.z >> kRegionShift},
          {(last.x >> kRegionShift) + 1, (last.y >> kRegionShift) + 1, (last.z >> kRegionShift) + 1}};
}

}  // namespace

std::optional<Part> part_of(Statement& row, std::string_view kind, std::uint64_t& sum) {
  if (!row.is_integer(1) || !row.is_integer(2) || !row.is_bytes(3)) return std::nullopt;
  if (!row.is_integer(0) && !row.is_bytes(0)) return std::nullopt;
  Part part;
  part.key.kind = kind;
  part.key.id = row.is_integer(0) ? PartId(row.integer(0)) : PartId(std::string(row.text(0)));
  part.revision = static_cast<std::uint64_t>(row.integer(1));
  sum = static_cast<std::uint64_t>(row.integer(2));
  part.body = row.bytes(3);
  return part;
}

Result<Statement*> WorldReader::ready(Statement& statement, const char* sql) {
  if (!statement.is_prepared()) {
    auto prepared = connection_.prepare(sql);
    if (!prepared) return prepared.error();
    statement = std::move(*prepared);
  }
  return &statement;
}

Result<std::optional<std::int64_t>> WorldReader::region_id(const RegionPlace& place) {
  if (const auto known = known_regions_.find(place); known != known_regions_.end()) return known->second;
  const auto statement = ready(region_, kSelectRegion);
  if (!statement) return statement.error();
  Statement& select = **statement;
  const StatementScope scope(select);
  select.bind(0, std::int64_t{place.grid});
  select.bind(1, std::int64_t{place.level});
  for (int axis = 0; axis < 3; ++axis) select.bind(2 + axis, std::int64_t{place.region[axis]});
  const auto row = select.step();
  if (!row) return row.error();
  if (!*row) return std::optional<std::int64_t>();
  const std::int64_t id = select.integer(0);
  if (id < 0 || id > kMaxRegion) return make_error(ErrorCode::BadFormat, "region number out of range");
  known_regions_[place] = id;
  return id;
}

Result<std::optional<BlockVector<std::byte>>> WorldReader::chunk_body(const ChunkAddress& place) {
  const RegionPlace wanted = region_of(place);
  const auto known = known_regions_.find(wanted);
  const bool was_known = known != known_regions_.end();
  const std::int64_t before = was_known ? known->second : -1;
  auto body = body_in_region(wanted, place.chunk);
  if (!body || *body || !was_known) return body;
  // The grid may have been removed and added again, with another region.
  known_regions_.erase(wanted);
  const auto now = region_id(wanted);
  if (!now) return now.error();
  return *now && **now != before ? body_in_region(wanted, place.chunk) : body;
}

Result<std::optional<BlockVector<std::byte>>> WorldReader::body_in_region(const RegionPlace& place, IVec3 chunk) {
  const auto region = region_id(place);
  if (!region) return region.error();
  if (!*region) return std::optional<BlockVector<std::byte>>();
  const auto statement = ready(chunk_, kSelectChunk);
  if (!statement) return statement.error();
  Statement& select = **statement;
  const StatementScope scope(select);
  select.bind(0, key_of(**region, chunk));
  const auto row = select.step();
  if (!row) return row.error();
  if (!*row) return std::optional<BlockVector<std::byte>>();
  const std::span<const std::byte> bytes = select.bytes(0);
  return BlockVector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::vector<WorldReader::Region>> WorldReader::find_regions(std::uint32_t grid, std::uint8_t level,
                                                                   const IBox& box) {
  const auto statement = ready(regions_in_, kSelectRegionsIn);
  if (!statement) return statement.error();
  Statement& select = **statement;
  const StatementScope scope(select);
  select.bind(0, std::int64_t{grid});
  select.bind(1, std::int64_t{level});
  for (int axis = 0; axis < 3; ++axis) {
    select.bind(2 + 2 * axis, std::int64_t{box.min[axis]});
    select.bind(3 + 2 * axis, std::int64_t{box.max[axis]} - 1);
  }
  std::vector<Region> found;
  while (true) {
    const auto row = select.step();
    if (!row) return row.error();
    if (!*row) break;
    const std::int64_t id = select.integer(0);
    if (id < 0 || id > kMaxRegion) return make_error(ErrorCode::BadFormat, "region number out of range");
    const auto along = [&](int column) { return static_cast<int>(select.integer(column)); };
    found.push_back({id, {grid, level, {along(1), along(2), along(3)}}});
  }
  std::ranges::sort(found, {}, &Region::id);
  return found;
}

Status WorldReader::find_chunks(std::uint32_t grid, std::uint8_t level, const IBox& box, std::vector<IVec3>& out) {
  if (box.empty()) return {};
  const auto regions = find_regions(grid, level, regions_of(box));
  if (!regions) return regions.error();
  const auto statement = ready(keys_, kSelectKeys);
  if (!statement) return statement.error();
  Statement& select = **statement;
  const auto add_keys = [&](const Region& region, std::int64_t first, std::int64_t last) -> Status {
    const StatementScope scope(select);
    select.bind(0, first);
    select.bind(1, last);
    while (true) {
      const auto row = select.step();
      if (!row) return row.error();
      if (!*row) return {};
      const IVec3 chunk = chunk_of_key(region.place, select.integer(0));
      if (box.contains(chunk)) out.push_back(chunk);
    }
  };
  for (const Region& region : *regions) {
    const IVec3 corner = region.place.region * kRegionEdge;
    const IBox part{glm::max(box.min, corner), glm::min(box.max, corner + IVec3(kRegionEdge))};
    if (!is_small(part)) {
      if (auto done = add_keys(region, first_key(region.id), first_key(region.id + 1) - 1); !done) return done;
      continue;
    }
    for (int z = part.min.z; z < part.max.z; ++z) {
      for (int y = part.min.y; y < part.max.y; ++y) {
        for (int x = part.min.x; x < part.max.x; ++x) {
          const std::int64_t key = key_of(region.id, {x, y, z});
          if (auto done = add_keys(region, key, key); !done) return done;
        }
      }
    }
  }
  return {};
}

Status WorldReader::each_body(std::uint32_t grid, std::uint8_t level,
                              FunctionRef<bool(const ChunkAddress&, std::span<const std::byte>)> visit) {
  const auto regions = find_regions(grid, level, kAllChunks);
  if (!regions) return regions.error();
  const auto statement = ready(bodies_, kSelectBodies);
  if (!statement) return statement.error();
  Statement& select = **statement;
  for (const Region& region : *regions) {
    const StatementScope scope(select);
    select.bind(0, first_key(region.id));
    select.bind(1, first_key(region.id + 1) - 1);
    while (true) {
      const auto row = select.step();
      if (!row) return row.error();
      if (!*row) break;
      const IVec3 chunk = chunk_of_key(region.place, select.integer(0));
      if (!visit({grid, level, chunk}, select.bytes(1))) return {};
    }
  }
  return {};
}

Status WorldReader::each_place(FunctionRef<bool(const ChunkAddress&)> visit) {
  std::map<std::int64_t, RegionPlace> places;
  auto regions = connection_.prepare("SELECT id, grid, level, x, y, z FROM regions");
  if (!regions) return regions.error();
  while (true) {
    const auto row = regions->step();
    if (!row) return row.error();
    if (!*row) break;
    const auto along = [&](int column) { return static_cast<int>(regions->integer(column)); };
    places[regions->integer(0)] = {static_cast<std::uint32_t>(regions->integer(1)),
                                   static_cast<std::uint8_t>(regions->integer(2)),
                                   {along(3), along(4), along(5)}};
  }
  auto keys = connection_.prepare("SELECT key FROM chunks");
  if (!keys) return keys.error();
  while (true) {
    const auto row = keys->step();
    if (!row) return row.error();
    if (!*row) return {};
    const auto region = places.find(keys->integer(0) >> kRegionBits);
    if (region == places.end()) continue;
    const RegionPlace& place = region->second;
    if (!visit({place.grid, place.level, chunk_of_key(place, keys->integer(0))})) return {};
  }
}

Result<std::vector<RegionPlace>> WorldReader::regions() {
  auto select = connection_.prepare("SELECT grid, level, x, y, z FROM regions ORDER BY id");
  if (!select) return select.error();
  std::vector<RegionPlace> found;
  while (true) {
    const auto row = select->step();
    if (!row) return row.error();
    if (!*row) return found;
    const auto along = [&](int column) { return static_cast<int>(select->integer(column)); };
    found.push_back({static_cast<std::uint32_t>(select->integer(0)),
                     static_cast<std::uint8_t>(select->integer(1)),
                     {along(2), along(3), along(4)}});
  }
}

Result<std::optional<std::vector<std::byte>>> WorldReader::part(const PartKey& key) {
  const auto statement = ready(part_, kSelectPart);
  if (!statement) return statement.error();
  Statement& select = **statement;
  const StatementScope scope(select);
  select.bind(0, key.kind);
  bind(select, 1, key.id);
  const auto row = select.step();
  if (!row) return row.error();
  if (!*row) return std::optional<std::vector<std::byte>>();
  std::uint64_t sum = 0;
  const auto found = part_of(select, key.kind, sum);
  if (!found || sum_of(*found) != sum) return make_error(ErrorCode::BadFormat, name_of(key) + " is damaged");
  return std::vector<std::byte>(found->body.begin(), found->body.end());
}

Status WorldReader::each_part(std::string_view kind, FunctionRef<void(const Part&, bool)> visit) {
  const auto statement = ready(parts_, kSelectParts);
  if (!statement) return statement.error();
  Statement& select = **statement;
  const StatementScope scope(select);
  select.bind(0, kind);
  while (true) {
    const auto row = select.step();
    if (!row) return row.error();
    if (!*row) return {};
    std::uint64_t sum = 0;
    const auto found = part_of(select, kind, sum);
    if (found) {
      visit(*found, sum_of(*found) == sum);
    } else {
      visit(Part{{std::string(kind), select.integer(0)}, 0, {}}, false);
    }
  }
}

namespace {

constexpr std::int64_t kLastKey = std::numeric_limits<std::int64_t>::max();

}  // namespace

std::map<std::int64_t, RegionPlace> ChunkRows::regions(std::vector<std::string>& damage) {
  std::map<std::int64_t, RegionPlace> found;
  auto select = connection_.prepare("SELECT id, grid, level, x, y, z FROM regions");
  if (!select) {
    damage.push_back("regions: " + select.error().message);
    return found;
  }
  while (true) {
    const auto row = select->step();
    if (!row) damage.push_back("regions: " + row.error().message);
    if (!row || !*row) return found;
    const auto along = [&](int column) { return static_cast<int>(select->integer(column)); };
    const std::int64_t grid = select->integer(1);
    const std::int64_t level = select->integer(2);
    if (grid < 0 || grid > std::int64_t{0xFFFFFFFF} || level < 0 || level > 255) continue;
    found[select->integer(0)] = {
        static_cast<std::uint32_t>(grid), static_cast<std::uint8_t>(level), {along(3), along(4), along(5)}};
  }
}

Result<std::vector<KeyGap>> ChunkRows::each(FunctionRef<RowVerdict(std::int64_t, std::span<const std::byte>)> visit) {
  constexpr std::int64_t kFirstKey = std::numeric_limits<std::int64_t>::min();
  std::vector<KeyGap> gaps;
  auto rows = connection_.prepare("SELECT key, body FROM chunks WHERE key>=? ORDER BY key");
  if (!rows) {
    if (rows.error().code != ErrorCode::BadFormat) return rows.error();
    gaps.push_back({kFirstKey, kLastKey, rows.error().message});
    return gaps;
  }
  std::set<std::int64_t> unsound;
  std::optional<KeyGap> gap;
  std::int64_t next = kFirstKey;    // after the last sound row
  std::int64_t resume = kFirstKey;  // first key of the next query
  std::uint64_t step = 1;
  while (true) {
    rows->bind(0, resume);
    Result<bool> row = rows->step();
    for (; row && *row; row = rows->step()) {
      const std::int64_t key = rows->integer(0);
      if (unsound.contains(key)) continue;
      const RowVerdict verdict = visit(key, rows->bytes(1));
      if (verdict == RowVerdict::Stop) {
        rows->reset();
        return gaps;
      }
      // A corrupt key gives no position for the rows after it.
      if (verdict == RowVerdict::Damaged) {
        unsound.insert(key);
        continue;
      }
      if (gap) {
        gap->last = key - 1;
        gaps.push_back(*std::exchange(gap, std::nullopt));
      }
      if (key == kLastKey) return gaps;
      next = key + 1;
      step = 1;
    }
    rows->reset();
    if (row) {  // the end
      if (gap) gaps.push_back(*gap);
      return gaps;
    }
    if (row.error().code != ErrorCode::BadFormat) return row.error();
    // Continues after the damage, at first near it. Readable rows between two damaged pages may also be reported as
    // damaged.
    if (!gap) gap = KeyGap{next, kLastKey, row.error().message};
    const std::uint64_t room = static_cast<std::uint64_t>(kLastKey) - static_cast<std::uint64_t>(next);
    if (step == 0 || step > room) {
      gaps.push_back(*gap);
      return gaps;
    }
    resume = static_cast<std::int64_t>(static_cast<std::uint64_t>(next) + step);
    step *= 2;
  }
}

std::string about(const KeyGap& gap, const std::map<std::int64_t, RegionPlace>& regions) {
  QUOIN_ASSERT(gap.first <= gap.last, "a range of keys");
  const auto place_of = [&](std::int64_t key) -> std::optional<std::string> {
    const auto region = regions.find(key >> kRegionBits);
    if (region == regions.end()) return std::nullopt;
    return about(ChunkAddress{region->second.grid, region->second.level, chunk_of_key(region->second, key)});
  };
  const auto first = place_of(gap.first);
  const auto last = place_of(gap.last);
  return "unreadable: " + first.value_or("the table's beginning") + " to " + last.value_or("the end of the table") +
         ", along the curve";
}

}  // namespace quoin::store
