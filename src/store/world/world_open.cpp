#include "store/world/world_open.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/bytes/files.h"
#include "core/database/connection.h"
#include "store/database/schema.h"

namespace quoin::store {

namespace {

Error failed(int number) {
  return make_error(ErrorCode::CannotWrite, "cannot write it: " + std::generic_category().message(number));
}

Status sync_file(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int number = errno;
  if (descriptor >= 0) ::close(descriptor);
  return done ? Status() : Status(failed(number));
}

Status roll_back(const std::filesystem::path& path) {
  const auto lock = WorldLock::take(follow_links(path));
  if (!lock) return lock.error();
  auto connection = Connection::open(path.string(), Connection::Mode::Write);
  if (!connection) return connection.error();
  if (auto done = check_schema(*connection); !done) return done;
  return connection->close();
}

/// Opens the file as immutable: no other program changes it.
Result<WorldReader> open_alone(const std::filesystem::path& path) {
  auto alone = Connection::open(path.string(), Connection::Mode::ReadImmutable);
  if (!alone) return alone.error();
  if (auto done = check_schema(*alone); !done) return done.error();
  return WorldReader(std::move(*alone));
}

/// Opens a world on a file system without locks. Writing is impossible there, so the file is stable, unless it was
/// copied there during a write.
Result<WorldReader> open_unlocked(const std::filesystem::path& path) {
  std::error_code unknown;
  for (const char* const log : {"-wal", "-journal"}) {
    const std::uintmax_t bytes = std::filesystem::file_size(path.string() + log, unknown);
    if (!unknown && bytes != 0) {
      return make_error(ErrorCode::CannotRead,
                        "it was not closed, and its file system has no locks: copy it elsewhere, together with " +
                            path.filename().string() + log);
    }
  }
  return open_alone(path);
}

}  // namespace

Status begin_writing(Connection& connection, bool is_network) {
  // Acknowledged commits must be synced: NORMAL could lose commits on a power failure. In rollback mode the folder must
  // also be synced after the journal is deleted. The same holds at the switch to the log: a journal that reappears
  // after a power cut would hide the log from the database.
  if (auto done = connection.run("PRAGMA synchronous=EXTRA"); !done) return done;
  if (is_network) {  // another machine may have left the database in WAL mode
    const auto mode = connection.text("PRAGMA journal_mode=DELETE");
    if (!mode) return mode.error();
    return *mode == "delete" ? Status() : Status(make_error(ErrorCode::CannotWrite, "another program is reading it"));
  }
  const auto mode = connection.text("PRAGMA journal_mode=WAL");
  if (!mode) return mode.error();
  return *mode == "wal" ? connection.run("PRAGMA synchronous=FULL") : Status();
}

bool end_writing(Connection& connection) {
  // Only a connection that has the log open removes it; a connection without writes has not opened it.
  if (!connection.run("PRAGMA busy_timeout=0; PRAGMA synchronous=EXTRA; BEGIN IMMEDIATE; COMMIT")) return false;
  const auto mode = connection.text("PRAGMA journal_mode=DELETE");
  return mode && *mode == "delete";
}

Result<WorldReader> open_reader(const std::filesystem::path& path, const char* vfs) {
  if (vfs == nullptr && !has_locks(path)) return open_unlocked(path);
  auto connection = Connection::open(path.string(), Connection::Mode::Read, vfs);
  const Status sound = connection ? check_schema(*connection) : Status(connection.error());
  if (sound) return WorldReader(std::move(*connection));
  // A writer rolls back a transaction that a crash left in rollback mode.
  if (sound.error().code == ErrorCode::CannotWrite && vfs == nullptr) {
    if (auto undone = roll_back(path); !undone) return undone.error();
    auto again = Connection::open(path.string(), Connection::Mode::Read);
    if (!again) return again.error();
    if (auto done = check_schema(*again); !done) return done.error();
    return WorldReader(std::move(*again));
  }
  // A read-only folder cannot hold the readers' shared memory file; it also has no writers.
  const std::filesystem::path folder = path.parent_path();
  std::error_code error;
  const bool has_log = std::filesystem::exists(path.string() + "-wal", error);
  const bool may_write = ::access(folder.empty() ? "." : folder.c_str(), W_OK) == 0;
  if (sound.error().code != ErrorCode::CannotRead || has_log || may_write || vfs != nullptr) return sound.error();
  return open_alone(path);
}

void remove_database_log(const std::filesystem::path& path) {
  std::error_code ignored;
  for (const char* suffix : {"-wal", "-shm", "-journal"}) std::filesystem::remove(path.string() + suffix, ignored);
}

void remove_database(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  remove_database_log(path);
}

std::filesystem::path fresh_name(const std::filesystem::path& world) {
  static std::atomic<unsigned> counter{0};
  return world.parent_path() /
         (".quoin-world-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".tmp");
}

Status move_in_place(const std::filesystem::path& from, const std::filesystem::path& to, Existing existing) {
  if (auto done = sync_file(from); !done) return done;
  std::error_code error;
  const unsigned flags = existing == Existing::Refused ? RENAME_NOREPLACE : 0;
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) != 0) {
    const int number = errno;
    const bool is_there = std::filesystem::exists(std::filesystem::symlink_status(to, error));
    if (existing == Existing::Refused && is_there) {
      return make_error(ErrorCode::CannotWrite, "file already exists");
    }
    if (number != EINVAL && number != ENOSYS) return failed(number);
    std::filesystem::rename(from, to, error);  // the file system lacks such flags; the lock excludes others
    if (error) return failed(error.value());
  }
  sync_folder(to.parent_path());
  return {};
}

namespace {

// Adds an index that holds the chunks' keys without their bodies.
Status add_key_index(Connection& database) {
  return database.run("CREATE INDEX chunk_keys ON chunks(key)");
}

// Version 3 has environment parts, which earlier programs would ignore. Version 4 has whole grids, and types with light
// and occlusion of their own, which they would refuse as damaged. Without the mark a grid is streamed, as all were
// before. Version 5 has types with textures, version 6 types with orientations, shapes and
// textures of fields.
Status add_nothing(Connection& /*database*/) {
  return {};
}

constexpr std::array kSteps = {MigrationStep{1, false, add_key_index}, MigrationStep{2, false, add_nothing},
                               MigrationStep{3, false, add_nothing}, MigrationStep{4, false, add_nothing},
                               MigrationStep{5, false, add_nothing}};
static_assert(kSteps.back().from + 1 == kSchemaVersion, "a step for each version");

Status keep_copy(Connection& database, const std::filesystem::path& path) {
  const std::filesystem::path kept = FileBackup::name_for(path, FileBackup::Older::Kept);
  if (kept.empty()) {
    return make_error(ErrorCode::CannotWrite,
                      "cannot back up the world before upgrading it: all backup names are taken");
  }
  const std::filesystem::path fresh = fresh_name(path);
  Status done = [&]() -> Status {
    auto copy = database.prepare("VACUUM INTO ?");
    if (!copy) return copy.error();
    copy->bind(0, std::string_view(fresh.native()));
    if (auto copied = copy->run(); !copied) return copied;
    return move_in_place(fresh, kept);
  }();
  if (!done) remove_database(fresh);
  return done;
}

}  // namespace

Status put_version(Connection& database, int version) {
  const std::string digits = std::to_string(version);
  if (auto done = database.run(("PRAGMA user_version=" + digits).c_str()); !done) return done;
  auto revision = database.prepare("SELECT revision FROM parts WHERE kind='world' AND id='version'");
  if (!revision) return revision.error();
  const auto row = revision->step();
  if (!row) return row.error();
  if (!*row) return {};  // the world has no saves: the first save writes the version
  const std::vector<std::byte> body = body_of(digits);
  const Part part{{part::kWorld, std::string("version")}, static_cast<std::uint64_t>(revision->integer(0)), body};
  revision->reset();
  auto put = database.prepare("UPDATE parts SET sum=?, body=? WHERE kind='world' AND id='version'");
  if (!put) return put.error();
  put->bind(0, static_cast<std::int64_t>(sum_of(part)));
  put->bind(1, std::span<const std::byte>(body));
  return put->run();
}

std::span<const MigrationStep> migration_steps() {
  return kSteps;
}

Status migrate(Connection& database, const std::filesystem::path& path, std::span<const MigrationStep> steps) {
  QUOIN_ASSERT(!database.is_in_transaction(), "no transaction is open");
  const auto version = database.number("PRAGMA user_version");
  if (!version) return version.error();
  const auto first = std::ranges::find(steps, static_cast<int>(*version), &MigrationStep::from);
  const std::span<const MigrationStep> wanted(first, steps.end());
  if (wanted.empty()) return {};
  if (std::ranges::any_of(wanted, &MigrationStep::changes_rows)) {
    if (auto done = keep_copy(database, path); !done) return done;
  }
  Status done = database.run("BEGIN IMMEDIATE");
  for (std::size_t i = 0; done && i < wanted.size(); ++i) {
    QUOIN_ASSERT(i == 0 || wanted[i].from == wanted[i - 1].from + 1, "steps without a gap");
    done = wanted[i].run(database);
  }
  if (done) done = put_version(database, wanted.back().from + 1);
  if (done) done = database.run("COMMIT");
  if (!done && database.is_in_transaction()) static_cast<void>(database.run("ROLLBACK"));
  return done;
}

namespace {

bool is_without_locks(int number) {
  return number == ENOLCK || number == EOPNOTSUPP || number == ENOSYS || number == EINVAL;
}

Error refused(int number) {
  if (number == EWOULDBLOCK) {
    return make_error(ErrorCode::CannotWrite, "it is already open for writing, in this or another program");
  }
  if (is_without_locks(number)) {
    return make_error(ErrorCode::CannotWrite, "cannot write it safely: its file system has no locks");
  }
  return make_error(ErrorCode::CannotWrite, "cannot lock it: " + std::generic_category().message(number));
}

// Returns true if the open file still has that name: its last holder may have removed it.
bool is_named(int descriptor, const std::filesystem::path& file) {
  struct stat open_file {};
  struct stat named {};
  return ::fstat(descriptor, &open_file) == 0 && ::stat(file.c_str(), &named) == 0 &&
         open_file.st_ino == named.st_ino && open_file.st_dev == named.st_dev;
}

}  // namespace

Result<WorldLock> WorldLock::take(const std::filesystem::path& world) {
  constexpr int kAttempts = 100;
  WorldLock lock;
  lock.file_ = world.string() + "-lock";
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    lock.descriptor_ = ::open(lock.file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (lock.descriptor_ < 0) {
      const int number = errno;
      if (number == ENOENT) return make_error(ErrorCode::CannotWrite, "its folder does not exist");
      return make_error(ErrorCode::CannotWrite,
                        "cannot create its lock file: " + std::generic_category().message(number));
    }
    const int number = ::flock(lock.descriptor_, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
    if (number == 0 && is_named(lock.descriptor_, lock.file_)) return lock;
    ::close(std::exchange(lock.descriptor_, -1));
    if (is_without_locks(number)) ::unlink(lock.file_.c_str());
    if (number != 0) return refused(number);
  }
  return refused(EWOULDBLOCK);
}

WorldLock::WorldLock(WorldLock&& other) noexcept
    : file_(std::move(other.file_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

WorldLock& WorldLock::operator=(WorldLock&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

WorldLock::~WorldLock() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());  // unlinked while locked: a waiting process detects that the name refers to another file
  ::close(descriptor_);
}

bool has_locks(const std::filesystem::path& world) {
  // Queries the folder: closing a descriptor of the world itself would release this process's locks on it.
  const std::filesystem::path folder = world.parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return true;
  const int number = ::flock(descriptor, LOCK_SH | LOCK_NB) == 0 ? 0 : errno;
  ::close(descriptor);
  return !is_without_locks(number);
}

bool is_on_network(const std::filesystem::path& world) {
  // NFS, SMB, CIFS, SMB2, 9P, Ceph, FUSE (sshfs and others), AFS, Coda.
  constexpr std::array<unsigned long, 9> kKinds = {0x6969,     0x517B,     0xFF534D42, 0xFE534D42, 0x01021997,
                                                   0x00C36400, 0x65735546, 0x5346414F, 0x73757245};
  const std::filesystem::path folder = world.parent_path();
  struct statfs info {};
  if (::statfs(folder.empty() ? "." : folder.c_str(), &info) != 0) return false;
  const auto kind = static_cast<unsigned long>(info.f_type) & 0xFFFFFFFFUL;
  return std::ranges::find(kKinds, kind) != kKinds.end();
}

}  // namespace quoin::store
