#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/instruction_set.h"

// The functions compiled once per instruction set: they process the rows of a light region (light_solver.h). All
// kernels give the same bits.

namespace quoin::propagated {

inline constexpr std::size_t kPlanes = 4;                 // bits of a level
inline constexpr std::size_t kBlockRows = 8;              // rows along y processed at a time: one cache line
inline constexpr std::size_t kSlabWords = 16;             // rows of a chunk slab: 4 along y, 4 along z
inline constexpr std::uint64_t kAll = ~std::uint64_t{0};  // all voxels of a row

/// One step that spreads light from a level to the next lower one. Words are [z][column of words][y]. `layer` is the
/// stride in words from z to z + 1, `column` the stride to the next word along x. Bit i of a layer's mask stands for
/// the block of rows starting at 8 i.
struct LevelPass {
  unsigned level;  ///< the level that this step assigns
  std::size_t layer;
  std::size_t column;
  std::size_t layers;         ///< with the first and the last, which belong to the rim and receive no light
  const std::uint64_t* pass;  ///< voxels that light passes; 0 at the region's rim
  /// By axis: voxels with an open side towards the next lower voxel of the axis, and one more word. Null: all are open.
  const std::uint64_t* open_sides[3];
  std::uint64_t* rest;                 ///< the dark voxels of `pass`, valid in touched blocks
  std::uint64_t* front;                ///< voxels with exactly the level above
  std::uint64_t* next;                 ///< out: voxels with exactly this level; in: voxels with the level two above
  std::uint64_t* planes[kPlanes];      ///< bit planes of levels, valid in wanted blocks that are touched
  std::size_t wanted_z, wanted_end_z;  ///< range of wanted layers
  std::uint64_t wanted;                ///< wanted blocks of these layers
  const std::uint64_t* wanted_bits;    ///< [column]: wanted voxels of the rows of these blocks, at least
  const std::uint64_t* active;         ///< [z]: blocks to process
  std::uint64_t* changed;              ///< [z]: blocks in which `next` is not 0
  std::uint64_t* touched;              ///< [z]: blocks that light has reached
  std::uint64_t* open;                 ///< [z]: blocks that may contain dark voxels
};

/// The rows of a region that lie in a slab of a chunk.
struct SlabRead {
  const std::uint64_t* planes[kPlanes];  ///< at the slab's first row
  std::size_t layer;
  std::size_t column;
  unsigned shift;          ///< first bit of a row in its word; the row continues in the next column
  std::size_t begin, end;  ///< range of the slab's four z layers that lie in the region
};

/// Contents of a slab after a change. Bit i stands for plane i.
struct SlabKinds {
  unsigned has_ones = 0;
  unsigned has_zeros = 0;
  bool is_changed = false;
};

/// The planes of a slab in Gray code, in which consecutive levels differ in one bit. Each plane stores only the
/// 32-voxel units that differ from the unit in the previous row (for the first row: from 0). Light changes little from
/// row to row, and then by one level.
struct SlabUnits {
  std::array<std::uint32_t, kPlanes> fresh;     ///< bit half + 2 row: the units that are stored
  std::array<std::uint8_t, kPlanes + 1> first;  ///< first unit of each plane; the last entry is the number of units
};

/// Buffer for packed units: the maximum number plus padding that kernels may overwrite.
using SlabUnitsRoom = std::array<std::uint32_t, 2 * kPlanes * kSlabWords + 16>;

struct Kernel {
  void (*spread)(const LevelPass& step);
  /// Lets the light of `front` fall along y where light passes and makes the result the first front. Does not use
  /// `next`. Returns true if some wanted voxels stay dark.
  bool (*take_sky)(const LevelPass& step);
  /// Returns the blocks of rows of a layer in which a bit is set. Requires: count <= 64.
  std::uint64_t (*find_blocks)(const std::uint64_t* words, std::size_t count);
  /// Bit i of the result is set if row i in any of the `count` planes, [plane][row], has a bit of `mask`.
  unsigned (*find_rows)(const std::uint64_t* planes, std::size_t count, std::uint64_t mask);
  /// Converts 16 bit planes of a row to words: bit i of out[x] is bit x of planes[i]. `out` has 64 words.
  void (*unpack)(const std::uint64_t* planes, std::uint16_t* out);
  /// low[i] |= (from[i] & mask) << shift; the bits shifted out go to high[i]. Requires: shift < 64.
  void (*shift_in)(const std::uint64_t* from, std::size_t count, std::uint64_t mask, unsigned shift, std::uint64_t* low,
                   std::uint64_t* high);
  /// Writes [plane][row]. Keeps the bits of `out` outside of the region.
  void (*read_slab)(const SlabRead& from, std::uint64_t* out);
  /// Copies the voxels outside of `inside` from `before` to `now`, both [plane][row]. Sets `changed` to the voxels that
  /// differ.
  SlabKinds (*merge)(const std::uint64_t* before, const std::uint64_t* inside, std::uint64_t* now,
                     std::uint64_t* changed);
  /// Packs [plane][row]. Writes `units` plane by plane, in the order of the bits.
  SlabUnits (*pack_slab)(const std::uint64_t* planes, SlabUnitsRoom& units);
  /// The inverse of `pack_slab`. Reads no memory past the stored units.
  void (*unpack_slab)(const SlabUnits& of, const std::uint32_t* units, std::uint64_t* planes);
  /// Unpacks one row; planes[i] receives bit i.
  void (*unpack_row)(const SlabUnits& of, const std::uint32_t* units, std::size_t row, std::uint64_t* planes);
};

// The wider kernels exist only in builds that compile them. `kKernels` contains the available ones.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const KernelTable<Kernel> kKernels;

/// Returns the kernel of the widest instructions of this machine.
[[nodiscard]] inline const Kernel& kernel() {
  return kKernels.widest();
}

}  // namespace quoin::propagated
