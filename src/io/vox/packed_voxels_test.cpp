#include <quoin/io/vox.h>

#include <zlib.h>

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/vox/vox_for_tests.h"

// TDCZ: Teardown's compressed models.

namespace quoin {
namespace {

using vox_test::FileBuilder;
using vox_test::FileVoxel;

/// The end of a writer's stream.
enum class End { Proper, None };

std::vector<std::byte> deflated(std::span<const std::byte> bytes, End end) {
  z_stream state{};
  EXPECT_EQ(deflateInit(&state, 9), Z_OK);
  std::vector<std::byte> out(deflateBound(&state, static_cast<uLong>(bytes.size())) + 64);
  state.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data()));
  state.avail_in = static_cast<uInt>(bytes.size());
  state.next_out = reinterpret_cast<Bytef*>(out.data());
  state.avail_out = static_cast<uInt>(out.size());
  deflate(&state, end == End::Proper ? Z_FINISH : Z_SYNC_FLUSH);
  out.resize(state.total_out);
  deflateEnd(&state);
  return out;
}

void add_packed(FileBuilder& file, IVec3 size, std::span<const std::byte> stream) {
  file.with("TDCZ", [&](auto& out) {
    for (int axis = 0; axis < 3; ++axis) out.u32(static_cast<std::uint32_t>(size[axis]));
    out.raw(stream);
  });
}

/// A model in both forms: one byte per voxel of the box, x fastest, then y, then z; and as in XYZI.
struct RandomModel {
  IVec3 size{1};
  std::vector<std::byte> box;
  std::vector<FileVoxel> voxels;
};

RandomModel random_model(std::mt19937& random, int most) {
  RandomModel model;
  for (int axis = 0; axis < 3; ++axis) model.size[axis] = 1 + static_cast<int>(random() % static_cast<unsigned>(most));
  const unsigned density = 1 + random() % 8;
  for (int z = 0; z < model.size.z; ++z) {
    for (int y = 0; y < model.size.y; ++y) {
      for (int x = 0; x < model.size.x; ++x) {
        const auto colour = static_cast<std::uint8_t>(random() % density == 0 ? random() % 256 : 0);
        model.box.push_back(static_cast<std::byte>(colour));
        if (colour == 0) continue;
        const auto byte = [](int value) { return static_cast<std::uint8_t>(value); };
        model.voxels.push_back({byte(x), byte(y), byte(z), colour});
      }
    }
  }
  return model;
}

std::string find_error(FileBuilder& file) {
  const auto loaded = read_vox(file.file());
  return loaded ? "none" : to_string(loaded.error());
}

TEST(PackedVoxels, MatchPlainModels) {
  std::mt19937 random(12);
  for (int round = 0; round < 40; ++round) {
    FileBuilder plain;
    FileBuilder packed;
    for (unsigned i = random() % 3 + 1; i > 0; --i) {
      const RandomModel model = random_model(random, round % 10 == 0 ? 100 : 20);
      const auto edge = [&](int axis) { return static_cast<std::uint32_t>(model.size[axis]); };
      plain.model(edge(0), edge(1), edge(2), model.voxels);
      if (random() % 2 == 0) packed.size(edge(0), edge(1), edge(2));
      add_packed(packed, model.size, deflated(model.box, random() % 2 == 0 ? End::Proper : End::None));
    }
    const auto expected = read_vox(plain.file());
    const auto loaded = read_vox(packed.file());
    ASSERT_TRUE(expected);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->warnings, expected->warnings);
    EXPECT_EQ(write_vox(loaded->scene)->bytes, write_vox(expected->scene)->bytes) << "round " << round;
  }
}

TEST(PackedVoxels, ReportPositionOfDamage) {
  const std::vector<std::byte> box(27, std::byte{1});
  const auto fault = [&](IVec3 size, std::vector<std::byte> stream) {
    FileBuilder file;
    add_packed(file, size, stream);
    return find_error(file);
  };
  const std::vector<std::byte> sound = deflated(box, End::Proper);
  EXPECT_EQ(fault({3, 3, 3}, sound), "none");
  EXPECT_EQ(fault({3, 3, 4}, sound), "byte 20: chunk TDCZ holds 27 voxels, but its size needs 36");
  EXPECT_EQ(fault({3, 3, 2}, sound), "byte 20: chunk TDCZ holds more voxels, but its size needs 18");
  EXPECT_EQ(fault({3, 3, 257}, sound), "byte 20: chunk TDCZ claims 3 x 3 x 257 voxels");
  EXPECT_EQ(fault({3, 0, 3}, sound), "byte 20: chunk TDCZ claims 3 x 0 x 3 voxels");
  EXPECT_EQ(fault({3, 3, 3}, {}), "byte 44: the compressed data is cut off");
  std::vector<std::byte> bytes = sound;
  bytes[bytes.size() - 1] ^= std::byte{1};
  EXPECT_NE(fault({3, 3, 3}, bytes).find("the compressed data is damaged"), std::string::npos) << "a wrong checksum";
  bytes = sound;
  bytes[0] ^= std::byte{0xFF};
  EXPECT_NE(fault({3, 3, 3}, bytes).find("the compressed data is damaged"), std::string::npos);
  bytes = sound;
  bytes.resize(5);
  EXPECT_NE(fault({3, 3, 3}, bytes).find("the compressed data is cut off"), std::string::npos);
  FileBuilder other;
  other.size(3, 3, 4);
  add_packed(other, {3, 3, 3}, sound);
  EXPECT_EQ(find_error(other), "byte 44: chunk TDCZ has a different size than the SIZE before it");
  FileBuilder both;
  add_packed(both, {3, 3, 3}, sound);
  both.voxels({});
  EXPECT_NE(find_error(both).find("chunk XYZI has no SIZE before it"), std::string::npos);
}

// A stream expands to at most 1,032 times its own length, and a model has at most 256 voxels per side.
TEST(PackedVoxels, BoundMemoryOfBombs) {
  std::vector<std::byte> box(std::size_t{256} * 256 * 256);
  // A voxel in every slab of every chunk: expensive in memory, and small in the file.
  for (std::size_t i = 0; i < box.size(); i += 1'024) box[i] = std::byte{static_cast<unsigned char>(1 + i % 255)};
  const auto packed = deflated(box, End::Proper);
  FileBuilder file;
  for (int i = 0; i < 40; ++i) add_packed(file, IVec3(256), packed);
  const auto loaded = read_vox(file.file());
  if (!loaded) {
    EXPECT_EQ(loaded.error().code, ErrorCode::LimitExceeded);
  }
  EXPECT_LE(loaded ? vox_test::grid_bytes(loaded->scene) : 0, std::size_t{1} << 29);
}

}  // namespace
}  // namespace quoin
