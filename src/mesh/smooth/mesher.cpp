#include <quoin/mesh/smooth.h>

#include <algorithm>

#include "core/instruction_set.h"
#include "core/moved_from.h"
#include "mesh/smooth/levels.h"
#include "mesh/smooth/scratch.h"
#include "mesh/smooth/split.h"

namespace quoin {

namespace {

using MeshKernel = void (*)(smooth::Work&, SmoothChunkMesh&);

MeshKernel pick_kernel() {
#ifdef QUOIN_X86_KERNELS
  if (has_instruction_set(InstructionSet::Avx512Bytes)) return smooth::mesh_avx512;
  if (has_instruction_set(InstructionSet::Avx2)) return smooth::mesh_avx2;
#endif
  return smooth::mesh_plain;
}

}  // namespace

struct SmoothMesher::Scratch {
  const MeshKernel kernel = pick_kernel();
  smooth::Work work;

  // Replaces `out` by the surface of a range of cells of the centre chunk.
  void mesh(const DensityNeighbourhood& chunks, const SmoothOptions& options, smooth::CellRange cells,
            SmoothChunkMesh& out) {
    out.clear();
    work.level = options.levels[13];
    work.n = kChunkEdge >> work.level;
    work.cells = cells;
    work.occlusion = smooth::within_limits(options.occlusion, work.level);
    if (smooth::prepare(chunks, work)) kernel(work, out);
  }
};

SmoothMesher::SmoothMesher() : scratch_(std::make_unique<Scratch>()) {}
SmoothMesher::SmoothMesher(SmoothMesher&&) noexcept = default;
SmoothMesher& SmoothMesher::operator=(SmoothMesher&&) noexcept = default;
SmoothMesher::~SmoothMesher() = default;

void SmoothMesher::mesh(const DensityNeighbourhood& chunks, const SmoothOptions& wanted, SmoothChunkMesh& out) {
  SmoothOptions options = wanted;
  for (std::uint8_t& level : options.levels) level = std::min<std::uint8_t>(level, kMaxSmoothLevel);
  const int n = kChunkEdge >> options.levels[13];
  const bool is_open = options.border == SmoothBorder::Open;
  if (!is_open && !smooth::ChunkLevels(options.levels).all_same()) {
    const auto own_cells = [&](SmoothChunkMesh& mesh) { impl_of(scratch_).mesh(chunks, options, {0, n}, mesh); };
    return smooth::mesh_with_transitions(chunks, options, own_cells, out);
  }
  impl_of(scratch_).mesh(chunks, options, is_open ? smooth::CellRange{0, n - 1} : smooth::CellRange{-1, n}, out);
  if (options.split_sheets) smooth::split_sheets(chunks, options, out.indices.size(), out);
}

void SmoothChunkMesh::clear() {
  positions.clear();
  normals.clear();
  occlusion.clear();
  cells.clear();
  indices.clear();
}

}  // namespace quoin
