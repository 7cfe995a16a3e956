#pragma once

#include <filesystem>
#include <span>

#include <quoin/core/result.h>

#include "store/database/connection.h"

namespace quoin::store {

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

}  // namespace quoin::store
