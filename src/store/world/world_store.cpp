#include <quoin/store/world_store.h>

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/bytes/files.h"
#include "core/database/connection.h"
#include "store/chunk/chunk_body.h"
#include "store/store_formats.h"
#include "store/world/world_changes.h"
#include "store/world/world_open.h"
#include "store/world/world_reader.h"
#include "store/world/world_writer.h"

namespace quoin {

namespace {

using namespace store;

/// Identifies the file that a name refers to.
struct FileIdentity {
  dev_t device = 0;
  ino_t number = 0;
  bool operator==(const FileIdentity&) const = default;

  static std::optional<FileIdentity> of(const std::filesystem::path& path) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) return std::nullopt;
    return FileIdentity{info.st_dev, info.st_ino};
  }
};

/// The reading objects of one thread.
struct ReadKit {
  WorldReader reader;
  ChunkDecoder decoder;
};

Result<std::uint64_t> last_revision(WorldReader& reader) {
  const auto body = reader.part({part::kWorld, std::string("revision")});
  // A damaged revision counts as higher than any real one: at worst salvage mistakes later rows for older ones.
  if (!body)
    return body.error().code == ErrorCode::BadFormat ? std::uint64_t{1} << 48 : Result<std::uint64_t>(body.error());
  return *body ? number_in(**body) : 0;
}

Status make_database(const std::filesystem::path& path, const char* vfs) {
  auto connection = Connection::open(path.string(), Connection::Mode::Create, vfs);
  if (!connection) return connection.error();
  if (auto done = connection->run("PRAGMA page_size=8192; PRAGMA synchronous=EXTRA"); !done) return done;
  if (auto done = create_schema(*connection); !done) return done;
  return connection->close();
}

}  // namespace

struct WorldStore::Impl {
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    // Closes readers first: the last connection to close removes the log, and only the writer is allowed to. The lock
    // is not held here, since callbacks at the end of the last saves may need it.
    std::vector<std::unique_ptr<ReadKit>> readers;
    {
      const std::scoped_lock guard(mutex);
      readers.swap(idle);
    }
    readers.clear();
    writer.reset();
  }

  std::filesystem::path path;
  HeldFile held;                         // ends after all connections
  std::optional<FileIdentity> identity;  // of the opened file
  const char* vfs = nullptr;
  WorldLock lock;
  mutable std::mutex mutex;  // guards the members below
  mutable std::vector<std::unique_ptr<ReadKit>> idle;
  mutable std::shared_ptr<const WorldRules> rules;
  std::uint32_t next_grid = 0;
  std::uint32_t saved_next_grid = 0;
  std::unique_ptr<WorldWriter> writer;  // null if opened for reading
  std::vector<std::byte> in_memory;     // the database, if it is not a file

  void hold() {
    held = HeldFile(path);
    identity = FileIdentity::of(path);
  }
  Result<std::unique_ptr<ReadKit>> take() const {
    // A log that belongs to another file of that name must not be read with this one.
    if (identity && FileIdentity::of(path) != identity) {
      return make_error(ErrorCode::CannotRead, "another file replaced it: open it again", path.string());
    }
    {
      const std::scoped_lock guard(mutex);
      if (!idle.empty()) {
        auto kit = std::move(idle.back());
        idle.pop_back();
        return kit;
      }
    }
    auto reader = in_memory.empty() ? with_world(open_reader(path, vfs), path) : open_bytes();
    if (!reader) return reader.error();
    return std::make_unique<ReadKit>(ReadKit{std::move(*reader), {}});
  }
  Result<WorldReader> open_bytes() const {
    auto connection = Connection::open(in_memory);
    if (!connection) return connection.error();
    if (auto done = check_schema(*connection); !done) return done.error();
    return WorldReader(std::move(*connection));
  }
  void give_back(std::unique_ptr<ReadKit> kit) const {
    QUOIN_ASSERT(kit != nullptr, "a kit that was taken");
    const std::scoped_lock guard(mutex);
    idle.push_back(std::move(kit));
  }
  /// Returns the result of `read(kit)`; adds the path to errors.
  template <class Read>
  auto with_kit(Read read) const -> std::invoke_result_t<Read, ReadKit&> {
    auto kit = take();
    if (!kit) return kit.error();
    auto outcome = with_world(read(**kit), path);
    give_back(std::move(*kit));
    return outcome;
  }
  std::shared_ptr<const WorldRules> current_rules() const {
    const std::scoped_lock guard(mutex);
    return rules;
  }
  void set_rules(WorldRules now) const {
    auto shared = std::make_shared<const WorldRules>(std::move(now));
    const std::scoped_lock guard(mutex);
    rules = std::move(shared);
  }
  Result<StoredChunk> decode(ReadKit& kit, const ChunkAddress& place, std::span<const std::byte> body) const {
    auto chunk = decode_with(kit.decoder, place, body, *current_rules());
    if (chunk || writer != nullptr) return chunk;
    // Another process may have added types and grids since.
    auto now = read_rules(kit.reader);
    if (!now) return chunk;
    set_rules(std::move(*now));
    return decode_with(kit.decoder, place, body, *current_rules());
  }
  static Result<StoredChunk> decode_with(ChunkDecoder& decoder, const ChunkAddress& place,
                                         std::span<const std::byte> body, const WorldRules& rules) {
    const auto grid = rules.grids.find(place.grid);
    const float band = grid == rules.grids.end() ? WorldGrid{}.band : grid->second.band;
    auto chunk = decoder.decode(place, body, ChunkLimits{&rules.types, band});
    if (!chunk) return make_error(chunk.error().code, about(place) + ": " + chunk.error().message);
    return chunk;
  }
};

WorldStore::WorldStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WorldStore::WorldStore(WorldStore&&) noexcept = default;
WorldStore& WorldStore::operator=(WorldStore&&) noexcept = default;
WorldStore::~WorldStore() = default;

Result<WorldStore> WorldStore::create(const std::filesystem::path& path, Threads threads) {
  return WorldParts::create(path, threads, nullptr);
}

Result<WorldStore> WorldParts::create(const std::filesystem::path& named, Threads threads, const char* vfs) {
  const std::filesystem::path path = vfs == nullptr ? follow_links(named) : named;
  if (vfs != nullptr) {
    if (auto done = make_database(path, vfs); !done) return with_world(Result<WorldStore>(done.error()), path);
    return open(path, WorldAccess::Write, threads, vfs);
  }
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::symlink_status(path, error))) {
    return make_error(ErrorCode::CannotWrite, "file already exists", path.string());
  }
  {
    const auto lock = WorldLock::take(path);
    if (!lock) return with_world(Result<WorldStore>(lock.error()), path);
    const std::filesystem::path fresh = fresh_name(path);
    auto done = make_database(fresh, nullptr);
    if (done) {
      remove_database_log(path);  // removes the log of an earlier file of that name
      done = move_in_place(fresh, path);
    }
    if (!done) {
      remove_database(fresh);
      return with_world(Result<WorldStore>(done.error()), path);
    }
  }
  return open(path, WorldAccess::Write, threads, nullptr);
}

Result<WorldStore> WorldParts::create_unsynced(const std::filesystem::path& path, Threads threads) {
  auto connection = Connection::open(path.string(), Connection::Mode::Create);
  if (!connection) return connection.error();
  const Status set = connection->run("PRAGMA page_size=8192; PRAGMA journal_mode=MEMORY; PRAGMA synchronous=OFF");
  if (!set) return set.error();
  if (auto done = create_schema(*connection); !done) return done.error();
  auto impl = std::make_unique<WorldStore::Impl>();
  impl->path = path;
  return begin(std::move(impl), std::move(*connection), threads);
}

Result<WorldStore> WorldStore::open(const std::filesystem::path& path, WorldAccess access, Threads threads) {
  return WorldParts::open(path, access, threads, nullptr);
}

Result<WorldStore> WorldStore::open_or_create(const std::filesystem::path& path, Threads threads) {
  std::error_code error;
  return std::filesystem::exists(path, error) ? open(path, WorldAccess::Write, threads) : create(path, threads);
}

Result<WorldStore> WorldParts::open(const std::filesystem::path& named, WorldAccess access, Threads threads,
                                    const char* vfs) {
  const std::filesystem::path path = vfs == nullptr ? follow_links(named) : named;
  auto impl = std::make_unique<WorldStore::Impl>();
  impl->path = path;
  impl->vfs = vfs;
  const auto fail = [&](const Error& error) { return with_world(Result<WorldStore>(error), path); };
  if (vfs == nullptr) {
    const auto beginning = read_file_beginning(path, kWorldHeaderBytes);
    if (!beginning) return beginning.error();
    if (!is_world_format(*beginning)) return fail(make_error(ErrorCode::BadFormat, "not a Quoin world"));
    impl->hold();
  }
  std::optional<Connection> writing;
  if (access == WorldAccess::Write) {
    if (vfs == nullptr) {
      auto lock = WorldLock::take(path);
      if (!lock) return fail(lock.error());
      impl->lock = std::move(*lock);
      if (::access(path.c_str(), W_OK) != 0) return fail(make_error(ErrorCode::CannotWrite, "file is read-only"));
    }
    auto connection = Connection::open(path.string(), Connection::Mode::Write, vfs);
    if (!connection) return fail(connection.error());
    if (auto done = check_schema(*connection); !done) return fail(done.error());
    if (auto done = begin_writing(*connection, vfs == nullptr && is_on_network(path)); !done) return fail(done.error());
    if (auto done = migrate(*connection, path); !done) return fail(done.error());
    writing = std::move(*connection);
  }
  return begin(std::move(impl), std::move(writing), threads);
}

Result<WorldStore> WorldParts::open(std::span<const std::byte> bytes) {
  if (!is_world_format(bytes)) return make_error(ErrorCode::BadFormat, "not a Quoin world");
  auto impl = std::make_unique<WorldStore::Impl>();
  impl->in_memory.assign(bytes.begin(), bytes.end());
  return begin(std::move(impl), std::nullopt, {});
}

Result<WorldStore> WorldParts::begin(std::unique_ptr<WorldStore::Impl> impl, std::optional<Connection> writing,
                                     Threads threads) {
  auto kit = impl->take();
  if (!kit) return kit.error();
  auto rules = with_world(read_rules((*kit)->reader), impl->path);
  if (!rules) return rules.error();
  const auto revision = with_world(last_revision((*kit)->reader), impl->path);
  if (!revision) return revision.error();
  if (!rules->grids.empty()) impl->next_grid = rules->grids.rbegin()->first + 1;
  const auto next_grid = (*kit)->reader.part({part::kWorld, std::string("next_grid")});
  if (next_grid && *next_grid) {
    impl->next_grid = std::max(impl->next_grid, static_cast<std::uint32_t>(number_in(**next_grid)));
  }
  impl->saved_next_grid = impl->next_grid;
  impl->give_back(std::move(*kit));
  impl->set_rules(std::move(*rules));
  if (writing) impl->writer = std::make_unique<WorldWriter>(std::move(*writing), *revision, threads);
  return WorldStore(std::move(impl));
}

Result<std::optional<StoredChunk>> WorldStore::load_chunk(const ChunkAddress& place) const {
  QUOIN_ASSERT(impl_ != nullptr, "a world that was not moved from");
  if (impl_->writer != nullptr) {
    if (auto pending = impl_->writer->pending_chunk(place)) return std::move(*pending);
  }
  return impl_->with_kit([&](ReadKit& kit) -> Result<std::optional<StoredChunk>> {
    const auto body = kit.reader.chunk_body(place);
    if (!body) return body.error();
    if (!*body) return std::optional<StoredChunk>();
    auto chunk = impl_->decode(kit, place, **body);
    if (!chunk) return chunk.error();
    return std::optional(std::move(*chunk));
  });
}

Result<std::vector<IVec3>> WorldStore::chunks(std::uint32_t grid, std::uint8_t level, const IBox& box) const {
  QUOIN_ASSERT(impl_ != nullptr, "a world that was not moved from");
  // Taken before the disk is read, so that chunks written in between are found on disk.
  WorldWriter::PendingChunks pending;
  if (impl_->writer != nullptr) pending = impl_->writer->pending_chunks(grid, level, box);
  std::vector<IVec3> on_disk;
  const Status done = impl_->with_kit([&](ReadKit& kit) { return kit.reader.find_chunks(grid, level, box, on_disk); });
  if (!done) return done.error();
  const auto before = [](IVec3 a, IVec3 b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); };
  std::set<IVec3, decltype(before)> changed(before);
  std::vector<IVec3> found;
  for (const auto& [chunk, is_there] : pending.chunks) {
    changed.insert(chunk);
    if (is_there) found.push_back(chunk);
  }
  for (const IVec3 chunk : on_disk) {
    if (!pending.is_removed && !changed.contains(chunk)) found.push_back(chunk);
  }
  std::ranges::sort(found, before);
  return found;
}

Result<std::vector<IVec3>> WorldStore::chunks(std::uint32_t grid, std::uint8_t level) const {
  return chunks(grid, level, kAllChunks);
}

Result<VoxelRegistry> WorldStore::types() const {
  if (impl_->writer == nullptr) {
    auto rules = impl_->with_kit([&](ReadKit& kit) { return read_rules(kit.reader); });
    if (!rules) return rules.error();
    impl_->set_rules(std::move(*rules));
  }
  return impl_->current_rules()->types;
}

Result<std::map<std::uint32_t, WorldGrid>> WorldStore::grids() const {
  if (auto now = types(); !now) return now.error();
  return impl_->current_rules()->grids;
}

std::uint32_t WorldStore::next_grid() {
  QUOIN_ASSERT(impl_ != nullptr, "a world that was not moved from");
  const std::scoped_lock guard(impl_->mutex);
  return impl_->next_grid++;
}

Result<std::optional<std::vector<std::byte>>> WorldStore::value(std::string_view name) const {
  return WorldParts::find(*this, {part::kValue, std::string(name)});
}

Result<std::optional<std::vector<std::byte>>> WorldStore::thumbnail() const {
  return WorldParts::find(*this, {part::kThumbnail, std::int64_t{0}});
}

Result<std::optional<PartBody>> WorldParts::find(const WorldStore& world, const PartKey& key) {
  const WorldStore::Impl& impl = world.impl();
  if (impl.writer != nullptr) {
    if (auto pending = impl.writer->pending_part(key)) {
      return *pending ? std::optional(body_of(std::move(**pending))) : std::optional<PartBody>();
    }
  }
  return impl.with_kit([&](ReadKit& kit) { return kit.reader.part(key); });
}

Result<std::vector<std::string>> WorldStore::value_names() const {
  std::vector<std::string> names;
  const Status done = WorldParts::each(*this, part::kValue, [&](const Part& part, bool) {
    if (const auto* const name = std::get_if<std::string>(&part.key.id)) names.push_back(*name);
  });
  if (!done) return done.error();
  return names;
}

Status WorldParts::each(const WorldStore& world, const char* kind, FunctionRef<void(const Part&, bool)> visit) {
  const WorldStore::Impl& impl = world.impl();
  std::map<PartKey, PartBody> parts;
  std::set<PartKey> damaged;
  std::vector<std::pair<PartKey, std::optional<PartContent>>> pending;
  if (impl.writer != nullptr) pending = impl.writer->pending_parts(kind);
  Status done = impl.with_kit([&](ReadKit& kit) {
    return kit.reader.each_part(kind, [&](const Part& part, bool is_sound) {
      parts[part.key].assign(part.body.begin(), part.body.end());
      if (!is_sound) damaged.insert(part.key);
    });
  });
  if (!done) return done;
  for (auto& [key, content] : pending) {
    damaged.erase(key);
    if (content) {
      parts[key] = body_of(std::move(*content));
    } else {
      parts.erase(key);
    }
  }
  for (const auto& [key, body] : parts) visit(Part{key, 0, body}, !damaged.contains(key));
  return {};
}

Status WorldParts::each_chunk(const WorldStore& world, std::uint32_t grid, std::uint8_t level, Threads threads,
                              FunctionRef<bool(const ChunkAddress&, Result<StoredChunk>)> visit) {
  struct Row {
    ChunkAddress place;
    std::vector<std::byte> body;
    Result<StoredChunk> chunk = StoredChunk{};
  };
  const WorldStore::Impl& impl = world.impl();
  const std::shared_ptr<const WorldRules> rules = impl.current_rules();
  const unsigned workers = thread_count(threads);
  auto kit = impl.take();
  if (!kit) return kit.error();
  std::vector<ChunkDecoder> decoders(workers);
  std::vector<Row> rows;
  bool is_wanted = true;
  const auto pass_on = [&] {
    parallel_for(workers, threads, [&](std::size_t worker) {
      for (std::size_t i = worker; i < rows.size(); i += workers) {
        rows[i].chunk = WorldStore::Impl::decode_with(decoders[worker], rows[i].place, rows[i].body, *rules);
      }
    });
    for (Row& row : rows) is_wanted = is_wanted && visit(row.place, with_world(std::move(row.chunk), impl.path));
    rows.clear();
    return is_wanted;
  };
  const std::size_t slice = std::size_t{64} * workers;
  const Status done = (*kit)->reader.each_body(grid, level, [&](const ChunkAddress& place, auto body) {
    rows.push_back({place, {body.begin(), body.end()}});
    return rows.size() < slice || pass_on();
  });
  if (is_wanted) pass_on();
  impl.give_back(std::move(*kit));
  return with_world(done, impl.path);
}

std::vector<std::string> WorldParts::damage(const WorldStore& world) {
  return world.impl().current_rules()->damage;
}

Result<SaveTicket> WorldStore::save(WorldChanges changes, std::function<void(const Status&)> on_saved) {
  QUOIN_ASSERT(impl_ != nullptr && impl_->writer != nullptr, "a world opened for writing");
  ChangeSet& content = changes.content();
  if (content.empty() && !on_saved) return SaveTicket{};
  // Under the lock: two threads that put types must not overtake each other.
  const std::scoped_lock guard(impl_->mutex);
  std::shared_ptr<const WorldRules> rules = impl_->rules;
  std::uint32_t next_after = impl_->next_grid;
  bool stores_next_grid = false;
  if (WorldRules::concern(content)) {
    auto now = rules->after(content);
    if (!now) return with_world(Result<SaveTicket>(now.error()), impl_->path);
    for (const auto& [key, body] : content.parts) {
      const auto* const number = std::get_if<std::int64_t>(&key.id);
      const bool is_grid = key.kind == part::kGrid && body && number != nullptr;
      if (is_grid) next_after = std::max(next_after, static_cast<std::uint32_t>(*number) + 1);
    }
    stores_next_grid = next_after > impl_->saved_next_grid;
    if (stores_next_grid) {
      content.parts.insert_or_assign({part::kWorld, std::string("next_grid")}, body_of(std::to_string(next_after)));
    }
    rules = std::make_shared<const WorldRules>(std::move(*now));
  }
  if (auto done = check_changes(content, *rules); !done)
    return with_world(Result<SaveTicket>(done.error()), impl_->path);
  const SaveTicket ticket = impl_->writer->save(std::move(content), std::move(on_saved));
  // A save that is refused or throws leaves these as they were.
  impl_->rules = std::move(rules);
  if (stores_next_grid) impl_->next_grid = impl_->saved_next_grid = next_after;
  return ticket;
}

Status WorldStore::wait(SaveTicket ticket) {
  return impl_->writer == nullptr ? Status() : with_world(impl_->writer->wait(ticket), impl_->path);
}

Status WorldStore::flush() {
  return impl_->writer == nullptr ? Status() : with_world(impl_->writer->flush(), impl_->path);
}

WorldStats WorldStore::stats() const {
  return impl_->writer == nullptr ? WorldStats{} : impl_->writer->stats();
}

const std::filesystem::path& WorldStore::path() const {
  return impl_->path;
}

bool WorldStore::is_writable() const {
  return impl_->writer != nullptr;
}

}  // namespace quoin
