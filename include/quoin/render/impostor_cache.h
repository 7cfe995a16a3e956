#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/render/impostor.h>
#include <quoin/scene/scene.h>

namespace quoin {

struct ImpostorCacheOptions {
  std::size_t max_bytes = std::size_t{1} << 30;  ///< of the impostors that are held
};

struct ImpostorCacheStats {
  std::size_t held = 0;     ///< impostors
  std::size_t bytes = 0;    ///< of these
  std::size_t waiting = 0;  ///< grids that were asked for and are yet to be built, or built anew
  std::uint64_t built = 0;
  std::uint64_t dropped = 0;  ///< for want of room
};

/// Impostors of a scene's grids, built when they are first asked for, some at a time, off the frame's critical path.
///
///   const std::shared_ptr<const Impostor> impostor = cache.find(scene, instance.grid);  // null: trace it this time
///   ...
///   cache.build_some(scene, 0.002);  // once a frame
///
/// An edit of a grid, or another in its place, asks for a new impostor; the old one is returned until that is ready.
/// When there is no room, the ones that were asked for longest ago are dropped. What is asked for within one round, up
/// to the end of a `build_some`, is never dropped for something else of that round, which then has none.
///
/// Lifetime: shares impostors with whoever was given one; the scene is only read within calls.
/// Threads:  any number may call `find`, `stats` and `build_some` at once, as long as nobody edits the scene meanwhile.
///           One that finds nothing waiting does not wait for what others are building.
class ImpostorCache {
 public:
  explicit ImpostorCache(const ImpostorCacheOptions& options = {});
  ImpostorCache(ImpostorCache&&) noexcept;
  ImpostorCache& operator=(ImpostorCache&&) noexcept;
  ~ImpostorCache();

  /// The newest impostor that is ready; null when there is none or the handle names nothing. Marks it as used, and has
  /// it built when it is missing or older than the grid. Cost: O(log grids).
  [[nodiscard]] std::shared_ptr<const Impostor> find(const Scene& scene, GridHandle grid);

  /// Builds what is waiting, in the order in which it was asked for, until that many seconds have passed; at least one,
  /// so that it comes to an end. Returns how many still wait. Grids that are gone are forgotten.
  /// Cost: the time of one impostor beyond the budget, times one for each thread at most.
  std::size_t build_some(const Scene& scene, double budget_seconds, Threads threads = {1});

  /// Has impostors built anew where types became transparent or opaque since they were; `build_some` does it as well.
  /// Cost: O(types that changed).
  void update_types(const VoxelRegistry& types);

  [[nodiscard]] ImpostorCacheStats stats() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
