#include <quoin/io/chunk_source.h>

#include <atomic>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/parallel.h>

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
  explicit CountedSource(int parts) : ChunkSource({}, row_of_parts(parts)), chunk_(large_chunk()) {}

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

TEST(ChunkSource, KeepsPartsThatAreUsedAgain) {
  constexpr int kParts = 200;
  const CountedSource source(kParts);
  for (int x = 1; x < kParts; ++x) {
    read_row(source, 0, 1);
    read_row(source, x, x + 1);
  }
  EXPECT_EQ(source.reads(), kParts);
}

TEST(ChunkSource, ReadsAPartOnceForManyThreads) {
  const CountedSource source(20);
  parallel_for(200, Threads{4}, [&](std::size_t i) {
    const auto chunk = source.read({static_cast<int>(i / 10), 0, 0});
    EXPECT_TRUE(chunk && chunk->has_value());
  });
  EXPECT_EQ(source.reads(), 20);
}

}  // namespace
}  // namespace quoin
