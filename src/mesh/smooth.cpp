// For the time being: every chunk by the plain mesher that the tests compare with.

#include <quoin/mesh/smooth.h>

#include <algorithm>
#include <cmath>

#include "mesh/smooth_oracle.h"
#include "mesh/smooth_split.h"
#include "mesh/smooth_transition.h"

namespace quoin {

struct SmoothMesher::Scratch {};

SmoothMesher::SmoothMesher(InstructionSet) : scratch_(std::make_unique<Scratch>()) {}
SmoothMesher::SmoothMesher(SmoothMesher&&) noexcept = default;
SmoothMesher& SmoothMesher::operator=(SmoothMesher&&) noexcept = default;
SmoothMesher::~SmoothMesher() = default;

void SmoothChunkMesh::clear() {
  positions.clear();
  normals.clear();
  openness.clear();
  cells.clear();
  indices.clear();
}

int reach_of(const SmoothOcclusionOptions& occlusion, int coarsest_level) {
  const float cells =
      occlusion.form == SmoothOcclusion::None ? 1.0F : 2.0F + std::ceil(occlusion.spread * 2.75F + 0.1F);
  return static_cast<int>(cells) << coarsest_level;
}

void SmoothMesher::mesh(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out) {
  const bool one_level = smooth::ChunkLevels(options.levels).all_same();
  if (options.border == SmoothBorder::Open || one_level) {
    oracle::smooth_mesh(chunks, options, out);
    if (options.split_sheets) smooth::split_sheets(chunks, options, out.indices.size(), out);
    return;
  }
  const auto own = [&](SmoothChunkMesh& mesh) {
    oracle::SmoothOracle(oracle::lattice_density(chunks, options.levels[13]), oracle::own_part(options)).mesh(mesh);
  };
  smooth::mesh_with_transitions(chunks, options, own, out);
}

}  // namespace quoin
