#pragma once

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

/// A face and the views that saw it.
struct SeenFace {
  VoxelFace face;
  const ImpostorFaces::Surfel* surfel = nullptr;  ///< null: a voxel face
  std::uint32_t views = 0;
};

/// Returns all faces of a shell and of a field with their visibility in the 26 snapshots of `edge` texels per side:
/// sorted by side, neighbours mostly together. `field` must outlive the result.
///
/// Source: all faces drawn from each view. Cost: about 10 ns per face and view.
[[nodiscard]] std::vector<SeenFace> faces_seen_of(const ImpostorShell& shell, const FieldSurfels& field,
                                                  const IBox& box, const ContentSphere& content, int edge);

/// Updates the faces after an edit. `before`: an impostor with the same content and edge, and complete faces.
/// `changed`: boxes around the changed voxels.
///
/// Cost: about 10 ns per face, plus the faces that may be visible in the texels of each box and view.
[[nodiscard]] std::vector<SeenFace> faces_seen_after(const ImpostorFaces& before, const ImpostorShell& shell,
                                                     const ContentSphere& content, std::span<const IBox> changed);

/// Returns the faces that one ray per texel meets, and faces that share an edge with one of them (slivers between the
/// rays). Works for any number of faces. Cost: about 0.15 microseconds per covered texel.
[[nodiscard]] std::vector<SeenFace> faces_seen_by_rays(const OccupancyTree& opaque, const ContentSphere& content,
                                                       int edge);

/// Returns the level of the faces that any view saw. Level::face indexes `faces`, which are sorted by direction, voxel
/// faces first.
[[nodiscard]] ImpostorFaces::Level seen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

/// Returns the level of the faces that no view saw, as if every view had seen them.
[[nodiscard]] ImpostorFaces::Level unseen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

/// Returns the level of all faces, as if every view had seen them.
[[nodiscard]] ImpostorFaces::Level all_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

}  // namespace quoin
