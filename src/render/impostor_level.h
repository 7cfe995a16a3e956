#pragma once

#include <vector>

#include "render/impostor_faces.h"
#include "render/impostor_seen.h"

namespace quoin {

/// Those of `faces` that any view saw at a level, of snapshots `edge` texels a side there. Level::face counts in
/// `faces`, which are sorted by direction.
[[nodiscard]] ImpostorFaces::Level faces_of_level(const std::vector<SeenFace>& faces, std::size_t level, int edge,
                                                  const ContentSphere& content);

/// Those that no view saw at the finest level, as if every view had seen them.
[[nodiscard]] ImpostorFaces::Level unseen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

/// All of them, as if every view had seen them, of their own size.
[[nodiscard]] ImpostorFaces::Level all_faces(const std::vector<SeenFace>& faces, const ContentSphere& content);

}  // namespace quoin
