#pragma once

#include <cstdint>
#include <vector>

#include <quoin/mesh/quad.h>

#include "light/propagated/light_reader.h"

namespace quoin::propagated {

/// See PropagatedLight::split.
void split_quads(const LightReader& reader, const QuadBuffer& quads, IVec3 chunk, QuadBuffer& out,
                 std::vector<std::uint16_t>& light);

}  // namespace quoin::propagated
