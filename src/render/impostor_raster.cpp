#include "render/impostor_raster.h"

#include <algorithm>

namespace quoin::raster {

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
