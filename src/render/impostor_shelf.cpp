#include "render/impostor_shelf.h"

namespace quoin {

std::vector<const Impostor*> ImpostorShelf::take(const VoxelRegistry& types, std::span<const PlacedGrid* const> placed,
                                                 Threads threads, InstructionSet instructions) {
  const std::lock_guard lock(mutex_);
  struct Missing {
    const PlacedGrid* placed = nullptr;
    Impostor* impostor = nullptr;
  };
  std::vector<Missing> missing;
  std::vector<const Impostor*> all;
  for (const PlacedGrid* each : placed) {
    auto found = impostors_.find(each->grid);
    if (found == impostors_.end() && impostors_.size() < 4096) {
      found = impostors_.try_emplace(each->grid).first;
      missing.push_back({each, &found->second});
    }
    all.push_back(found == impostors_.end() ? nullptr : &found->second);
  }
  parallel_for(missing.size(), threads, [&](std::size_t i) {
    const PlacedGrid& each = *missing[i].placed;
    *missing[i].impostor = Impostor::build(each.grid->grid, types, *each.opaque, instructions);
  });
  return all;
}

}  // namespace quoin
