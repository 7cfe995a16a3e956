#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/render/impostor.h>
#include <quoin/trace/occupancy_tree.h>

#include "render/impostor/raster/faces.h"
#include "render/impostor/snapshot.h"
#include "render/impostor/surfels.h"
#include "render/shell/shell.h"

namespace quoin {

/// A face and the views that saw it, by level.
struct SeenFace {
  VoxelFace face;
  const ImpostorFaces::Surfel* surfel = nullptr;  ///< null: of a voxel
  std::array<std::uint32_t, ImpostorFaces::kLevels> views{};

  [[nodiscard]] std::size_t side() const {
    return static_cast<std::size_t>(face.direction) + (surfel == nullptr ? 0 : ImpostorFaces::kSides / 2);
  }
};

/// All faces of a shell and of a field, with what the 26 snapshots of `edge` texels a side see of them: by side,
/// neighbours mostly together. `field` is to outlive the result.
///
/// Source: all faces drawn from each view. Cost: about 10 ns a face and view.
[[nodiscard]] std::vector<SeenFace> faces_seen_of(const ImpostorShell& shell, const FieldSurfels& field,
                                                  const IBox& box, const ContentSphere& content, int edge);

/// The same after an edit. `before`: of an impostor with the same content and edge whose faces are whole. `changed`:
/// boxes around the voxels that are other than then.
///
/// Cost: about 10 ns a face, and for each box and view the faces that may show in its texels.
[[nodiscard]] std::vector<SeenFace> faces_seen_after(const ImpostorFaces& before, const ImpostorShell& shell,
                                                     const ContentSphere& content, std::span<const IBox> changed);

/// Those that were seen, by a ray for each texel, whatever the number of faces; at the finest level those too that
/// share an edge with one that was seen: slivers that no texel's ray met. Cost: about 0.15 microseconds a covered
/// texel.
[[nodiscard]] std::vector<SeenFace> faces_seen_by_rays(const OccupancyTree& opaque, const ContentSphere& content,
                                                       int edge);

/// Those of `faces` that any view saw at a level, of snapshots `edge` texels a side there. Level::face counts in
/// `faces`, which are sorted by direction.
[[nodiscard]] ImpostorFaces::Level faces_of_level(const std::vector<SeenFace>& faces, std::size_t level, int edge,
                                                  const ContentSphere& content);

/// Those that no view saw at the finest level, as if every view had seen them.
[[nodiscard]] ImpostorFaces::Level unseen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

/// Those that any view saw at the finest level, of their own size.
[[nodiscard]] ImpostorFaces::Level seen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

/// All of them, as if every view had seen them, of their own size.
[[nodiscard]] ImpostorFaces::Level all_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

}  // namespace quoin
