#include <quoin/grid/voxel_registry.h>

#include <cassert>
#include <functional>

namespace quoin {
namespace {

// Only properties that are cheap to mix: equal properties hash alike, `find_or_add` compares the rest.
std::uint64_t hash_of(const VoxelProperties& p) {
  const std::uint64_t colour = (std::uint64_t{p.colour.r} << 24) | (std::uint64_t{p.colour.g} << 16) |
                               (std::uint64_t{p.colour.b} << 8) | p.colour.a;
  return std::hash<std::string>{}(p.name) * 0x9E37'79B9'7F4A'7C15U + colour * 4 +
         static_cast<std::uint64_t>(p.visibility);
}

}  // namespace

VoxelRegistry::VoxelRegistry() {
  VoxelProperties air;
  air.name = "air";
  air.colour = {0, 0, 0, 0};
  air.visibility = Visibility::Air;
  air.collides = false;
  properties_.push_back(std::move(air));
  visibility_.push_back(Visibility::Air);
}

Result<VoxelType> VoxelRegistry::add(VoxelProperties properties) {
  if (properties.visibility == Visibility::Air) {
    return fail(ErrorCode::InvalidArgument, "type 0 is the only air");
  }
  if (properties_.size() > kMaxVoxelTypes) {
    return fail(ErrorCode::LimitExceeded, "more than 65,535 distinct voxel types");
  }
  const auto type = static_cast<VoxelType>(properties_.size());
  if (properties.visibility == Visibility::Transparent) ++transparent_count_;
  by_hash_.emplace(hash_of(properties), type);
  visibility_.push_back(properties.visibility);
  properties_.push_back(std::move(properties));
  return type;
}

Result<VoxelType> VoxelRegistry::find_or_add(const VoxelProperties& properties) {
  const auto [first, last] = by_hash_.equal_range(hash_of(properties));
  for (auto it = first; it != last; ++it) {
    if (properties_[it->second] == properties) return it->second;
  }
  return add(properties);
}

void VoxelRegistry::replace(VoxelType type, VoxelProperties properties) {
  assert(type != kAir && type < properties_.size() && properties.visibility != Visibility::Air);
  const auto [first, last] = by_hash_.equal_range(hash_of(properties_[type]));
  for (auto it = first; it != last; ++it) {
    if (it->second == type) {
      by_hash_.erase(it);
      break;
    }
  }
  by_hash_.emplace(hash_of(properties), type);
  if (visibility_[type] == Visibility::Transparent) --transparent_count_;
  if (properties.visibility == Visibility::Transparent) ++transparent_count_;
  visibility_[type] = properties.visibility;
  properties_[type] = std::move(properties);
}

}  // namespace quoin
