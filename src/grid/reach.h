#pragma once

#include <bit>
#include <cstdint>

#include <quoin/grid/chunk.h>
#include <quoin/grid/neighbourhood.h>

namespace quoin {

/// Which neighbours of a chunk hold one of the 26 neighbours of a changed voxel: a bit for each of the 27 offsets.
class Reach {
 public:
  /// The `mask` of an edit that stays clear of the chunk's sides.
  static constexpr std::uint32_t kCentreOnly = std::uint32_t{1} << 13;

  /// Counts voxels of a row that changed.
  void add(int y, int z, std::uint64_t changed) {
    if (changed == 0) return;
    voxels += std::popcount(changed);
    const unsigned x_sides = 0b010U | static_cast<unsigned>(changed & 1) | static_cast<unsigned>(changed >> 63) << 2;
    const unsigned y_sides = sides(y);
    const unsigned z_sides = sides(z);
    for (unsigned dz = 0; dz < 3; ++dz) {
      for (unsigned dy = 0; dy < 3; ++dy) {
        if (((z_sides >> dz) & (y_sides >> dy) & 1U) != 0) mask |= x_sides << (dz * 9 + dy * 3);
      }
    }
  }

  /// For an edit that was broken off: anything may have changed.
  void add_all() {
    voxels = kChunkVoxels;
    mask = (std::uint32_t{1} << 27) - 1;
  }

  std::int64_t voxels = 0;
  std::uint32_t mask = 0;  ///< bit Neighbourhood::index(dx, dy, dz)

 private:
  static unsigned sides(int local) {
    return 0b010U | static_cast<unsigned>(local == 0) | static_cast<unsigned>(local == kChunkEdge - 1) << 2;
  }
};

}  // namespace quoin
