#pragma once

#include <cstdint>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Plane through a scene, and image size.
struct DensitySliceOptions {
  int width = 1280;  ///< pixels
  int height = 720;
  int axis = 1;     ///< world axis perpendicular to the plane: 0 x, 1 y, 2 z
  double at = 0.5;  ///< position on the axis: 0 to 1 from the minimum to the maximum of the drawn fields' bounds
  InstanceFilter instances = InstanceFilter::Visible;
};

struct DensitySlice {
  Image colour;
  std::int64_t pixels_solid = 0;  ///< pixels in a field's solid
  double position = 0.0;          ///< of the plane on its axis, in world units
};

/// Draws the densities on a plane through a scene's fields as unlit colours. Solid runs from light orange at the
/// surface to brown at the end of the density band, air from light blue to dark blue. A dark line marks the
/// surface. Where a sample spans more than four pixels, faint lines mark each whole sample of distance. Overlapping
/// fields are combined by the lowest density in samples, which is their union.
///
/// View:   all fields' bounds, seen from the positive end of the axis: for y, x points right and z down; for z, x right
///         and y up; for x, -z right and y up.
/// Errors: InvalidArgument if a size is not positive, there are more than 2^28 pixels, `axis` is not 0 to 2, `at` is
///         not 0 to 1, or no drawn instance has a field with a solid.
/// Cost:   O(pixels * instances with fields). The bytes are the same at any thread count.
[[nodiscard]] Result<DensitySlice> draw_density_slice(const Scene& scene, const DensitySliceOptions& options = {},
                                                      Threads threads = {});

}  // namespace quoin
