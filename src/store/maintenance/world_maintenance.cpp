#include <quoin/store/world_maintenance.h>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <filesystem>
#include <map>
#include <string>
#include <system_error>
#include <utility>

#include <glm/common.hpp>

#include <quoin/io/file.h>

#include "core/bytes/files.h"
#include "core/database/connection.h"
#include "core/work/progress_steps.h"
#include "store/chunk/chunk_body.h"
#include "store/scene/world_file.h"
#include "store/world/part_text.h"
#include "store/world/world_changes.h"
#include "store/world/world_open.h"
#include "store/world/world_reader.h"

namespace quoin {

using namespace store;

namespace {

constexpr std::array kKinds = {part::kType,      part::kGrid,   part::kInstance, part::kGroup, part::kLayer,
                               part::kLamp,      part::kCamera, part::kView,     part::kSun,   part::kEnvironment,
                               part::kThumbnail, part::kValue,  part::kWorld};

std::uint64_t file_bytes(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  return error ? 0 : bytes;
}

Result<WorldSummary> summarize(const std::filesystem::path& path, const Progress& progress) {
  auto reader = open_reader(path);
  if (!reader) return reader.error();
  // Reads one consistent state.
  if (auto begun = reader->connection().run("BEGIN"); !begun) return begun.error();
  const auto rules = read_rules(*reader);
  if (!rules) return rules.error();
  WorldSummary summary;
  const auto version = reader->connection().number("PRAGMA user_version");
  if (!version) return version.error();
  summary.version = static_cast<int>(*version);
  summary.bytes = file_bytes(path) + file_bytes(path.string() + "-wal");
  summary.types = rules->types.size() - 1;
  for (const auto& [number, grid] : rules->grids) summary.grids[number].grid = grid;
  const auto count = [&](const char* kind, std::size_t& counted) {
    return reader->each_part(kind, [&](const Part&, bool) { ++counted; });
  };
  if (auto done = count(part::kInstance, summary.instances); !done) return done.error();
  if (auto done = count(part::kValue, summary.values); !done) return done.error();
  if (const auto revision = reader->part({part::kWorld, std::string("revision")}); revision && *revision) {
    summary.saves = number_in(**revision);
  }
  if (const auto thumbnail = reader->part({part::kThumbnail, std::int64_t{0}}); thumbnail && *thumbnail) {
    summary.thumbnail_bytes = (*thumbnail)->size();
  }
  std::uint64_t seen = 0;
  bool is_cancelled = false;
  const Status read = reader->each_place([&](const ChunkAddress& place) {
    auto& grid = summary.grids[place.grid];
    ++grid.by_level[place.level];
    if (place.level == 0) {
      ++grid.chunks;
      grid.chunk_bounds = unite(grid.chunk_bounds, IBox{place.chunk, place.chunk + IVec3(1)});
    }
    is_cancelled = progress && (++seen & 65'535U) == 0 && !progress(0.5);
    return !is_cancelled;
  });
  if (!read) return read.error();
  if (is_cancelled) return make_error(ErrorCode::Cancelled, "cancelled");
  return summary;
}

/// Checks rows one by one.
class Check {
 public:
  Check(WorldReader& reader, const Progress& progress, const std::filesystem::path& path)
      : reader_(reader), reading_(progress, file_bytes(path)) {}

  Result<WorldCheck> run() {
    // Reads one consistent state, even if others write to the world.
    if (auto begun = reader_.connection().run("BEGIN"); !begun) return begun.error();
    auto rules = read_rules(reader_);
    if (rules) {
      rules_ = std::move(*rules);
    } else if (rules.error().code == ErrorCode::BadFormat) {
      report("types and grids: " + rules.error().message);
    } else {
      return rules.error();
    }
    for (const char* const kind : kKinds) check_parts(kind);
    if (auto done = check_chunks(); !done) return done.error();
    if (auto done = check_tables(); !done) return done.error();
    return std::move(check_);
  }

 private:
  // Reports progress every 256 rows. Returns false if the caller cancelled.
  bool note_row(std::size_t bytes) {
    unreported_bytes_ += bytes;
    return (++rows_ & 255U) != 0 || reading_.add(static_cast<double>(std::exchange(unreported_bytes_, 0)));
  }
  void report(std::string line) { check_.damage.push_back({std::nullopt, std::move(line)}); }

  void check_parts(const char* kind) {
    const Status read = reader_.each_part(kind, [&](const Part& part, bool is_sound) {
      if (!is_sound) {
        report(name_of(part.key) + " is damaged");
      } else if (const Status sound = check_part(part.key, part.body); !sound) {
        report(sound.error().message);
      } else {
        ++check_.parts;
      }
    });
    if (!read) report(std::string(kind) + ": " + read.error().message);
  }

  Status check_chunks() {
    std::vector<std::string> damage;
    ChunkRows rows(reader_.connection());
    const std::map<std::int64_t, RegionPlace> regions = rows.regions(damage);
    for (std::string& line : damage) report(std::move(line));
    const auto gaps = rows.each([&](std::int64_t key, std::span<const std::byte> body) {
      if (!note_row(body.size())) return RowVerdict::Stop;
      const auto region = regions.find(key >> kRegionBits);
      if (region == regions.end()) {
        report("the chunk with key " + std::to_string(key) + " lies in a missing region");
        return RowVerdict::Damaged;
      }
      const ChunkAddress place{region->second.grid, region->second.level, chunk_of_key(region->second, key)};
      if (const Status listed = check_address(place); !listed) {
        check_.damage.push_back({place, listed.error().message});
        return RowVerdict::Damaged;
      }
      const auto grid = rules_.grids.find(place.grid);
      const float band = grid == rules_.grids.end() ? WorldGrid{}.band : grid->second.band;
      const auto chunk = decoder_.decode(place, body, ChunkLimits{&rules_.types, band});
      if (chunk) {
        ++check_.chunks;
        return RowVerdict::Sound;
      }
      check_.damage.push_back({place, about(place) + ": " + chunk.error().message});
      return RowVerdict::Damaged;
    });
    if (!gaps) return gaps.error();
    for (const KeyGap& gap : *gaps) report(about(gap, regions) + ": " + gap.why);
    return reading_.cancelled() ? Status(make_error(ErrorCode::Cancelled, "cancelled")) : Status();
  }

  // Checks structures that rows do not cover: indices, free pages.
  Status check_tables() {
    auto select = reader_.connection().prepare("PRAGMA integrity_check(20)");
    if (!select) return select.error().code == ErrorCode::BadFormat ? Status() : Status(select.error());
    while (true) {
      const auto row = select->step();
      if (!row) {
        if (row.error().code != ErrorCode::BadFormat) return row.error();
        report("the tables: " + row.error().message);
        return {};
      }
      if (!*row) return {};
      std::string line(select->text(0));
      std::ranges::replace(line, '\n', ' ');
      if (line != "ok") report("the tables: " + line);
    }
  }

  WorldReader& reader_;
  ProgressSteps reading_;  // bytes of the file
  std::size_t unreported_bytes_ = 0;
  unsigned rows_ = 0;
  ChunkDecoder decoder_;
  WorldRules rules_;
  WorldCheck check_;
};

Result<std::uint64_t> back_up(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::symlink_status(to, error))) {
    return make_error(ErrorCode::CannotWrite, "file already exists", to.string());
  }
  const auto lock = WorldLock::take(to);
  if (!lock) return with_world(Result<std::uint64_t>(lock.error()), to);
  const std::filesystem::path fresh = fresh_name(to);
  const Status done = [&]() -> Status {
    auto reader = with_world(open_reader(from), from);
    if (!reader) return reader.error();
    // Writing is allowed here because VACUUM INTO writes to another file.
    if (auto set = reader->connection().run("PRAGMA query_only=OFF"); !set) return set;
    auto copy = reader->connection().prepare("VACUUM INTO ?");
    if (!copy) return copy.error();
    copy->bind(0, std::string_view(fresh.native()));
    if (auto copied = copy->run(); !copied) {
      Error fault = copied.error();
      if (fault.path.empty()) fault.path = (fault.code == ErrorCode::CannotWrite ? to : from).string();
      return fault;
    }
    remove_database_log(to);
    return move_in_place(fresh, to);
  }();
  if (!done) {
    remove_database(fresh);
    return done.error();
  }
  return file_bytes(to);
}

Status compact(const std::filesystem::path& named) {
  const std::filesystem::path path = follow_links(named);
  const auto lock = WorldLock::take(path);
  if (!lock) return lock.error();
  auto connection = Connection::open(path.string(), Connection::Mode::Write);
  if (!connection) return connection.error();
  if (auto done = check_schema(*connection); !done) return done;
  if (!end_writing(*connection)) return make_error(ErrorCode::CannotWrite, "another program is reading it");
  if (auto done = connection->run("PRAGMA temp_store=FILE; VACUUM"); !done) return done;
  return connection->close();
}

}  // namespace

Result<WorldSummary> summarize_world(const std::filesystem::path& path, const Progress& progress) {
  return with_world(summarize(path, progress), path);
}

Result<WorldCheck> check_world(const std::filesystem::path& path, const Progress& progress) {
  auto reader = open_reader(path);
  if (!reader) return with_world(Result<WorldCheck>(reader.error()), path);
  return with_world(Check(*reader, progress, path).run(), path);
}

Result<std::uint64_t> back_up_world(const std::filesystem::path& from, const std::filesystem::path& to) {
  return back_up(from, to);
}

Result<std::uint64_t> compact_world(const std::filesystem::path& path) {
  if (auto done = compact(path); !done) return with_world(Result<std::uint64_t>(done.error()), path);
  return file_bytes(path);
}

namespace {

constexpr const char* kPutPart = "INSERT INTO parts(kind, id, revision, sum, body) VALUES(?, ?, ?, ?, ?)";
constexpr const char* kPutRegion = "INSERT INTO regions(id, grid, level, x, y, z) VALUES(?, ?, ?, ?, ?, ?)";
constexpr const char* kPutChunk = "INSERT INTO chunks(key, body) VALUES(?, ?)";
// Rows per transaction: written rows stay in memory until it ends.
constexpr std::uint64_t kGroup = 1024;

std::uint64_t solid_samples(const DensityChunk& densities) {
  std::uint64_t count = 0;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) count += static_cast<std::uint64_t>(std::popcount(densities.solid_row(y, z)));
  }
  return count;
}

/// Copies row by row, in the order of the tables.
class Copy {
 public:
  Copy(WorldReader& reader, Connection& to, double file_bytes, const Progress& progress)
      : reader_(reader), to_(to), file_bytes_(file_bytes), progress_(progress) {}

  Result<WorldCopy> run() {
    if (Status goes_on = report(); !goes_on) return goes_on.error();
    // Reads one consistent state.
    if (auto begun = reader_.connection().run("BEGIN"); !begun) return begun.error();
    auto rules = read_rules(reader_);
    if (!rules) return rules.error();
    if (!rules->damage.empty()) return damaged(rules->damage.front()).error();
    rules_ = std::move(*rules);
    if (auto begun = to_.run("BEGIN"); !begun) return begun.error();
    for (const auto step : {&Copy::copy_parts, &Copy::copy_regions, &Copy::copy_chunks}) {
      if (auto done = (this->*step)(); !done) return done.error();
    }
    if (auto done = put_version(to_, kSchemaVersion); !done) return done.error();
    if (auto done = to_.run("COMMIT"); !done) return done.error();
    return std::move(copied_);
  }

 private:
  static Status damaged(const std::string& what) {
    return make_error(ErrorCode::BadFormat, what + "; `quoin world repair` recovers the undamaged data");
  }

  Status copy_parts() {
    auto from = reader_.connection().prepare("SELECT id, revision, sum, body, kind FROM parts ORDER BY kind, id");
    if (!from) return from.error();
    auto put = to_.prepare(kPutPart);
    if (!put) return put.error();
    while (true) {
      const auto row = from->step();
      if (!row) return row.error();
      if (!*row) return {};
      std::uint64_t sum = 0;
      const std::string kind(from->text(4));
      const auto part = part_of(*from, kind, sum);
      if (!part || sum_of(*part) != sum) return damaged((part ? name_of(part->key) : "a part") + " is damaged");
      put->bind(0, std::string_view(kind));
      bind(*put, 1, part->key.id);
      put->bind(2, static_cast<std::int64_t>(part->revision));
      put->bind(3, static_cast<std::int64_t>(sum));
      put->bind(4, part->body);
      if (auto done = put->run(); !done) return done;
    }
  }

  Status copy_regions() {
    std::vector<std::string> damage;
    regions_ = ChunkRows(reader_.connection()).regions(damage);
    if (!damage.empty()) return damaged(damage.front());
    auto put = to_.prepare(kPutRegion);
    if (!put) return put.error();
    for (const auto& [id, place] : regions_) {
      put->bind(0, id);
      put->bind(1, std::int64_t{place.grid});
      put->bind(2, std::int64_t{place.level});
      for (int axis = 0; axis < 3; ++axis) put->bind(3 + axis, std::int64_t{place.region[axis]});
      if (auto done = put->run(); !done) return done;
    }
    return {};
  }

  Status copy_chunks() {
    auto put = to_.prepare(kPutChunk);
    if (!put) return put.error();
    ChunkRows rows(reader_.connection());
    Status fault;
    const auto gaps = rows.each([&](std::int64_t key, std::span<const std::byte> body) {
      const auto region = regions_.find(key >> kRegionBits);
      if (region == regions_.end()) {
        copied_.lost.push_back(
            {std::nullopt, "the chunk with key " + std::to_string(key) + " lies in a missing region"});
        return RowVerdict::Damaged;
      }
      const ChunkAddress place{region->second.grid, region->second.level, chunk_of_key(region->second, key)};
      if (!count(place, body)) return RowVerdict::Damaged;
      put->bind(0, key);
      put->bind(1, body);
      fault = put->run();
      if (fault) fault = advance(body.size());
      return fault ? RowVerdict::Sound : RowVerdict::Stop;
    });
    if (!fault) return fault;
    if (!gaps) return gaps.error();
    for (const KeyGap& gap : *gaps) copied_.lost.push_back({std::nullopt, about(gap, regions_) + ": " + gap.why});
    return {};
  }

  // Returns false if the chunk is damaged.
  bool count(const ChunkAddress& place, std::span<const std::byte> body) {
    const auto grid = rules_.grids.find(place.grid);
    const float band = grid == rules_.grids.end() ? WorldGrid{}.band : grid->second.band;
    const auto chunk = decoder_.decode(place, body, ChunkLimits{&rules_.types, band});
    if (!chunk) {
      copied_.lost.push_back({place, about(place) + ": " + chunk.error().message});
      return false;
    }
    ++copied_.chunks;
    if (place.level != 0) return true;
    copied_.voxels += static_cast<std::uint64_t>(chunk->voxels.non_air_count());
    if (chunk->densities) copied_.samples += solid_samples(*chunk->densities);
    return true;
  }

  Status advance(std::size_t bytes) {
    read_ += bytes;
    if (copied_.chunks % kGroup != 0) return {};
    if (Status goes_on = report(); !goes_on) return goes_on;
    return to_.run("COMMIT; BEGIN");
  }

  Status report() const {
    if (!progress_ || progress_(std::min(1.0, static_cast<double>(read_) / file_bytes_))) return {};
    return make_error(ErrorCode::Cancelled, "cancelled");
  }

  WorldReader& reader_;
  Connection& to_;
  double file_bytes_;
  const Progress& progress_;
  WorldRules rules_;
  std::map<std::int64_t, RegionPlace> regions_;
  ChunkDecoder decoder_;
  WorldCopy copied_;
  std::size_t read_ = 0;
};

Result<WorldCopy> copy(const std::filesystem::path& from, const std::filesystem::path& fresh,
                       const Progress& progress) {
  auto reader = with_world(open_reader(from), from);
  if (!reader) return reader.error();
  auto database = Connection::open(fresh.string(), Connection::Mode::Create);
  if (!database) return database.error();
  // The copy is invalid until it is complete and has its final name.
  const Status set = database->run("PRAGMA page_size=8192; PRAGMA journal_mode=MEMORY; PRAGMA synchronous=OFF");
  if (!set) return set.error();
  if (auto done = create_schema(*database); !done) return done.error();
  std::error_code error;
  const auto bytes = static_cast<double>(std::max<std::uintmax_t>(std::filesystem::file_size(from, error), 1));
  auto copied = Copy(*reader, *database, bytes, progress).run();
  if (!copied) {
    Error fault = copied.error();
    if (fault.path.empty() && fault.code != ErrorCode::CannotWrite) fault.path = from.string();
    return fault;
  }
  if (auto done = database->close(); !done) return done.error();
  return copied;
}

}  // namespace

Result<WorldCopy> copy_world(const std::filesystem::path& from, const std::filesystem::path& to,
                             const Progress& progress) {
  const std::filesystem::path target = follow_links(to);
  const auto lock = WorldLock::take(target);
  if (!lock) return with_world(Result<WorldCopy>(lock.error()), to);
  const std::filesystem::path fresh = fresh_name(target);
  auto copied = copy(from, fresh, progress);
  Status done = copied ? put_world_in_place(fresh, target) : Status(copied.error());
  remove_database(fresh);
  if (!done) return with_world(Result<WorldCopy>(done.error()), to);
  std::error_code error;
  copied->bytes = std::filesystem::file_size(target, error);
  return copied;
}

}  // namespace quoin
