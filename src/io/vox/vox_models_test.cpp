#include "io/vox/vox_reader.h"

#include <random>

#include <gtest/gtest.h>

namespace quoin::vox {
namespace {

struct RandomModel {
  std::vector<std::byte> voxels;
  IVec3 size{};
};

/// Some positions occur twice, some lie outside, and some have no colour.
RandomModel random_model(std::mt19937& random, IVec3 size, std::size_t count) {
  RandomModel model{{}, size};
  const auto coordinate = [&](int edge) {
    return static_cast<std::byte>(random() % static_cast<unsigned>(std::min(edge + 1, 256)));
  };
  for (std::size_t i = 0; i < count; ++i) {
    model.voxels.insert(model.voxels.end(), {coordinate(size.x), coordinate(size.y), coordinate(size.z),
                                             static_cast<std::byte>(random() % 5)});
  }
  return model;
}

/// The simple version: one voxel after the other.
Grid one_by_one(const RandomModel& model, const std::array<std::uint8_t, kColours>& type_of, ModelOmissions& losses) {
  Grid grid;
  for (std::size_t i = 0; i < model.voxels.size(); i += 4) {
    const auto byte = [&](std::size_t at) { return std::to_integer<int>(model.voxels[i + at]); };
    if (byte(0) >= model.size.x || byte(1) >= model.size.y || byte(2) >= model.size.z) {
      ++losses.outside;
    } else if (byte(3) == 0) {
      ++losses.colourless;
    } else {
      grid.set({byte(0), byte(2), model.size.y - 1 - byte(1)}, type_of[static_cast<std::size_t>(byte(3))]);
    }
  }
  return grid;
}

TEST(VoxModels, MatchSettingVoxelsOneByOne) {
  constexpr unsigned kSeed = 61;
  std::mt19937 random(kSeed);
  SCOPED_TRACE(kSeed);
  std::array<std::uint8_t, kColours> type_of{};
  for (std::size_t i = 1; i < type_of.size(); ++i) type_of[i] = static_cast<std::uint8_t>(1 + i % 3);
  ModelBuilder builder(type_of);
  ModelOmissions losses;
  for (const IVec3 size :
       {IVec3{1}, IVec3{64}, IVec3{65, 3, 64}, IVec3{130, 64, 20}, IVec3{7, 200, 66}, IVec3{256, 256, 2}}) {
    for (const std::size_t count : {1U, 100U, 10'000U, 70'000U, 500'000U}) {
      const RandomModel made = random_model(random, size, count);
      Model model;
      model.size = size;
      model.voxels = made.voxels;
      const SceneGrid built = builder.build(model);
      const Grid expected = one_by_one(made, type_of, losses);
      ASSERT_EQ(built.grid.voxel_count(), expected.voxel_count()) << count;
      ASSERT_EQ(built.grid.chunk_count(), expected.chunk_count()) << count;
      const IVec3 end = built.canvas.max;
      std::size_t differing = 0;
      for (int z = 0; z < end.z; ++z) {
        for (int y = 0; y < end.y; ++y) {
          for (int x = 0; x < end.x; ++x) differing += built.grid.get({x, y, z}) != expected.get({x, y, z}) ? 1 : 0;
        }
      }
      EXPECT_EQ(differing, 0U) << count;
    }
  }
  EXPECT_EQ(builder.losses().outside, losses.outside);
  EXPECT_EQ(builder.losses().colourless, losses.colourless);
}

}  // namespace
}  // namespace quoin::vox
