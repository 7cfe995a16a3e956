#include "store/world/world_writer.h"

#include <algorithm>
#include <ranges>
#include <span>
#include <string>

#include <quoin/core/assert.h>

#include "store/world/world_open.h"

namespace quoin::store {

namespace {

// Maximum number of chunks per commit, unless a single save has more. A commit's syncs cost as much as tens of chunks,
// and later saves wait for the whole commit.
constexpr std::size_t kGroupChunks = 256;
// Number of chunks encoded at once in larger saves; bounds memory.
constexpr std::size_t kSliceChunks = 256;
// The log is checkpointed at 16 MiB. Otherwise it would keep growing, and so would the time of a checkpoint.
constexpr int kMaxLogPages = (16 << 20) / kPageBytes;

constexpr const char* kPutChunk = "REPLACE INTO chunks(key, body) VALUES(?, ?)";
constexpr const char* kDeleteChunk = "DELETE FROM chunks WHERE key=?";
constexpr const char* kDeleteChunks = "DELETE FROM chunks WHERE key BETWEEN ? AND ?";
constexpr const char* kAddRegion = "INSERT INTO regions(grid, level, x, y, z) VALUES(?, ?, ?, ?, ?) RETURNING id";
constexpr const char* kSelectGridRegion = "SELECT id FROM regions WHERE grid=? LIMIT 1";
constexpr const char* kDeleteRegion = "DELETE FROM regions WHERE id=?";
constexpr const char* kPutPart =
    "INSERT INTO parts(kind, id, revision, sum, body) VALUES(?, ?, ?, ?, ?)"
    " ON CONFLICT(kind, id) DO UPDATE SET revision=excluded.revision, sum=excluded.sum, body=excluded.body";
constexpr const char* kDeletePart = "DELETE FROM parts WHERE kind=? AND id=?";

std::uint64_t bytes_of(const std::optional<StoredChunk>& chunk) {
  if (!chunk) return 0;
  return chunk->voxels.bytes() + (chunk->densities ? chunk->densities->bytes() : 0);
}

}  // namespace

WorldWriter::WorldWriter(Connection connection, std::uint64_t revision, Threads threads)
    : connection_(std::move(connection)),
      revision_(revision),
      needs_version_(revision == 0),
      threads_(threads),
      encoders_(thread_count(threads)) {
  thread_.start(1, [this](Workers::Lock& lock, unsigned /*worker*/) { return step(lock); }, {.name = "store"});
}

WorldWriter::~WorldWriter() {
  {
    const std::scoped_lock lock(mutex_);
    failed_through_ = 0;  // retries
  }
  thread_.drain();
  statements_.clear();
  end_writing(connection_);
  static_cast<void>(connection_.close());
}

SaveTicket WorldWriter::save(ChangeSet changes, OnSaved on_saved) {
  SaveTicket ticket;
  std::list<Save> added(1);
  if (on_saved) added.front().on_saved.push_back(std::move(on_saved));
  {
    const std::scoped_lock lock(mutex_);
    note_pending(changes, last_ticket_ + 1);
    // Nothing fails from here on.
    ticket.number = ++last_ticket_;
    added.front().last = ticket.number;
    added.front().changes = std::move(changes);
    queue_.splice(queue_.end(), added);  // the writer may destroy the save when the lock is free
    failed_through_ = 0;
  }
  thread_.wake_one();
  return ticket;
}

void WorldWriter::note_pending(const ChangeSet& changes, std::uint64_t ticket) {
  std::map<std::uint32_t, std::uint64_t> removed;
  for (const std::uint32_t grid : changes.removed_grids) removed.emplace(grid, ticket);
  make_room(pending_chunks_, changes.chunks.size());
  // No allocation from here on: copies of chunks share their content.
  const auto drop = [&](auto found) {
    stats_.pending_bytes -= bytes_of(found->second.content);
    return pending_chunks_.erase(found);
  };
  for (const std::uint32_t grid : changes.removed_grids) {
    for (auto it = pending_chunks_.begin(); it != pending_chunks_.end();) it = it->first.grid == grid ? drop(it) : ++it;
    pending_removed_.erase(grid);
  }
  pending_removed_.merge(removed);
  for (const auto& [place, chunk] : changes.chunks) {
    PendingChunk& pending = pending_chunks_[place];
    stats_.pending_bytes += bytes_of(chunk) - bytes_of(pending.content);
    pending = {chunk, ticket};
  }
  stats_.pending_chunks = pending_chunks_.size();
}

void WorldWriter::forget_pending(const Save& group) {
  for (const auto& [place, chunk] : group.changes.chunks) {
    const auto found = pending_chunks_.find(place);
    if (found == pending_chunks_.end() || found->second.ticket > group.last) continue;
    stats_.pending_bytes -= bytes_of(found->second.content);
    pending_chunks_.erase(found);
  }
  std::erase_if(pending_removed_, [&](const auto& removed) { return removed.second <= group.last; });
  stats_.pending_chunks = pending_chunks_.size();
}

Status WorldWriter::wait(SaveTicket ticket) {
  std::unique_lock lock(mutex_);
  QUOIN_ASSERT(ticket.number <= last_ticket_, "a ticket of this world");
  thread_.wait(lock, [&] { return saved_through_ >= ticket.number || failed_through_ >= ticket.number; });
  return saved_through_ >= ticket.number ? Status() : failure_;
}

Status WorldWriter::flush() {
  SaveTicket last;
  {
    const std::scoped_lock lock(mutex_);
    last.number = last_ticket_;
    failed_through_ = 0;
  }
  thread_.wake_one();
  return wait(last);
}

WorldStats WorldWriter::stats() const {
  const std::scoped_lock lock(mutex_);
  return stats_;
}

std::optional<std::optional<StoredChunk>> WorldWriter::pending_chunk(const ChunkAddress& place) const {
  const std::scoped_lock lock(mutex_);
  const auto found = pending_chunks_.find(place);
  if (found != pending_chunks_.end()) return found->second.content;
  if (pending_removed_.contains(place.grid)) return std::optional<StoredChunk>();
  return std::nullopt;
}

std::optional<std::optional<PartContent>> WorldWriter::pending_part(const PartKey& key) const {
  const std::scoped_lock lock(mutex_);
  for (const std::list<Save>* const saves : {&queue_, &group_}) {
    for (const Save& save : *saves | std::views::reverse) {
      const auto found = save.changes.parts.find(key);
      if (found != save.changes.parts.end()) return found->second;
    }
  }
  return std::nullopt;
}

WorldWriter::PendingChunks WorldWriter::pending_chunks(std::uint32_t grid, std::uint8_t level, const IBox& box) const {
  const std::scoped_lock lock(mutex_);
  PendingChunks found;
  found.is_removed = pending_removed_.contains(grid);
  for (const auto& [place, pending] : pending_chunks_) {
    if (place.grid != grid || place.level != level || !box.contains(place.chunk)) continue;
    found.chunks.emplace_back(place.chunk, pending.content.has_value());
  }
  return found;
}

std::vector<std::pair<PartKey, std::optional<PartContent>>> WorldWriter::pending_parts(std::string_view kind) const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::pair<PartKey, std::optional<PartContent>>> found;
  for (const std::list<Save>* const saves : {&group_, &queue_}) {
    for (const Save& save : *saves) {
      for (const auto& [key, content] : save.changes.parts) {
        if (key.kind == kind) found.emplace_back(key, content);
      }
    }
  }
  return found;
}

// Moves saves as list nodes, so that they can be put back without allocation.
void WorldWriter::begin_group() {
  if (queue_.empty() || failed_through_ != 0) return;
  group_.splice(group_.begin(), queue_, queue_.begin());
  Save& first = group_.front();
  while (!queue_.empty() && first.changes.chunks.size() + queue_.front().changes.chunks.size() <= kGroupChunks) {
    Save& next = queue_.front();
    QUOIN_ASSERT(next.last > first.last, "saves in the order of their tickets");
    try {
      first.on_saved.reserve(first.on_saved.size() + next.on_saved.size());
      first.changes.add(std::move(next.changes));
    } catch (const std::bad_alloc&) {
      break;  // gets its own commit
    }
    first.last = next.last;
    std::ranges::move(next.on_saved, std::back_inserter(first.on_saved));
    queue_.pop_front();
  }
}

Workers::Clock::time_point WorldWriter::step(Workers::Lock& lock) {
  if (group_.empty()) begin_group();
  if (group_.empty()) return Workers::kWhenWoken;
  lock.unlock();
  Status outcome;
  try {
    outcome = write(group_.front().changes);
  } catch (const std::bad_alloc&) {
    roll_back();
    outcome = make_error(ErrorCode::LimitExceeded, "not enough memory to save");
  } catch (const std::exception& failure) {  // an encoding thread cannot start
    roll_back();
    outcome = make_error(ErrorCode::CannotWrite, std::string("cannot save: ") + failure.what());
  }
  finish(outcome);
  lock.lock();
  return Workers::kAgain;
}

void WorldWriter::finish(const Status& outcome) {
  std::list<Save> saved;
  std::vector<OnSaved> to_notify;
  if (outcome) to_notify = std::move(group_.front().on_saved);
  {
    const std::scoped_lock lock(mutex_);
    if (outcome) {
      const Save& save = group_.front();
      forget_pending(save);
      QUOIN_ASSERT(save.last > saved_through_ && save.last <= last_ticket_, "saves in the order of their tickets");
      saved_through_ = save.last;
      stats_.commits += save.changes.empty() ? 0 : 1;
      stats_.saved_chunks += chunks_of_commit_;
      stats_.saved_bytes += bytes_of_commit_;
      saved.swap(group_);
    } else {
      failure_ = outcome;
      // Later saves are not tried either, until a caller retries.
      failed_through_ = last_ticket_;
      queue_.splice(queue_.begin(), group_);
      try {
        for (const Save& save : queue_) std::ranges::copy(save.on_saved, std::back_inserter(to_notify));
      } catch (const std::bad_alloc&) {  // the others are notified after the retry
      }
    }
  }
  thread_.notify();
  for (const OnSaved& on_saved : to_notify) on_saved(outcome);
}

// Rolls back an unfinished commit.
void WorldWriter::roll_back() {
  regions_.clear();
  try {
    if (connection_.is_in_transaction()) static_cast<void>(connection_.run("ROLLBACK"));
  } catch (const std::bad_alloc&) {  // the next write starts with the rollback
  }
}

Result<Statement*> WorldWriter::ready(const char* sql) {
  Statement& statement = statements_[sql];
  if (!statement.is_prepared()) {
    auto prepared = connection_.prepare(sql);
    if (!prepared) return prepared.error();
    statement = std::move(*prepared);
  }
  return &statement;
}

Status WorldWriter::write(const ChangeSet& changes) {
  chunks_of_commit_ = 0;
  bytes_of_commit_ = 0;
  if (changes.empty() && !needs_version_) return {};  // all earlier changes are on disk
  ++revision_;
  if (connection_.is_in_transaction()) roll_back();
  Status outcome = connection_.run("BEGIN IMMEDIATE");
  if (outcome) outcome = write_all(changes);
  if (outcome) outcome = connection_.run("COMMIT");
  if (!outcome) {
    roll_back();
    return outcome;
  }
  needs_version_ = false;
  // Failures are ignored: a later commit retries, and this one is safe in the log.
  if (connection_.log_pages() > kMaxLogPages) static_cast<void>(connection_.checkpoint());
  return outcome;
}

Status WorldWriter::write_all(const ChangeSet& changes) {
  for (const std::uint32_t grid : changes.removed_grids) {
    if (auto done = remove_grid(grid); !done) return done;
  }
  if (auto done = write_chunks(changes); !done) return done;
  for (const auto& [key, content] : changes.parts) {
    if (auto done = write_part(key, content); !done) return done;
  }
  const auto put = [&](const char* name, std::uint64_t number) {
    return write_part({part::kWorld, std::string(name)}, body_of(std::to_string(number)));
  };
  if (needs_version_) {  // written again in a part, so that a flipped bit in the header cannot change it
    if (auto done = put("version", kSchemaVersion); !done) return done;
  }
  return put("revision", revision_);
}

Status WorldWriter::remove_grid(std::uint32_t number) {
  const auto select = ready(kSelectGridRegion);
  if (!select) return select.error();
  const auto chunks = ready(kDeleteChunks);
  if (!chunks) return chunks.error();
  const auto region = ready(kDeleteRegion);
  if (!region) return region.error();
  std::erase_if(regions_, [&](const auto& known) { return known.first.grid == number; });
  while (true) {
    (*select)->bind(0, std::int64_t{number});
    const auto row = (*select)->step();
    if (!row) return row.error();
    const std::int64_t id = *row ? (*select)->integer(0) : 0;
    (*select)->reset();
    if (!*row) return {};
    if (id < 0 || id > kMaxRegion) return make_error(ErrorCode::BadFormat, "region number out of range");
    (*chunks)->bind(0, first_key(id));
    (*chunks)->bind(1, first_key(id + 1) - 1);
    if (auto done = (*chunks)->run(); !done) return done;
    (*region)->bind(0, id);
    if (auto done = (*region)->run(); !done) return done;
  }
}

Result<std::optional<std::int64_t>> WorldWriter::region_for(const RegionPlace& place, bool may_add) {
  if (const auto known = regions_.find(place); known != regions_.end()) return known->second;
  for (const char* sql : {kSelectRegion, kAddRegion}) {
    if (sql == kAddRegion && !may_add) return std::optional<std::int64_t>();
    const auto statement = ready(sql);
    if (!statement) return statement.error();
    const StatementScope scope(**statement);
    (*statement)->bind(0, std::int64_t{place.grid});
    (*statement)->bind(1, std::int64_t{place.level});
    for (int axis = 0; axis < 3; ++axis) (*statement)->bind(2 + axis, std::int64_t{place.region[axis]});
    const auto row = (*statement)->step();
    if (!row) return row.error();
    if (!*row) continue;
    const std::int64_t id = (*statement)->integer(0);
    if (id < 0 || id > kMaxRegion) return make_error(ErrorCode::BadFormat, "region number out of range");
    regions_[place] = id;
    return id;
  }
  return make_error(ErrorCode::BadFormat, "cannot add a region");
}

Status WorldWriter::write_chunks(const ChangeSet& changes) {
  std::vector<Encoded> chunks;
  chunks.reserve(changes.chunks.size());
  for (const auto& [place, chunk] : changes.chunks) {
    const auto region = region_for(region_of(place), chunk.has_value());
    if (!region) return region.error();
    if (!*region) continue;
    chunks.push_back({key_of(**region, place.chunk), &place, chunk ? &*chunk : nullptr, {}, {}});
  }
  std::ranges::sort(chunks, {}, &Encoded::key);
  for (std::size_t begin = 0; begin < chunks.size(); begin += kSliceChunks) {
    const std::size_t end = std::min(begin + kSliceChunks, chunks.size());
    std::vector<Encoded> slice(std::make_move_iterator(chunks.begin() + static_cast<std::ptrdiff_t>(begin)),
                               std::make_move_iterator(chunks.begin() + static_cast<std::ptrdiff_t>(end)));
    const std::size_t stride = encoders_.size();
    parallel_for(stride, threads_, [&](std::size_t worker) {
      for (std::size_t i = worker; i < slice.size(); i += stride) {
        Encoded& each = slice[i];
        if (each.chunk == nullptr) continue;
        const DensityChunk* const densities = each.chunk->densities ? &*each.chunk->densities : nullptr;
        each.outcome = encoders_[worker].encode(*each.place, revision_, each.chunk->voxels, densities, each.body);
      }
    });
    if (auto done = put_chunks(slice); !done) return done;
  }
  return {};
}

Status WorldWriter::put_chunks(std::vector<Encoded>& chunks) {
  const auto put = ready(kPutChunk);
  if (!put) return put.error();
  const auto remove = ready(kDeleteChunk);
  if (!remove) return remove.error();
  for (const Encoded& each : chunks) {
    if (!each.outcome) return each.outcome;
    Statement& statement = each.chunk != nullptr ? **put : **remove;
    statement.bind(0, each.key);
    if (each.chunk != nullptr) statement.bind(1, std::span<const std::byte>(each.body));
    if (auto done = statement.run(); !done) return done;
    if (each.chunk == nullptr) continue;
    ++chunks_of_commit_;
    bytes_of_commit_ += each.body.size();
  }
  return {};
}

Status WorldWriter::write_part(const PartKey& key, const std::optional<PartContent>& content) {
  const auto prepared = ready(content ? kPutPart : kDeletePart);
  if (!prepared) return prepared.error();
  Statement& statement = **prepared;
  statement.bind(0, std::string_view(key.kind));
  bind(statement, 1, key.id);
  PartBody made;
  if (content) {
    const Part part{key, revision_, bytes_of(*content, made)};
    statement.bind(2, static_cast<std::int64_t>(revision_));
    statement.bind(3, static_cast<std::int64_t>(sum_of(part)));
    statement.bind(4, part.body);
  }
  return statement.run();
}

}  // namespace quoin::store
