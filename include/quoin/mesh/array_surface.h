#pragma once

#include <cstdint>

#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>

namespace [[gnu::visibility("default")]] quoin {

/// Selects which values are solid. Samples equal to the iso value are air.
enum class SolidSide : std::uint8_t {
  Above,  ///< values above the iso value: densities, CT scans
  Below,  ///< values below the iso value: signed distances
};

/// Selects how the surface ends where the array cuts through a solid.
enum class ArrayBorder : std::uint8_t {
  Closed,  ///< half a sample beyond the last samples: the surface is closed
  Open,    ///< at the last samples: the surface has a boundary edge there
};

struct ArraySurfaceOptions {
  double iso = 0.0;  ///< iso value of the surface
  SolidSide solid = SolidSide::Above;
  ArrayBorder border = ArrayBorder::Closed;
  /// Gives a cell one vertex per sheet of the surface, so that the mesh is manifold. Cells at an open border keep one
  /// vertex. If false, some edges have four triangles.
  bool split_sheets = true;
};

/// A welded surface. The vertex arrays have one entry per vertex; every vertex belongs to a triangle.
struct ArraySurface {
  Buffer<Vec3> positions;         ///< in the view's `spacing` and `origin`
  Buffer<Vec3> normals;           ///< unit length, towards the air
  Buffer<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from the air
};

/// Meshes the isosurface of an array with naive Surface Nets, without copying the array into chunks.
///
/// Vertices: one in each cell of eight samples that the surface crosses (more with `split_sheets`), at the mean of its
///           edge crossings, rounded to 1/65,536 of a cell. A crossing is at least 1/257 of an edge away from a
///           sample that equals `iso`, so that no triangle collapses to a point.
/// Quads:    one around each crossed edge, split along the diagonal that is shorter in space.
/// Normals:  the gradient of the trilinear field at the vertex, in space; (0, 1, 0) where the gradient is 0.
/// Winding:  counter-clockwise seen from the air, for any strides and any sign of the spacing. The surface is never
///           mirrored.
/// Closed:   every edge has an even number of triangles, half in each direction, except at the ends of an open border.
///           With `split_sheets` that number is two. Without it, two sheets in one cell share a vertex, and an edge
///           between two such cells can have four triangles: the mesh is not manifold there.
/// Values:   NaN is air, about as far from the surface as its neighbours. Infinities are far air or deep solid. 64-bit
///           integers are compared and subtracted exactly.
/// Order:    along the axis with the largest stride, then the next; vertices of additional sheets come last. The bytes
///           are the same at any thread count and on every instruction set.
/// Memory:   a third of a byte per sample plus a few slices, in addition to input and output, if the axis of the
///           smallest stride has 256 samples or more; two thirds of a byte if it has 40. `split_sheets` adds 24 bytes
///           per cell with several vertices and one bit per other cell.
/// Errors:   InvalidArgument if `iso` is NaN, a size is not positive, the data is null, the type is unknown, a spacing
///           is 0 or not finite, the origin is not finite, or the strides leave the address space. LimitExceeded for
///           more than 2^32 - 2 vertices or an axis of more than 2^31 - 2 samples. Cancelled.
/// Cost:     reads each sample once, and samples next to the surface a second time.
/// Source:   S. Gibson, "Constrained Elastic Surface Nets" (1998), without the relaxation.
///
///     ArrayView view{values.data(), ScalarType::Float32, {256, 256, 256}};
///     view.strides = strides_of_last_fastest(view.size, view.type);
///     const Result<ArraySurface> surface = surface_from_array(view, {.iso = 0.5});
[[nodiscard]] Result<ArraySurface> surface_from_array(const ArrayView& array, const ArraySurfaceOptions& options = {},
                                                      Threads threads = {}, const Progress& progress = {});

}  // namespace quoin
