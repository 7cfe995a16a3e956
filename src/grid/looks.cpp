#include "grid/looks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

std::uint64_t key_of(Rgba8 colour, std::uint32_t material) {
  return std::uint64_t{material} << 32 | std::uint64_t{colour.r} << 24 | std::uint64_t{colour.g} << 16 |
         std::uint64_t{colour.b} << 8 | colour.a;
}

using Channels = std::array<int, 4>;

Channels channels_of(Rgba8 colour) {
  return {colour.r, colour.g, colour.b, colour.a};
}

/// Looks that are merged: a range of a list.
struct Group {
  std::size_t first = 0;
  std::size_t end = 0;
  std::size_t channel = 0;  // in which they differ most
  std::int64_t spread = 0;  // how much, by how many voxels

  bool operator<(const Group& other) const {
    return spread != other.spread ? spread < other.spread : first > other.first;
  }
};

/// Groups of looks; each group becomes one colour (median cut).
class MedianCut {
 public:
  explicit MedianCut(std::span<const Looks::Look> looks) : looks_(looks), order_(looks.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(looks_[a].material, is_opaque(looks_[a])) < std::pair(looks_[b].material, is_opaque(looks_[b]));
    });
    for (std::size_t first = 0; first < order_.size();) {
      std::size_t end = first;
      while (end < order_.size() && belong_together(look(first), look(end))) ++end;
      groups_.push(group_of(first, end));
      first = end;
    }
  }

  [[nodiscard]] std::size_t groups() const { return groups_.size(); }

  /// Splits groups until there are `most`, or no group has two colours.
  void cut(std::size_t most) {
    QUOIN_ASSERT(!groups_.empty(), "at least one look");
    while (groups_.size() < most && groups_.top().spread > 0) {
      const Group group = groups_.top();
      groups_.pop();
      const std::size_t middle = middle_of(group);
      groups_.push(group_of(group.first, middle));
      groups_.push(group_of(middle, group.end));
    }
  }

  /// Gives each look the mean colour of its group. Removes the groups.
  void take_means(std::vector<Rgba8>& colours) {
    QUOIN_ASSERT(colours.size() == looks_.size(), "a colour per look");
    for (; !groups_.empty(); groups_.pop()) {
      const Group& group = groups_.top();
      const Rgba8 colour = mean_of(group);
      for (std::size_t i = group.first; i < group.end; ++i) colours[order_[i]] = colour;
    }
  }

 private:
  static bool is_opaque(const Looks::Look& look) { return look.colour.a == 255; }
  // Transparent and opaque looks are never merged.
  static bool belong_together(const Looks::Look& a, const Looks::Look& b) {
    return a.material == b.material && is_opaque(a) == is_opaque(b);
  }
  [[nodiscard]] const Looks::Look& look(std::size_t place) const { return looks_[order_[place]]; }

  [[nodiscard]] Group group_of(std::size_t first, std::size_t end) const {
    Channels low{255, 255, 255, 255};
    Channels high{};
    std::int64_t voxels = 0;
    for (std::size_t i = first; i < end; ++i) {
      const Channels channels = channels_of(look(i).colour);
      for (std::size_t c = 0; c < channels.size(); ++c) {
        low[c] = std::min(low[c], channels[c]);
        high[c] = std::max(high[c], channels[c]);
      }
      voxels += look(i).voxels;
    }
    Group group{first, end};
    for (std::size_t c = 1; c < low.size(); ++c) {
      if (high[c] - low[c] > high[group.channel] - low[group.channel]) group.channel = c;
    }
    const std::int64_t extent = high[group.channel] - low[group.channel];
    // Large differences count for more than many voxels.
    group.spread =
        extent * extent * (1 + static_cast<std::int64_t>(std::bit_width(static_cast<std::uint64_t>(voxels))));
    return group;
  }

  // Sorts the group, and finds a place between two values next to the middle. Requires: it has two.
  std::size_t middle_of(const Group& group) {
    const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(group.first);
    const auto end = order_.begin() + static_cast<std::ptrdiff_t>(group.end);
    const auto value = [&](std::uint32_t number) { return channels_of(looks_[number].colour)[group.channel]; };
    std::stable_sort(begin, end, [&](std::uint32_t a, std::uint32_t b) { return value(a) < value(b); });
    auto middle = begin + (end - begin) / 2;
    while (middle != end && value(*middle) == value(*(middle - 1))) ++middle;
    if (middle == end) {
      middle = begin + (end - begin) / 2;
      while (value(*middle) == value(*(middle - 1))) --middle;
    }
    QUOIN_ASSERT(middle > begin && middle < end, "looks on both sides");
    return static_cast<std::size_t>(middle - order_.begin());
  }

  [[nodiscard]] Rgba8 mean_of(const Group& group) const {
    std::array<std::uint64_t, 4> sums{};
    std::uint64_t voxels = 0;
    for (std::size_t i = group.first; i < group.end; ++i) {
      const Channels channels = channels_of(look(i).colour);
      for (std::size_t c = 0; c < sums.size(); ++c) sums[c] += static_cast<std::uint64_t>(channels[c]) * look(i).voxels;
      voxels += look(i).voxels;
    }
    QUOIN_ASSERT(voxels != 0, "looks of voxels");
    const auto mean = [&](std::size_t c) { return static_cast<std::uint8_t>((sums[c] + voxels / 2) / voxels); };
    Rgba8 colour{mean(0), mean(1), mean(2), mean(3)};
    // A mean of glass is glass.
    if (!is_opaque(look(group.first))) colour.a = std::min<std::uint8_t>(colour.a, 254);
    return colour;
  }

  std::span<const Looks::Look> looks_;
  std::vector<std::uint32_t> order_;
  std::priority_queue<Group> groups_;
};

}  // namespace

Rgba8 Looks::nearest(Rgba8 colour, std::uint32_t material) const {
  const Channels wanted = channels_of(colour);
  Rgba8 found = colour;
  int least = std::numeric_limits<int>::max();
  for (const Look& look : looks_) {
    if (look.material != material || look.colour.a != colour.a) continue;
    const Channels channels = channels_of(look.colour);
    int distance = 0;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      distance += (channels[i] - wanted[i]) * (channels[i] - wanted[i]);
    }
    if (distance >= least) continue;
    least = distance;
    found = look.colour;
  }
  return found;
}

std::uint32_t Looks::number_of(Rgba8 colour, std::uint32_t material) {
  const auto [known, is_new] =
      numbers_.try_emplace(key_of(colour, material), static_cast<std::uint32_t>(looks_.size()));
  if (is_new) looks_.push_back({colour, material, 0});
  ++looks_[known->second].voxels;
  return known->second;
}

Result<std::vector<Rgba8>> Looks::reduced(std::size_t most) const {
  std::vector<Rgba8> colours;
  colours.reserve(looks_.size());
  for (const Look& look : looks_) colours.push_back(look.colour);
  if (looks_.size() <= most) return colours;
  MedianCut cut(looks_);
  if (cut.groups() > most) {
    return make_error(ErrorCode::LimitExceeded,
                      "too many materials for " + std::to_string(most) + " types: " + std::to_string(cut.groups()));
  }
  cut.cut(most);
  cut.take_means(colours);
  return colours;
}

Result<std::vector<VoxelType>> Looks::add_to(VoxelRegistry& types, std::span<const VoxelProperties> materials,
                                             std::vector<std::string>& warnings, std::size_t most) const {
  const std::size_t first = types.size();
  most = std::min(most, kMaxVoxelTypes + 1 - first);
  const auto colours = reduced(most);
  if (!colours) return colours.error();
  std::unordered_map<std::uint64_t, VoxelType> by_key;
  std::vector<VoxelType> found;
  found.reserve(looks_.size());
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    const auto next = static_cast<VoxelType>(first + by_key.size());
    const auto [known, is_new] = by_key.try_emplace(key_of((*colours)[i], looks_[i].material), next);
    found.push_back(known->second);
    if (!is_new) continue;
    QUOIN_ASSERT(looks_[i].material < materials.size(), "one of the materials");
    VoxelProperties type = materials[looks_[i].material];
    type.colour = (*colours)[i];
    type.visibility = type.colour.a < 255 ? Visibility::Transparent : Visibility::Opaque;
    const auto added = types.add(std::move(type));
    if (!added) return added.error();
    QUOIN_ASSERT(*added == next, "types are numbered as they come");
  }
  if (looks_.size() > most) {
    warnings.push_back("its " + std::to_string(looks_.size()) + " colours were reduced to " +
                       std::to_string(by_key.size()));
  }
  return found;
}

}  // namespace quoin
