#include "store/maintenance/world_rows.h"

#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <quoin/core/assert.h>

#include "store/world/world_rules.h"

namespace quoin::store {

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
