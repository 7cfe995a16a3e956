#include <quoin/io/chunk_source.h>

#include <atomic>
#include <limits>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/parallel.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

// Returns a chunk that needs 8 bits per voxel: 256 KiB.
Chunk large_chunk() {
  std::mt19937 random(1);
  std::vector<VoxelType> voxels(kChunkVoxels);
  for (VoxelType& voxel : voxels) voxel = static_cast<VoxelType>(1 + random() % 200);
  return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(voxels));
}

std::vector<IBox> row_of_parts(int count) {
  std::vector<IBox> parts;
  for (int x = 0; x < count; ++x) parts.push_back({{x, 0, 0}, {x + 1, 1, 1}});
  return parts;
}

// A source of equal chunks in a row, one per part, which counts the calls of read_part.
class CountedSource final : public ChunkSource {
 public:
  explicit CountedSource(int parts, ChunkSourceInfo info = {})
      : ChunkSource(std::move(info), row_of_parts(parts)), chunk_(large_chunk()) {}

  VoxelRegistry types() const override { return {}; }
  Result<SourcePart> read_part(std::size_t part) const override {
    ++reads_;
    return SourcePart{{{parts()[part].min, Chunk(chunk_)}}};
  }
  int reads() const { return reads_; }
  std::size_t chunk_bytes() const { return chunk_.bytes(); }

 private:
  Chunk chunk_;
  mutable std::atomic<int> reads_{0};
};

void read_row(const CountedSource& source, int begin, int end) {
  for (int x = begin; x < end; ++x) {
    const auto chunk = source.read({x, 0, 0});
    ASSERT_TRUE(chunk && chunk->has_value()) << x;
    EXPECT_EQ((*chunk)->bytes(), source.chunk_bytes());
  }
}

TEST(ChunkSource, KeepsRecentlyReadParts) {
  constexpr int kParts = 200;
  const CountedSource source(kParts);
  constexpr std::size_t kCacheBytes = std::size_t{32} << 20;
  ASSERT_GT(kParts * source.chunk_bytes(), kCacheBytes);
  read_row(source, 0, kParts);
  EXPECT_EQ(source.reads(), kParts);
  read_row(source, kParts - 50, kParts);
  EXPECT_EQ(source.reads(), kParts) << "the newest parts are in memory";
  read_row(source, 0, 1);
  EXPECT_EQ(source.reads(), kParts + 1) << "the oldest part is not";
}

TEST(ChunkSource, KeepsReusedParts) {
  constexpr int kParts = 200;
  const CountedSource source(kParts);
  for (int x = 1; x < kParts; ++x) {
    read_row(source, 0, 1);
    read_row(source, x, x + 1);
  }
  EXPECT_EQ(source.reads(), kParts);
}

TEST(ChunkSource, SelectsChunksAroundSpawn) {
  ChunkSourceInfo info;
  info.chunks = {{-5, -1, 0}, {20, 1, 1}};
  info.spawn = DVec3(130.0, 0.0, 3.0);
  const CountedSource source(20, info);
  EXPECT_EQ(chunks_around_spawn(source, 0), (IBox{{2, -1, 0}, {3, 1, 1}}));
  EXPECT_EQ(chunks_around_spawn(source, 3), (IBox{{-1, -1, 0}, {6, 1, 1}}));
  EXPECT_EQ(chunks_around_spawn(source, std::numeric_limits<int>::max()), info.chunks);
}

TEST(ChunkSourceDeathTest, RejectsNegativeRadius) {
  const CountedSource source(1);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(chunks_around_spawn(source, -1)), "a radius that is not negative");
}

// Fails `failures` times before it reads its only part: the first time by an exception, then by an error.
class FailingSource final : public ChunkSource {
 public:
  explicit FailingSource(int failures) : ChunkSource({}, row_of_parts(1)), failures_(failures) {}

  VoxelRegistry types() const override { return {}; }
  Result<SourcePart> read_part(std::size_t part) const override {
    const int read = reads_++;
    if (read == 0) throw std::runtime_error("no disk");
    if (read < failures_) return make_error(ErrorCode::CannotRead, "no disk");
    return SourcePart{{{parts()[part].min, Chunk(VoxelType{1})}}};
  }
  int reads() const { return reads_; }

 private:
  int failures_;
  mutable std::atomic<int> reads_{0};
};

TEST(ChunkSource, RereadsPartAfterException) {
  const FailingSource source(2);
  EXPECT_THROW(static_cast<void>(source.read({0, 0, 0})), std::runtime_error);
  EXPECT_FALSE(source.read({0, 0, 0}));
  EXPECT_TRUE(source.read({0, 0, 0}));
  EXPECT_EQ(source.reads(), 3);
}

TEST(ChunkSource, WaitingThreadsRereadPartAfterException) {
  constexpr int kFailures = 3;
  const FailingSource source(kFailures);
  std::atomic<int> failed{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      try {
        if (!source.read({0, 0, 0})) ++failed;
      } catch (const std::runtime_error&) {
        ++failed;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failed, kFailures);
  EXPECT_EQ(source.reads(), kFailures + 1);
}

TEST(ChunkSource, ReadsPartOnceForManyThreads) {
  const CountedSource source(20);
  parallel_for(200, Threads{4}, [&](std::size_t i) {
    const auto chunk = source.read({static_cast<int>(i / 10), 0, 0});
    EXPECT_TRUE(chunk && chunk->has_value());
  });
  EXPECT_EQ(source.reads(), 20);
}

}  // namespace
}  // namespace quoin
