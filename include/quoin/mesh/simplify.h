#pragma once

#include <quoin/core/result.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// Removes triangles where that moves the surface by at most about `error_in_samples`, drops vertices that nothing uses
/// any more, and orders what is left for the caches of graphics processors. Returns the error reached, at most the one
/// allowed.
///
/// Error:    the root mean square distance, in samples, of a vertex from the planes of all triangles that it stands
///           for, as meshoptimizer estimates it; single points of the surface may be some times farther off.
/// Kept:     vertices that stay keep position, normal, occlusion, albedo and type. A closed mesh stays closed.
/// Order:    the same bytes on every run.
/// Requires: arrays of one length (but for empty occlusion), indices that name vertices, finite positions.
/// Errors:   InvalidArgument when the error is not a number of at least 0; Unsupported in builds without meshoptimizer.
///           The mesh is as before then.
/// Cost:     about a microsecond a triangle, on one thread.
/// Source:   M. Garland, P. Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997); meshoptimizer.
[[nodiscard]] Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples);

/// Whether this build can simplify.
[[nodiscard]] bool can_simplify();

}  // namespace quoin
