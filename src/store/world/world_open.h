#pragma once

#include <filesystem>
#include <span>

#include <quoin/core/result.h>

#include "core/database/connection.h"
#include "store/world/world_reader.h"

namespace quoin::store {

/// Opens a world file for reading, also in a read-only folder.
[[nodiscard]] Result<WorldReader> open_reader(const std::filesystem::path& path, const char* vfs = nullptr);
/// Makes commits of a writing connection durable when they return. Uses a write-ahead log, except on networks.
[[nodiscard]] Status begin_writing(Connection& connection, bool is_network);
/// Empties and disables the log, so that the world is a single file that works on any medium. Returns false if the log
/// is in use: it then stays for the next writer.
bool end_writing(Connection& connection);
/// Removes a database's log files.
void remove_database_log(const std::filesystem::path& path);
/// Removes a database with its log files.
void remove_database(const std::filesystem::path& path);

/// Returns an unused temporary name in the world's folder.
[[nodiscard]] std::filesystem::path fresh_name(const std::filesystem::path& world);

enum class Existing : std::uint8_t { Refused, Replaced };
/// Renames a closed database; after a power cut the new name has the complete file or does not exist. Errors:
/// CannotWrite.
[[nodiscard]] Status move_in_place(const std::filesystem::path& from, const std::filesystem::path& to,
                                   Existing existing = Existing::Refused);

/// Upgrades a world from one format version to the next.
struct MigrationStep {
  int from = 0;               ///< upgrades to from + 1
  bool changes_rows = false;  ///< changes existing rows instead of only adding to them: a backup file is then kept
  Status (*run)(Connection& database) = nullptr;  ///< runs within the caller's transaction
};

/// Returns a step for each version before the current version, from version 1 on.
[[nodiscard]] std::span<const MigrationStep> migration_steps();

/// Sets a world's version, in its header and in its version part.
[[nodiscard]] Status put_version(Connection& database, int version);

/// Upgrades a world to the version after the last step, in one transaction: after a crash or a failed step it is
/// unchanged. If rows change, a copy of the world is kept in the same folder first, as NAME~ or, if that file
/// exists, under the next free name of this form. Does nothing to a world of that version.
///
/// Requires: `database` is open for writing and the caller holds the lock of `path`; commits are durable on return.
/// Errors: CannotWrite (a full disk ...), BadFormat.
[[nodiscard]] Status migrate(Connection& database, const std::filesystem::path& path,
                             std::span<const MigrationStep> steps = migration_steps());

/// Ensures that only this process writes a world: a lock on NAME-lock that the system releases when the process ends.
class WorldLock {
 public:
  /// Errors: CannotWrite if another writer has it, or the file system has no locks.
  [[nodiscard]] static Result<WorldLock> take(const std::filesystem::path& world);
  /// Holds no lock.
  WorldLock() = default;
  WorldLock(WorldLock&& other) noexcept;
  WorldLock& operator=(WorldLock&& other) noexcept;
  ~WorldLock();

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

/// Returns true if the file system of a world's folder supports locks, or if that is unknown.
[[nodiscard]] bool has_locks(const std::filesystem::path& world);

/// Returns true if a world's folder is on another machine, where programs cannot share memory.
[[nodiscard]] bool is_on_network(const std::filesystem::path& world);

}  // namespace quoin::store
