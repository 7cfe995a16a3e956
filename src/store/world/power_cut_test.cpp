// Power cuts, failing calls: what was acknowledged is there, and every save is there as a whole or not at all.

#include <cstdlib>
#include <optional>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "store/world/connection.h"
#include "store/world/disk_for_tests.h"
#include "store/world/world_changes.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

using store::Connection;

constexpr const char* kFile = "w.quoin";
constexpr int kPlaces = 24;
constexpr int kTypes = 200;

/// What a world holds after so many saves: the type of each place's chunk; 0: none. Save i is save i whatever was
/// before, so that any number of them can be replayed.
struct Expected {
  std::array<VoxelType, kPlaces> types{};
  int saves = 0;
};

/// Save number `i` (from 1): a counter, and some chunks, of which one may go.
template <class Put, class Remove>
void each_of_save(int i, Put put, Remove remove) {
  std::minstd_rand random(static_cast<unsigned>(i) * 7919U);
  const unsigned count = 1 + random() % 5;
  std::set<int> places;
  while (places.size() < count) places.insert(static_cast<int>(random() % kPlaces));
  bool may_remove = random() % 4 == 0;
  for (const int place : places) {
    if (may_remove) {
      remove(place);
    } else {
      put(place, static_cast<VoxelType>(1 + (i * 13 + place) % kTypes));
    }
    may_remove = false;
  }
}

void apply(Expected& expected, int i) {
  each_of_save(
      i, [&](int place, VoxelType type) { expected.types[static_cast<std::size_t>(place)] = type; },
      [&](int place) { expected.types[static_cast<std::size_t>(place)] = kAir; });
  expected.saves = i;
}

ChunkPlace place_of(int place) {
  return {0, 0, {place % 5 - 2, place / 5, 31 + place % 3}};
}

// Several rows' worth of content, told apart by its type.
Chunk content_of(VoxelType type) {
  Chunk chunk(type);
  for (int i = 0; i < 40; ++i) chunk.set(i, (i * type) % 64, (i * 5) % 64, kAir);
  return chunk;
}

WorldChanges changes_of(int i) {
  WorldChanges changes;
  const std::string number = std::to_string(i);
  const auto bytes = std::as_bytes(std::span(number));
  changes.put_value("saves", {bytes.begin(), bytes.end()});
  each_of_save(
      i, [&](int place, VoxelType type) { changes.put_chunk(place_of(place), {content_of(type)}); },
      [&](int place) { changes.remove_chunk(place_of(place)); });
  return changes;
}

Result<WorldStore> create_on(const TestDisk& disk) {
  auto world = WorldParts::create(kFile, {1}, disk.name());
  if (!world) return world.error();
  WorldChanges first;
  first.put_types(coloured_types(kTypes));
  first.put_grid(0, {});
  if (auto saved = world->save(std::move(first)); !saved) return saved.error();
  if (auto saved = world->flush(); !saved) return saved.error();
  return world;
}

/// How many saves a world has; -1 where it is not as after any number of them, with the reason.
struct Found {
  int saves = -1;
  std::string why;
};

Found look_at(const TestDisk& disk) {
  auto connection = Connection::open(kFile, Connection::Mode::Write, disk.name());
  if (!connection) return {-1, "it does not open: " + connection.error().message};
  const auto sound = connection->text("PRAGMA integrity_check");
  if (!sound || *sound != "ok") return {-1, "integrity_check: " + (sound ? *sound : sound.error().message)};
  static_cast<void>(connection->close());
  auto world = WorldParts::open(kFile, WorldAccess::Write, {1}, disk.name());
  if (!world) return {-1, "the world does not open: " + world.error().message};
  const auto value = world->value("saves");
  if (!value) return {-1, value.error().message};
  int saves = 0;
  if (*value) saves = std::atoi(std::string(reinterpret_cast<const char*>((*value)->data()), (*value)->size()).c_str());
  Expected expected;
  for (int i = 1; i <= saves; ++i) apply(expected, i);
  for (int place = 0; place < kPlaces; ++place) {
    const auto chunk = world->load_chunk(place_of(place));
    if (!chunk) return {-1, chunk.error().message};
    const VoxelType type = expected.types[static_cast<std::size_t>(place)];
    const bool is_right = chunk->has_value() ? type != kAir && (*chunk)->voxels == content_of(type) : type == kAir;
    if (!is_right) return {-1, "after " + std::to_string(saves) + " saves place " + std::to_string(place)};
  }
  return {saves, ""};
}

/// Saves to a world on a disk, and cuts the power all the while.
class Cuts {
 public:
  explicit Cuts(unsigned seed, int one_of) : random_(seed), one_of_(one_of) {
    disk_.before_change = [this] { consider(); };
  }

  void run(int saves, bool has_honest_syncs = true) {
    auto world = create_on(disk_);
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
      if (i % 20 == 0) {  // closed and opened, by which the log ends and begins
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
  // On the thread that writes.
  void consider() {
    if (!is_cutting_ || is_looking_ || cut_random_() % static_cast<unsigned>(one_of_) != 0) return;
    is_looking_ = true;
    const int least = acknowledged_;
    after_.become(disk_.image(), cut_random_);
    ++cuts;
    const Found found = look_at(after_);
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

TEST(WorldPowerCut, NothingAcknowledgedIsLost) {
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

// The test can fail: a disk that says it has synced the log, and has not.
TEST(WorldPowerCut, ADiskThatLiesAboutSyncsLosesSaves) {
  int bad = 0;
  for (unsigned seed = 1; seed < 4; ++seed) {
    Cuts run(seed, 4);
    run.run(40, false);
    bad += run.bad;
  }
  EXPECT_GT(bad, 0);
}

/// Fails the n-th call that changes the disk, or it and all behind it.
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

/// Saves, with a fault at some call; returns whether there were as many calls.
bool survives_fault(int number, int code, bool is_lasting) {
  constexpr int kSaves = 6;
  TestDisk disk("faulty");
  Fault fault(disk, number, code, is_lasting);
  {
    auto world = create_on(disk);
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
      // As if the power went now.
      TestDisk after("after the fault");
      std::minstd_rand random(static_cast<unsigned>(number));
      after.become(disk.image(), random);
      const Found found = look_at(after);
      EXPECT_GE(found.saves, acknowledged) << found.why << " call " << number;
      // What failed is read, and saved once there is room again.
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
  const Found found = look_at(disk);
  EXPECT_EQ(found.saves, kSaves) << found.why << ": call " << number << ", code " << code;
  return fault.was_hit();
}

TEST(WorldFault, AnyCallMayFailAndNothingIsLost) {
  for (const int code : {SQLITE_FULL, SQLITE_IOERR_WRITE}) {
    for (const bool is_lasting : {false, true}) {
      int number = 1;
      while (survives_fault(number, code, is_lasting) && number < 2000 && !HasFailure()) ++number;
      EXPECT_GT(number, 50);
    }
  }
}

}  // namespace
}  // namespace quoin
