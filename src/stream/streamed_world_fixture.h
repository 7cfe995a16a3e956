#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>
#include <quoin/stream/streamed_world.h>

#include "store/world/world_for_tests.h"

namespace quoin {

/// Ground below y = 0 with a different pattern in each chunk; counts the requests.
class PatternGround final : public ChunkGenerator {
 public:
  explicit PatternGround(int delay_microseconds = 0) : delay_(delay_microseconds) {}
  [[nodiscard]] IBox chunks() const override { return {{-1000, -2, -1000}, {1000, 2, 1000}}; }
  [[nodiscard]] Result<StoredChunk> make(IVec3 chunk, const Cancellation& /*cancelled*/) const override {
    {
      const std::scoped_lock lock(mutex_);
      ++asked_[{chunk.x, chunk.y, chunk.z}];
    }
    if (delay_ != 0) {
      const auto spread = static_cast<unsigned>(chunk.x * 7 + chunk.y * 13 + chunk.z * 31) % 5U;
      std::this_thread::sleep_for(std::chrono::microseconds(delay_ * static_cast<int>(spread)));
    }
    return StoredChunk{of(chunk)};
  }
  static Chunk of(IVec3 chunk) {
    if (chunk.y >= 0) return Chunk(kAir);
    Chunk made(1);
    const auto whole = [](int coordinate) { return static_cast<unsigned>(coordinate); };
    const unsigned noise = whole(chunk.x) * 73'856'093U ^ whole(chunk.y) * 19'349'663U ^ whole(chunk.z) * 83'492'791U;
    made.set({static_cast<int>(noise % 64), static_cast<int>(noise / 64 % 64), static_cast<int>(noise / 4096 % 64)}, 2);
    return made;
  }
  [[nodiscard]] int most_asked() const {
    const std::scoped_lock lock(mutex_);
    int most = 0;
    for (const auto& [chunk, count] : asked_) most = std::max(most, count);
    return most;
  }
  [[nodiscard]] std::size_t asked() const {
    const std::scoped_lock lock(mutex_);
    return asked_.size();
  }

 private:
  int delay_;
  mutable std::mutex mutex_;
  mutable std::map<std::tuple<int, int, int>, int> asked_;
};

class StreamedWorldTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto made = WorldStore::create(path("tried.quoin"));
    if (!made && made.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(made.error());
  }
  [[nodiscard]] std::filesystem::path path(const char* name = "world.quoin") const { return folder_ / name; }

  static void add_types(StreamedWorld& world) {
    for (std::uint8_t type = 1; type <= 3; ++type) {
      ASSERT_TRUE(world.scene().types.add(coloured_type(type)).has_value());
    }
  }
  // Returns a world with one grid of PatternGround; the grid's number is 0.
  static StreamedWorld ground(const std::filesystem::path& path, const std::shared_ptr<const PatternGround>& generator,
                              StreamOptions options = {}) {
    auto world = StreamedWorld::open_or_create(path, options);
    EXPECT_TRUE(world.has_value()) << to_string(world.error());
    if (world->is_new()) {
      add_types(*world);
      const auto grid = world->add_grid({.name = "ground"}, generator);
      EXPECT_TRUE(grid.has_value()) << to_string(grid.error());
      Instance instance;
      instance.grid = *grid;
      world->scene().add_instance(instance);
    } else {
      world->use_generator(only_grid(*world), generator);
    }
    return std::move(*world);
  }
  static GridHandle only_grid(const StreamedWorld& world) { return world.scene().grids().handles().front(); }

  WorldFolder folder_;
};

}  // namespace quoin
