#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/render/impostor.h>

namespace quoin {

/// The impostors of a scene that does not change, taken when first asked for.
class ImpostorShelf {
 public:
  /// No more impostors than fit are taken; grids beyond them have none.
  static constexpr std::size_t kMostBytes = std::size_t{1} << 30;

  /// Of each of `placed`, which holds whole grids; null where there was no room. They live as long as this.
  /// Threads: any number may call at once; impostors are taken on `threads`.
  [[nodiscard]] std::vector<const Impostor*> take(const VoxelRegistry& types, std::span<const PlacedGrid* const> placed,
                                                  Threads threads, InstructionSet instructions);

 private:
  std::mutex mutex_;
  std::map<const SceneGrid*, Impostor> impostors_;
};

}  // namespace quoin
