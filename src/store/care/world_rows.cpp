#include "store/care/world_rows.h"

#include <limits>
#include <utility>

#include "store/world/world_rules.h"

namespace quoin::store {

namespace {

constexpr std::int64_t kLastKey = std::numeric_limits<std::int64_t>::max();

// Whether the first row from a key on can be found.
bool can_seek(Statement& select, std::int64_t from) {
  const StatementScope scope(select);
  select.bind(0, from);
  return select.step().has_value();
}

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

Result<std::vector<KeyGap>> ChunkRows::each(FunctionRef<bool(std::int64_t, std::span<const std::byte>)> visit) {
  std::vector<KeyGap> gaps;
  auto rows = connection_.prepare("SELECT key, body FROM chunks WHERE key>=? ORDER BY key");
  if (!rows) {
    if (rows.error().code != ErrorCode::BadFormat) return rows.error();
    gaps.push_back({0, kLastKey, rows.error().message});
    return gaps;
  }
  auto seek = connection_.prepare("SELECT key, body FROM chunks WHERE key>=? ORDER BY key LIMIT 1");
  if (!seek) return seek.error();
  std::int64_t next = std::numeric_limits<std::int64_t>::min();
  while (true) {
    rows->bind(0, next);
    Result<bool> row = rows->step();
    while (row && *row) {
      const std::int64_t key = rows->integer(0);
      if (!visit(key, rows->bytes(1))) {
        rows->reset();
        return gaps;
      }
      if (key == kLastKey) return gaps;
      next = key + 1;
      row = rows->step();
    }
    rows->reset();
    if (row) return gaps;  // the end
    if (row.error().code != ErrorCode::BadFormat) return row.error();
    // A key behind the damage, near it: what is readable between two damaged pages may be taken for damaged too.
    std::int64_t unreadable = next;
    std::int64_t readable = next;
    for (std::uint64_t step = 1; !can_seek(*seek, readable); step *= 2) {
      if (readable == kLastKey) {
        gaps.push_back({next, kLastKey, row.error().message});
        return gaps;
      }
      unreadable = readable;
      const std::uint64_t room = static_cast<std::uint64_t>(kLastKey) - static_cast<std::uint64_t>(next);
      readable =
          step != 0 && step < room ? static_cast<std::int64_t>(static_cast<std::uint64_t>(next) + step) : kLastKey;
    }
    while (readable - unreadable > 1) {
      const std::int64_t middle = unreadable + (readable - unreadable) / 2;
      (can_seek(*seek, middle) ? readable : unreadable) = middle;
    }
    if (readable == next) readable = next + 1;  // it can be found, and not be read: its own pages are damaged
    gaps.push_back({next, readable - 1, row.error().message});
    next = readable;
  }
}

std::string about(const KeyGap& gap, const std::map<std::int64_t, RegionPlace>& regions) {
  const auto place_of = [&](std::int64_t key) -> std::optional<std::string> {
    const auto region = regions.find(key >> kRegionBits);
    if (region == regions.end()) return std::nullopt;
    return about(ChunkPlace{region->second.grid, region->second.level, chunk_of_key(region->second, key)});
  };
  const auto first = place_of(gap.first);
  const auto last = place_of(gap.last);
  return "unreadable: " + first.value_or("the table's beginning") + " to " + last.value_or("the end of the table") +
         ", along the curve";
}

}  // namespace quoin::store
