#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <unordered_set>
#include <utility>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/store/world_maintenance.h>

#include "core/bytes/files.h"
#include "core/database/connection.h"
#include "store/chunk/chunk_body.h"
#include "store/maintenance/page_scan.h"
#include "store/world/part_text.h"
#include "store/world/world_changes.h"
#include "store/world/world_open.h"
#include "store/world/world_reader.h"

namespace quoin::store {
namespace {

/// The sound parts of a damaged world except its chunks, and placeholders for lost parts.
class FoundParts {
 public:
  FoundParts();

  /// Takes all parts that SQLite can read. Returns false if it cannot read all of them.
  bool read(Connection& connection, std::vector<WorldDamage>& damage);
  /// Takes a record found in the file's pages, if it is a sound part and newer than the stored version.
  void add(const PageRecord& record);

  /// Returns the format version, if a record is the sound part that holds it.
  [[nodiscard]] static std::optional<int> version_of(const PageRecord& record);

  [[nodiscard]] float band(std::uint32_t grid) const;
  /// The maximum number of types: chunks are checked against these until the lost types are known.
  [[nodiscard]] const VoxelRegistry& any_types() const { return any_types_; }
  /// `add_grid` ensures that a grid exists, `add_types_up_to` that all types up to a number exist.
  void add_grid(std::uint32_t grid);
  void add_types_up_to(VoxelType last);
  /// Moves the parts added since the last call into `changes`.
  void move_to(WorldChanges& changes);

  /// Returns the number of sound parts.
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Returns a line for each lost item.
  [[nodiscard]] std::vector<std::string> lost() const { return lost_; }

 private:
  struct Found {
    std::uint64_t revision = 0;
    PartBody body;
  };
  void take(const Part& part);

  VoxelRegistry any_types_;
  std::map<PartKey, Found> parts_;
  std::set<PartKey> put_;
  std::size_t count_ = 0;
  std::int64_t types_put_ = 0;
  std::map<std::uint32_t, WorldGrid> grids_;
  std::set<std::size_t> placed_grids_;  // may exceed 32 bits in damaged worlds
  std::int64_t next_instance_ = 0;
  std::vector<std::string> lost_;
};

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
      placed_grids_.insert(*instance->grid);
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
  SceneFile::Placement placement;  // makes the grid visible
  placement.grid = grid;
  placement.instance.name = name;
  put({part::kInstance, next_instance_++}, text_of(placement));
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

}  // namespace
}  // namespace quoin::store

namespace quoin {

using namespace store;

namespace {

// Number of chunks per save; bounds memory.
constexpr std::size_t kSlice = 256;

/// Chunks on their way into the new world, with the types and grids that only they refer to.
class Output {
 public:
  explicit Output(WorldStore& world, FoundParts& parts) : world_(world), parts_(parts) {}

  Status put(const ChunkAddress& place, StoredChunk chunk) {
    for (const VoxelType type : chunk.voxels.types()) last_type_ = std::max(last_type_, type);
    if (chunk.densities) {
      for (const VoxelType type : chunk.densities->materials().types()) last_type_ = std::max(last_type_, type);
    }
    parts_.add_grid(place.grid);
    slice_.put_chunk(place, std::move(chunk));
    return slice_.chunk_count() < kSlice ? Status() : flush();
  }
  Status flush() {
    parts_.add_types_up_to(last_type_);
    parts_.move_to(slice_);
    const auto saved = world_.save(std::exchange(slice_, {}));
    if (!saved) return saved.error();
    return world_.flush();
  }

 private:
  WorldStore& world_;
  FoundParts& parts_;
  WorldChanges slice_;
  VoxelType last_type_ = kAir;
};

class Repair {
 public:
  Repair(const std::filesystem::path& from, const std::filesystem::path& fresh, const Progress& progress)
      : from_(from), fresh_(fresh), progress_(progress) {}

  Result<WorldCheck> run() {
    auto reader = open_reader(from_);
    if (!reader && reader.error().code == ErrorCode::Unsupported) {
      // A later Quoin wrote it; or the number itself is damaged, and the world has a different one elsewhere.
      bool is_known = false;
      const Status scanned = scan_records(from_, [&](const PageRecord& record) {
        const auto version = FoundParts::version_of(record);
        is_known = is_known || (version && *version <= kSchemaVersion);
      });
      if (!scanned || !is_known) return reader.error();
    } else if (!reader && reader.error().code != ErrorCode::BadFormat) {
      return reader.error();
    }
    if (!reader) report("the tables: " + reader.error().message);
    bool needs_scan = !reader;
    if (reader && !parts_.read(reader->connection(), check_.damage)) needs_scan = true;
    // All parts come first: chunks are checked against them.
    if (needs_scan) {
      const Status scanned = scan_parts();
      if (!scanned) return scanned.error();
    }
    const auto world = WorldParts::create_unsynced(fresh_, {});
    if (!world) return world.error();
    Output output(const_cast<WorldStore&>(*world), parts_);
    if (reader) {
      if (auto done = copy_rows(*reader, output); !done) return done.error();
    } else {
      gaps_.push_back({0, std::numeric_limits<std::int64_t>::max(), ""});
    }
    if (!gaps_.empty() || !lost_.empty()) {
      if (auto done = salvage_chunks(output); !done) return done.error();
    }
    if (auto done = output.flush(); !done) return done.error();
    for (const ChunkAddress& place : lost_) check_.damage.push_back({place, about(place) + " is lost"});
    for (std::string& line : parts_.lost()) report(std::move(line));
    check_.parts = parts_.count();
    if (check_.chunks == 0 && check_.parts == 0) {
      return make_error(ErrorCode::BadFormat, "cannot repair it: no world data found");
    }
    return std::move(check_);
  }

 private:
  void report(std::string line) { check_.damage.push_back({std::nullopt, std::move(line)}); }
  [[nodiscard]] bool is_cancelled() const { return progress_ && !progress_(0.5); }

  Status scan_parts() {
    return scan_records(from_, [&](const PageRecord& record) { parts_.add(record); });
  }

  Status copy_rows(WorldReader& reader, Output& output) {
    std::vector<std::string> damage;
    ChunkRows rows(reader.connection());
    const std::map<std::int64_t, RegionPlace> regions = rows.regions(damage);
    for (std::string& line : damage) report(std::move(line));
    Status fault;
    auto gaps = rows.each([&](std::int64_t key, std::span<const std::byte> body) {
      if (is_cancelled()) return RowVerdict::Stop;
      // The body's own address counts: the row's key may be wrong, or its region lost.
      const auto region = regions.find(key >> kRegionBits);
      const bool is_key_right = region != regions.end();
      if (const auto header = read_header(body)) {
        fault = take(*header, body, output);
        return !fault ? RowVerdict::Stop : is_key_right ? RowVerdict::Sound : RowVerdict::Damaged;
      }
      if (is_key_right) {
        lost_.insert({region->second.grid, region->second.level, chunk_of_key(region->second, key)});
      } else {
        report("the chunk with key " + std::to_string(key) + " is damaged");
      }
      return RowVerdict::Damaged;
    });
    if (!fault) return fault;
    if (is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    if (!gaps) return gaps.error();
    for (const KeyGap& gap : *gaps) report(about(gap, regions) + ": " + gap.why);
    gaps_ = std::move(*gaps);
    return {};
  }

  /// Adds a body with a correct checksum, unless there is a newer one.
  Status take(const ChunkBodyHeader& header, std::span<const std::byte> body, Output& output) {
    auto& newest = revisions_[header.place];
    if (newest > header.revision) return {};
    if (const Status listed = check_address(header.place); !listed) {
      if (newest == 0) check_.damage.push_back({header.place, listed.error().message});
      newest = std::max<std::uint64_t>(header.revision, 1);
      return {};
    }
    auto chunk = decoder_.decode(header.place, body, ChunkLimits{&parts_.any_types(), parts_.band(header.place.grid)});
    if (!chunk) {
      report(about(header.place) + ": " + chunk.error().message);
      return {};
    }
    if (newest == 0) ++check_.chunks;
    newest = std::max<std::uint64_t>(header.revision, 1);
    lost_.erase(header.place);
    return output.put(header.place, std::move(*chunk));
  }

  /// Covers rows that SQLite cannot read, or whose bytes are damaged: an older state of a chunk, left on an unused
  /// page, is better than none.
  Status salvage_chunks(Output& output) {
    Status fault;
    const auto read = revisions_;  // rows that SQLite could read are newer than bodies on unused pages
    Status scanned = scan_bodies(from_, [&](std::int64_t key, std::span<const std::byte> body) {
      const bool is_in_gap =
          std::ranges::any_of(gaps_, [&](const KeyGap& gap) { return gap.first <= key && key <= gap.last; });
      if (!fault || is_cancelled()) return;
      const auto header = read_header(body);
      if (!header || read.contains(header->place)) return;
      if (is_in_gap || lost_.contains(header->place) || salvaged_.contains(header->place)) {
        salvaged_.insert(header->place);
        fault = take(*header, body, output);
      }
    });
    if (!fault) return fault;
    if (is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    return scanned;
  }

  const std::filesystem::path& from_;
  const std::filesystem::path& fresh_;
  const Progress& progress_;
  WorldCheck check_;
  FoundParts parts_;
  ChunkDecoder decoder_;
  std::vector<KeyGap> gaps_;
  std::unordered_set<ChunkAddress, ChunkAddressHash> lost_;
  std::unordered_set<ChunkAddress, ChunkAddressHash> salvaged_;
  std::unordered_map<ChunkAddress, std::uint64_t, ChunkAddressHash> revisions_;
};

/// Replaces the damaged world by the new world; keeps the damaged content and its log under another name.
Result<std::filesystem::path> replace(const std::filesystem::path& fresh, const std::filesystem::path& path) {
  auto backup = FileBackup::of(path, FileBackup::Older::Kept);
  if (!backup) return backup.error();
  const std::filesystem::path kept = FileBackup::name_for(path, FileBackup::Older::Kept);
  if (auto done = backup->keep(); !done) return done.error();
  // From here on the damaged world has only the other name, so that no crash separates it from its log. The new world
  // must not find that log.
  std::error_code removed;
  std::filesystem::remove(path, removed);
  if (removed) return make_error(ErrorCode::CannotWrite, removed.message());
  for (const char* suffix : {"-wal", "-journal"}) {
    std::error_code error;
    const std::filesystem::path log = path.string() + suffix;
    if (!std::filesystem::exists(log, error)) continue;
    std::filesystem::rename(log, kept.string() + suffix, error);
    if (error) return make_error(ErrorCode::CannotWrite, error.message(), log.string());
  }
  remove_database_log(path);
  sync_folder(path.parent_path());
  if (auto done = move_in_place(fresh, path, Existing::Replaced); !done) return done.error();
  return kept;
}

}  // namespace

Result<WorldRepair> repair_world(const std::filesystem::path& from, const std::filesystem::path& to,
                                 const Progress& progress) {
  const bool is_in_place = is_same_file(from, to);
  const std::filesystem::path target = is_in_place ? follow_links(to) : to;
  const auto fail = [](const Error& error, const std::filesystem::path& path) {
    return with_path(Result<WorldRepair>(error), path);
  };
  if (const auto there = read_file_beginning(from, 1); !there) return there.error();
  auto lock = WorldLock::take(target);
  if (!lock) return fail(lock.error(), target);
  std::error_code error;
  if (!is_in_place && std::filesystem::exists(std::filesystem::symlink_status(target, error))) {
    return fail(make_error(ErrorCode::CannotWrite, "file already exists"), to);
  }
  const std::filesystem::path fresh = fresh_name(target);
  WorldRepair repair;
  auto check = Repair(from, fresh, progress).run();
  Status done = check ? Status() : Status(check.error());
  if (done && is_in_place) {
    auto kept = replace(fresh, target);
    if (kept) repair.kept = *kept;
    if (!kept) done = kept.error();
  } else if (done) {
    remove_database_log(target);
    done = move_in_place(fresh, target);
  }
  if (!done) {
    remove_database(fresh);
    return fail(done.error(), from);
  }
  repair.check = std::move(*check);
  return repair;
}

}  // namespace quoin
