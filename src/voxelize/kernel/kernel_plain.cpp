// The kernel for any processor.

#include "voxelize/kernel/row.inl"

namespace quoin::voxelizing {

const Kernel kPlainKernel = {&update_row};

}  // namespace quoin::voxelizing
