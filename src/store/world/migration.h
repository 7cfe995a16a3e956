#pragma once

#include <filesystem>
#include <span>

#include <quoin/core/result.h>

#include "store/database/connection.h"

namespace quoin::store {

/// What takes a world from one version of the format to the next.
struct MigrationStep {
  int from = 0;               ///< to the next one
  bool changes_rows = false;  ///< rather than to add something: what was there is then kept as another file
  Status (*run)(Connection& database) = nullptr;  ///< within a transaction that is none of its own
};

/// One for each version before the present one, from version 1 on.
[[nodiscard]] std::span<const MigrationStep> migration_steps();

/// Has a world say a version, in its header and in the part that says it.
[[nodiscard]] Status put_version(Connection& database, int version);

/// Takes a world to the version after the last of the steps, all of them in one transaction: after a crash, and where
/// one of them fails, it is as it was. Where rows change, a copy of the world is kept beside it first, as NAME~ or,
/// where there is such a file, under the next such name that is free. Nothing is done to a world of that version.
///
/// Requires: `database` is open for writing, by whoever holds the lock of `path`; a commit lasts once it returns.
/// Errors: CannotWrite (a full disk ...), BadFormat.
[[nodiscard]] Status migrate(Connection& database, const std::filesystem::path& path,
                             std::span<const MigrationStep> steps = migration_steps());

}  // namespace quoin::store
