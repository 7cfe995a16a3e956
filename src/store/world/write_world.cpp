#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <quoin/io/file.h>
#include <quoin/store/world_saver.h>

#include "io/whole_file.h"
#include "io/world_format.h"
#include "store/world/connection.h"
#include "store/world/schema.h"
#include "store/world/world_changes.h"
#include "store/world/world_lock.h"
#include "store/world/world_open.h"

namespace quoin {

using namespace store;

namespace {

/// Empties the log of a world that is about to be replaced: the new one must not find it. Others that read it keep what
/// they have open.
Status clear_log(const std::filesystem::path& path) {
  const auto beginning = read_file_beginning(path, kWorldHeaderBytes);
  if (!beginning) return beginning.error();
  if (is_world_format(*beginning)) {
    auto connection = Connection::open(path.string(), Connection::Mode::Write);
    if (!connection) return connection.error();
    // A world that cannot be read has a log that cannot be either.
    if (check_schema(*connection)) {
      if (!end_writing(*connection)) return make_error(ErrorCode::CannotWrite, "another program reads it");
      if (auto done = connection->close(); !done) return done;
    }
  }
  std::error_code error;
  for (const char* suffix : {"-wal", "-shm", "-journal"}) std::filesystem::remove(path.string() + suffix, error);
  return {};
}

Status sync_file(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int number = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (done) return {};
  return make_error(ErrorCode::CannotWrite, "it cannot be written: " + std::generic_category().message(number));
}

/// A world that is made beside the name that it is to have; without `put_in_place` nothing is left of it.
class FreshWorld {
 public:
  explicit FreshWorld(std::filesystem::path path) : path_(std::move(path)), fresh_(path_.string() + "-new") {}
  FreshWorld(const FreshWorld&) = delete;
  FreshWorld& operator=(const FreshWorld&) = delete;
  ~FreshWorld() { remove_database(fresh_); }

  Status begin() {
    auto lock = WorldLock::take(path_);
    if (!lock) return lock.error();
    lock_ = std::move(*lock);
    remove_database(fresh_);
    return {};
  }
  [[nodiscard]] const std::filesystem::path& fresh() const { return fresh_; }

  Status put_in_place() {
    if (auto done = sync_file(fresh_); !done) return done;
    std::error_code error;
    const auto status = std::filesystem::status(path_, error);
    if (std::filesystem::exists(status)) {
      if (!std::filesystem::is_regular_file(status)) {
        return make_error(ErrorCode::CannotWrite, "it is not a regular file");
      }
      if (auto done = clear_log(path_); !done) return done;
      std::filesystem::permissions(fresh_, status.permissions(), error);
    }
    std::filesystem::rename(fresh_, path_, error);
    if (error) return make_error(ErrorCode::CannotWrite, error.message());
    sync_folder(path_.parent_path());
    return {};
  }

 private:
  std::filesystem::path path_;
  std::filesystem::path fresh_;
  WorldLock lock_;
};

Result<SavedScene> write(const Scene& scene, WorldView view, const std::filesystem::path& path, Threads threads,
                         const Progress& progress) {
  const std::filesystem::path target = follow_links(path);
  FreshWorld fresh(target);
  if (auto done = fresh.begin(); !done) return done.error();
  {
    auto world = WorldParts::create_unsynced(fresh.fresh(), threads);
    if (!world) return world.error();
    WorldSaver saver;
    saver.set_view(std::move(view));
    if (progress && !progress(0.0)) return make_error(ErrorCode::Cancelled, "cancelled");
    const auto ticket = saver.save(*world, scene);
    if (!ticket) return ticket.error();
    if (auto done = world->flush(); !done) return done.error();
    if (progress && !progress(0.95)) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  if (auto done = fresh.put_in_place(); !done) return done.error();
  std::error_code error;
  SavedScene saved;
  saved.bytes = std::filesystem::file_size(target, error);
  return saved;
}

}  // namespace

namespace store {

void remove_database(const std::filesystem::path& path) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) std::filesystem::remove(path.string() + suffix, ignored);
}

}  // namespace store

// Errors name the file that was wanted, not the one beside it.
Result<SavedScene> write_world(const Scene& scene, const std::filesystem::path& path, Threads threads,
                               const Progress& progress) {
  auto saved = write(scene, {}, path, threads, progress);
  if (!saved) saved.error().path = path.string();
  return saved;
}

Result<SavedScene> write_world(const LoadedScene& loaded, const std::filesystem::path& path, Threads threads,
                               const Progress& progress) {
  auto saved = write(loaded.scene, {loaded.sun, loaded.camera, loaded.cameras}, path, threads, progress);
  if (!saved) saved.error().path = path.string();
  return saved;
}

}  // namespace quoin
