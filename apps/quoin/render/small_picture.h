#pragma once

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_store.h>

namespace quoin::tool {

/// Pixels along each side of what is drawn where nobody asks for a size.
inline constexpr int kThumbnailSize = 256;

struct SmallPicture {
  AlphaImage image;  ///< clear where nothing is
  bool is_empty = false;
};

/// A square picture of a scene that is drawn at once: occlusion without rays, and few lamps.
[[nodiscard]] Result<SmallPicture> draw_small(const Scene& scene, int size, InstanceFilter filter, Threads threads,
                                              const Progress& progress);

/// Puts the picture with which a world shows itself in lists into changes; nothing where nothing is to be seen.
/// Errors: Cancelled, once the user wants to end.
[[nodiscard]] Status put_thumbnail(const Scene& scene, Threads threads, WorldChanges& changes);

}  // namespace quoin::tool
