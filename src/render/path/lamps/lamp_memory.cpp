#include "render/path/lamps/lamp_memory.h"

#include <algorithm>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>

namespace quoin::path {
namespace {

constexpr int kPlaceShift = 3;
// The prior assumes that all lamps are visible: it weighs like this many samples of mean light.
constexpr float kBelief = 0.5F;
constexpr float kLeastShare = 0.05F;

}  // namespace

LampMemory::LampMemory()
    : places_(1), tables_(LightTree::kTopNodes, 1.0F), lights_(LightTree::kTopNodes), slots_(2 * kMostPlaces) {}

std::int32_t LampMemory::place_of(std::int32_t of, IVec3 voxel, Direction side) {
  const IVec3 block = voxel >> kPlaceShift;
  std::uint32_t hash = mix_bits(static_cast<std::uint32_t>(of) * 8U + static_cast<std::uint32_t>(side));
  for (const int coordinate : {block.x, block.y, block.z}) {
    hash = mix_bits(hash ^ static_cast<std::uint32_t>(coordinate));
  }
  std::size_t slot = hash & (slots_.size() - 1);
  for (; slots_[slot] > 0; slot = (slot + 1) & (slots_.size() - 1)) {
    const Place& place = places_[static_cast<std::size_t>(slots_[slot])];
    if (place.block == block && place.of == of && place.side == side) return slots_[slot];
  }
  if (places_.size() == kMostPlaces) return 0;
  slots_[slot] = static_cast<std::int32_t>(places_.size());
  Place& place = places_.emplace_back();
  place.of = of;
  place.block = block;
  place.side = side;
  tables_.resize(places_.size() * LightTree::kTopNodes, 1.0F);
  lights_.resize(tables_.size());
  return slots_[slot];
}

void LampMemory::note(const LightTree& tree, std::int32_t place, std::int32_t lamp, float light, bool is_blocked) {
  if (place == 0 || !(light < 1e30F)) return;
  const auto at = static_cast<std::size_t>(place);
  QUOIN_ASSERT(place > 0 && at < places_.size(), "a place that was returned");
  places_[at].is_new = true;
  places_[at].samples += 1.0F;
  Light* const lights = lights_.data() + at * LightTree::kTopNodes;
  tree.for_each_top_node(static_cast<std::uint32_t>(lamp), [&](std::size_t node) {
    lights[node].sent += light;
    if (!is_blocked) lights[node].arrived += light;
  });
}

void LampMemory::learn() {
  for (std::size_t at = 1; at < places_.size(); ++at) {
    Place& place = places_[at];
    if (!place.is_new) continue;
    place.is_new = false;
    const Light* const lights = lights_.data() + at * LightTree::kTopNodes;
    float* const table = tables_.data() + at * LightTree::kTopNodes;
    const float belief = kBelief * lights[0].sent / place.samples;
    if (!(belief > 1e-30F)) continue;
    for (std::size_t node = 0; node < LightTree::kTopNodes; ++node) {
      const float share = (lights[node].arrived + belief) / (lights[node].sent + belief);
      table[node] = std::max(share, kLeastShare);
    }
  }
}

}  // namespace quoin::path
