#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/render/impostor.h>
#include <quoin/render/impostor_cache.h>

namespace quoin {

/// An instance drawn as its grid's impostor. Lifetime: the impostor must outlive it.
struct FarInstance {
  InstanceHandle instance;
  const Impostor* impostor = nullptr;
};

/// The far instances of one image that have impostors.
struct FarImpostors {
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  ///< of all grids; grids beyond the limit have none

  std::vector<FarInstance> instances;
  std::map<GridHandle, std::shared_ptr<const Impostor>> kept;  ///< owns the impostors above
};

/// Requests impostors for the Far instances in `selected`, and takes the ready ones after `seconds`.
///
/// Without a time limit only the scene determines which instances have an impostor. Grids are taken in the order of the
/// instances.
[[nodiscard]] FarImpostors take_impostors(ImpostorCache& cache, const Scene& scene,
                                          std::span<const SelectedInstance> selected, double seconds,
                                          const ImpostorOptions& options);

}  // namespace quoin
