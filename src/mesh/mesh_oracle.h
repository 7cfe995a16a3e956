#pragma once

// The slow, obvious mesher, one voxel, one face, one neighbour at a time: the reference for the fast ones.

#include <map>
#include <random>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include <quoin/core/direction.h>
#include <quoin/grid/grid.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/mesh/quad.h>

namespace quoin::oracle {

/// The visible content of a unit face.
struct UnitFace {
  VoxelType type = kAir;
  FaceOcclusion corners{};
  bool operator==(const UnitFace&) const = default;
};

/// x, y, z, direction.
using FaceKey = std::tuple<int, int, int, int>;
using FaceSet = std::map<FaceKey, UnitFace>;

inline bool shows(const VoxelRegistry& types, VoxelType a, VoxelType b) {
  return a != kAir && (b == kAir || (types[b].visibility == Visibility::Transparent && a != b));
}

/// Computes occlusion by reading each of the three voxels of each corner.
inline FaceOcclusion corners_of_face(const Grid& grid, const VoxelRegistry& types, IVec3 voxel, Direction d) {
  const FaceFrame& frame = frame_of(d);
  FaceOcclusion corners{};
  const int du[4] = {-1, 1, 1, -1};
  const int dv[4] = {-1, -1, 1, 1};
  for (std::size_t corner = 0; corner < 4; ++corner) {
    IVec3 side1 = voxel + normal_of(d);
    IVec3 side2 = side1;
    side1[frame.u] += du[corner];
    side2[frame.v] += dv[corner];
    IVec3 across = side1;
    across[frame.v] += dv[corner];
    const auto blocks = [&](IVec3 at) {
      const VoxelProperties& type = types[grid.get(at)];
      return type.visibility == Visibility::Opaque && type.occludes.value_or(true) ? 1 : 0;
    };
    const int sum = blocks(side1) + blocks(side2);
    corners[corner] = static_cast<std::uint8_t>(sum == 2 ? 3 : sum + blocks(across));
  }
  return corners;
}

inline FaceSet visible_faces(const Grid& grid, const VoxelRegistry& types, bool occlusion) {
  FaceSet faces;
  grid.for_each([&](IVec3 v, VoxelType type) {
    for (const Direction d : kDirections) {
      if (!shows(types, type, grid.get(v + normal_of(d)))) continue;
      faces[{v.x, v.y, v.z, static_cast<int>(d)}] = {type,
                                                     occlusion ? corners_of_face(grid, types, v, d) : FaceOcclusion{}};
    }
  });
  return faces;
}

/// Splits a quad into unit faces. Fails if its corners do not interpolate to one tuple, or if a face exists twice.
inline void add_quad(const Quad& quad, IVec3 origin, FaceSet& faces) {
  const FaceOcclusion corners = quad.occlusion();
  const FaceFrame& frame = frame_of(quad.direction());
  if (quad.size_u() > 1) {
    EXPECT_TRUE(corners[0] == corners[1] && corners[3] == corners[2]);
  }
  if (quad.size_v() > 1) {
    EXPECT_TRUE(corners[0] == corners[3] && corners[1] == corners[2]);
  }
  EXPECT_EQ(quad.flipped(), corners[0] + corners[2] > corners[1] + corners[3]);
  for (int v = 0; v < quad.size_v(); ++v) {
    for (int u = 0; u < quad.size_u(); ++u) {
      IVec3 at = quad.voxel();
      at[frame.u] += u;
      at[frame.v] += v;
      at += origin;
      const FaceKey key{at.x, at.y, at.z, static_cast<int>(quad.direction())};
      EXPECT_TRUE(faces.emplace(key, UnitFace{quad.type(), corners}).second) << "a face is covered twice";
    }
  }
}

/// Opaque types 1 to 3, transparent types 4 and 5.
inline VoxelRegistry mixed_types() {
  VoxelRegistry types;
  for (int i = 0; i < 5; ++i) {
    VoxelProperties properties;
    properties.colour = {static_cast<std::uint8_t>(40 * i), 90, 200, 255};
    if (i >= 3) properties.visibility = Visibility::Transparent;
    EXPECT_TRUE(types.add(properties).has_value());
  }
  return types;
}

/// As `mixed_types`, but the opaque type 2 does not occlude.
inline VoxelRegistry unoccluding_types() {
  VoxelRegistry types = mixed_types();
  VoxelProperties properties = types[2];
  properties.occludes = false;
  types.replace(2, properties);
  return types;
}

/// Returns a random world in `box`: blocks of random size, which can be merged, and single voxels.
inline Grid random_world(unsigned seed, const IBox& box, int type_count, double density) {
  std::mt19937 random(seed);
  Grid grid;
  const IVec3 size = box.size();
  const auto within = [&](int axis) {
    return box.min[axis] + static_cast<int>(random() % static_cast<unsigned>(size[axis]));
  };
  const auto type = [&] { return static_cast<VoxelType>(random() % static_cast<unsigned>(type_count + 1)); };
  const int blocks = 1 + static_cast<int>(random() % 30);
  for (int i = 0; i < blocks; ++i) {
    const IVec3 a{within(0), within(1), within(2)};
    const IVec3 b{within(0), within(1), within(2)};
    grid.fill_box({a, glm::min(a + glm::abs(b - a) / 2, box.max - 1) + 1}, type());
  }
  const double voxels = density * size.x * size.y * size.z;
  for (int i = 0; i < static_cast<int>(voxels); ++i) grid.set({within(0), within(1), within(2)}, type());
  return grid;
}

}  // namespace quoin::oracle
