#include "trace/tree_view.h"

namespace quoin::trace {

const Kernel& kernel_of(InstructionSet instructions) {
#ifdef QUOIN_X86_KERNELS
  const InstructionSet set = resolve(instructions);
  if (set == InstructionSet::Avx512) return kAvx512Kernel;
  if (set == InstructionSet::Avx2) return kAvx2Kernel;
#endif
  static_cast<void>(instructions);
  return kPlainKernel;
}

TreeView view_of(const OccupancyTree& tree, const OccupancyTree::FlatTables& tables) {
  TreeView view;
  view.cells = tables.cells.data();
  view.bricks = tables.bricks.data();
  view.words = reinterpret_cast<const std::uint32_t*>(tree.bricks());
  view.last_cell_word = static_cast<std::uint32_t>(tables.cells.size() - 1);
  view.cell_strides = tables.cell_strides();
  view.brick_strides = tables.brick_strides();
  view.brick_sizes = tables.chunks * 4;
  view.first_cell = view.cell_strides.x + view.cell_strides.y + view.cell_strides.z;
  view.origin = DVec3(tables.origin);
  const IBox bounds = tree.bounds();
  view.box = {bounds.min - tables.origin, bounds.max - tables.origin};
  return view;
}

}  // namespace quoin::trace
