// The kernel of impostors for any CPU.

#include "render/impostor/raster/raster.inl"

namespace quoin::raster {

const Draw kDrawPlain = draw_faces;

}  // namespace quoin::raster
