#pragma once

#include <cstdint>

namespace quoin {

/// Which processor instructions a kernel may use. Every choice gives the same bytes; asking for what the machine lacks
/// gives the widest that it has below.
enum class InstructionSet : std::uint8_t {
  Best,    ///< the widest that this machine has
  Avx512,  ///< AVX-512 F, BW, DQ, VL, and what a kernel needs besides (meshing: VBMI, VBMI2, GFNI); otherwise AVX2
  Avx2,    ///< AVX2, BMI, BMI2
  Plain,   ///< none beyond the build's baseline
};

/// What `wanted` comes to on this machine: never Best.
[[nodiscard]] InstructionSet resolve(InstructionSet wanted);

}  // namespace quoin
