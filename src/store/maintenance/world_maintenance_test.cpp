#include <quoin/store/world_maintenance.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <quoin/core/memory.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/store/world_saver.h>

#include "core/database/connection.h"
#include "core/work/nightly_for_tests.h"
#include "store/chunk/chunk_body.h"
#include "store/database/schema.h"
#include "store/world/part_text.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

constexpr int kChunks = 120;

ChunkAddress place_of(int i) {
  return {0, 0, {i % 10, i / 10 % 4, i / 40 - 1}};
}

Chunk chunk_of(int i) {
  return random_chunk(static_cast<std::uint32_t>(i), 9);
}

void make_world(const std::filesystem::path& path) {
  auto world = WorldStore::create(path);
  ASSERT_TRUE(world) << to_string(world.error());
  WorldChanges changes;
  changes.put_types(coloured_types(9));
  changes.put_grid(0, {.name = "ground"});
  for (int i = 0; i < kChunks; ++i) changes.put_chunk(place_of(i), {chunk_of(i)});
  changes.put_value("inventory", std::vector<std::byte>(3000, std::byte{7}));
  ASSERT_TRUE(world->save(std::move(changes)));
  ASSERT_TRUE(world->flush());
}

std::size_t sound_chunks(const std::filesystem::path& path) {
  const auto world = WorldStore::open(path, WorldAccess::Read);
  if (!world) return 0;
  std::size_t sound = 0;
  for (int i = 0; i < kChunks; ++i) {
    const auto chunk = world->load_chunk(place_of(i));
    sound += chunk && *chunk && (*chunk)->voxels == chunk_of(i) ? 1 : 0;
  }
  return sound;
}

TEST(WorldMaintenance, SummarizesAndChecksSoundWorld) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  const auto summary = summarize_world(path);
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->version, 6);
  EXPECT_EQ(summary->types, 9U);
  EXPECT_EQ(summary->values, 1U);
  EXPECT_EQ(summary->saves, 1U);
  EXPECT_EQ(summary->grids.at(0).grid.name, "ground");
  EXPECT_EQ(summary->grids.at(0).chunks, std::uint64_t{kChunks});
  EXPECT_EQ(summary->grids.at(0).chunk_bounds, (IBox{{0, 0, -1}, {10, 4, 2}}));
  const auto check = check_world(path);
  ASSERT_TRUE(check) << to_string(check.error());
  EXPECT_EQ(check->chunks, std::uint64_t{kChunks});
  EXPECT_TRUE(check->damage.empty()) << check->damage.front().what;
}

TEST(WorldMaintenance, BacksUpWhileWorldIsWritten) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  auto world = WorldStore::open(path, WorldAccess::Write);
  WorldChanges changes;
  changes.put_chunk({0, 0, {50, 0, 0}}, {Chunk(3)});
  ASSERT_TRUE(world->save(std::move(changes)));
  ASSERT_TRUE(world->flush());
  const auto bytes = back_up_world(path, folder / "b.quoin");
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  EXPECT_EQ(*bytes, std::filesystem::file_size(folder / "b.quoin"));
  EXPECT_EQ(sound_chunks(folder / "b.quoin"), std::size_t{kChunks});
  EXPECT_TRUE(WorldStore::open(folder / "b.quoin", WorldAccess::Read)->load_chunk({0, 0, {50, 0, 0}})->has_value());
  EXPECT_TRUE(check_world(folder / "b.quoin")->damage.empty());
  const auto again = back_up_world(path, folder / "b.quoin");
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::CannotWrite);
  EXPECT_FALSE(back_up_world(folder / "none.quoin", folder / "c.quoin"));
  EXPECT_FALSE(std::filesystem::exists(folder / "c.quoin-new"));
  const auto compacted = compact_world(path);
  ASSERT_FALSE(compacted) << "while it is written";
  EXPECT_EQ(compacted.error().code, ErrorCode::CannotWrite);
}

TEST(WorldMaintenance, CompactingReclaimsSpace) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  {
    auto world = WorldStore::open(path, WorldAccess::Write);
    WorldChanges changes;
    for (int i = 20; i < kChunks; ++i) changes.remove_chunk(place_of(i));
    ASSERT_TRUE(world->save(std::move(changes)));
    ASSERT_TRUE(world->flush());
  }
  const auto before = std::filesystem::file_size(path);
  const auto bytes = compact_world(path);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  EXPECT_LT(*bytes, before);
  EXPECT_EQ(sound_chunks(path), 20U);
}

/// Flips bytes of a file.
void damage(const std::filesystem::path& path, std::uintmax_t at, std::size_t count) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(at));
  std::string bytes(count, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  file.clear();
  for (char& byte : bytes) byte = static_cast<char>(~byte);
  file.seekp(static_cast<std::streamoff>(at));
  file.write(bytes.data(), static_cast<std::streamsize>(count));
}

int wanted_damage() {
  const char* const wanted = std::getenv("QUOIN_DAMAGE");
  return wanted != nullptr ? std::atoi(wanted) : cases(20, 60);
}

// The check names all lost items; the repaired world has all others.
TEST(WorldMaintenance, DetectsDamageAndKeepsSoundParts) {
  const WorldFolder folder;
  const auto whole = folder / "whole.quoin";
  make_world(whole);
  const auto size = std::filesystem::file_size(whole);
  std::minstd_rand random(5);
  for (int i = 0; i < wanted_damage(); ++i) {
    const auto path = folder / "w.quoin";
    const auto repaired = folder / "repaired.quoin";
    std::filesystem::copy_file(whole, path, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::remove(repaired);
    const bool is_page = i % 3 == 0;
    const std::uintmax_t at = is_page ? random() % (size / 8192) * 8192 : random() % size;
    damage(path, at, std::min<std::uintmax_t>(is_page ? 8192 : 1 + random() % 40, size - at));
    SCOPED_TRACE("damage " + std::to_string(i) + " at " + std::to_string(at));
    const auto check = check_world(path);
    const std::size_t readable = sound_chunks(path);
    if (check && check->damage.empty()) {
      ASSERT_EQ(readable, std::size_t{kChunks}) << "the check finds all damage";
    }
    const auto repair = repair_world(path, repaired);
    ASSERT_TRUE(repair) << to_string(repair.error());
    const std::size_t kept = sound_chunks(repaired);
    EXPECT_GE(kept, readable);
    // The flipped bytes may hit two bodies; a page holds about thirty of these small ones.
    EXPECT_GE(kept, std::size_t{kChunks} - (is_page ? 40 : 2));
    EXPECT_EQ(repair->check.chunks, kept);
    const auto sound = check_world(repaired);
    ASSERT_TRUE(sound) << to_string(sound.error());
    EXPECT_TRUE(sound->damage.empty()) << sound->damage.front().what;
  }
}

TEST(WorldMaintenance, RepairReplacesDamagedWorld) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  damage(path, std::filesystem::file_size(path) / 2, 200);
  const auto before = read_file(path);
  const auto repair = repair_world(path, path);
  ASSERT_TRUE(repair) << to_string(repair.error());
  ASSERT_FALSE(repair->kept.empty());
  EXPECT_EQ(*read_file(repair->kept), *before) << "the damaged one is as it was";
  EXPECT_TRUE(check_world(path)->damage.empty());
  EXPECT_GE(sound_chunks(path), std::size_t{kChunks} - 3);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

TEST(WorldMaintenance, MarksLostTypesByColour) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  // All types are lost, since their texts are stored together.
  const auto bytes = read_file(path);
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  for (std::size_t at = text.find("\"type 1\""); at != std::string_view::npos; at = text.find("\"type 1\"", at + 1)) {
    damage(path, at, 1);
  }
  const auto repair = repair_world(path, folder / "m.quoin");
  ASSERT_TRUE(repair) << to_string(repair.error());
  EXPECT_FALSE(repair->check.damage.empty());
  const auto types = WorldStore::open(folder / "m.quoin", WorldAccess::Read)->types();
  EXPECT_EQ((*types)[1].colour, (Rgba8{255, 0, 255, 255}));
  EXPECT_EQ((*types)[2], coloured_type(2));
  EXPECT_EQ(sound_chunks(folder / "m.quoin"), std::size_t{kChunks});
}

/// Adds a part with a correct checksum, as no save would.
void put_part(const std::filesystem::path& path, const store::PartKey& key, std::string_view text) {
  auto connection = Connection::open(path.string(), Connection::Mode::Write);
  ASSERT_TRUE(connection) << to_string(connection.error());
  auto insert = connection->prepare("INSERT INTO parts(kind, id, revision, sum, body) VALUES(?, ?, 1, ?, ?)");
  ASSERT_TRUE(insert) << to_string(insert.error());
  const std::vector<std::byte> body = store::body_of(text);
  insert->bind(0, std::string_view(key.kind));
  store::bind(*insert, 1, key.id);
  insert->bind(2, static_cast<std::int64_t>(store::sum_of({key, 1, body})));
  insert->bind(3, std::span<const std::byte>(body));
  ASSERT_TRUE(insert->run());
}

TEST(WorldMaintenance, RepairLeavesOutPartsWithInvalidNumbers) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  const std::vector<store::PartKey> invalid = {
      {store::part::kType, std::int64_t{0}},       {store::part::kType, std::int64_t{65'536}},
      {store::part::kType, std::int64_t{1} << 52}, {store::part::kType, std::string("stone")},
      {store::part::kGrid, std::int64_t{-1}},      {store::part::kGrid, std::int64_t{0xFFFF'FFFF}},
      {store::part::kGrid, std::int64_t{1} << 32},
  };
  for (const store::PartKey& key : invalid) {
    put_part(path, key,
             key.kind == store::part::kType ? store::text_of(coloured_type(7)) : store::text_of(WorldGrid{}));
  }
  const auto check = check_world(path);
  ASSERT_TRUE(check) << to_string(check.error());
  EXPECT_EQ(check->damage.size(), invalid.size());
  const auto repair = repair_world(path, folder / "m.quoin");
  ASSERT_TRUE(repair) << to_string(repair.error());
  ASSERT_EQ(repair->check.damage.size(), invalid.size());
  for (const store::PartKey& key : invalid) {
    const std::string line = store::name_of(key) + " is not valid";
    EXPECT_EQ(std::ranges::count(repair->check.damage, line, &WorldDamage::what), 1) << line;
  }
  EXPECT_EQ(WorldStore::open(folder / "m.quoin", WorldAccess::Read)->types()->size(), 10U);
  EXPECT_EQ(sound_chunks(folder / "m.quoin"), std::size_t{kChunks});
  EXPECT_TRUE(check_world(folder / "m.quoin")->damage.empty());
}

/// Adds a chunk with a correct checksum, as no save would.
void put_chunk(const std::filesystem::path& path, std::int64_t region, const ChunkAddress& place) {
  auto connection = Connection::open(path.string(), Connection::Mode::Write);
  ASSERT_TRUE(connection) << to_string(connection.error());
  auto put_region = connection->prepare("INSERT INTO regions(id, grid, level, x, y, z) VALUES(?, ?, 0, ?, ?, ?)");
  auto put_body = connection->prepare("INSERT INTO chunks(key, body) VALUES(?, ?)");
  ASSERT_TRUE(put_region && put_body);
  put_region->bind(0, region);
  put_region->bind(1, std::int64_t{place.grid});
  for (int axis = 0; axis < 3; ++axis) {
    put_region->bind(2 + axis, std::int64_t{store::region_of(place).region[axis]});
  }
  ASSERT_TRUE(put_region->run());
  BlockVector<std::byte> body;
  ASSERT_TRUE(store::ChunkEncoder().encode(place, 1, Chunk(VoxelType{1}), nullptr, body));
  put_body->bind(0, store::key_of(region, place.chunk));
  put_body->bind(1, std::span<const std::byte>(body));
  ASSERT_TRUE(put_body->run());
}

TEST(WorldMaintenance, RepairLeavesOutChunksWithInvalidAddresses) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  const ChunkAddress far{0, 0, {1 << 27, 0, 0}};
  const ChunkAddress of_no_grid{0xFFFF'FFFF, 0, {0, 0, 0}};
  put_chunk(path, 900, far);
  put_chunk(path, 901, of_no_grid);
  const auto check = check_world(path);
  ASSERT_TRUE(check) << to_string(check.error());
  const auto repair = repair_world(path, folder / "m.quoin");
  ASSERT_TRUE(repair) << to_string(repair.error());
  for (const std::vector<WorldDamage>& damage : {check->damage, repair->check.damage}) {
    ASSERT_EQ(damage.size(), 2U);
    EXPECT_EQ(damage[0].what, "chunk (134217728, 0, 0) of grid 0 lies more than 2^26 chunks from the origin");
    EXPECT_EQ(damage[0].chunk, far);
    EXPECT_EQ(damage[1].chunk, of_no_grid);
  }
  EXPECT_EQ(sound_chunks(folder / "m.quoin"), std::size_t{kChunks});
  EXPECT_TRUE(check_world(folder / "m.quoin")->damage.empty());
}

TEST(WorldMaintenance, RepairPlacesLostGridDespiteLargeGridNumber) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  put_chunk(path, 900, {5, 0, {0, 0, 0}});
  SceneFile::Placement of_no_grid;
  of_no_grid.grid = (std::size_t{1} << 32U) + 5;
  put_part(path, {store::part::kInstance, std::int64_t{3}}, store::text_of(of_no_grid));
  ASSERT_TRUE(repair_world(path, folder / "m.quoin"));
  const auto loaded = load_scene(folder / "m.quoin");
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const auto instances = loaded->scene.instances().handles();
  ASSERT_EQ(instances.size(), 1U);
  EXPECT_EQ(loaded->scene.instances()[instances[0]].name, "lost grid 5");
}

TEST(WorldMaintenance, RefusesToRepairInvalidFiles) {
  const WorldFolder folder;
  std::ofstream(folder / "text.quoin") << std::string(30'000, 'x');
  const auto repair = repair_world(folder / "text.quoin", folder / "m.quoin");
  ASSERT_FALSE(repair);
  EXPECT_EQ(repair.error().code, ErrorCode::BadFormat);
  EXPECT_FALSE(std::filesystem::exists(folder / "m.quoin"));
  EXPECT_FALSE(std::filesystem::exists(folder / "m.quoin-new"));
  EXPECT_FALSE(repair_world(folder / "none", folder / "m.quoin"));
}

std::vector<std::byte> png_of(char last) {
  const std::string text = std::string("\x89PNG\r\n\x1A\n") + last;
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

TEST(WorldThumbnail, IsKeptUntilReplaced) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  EXPECT_EQ(summarize_world(path)->thumbnail_bytes, 0U);
  {
    auto world = WorldStore::open(path, WorldAccess::Write);
    EXPECT_FALSE(world->thumbnail()->has_value());
    for (const char last : {'a', 'b'}) {
      WorldChanges changes;
      changes.put_thumbnail(png_of(last));
      ASSERT_TRUE(world->save(std::move(changes)));
      EXPECT_EQ(**world->thumbnail(), png_of(last));
    }
    WorldChanges none;
    none.put_thumbnail(std::vector<std::byte>(100));
    const auto refused = world->save(std::move(none));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    ASSERT_TRUE(world->flush());
  }
  EXPECT_EQ(**WorldStore::open(path, WorldAccess::Read)->thumbnail(), png_of('b'));
  EXPECT_EQ(summarize_world(path)->thumbnail_bytes, 9U);
  EXPECT_TRUE(check_world(path)->damage.empty());
  auto world = WorldStore::open(path, WorldAccess::Write);
  WorldChanges changes;
  changes.remove_thumbnail();
  ASSERT_TRUE(world->save(std::move(changes)));
  EXPECT_FALSE(world->thumbnail()->has_value());
}

TEST(WorldCopy, CopiesEverything) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  {
    auto world = WorldStore::open(path, WorldAccess::Write);
    WorldChanges changes;
    changes.put_thumbnail(png_of('a'));
    changes.put_chunk({0, 3, {1, 2, 3}}, {Chunk(2)});  // another level
    ASSERT_TRUE(world->save(std::move(changes)));
    ASSERT_TRUE(world->flush());
  }
  const auto copied = copy_world(path, folder / "c.quoin");
  ASSERT_TRUE(copied) << to_string(copied.error());
  EXPECT_EQ(copied->chunks, kChunks + 1U);
  EXPECT_TRUE(copied->lost.empty());
  EXPECT_EQ(copied->bytes, std::filesystem::file_size(folder / "c.quoin"));
  std::uint64_t voxels = 0;
  for (int i = 0; i < kChunks; ++i) voxels += static_cast<std::uint64_t>(chunk_of(i).non_air_count());
  EXPECT_EQ(copied->voxels, voxels);
  EXPECT_EQ(sound_chunks(folder / "c.quoin"), std::size_t{kChunks});
  EXPECT_TRUE(check_world(folder / "c.quoin")->damage.empty());
  const auto copy = WorldStore::open(folder / "c.quoin", WorldAccess::Read);
  EXPECT_EQ(**copy->value("inventory"), std::vector<std::byte>(3000, std::byte{7}));
  EXPECT_EQ(**copy->thumbnail(), png_of('a'));
  EXPECT_EQ((*copy->load_chunk({0, 3, {1, 2, 3}}))->voxels.uniform(), 2);
  // The world remains usable: grid and region numbers match it.
  auto on = WorldStore::open(folder / "c.quoin", WorldAccess::Write);
  WorldChanges more;
  more.put_chunk({0, 0, {500, 0, 0}}, {Chunk(1)});
  ASSERT_TRUE(on->save(std::move(more)));
  ASSERT_TRUE(on->flush());
  EXPECT_EQ(on->chunks(0, 0)->size(), kChunks + 1U);
}

TEST(WorldCopy, SkipsDamagedChunksAndRefusesOtherDamage) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  make_world(path);
  const auto damage = [&](const char* sql) {
    auto database = Connection::open(path.string(), Connection::Mode::Write);
    ASSERT_TRUE(database->run(sql));
    ASSERT_TRUE(database->close());
  };
  damage("UPDATE chunks SET body = zeroblob(length(body)) WHERE key = (SELECT max(key) FROM chunks)");
  const auto copied = copy_world(path, folder / "c.quoin");
  ASSERT_TRUE(copied) << to_string(copied.error());
  ASSERT_EQ(copied->lost.size(), 1U);
  EXPECT_TRUE(copied->lost[0].chunk.has_value());
  EXPECT_EQ(copied->chunks, kChunks - 1U);
  EXPECT_TRUE(check_world(folder / "c.quoin")->damage.empty());
  damage("UPDATE parts SET body = zeroblob(length(body)) WHERE kind = 'value'");
  const auto refused = copy_world(path, folder / "d.quoin");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::BadFormat);
  EXPECT_NE(to_string(refused.error()).find("quoin world repair"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "d.quoin"));
}

TEST(WorldCopy, ReplacesWorldUnlessOpenForWriting) {
  const WorldFolder folder;
  make_world(folder / "w.quoin");
  make_world(folder / "c.quoin");
  {
    const auto writer = WorldStore::open(folder / "c.quoin", WorldAccess::Write);
    const auto refused = copy_world(folder / "w.quoin", folder / "c.quoin");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::CannotWrite);
  }
  EXPECT_TRUE(copy_world(folder / "w.quoin", folder / "c.quoin"));
  EXPECT_EQ(sound_chunks(folder / "c.quoin"), std::size_t{kChunks});
  EXPECT_EQ(copy_world(folder / "none.quoin", folder / "e.quoin").error().code, ErrorCode::CannotRead);
  const auto cancelled = copy_world(folder / "w.quoin", folder / "e.quoin", [](double) { return false; });
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2) << "nothing of it is left";
}

}  // namespace
}  // namespace quoin
