#include "stream/stream_plan.h"

#include <algorithm>
#include <chrono>
#include <cstddef>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

using stream::StreamBudget;

constexpr std::size_t kBudget = std::size_t{64} << 20;
constexpr std::size_t kChunk = 50'000;

// A program whose meshes need as much memory as the chunks, and appear some time later.
class Program {
 public:
  void load(std::size_t chunks) {
    for (std::size_t i = 0; i < chunks && budget.room(0) > 0; ++i) budget.add_chunk(kChunk);
  }
  void released(std::size_t chunks) {
    for (std::size_t i = 0; i < chunks; ++i) budget.remove_chunk(kChunk);
  }
  // Waits a tenth of a second, in which meshes appear.
  void wait() {
    meshes_ += (static_cast<double>(budget.loaded_bytes()) - meshes_) * 0.2;
    now_ += std::chrono::milliseconds(100);
    budget.set_others(static_cast<std::size_t>(meshes_), 0, false, now_);
    most = std::max(most, meshes_ + static_cast<double>(budget.loaded_bytes()));
  }

  StreamBudget budget{kBudget, true};
  double most = 0.0;

 private:
  double meshes_ = 0.0;
  StreamBudget::Clock::time_point now_{};
};

TEST(StreamBudget, ReservesMemoryForDerivedData) {
  Program program;
  program.load(100'000);
  EXPECT_LT(program.budget.loaded_bytes(), kBudget / 2);
  EXPECT_GT(program.budget.loaded_bytes(), kBudget / 4);
  for (int i = 0; i < 600; ++i) {
    program.wait();
    program.load(10);
  }
  EXPECT_LT(program.most, static_cast<double>(kBudget));
  EXPECT_GT(program.most, 0.8 * static_cast<double>(kBudget)) << "unused reserves are used in the end";
  // The loaded chunks do not decrease during an hour of flight.
  const std::size_t before = program.budget.loaded_chunks();
  std::size_t planned = before;
  for (int i = 0; i < 6000; ++i) {
    program.released(10);
    program.wait();
    program.load(10);
    planned = program.budget.chunks(planned, true, 0.05);
  }
  EXPECT_GT(program.budget.loaded_chunks(), before * 9 / 10);
  EXPECT_GT(planned, before * 8 / 10);
  EXPECT_LT(program.most, static_cast<double>(kBudget));
}

TEST(StreamBudget, GivesAllToChunksWithoutOthers) {
  StreamBudget budget(kBudget, false);
  while (budget.room(0) > 0) budget.add_chunk(kChunk);
  EXPECT_GT(budget.loaded_bytes(), kBudget * 8 / 10);
  EXPECT_LE(budget.loaded_bytes(), kBudget);
  EXPECT_FALSE(budget.is_over());
  EXPECT_LT(budget.chunks(2 * budget.loaded_chunks(), true, 0.0), budget.loaded_chunks() + 1);
}

TEST(StreamBudgetDeathTest, RejectsRemovingUnknownChunk) {
  StreamBudget budget(kBudget, false);
  budget.add_chunk(kChunk);
  QUOIN_EXPECT_MISTAKE(budget.remove_chunk(kChunk + 1), "a chunk that was added");
}

TEST(StreamBudgetDeathTest, RejectsShareAboveOne) {
  const StreamBudget budget(kBudget, false);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(budget.chunks(1, true, 2.0)), "a share of 0 to 1");
}

}  // namespace
}  // namespace quoin
