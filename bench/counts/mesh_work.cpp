#include <memory>
#include <utility>

#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth.h>

#include "bench/smooth_workload.h"
#include "bench/workloads.h"
#include "core/made_with_for_tests.h"
#include "counted.h"

namespace quoin::counts {
namespace {

Counted blocky(const std::string& name, workloads::Blocky which, bool occlusion, InstructionSet instructions) {
  struct State {
    Chunk chunk;
    VoxelRegistry types;
    BlockyMesher mesher;
    QuadBuffer quads;
  };
  const auto state = std::make_shared<State>(
      State{workloads::blocky_chunk(which), workloads::three_types(), made_with<BlockyMesher>(instructions), {}});
  QuadOptions options;
  options.bake_occlusion = occlusion;
  options.region = workloads::kInterior;
  return {name, [=] { state->mesher.mesh(isolated(state->chunk), state->types, options, state->quads); }};
}

Counted smooth(const std::string& name, workloads::Smooth which, SmoothOcclusion form, InstructionSet instructions) {
  struct State {
    DensityChunk chunk;
    SmoothMesher mesher;
    SmoothChunkMesh mesh;
  };
  const auto state = std::make_shared<State>(
      State{workloads::density_chunk(workloads::smooth_field(which)), made_with<SmoothMesher>(instructions), {}});
  SmoothOptions options;
  options.border = SmoothBorder::Open;
  options.split_sheets = false;
  options.occlusion.method = form;
  return {name, [=] {
            DensityNeighbourhood alone;
            alone.chunks[13] = &state->chunk;
            state->mesher.mesh(alone, options, state->mesh);
          }};
}

}  // namespace

std::vector<Counted> mesh_work() {
  using workloads::Blocky;
  using workloads::Smooth;
  return {blocky("blocky/w1/ao", Blocky::W1, true, instruction_set()),
          blocky("blocky/w1/no_ao", Blocky::W1, false, instruction_set()),
          blocky("blocky/w2/ao", Blocky::W2, true, instruction_set()),
          blocky("blocky/w4/ao", Blocky::W4, true, instruction_set()),
          blocky("blocky/empty", Blocky::Empty, true, instruction_set()),
          blocky("plain/blocky/w1/ao", Blocky::W1, true, InstructionSet::Plain),
          smooth("smooth/s4", Smooth::S4, SmoothOcclusion::None, instruction_set()),
          smooth("smooth/s1", Smooth::S1, SmoothOcclusion::None, instruction_set()),
          smooth("smooth/s1/soft_share", Smooth::S1, SmoothOcclusion::SoftShare, instruction_set()),
          smooth("smooth/s1/openness", Smooth::S1, SmoothOcclusion::SolidShare, instruction_set()),
          smooth("plain/smooth/s1", Smooth::S1, SmoothOcclusion::None, InstructionSet::Plain)};
}

}  // namespace quoin::counts
