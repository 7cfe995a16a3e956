#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <quoin/grid/chunk.h>

// What is compiled for each instruction set. Every kernel gives the same bits.

namespace quoin::propagated {

inline constexpr std::size_t kPlanes = 4;       // bits of a level
inline constexpr std::size_t kBlock = 8;        // rows that lie side by side along y
inline constexpr std::size_t kStride = 80;      // from z to z + 1
inline constexpr std::size_t kSlices = 64 + 2;  // one more at either side
inline constexpr std::size_t kPlaneWords = kStride * kSlices;

/// Of rows of 64 voxels along x, a bit a voxel: [at(y, z)]. Blocks of rows are aligned.
struct Plane {
  alignas(64) std::array<std::uint64_t, kPlaneWords> rows{};
};
/// Requires: -1 <= y, z <= 64.
[[nodiscard]] inline std::size_t at(int y, int z) {
  return static_cast<std::size_t>(z + 1) * kStride + kBlock + static_cast<std::size_t>(y);
}

/// [z]: bit b stands for the rows of y = 8 b to 8 b + 7.
using BlockSet = std::array<std::uint8_t, kChunkEdge>;

/// From one level to the next lower one.
struct SpreadStep {
  const std::uint64_t* front;  ///< voxels of the level above; none beside the chunk
  std::uint64_t* next;         ///< becomes those of this level
  std::uint64_t* open;         ///< voxels that light may still reach: those of `next` leave it
  std::array<std::uint64_t*, kPlanes>
      level;               ///< planes of the level's bits, to which `next` is added; null: bit not set
  const BlockSet* blocks;  ///< where to look; `next` stays as it was elsewhere
  BlockSet* lit;           ///< becomes where `next` has any
};

/// Levels of eight rows of 64 voxels: bit x of [i][y & 7] is bit i of the level at x.
struct LevelBlock {
  alignas(64) std::array<std::array<std::uint64_t, kBlock>, kPlanes> bits{};

  [[nodiscard]] static LevelBlock uniform(unsigned level);
  [[nodiscard]] unsigned at(int x, int row) const {
    unsigned level = 0;
    for (std::size_t bit = 0; bit < kPlanes; ++bit) {
      level |= static_cast<unsigned>(bits[bit][static_cast<std::size_t>(row)] >> x & 1U) << bit;
    }
    return level;
  }
  /// The level of all its voxels, if it is one.
  [[nodiscard]] std::optional<unsigned> uniform() const;
};

struct SpreadKernel {
  void (*spread)(const SpreadStep& step, int low_z, int high_z);
  /// Replaces the levels `where` bits are set by those of planes, [bit][y]. Returns whether any differs; `changed` says
  /// where.
  bool (*replace)(const std::array<const std::uint64_t*, kPlanes>& planes,
                  const std::array<std::uint64_t, kBlock>& where, LevelBlock& block,
                  std::array<std::uint64_t, kBlock>& changed);
};

extern const SpreadKernel kSpreadPlain;
extern const SpreadKernel kSpreadAvx2;
extern const SpreadKernel kSpreadAvx512;

}  // namespace quoin::propagated
