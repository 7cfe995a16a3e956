#include "grid/colour_table.h"

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

/// Entries that are merged: a range of a list.
struct Group {
  std::size_t first = 0;
  std::size_t end = 0;
  std::size_t channel = 0;  // in which they differ most
  std::int64_t spread = 0;  // how much, by how many voxels

  bool operator<(const Group& other) const {
    return spread != other.spread ? spread < other.spread : first > other.first;
  }
};

/// Groups of entries; each group becomes one colour (median cut).
class MedianCut {
 public:
  explicit MedianCut(std::span<const ColourTable::Entry> entries) : entries_(entries), order_(entries.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(entries_[a].material, is_opaque(entries_[a])) <
             std::pair(entries_[b].material, is_opaque(entries_[b]));
    });
    for (std::size_t first = 0; first < order_.size();) {
      std::size_t end = first;
      while (end < order_.size() && belong_together(entry(first), entry(end))) ++end;
      groups_.push(group_of(first, end));
      first = end;
    }
  }

  [[nodiscard]] std::size_t groups() const { return groups_.size(); }

  /// Splits groups until there are `most`, or no group has two colours.
  void cut(std::size_t most) {
    QUOIN_ASSERT(!groups_.empty(), "at least one entry");
    while (groups_.size() < most && groups_.top().spread > 0) {
      const Group group = groups_.top();
      groups_.pop();
      const std::size_t middle = middle_of(group);
      groups_.push(group_of(group.first, middle));
      groups_.push(group_of(middle, group.end));
    }
  }

  /// Gives each entry the mean colour of its group. Removes the groups.
  void take_means(std::vector<Rgba8>& colours) {
    QUOIN_ASSERT(colours.size() == entries_.size(), "a colour per entry");
    for (; !groups_.empty(); groups_.pop()) {
      const Group& group = groups_.top();
      const Rgba8 colour = mean_of(group);
      for (std::size_t i = group.first; i < group.end; ++i) colours[order_[i]] = colour;
    }
  }

 private:
  static bool is_opaque(const ColourTable::Entry& entry) { return entry.colour.a == 255; }
  // Transparent and opaque entries are never merged.
  static bool belong_together(const ColourTable::Entry& a, const ColourTable::Entry& b) {
    return a.material == b.material && is_opaque(a) == is_opaque(b);
  }
  [[nodiscard]] const ColourTable::Entry& entry(std::size_t position) const { return entries_[order_[position]]; }

  [[nodiscard]] Group group_of(std::size_t first, std::size_t end) const {
    Channels low{255, 255, 255, 255};
    Channels high{};
    std::int64_t voxels = 0;
    for (std::size_t i = first; i < end; ++i) {
      const Channels channels = channels_of(entry(i).colour);
      for (std::size_t c = 0; c < channels.size(); ++c) {
        low[c] = std::min(low[c], channels[c]);
        high[c] = std::max(high[c], channels[c]);
      }
      voxels += entry(i).voxels;
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
    const auto value = [&](std::uint32_t number) { return channels_of(entries_[number].colour)[group.channel]; };
    std::stable_sort(begin, end, [&](std::uint32_t a, std::uint32_t b) { return value(a) < value(b); });
    auto middle = begin + (end - begin) / 2;
    while (middle != end && value(*middle) == value(*(middle - 1))) ++middle;
    if (middle == end) {
      middle = begin + (end - begin) / 2;
      while (value(*middle) == value(*(middle - 1))) --middle;
    }
    QUOIN_ASSERT(middle > begin && middle < end, "entries on both sides");
    return static_cast<std::size_t>(middle - order_.begin());
  }

  [[nodiscard]] Rgba8 mean_of(const Group& group) const {
    std::array<std::uint64_t, 4> sums{};
    std::uint64_t voxels = 0;
    for (std::size_t i = group.first; i < group.end; ++i) {
      const Channels channels = channels_of(entry(i).colour);
      for (std::size_t c = 0; c < sums.size(); ++c)
        sums[c] += static_cast<std::uint64_t>(channels[c]) * entry(i).voxels;
      voxels += entry(i).voxels;
    }
    QUOIN_ASSERT(voxels != 0, "entries of voxels");
    const auto mean = [&](std::size_t c) { return static_cast<std::uint8_t>((sums[c] + voxels / 2) / voxels); };
    Rgba8 colour{mean(0), mean(1), mean(2), mean(3)};
    // A mean of glass is glass.
    if (!is_opaque(entry(group.first))) colour.a = std::min<std::uint8_t>(colour.a, 254);
    return colour;
  }

  std::span<const ColourTable::Entry> entries_;
  std::vector<std::uint32_t> order_;
  std::priority_queue<Group> groups_;
};

}  // namespace

Rgba8 ColourTable::nearest(Rgba8 colour, std::uint32_t material) const {
  const Channels wanted = channels_of(colour);
  Rgba8 found = colour;
  int least = std::numeric_limits<int>::max();
  for (const Entry& entry : entries_) {
    if (entry.material != material || entry.colour.a != colour.a) continue;
    const Channels channels = channels_of(entry.colour);
    int distance = 0;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      distance += (channels[i] - wanted[i]) * (channels[i] - wanted[i]);
    }
    if (distance >= least) continue;
    least = distance;
    found = entry.colour;
  }
  return found;
}

std::uint32_t ColourTable::index_of(Rgba8 colour, std::uint32_t material) {
  const auto [known, is_new] =
      indices_.try_emplace(key_of(colour, material), static_cast<std::uint32_t>(entries_.size()));
  if (is_new) entries_.push_back({colour, material, 0});
  ++entries_[known->second].voxels;
  return known->second;
}

Result<std::vector<Rgba8>> ColourTable::reduced(std::size_t most) const {
  std::vector<Rgba8> colours;
  colours.reserve(entries_.size());
  for (const Entry& entry : entries_) colours.push_back(entry.colour);
  if (entries_.size() <= most) return colours;
  MedianCut cut(entries_);
  if (cut.groups() > most) {
    return make_error(ErrorCode::LimitExceeded,
                      "too many materials for " + std::to_string(most) + " types: " + std::to_string(cut.groups()));
  }
  cut.cut(most);
  cut.take_means(colours);
  return colours;
}

Result<std::vector<VoxelType>> ColourTable::add_to(VoxelRegistry& types, std::span<const VoxelProperties> materials,
                                                   std::vector<std::string>& warnings, std::size_t most) const {
  const std::size_t first = types.size();
  most = std::min(most, kMaxVoxelTypes + 1 - first);
  const auto colours = reduced(most);
  if (!colours) return colours.error();
  std::unordered_map<std::uint64_t, VoxelType> by_key;
  std::vector<VoxelType> found;
  found.reserve(entries_.size());
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const auto next = static_cast<VoxelType>(first + by_key.size());
    const auto [known, is_new] = by_key.try_emplace(key_of((*colours)[i], entries_[i].material), next);
    found.push_back(known->second);
    if (!is_new) continue;
    QUOIN_ASSERT(entries_[i].material < materials.size(), "one of the materials");
    VoxelProperties type = materials[entries_[i].material];
    type.colour = (*colours)[i];
    type.visibility = type.colour.a < 255 ? Visibility::Transparent : Visibility::Opaque;
    const auto added = types.add(std::move(type));
    if (!added) return added.error();
    QUOIN_ASSERT(*added == next, "types are numbered as they come");
  }
  if (entries_.size() > most) {
    warnings.push_back("its " + std::to_string(entries_.size()) + " colours were reduced to " +
                       std::to_string(by_key.size()));
  }
  return found;
}

}  // namespace quoin
