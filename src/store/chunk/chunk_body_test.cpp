#include "store/chunk/chunk_body.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>
#include <quoin/terrain/terrain.h>

#include "core/death_for_tests.h"
#include "grid/chunk/chunk_storage.h"
#include "store/chunk/chunk_body_for_tests.h"
#include "store/chunk/content.h"

namespace quoin::store {
namespace {

constexpr ChunkAddress kPlace{7, 3, {-5, 1 << 20, -(1 << 24)}};

BlockVector<std::byte> encoded(const Chunk& voxels, const DensityChunk* densities = nullptr,
                               std::uint64_t revision = 11) {
  ChunkEncoder encoder;
  BlockVector<std::byte> body;
  EXPECT_TRUE(encoder.encode(kPlace, revision, voxels, densities, body).has_value());
  return body;
}

Result<StoredChunk> decoded(std::span<const std::byte> body, const VoxelRegistry& types, float band = 8.0F) {
  ChunkDecoder decoder;
  return decoder.decode(kPlace, body, {&types, band});
}

const VoxelRegistry& many_types() {
  static const VoxelRegistry types = types_for_tests(65'535);
  return types;
}

std::vector<VoxelType> dense_of(const Chunk& chunk) {
  std::vector<VoxelType> dense(kChunkVoxels);
  for (std::size_t row = 0; row < 4'096; ++row) {
    chunk.read_row(static_cast<int>(row % 64), static_cast<int>(row / 64),
                   std::span<VoxelType, 64>(dense.data() + row * 64, 64));
  }
  return dense;
}

/// Expects the storage that `from_dense` makes of the same voxels, except for the palette's order.
void expect_sound(const Chunk& chunk) {
  const std::vector<VoxelType> dense = dense_of(chunk);
  const Chunk wanted = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
  ASSERT_EQ(chunk.uniform(), wanted.uniform());
  ASSERT_EQ(chunk.types(), wanted.types());
  if (chunk.uniform()) return;
  const ChunkStorage& a = *ChunkStorage::of(chunk);
  const ChunkStorage& b = *ChunkStorage::of(wanted);
  EXPECT_EQ(a.bits, b.bits);
  EXPECT_EQ(a.non_air, b.non_air);
  EXPECT_EQ(a.used, b.used);
  EXPECT_EQ(a.slot_count, b.slot_count);
  EXPECT_EQ(a.free_count, 0U);
  EXPECT_TRUE(a.layer_counts == b.layer_counts);
  EXPECT_EQ(a.words.size(), b.words.size());
  if (a.direct()) {
    EXPECT_TRUE(a.counts == b.counts);
  }
  const std::vector<VoxelType> types = wanted.types();
  for (std::size_t i = 0; i < types.size(); i += 1 + types.size() / 256) {
    ASSERT_EQ(chunk.count(types[i]), wanted.count(types[i]));
  }
}

struct Kind {
  int types;
  int boxes;
  int noise;
};
constexpr std::array<Kind, 12> kKinds = {{{2, 3, 0},
                                          {2, 5, 40},
                                          {2, 0, 400'000},
                                          {3, 9, 100},
                                          {4, 0, 400'000},
                                          {16, 30, 2'000},
                                          {16, 0, 300'000},
                                          {200, 300, 20'000},
                                          {256, 0, 900'000},
                                          {1'000, 600, 20'000},
                                          {30'000, 100, 30'000},
                                          {65'536, 0, 900'000}}};

TEST(ChunkBody, KeepsChunksOfEveryPaletteWidth) {
  std::mt19937 random(1);
  for (const Kind& kind : kKinds) {
    for (int i = 0; i < 4; ++i) {
      SCOPED_TRACE(std::to_string(kind.types) + " types, " + std::to_string(kind.noise) + " at random");
      const Chunk chunk = chunk_of_boxes(random, kind.types, kind.boxes, kind.noise);
      const auto body = encoded(chunk);
      const auto back = decoded(body, many_types());
      ASSERT_TRUE(back.has_value()) << to_string(back.error());
      ASSERT_TRUE(back->voxels == chunk);
      EXPECT_FALSE(back->densities.has_value());
      expect_sound(back->voxels);
    }
  }
}

TEST(ChunkBody, KeepsChunksOfOneType) {
  for (const VoxelType type : {VoxelType{0}, VoxelType{1}, VoxelType{65'535}}) {
    const auto body = encoded(Chunk(type));
    const auto back = decoded(body, many_types());
    ASSERT_TRUE(back.has_value()) << to_string(back.error());
    EXPECT_EQ(back->voxels.uniform(), type);
    EXPECT_EQ(body.size() == kChunkBodyHeader, type == kAir);
  }
}

// Voxels at the ends of rows, layers and slabs, where the reader's sums could be wrong.
TEST(ChunkBody, KeepsSingleVoxelsAnywhere) {
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    Chunk chunk(static_cast<VoxelType>(i % 3));
    const std::array<int, 6> ends = {0, 3, 4, 31, 62, 63};
    for (int k = 0; k <= i % 5; ++k) {
      chunk.set(ends[random() % 6], ends[random() % 6], ends[random() % 6], static_cast<VoxelType>(random() % 4));
    }
    const auto back = decoded(encoded(chunk), many_types());
    ASSERT_TRUE(back.has_value()) << to_string(back.error());
    ASSERT_TRUE(back->voxels == chunk);
    expect_sound(back->voxels);
  }
}

TEST(ChunkBody, EditsDecodedChunks) {
  std::mt19937 random(3);
  for (const Kind& kind : kKinds) {
    Chunk chunk = chunk_of_boxes(random, kind.types, kind.boxes, kind.noise / 10);
    Chunk read = decoded(encoded(chunk), many_types())->voxels;
    for (int i = 0; i < 3'000; ++i) {
      const IVec3 at{static_cast<int>(random() % 64), static_cast<int>(random() % 64), static_cast<int>(random() % 64)};
      const auto type = static_cast<VoxelType>(random() % 70);
      ASSERT_EQ(chunk.set(at, type), read.set(at, type));
    }
    read.compact();
    ASSERT_TRUE(chunk == read);
    expect_sound(read);
  }
}

TEST(ChunkBody, EqualVoxelsGiveEqualBytes) {
  std::mt19937 random(4);
  for (const Kind& kind : kKinds) {
    const Chunk chunk = chunk_of_boxes(random, kind.types, kind.boxes, kind.noise / 10);
    // Writes row by row from below, over another palette, with types that appear and disappear.
    Chunk other(static_cast<VoxelType>(kind.types + 1));
    for (int i = 0; i < 300; ++i) {
      other.set(static_cast<int>(random() % 64), static_cast<int>(random() % 64), static_cast<int>(random() % 64),
                static_cast<VoxelType>(random() % 300));
    }
    std::array<VoxelType, kChunkEdge> row{};
    for (int i = 4'095; i >= 0; --i) {
      chunk.read_row(i % 64, i / 64, row);
      other.write_row(i % 64, i / 64, row);
    }
    ASSERT_TRUE(chunk == other);
    EXPECT_TRUE(encoded(chunk) == encoded(other)) << kind.types;
  }
}

TEST(ChunkBody, KeepsDataAtVoxels) {
  std::mt19937 random(5);
  const VoxelRegistry types = types_for_tests(40);
  for (int i = 0; i < 12; ++i) {
    Chunk chunk = chunk_of_boxes(random, 41, 20, 100);
    put_some_data(random, types, 1 << i, chunk);
    const auto back = decoded(encoded(chunk), types);
    ASSERT_TRUE(back.has_value()) << to_string(back.error());
    EXPECT_EQ(back->voxels.data_count(), chunk.data_count());
    ASSERT_TRUE(back->voxels == chunk);
    EXPECT_TRUE(encoded(back->voxels) == encoded(chunk));
  }
}

TEST(ChunkBody, KeepsLargestVoxelData) {
  const VoxelRegistry types = types_for_tests(5);
  Chunk chunk(VoxelType{5});
  chunk.set_data({63, 63, 63}, {0xFFFF'FFFFU, BlockVector<std::byte>(kMaxVoxelDataBytes, std::byte{9})});
  chunk.set_data({0, 0, 0}, {1, {}});
  const auto back = decoded(encoded(chunk), types);
  ASSERT_TRUE(back.has_value()) << to_string(back.error());
  EXPECT_TRUE(back->voxels == chunk);
}

TEST(ChunkBody, RefusesMoreDataThanWorldsKeep) {
  Chunk chunk(VoxelType{1});
  const BlockVector<std::byte> bytes(kMaxVoxelDataBytes);
  for (int i = 0; i <= static_cast<int>(kMaxChunkDataBytes / kMaxVoxelDataBytes); ++i) {
    chunk.set_data({i % 64, i / 64 % 64, i / 4'096}, {0, bytes});
  }
  ChunkEncoder encoder;
  BlockVector<std::byte> body(5);
  const auto status = encoder.encode(kPlace, 1, chunk, nullptr, body);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::LimitExceeded);
  EXPECT_TRUE(body.empty());
}

TEST(ChunkBody, KeepsDensitiesAndMaterials) {
  std::mt19937 random(6);
  for (const float band : {8.0F, 1.0F, 0.25F, 300.0F, 65'504.0F, 1e-4F, 1e-6F}) {
    for (int i = 0; i < 4; ++i) {
      const DensityChunk densities = densities_of_spheres(random, 9, band, i);
      const auto body = encoded(Chunk(), &densities);
      const auto back = decoded(body, many_types(), band);
      ASSERT_TRUE(back.has_value()) << to_string(back.error());
      ASSERT_TRUE(back->densities.has_value());
      ASSERT_TRUE(*back->densities == densities) << band;
      EXPECT_EQ(back->voxels.uniform(), kAir);
      for (int row = 0; row < 4'096; ++row) {
        ASSERT_EQ(back->densities->solid_row(row % 64, row / 64), densities.solid_row(row % 64, row / 64));
      }
      // The other chunk was written row by row, and its slabs are still expanded.
      EXPECT_TRUE(encoded(Chunk(), &*back->densities) == body);
    }
  }
}

TEST(ChunkBody, KeepsRandomDensities) {
  std::mt19937 random(7);
  DensityChunk densities(stored_density(8.0F, 8.0F));
  std::array<Half, kChunkEdge> row{};
  for (int i = 0; i < 4'096; i += i % 7 + 1) {
    for (Half& half : row) half = stored_density(float_from_half(static_cast<Half>(random() & 0xBFFF)), 8.0F);
    densities.write_row(i % 64, i / 64, row);
  }
  const auto back = decoded(encoded(Chunk(VoxelType{3}), &densities), many_types());
  ASSERT_TRUE(back.has_value()) << to_string(back.error());
  EXPECT_TRUE(back->densities == densities);
  EXPECT_EQ(back->voxels.uniform(), VoxelType{3});
}

TEST(ChunkBody, RefusesDensitiesOutsideBand) {
  std::mt19937 random(8);
  const DensityChunk densities = densities_of_spheres(random, 3, 8.0F, 2);
  const auto body = encoded(Chunk(), &densities);
  const auto back = decoded(body, many_types(), 4.0F);
  ASSERT_FALSE(back.has_value());
  EXPECT_EQ(back.error().code, ErrorCode::BadFormat);
}

TEST(ChunkBody, IdentifiesItsChunk) {
  std::mt19937 random(9);
  const Chunk chunk = chunk_of_boxes(random, 5, 10, 10);
  const auto body = encoded(chunk, nullptr, 0x0102'0304'0506'0708U);
  const auto header = read_header(body);
  ASSERT_TRUE(header.has_value()) << to_string(header.error());
  EXPECT_TRUE(header->place == kPlace);
  EXPECT_EQ(header->revision, 0x0102'0304'0506'0708U);
  EXPECT_EQ(header->sections & chunk_sections::kVoxels, chunk_sections::kVoxels);

  ChunkDecoder decoder;
  for (const ChunkAddress& other : {ChunkAddress{8, 3, kPlace.chunk}, ChunkAddress{7, 2, kPlace.chunk},
                                    ChunkAddress{7, 3, kPlace.chunk + IVec3{0, 0, 1}}}) {
    const auto back = decoder.decode(other, body, {&many_types(), 8.0F});
    ASSERT_FALSE(back.has_value());
    EXPECT_EQ(back.error().code, ErrorCode::BadFormat);
    EXPECT_NE(back.error().message.find("it is chunk"), std::string::npos);
  }
}

BlockVector<std::byte> body_with_everything() {
  std::mt19937 random(10);
  const VoxelRegistry types = types_for_tests(20);
  Chunk chunk = chunk_of_boxes(random, 21, 10, 20);
  put_some_data(random, types, 20, chunk);
  DensityChunk densities(stored_density(8.0F, 8.0F));
  std::array<Half, kChunkEdge> row{};
  for (std::size_t x = 0; x < row.size(); ++x) row[x] = stored_density(static_cast<float>(x) / 8.0F - 4.0F, 8.0F);
  densities.write_row(30, 9, row);
  return encoded(chunk, &densities);
}

TEST(ChunkBody, RefusesEveryTruncation) {
  auto body = body_with_everything();
  const VoxelRegistry types = types_for_tests(20);
  ASSERT_TRUE(decoded(body, types).has_value());
  ChunkDecoder decoder;
  const std::span<std::byte> all(body);
  for (std::size_t size = 0; size < body.size(); ++size) {
    EXPECT_FALSE(decoder.decode(kPlace, all.first(size), {&types, 8.0F}).has_value()) << size;
    if (size < kChunkBodyHeader) continue;
    // The same with a correct checksum.
    BlockVector<std::byte> shorter(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(size));
    put_checksum(shorter);
    EXPECT_FALSE(decoder.decode(kPlace, shorter, {&types, 8.0F}).has_value()) << size;
  }
}

TEST(ChunkBody, RefusesEveryFlippedBit) {
  auto body = body_with_everything();
  const VoxelRegistry types = types_for_tests(20);
  ChunkDecoder decoder;
  for (std::size_t bit = 0; bit < body.size() * 8; ++bit) {
    const auto flip = static_cast<std::byte>(1U << (bit % 8));
    body[bit / 8] ^= flip;
    EXPECT_FALSE(decoder.decode(kPlace, body, {&types, 8.0F}).has_value()) << bit;
    body[bit / 8] ^= flip;
  }
}

/// Returns a body with uncompressed content, so that corruptions of it are not masked by the zstd frame.
BlockVector<std::byte> stored_raw(const BlockVector<std::byte>& content, std::uint8_t sections) {
  auto body = encoded(Chunk());
  body[12] = static_cast<std::byte>(sections);
  for (std::size_t i = 0; i < 4; ++i) body[40 + i] = static_cast<std::byte>(content.size() >> (8 * i));
  body.insert(body.end(), content.begin(), content.end());
  put_checksum(body);
  return body;
}

BlockVector<std::byte> impl_of(const Chunk& chunk) {
  VoxelRunWriter writer;
  BlockVector<std::byte> content;
  writer.write(chunk, content);
  return content;
}

TEST(ChunkBody, SurvivesDamageWithValidChecksum) {
  std::mt19937 random(11);
  const VoxelRegistry types = types_for_tests(30);
  ChunkDecoder decoder;
  int errors = 0;
  int chunks = 0;
  for (int i = 0; i < 3'000; ++i) {
    const int kind = i % 3;
    Chunk chunk = chunk_of_boxes(random, kind == 0 ? 2 : 31, 4, 20);
    BlockVector<std::byte> content = impl_of(chunk);
    std::uint8_t sections = chunk_sections::kVoxels;
    if (kind == 2) {
      put_some_data(random, types, 10, chunk);
      if (chunk.data_count() != 0) {
        sections |= chunk_sections::kData;
        ASSERT_TRUE(write_placed_data(chunk, content).has_value());
      }
    }
    const int lies = static_cast<int>(random() % 4);
    for (int k = 0; k < lies; ++k) content[random() % content.size()] = static_cast<std::byte>(random());
    const auto back = decoder.decode(kPlace, stored_raw(content, sections), {&types, 8.0F});
    if (!back) {
      ++errors;
      EXPECT_EQ(back.error().code, ErrorCode::BadFormat);
      EXPECT_TRUE(back.error().byte_offset.has_value());
      EXPECT_LE(*back.error().byte_offset, content.size() + kChunkBodyHeader);
      continue;
    }
    ++chunks;
    expect_sound(back->voxels);
    back->voxels.for_each_data([&](IVec3 local, const VoxelData&) { EXPECT_NE(back->voxels.get(local), kAir); });
  }
  EXPECT_GT(errors, 500);
  EXPECT_GT(chunks, 500);
}

TEST(ChunkBody, DescribesDamage) {
  const VoxelRegistry types = types_for_tests(3);
  Chunk chunk(VoxelType{1});
  chunk.set(5, 0, 0, VoxelType{2});
  const auto good = impl_of(chunk);  // form, 1, types 1 and 2, 3 runs, 5 bytes: 4, 0, 262,137
  ASSERT_TRUE(decoded(stored_raw(good, 1), types).has_value());
  const auto message = [&](std::size_t at, std::uint8_t byte) {
    auto content = good;
    content[at] = static_cast<std::byte>(byte);
    const auto back = decoded(stored_raw(content, 1), types);
    return back ? std::string() : to_string(back.error());
  };
  EXPECT_EQ(message(0, 3), "byte 44: unknown voxel encoding 3 with 2 types");
  EXPECT_EQ(message(0, 0), "byte 44: unknown voxel encoding 0 with 2 types");
  EXPECT_EQ(message(3, 4), "byte 47: type 4, but the last type of the world is 3");
  EXPECT_EQ(message(5, 1), "byte 49: duplicate type 1");
  EXPECT_EQ(message(7, 1), "byte 51: invalid number of runs: 1 for 2 types");
  EXPECT_EQ(message(7, 2), "byte 59: runs end early, at voxel 6");
  EXPECT_EQ(message(15, 5), "byte 59: invalid run length at voxel 7");
  EXPECT_EQ(message(15, 3), "byte 59: runs end early, at voxel 262143");
  auto longer = good;
  longer.push_back(std::byte{0});
  EXPECT_EQ(to_string(decoded(stored_raw(longer, 1), types).error()), "byte 64: extra bytes after the last section");
  auto later = encoded(chunk);
  later[11] = std::byte{'2'};
  put_checksum(later);
  EXPECT_EQ(decoded(later, types).error().code, ErrorCode::Unsupported);
}

// Bodies from earlier versions still decode to the same chunks.
TEST(ChunkBody, ReadsCorpus) {
  const VoxelRegistry types = types_for_tests(300);
  for (const CorpusChunk& each : corpus_chunks()) {
    const auto path = std::filesystem::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "chunk_body" / each.file;
    std::ifstream in(path, std::ios::binary);
    ASSERT_TRUE(in.good()) << path;
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    ChunkDecoder decoder;
    const auto back = decoder.decode({}, std::as_bytes(std::span(bytes)), {&types, 8.0F});
    ASSERT_TRUE(back.has_value()) << each.file << ": " << to_string(back.error());
    EXPECT_TRUE(*back == each.chunk) << each.file;
  }
}

// A frame whose size exceeds any chunk is rejected before memory is allocated.
TEST(ChunkBody, RefusesBombs) {
  auto body = encoded(Chunk(VoxelType{1}));
  body[12] = static_cast<std::byte>(chunk_sections::kVoxels | chunk_sections::kCompressed);
  for (std::size_t i = 40; i < 44; ++i) body[i] = std::byte{0xFF};
  put_checksum(body);
  const auto back = decoded(body, many_types());
  ASSERT_FALSE(back.has_value());
  EXPECT_EQ(back.error().byte_offset, 40U);
}

TEST(ChunkBody, KeepsGeneratedTerrain) {
  VoxelRegistry types;
  const auto terrain = add_terrain_types(types);
  ASSERT_TRUE(terrain.has_value());
  ChunkEncoder encoder;
  ChunkDecoder decoder;
  BlockVector<std::byte> body;
  for (int i = 0; i < 12; ++i) {
    const IVec3 place{i % 3, i / 3 % 2, i / 6};
    const Chunk chunk = generate_terrain_chunk({.size = {8, 4, 8}}, *terrain, place);
    const DensityChunk densities = generate_smooth_terrain_chunk({.size = {3, 2, 2}}, *terrain, place);
    ASSERT_TRUE(encoder.encode({0, 0, place}, 1, chunk, &densities, body).has_value());
    const auto back = decoder.decode({0, 0, place}, body, {&types, 8.0F});
    ASSERT_TRUE(back.has_value()) << to_string(back.error());
    EXPECT_TRUE(back->voxels == chunk);
    EXPECT_TRUE(back->densities == densities);
    expect_sound(back->voxels);
  }
}

TEST(ChunkBodyDeathTest, AssertsOnReadBeyondContent) {
  const BlockVector<std::byte> bytes(3);
  ContentReader content(bytes);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(content.take<std::uint32_t>()), "bytes that .has. confirmed");
}

TEST(ChunkBodyDeathTest, AssertsOnZeroBand) {
  const BlockVector<std::byte> body = encoded(Chunk());
  QUOIN_EXPECT_MISTAKE(static_cast<void>(decoded(body, many_types(), 0.0F)), "a positive band");
}

}  // namespace
}  // namespace quoin::store
