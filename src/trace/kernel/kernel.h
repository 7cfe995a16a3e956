#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/grid/density_grid.h>
#include <quoin/trace/packet.h>

#include "core/instruction_set.h"
#include "trace/tree_view.h"

namespace quoin {
struct DensityStorage;
}

namespace quoin::trace {

/// A field as kernels read it.
struct FieldView {
  const TreeView* cells;  ///< those with a solid corner
  const DensityGrid* grid;
  /// The densities of a chunk; null where it is not there or uniform.
  const DensityStorage* (*find)(const DensityGrid& grid, int x, int y, int z);
  /// The densities of any cell's corners, by x + 2 y + 4 z.
  void (*read)(const DensityGrid& grid, int x, int y, int z, float* corners);
};

/// Where a field becomes negative along a ray: the cell, the densities of its corners by x + 2 y + 4 z, and t.
struct FieldHit {
  double t;
  int x, y, z;
  float corners[8];
};

// Every kernel gives the same results, those of a walk from one lattice plane to the next where the plane P of an axis
// is crossed at t = (P - origin) * (1 / direction), in single precision and rounded after each operation, in the order
// of t and at ties of axes; origin is relative to a multiple of 64 voxels next to the ray's start.
struct Kernel {
  /// One ray; `face` is not set where it starts inside.
  bool (*first_hit)(const TreeView& tree, const Ray& ray, double max_t, RayHit& hit, bool& unfinished);
  /// Whether one ray is blocked.
  bool (*any_hit)(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished);
  /// Fills in what `PacketHits` says; lanes of `unfinished` are to be traced otherwise.
  void (*first_hits)(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished);
  /// Returns the lanes that are blocked.
  std::uint32_t (*any_hits)(const TreeView& tree, const RayPacket& rays, std::uint32_t& unfinished);
};

/// Of fields. Files of their own hold these: in one with the others, compilers turn what both use into calls, and rays
/// among voxels take a tenth more instructions (docs/decisions/archive/052).
struct FieldKernel {
  /// One ray in a field; null where it is to be walked otherwise, as are those that are unfinished. Whether alone: `t`
  /// means nothing.
  bool (*first_in_field)(const FieldView& field, const Ray& ray, double max_t, FieldHit& hit, bool& unfinished);
  bool (*any_in_field)(const FieldView& field, const Ray& ray, double max_t, FieldHit& hit, bool& unfinished);
  /// The same of packets, lane by lane; null where rays are to be traced one by one.
  std::uint32_t (*first_hits_in_field)(const FieldView& field, const RayPacket& rays, FieldHit* hits,
                                       std::uint32_t& unfinished);
  std::uint32_t (*any_hits_in_field)(const FieldView& field, const RayPacket& rays, std::uint32_t& unfinished);
};

/// The same by any processor, for any ray and whatever the size of the world: `field.cells` may be null.
bool walk_in_field(const OccupancyTree& cells, const FieldView& field, const Ray& ray, double max_t, bool asks_where,
                   FieldHit& hit);

// Those of wider instructions are there only where they are compiled; tables have what there is.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const FieldKernel kPlainFieldKernel;
extern const FieldKernel kAvx2FieldKernel;
extern const FieldKernel kAvx512FieldKernel;
extern const KernelTable<Kernel> kKernels;
extern const KernelTable<FieldKernel> kFieldKernels;

/// That of the widest instructions that this machine has.
[[nodiscard]] inline const Kernel& kernel() {
  return kKernels.widest();
}
[[nodiscard]] inline const FieldKernel& field_kernel() {
  return kFieldKernels.widest();
}

}  // namespace quoin::trace
