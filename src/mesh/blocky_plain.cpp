// The mesher's kernel for any processor.

#include <algorithm>

#include "grid/packed_row.h"
#include "mesh/blocky_scratch.h"

#define QUOIN_KERNEL plain
#define QUOIN_KERNEL_AVX2 0
#define QUOIN_KERNEL_AVX512 0
#include "mesh/blocky_kernel.inl"

namespace quoin::blocky {

void mesh_plain(const Job& job, Scratch& scratch, QuadBuffer& out) {
  plain::mesh_chunk(job, scratch, out);
}

void find_faces_plain(const Job& job, Scratch& scratch) {
  plain::find_all_faces(job, scratch);
}

}  // namespace quoin::blocky
