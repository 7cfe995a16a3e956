#include <quoin/grid/density_chunk.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "grid/density/density_storage.h"

namespace quoin {
namespace {

constexpr Half kFar = 0x4800;   // 8
constexpr Half kDeep = 0xC800;  // -8
constexpr float kFloatInfinity = std::numeric_limits<float>::infinity();

TEST(StoredDensity, KeepsSignOfTinyDensities) {
  for (const float small : {1e-45F, 1e-30F, 1e-8F, 3e-8F, 1e-6F, 6e-5F}) {
    EXPECT_TRUE(DensityChunk::is_solid(stored_density(-small, 8.0F))) << small;
    EXPECT_GT(float_from_half(stored_density(small, 8.0F)), 0.0F) << small;
    EXPECT_GE(float_from_half(stored_density(small, 8.0F)), 1.0F / 16384.0F) << small;
  }
  EXPECT_EQ(stored_density(0.0F, 8.0F), 0);
  EXPECT_EQ(stored_density(-0.0F, 8.0F), 0);
}

TEST(StoredDensity, ClampsToBandAndTreatsNanAsAir) {
  EXPECT_EQ(stored_density(100.0F, 8.0F), kFar);
  EXPECT_EQ(stored_density(-100.0F, 8.0F), kDeep);
  EXPECT_EQ(stored_density(kFloatInfinity, 8.0F), kFar);
  EXPECT_EQ(stored_density(-kFloatInfinity, 8.0F), kDeep);
  EXPECT_EQ(stored_density(std::nanf(""), 8.0F), kFar);
  EXPECT_EQ(stored_density(-std::nanf(""), 8.0F), kFar);
  EXPECT_EQ(float_from_half(stored_density(1e9F, kMaxHalf)), kMaxHalf);
}

TEST(StoredDensity, NeverExceedsBandBetweenHalves) {
  std::mt19937 random(3);
  for (int round = 0; round < 1'000; ++round) {
    const float band =
        std::ldexp(1.0F + static_cast<float>(random() % 10'000) / 10'000.0F, static_cast<int>(random() % 28) - 13);
    const float most = float_from_half(stored_density(kFloatInfinity, band));
    EXPECT_LE(most, band);
    EXPECT_GE(most, band * (1.0F - 1.0F / 1024.0F));
  }
  EXPECT_GT(float_from_half(stored_density(1.0F, 1e-30F)), 0.0F);
}

TEST(StoredDensity, IsWithinOnePartIn2048) {
  std::mt19937 random(5);
  for (int round = 0; round < 10'000; ++round) {
    const float value = (static_cast<float>(random()) / 4294967296.0F - 0.5F) * 16.0F;
    if (std::abs(value) < 1e-4F) continue;
    EXPECT_NEAR(float_from_half(stored_density(value, 8.0F)), value, std::abs(value) / 2048.0F);
  }
}

// Stores every sample, and the row of its sign.
class PlainChunk {
 public:
  explicit PlainChunk(Half density) : values_(kChunkVoxels, density) {}
  [[nodiscard]] Half* row(int y, int z) { return values_.data() + (z * kChunkEdge + y) * kChunkEdge; }

 private:
  std::vector<Half> values_;
};

void expect_equal(const DensityChunk& chunk, PlainChunk& plain) {
  std::array<Half, kChunkEdge> row;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      chunk.read_row(y, z, row);
      std::uint64_t solid = 0;
      for (int x = 0; x < kChunkEdge; ++x) {
        const Half expected = plain.row(y, z)[x];
        ASSERT_EQ(row[static_cast<std::size_t>(x)], expected);
        ASSERT_EQ(chunk.get(x, y, z), expected);
        solid |= std::uint64_t{float_from_half(expected) < 0.0F} << x;
      }
      ASSERT_EQ(chunk.solid_row(y, z), solid);
      if (chunk.row(y, z) != nullptr) {
        ASSERT_EQ(chunk.row(y, z)[17], plain.row(y, z)[17]);
      }
    }
  }
}

TEST(DensityChunk, MatchesPlainArrayUnderRandomWrites) {
  constexpr unsigned kSeed = 19;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  DensityChunk chunk(kFar, 4);
  PlainChunk plain(kFar);
  std::array<Half, kChunkEdge> row;
  for (int round = 0; round < 6'000; ++round) {
    const int y = static_cast<int>(random() % 64);
    const int z = static_cast<int>(random() % 64);
    chunk.read_row(y, z, row);
    const unsigned kind = random() % 4;
    for (Half& value : row) {
      if (kind == 0) value = kDeep;
      if (kind == 1) value = kFar;
      if (kind == 2 && random() % 4 == 0) value = stored_density(static_cast<float>(random() % 100) - 50.0F, 8.0F);
    }
    std::uint64_t changed = 0;
    for (std::size_t x = 0; x < kChunkEdge; ++x) changed |= std::uint64_t{row[x] != plain.row(y, z)[x]} << x;
    ASSERT_EQ(chunk.write_row(y, z, row), changed);
    std::copy(row.begin(), row.end(), plain.row(y, z));
    if (round % 1'500 == 700) chunk.unite_slabs();
    if (round % 1'500 == 1'400) chunk.compact();
    if (round % 1'500 == 1'499) expect_equal(chunk, plain);
  }
  const DensityChunk copy = chunk;
  chunk.fill(kFar);
  expect_equal(copy, plain);
  EXPECT_EQ(copy.materials().uniform(), std::optional<VoxelType>(4));
}

TEST(DensityChunk, UniteAndCompactFreeUniformStorage) {
  DensityChunk chunk(kFar, 2);
  const std::size_t empty = chunk.bytes();
  EXPECT_EQ(chunk.uniform(), std::optional<Half>(kFar));
  EXPECT_EQ(chunk.solid_row(3, 3), 0U);
  EXPECT_EQ(chunk.row(3, 3), nullptr);
  std::array<Half, kChunkEdge> row;
  row.fill(kDeep);
  for (int z = 4; z < 8; ++z) {
    for (int y = 8; y < 12; ++y) EXPECT_EQ(chunk.write_row(y, z, row), ~std::uint64_t{0});
  }
  EXPECT_NE(chunk.row(8, 4), nullptr);
  chunk.unite_slabs();
  EXPECT_EQ(chunk.row(8, 4), nullptr);
  EXPECT_EQ(chunk.get(5, 11, 7), kDeep);
  EXPECT_EQ(chunk.solid_row(11, 7), ~std::uint64_t{0});
  EXPECT_EQ(chunk.uniform(), std::nullopt);
  row.fill(kFar);
  for (int z = 4; z < 8; ++z) {
    for (int y = 8; y < 12; ++y) chunk.write_row(y, z, row);
  }
  chunk.compact();
  EXPECT_EQ(chunk.uniform(), std::optional<Half>(kFar));
  EXPECT_EQ(chunk.bytes(), empty);
}

TEST(DensityChunk, StoresOnlyDifferingSlabs) {
  DensityChunk chunk(kFar);
  std::array<Half, kChunkEdge> row;
  row.fill(kFar);
  row[5] = 0;
  for (int i = 0; i < 10; ++i) chunk.write_row(4 * i, 0, row);
  row.fill(kFar);
  for (int i = 1; i < 10; ++i) chunk.write_row(4 * i, 0, row);
  chunk.compact();
  EXPECT_EQ(chunk.get(5, 0, 0), 0);
  EXPECT_EQ(chunk.solid_row(0, 0), 0U);
  EXPECT_LT(chunk.bytes(), sizeof(DensityChunk) + sizeof(DensityStorage) + 2 * 2 * 16 * 64);
}

// Returns a row of a slab that is not uniform.
std::array<Half, kChunkEdge> mixed_row(unsigned seed) {
  std::array<Half, kChunkEdge> row;
  for (std::size_t x = 0; x < kChunkEdge; ++x) {
    row[x] = stored_density(static_cast<float>((seed * 31 + x * 7) % 100) - 50.0F, 8.0F);
  }
  return row;
}

// Returns a chunk whose slabs all have values of their own.
DensityChunk full_chunk() {
  DensityChunk chunk(kFar);
  for (int z = 0; z < kChunkEdge; z += 4) {
    for (int y = 0; y < kChunkEdge; y += 4) chunk.write_row(y, z, mixed_row(static_cast<unsigned>(z * 64 + y)));
  }
  return chunk;
}

int shared_slabs(const DensityChunk& a, const DensityChunk& b) {
  int count = 0;
  for (int z = 0; z < kChunkEdge; z += 4) {
    for (int y = 0; y < kChunkEdge; y += 4) count += static_cast<int>(a.row(y, z) == b.row(y, z));
  }
  return count;
}

TEST(DensityChunk, CopiesOnlyWrittenSlabsOfSharedChunks) {
  DensityChunk chunk = full_chunk();
  {
    const DensityChunk snapshot = chunk;
    chunk.write_row(5, 9, mixed_row(1));  // may move all slabs, to have room for more
  }
  const DensityChunk snapshot = chunk;
  for (int frame = 0; frame < 20; ++frame) {
    const DensityChunk later = chunk;
    chunk.write_row(5, 9, mixed_row(static_cast<unsigned>(2 + frame)));
    EXPECT_EQ(shared_slabs(later, chunk), 255) << frame;
    chunk.write_row(62, 33, mixed_row(static_cast<unsigned>(50 + frame)));
    chunk.write_row(63, 33, mixed_row(static_cast<unsigned>(90 + frame)));
    EXPECT_EQ(shared_slabs(later, chunk), 254) << frame;
    EXPECT_EQ(shared_slabs(snapshot, chunk), 254) << frame;
  }
  std::array<Half, kChunkEdge> row;
  snapshot.read_row(5, 9, row);
  EXPECT_EQ(row, mixed_row(1));
  // Without other owners the block is as large as its contents again.
  DensityChunk other = full_chunk();
  const std::size_t bytes = other.bytes();
  {
    const DensityChunk first = other;
    other.write_row(0, 0, mixed_row(7));
    const DensityChunk second = other;
    other.write_row(0, 0, mixed_row(8));
    other.compact();
    EXPECT_GT(other.bytes(), bytes) << "the copy would keep the memory";
  }
  other.compact();
  EXPECT_EQ(other.bytes(), bytes);
}

TEST(DensityChunk, KeepsVersionsApart) {
  std::mt19937 random(20261129);
  struct Version {
    DensityChunk chunk;
    PlainChunk plain;
  };
  std::vector<Version> versions;
  versions.push_back({full_chunk(), PlainChunk(kFar)});
  for (int z = 0; z < kChunkEdge; z += 4) {
    for (int y = 0; y < kChunkEdge; y += 4) {
      const auto row = mixed_row(static_cast<unsigned>(z * 64 + y));
      std::copy(row.begin(), row.end(), versions[0].plain.row(y, z));
    }
  }
  for (int round = 0; round < 400; ++round) {
    const std::size_t from = random() % versions.size();
    Version next = versions[from];
    const int count = 1 + static_cast<int>(random() % 12);
    for (int i = 0; i < count; ++i) {
      const int y = static_cast<int>(random() % 64);
      const int z = static_cast<int>(random() % 64);
      auto row = mixed_row(random());
      if (random() % 3 == 0) row.fill(random() % 2 == 0 ? kDeep : kFar);
      next.chunk.write_row(y, z, row);
      std::copy(row.begin(), row.end(), next.plain.row(y, z));
    }
    if (random() % 4 == 0) next.chunk.unite_slabs();
    if (random() % 16 == 0) next.chunk.compact();
    if (versions.size() == 8) {
      versions[random() % versions.size()] = std::move(next);
    } else {
      versions.push_back(std::move(next));
    }
    if (round % 50 != 49) continue;
    for (Version& version : versions) expect_equal(version.chunk, version.plain);
  }
}

TEST(DensityChunk, IsWrittenWhileOtherThreadsReadAndDestroyCopies) {
  DensityChunk chunk = full_chunk();
  std::atomic<int> wrong = 0;
  for (int round = 0; round < 20; ++round) {
    std::vector<std::thread> readers;
    for (int reader = 0; reader < 3; ++reader) {
      readers.emplace_back([&wrong, copy = chunk, reader]() mutable {
        const std::uint64_t before = copy.content_hash();
        DensityChunk own = copy;  // written by this thread
        own.write_row(4 * reader, 8, mixed_row(static_cast<unsigned>(reader)));
        wrong += static_cast<int>(copy.content_hash() != before);
        copy = DensityChunk(kFar);
      });
    }
    for (int i = 0; i < 200; ++i) {
      const auto at = static_cast<unsigned>(round * 200 + i);
      chunk.write_row(static_cast<int>(at * 5 % 64), static_cast<int>(at * 13 % 64), mixed_row(at));
    }
    for (std::thread& reader : readers) reader.join();
  }
  EXPECT_EQ(wrong, 0);
}

TEST(DensityNeighbourhood, ReadsAcrossChunksAndOutside) {
  const DensityChunk centre(kDeep);
  const DensityChunk next(Half{0});
  DensityNeighbourhood around;
  around.chunks[13] = &centre;
  around.chunks[14] = &next;
  EXPECT_EQ(around.get({63, 0, 0}), kDeep);
  EXPECT_EQ(around.get({64, 63, 0}), 0);
  EXPECT_EQ(around.get({-1, 0, 0}), kFar);
  EXPECT_EQ(around.get({127, 0, 127}), kFar);
}

TEST(DensityChunk, ComparesContentNotStorage) {
  const Half air = stored_density(8.0F, 8.0F);
  const Half solid = stored_density(-3.0F, 8.0F);
  DensityChunk chunk(air);
  DensityChunk other(air);
  EXPECT_EQ(chunk, other);
  std::array<Half, kChunkEdge> row;
  row.fill(air);
  row[7] = solid;
  chunk.write_row(5, 6, row);
  EXPECT_NE(chunk, other);
  EXPECT_EQ(chunk, DensityChunk(chunk));
  EXPECT_EQ(chunk.get(IVec3(7, 5, 6)), solid);
  other.write_row(5, 6, row);
  EXPECT_EQ(chunk, other);
  row[7] = air;
  chunk.write_row(5, 6, row);
  EXPECT_EQ(chunk, DensityChunk(air)) << "with a slab that is stored";
  EXPECT_NE(chunk, DensityChunk(solid));
  chunk.materials().set(1, 2, 3, 4);
  EXPECT_NE(chunk, DensityChunk(air));
}

TEST(DensityChunk, RoundsRowsToStoredDensities) {
  constexpr float kBand = 5.3F;
  std::array<float, kChunkEdge> densities{};
  std::array<Half, kChunkEdge> stored{};
  for (std::size_t i = 0; i < densities.size(); ++i) {
    densities[i] = i == 9 ? std::numeric_limits<float>::quiet_NaN() : 0.37F * (static_cast<float>(i) - 30.0F);
    stored[i] = stored_density(densities[i], kBand);
  }
  DensityChunk rounded(stored_density(kBand, kBand));
  DensityChunk exact = rounded;
  EXPECT_EQ(rounded.write_row(3, 4, densities, kBand), exact.write_row(3, 4, stored));
  EXPECT_EQ(rounded, exact);
  EXPECT_EQ(rounded.get(0, 3, 4), stored_density(-kBand, kBand));
}

}  // namespace
}  // namespace quoin
