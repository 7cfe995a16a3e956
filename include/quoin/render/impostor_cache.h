#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/impostor.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

struct ImpostorCacheOptions {
  std::size_t max_bytes = std::size_t{1} << 30;  ///< of all held impostors
  Threads workers{};
};

/// Impostors of a scene's grids, built by worker threads on first request and rebuilt after edits.
///
///   const std::shared_ptr<const Impostor> impostor = cache.find(scene, instance.grid);  // null: trace it this time
///   ...
///   cache.wait(scene, 0.0);  // once per frame, at its end
///
/// Workers read snapshots of the grids, so edits never wait for them. After an edit, only the affected parts are
/// processed (Impostor::rebuilt), and `find` returns the old impostor until the new impostor is ready. Grids with
/// shapes are processed whole, also if the state of a shape has changed. `find` never returns the impostor of a
/// replaced grid or of another scene. When the cache is full, it drops the least recently used impostors. Impostors
/// requested within one round, which ends with `wait`, never replace each other; requests that do not fit get no
/// impostor.
///
/// Lifetime: shares impostors with its callers; the scene is read only during calls.
/// Threads:  any number can call at once, as long as no thread edits the scene at the same time.
class ImpostorCache {
 public:
  explicit ImpostorCache(const ImpostorCacheOptions& options = {});
  ImpostorCache(ImpostorCache&&) noexcept;
  ImpostorCache& operator=(ImpostorCache&&) noexcept;
  /// Waits for the builds in progress; cancels the rest.
  ~ImpostorCache();

  /// Returns the newest completed impostor; null if there is none or the handle is invalid. Marks it as used. Requests
  /// a build if the impostor is missing, older than the grid or built with other options.
  ///
  /// Cost:   O(log grids), plus a grid snapshot if a build is needed.
  /// Errors: std::system_error if the workers cannot be started.
  [[nodiscard]] std::shared_ptr<const Impostor> find(const Scene& scene, GridHandle grid,
                                                     const ImpostorOptions& options = {});

  /// Ends a round. Waits until all requested impostors are ready or `seconds` have passed, and forgets removed grids.
  /// Without a time limit, the calling thread also builds. Returns the number of grids that still wait.
  std::size_t wait(const Scene& scene, double seconds = std::numeric_limits<double>::infinity());

  /// Requests rebuilds of impostors with types that have become transparent or opaque since the build, or whose shapes
  /// have changed; `find` does this too.
  /// Cost: O(types that changed).
  void update_types(const VoxelRegistry& types);

  struct Stats {
    std::size_t held = 0;     ///< impostors
    std::size_t bytes = 0;    ///< bytes of the held impostors
    std::size_t waiting = 0;  ///< requested grids that wait for a build or rebuild
    std::uint64_t built = 0;  ///< builds in total, including `rebuilt` ones
    std::uint64_t rebuilt = 0;
    std::uint64_t dropped = 0;  ///< to stay within max_bytes
    /// Number of builds that ran out of memory. The grid is built again on its next request.
    std::uint64_t out_of_memory = 0;
  };
  [[nodiscard]] Stats stats() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
