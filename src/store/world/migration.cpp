#include "store/world/migration.h"

#include <algorithm>
#include <array>
#include <string>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "store/database/schema.h"
#include "store/world/world_open.h"

namespace quoin::store {
namespace {

// Adds an index that holds the chunks' keys without their bodies.
Status add_key_index(Connection& database) {
  return database.run("CREATE INDEX chunk_keys ON chunks(key)");
}

// Version 3 has environment parts, which earlier programs would ignore.
Status add_nothing(Connection& /*database*/) {
  return {};
}

constexpr std::array kSteps = {MigrationStep{1, false, add_key_index}, MigrationStep{2, false, add_nothing}};
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

}  // namespace quoin::store
