#include "render/impostor_raster.h"

#include <limits>

namespace quoin::raster {

void Canvas::clear() {
  depth.fill(std::numeric_limits<float>::infinity());
  furthest.fill(std::numeric_limits<float>::infinity());
  id.fill(std::numeric_limits<std::int32_t>::max());
}

Draw draw_of(InstructionSet instructions) {
#ifdef QUOIN_X86_KERNELS
  switch (resolve(instructions)) {
    case InstructionSet::Avx512: return kDrawAvx512;
    case InstructionSet::Avx2: return kDrawAvx2;
    default: return kDrawPlain;
  }
#else
  static_cast<void>(instructions);
  return kDrawPlain;
#endif
}

}  // namespace quoin::raster
