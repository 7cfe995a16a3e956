#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/impostor.h>
#include <quoin/scene/scene.h>

namespace quoin {

struct ImpostorCacheOptions {
  std::size_t max_bytes = std::size_t{1} << 30;  ///< of the impostors that are held
  Threads workers{};                             ///< unlike elsewhere 0 means one less than the machine has, at least 1
};

/// Impostors of a scene's grids, built by worker threads when they are first asked for, and again after edits.
///
///   const std::shared_ptr<const Impostor> impostor = cache.find(scene, instance.grid);  // null: trace it this time
///   ...
///   cache.wait(scene, 0.0);  // once a frame, at its end
///
/// Workers read snapshots of the grids, so edits never wait for them. After an edit only what it can have changed is
/// looked at again (Impostor::rebuilt), and the old impostor is returned until the new one is ready; that of a grid
/// which another replaced, or of another scene's, is not. When there is no room, the ones that were asked for longest
/// ago are dropped. What is asked for within one round, up to the end of a `wait`, is never dropped for something else
/// of that round, which then has none.
///
/// Lifetime: shares impostors with whoever was given one; the scene is only read within calls.
/// Threads:  any number may call at once, as long as nobody edits the scene meanwhile.
class ImpostorCache {
 public:
  explicit ImpostorCache(const ImpostorCacheOptions& options = {});
  ImpostorCache(ImpostorCache&&) noexcept;
  ImpostorCache& operator=(ImpostorCache&&) noexcept;
  /// Waits for what is being built; the rest is given up.
  ~ImpostorCache();

  /// The newest impostor that is ready; null when there is none or the handle names nothing. Marks it as used, and has
  /// it built when it is missing, older than the grid, or was asked for with other options.
  ///
  /// Cost:   O(log grids), and a snapshot of the grid where it has to be built.
  /// Errors: std::system_error where the workers cannot be started.
  [[nodiscard]] std::shared_ptr<const Impostor> find(const Scene& scene, GridHandle grid,
                                                     const ImpostorOptions& options = {});

  /// Ends a round: returns once all that was asked for is ready or so many seconds have passed, and forgets grids that
  /// are gone. Without a limit of time the calling thread builds as well. Returns how many still wait.
  std::size_t wait(const Scene& scene, double seconds = std::numeric_limits<double>::infinity());

  /// Has impostors built anew where types became transparent or opaque since they were; `find` does it as well.
  /// Cost: O(types that changed).
  void update_types(const VoxelRegistry& types);

  struct Stats {
    std::size_t held = 0;     ///< impostors
    std::size_t bytes = 0;    ///< of these
    std::size_t waiting = 0;  ///< grids that were asked for and are yet to be built, or built anew
    std::uint64_t built = 0;  ///< in all, of which `rebuilt` from the one before
    std::uint64_t rebuilt = 0;
    std::uint64_t dropped = 0;        ///< for want of room
    std::uint64_t out_of_memory = 0;  ///< times a build's memory ran out; the grid is built when it is asked for again
  };
  [[nodiscard]] Stats stats() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
