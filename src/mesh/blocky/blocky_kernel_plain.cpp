// The mesher's kernel for any processor.

#include "mesh/blocky/blocky_kernel.inl"

namespace quoin::blocky {

void mesh_plain(const Job& job, Scratch& scratch, QuadBuffer& out) {
  mesh_chunk(job, scratch, out);
}

void find_faces_plain(const Job& job, Scratch& scratch) {
  find_all_faces(job, scratch);
}

std::int64_t count_faces_plain(const Job& job, Scratch& scratch) {
  return count_all_faces(job, scratch);
}

}  // namespace quoin::blocky
