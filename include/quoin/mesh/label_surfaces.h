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

namespace quoin {

struct LabelSurfaceOptions {
  std::int64_t background = 0;  ///< the label of what is no object, and of all beyond the array
  /// How often each vertex goes five eighths of the way to the middle of its neighbours, within its cell: what labels
  /// draw as stairs becomes smooth. 0 leaves the vertices at the mean of the crossings; 0 to 1,000.
  int relaxation_steps = 4;
};

/// The faces between two labels: a range of the triangles.
struct LabelInterface {
  std::int64_t back = 0;   ///< the label behind the faces; never the background
  std::int64_t front = 0;  ///< the label in front of them: the background, or else the lesser of both
  std::size_t first_index = 0;
  std::size_t index_count = 0;
};

/// The surfaces between all labels of an array, as one mesh: neighbours share their vertices.
struct LabelSurfaces {
  Buffer<Vec3> positions;                  ///< in the view's `spacing` and `origin`
  Buffer<std::uint32_t> indices;           ///< three a triangle, counter-clockwise seen from its front label
  std::vector<LabelInterface> interfaces;  ///< by `back`, then `front` (the background first); they cover the indices
  std::int64_t background = 0;
};

/// The surfaces between the labels of a segmentation, in one pass.
///
/// Input:    whole numbers; those of 64 bits without sign count as the signed number of the same bits where labels are
///           named, and are ordered as they are.
/// Vertices: one in each cell of eight samples whose labels are not all the same, at the mean of the crossings of its
///           edges, which are in their middles; relaxed, it stays within its cell, a thirty-second of it from its
///           faces.
/// Quads:    one between any two neighbouring samples of different labels, split along the diagonal that is shorter in
///           space; beyond the array lies the background.
/// Labels:   each triangle has exactly two. The triangles of the interfaces of one label are its surface, which is
///           closed: every edge has an even number of them, and four only where the label touches itself along an edge.
///           Two neighbours' surfaces share the triangles of their interface, to the bit.
/// Winding:  as LabelSurfaces says, whatever the strides and the signs of the spacing.
/// Order:    within an interface along the axis with the largest stride, then the next; the same bytes at any thread
///           count and on every instruction set.
/// Memory:   beside input and output a fifth of a byte a sample, and a byte a vertex with relaxation, where the axis of
///           the smallest stride has 256 samples or more; a few slices; and some 100 bytes for each pair of labels that
///           touch, for each 16 slices in which they do.
/// Errors:   as surface_from_array; InvalidArgument also for arrays of Float32 and Float64, for a background that the
///           array's type cannot hold, and for relaxation steps out of their range.
/// Cost:     each sample is read three times, from neighbouring places.
/// Source:   S. Gibson, "Constrained Elastic Surface Nets" (1998), for several materials at once.
[[nodiscard]] Result<LabelSurfaces> surfaces_from_labels(const ArrayView& labels,
                                                         const LabelSurfaceOptions& options = {}, Threads threads = {},
                                                         const Progress& progress = {});

/// The labels that have a surface, but for the background; in the order of the interfaces.
[[nodiscard]] std::vector<std::int64_t> labels_of(const LabelSurfaces& surfaces);

/// The triangles around one label, counter-clockwise seen from outside it; none where there is no such label.
/// Cost: O(interfaces + triangles of the label).
[[nodiscard]] Buffer<std::uint32_t> indices_of_label(const LabelSurfaces& surfaces, std::int64_t label);

/// One label's surface with vertices of its own, in the order of the mesh; normals are the mean of the triangles'
/// around a vertex, by their areas, and point out of the label; (0, 1, 0) where that is 0.
/// Cost: O(interfaces + vertices of the mesh + triangles of the label).
[[nodiscard]] ArraySurface surface_of_label(const LabelSurfaces& surfaces, std::int64_t label);

}  // namespace quoin
