#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/instruction_set.h"

// What is compiled for each instruction set: work on the rows of a region of light (light_solver.h). Every kernel gives
// the same bits.

namespace quoin::propagated {

inline constexpr std::size_t kPlanes = 4;      // bits of a level
inline constexpr std::size_t kBlockRows = 8;   // rows along y that are worked on at a time: a line of memory
inline constexpr std::size_t kSlabWords = 16;  // rows of a slab of a chunk: 4 along y, 4 along z

/// A step of light from one level to the next lower one. Words are [z][column of words][y]; `layer` words lie from z to
/// z + 1, `column` words from a word to that beside it along x. Bit i of a layer's mask is its block of rows 8 i on.
struct LevelPass {
  unsigned level;  ///< that which is reached
  std::size_t layer;
  std::size_t column;
  std::size_t layers;                  ///< with those of the rim: the first and the last, which nothing reaches
  const std::uint64_t* pass;           ///< where light passes; nowhere at the region's rim
  std::uint64_t* rest;                 ///< what of it is dark, in blocks that are touched
  std::uint64_t* front;                ///< what has just the level above
  std::uint64_t* next;                 ///< becomes what has this very level; holds what had the level two above
  std::uint64_t* planes[kPlanes];      ///< bits of levels, in what is wanted of the blocks that are touched
  std::size_t wanted_z, wanted_end_z;  ///< what is wanted: these layers, ...
  std::uint64_t wanted;                ///< ... of these these blocks, ...
  const std::uint64_t* wanted_bits;    ///< [column]: ... and of their rows at least these voxels
  const std::uint64_t* active;         ///< [z]: blocks to work on
  std::uint64_t* changed;              ///< [z]: blocks in which `next` is not 0
  std::uint64_t* touched;              ///< [z]: blocks in which anything was reached
  std::uint64_t* open;                 ///< [z]: blocks in which something may still be
};

/// Rows of a region that lie in a slab of a chunk.
struct SlabRead {
  const std::uint64_t* planes[kPlanes];  ///< at the slab's first row
  std::size_t layer;
  std::size_t column;
  unsigned shift;          ///< bit of a word at which a row begins; it goes on in the next column
  std::size_t begin, end;  ///< of its four layers of z those that are in the region
};

/// Of a slab, if it is changed; bit i: of plane i.
struct SlabKinds {
  unsigned has_ones = 0;
  unsigned has_zeros = 0;
  bool is_changed = false;
};

/// The planes of a slab by Gray's code, in which levels that follow each other differ in one bit: of each, units of 32
/// voxels that differ from those a row before, in the first row from 0. Light changes little from row to row, and then
/// by one level.
struct SlabUnits {
  std::array<std::uint32_t, kPlanes> fresh;     ///< bit half + 2 row: which units are there
  std::array<std::uint8_t, kPlanes + 1> first;  ///< unit of each plane; how many there are
};

/// What units are packed into: as many as there may be, and room for kernels to write beyond.
using SlabUnitsRoom = std::array<std::uint32_t, 2 * kPlanes * kSlabWords + 16>;

struct Kernel {
  void (*spread)(const LevelPass& step);
  /// Lets what `front` has fall along y where light passes, and takes that as the first front; `next` is not used.
  /// Returns whether something that is wanted stays in the shade.
  bool (*take_sky)(const LevelPass& step);
  /// Which of a layer's blocks of rows hold a bit. Requires: count <= 64.
  std::uint64_t (*find_blocks)(const std::uint64_t* words, std::size_t count);
  /// Bit i: whether row i of any of `count` planes of a slab, [plane][row], has a bit of `mask`.
  unsigned (*find_rows)(const std::uint64_t* planes, std::size_t count, std::uint64_t mask);
  /// Turns 16 planes of a row into words: bit i of out[x] is bit x of planes[i]; `out` has 64.
  void (*unpack)(const std::uint64_t* planes, std::uint16_t* out);
  /// low[i] |= (from[i] & mask) << shift, and what leaves at the top goes to high[i]. Requires: shift < 64.
  void (*shift_in)(const std::uint64_t* from, std::size_t count, std::uint64_t mask, unsigned shift, std::uint64_t* low,
                   std::uint64_t* high);
  /// `out`: [plane][row]; what is not in the region stays as it is.
  void (*read_slab)(const SlabRead& from, std::uint64_t* out);
  /// Puts what was at voxels outside of `inside` into `now`, both [plane][row]; `changed` becomes where they differ.
  SlabKinds (*merge)(const std::uint64_t* before, const std::uint64_t* inside, std::uint64_t* now,
                     std::uint64_t* changed);
  /// Of [plane][row]. `units`: plane by plane, in the order of the bits.
  SlabUnits (*pack_slab)(const std::uint64_t* planes, SlabUnitsRoom& units);
  /// The inverse. Nothing beyond the units that there are is read.
  void (*unpack_slab)(const SlabUnits& of, const std::uint32_t* units, std::uint64_t* planes);
  /// Of one row; planes[i] is that of bit i.
  void (*unpack_row)(const SlabUnits& of, const std::uint32_t* units, std::size_t row, std::uint64_t* planes);
};

// Those of wider instructions are there only where they are compiled; tables have what there is.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const KernelTable<Kernel> kKernels;

/// That of the widest instructions that this machine has.
[[nodiscard]] inline const Kernel& kernel() {
  return kKernels.widest();
}

}  // namespace quoin::propagated
