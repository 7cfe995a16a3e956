#include "store/maintenance/found_parts.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "store/world/part_text.h"
#include "store/world/world_reader.h"
#include "store/world/world_rules.h"

namespace quoin::store {

namespace {

std::int64_t number_of(const PartKey& key) {
  const auto* const number = std::get_if<std::int64_t>(&key.id);
  return number != nullptr ? *number : -1;
}

// Returns the part in a record with columns kind, id, revision, sum, body, if its checksum is right. Lifetime: as the
// record.
std::optional<Part> sound_part(const PageRecord& record) {
  if (record.columns.size() != 5) return std::nullopt;
  const auto* const kind = std::get_if<std::string>(&record.columns[0]);
  const auto* const revision = std::get_if<std::int64_t>(&record.columns[2]);
  const auto* const sum = std::get_if<std::int64_t>(&record.columns[3]);
  const auto* const body = std::get_if<std::vector<std::byte>>(&record.columns[4]);
  if (kind == nullptr || revision == nullptr || sum == nullptr || body == nullptr) return std::nullopt;
  Part part{{*kind, std::int64_t{0}}, static_cast<std::uint64_t>(*revision), *body};
  if (const auto* const number = std::get_if<std::int64_t>(&record.columns[1])) {
    part.key.id = *number;
  } else if (const auto* const name = std::get_if<std::string>(&record.columns[1])) {
    part.key.id = *name;
  } else {
    return std::nullopt;
  }
  if (sum_of(part) != static_cast<std::uint64_t>(*sum)) return std::nullopt;
  return part;
}

}  // namespace

FoundParts::FoundParts() {
  while (any_types_.size() <= kMaxVoxelTypes) {
    if (!any_types_.add(lost_type(static_cast<std::int64_t>(any_types_.size())))) break;
  }
}

void FoundParts::take(const Part& part) {
  if (part.key.kind == part::kWorld) return;  // belongs to the damaged file
  if (!check_part(part.key, part.body)) {
    lost_.push_back(name_of(part.key) + " is not valid");
    return;
  }
  const auto found = parts_.find(part.key);
  if (found != parts_.end() && found->second.revision >= part.revision) return;
  if (found == parts_.end()) ++count_;
  parts_[part.key] = {part.revision, PartBody(part.body.begin(), part.body.end())};
  const std::int64_t number = number_of(part.key);
  if (part.key.kind == part::kGrid && number >= 0) {
    if (const auto grid = part_from<WorldGrid>(part.body, name_of(part.key))) {
      grids_[static_cast<std::uint32_t>(number)] = *grid;
    }
  }
  if (part.key.kind == part::kInstance) {
    next_instance_ = std::max(next_instance_, number + 1);
    if (const auto instance = part_from<SceneFile::Placement>(part.body, name_of(part.key))) {
      placed_grids_.insert(static_cast<std::uint32_t>(*instance->grid));
    }
  }
}

bool FoundParts::read(Connection& connection, std::vector<WorldDamage>& damage) {
  // Without the index, which may be damaged even if the table is not.
  auto rows = connection.prepare("SELECT id, revision, sum, body, kind FROM parts NOT INDEXED");
  if (!rows) {
    damage.push_back({std::nullopt, "parts: " + rows.error().message});
    return false;
  }
  bool is_whole = true;
  while (true) {
    const auto row = rows->step();
    if (!row) {
      damage.push_back({std::nullopt, "parts: " + row.error().message});
      return false;
    }
    if (!*row) return is_whole;
    std::uint64_t sum = 0;
    const auto part = part_of(*rows, rows->text(4), sum);
    if (part && sum_of(*part) == sum) {
      take(*part);
    } else {
      damage.push_back({std::nullopt, (part ? name_of(part->key) : std::string("a part")) + " is damaged"});
      is_whole = false;
    }
  }
}

void FoundParts::add(const PageRecord& record) {
  if (const auto part = sound_part(record)) take(*part);
}

std::optional<int> FoundParts::version_of(const PageRecord& record) {
  const auto part = sound_part(record);
  if (!part || part->key != PartKey{part::kWorld, std::string("version")}) return std::nullopt;
  return static_cast<int>(std::min<std::uint64_t>(number_in(part->body), std::numeric_limits<int>::max()));
}

float FoundParts::band(std::uint32_t grid) const {
  const auto found = grids_.find(grid);
  return found == grids_.end() ? WorldGrid{}.band : found->second.band;
}

void FoundParts::add_grid(std::uint32_t grid) {
  if (grids_.contains(grid)) return;
  const std::string name = "lost grid " + std::to_string(grid);
  lost_.push_back(name_of({part::kGrid, std::int64_t{grid}}) + ": its name, pivot and band are lost");
  const WorldGrid header{.name = name};
  const auto put = [&](const PartKey& key, const std::string& text) { parts_[key] = {0, body_of(text)}; };
  put({part::kGrid, std::int64_t{grid}}, text_of(header));
  grids_[grid] = header;
  if (placed_grids_.contains(grid)) return;
  SceneFile::Placement instance;  // makes the grid visible
  instance.grid = grid;
  instance.name = name;
  put({part::kInstance, next_instance_++}, text_of(instance));
}

void FoundParts::add_types_up_to(VoxelType last) {
  std::int64_t greatest = last;
  for (const auto& [key, found] : parts_) {
    if (key.kind == part::kType) greatest = std::max(greatest, number_of(key));
  }
  for (std::int64_t type = types_put_ + 1; type <= greatest; ++type) {
    const PartKey key{part::kType, type};
    if (parts_.contains(key)) continue;
    lost_.push_back(name_of(key) + " is lost");
    parts_[key] = {0, body_of(text_of(lost_type(type)))};
  }
  types_put_ = std::max(types_put_, greatest);
}

void FoundParts::move_to(WorldChanges& changes) {
  for (const auto& [key, found] : parts_) {
    if (put_.insert(key).second) WorldParts::put(changes, key, found.body);
  }
}

}  // namespace quoin::store
