#include "store/scene/world_memory.h"

#include <algorithm>
#include <cstddef>

namespace quoin {

std::optional<std::uint64_t> memory_of_world(const WorldStore& world) {
  constexpr std::size_t kSamples = 64;
  const auto grids = world.grids();
  if (!grids) return std::nullopt;
  double total = 0.0;
  for (const auto& [number, grid] : *grids) {
    const auto places = world.chunks(number, 0);
    if (!places) return std::nullopt;
    double bytes = 0.0;
    std::size_t read = 0;
    const std::size_t step = std::max<std::size_t>(places->size() / kSamples, 1);
    for (std::size_t i = 0; i < places->size(); i += step) {
      const auto chunk = world.load_chunk({number, 0, (*places)[i]});
      if (!chunk || !*chunk) continue;
      ++read;
      bytes += static_cast<double>((*chunk)->voxels.bytes());
      if ((*chunk)->densities) bytes += static_cast<double>((*chunk)->densities->bytes());
    }
    if (read != 0) total += bytes / static_cast<double>(read) * static_cast<double>(places->size());
  }
  return static_cast<std::uint64_t>(total);
}

}  // namespace quoin
