#pragma once

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_store.h>

namespace quoin::tool {

/// Default width and height in pixels.
inline constexpr int kThumbnailSize = 256;

struct SmallImage {
  AlphaImage image;  ///< transparent background
  bool is_empty = false;
};

/// Renders a small square image quickly: with vertex occlusion and at most 4 lamps.
[[nodiscard]] Result<SmallImage> draw_small(const Scene& scene, int size, InstanceFilter filter, Threads threads,
                                            const Progress& progress);

/// Renders the thumbnail of a world and adds it to `changes`, unless nothing is visible.
/// Errors: Cancelled, after an interrupt.
[[nodiscard]] Status put_thumbnail(const Scene& scene, Threads threads, WorldChanges& changes);

}  // namespace quoin::tool
