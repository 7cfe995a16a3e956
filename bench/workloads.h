#pragma once

// The fixed worlds of the benchmarks and their check values. All mathematics in double.

#include <cmath>
#include <cstdint>
#include <vector>

#include <quoin/grid/chunk.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin::workloads {

/// Terrain height of a column, without and with steps.
inline double smooth_height(double x, double z) {
  return 31.0 + 12.0 * std::sin(0.11 * x + 0.3) * std::cos(0.07 * z) + 6.0 * std::sin(0.31 * x) * std::sin(0.23 * z);
}
inline double height(double x, double z) {
  return std::floor(smooth_height(x, z));
}

inline VoxelType terrain_type(double y, double h) {
  if (y > h) return kAir;
  if (y == h) return 1;
  return y >= h - 3 ? 2 : 3;
}

/// Glass is W1 with glass as the top voxel of every tenth column; in GlassColumns the whole column is glass.
enum class Blocky { W1, W2, W3a, W3b, W3c, W4, Empty, Full, Glass, GlassColumns };

inline constexpr VoxelType kGlass = 4;

/// The meshed part: padded coordinates 1 to 62, with a border of one voxel on all sides.
inline constexpr IBox kInterior = {IVec3{1}, IVec3{63}};

namespace detail {

/// The noise worlds draw their two bits per voxel in this order: y, then x, then z.
inline std::vector<VoxelType> noise(bool typed) {
  std::vector<VoxelType> dense(kChunkVoxels, kAir);
  std::uint64_t s = 42;
  for (std::size_t y = 0; y < 64; ++y) {
    for (std::size_t x = 0; x < 64; ++x) {
      for (std::size_t z = 0; z < 64; ++z) {
        s ^= s << 13;
        s ^= s >> 7;
        s ^= s << 17;
        if ((s >> 32 & 1U) == 0) continue;
        dense[(z * 64 + y) * 64 + x] = typed ? static_cast<VoxelType>(1 + (s >> 40) % 3) : VoxelType{1};
      }
    }
  }
  return dense;
}

inline std::vector<VoxelType> terrain(Blocky which, int column_x, int column_z) {
  std::vector<VoxelType> dense(kChunkVoxels, kAir);
  for (int z = 0; z < 64; ++z) {
    for (int x = 0; x < 64; ++x) {
      const double wx = x - 1 + 62 * column_x;
      const double wz = z - 1 + 62 * column_z;
      const double h = height(wx, wz);
      const double cave = std::sin(0.2 * wx) * std::sin(0.19 * wz);
      for (int y = 0; y < 64; ++y) {
        if (which == Blocky::W2 && !(cave * std::sin(0.21 * (y - 1)) > -0.35)) continue;
        VoxelType& type = dense[static_cast<std::size_t>((z * 64 + y) * 64 + x)];
        type = terrain_type(y - 1, h);
        const bool has_glass = (which == Blocky::Glass && type == 1) || (which == Blocky::GlassColumns && type != kAir);
        if (has_glass && (x + 3 * z) % 10 == 0) type = kGlass;
      }
    }
  }
  return dense;
}

template <class Pick>
std::vector<VoxelType> filled(Pick&& pick) {
  std::vector<VoxelType> dense(kChunkVoxels, kAir);
  for (int i = 0; i < 64 * 64 * 64; ++i) dense[static_cast<std::size_t>(i)] = pick(i & 63, i >> 6 & 63, i >> 12);
  return dense;
}

}  // namespace detail

/// A padded 64^3 chunk; each chunk column shifts the terrain by 62 voxels along x and z.
inline Chunk blocky_chunk(Blocky which, int column_x = 0, int column_z = 0) {
  const auto make = [&]() -> std::vector<VoxelType> {
    switch (which) {
      case Blocky::W1:
      case Blocky::W2:
      case Blocky::Glass:
      case Blocky::GlassColumns:
        return detail::terrain(which, column_x, column_z);
      case Blocky::W3a:
        return detail::filled([](int x, int y, int z) { return static_cast<VoxelType>((x + y + z) & 1); });
      case Blocky::W3b:
        return detail::noise(false);
      case Blocky::W3c:
        return detail::noise(true);
      case Blocky::W4:
        return detail::filled([](int x, int y, int z) {
          const int dx = x - 32;
          const int dy = y - 32;
          const int dz = z - 32;
          return dx * dx + dy * dy + dz * dz <= 784 ? VoxelType{1} : kAir;
        });
      case Blocky::Full:
        return std::vector<VoxelType>(kChunkVoxels, 1);
      default:
        return std::vector<VoxelType>(kChunkVoxels, kAir);
    }
  };
  const std::vector<VoxelType> dense = make();
  return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
}

/// The number of visible unit faces stated in the specification.
inline std::int64_t expected_faces(Blocky which) {
  switch (which) {
    case Blocky::W1:
      return 9'949;
    case Blocky::W2:
      return 19'627;
    case Blocky::W3a:
      return 714'984;
    case Blocky::W3b:
    case Blocky::W3c:
      return 357'362;
    case Blocky::W4:
      return 14'718;
    case Blocky::Glass:
      return 11'379;
    case Blocky::GlassColumns:
      return 57'616;
    default:
      return 0;
  }
}

/// A registry of three opaque types, 1 to 3.
inline VoxelRegistry three_types() {
  VoxelRegistry types;
  for (const Rgba8 colour : {Rgba8{77, 179, 51}, Rgba8{128, 77, 26}, Rgba8{128, 128, 128}}) {
    VoxelProperties properties;
    properties.colour = colour;
    if (!types.add(properties)) break;
  }
  return types;
}

/// The same registry with glass added.
inline VoxelRegistry glass_types() {
  VoxelRegistry types = three_types();
  VoxelProperties properties;
  properties.visibility = Visibility::Transparent;
  properties.colour = Rgba8{200, 220, 255};
  static_cast<void>(types.add(properties));
  return types;
}

/// Returns true if a voxel of `cave_terrain` is in a cave.
inline bool is_cave(IVec3 v) {
  return std::sin(0.2 * v.x) * std::sin(0.19 * v.z) * std::sin(0.21 * v.y) < -0.35;
}

/// A 512x128x512 terrain of 128 chunks full of caves, and its voxels without them.
inline constexpr IBox kCaveTerrain{{0, 0, 0}, {512, 128, 512}};
inline VoxelType cave_terrain_rock(IVec3 v) {
  return terrain_type(v.y, 30.0 + height(v.x, v.z));
}

inline Grid cave_terrain() {
  Grid made;
  made.edit(kCaveTerrain, [](IVec3 v, VoxelType) { return is_cave(v) ? kAir : cave_terrain_rock(v); });
  made.compact();
  return made;
}

}  // namespace quoin::workloads
