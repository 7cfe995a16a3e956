#pragma once

#include <cstddef>
#include <cstdint>

#include "core/instruction_set.h"

// The kernel compiled for each instruction set: the nearest triangle for a row of voxels. Every kernel gives the same
// bits.

namespace quoin::voxelizing {

/// An edge relative to a row of points along x. Offsets start at the row's point 0; points are one voxel apart.
struct EdgeInRow {
  float at_x, at_y, at_z;        ///< from the edge's beginning to point 0
  float edge_x, edge_y, edge_z;  ///< the edge
  float per_square;              ///< 1 / squared length; 0 for an edge of length 0
  float along;                   ///< dot product of the two vectors above
  float inwards, inwards_x;      ///< distance of point 0 inwards from the edge, and its slope
};

struct TriangleInRow {
  EdgeInRow edges[3];
  float plane, plane_x;  ///< distance of point 0 from the plane, and its slope
  float flat;            ///< 1 for a triangle without area, otherwise 0
  std::int32_t number;
};

struct Kernel {
  /// Updates points from first to before end: if the triangle is nearer than `squared`, stores the square of its
  /// distance there and its number in `nearest`. Both arrays have 64 elements; points outside the range may be read
  /// too.
  void (*update_row)(const TriangleInRow& triangle, int first, int end, float* squared, std::int32_t* nearest);
};

// Kernels of wider instruction sets exist only where they are compiled; the tables list the compiled ones.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const KernelTable<Kernel> kKernels;

/// Returns the kernel with the widest instructions that this machine has.
[[nodiscard]] inline const Kernel& kernel() {
  return kKernels.widest();
}

}  // namespace quoin::voxelizing
