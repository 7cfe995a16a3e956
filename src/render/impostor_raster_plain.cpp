// The kernel of impostors for any processor.

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "render/impostor_raster.h"

namespace quoin::raster {
namespace {

#include "core/lanes_plain.h"

#include "render/impostor_raster.inl"

}  // namespace

const Draw kDrawPlain = draw_faces;

}  // namespace quoin::raster
