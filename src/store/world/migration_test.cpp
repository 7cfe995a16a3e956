#include "store/world/world_open.h"

#include <array>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/file.h>
#include <quoin/store/world_maintenance.h>

#include "store/database/schema.h"
#include "store/world/world_for_tests.h"

namespace quoin::store {
namespace {

constexpr int kChunks = 40;

void make_world(const std::filesystem::path& path) {
  auto world = WorldStore::create(path);
  ASSERT_TRUE(world) << to_string(world.error());
  WorldChanges changes;
  changes.put_types(coloured_types(9));
  changes.put_grid(0, {.name = "ground"});
  for (int i = 0; i < kChunks; ++i)
    changes.put_chunk({0, 0, {i, 0, 0}}, {random_chunk(static_cast<std::uint32_t>(i), 9)});
  ASSERT_TRUE(world->save(std::move(changes)));
  ASSERT_TRUE(world->flush());
}

Connection write(const std::filesystem::path& path) {
  return std::move(*Connection::open(path.string(), Connection::Mode::Write));
}

void set_version(Connection& database, int version) {
  ASSERT_TRUE(database.run(("PRAGMA user_version=" + std::to_string(version)).c_str()));
  const std::string digits = std::to_string(version);
  const std::vector<std::byte> body = body_of(digits);
  const Part part{{part::kWorld, std::string("version")}, 1, body};
  auto put = database.prepare("UPDATE parts SET revision=1, sum=?, body=? WHERE kind='world' AND id='version'");
  ASSERT_TRUE(put);
  put->bind(0, static_cast<std::int64_t>(sum_of(part)));
  put->bind(1, std::span<const std::byte>(body));
  ASSERT_TRUE(put->run());
}

// Creates a world in the first version of the format.
void make_version_1(const std::filesystem::path& path) {
  make_world(path);
  Connection database = write(path);
  ASSERT_TRUE(database.run("DROP INDEX chunk_keys"));
  set_version(database, 1);
  ASSERT_TRUE(database.close());
}

int version_of(const std::filesystem::path& path) {
  const auto summary = summarize_world(path);
  return summary ? summary->version : -1;
}

std::size_t sound_chunks(const std::filesystem::path& path) {
  const auto check = check_world(path);
  return check && check->damage.empty() ? check->chunks : 0;
}

TEST(Migration, ReadsFirstVersionUnchanged) {
  const WorldFolder folder;
  const auto path = folder / "old.quoin";
  make_version_1(path);
  {
    const auto world = WorldStore::open(path, WorldAccess::Read);
    ASSERT_TRUE(world) << to_string(world.error());
    EXPECT_EQ(world->chunks(0, 0)->size(), std::size_t{kChunks});
  }
  EXPECT_EQ(version_of(path), 1);
  EXPECT_EQ(sound_chunks(path), std::size_t{kChunks});
}

TEST(Migration, UpgradesWhenOpenedForWriting) {
  const WorldFolder folder;
  const auto path = folder / "old.quoin";
  make_version_1(path);
  {
    auto world = WorldStore::open(path, WorldAccess::Write);
    ASSERT_TRUE(world) << to_string(world.error());
    EXPECT_EQ(world->chunks(0, 0)->size(), std::size_t{kChunks});
  }
  EXPECT_EQ(version_of(path), kSchemaVersion);
  EXPECT_EQ(sound_chunks(path), std::size_t{kChunks});  // the version part has a correct checksum too
  Connection database = write(path);
  EXPECT_EQ(*database.number("SELECT count(*) FROM sqlite_schema WHERE name='chunk_keys'"), 1);
  EXPECT_EQ(*database.text("SELECT body FROM parts WHERE kind='world' AND id='version'"),
            std::to_string(kSchemaVersion));
  EXPECT_FALSE(std::filesystem::exists(path.string() + "~"));  // steps that only add keep no copy
}

// Programs of version 4 cannot read types with textures, and those of version 5 no types with shapes. They report them
// as damage unless the version is later.
TEST(Migration, MarksWorldsThatMayHaveTexturesOrShapes) {
  for (const int version : {4, 5}) {
    const WorldFolder folder;
    const auto path = folder / "w.quoin";
    make_world(path);
    {
      Connection database = write(path);
      set_version(database, version);
      ASSERT_TRUE(database.close());
    }
    ASSERT_TRUE(WorldStore::open(path, WorldAccess::Write));
    EXPECT_EQ(version_of(path), 6);
    EXPECT_EQ(sound_chunks(path), std::size_t{kChunks});
  }
}

TEST(Migration, ListsKeysWithoutReadingBodies) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  Connection database = write(path);
  for (const char* const sql : {"EXPLAIN QUERY PLAN SELECT key FROM chunks",
                                "EXPLAIN QUERY PLAN SELECT key FROM chunks WHERE key BETWEEN 5 AND 9"}) {
    auto plan = database.prepare(sql);
    ASSERT_TRUE(plan);
    ASSERT_TRUE(*plan->step());
    EXPECT_NE(plan->text(3).find("COVERING INDEX chunk_keys"), std::string_view::npos) << plan->text(3);
  }
}

// Steps of a future program: from the present version to one that renames types, and to the next one.
Status rename_values(Connection& database) {
  return database.run("UPDATE parts SET kind='thing' WHERE kind='value'; CREATE TABLE added(x)");
}
Status add_nothing(Connection& /*database*/) {
  return {};
}
Status fail_halfway(Connection& database) {
  if (auto done = database.run("DELETE FROM chunks"); !done) return done;
  return database.run("INSERT INTO nowhere VALUES(1)");
}

TEST(Migration, KeepsCopyIfRowsChange) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  constexpr std::array kSteps = {MigrationStep{kSchemaVersion, true, rename_values},
                                 MigrationStep{kSchemaVersion + 1, false, add_nothing}};
  for (const bool is_again : {false, true}) {
    Connection database = write(path);
    ASSERT_TRUE(migrate(database, path, kSteps)) << is_again;  // the second call does nothing
    EXPECT_EQ(*database.number("PRAGMA user_version"), kSchemaVersion + 2);
    EXPECT_EQ(*database.number("SELECT count(*) FROM sqlite_schema WHERE name='added'"), 1);
    ASSERT_TRUE(database.close());
  }
  const std::filesystem::path kept = path.string() + "~";
  EXPECT_EQ(version_of(kept), kSchemaVersion);
  EXPECT_EQ(sound_chunks(kept), std::size_t{kChunks});
  const auto refused = WorldStore::open(path, WorldAccess::Read);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_NE(to_string(refused.error()).find("needs a later Quoin"), std::string::npos);
  EXPECT_EQ(to_string(refused.error()).find('\n'), std::string::npos);
  EXPECT_EQ(WorldStore::open(path, WorldAccess::Write).error().code, ErrorCode::Unsupported);
}

TEST(Migration, FailedStepsLeaveWorldUnchanged) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  constexpr std::array kSteps = {MigrationStep{kSchemaVersion, false, rename_values},
                                 MigrationStep{kSchemaVersion + 1, true, fail_halfway}};
  {
    Connection database = write(path);
    EXPECT_FALSE(migrate(database, path, kSteps));
    EXPECT_FALSE(database.is_in_transaction());
  }
  EXPECT_EQ(version_of(path), kSchemaVersion);
  EXPECT_EQ(sound_chunks(path), std::size_t{kChunks});
  EXPECT_EQ(sound_chunks(path.string() + "~"), std::size_t{kChunks});
}

TEST(Migration, NeverReplacesOlderCopy) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  std::ofstream(path.string() + "~") << "mine";
  constexpr std::array kSteps = {MigrationStep{kSchemaVersion, true, rename_values}};
  Connection database = write(path);
  ASSERT_TRUE(migrate(database, path, kSteps));
  EXPECT_EQ(std::filesystem::file_size(path.string() + "~"), 4U);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

}  // namespace
}  // namespace quoin::store
