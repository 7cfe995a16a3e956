#include <quoin/store/world_store.h>

#include <sys/stat.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "core/death_for_tests.h"
#include "store/database/schema.h"
#include "store/world/part_text.h"
#include "store/world/world_changes.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

WorldStore made(const std::filesystem::path& path, int types = 9) {
  auto world = WorldStore::create(path);
  EXPECT_TRUE(world) << to_string(world.error());
  WorldChanges changes;
  changes.put_types(coloured_types(types));
  changes.put_grid(0, {.name = "ground"});
  EXPECT_TRUE(world->save(std::move(changes)));
  EXPECT_TRUE(world->flush());
  return std::move(*world);
}

TEST(WorldStore, KeepsContentAfterReopening) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  {
    WorldStore world = made(path);
    WorldChanges changes;
    for (int i = -3; i < 40; ++i) {
      changes.put_chunk({0, 0, {i, -i, 2 * i}}, {random_chunk(static_cast<std::uint32_t>(i + 3), 9)});
    }
    changes.put_chunk({0, 0, {0, 9, 0}}, {});
    changes.put_value("inventory", bytes_of("a sword"));
    changes.put_value(std::string("\0\xff", 2), {});
    ASSERT_TRUE(world.save(std::move(changes)));
    ASSERT_TRUE(world.flush());
  }
  EXPECT_FALSE(std::filesystem::exists(path.string() + "-wal"));
  EXPECT_FALSE(std::filesystem::exists(path.string() + "-lock"));
  for (const WorldAccess access : {WorldAccess::Read, WorldAccess::Write}) {
    auto world = WorldStore::open(path, access);
    ASSERT_TRUE(world) << to_string(world.error());
    for (int i = -3; i < 40; ++i) {
      const auto chunk = world->load_chunk({0, 0, {i, -i, 2 * i}});
      ASSERT_TRUE(chunk) << to_string(chunk.error());
      ASSERT_TRUE(chunk->has_value());
      EXPECT_EQ((*chunk)->voxels, random_chunk(static_cast<std::uint32_t>(i + 3), 9));
    }
    const auto air = world->load_chunk({0, 0, {0, 9, 0}});
    ASSERT_TRUE(air && air->has_value()) << "air that was put is there";
    EXPECT_EQ((*air)->voxels.uniform(), kAir);
    EXPECT_FALSE(world->load_chunk({0, 0, {0, 10, 0}})->has_value());
    EXPECT_FALSE(world->load_chunk({0, 1, {0, 9, 0}})->has_value());
    EXPECT_EQ(world->chunks(0, 0)->size(), 44U);
    EXPECT_EQ(world->types()->size(), 10U);
    EXPECT_EQ((*world->types())[3], coloured_type(3));
    EXPECT_EQ(world->grids()->at(0).name, "ground");
    EXPECT_EQ(**world->value("inventory"), bytes_of("a sword"));
    EXPECT_EQ(world->value_names()->size(), 2U);
    EXPECT_FALSE(world->value("nothing")->has_value());
    EXPECT_EQ(world->next_grid(), 1U);
  }
  // The second store was opened for writing without a write.
  EXPECT_FALSE(std::filesystem::exists(path.string() + "-wal"));
  EXPECT_FALSE(std::filesystem::exists(path.string() + "-shm"));
}

TEST(WorldStore, ReadsSavedChunksBeforeTheyAreOnDisk) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  for (std::uint32_t i = 0; i < 300; ++i) {
    WorldChanges changes;
    changes.put_chunk({0, 0, {static_cast<int>(i % 7), 0, 0}}, {random_chunk(i, 9)});
    ASSERT_TRUE(world.save(std::move(changes)));
    const auto chunk = world.load_chunk({0, 0, {static_cast<int>(i % 7), 0, 0}});
    ASSERT_TRUE(chunk && chunk->has_value());
    ASSERT_EQ((*chunk)->voxels, random_chunk(i, 9)) << i;
    ASSERT_EQ(world.chunks(0, 0, {{0, 0, 0}, {7, 1, 1}})->size(), std::min<std::size_t>(i + 1, 7));
  }
  WorldChanges changes;
  changes.remove_chunk({0, 0, {1, 0, 0}});
  ASSERT_TRUE(world.save(std::move(changes)));
  EXPECT_FALSE(world.load_chunk({0, 0, {1, 0, 0}})->has_value());
  EXPECT_EQ(world.chunks(0, 0)->size(), 6U);
  ASSERT_TRUE(world.flush());
  EXPECT_FALSE(world.load_chunk({0, 0, {1, 0, 0}})->has_value());
  EXPECT_EQ(world.stats().pending_chunks, 0U);
  EXPECT_EQ(world.stats().pending_bytes, 0U);
}

TEST(WorldStore, RemovesChunksWithGrid) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  WorldChanges two;
  two.put_grid(1, {});
  for (int x = 0; x < 80; ++x) {
    two.put_chunk({0, 0, {x, 0, 0}}, {random_chunk(1, 9)});
    two.put_chunk({1, 0, {x, 0, 0}}, {random_chunk(2, 9)});
  }
  ASSERT_TRUE(world.save(std::move(two)));
  ASSERT_TRUE(world.flush());
  WorldChanges gone;
  gone.remove_grid(0);
  ASSERT_TRUE(world.save(std::move(gone)));
  EXPECT_EQ(world.chunks(0, 0)->size(), 0U);
  ASSERT_TRUE(world.flush());
  EXPECT_EQ(world.chunks(0, 0)->size(), 0U);
  EXPECT_EQ(world.chunks(1, 0)->size(), 80U);
  EXPECT_EQ(world.grids()->size(), 1U);
  EXPECT_FALSE(world.load_chunk({0, 0, {3, 0, 0}})->has_value());
}

TEST(WorldStore, FindsChunksInBox) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  WorldChanges changes;
  for (int z = -40; z < 40; z += 5) {
    for (int x = -40; x < 40; x += 3) changes.put_chunk({0, 0, {x, 1, z}}, {});
  }
  ASSERT_TRUE(world.save(std::move(changes)));
  ASSERT_TRUE(world.flush());
  for (const IBox& box :
       {IBox{{-40, 0, -40}, {40, 2, 40}}, IBox{{-7, 1, -7}, {7, 2, 7}}, IBox{{30, -5, -9}, {36, 5, 9}}}) {
    std::size_t wanted = 0;
    for (int z = -40; z < 40; z += 5) {
      for (int x = -40; x < 40; x += 3) wanted += box.contains({x, 1, z}) ? 1 : 0;
    }
    EXPECT_EQ(world.chunks(0, 0, box)->size(), wanted);
  }
  EXPECT_TRUE(world.chunks(0, 0, {})->empty());
}

TEST(WorldStore, RefusesSecondWriterButAllowsReaders) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  WorldStore world = made(path);
  const auto second = WorldStore::open(path, WorldAccess::Write);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::CannotWrite);
  EXPECT_EQ(to_string(second.error()), path.string() + ": it is already open for writing, in this or another program");
  auto reader = WorldStore::open(path, WorldAccess::Read);
  ASSERT_TRUE(reader) << to_string(reader.error());
  WorldChanges changes;
  changes.put_type(10, coloured_type(10));
  changes.put_chunk({0, 0, {5, 5, 5}}, {Chunk(10)});
  ASSERT_TRUE(world.save(std::move(changes)));
  ASSERT_TRUE(world.flush());
  const auto chunk = reader->load_chunk({0, 0, {5, 5, 5}});
  ASSERT_TRUE(chunk) << to_string(chunk.error());
  EXPECT_EQ((*chunk)->voxels.uniform(), VoxelType{10}) << "of a type that was put after the reader had opened it";
}

TEST(WorldStore, SaveRejectsUnreadableChanges) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  const auto refused = [&](auto&& put) {
    WorldChanges changes;
    put(changes);
    const auto ticket = world.save(std::move(changes));
    EXPECT_FALSE(ticket);
    return ticket ? ErrorCode::DeviceLost : ticket.error().code;
  };
  EXPECT_EQ(refused([](auto& c) { c.put_chunk({0, 0, {}}, {Chunk(77)}); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(refused([](auto& c) { c.put_chunk({5, 0, {}}, {Chunk(1)}); }), ErrorCode::InvalidArgument);
  for (const IVec3 chunk : {IVec3(1 << 26, 0, 0), IVec3(0, -(1 << 26) - 1, 0), IVec3(0, 0, INT_MIN)}) {
    EXPECT_EQ(refused([&](auto& c) { c.put_chunk({0, 0, chunk}, {Chunk(1)}); }), ErrorCode::InvalidArgument);
  }
  EXPECT_EQ(refused([](auto& c) { c.put_type(33, {}); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(refused([](auto& c) { c.put_grid(1, {.pivot = DVec3(std::nan(""))}); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(refused([](auto& c) { c.put_value("x", std::vector<std::byte>((64U << 20) + 1)); }),
            ErrorCode::InvalidArgument);
  Chunk chunk(1);
  chunk.set_data({}, {.state = 256});
  EXPECT_EQ(refused([&](auto& c) { c.put_chunk({0, 0, {}}, {chunk}); }), ErrorCode::InvalidArgument);
  EXPECT_TRUE(world.chunks(0, 0)->empty());
  EXPECT_EQ(world.grids()->size(), 1U);
}

SceneFile::Placement placed(const char* name, double x) {
  SceneFile::Placement instance{.instance = {}, .grid = 0, .group = 2};
  instance.instance.name = name;
  instance.instance.position = {x, -0.0, 1e9 / 3.0};
  return instance;
}

TEST(WorldStore, StoresInstancesAsTheirText) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  const SceneFile::Placement instance = placed("ship", 0.1);
  const SceneFile::Group group{{.name = "not \xff UTF-8", .rotation = {0.5, 0.5, -0.5, 0.5}}, 1, {}};
  const auto expect_texts = [&](const WorldStore& world, const char* when) {
    const auto of_instance = WorldParts::find(world, {store::part::kInstance, std::int64_t{7}});
    ASSERT_TRUE(of_instance && *of_instance) << when;
    EXPECT_EQ(**of_instance, bytes_of(store::text_of(instance))) << when;
    const auto of_group = WorldParts::find(world, {store::part::kGroup, std::int64_t{2}});
    ASSERT_TRUE(of_group && *of_group) << when;
    EXPECT_EQ(**of_group, bytes_of(store::text_of(group))) << when;
    const auto removed = WorldParts::find(world, {store::part::kInstance, std::int64_t{8}});
    EXPECT_TRUE(removed && !*removed) << when;
    int count = 0;
    EXPECT_TRUE(WorldParts::each(world, store::part::kInstance, [&](const store::Part& part, bool is_sound) {
      EXPECT_TRUE(is_sound && std::ranges::equal(part.body, **of_instance)) << when;
      ++count;
    }));
    EXPECT_EQ(count, 1) << when;
  };
  {
    WorldStore world = made(path);
    WorldChanges first;
    WorldParts::put(first, 7, placed("ship", 4.0));
    WorldParts::put(first, 8, placed("gone", 5.0));
    ASSERT_TRUE(world.save(std::move(first)));
    WorldChanges second;
    WorldParts::put(second, 7, instance);
    WorldParts::put(second, 2, group);
    WorldParts::remove(second, store::part::kInstance, 8);
    ASSERT_TRUE(world.save(std::move(second)));
    expect_texts(world, "pending or just written");
    ASSERT_TRUE(world.flush());
    expect_texts(world, "on disk");
  }
  expect_texts(*WorldStore::open(path, WorldAccess::Read), "opened again");
}

TEST(WorldStore, SaveRejectsUnreadableInstancesAtOnce) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  const auto error_of = [&](auto&& put) {
    WorldChanges changes;
    WorldParts::put(changes, 1, placed("sound", 1.0));
    changes.put_value("x", bytes_of("y"));
    put(changes);
    const auto ticket = world.save(std::move(changes));
    return ticket ? std::string("accepted") : ticket.error().message;
  };
  const SceneFile::Placement unreadable = placed("ship", std::nan(""));
  const std::string as_text =
      error_of([&](auto& changes) { WorldParts::put(changes, store::part::kInstance, 3, store::text_of(unreadable)); });
  EXPECT_EQ(as_text, "instance 3.position[0]: must be a number");
  EXPECT_EQ(error_of([&](auto& changes) { WorldParts::put(changes, 3, unreadable); }), as_text);
  const std::int64_t too_large = store::kMaxPartNumber + 1;
  EXPECT_NE(error_of([&](auto& c) { WorldParts::put(c, too_large, placed("ship", 1.0)); }).find("an invalid number"),
            std::string::npos);
  ASSERT_TRUE(world.flush());
  EXPECT_FALSE(world.value("x")->has_value()) << "a refused save stores nothing";
  EXPECT_FALSE(WorldParts::find(world, {store::part::kInstance, std::int64_t{1}})->has_value());
}

TEST(WorldStore, ListsChunksAtItsLimits) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  const std::vector<IVec3> ends = {IVec3(-(1 << 26)), IVec3((1 << 26) - 1)};
  WorldChanges changes;
  for (const IVec3 chunk : ends) changes.put_chunk({0, 0, chunk}, {Chunk(1)});
  ASSERT_TRUE(world.save(std::move(changes)));
  ASSERT_TRUE(world.flush());
  EXPECT_EQ(*world.chunks(0, 0), ends);
}

TEST(WorldStore, ErrorsDescribeFileFaults) {
  const WorldFolder folder;
  const auto text_of = [](const Result<WorldStore>& world) { return world ? "" : to_string(world.error()); };
  EXPECT_NE(text_of(WorldStore::open(folder / "none", WorldAccess::Read)).find("No such file"), std::string::npos);
  std::ofstream(folder / "text") << std::string(200, 'x');
  EXPECT_NE(text_of(WorldStore::open(folder / "text", WorldAccess::Write)).find("not a Quoin world"),
            std::string::npos);
  EXPECT_NE(text_of(WorldStore::create(folder / "text")).find("file already exists"), std::string::npos);
  EXPECT_EQ(text_of(WorldStore::create(folder / "none" / "w.quoin")),
            (folder / "none" / "w.quoin").string() + ": its folder does not exist");
  { WorldStore world = made(folder / "w.quoin"); }
  std::filesystem::resize_file(folder / "w.quoin", 5000);
  EXPECT_EQ(WorldStore::open(folder / "w.quoin", WorldAccess::Read).error().code, ErrorCode::BadFormat);
  EXPECT_NE(text_of(WorldStore::open(folder / "w.quoin", WorldAccess::Read)).find("run quoin world repair"),
            std::string::npos);
}

TEST(WorldStore, ThreadsReadAndWriteAtOnce) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (std::uint32_t i = 0; i < 60; ++i) {
        const ChunkAddress place{0, 0, {t, static_cast<int>(i % 5), 0}};
        WorldChanges changes;
        changes.put_chunk(place, {random_chunk(i, 9)});
        const auto ticket = world.save(std::move(changes));
        ASSERT_TRUE(ticket);
        if (i % 3 == 0) {
          ASSERT_TRUE(world.wait(*ticket));
        }
        const auto chunk = world.load_chunk(place);
        ASSERT_TRUE(chunk && chunk->has_value());
        ASSERT_EQ((*chunk)->voxels, random_chunk(i, 9));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(world.chunks(0, 0)->size(), 20U);
}

TEST(WorldStore, CallsBackAfterCommit) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  WorldStore world = made(path);
  auto reader = WorldStore::open(path, WorldAccess::Read);
  ASSERT_TRUE(reader);
  bool was_there = false;
  WorldChanges changes;
  changes.put_chunk({0, 0, {1, 1, 1}}, {Chunk(2)});
  ASSERT_TRUE(world.save(std::move(changes), [&](const Status& saved) {
    was_there = saved && reader->load_chunk({0, 0, {1, 1, 1}})->has_value();
  }));
  ASSERT_TRUE(world.flush());
  // The callback follows the commit; flush waits for the commit only.
  for (int i = 0; i < 1000 && !was_there; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(was_there);
}

// Returns this process's locks on a file, as listed by the system.
int locks_on(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return -1;
  const std::string number = ":" + std::to_string(info.st_ino) + " ";
  std::ifstream locks("/proc/locks");
  int count = 0;
  for (std::string line; std::getline(locks, line);) count += line.find(number) != std::string::npos ? 1 : 0;
  return count;
}

TEST(WorldStore, OtherReadersOfFileEndNoLocks) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  WorldStore world = made(path);
  EXPECT_FALSE(world.load_chunk({0, 0, {1, 1, 1}})->has_value());
  const int before = locks_on(path);
  if (before <= 0) GTEST_SKIP() << "/proc/locks does not tell of it";
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(WorldStore::open(path, WorldAccess::Read));
    EXPECT_TRUE(read_file_beginning(path, 64));
    EXPECT_EQ(*detect_format(path), FileFormat::World);
    EXPECT_EQ(read_file(path)->size(), std::filesystem::file_size(path));
  }
  EXPECT_EQ(locks_on(path), before);
}

TEST(WorldStore, RefusesSecondWriterThroughLink) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  std::filesystem::create_symlink(folder / "w.quoin", folder / "link.quoin");
  EXPECT_FALSE(WorldStore::open(folder / "link.quoin", WorldAccess::Write));
  EXPECT_TRUE(WorldStore::open(folder / "link.quoin", WorldAccess::Read));
}

TEST(WorldStore, ReadsRecreatedGrid) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  for (int round = 0; round < 3; ++round) {
    WorldChanges changes;
    changes.remove_grid(0);
    changes.put_grid(0, {});
    changes.put_chunk({0, 0, {1, 2, 3}}, {Chunk(static_cast<VoxelType>(1 + round))});
    ASSERT_TRUE(world.save(std::move(changes)));
    ASSERT_TRUE(world.flush());
    const auto chunk = world.load_chunk({0, 0, {1, 2, 3}});
    ASSERT_TRUE(chunk && chunk->has_value()) << round;
    EXPECT_EQ((*chunk)->voxels.uniform(), static_cast<VoxelType>(1 + round));
  }
}

TEST(WorldStore, NeverReusesGridNumbers) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  {
    WorldStore world = made(path);
    WorldChanges exchanged;
    exchanged.remove_grid(0);
    exchanged.put_grid(7, {});
    ASSERT_TRUE(world.save(std::move(exchanged)));
    WorldChanges gone;
    gone.remove_grid(7);
    ASSERT_TRUE(world.save(std::move(gone)));
    ASSERT_TRUE(world.flush());
  }
  EXPECT_EQ(WorldStore::open(path, WorldAccess::Write)->next_grid(), 8U);
}

TEST(WorldStore, StoresNextGridNumberAfterRefusedSave) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  {
    WorldStore world = made(path);
    WorldChanges refused;
    refused.put_grid(7, {});
    refused.put_chunk({9, 0, {0, 0, 0}}, {Chunk(1)});  // of an undefined grid
    EXPECT_FALSE(world.save(std::move(refused)));
    WorldChanges accepted;
    accepted.put_grid(7, {});
    ASSERT_TRUE(world.save(std::move(accepted)));
    WorldChanges gone;
    gone.remove_grid(7);
    ASSERT_TRUE(world.save(std::move(gone)));
    ASSERT_TRUE(world.flush());
  }
  EXPECT_EQ(WorldStore::open(path, WorldAccess::Write)->next_grid(), 8U);
}

TEST(WorldStore, CallbacksCanUseClosingWorld) {
  const WorldFolder folder;
  std::uint32_t number = 0;
  {
    WorldStore world = made(folder / "w.quoin");
    WorldChanges changes;
    changes.put_chunk({0, 0, {1, 1, 1}}, {Chunk(2)});
    ASSERT_TRUE(world.save(std::move(changes), [&](const Status&) { number = world.next_grid(); }));
  }
  EXPECT_EQ(number, 1U);
}

TEST(WorldStore, ContinuesSavingAfterCallbackThrows) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  {
    WorldStore world = made(path);
    for (int i = 0; i < 4; ++i) {
      WorldChanges changes;
      changes.put_chunk({0, 0, {i, 0, 0}}, {random_chunk(static_cast<std::uint32_t>(i), 9)});
      ASSERT_TRUE(world.save(std::move(changes), [](const Status&) { throw std::runtime_error("cannot draw"); }));
      if (i == 1) {
        ASSERT_TRUE(world.flush());
      }
    }
  }
  auto world = WorldStore::open(path, WorldAccess::Read);
  ASSERT_TRUE(world) << to_string(world.error());
  for (int i = 0; i < 4; ++i) {
    const auto chunk = world->load_chunk({0, 0, {i, 0, 0}});
    ASSERT_TRUE(chunk && chunk->has_value()) << i;
    EXPECT_EQ((*chunk)->voxels, random_chunk(static_cast<std::uint32_t>(i), 9)) << i;
  }
}

TEST(WorldStore, RefusesToReadReplacedWorld) {
  const WorldFolder folder;
  { WorldStore first = made(folder / "a.quoin"); }
  { WorldStore second = made(folder / "b.quoin"); }
  const auto reader = WorldStore::open(folder / "a.quoin", WorldAccess::Read);
  ASSERT_TRUE(reader->load_chunk({0, 0, {}}));
  std::filesystem::rename(folder / "b.quoin", folder / "a.quoin");
  const auto chunk = reader->load_chunk({0, 0, {}});
  ASSERT_FALSE(chunk);
  EXPECT_NE(chunk.error().message.find("open it again"), std::string::npos);
}

TEST(WorldStoreDeathTest, AssertsOnRegionOutOfRange) {
  QUOIN_EXPECT_MISTAKE(static_cast<void>(store::key_of(-1, IVec3{0})), "a region's id");
  QUOIN_EXPECT_MISTAKE(static_cast<void>(store::key_of(store::kMaxRegion + 1, IVec3{0})), "a region's id");
}

TEST(WorldStoreDeathTest, AssertsOnSaveToReadOnlyWorld) {
  const WorldFolder folder;
  static_cast<void>(made(folder / "w.quoin"));
  auto reader = WorldStore::open(folder / "w.quoin", WorldAccess::Read);
  ASSERT_TRUE(reader);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(reader->save({})), "a world opened for writing");
}

TEST(WorldStoreDeathTest, AssertsOnForeignTicket) {
  const WorldFolder folder;
  WorldStore world = made(folder / "w.quoin");
  QUOIN_EXPECT_MISTAKE(static_cast<void>(world.wait({1'000})), "a ticket of this world");
}

TEST(WorldStoreDeathTest, AssertsOnSavingAir) {
  WorldChanges changes;
  QUOIN_EXPECT_MISTAKE(changes.put_type(kAir, {}), "a type other than air");
}

}  // namespace
}  // namespace quoin
