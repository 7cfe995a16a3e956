#include <quoin/mesh/smooth.h>

#include <algorithm>
#include <cassert>

#include "mesh/smooth_scratch.h"

namespace quoin {

namespace {

using MeshKernel = void (*)(smooth::Work&, SmoothChunkMesh&);

MeshKernel kernel_for(InstructionSet instructions) {
  switch (resolve(instructions)) {
#ifdef QUOIN_X86_KERNELS
    case InstructionSet::Avx512:
      return __builtin_cpu_supports("avx512vbmi2") != 0 ? smooth::mesh_avx512 : smooth::mesh_avx2;
    case InstructionSet::Avx2:
      return smooth::mesh_avx2;
#endif
    default:
      return smooth::mesh_plain;
  }
}

}  // namespace

struct SmoothMesher::Scratch {
  MeshKernel kernel = smooth::mesh_plain;
  smooth::Work work;
};

SmoothMesher::SmoothMesher(InstructionSet instructions) : scratch_(std::make_unique<Scratch>()) {
  scratch_->kernel = kernel_for(instructions);
}
SmoothMesher::SmoothMesher(SmoothMesher&&) noexcept = default;
SmoothMesher& SmoothMesher::operator=(SmoothMesher&&) noexcept = default;
SmoothMesher::~SmoothMesher() = default;

void SmoothMesher::mesh(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out) {
  out.clear();
  smooth::Work& work = scratch_->work;
  work.level = options.levels[13];
  assert(work.level <= kCoarsestLevel);
  work.n = kChunkEdge >> work.level;
  work.cells =
      options.border == SmoothBorder::Shared ? smooth::CellRange{-1, work.n} : smooth::CellRange{0, work.n - 1};
  work.occlusion = smooth::within_limits(options.occlusion, work.level);
  if (smooth::prepare(chunks, work)) scratch_->kernel(work, out);
}

void SmoothChunkMesh::clear() {
  positions.clear();
  normals.clear();
  openness.clear();
  cells.clear();
  indices.clear();
}

}  // namespace quoin
