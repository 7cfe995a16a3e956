#pragma once

#include <quoin/core/result.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// Removes triangles where that moves the surface by at most `error_in_samples`, drops vertices that nothing uses any
/// more, and orders what is left for the caches of graphics processors. Returns the error reached, at most the one
/// allowed.
///
/// Error:    the greatest distance, in samples, of a vertex of the mesh before from the surface after. It is measured;
///           where meshoptimizer, which bounds a mean, goes beyond it, less is removed, or nothing at all.
/// Kept:     vertices that stay keep normal, occlusion, albedo and type, and their position, but for those below.
///           Vertices of one place that differ in these count as one: lines between colours stay where they are, to the
///           error. A closed mesh stays closed.
/// Manifold: every edge of what was closed has two triangles, by places too if the error is above 0. Where removing
///           brings parts of the surface together, the vertices there are drawn a thousandth of a sample apart.
/// Order:    the same bytes on every run.
/// Requires: arrays of one length (but for empty occlusion), indices that name vertices, finite positions.
/// Errors:   InvalidArgument when the error is not a number of at least 0; Unsupported in builds without meshoptimizer.
///           The mesh is as before then.
/// Cost:     some microseconds a triangle, on one thread.
/// Source:   M. Garland, P. Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997); meshoptimizer.
[[nodiscard]] Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples);

/// Whether this build can simplify.
[[nodiscard]] bool can_simplify();

}  // namespace quoin
