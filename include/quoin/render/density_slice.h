#pragma once

#include <cstdint>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Which plane through a scene is drawn, and how large.
struct DensitySliceOptions {
  int width = 1280;  ///< pixels
  int height = 720;
  int axis = 1;     ///< of the world, that the plane is square to: 0 x, 1 y, 2 z
  double at = 0.5;  ///< where on it: 0 to 1 from the least to the greatest of the drawn fields' bounds
  InstanceFilter instances = InstanceFilter::Visible;
};

struct DensitySlice {
  Image colour;
  std::int64_t pixels_solid = 0;  ///< that lie in a field's solid
  double place = 0.0;             ///< of the plane on its axis, in the world
};

/// Draws the densities on a plane through a scene's fields as colours, without light: solid from light orange at the
/// surface to brown at the band's end, air from light blue to dark; a dark line at the surface, and where a sample
/// spans more than four pixels faint ones at each whole sample of distance. Of several fields that overlap, the least
/// density in samples counts, which is their union.
///
/// View:    the whole of the fields' bounds, from the positive end of the axis: x to the right and z down for y, x
///          right and y up for z, -z right and y up for x.
/// Errors:  InvalidArgument for a size that is not positive or more than 2^28 pixels, an axis that is none of the
///          three, a place beyond 0 to 1, and for a scene whose drawn instances have no field with a solid.
/// Cost:    O(pixels * instances with fields). The same bytes at any thread count.
[[nodiscard]] Result<DensitySlice> draw_density_slice(const Scene& scene, const DensitySliceOptions& options = {},
                                                      Threads threads = {});

}  // namespace quoin
