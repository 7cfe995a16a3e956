#include "io/vox/chunks.h"

#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "io/vox/vox_for_tests.h"

namespace quoin {
namespace {

using vox_test::FileBuilder;
using vox_test::FileVoxel;

using Matrix = std::array<std::array<double, 3>, 3>;

/// Follows the format's description: the two lowest pairs of bits are columns of rows 1 and 2, followed by three signs.
Matrix matrix_of(int byte) {
  Matrix m{};
  const int first = byte & 3;
  const int second = (byte >> 2) & 3;
  const int third = 3 - first - second;
  m[0][static_cast<std::size_t>(first)] = (byte & 16) != 0 ? -1 : 1;
  m[1][static_cast<std::size_t>(second)] = (byte & 32) != 0 ? -1 : 1;
  m[2][static_cast<std::size_t>(third)] = (byte & 64) != 0 ? -1 : 1;
  return m;
}

std::vector<int> all_rotation_bytes() {
  std::vector<int> bytes;
  for (int byte = 0; byte < 128; ++byte) {
    const int first = byte & 3;
    const int second = (byte >> 2) & 3;
    if (first < 3 && second < 3 && first != second) bytes.push_back(byte);
  }
  return bytes;
}

using Placed = std::set<std::array<int, 4>>;

/// Transforms each voxel's centre in MagicaVoxel's axes and then to Quoin's: voxel (x, y, z) to (x, z, -1 - y).
Placed place_by_hand(const std::vector<FileVoxel>& voxels, IVec3 size, const Matrix& m, IVec3 t) {
  Placed placed;
  for (const FileVoxel& v : voxels) {
    std::array<int, 3> at{};
    for (std::size_t row = 0; row < 3; ++row) {
      double sum = t[static_cast<int>(row)];
      for (std::size_t column = 0; column < 3; ++column) {
        const double from_pivot = v[column] + 0.5 - size[static_cast<int>(column)] / 2;
        sum += m[row][column] * from_pivot;
      }
      at[row] = static_cast<int>(std::floor(sum));
    }
    placed.insert({at[0], at[2], -1 - at[1], v[3]});
  }
  return placed;
}

Placed place_by_scene(const Scene& scene) {
  Placed placed;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    grid.grid.for_each([&](IVec3 voxel, VoxelType type) {
      const DVec3 centre = world_from_grid(instance, grid, DVec3(voxel) + 0.5);
      placed.insert({static_cast<int>(std::floor(centre.x)), static_cast<int>(std::floor(centre.y)),
                     static_cast<int>(std::floor(centre.z)), type});
    });
  }
  return placed;
}

/// Returns a shape without symmetry whose voxels all differ in colour.
std::vector<FileVoxel> asymmetric_voxels(IVec3 size) {
  std::vector<FileVoxel> voxels;
  std::uint8_t colour = 1;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        if ((x + 2 * y + 3 * z) % 4 == 3) continue;
        voxels.push_back(
            {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(z), colour++});
      }
    }
  }
  return voxels;
}

const std::vector<IVec3> kSizes = {{1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {1, 2, 3}, {4, 3, 2}, {5, 2, 4}, {3, 6, 1}};

TEST(VoxOrientation, PlacesVoxelCentresForAll48Rotations) {
  ASSERT_EQ(all_rotation_bytes().size(), 48U);
  const IVec3 t{7, -5, 3};
  for (const IVec3 size : kSizes) {
    const std::vector<FileVoxel> voxels = asymmetric_voxels(size);
    for (const int byte : all_rotation_bytes()) {
      FileBuilder builder;
      builder.model(static_cast<std::uint32_t>(size.x), static_cast<std::uint32_t>(size.y),
                    static_cast<std::uint32_t>(size.z), voxels);
      builder.transform(0, 1, {{}}).group(1, {2});
      builder.transform(2, 3, {{{"_r", std::to_string(byte)}, {"_t", "7 -5 3"}}}).shape(3, 0);
      const Result<LoadedScene> loaded = read_vox(builder.file());
      ASSERT_TRUE(loaded) << to_string(loaded.error());
      EXPECT_EQ(place_by_scene(loaded->scene), place_by_hand(voxels, size, matrix_of(byte), t))
          << "byte " << byte << ", size " << size.x << " x " << size.y << " x " << size.z;
    }
  }
}

TEST(VoxOrientation, NestedTransformsMultiplyParentFirst) {
  const IVec3 size{3, 2, 4};
  const std::vector<FileVoxel> voxels = asymmetric_voxels(size);
  for (const int outer : all_rotation_bytes()) {
    for (const int inner : {4, 17, 33, 52, 105, 9}) {
      FileBuilder builder;
      builder.model(3, 2, 4, voxels).transform(0, 1, {{{"_r", std::to_string(outer)}, {"_t", "1 2 3"}}});
      builder.group(1, {2}).transform(2, 3, {{{"_r", std::to_string(inner)}, {"_t", "-4 5 6"}}}).shape(3, 0);
      const Result<LoadedScene> loaded = read_vox(builder.file());
      ASSERT_TRUE(loaded) << to_string(loaded.error());
      const Matrix a = matrix_of(outer);
      const Matrix b = matrix_of(inner);
      Matrix product{};
      IVec3 t{1, 2, 3};
      const IVec3 inner_t{-4, 5, 6};
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          t[static_cast<int>(i)] += static_cast<int>(a[i][k]) * inner_t[static_cast<int>(k)];
          for (std::size_t j = 0; j < 3; ++j) product[i][j] += a[i][k] * b[k][j];
        }
      }
      EXPECT_EQ(place_by_scene(loaded->scene), place_by_hand(voxels, size, product, t));
    }
  }
}

TEST(VoxOrientation, RoundTripsBytesThroughInstanceTurns) {
  for (const int byte : all_rotation_bytes()) {
    const auto orientation = vox::orientation_from_byte(static_cast<std::uint8_t>(byte));
    ASSERT_TRUE(orientation.has_value());
    EXPECT_EQ(vox::byte_from_orientation(*orientation), byte);
    const auto again = vox::orientation_from_turn(vox::turn_from_orientation(*orientation));
    ASSERT_TRUE(again.has_value());
    EXPECT_EQ(*again, *orientation) << byte;
  }
}

TEST(VoxOrientation, EncodesOnlyQuarterTurns) {
  const DQuat eighth = glm::angleAxis(0.78539816339744831, DVec3(0, 1, 0));
  EXPECT_FALSE(vox::orientation_from_turn({eighth, false}).has_value());
  EXPECT_FALSE(vox::orientation_from_turn({DQuat(0, 0, 0, 0), false}).has_value());
  EXPECT_FALSE(vox::orientation_from_turn({DQuat(std::nan(""), 0, 0, 0), false}).has_value());
  EXPECT_FALSE(vox::orientation_from_byte(0).has_value());
  EXPECT_FALSE(vox::orientation_from_byte(3).has_value());
}

}  // namespace
}  // namespace quoin
