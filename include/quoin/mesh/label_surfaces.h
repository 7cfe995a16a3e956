#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>
#include <quoin/mesh/array_surface.h>

namespace [[gnu::visibility("default")]] quoin {

struct LabelSurfaceOptions {
  std::int64_t background = 0;  ///< label of empty space and of everything beyond the array
  /// Number of smoothing steps, 0 to 1,000, which remove the staircase that labels produce. Each step moves a vertex
  /// five eighths of the way towards the mean of its neighbours, within its cell. 0 leaves vertices at the mean of the
  /// edge crossings.
  int relaxation_steps = 4;
};

/// The faces between two labels, as a range of the triangles.
struct LabelInterface {
  std::int64_t back = 0;   ///< label behind the faces; never the background
  std::int64_t front = 0;  ///< label in front of the faces: the background, or else the lower label
  std::size_t first_index = 0;
  std::size_t index_count = 0;
};

/// The surfaces between all labels of an array, as one mesh. Neighbouring labels share vertices.
struct LabelSurfaces {
  Buffer<Vec3> positions;         ///< in the view's `spacing` and `origin`
  Buffer<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from the front label
  /// Sorted by `back`, then `front`, with the background first. Together they cover all indices.
  std::vector<LabelInterface> interfaces;
  std::int64_t background = 0;
};

/// Meshes the surfaces between the labels of a segmentation in one pass.
///
/// Input:    integers. Unsigned 64-bit labels keep their unsigned order, but are reported as the signed number with the
///           same bits.
/// Vertices: one in each cell of eight samples that has more than one label, at the mean of its edge crossings, which
///           lie at edge midpoints. Relaxation keeps a vertex inside its cell, at least 1/32 of a cell from the cell's
///           faces.
/// Quads:    one between any two neighbouring samples of different labels, split along the diagonal that is shorter in
///           space. Samples beyond the array have the background label.
/// Labels:   each triangle separates exactly two labels. The triangles of all interfaces of a label form its closed
///           surface: every edge has an even number of them, and four only where the label touches itself along an
///           edge. Neighbouring labels share the triangles of their interface exactly.
/// Winding:  counter-clockwise seen from the front label (see LabelSurfaces), for any strides and any sign of the
///           spacing.
/// Order:    within an interface along the axis with the largest stride, then the next. The bytes are the same at any
///           thread count and on every instruction set.
/// Memory:   a fifth of a byte per sample in addition to input and output, if the axis of the smallest stride has 256
///           samples or more; one byte per vertex with relaxation; a few slices; and about 100 bytes per pair of
///           touching labels per 16 slices in which they touch.
/// Errors:   as surface_from_array. Also InvalidArgument for Float32 and Float64 arrays, for a background that the
///           array's type cannot represent, and for relaxation steps out of range.
/// Cost:     reads each sample three times, with good locality.
/// Source:   S. Gibson, "Constrained Elastic Surface Nets" (1998), extended to several materials.
[[nodiscard]] Result<LabelSurfaces> surfaces_from_labels(const ArrayView& labels,
                                                         const LabelSurfaceOptions& options = {}, Threads threads = {},
                                                         const Progress& progress = {});

/// Returns the labels that have a surface, without the background, in the order of the interfaces.
[[nodiscard]] std::vector<std::int64_t> labels_of(const LabelSurfaces& surfaces);

/// Returns the triangles around one label, counter-clockwise seen from outside the label. Empty for unknown labels.
/// Cost: O(interfaces + triangles of the label).
[[nodiscard]] Buffer<std::uint32_t> indices_of_label(const LabelSurfaces& surfaces, std::int64_t label);

/// Returns the surface of one label with its own vertices, in mesh order. Normals are the area-weighted mean of the
/// triangles around a vertex and point out of the label; (0, 1, 0) where the mean is 0.
/// Cost: O(interfaces + vertices of the mesh + triangles of the label).
[[nodiscard]] ArraySurface surface_of_label(const LabelSurfaces& surfaces, std::int64_t label);

}  // namespace quoin
