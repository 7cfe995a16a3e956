#include "trace/tree_view.h"

#include <algorithm>

namespace quoin::trace {

#ifdef QUOIN_X86_KERNELS
Kernels kernels_here() {
  const Kernel* const all[] = {nullptr, &kAvx512Kernel, &kAvx2Kernel, &kPlainKernel};
  Kernels here{};
  for (std::size_t i = 0; i < here.size(); ++i) {
    here[i] = all[static_cast<std::size_t>(resolve(static_cast<InstructionSet>(i)))];
  }
  return here;
}
#endif

TreeView make_view(const OccupancyTree::FlatTables& tables, const FlatChunk* chunks, const OccupancyTree::Node* bricks,
                   const IBox& bounds) {
  TreeView view{};
  view.cells = tables.cells.data();
  view.bricks = tables.bricks.data();
  view.nodes = bricks;
  view.chunks = chunks;
  view.words = reinterpret_cast<const std::uint32_t*>(bricks);
  view.last_cell_word = static_cast<std::uint32_t>(tables.cells.size() - 1);
  view.cell_strides = tables.cell_strides();
  view.brick_strides = tables.brick_strides();
  view.brick_sizes = tables.chunks * 4;
  view.first_cell = view.cell_strides.x + view.cell_strides.y + view.cell_strides.z;
  view.origin = DVec3(tables.origin);
  view.box = {bounds.min - tables.origin, bounds.max - tables.origin};
  const std::int32_t strides[3] = {1, tables.chunks.x, tables.chunks.x * tables.chunks.y};
  std::copy_n(strides, 3, view.chunk_strides);
  const IVec3 size = view.box.size();
  view.is_small = std::max(std::max(size.x, size.y), size.z) <= 1'900;
  for (int axis = 0; axis < 3; ++axis) {
    view.corner[axis] = view.origin[axis];
    view.low[axis] = static_cast<float>(view.box.min[axis]);
    view.high[axis] = static_cast<float>(view.box.max[axis]);
    view.low_voxel[axis] = view.box.min[axis];
    view.high_voxel[axis] = view.box.max[axis];
  }
  return view;
}

}  // namespace quoin::trace
