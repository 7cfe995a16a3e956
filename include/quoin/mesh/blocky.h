#pragma once

#include <cstdint>
#include <memory>

#include <quoin/core/vec.h>
#include <quoin/grid/neighbourhood.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/visible_faces.h>

namespace quoin {

struct QuadOptions {
  bool merge = true;           ///< false: one quad a visible unit face
  bool bake_occlusion = true;  ///< false: 0 everywhere, and faces merge whatever stands in front of them
  IBox region = kWholeChunk;   ///< of the voxels whose faces are wanted: chunk coordinates, clipped to the chunk
};

/// Turns chunks into quads; holds the scratch memory that this takes (about 1.5 MiB), so keep one a thread.
class BlockyMesher {
 public:
  BlockyMesher();
  BlockyMesher(BlockyMesher&&) noexcept;
  BlockyMesher& operator=(BlockyMesher&&) noexcept;
  ~BlockyMesher();

  /// Replaces `out` by the quads of the centre chunk's visible faces.
  ///
  /// Space:    voxels, origin at the chunk's minimum corner.
  /// Border:   reads one voxel past each side; the chunk that owns the voxel emits the face. A null centre is air and
  ///           gives no quads.
  /// Lossless: every visible unit face of the region is covered by exactly one quad, of its type, whose occlusion
  ///           interpolates to that face's own; faces merge only where type and occlusion of all four corners agree,
  ///           and along directions in which the occlusion does not change.
  /// Order:    direction, layer, row, column; the same bytes on every machine.
  /// Cost:     O(rows of 64 voxels + visible faces); no allocation once `out` has grown.
  void mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options, QuadBuffer& out);

  /// Finds the visible faces of the centre chunk's voxels in `region` (chunk coordinates); reads one voxel past it.
  ///
  /// Cost: O(rows of 64 voxels); `out` is reused.
  void find_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region, FaceRows& out);

  /// How many faces of the centre chunk's voxels show: as many unit faces as `mesh` covers.
  ///
  /// Cost: O(rows of 64 voxels), less than `find_faces`.
  [[nodiscard]] std::int64_t count_faces(const Neighbourhood& chunks, const VoxelRegistry& types);

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace quoin
