// Power cuts and failing calls: acknowledged saves are present, and each save is complete or absent.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "store/world/disk_for_tests.h"
#include "store/world/part_text.h"
#include "store/world/saves_for_tests.h"

namespace quoin {
namespace {

constexpr const char* kFile = "w.quoin";

/// Saves to a world on a simulated disk, with power cuts at any time.
class Cuts {
 public:
  explicit Cuts(unsigned seed, int one_of) : random_(seed), one_of_(one_of) {
    disk_.before_change = [this] { consider(); };
  }

  void run(int saves, bool has_honest_syncs = true) {
    auto world = create_for_saves(kFile, disk_.name());
    ASSERT_TRUE(world) << to_string(world.error());
    if (!has_honest_syncs) disk_.is_sync_honest = [](const std::string& file) { return !file.ends_with("-wal"); };
    is_cutting_ = true;
    for (int i = 1; i <= saves; ++i) {
      submitted_ = i;
      const auto ticket = world->save(changes_of(i), [this, i](const Status& saved) {
        if (saved) acknowledged_ = i;
      });
      ASSERT_TRUE(ticket) << to_string(ticket.error());
      if (random_() % 3 == 0) {
        ASSERT_TRUE(world->wait(*ticket));
      }
      if (i % 20 == 0) {  // close and reopen, to end and restart the log
        world = make_error(ErrorCode::Cancelled, "closed");
        world = WorldParts::open(kFile, WorldAccess::Write, {1}, disk_.name());
        ASSERT_TRUE(world) << to_string(world.error());
      }
    }
  }

  int cuts = 0;
  int bad = 0;
  std::string first_fault;

 private:
  // Runs on the writing thread.
  void consider() {
    if (!is_cutting_ || is_looking_ || cut_random_() % static_cast<unsigned>(one_of_) != 0) return;
    is_looking_ = true;
    const int least = acknowledged_;
    after_.become(disk_.image(), cut_random_);
    ++cuts;
    const Found found = look_at(kFile, after_.name());
    if (found.saves < least || found.saves > submitted_) {
      if (bad++ == 0) {
        first_fault = found.saves < 0 ? found.why
                                      : "of " + std::to_string(least) + " acknowledged saves there are " +
                                            std::to_string(found.saves);
      }
    }
    is_looking_ = false;
  }

  TestDisk disk_{"cut"};
  TestDisk after_{"after the cut"};
  std::minstd_rand random_;
  std::minstd_rand cut_random_{random_() | 1U};
  int one_of_;
  std::atomic<bool> is_cutting_ = false;
  bool is_looking_ = false;
  std::atomic<int> submitted_ = 0;
  std::atomic<int> acknowledged_ = 0;
};

int wanted_cuts() {
  const char* const wanted = std::getenv("QUOIN_CUTS");
  return wanted != nullptr ? std::atoi(wanted) : 400;
}

TEST(WorldPowerCut, LosesNoAcknowledgedSave) {
  int cuts = 0;
  for (unsigned seed = 1; cuts < wanted_cuts(); ++seed) {
    Cuts run(seed, 4);
    run.run(60);
    ASSERT_EQ(run.bad, 0) << "seed " << seed << ": " << run.first_fault;
    cuts += run.cuts;
  }
  RecordProperty("cuts", cuts);
  std::printf("%d power cuts, nothing lost\n", cuts);
}

// Verifies that the test can fail: on a disk that reports the log as synced without syncing it.
TEST(WorldPowerCut, LosesSavesIfDiskSkipsSyncs) {
  int bad = 0;
  for (unsigned seed = 1; seed < 4; ++seed) {
    Cuts run(seed, 4);
    run.run(40, false);
    bad += run.bad;
  }
  EXPECT_GT(bad, 0);
}

/// Fails the n-th call that changes the disk, or that call and all later ones.
class Fault {
 public:
  Fault(TestDisk& disk, int number, int code, bool is_lasting) : disk_(disk) {
    disk_.fault = [=, this](const char* what) {
      if (what == std::string_view("read")) return SQLITE_OK;
      const int call = ++calls_;
      const bool fails = !is_healed_ && (call == number || (is_lasting && call > number));
      if (!fails) return SQLITE_OK;
      was_hit_ = true;
      return code;
    };
  }
  void heal() { is_healed_ = true; }
  [[nodiscard]] bool was_hit() const { return was_hit_; }

 private:
  TestDisk& disk_;
  std::atomic<int> calls_ = 0;
  std::atomic<bool> is_healed_ = false;
  std::atomic<bool> was_hit_ = false;
};

void expect_one_clear_line(const Error& error) {
  EXPECT_EQ(error.path, kFile);
  EXPECT_FALSE(error.message.empty());
  EXPECT_EQ(error.message.find('\n'), std::string::npos);
  EXPECT_NE(error.code, ErrorCode::BadFormat) << error.message;
}

/// Saves with a fault at one call; returns false if there were fewer calls.
bool survives_fault(int number, int code, bool is_lasting) {
  constexpr int kSaves = 6;
  TestDisk disk("faulty");
  Fault fault(disk, number, code, is_lasting);
  {
    auto world = create_for_saves(kFile, disk.name());
    if (!world) {
      expect_one_clear_line(world.error());
      return true;
    }
    int acknowledged = 0;
    for (int i = 1; i <= kSaves; ++i) {
      const auto ticket = world->save(changes_of(i));
      EXPECT_TRUE(ticket);
      const Status saved = world->wait(*ticket);
      if (saved) {
        acknowledged = i;
        continue;
      }
      expect_one_clear_line(saved.error());
      // Simulates a power cut at this moment.
      TestDisk after("after the fault");
      std::minstd_rand random(static_cast<unsigned>(number));
      after.become(disk.image(), random);
      const Found found = look_at(kFile, after.name());
      EXPECT_GE(found.saves, acknowledged) << found.why << " call " << number;
      // Failed saves are still readable, and are saved once there is room again.
      Expected expected;
      for (int k = 1; k <= i; ++k) apply(expected, k);
      for (int place = 0; place < kPlaces; ++place) {
        const auto chunk = world->load_chunk(place_of(place));
        EXPECT_TRUE(chunk) << to_string(chunk.error());
        if (!chunk) continue;
        EXPECT_EQ(chunk->has_value(), expected.types[static_cast<std::size_t>(place)] != kAir);
      }
      fault.heal();
      const Status again = world->flush();
      EXPECT_TRUE(again) << to_string(again.error());
      acknowledged = again ? i : acknowledged;
    }
    fault.heal();
  }
  const Found found = look_at(kFile, disk.name());
  EXPECT_EQ(found.saves, kSaves) << found.why << ": call " << number << ", code " << code;
  return fault.was_hit();
}

TEST(WorldFault, SurvivesFailureOfAnyCall) {
  for (const int code : {SQLITE_FULL, SQLITE_IOERR_WRITE}) {
    for (const bool is_lasting : {false, true}) {
      int number = 1;
      while (survives_fault(number, code, is_lasting) && number < 2000 && !HasFailure()) ++number;
      EXPECT_GT(number, 50);
    }
  }
}

// A save that waits behind a failed one, in a later commit, has failed as well.
TEST(WorldFault, ReportsFailureToSavesThatWait) {
  TestDisk disk("disk that becomes full");
  std::atomic<bool> is_full{true};
  std::mutex mutex;
  std::array<std::vector<bool>, 2> reported;
  auto world = create_for_saves(kFile, disk.name());
  ASSERT_TRUE(world.has_value());
  disk.fault = [&](const char* what) { return is_full && what == std::string("write") ? SQLITE_FULL : SQLITE_OK; };
  for (std::size_t i = 0; i < 2; ++i) {
    WorldChanges changes;
    for (int x = 0; x < 200; ++x) changes.put_chunk({0, 0, {x, static_cast<int>(i), 0}}, {Chunk(1)});
    ASSERT_TRUE(world->save(std::move(changes), [&, i](const Status& outcome) {
      const std::scoped_lock lock(mutex);
      reported[i].push_back(outcome.has_value());
    }));
  }
  const Status full = world->flush();
  ASSERT_FALSE(full);
  expect_one_clear_line(full.error());
  is_full = false;
  EXPECT_TRUE(world->flush());
  world = make_error(ErrorCode::Cancelled, "closed");  // after the callbacks
  for (const std::vector<bool>& each : reported) {
    ASSERT_GE(each.size(), 2U);
    EXPECT_FALSE(each.front());
    EXPECT_TRUE(each.back());
    EXPECT_EQ(std::ranges::count(each, true), 1);
  }
}

// Instances wait as they are, and each retry makes their text again.
TEST(WorldFault, KeepsInstancesOfFailedSaves) {
  TestDisk disk("disk that becomes full under instances");
  std::atomic<bool> is_full{true};
  auto world = create_for_saves(kFile, disk.name());
  ASSERT_TRUE(world.has_value());
  disk.fault = [&](const char* what) { return is_full && what == std::string("write") ? SQLITE_FULL : SQLITE_OK; };
  SceneFile::Placement instance{.instance = {}, .grid = 0};
  const auto expect_last = [&](const WorldStore& stored, const char* when) {
    const auto text = WorldParts::find(stored, {store::part::kInstance, std::int64_t{4}});
    ASSERT_TRUE(text && *text) << when;
    EXPECT_EQ(**text, store::body_of(store::text_of(instance))) << when;
    const auto removed = WorldParts::find(stored, {store::part::kInstance, std::int64_t{5}});
    EXPECT_TRUE(removed && !*removed) << when;
  };
  for (int i = 0; i < 3; ++i) {
    instance.instance.position.x = 0.1 * i;
    WorldChanges changes;
    WorldParts::put(changes, 4, instance);
    if (i == 0) {
      WorldParts::put(changes, 5, instance);
    } else {
      WorldParts::remove(changes, store::part::kInstance, 5);
    }
    // Too many chunks for one commit, so that the saves wait one by one.
    for (int x = 0; x < 200; ++x) changes.put_chunk({0, 0, {x, i, 0}}, {Chunk(1)});
    ASSERT_TRUE(world->save(std::move(changes)));
    EXPECT_FALSE(world->flush());
    if (i > 0) expect_last(*world, "on a full disk");
  }
  EXPECT_FALSE(world->flush());
  expect_last(*world, "after a retry");
  is_full = false;
  ASSERT_TRUE(world->flush());
  EXPECT_EQ(world->stats().pending_bytes, 0U);
  expect_last(*world, "on disk");
  world = make_error(ErrorCode::Cancelled, "closed");
  const auto again = WorldParts::open(kFile, WorldAccess::Write, {1}, disk.name());
  ASSERT_TRUE(again.has_value());
  expect_last(*again, "opened again");
}

}  // namespace
}  // namespace quoin
