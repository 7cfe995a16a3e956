#pragma once

#include <cstdint>

#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>

namespace quoin {

/// Which values are solid. The value of the surface itself is air.
enum class SolidSide : std::uint8_t {
  Above,  ///< those greater than it: densities, CT scans
  Below,  ///< those less than it: signed distances
};

/// What becomes of a solid that the array cuts off.
enum class ArrayBorder : std::uint8_t {
  Closed,  ///< it ends half a sample beyond the last: the surface is closed
  Open,    ///< the surface ends at the last samples, with an edge
};

struct ArraySurfaceOptions {
  double iso = 0.0;  ///< the value of the surface
  SolidSide solid = SolidSide::Above;
  ArrayBorder border = ArrayBorder::Closed;
  /// Gives a cell that several sheets of the surface pass through a vertex for each, so that the mesh is manifold; but
  /// for cells at an open border. Without, some edges have four triangles.
  bool split_sheets = true;
};

/// A welded surface. The vertex arrays have one entry a vertex; every vertex has a triangle.
struct ArraySurface {
  Buffer<Vec3> positions;         ///< in the view's `spacing` and `origin`
  Buffer<Vec3> normals;           ///< unit, into the air
  Buffer<std::uint32_t> indices;  ///< three a triangle, counter-clockwise seen from the air
};

/// The surface where an array has the value `iso`, straight from the array.
///
/// Vertices: one in each cell of eight samples that differ, at the mean of the crossings of its edges, to 1/65,536 of a
///           cell. A sample whose value is `iso` is 1/257 of an edge away from the surface, so that no triangles are
///           points.
/// Quads:    one around each crossed edge, split along the diagonal that is shorter in space.
/// Normals:  the gradient of the trilinear field at the vertex, in space; (0, 1, 0) where that is 0.
/// Winding:  counter-clockwise seen from the air whatever the strides and the signs of the spacing: nothing is
///           mirrored.
/// Closed:   every edge has an even number of triangles (but for the ends of an open border), as many in one direction
///           as in the other; two with `split_sheets`. Without, two sheets that pass through one cell share its vertex,
///           and an edge of two such cells may have four triangles: the mesh is then not manifold there.
/// Values:   NaN is air, about as far from the surface as its neighbours; infinities are far air and deep solid; whole
///           numbers of 64 bits are compared and subtracted exactly.
/// Order:    along the axis with the largest stride, then the next; the vertices of further sheets last; the same bytes
///           at any thread count and on every instruction set.
/// Memory:   beside input and output a third of a byte a sample and a few slices, where the axis of the smallest
///           stride has 256 samples or more; two thirds where it has 40. With `split_sheets` 24 bytes for each cell
///           that gets several vertices, and a bit for each other.
/// Errors:   InvalidArgument when `iso` is NaN, a size is not positive, the data null, a spacing 0 or, as the origin,
///           not finite, or the strides lead out of the address space; LimitExceeded for more than 2^32 - 2 vertices or
///           an axis of more than 2^31 - 2 samples; Cancelled.
/// Cost:     each sample is read once, those next to the surface a second time.
/// Source:   S. Gibson, "Constrained Elastic Surface Nets" (1998), without the relaxation.
///
///     ArrayView view{values.data(), ScalarType::Float32, {256, 256, 256}};
///     view.strides = strides_of_last_fastest(view.size, view.type);
///     const Result<ArraySurface> surface = surface_from_array(view, {.iso = 0.5});
[[nodiscard]] Result<ArraySurface> surface_from_array(const ArrayView& array, const ArraySurfaceOptions& options = {},
                                                      Threads threads = {}, const Progress& progress = {});

}  // namespace quoin
