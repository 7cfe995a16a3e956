// An edit changes light at most (level - 1) voxels around it and around the sky columns that it opens or blocks. This
// box is solved from scratch, with the light around it as boundary. Boxes that touch are merged. If the merged box is
// too large, or mostly not in the boxes, its parts are queued by chunks and solved from the top down (LightQueue).
// A chunk that arrives or leaves is an edit like any other; air in place of air is none.
#include <quoin/core/memory.h>
#include <quoin/render/propagated_light.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "render/light/propagated/chunk_masks.h"
#include "render/light/propagated/light_queue.h"
#include "render/light/propagated/light_solver.h"
#include "render/light/propagated/light_store.h"
#include "render/light/quad_cutter.h"

namespace quoin {
namespace {

using propagated::around_all;
using propagated::ChannelLight;
using propagated::ChunkAround;
using propagated::ChunkLightChange;
using propagated::ChunkMasks;
using propagated::ColumnSet;
using propagated::CoveredSides;
using propagated::fall;
using propagated::has_sides;
using propagated::is_any;
using propagated::kAllChannels;
using propagated::kChannels;
using propagated::kReach;
using propagated::kSky;
using propagated::LightBoxes;
using propagated::LightChunk;
using propagated::LightDomain;
using propagated::LightQueue;
using propagated::LightReader;
using propagated::LightRegion;
using propagated::LightSlab;
using propagated::LightSolver;
using propagated::LightStore;
using propagated::rows_of;
using propagated::type_lights;
using propagated::TypeLight;

constexpr unsigned kBrightest = 15;

// Returns the number of voxels around a region whose types the solver needs: it skips light that does not leave them,
// or not on the side of the region.
int rim_of(const std::vector<TypeLight>& lights) {
  return has_sides(lights) || std::ranges::any_of(lights, &TypeLight::absorbs) ? 1 : 0;
}

// Returns bit c for each channel in which a chunk has lamps.
unsigned lamp_channels(const Chunk& chunk, const std::vector<TypeLight>& lights) {
  unsigned channels = 0;
  for (const VoxelType type : chunk.types()) {
    const unsigned lamp = propagated::light_of(lights, type).lamp;
    for (std::size_t c = 0; c < kChannels; ++c) channels |= static_cast<unsigned>((lamp >> (4 * c) & 15U) != 0) << c;
  }
  return channels;
}

// The masks of a chunk, as far as they were read.
struct CachedMasks {
  ChunkMasks masks;
  IBox read;  // box of the chunk
};

// The light that edits change, and the types' light.
struct LightState {
  const LightStore& store;
  const LightDomain& domain;
  const std::vector<TypeLight>& types;
  const VoxelRegistry* shapes;  // null if no type covers sides
};

// Voxels of one chunk that changed, or a chunk that enters or leaves the domain.
struct LightEdit {
  IBox voxels;                                // in grid coordinates
  std::array<unsigned, kChannels> highest{};  // at least the levels before in and next to the box, and new lamps
  unsigned raised = kAllChannels;             // bit c: levels of channel c may rise
  unsigned lowered = kAllChannels;            // bit c: levels of channel c may fall
  ColumnSet above{};                          // the columns of the box that were open to the sky just above it
  ColumnSet below{};                          // ... and just below it
};

// The light of a chunk: one packed word for all voxels, or slabs.
struct ChunkLevels {
  bool is_held;
  std::uint16_t even;       // if `light` is null
  const LightChunk* light;  // null: `even` everywhere
};

ChunkLevels levels_of(const LightState& state, IVec3 chunk) {
  if (!state.domain.holds(chunk)) return {false, state.domain.beyond(chunk), nullptr};
  return {true, 0, state.store.find(chunk)};
}

// Calls `visit(chunk, part)` for each chunk of a box; `part` is in chunk coordinates.
template <class Visit>
void for_each_chunk(const IBox& voxels, Visit&& visit) {
  const IVec3 first = chunk_of(voxels.min);
  const IVec3 last = chunk_of(voxels.max - 1);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const IVec3 chunk{x, y, z};
        const IVec3 low = chunk * kChunkEdge;
        visit(chunk, intersect({voxels.min - low, voxels.max - low}, kWholeChunk));
      }
    }
  }
}

// Calls `visit(y, z, slab)` for each slab of a part of a chunk until it returns false.
template <class Visit>
void for_each_slab(const ChannelLight& light, const IBox& part, Visit&& visit) {
  for (int z = part.min.z & ~3; z < part.max.z; z += 4) {
    for (int y = part.min.y & ~3; y < part.max.y; y += 4) {
      if (!visit(y, z, light.stored(propagated::slab_index(y, z)))) return;
    }
  }
}

// Returns at least the highest level in a part of a chunk.
unsigned highest_level(const ChannelLight& light, const IBox& part) {
  if (light.is_uniform()) return light.level();
  unsigned highest = 0;
  for_each_slab(light, part, [&](int, int, const LightSlab& slab) {
    highest = std::max(highest, slab.is_uniform() ? slab.level() : kBrightest);
    return highest < kBrightest;
  });
  return highest;
}

void add_levels(unsigned word, std::array<unsigned, kChannels>& highest) {
  for (std::size_t c = 0; c < kChannels; ++c) highest[c] = std::max(highest[c], word >> (4 * c) & 15U);
}

// Reads single voxels.
std::array<unsigned, kChannels> exact_highest(const LightState& state, const Grid& grid, const IBox& voxels) {
  std::array<unsigned, kChannels> highest{};
  LightReader words(state.store, state.domain);
  for (int z = voxels.min.z - 1; z <= voxels.max.z; ++z) {
    for (int y = voxels.min.y - 1; y <= voxels.max.y; ++y) {
      for (int x = voxels.min.x - 1; x <= voxels.max.x; ++x) {
        add_levels(words.at({x, y, z}), highest);
        if (!voxels.contains({x, y, z})) continue;
        const VoxelType type = grid.get(x, y, z);
        if (type < state.types.size()) add_levels(state.types[type].lamp, highest);
      }
    }
  }
  return highest;
}

// Returns upper bounds of the levels in and next to a box of one chunk, with the lamps that it has now.
std::array<unsigned, kChannels> highest_levels(const LightState& state, const Grid& grid, const IBox& voxels) {
  constexpr int kMany = 512;
  const IVec3 size = voxels.size();
  if (size.x * size.y * size.z <= kMany) return exact_highest(state, grid, voxels);
  std::array<unsigned, kChannels> highest{};
  for_each_chunk({voxels.min - 1, voxels.max + 1}, [&](IVec3 chunk, const IBox& part) {
    const ChunkLevels levels = levels_of(state, chunk);
    add_levels(levels.even, highest);
    for (std::size_t c = 0; levels.light != nullptr && c < kChannels; ++c) {
      highest[c] = std::max(highest[c], highest_level(levels.light->channels[c], part));
    }
  });
  if (const Chunk* chunk = grid.find_chunk(chunk_of(voxels.min)); chunk != nullptr) {
    for (const VoxelType type : chunk->types()) {
      if (type < state.types.size()) add_levels(state.types[type].lamp, highest);
    }
  }
  return highest;
}

std::uint64_t bits_of(const IBox& voxels) {
  const int first = voxels.min.x & (kChunkEdge - 1);
  return propagated::kAll >> (kChunkEdge - (voxels.max.x - voxels.min.x)) << first;
}

// Returns the columns of a box that are open to the sky at height y.
ColumnSet open_columns(const LightState& state, const IBox& voxels, int y) {
  ColumnSet open{};
  const IVec3 first{voxels.min.x, y, voxels.min.z};
  const ChunkLevels levels = levels_of(state, chunk_of(first));
  const bool is_even = levels.light == nullptr || levels.light->channels[kSky].is_uniform();
  const unsigned level = levels.light == nullptr ? levels.even & 15U
                         : is_even               ? levels.light->channels[kSky].level()
                                                 : 0;
  if (is_even && level != kBrightest) return open;
  for (int z = voxels.min.z; z < voxels.max.z; ++z) {
    const IVec3 local = local_of({voxels.min.x, y, z});
    std::uint64_t row = bits_of(voxels);
    if (!is_even) {
      for (const std::uint64_t plane : levels.light->channels[kSky].row(local.y, local.z)) row &= plane;
    }
    open[static_cast<std::size_t>(local.z)] = row;
  }
  return open;
}

// Returns the columns of a box through which the sky's light falls out of the row at height y.
ColumnSet falling_columns(const LightState& state, const Grid& grid, const IBox& voxels, int y) {
  ColumnSet open = open_columns(state, voxels, y);
  if (state.shapes == nullptr) return open;
  const IVec3 first{voxels.min.x, y, voxels.min.z};
  const CoveredSides sides(grid, state.shapes, state.types, chunk_of(first));
  for (int z = 0; z < kChunkEdge && !sides.none(); ++z) {
    std::uint64_t& row = open[static_cast<std::size_t>(z)];
    row &= ~sides.covered(local_of(first).y, z, Direction::NegY, row);
  }
  return open;
}

// Returns a box of a chunk around columns, from row `begin` to row `end`.
IBox box_of(const ColumnSet& columns, int begin, int end) {
  std::uint64_t x = 0;
  std::uint64_t z = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    x |= columns[i];
    z |= std::uint64_t{columns[i] != 0} << i;
  }
  QUOIN_ASSERT(x != 0, "some columns");
  return {{std::countr_zero(x), begin, std::countr_zero(z)}, {64 - std::countl_zero(x), end, 64 - std::countl_zero(z)}};
}

// Calls `visit(voxels)` for a box in each chunk below an edit through which sky columns fall, or fell, that the edit
// opens or closes.
template <class Visit>
void follow_columns(const LightState& state, const Grid& grid, const LightEdit& edit, Visit&& visit) {
  IVec3 chunk = chunk_of(edit.voxels.min);
  int top = local_of(edit.voxels.min).y;
  ColumnSet columns = edit.above;
  const auto fall_to = [&](int begin, int end) {
    const CoveredSides sides(grid, state.shapes, state.types, chunk);
    return fall(grid.find_chunk(chunk), state.types, sides, begin, end, columns);
  };
  fall_to(top, top + edit.voxels.size().y);
  for (std::size_t z = 0; z < columns.size(); ++z) columns[z] ^= edit.below[z];
  const LightDomain::Range range = state.domain.range(chunk.x, chunk.z);
  while (range.begin != range.end && is_any(columns)) {
    if (top == 0) {
      --chunk.y;
      top = kChunkEdge;
    }
    if (chunk.y < range.begin) return;
    IBox reached = box_of(columns, 0, top);
    reached.min.y = fall_to(0, top);
    const IVec3 low = chunk * kChunkEdge;
    if (!reached.empty()) visit(IBox{reached.min + low, reached.max + low});
    top = 0;
  }
}

// The directions in which the light of a channel may change around an edit.
struct ChannelReach {
  bool is_raised;
  bool is_lowered;
  IBox closed;  // box of the chunk; beyond it, voxels of level 15 do not get darker
};

// Returns a box around the slabs of a part of a chunk that may change.
IBox changeable(const ChannelLight& light, const IBox& part, const ChannelReach& reach) {
  const auto of_slab = [&](unsigned level, const IBox& slab) {
    if (level == kBrightest) return reach.is_lowered ? intersect(slab, reach.closed) : IBox{};
    return reach.is_raised || (reach.is_lowered && level > 0) ? slab : IBox{};
  };
  if (light.is_uniform()) return of_slab(light.level(), part);
  IBox found;
  for_each_slab(light, part, [&](int y, int z, const LightSlab& slab) {
    const IBox box = intersect({{part.min.x, y, z}, {part.max.x, y + 4, z + 4}}, part);
    const IBox may_change = slab.is_uniform() ? of_slab(slab.level(), box) : box;
    if (!may_change.empty()) found = unite(found, may_change);
    return true;
  });
  return found;
}

// Returns the boxes in which the light of a box and around it may change; an empty box: that channel stays as it is.
// `closed`: box of all sky columns that the edit closes. Beyond it, sky light of level 15 stays, since it falls
// from above and from nowhere else.
LightBoxes reach_of(const LightState& state, const LightEdit& edit, const LightBoxes& around, const IBox& closed) {
  static const ChannelLight dark;
  IBox all;
  for (const IBox& box : around) all = unite(all, box);
  LightBoxes reach;
  if (all.empty()) return reach;
  for_each_chunk(all, [&](IVec3 chunk, const IBox& part) {
    const ChunkLevels levels = levels_of(state, chunk);
    if (!levels.is_held) return;
    const IVec3 low = chunk * kChunkEdge;
    for (std::size_t c = 0; c < kChannels; ++c) {
      const IBox wanted = intersect({around[c].min - low, around[c].max - low}, part);
      if (around[c].empty() || wanted.empty()) continue;
      const ChannelLight& light = levels.light == nullptr ? dark : levels.light->channels[c];
      const IBox of_sky{closed.min - low, closed.max - low};
      const IBox found =
          changeable(light, wanted,
                     {(edit.raised >> c & 1U) != 0, (edit.lowered >> c & 1U) != 0, c == kSky ? of_sky : kWholeChunk});
      if (!found.empty()) reach[c] = unite(reach[c], {found.min + low, found.max + low});
    }
  });
  return reach;
}

void add_if_any(const LightBoxes& boxes, std::vector<LightBoxes>& reached) {
  const bool is_empty = std::all_of(boxes.begin(), boxes.end(), [](const IBox& box) { return box.empty(); });
  if (!is_empty) reached.push_back(boxes);
}

// Returns the edit of a box of one chunk. Requires: `state` has the light and the domain before the edit.
// Cost: O(slabs around the box).
LightEdit edit_of(const LightState& state, const Grid& grid, const IBox& voxels) {
  QUOIN_ASSERT(!voxels.empty() && chunk_of(voxels.min) == chunk_of(voxels.max - 1), "a box of one chunk");
  LightEdit edit;
  edit.voxels = voxels;
  edit.highest = highest_levels(state, grid, voxels);
  edit.above = falling_columns(state, grid, voxels, voxels.max.y);
  edit.below = open_columns(state, voxels, voxels.min.y - 1);
  return edit;
}

// Returns the edit of a chunk that was dark, since it was below the domain, and is in it now. Requires: `state` has
// the domain after the edits.
LightEdit edit_of_entering(const LightState& state, const Grid& grid, IVec3 chunk) {
  QUOIN_ASSERT(state.domain.holds(chunk), "a chunk that enters the domain");
  const IVec3 low = chunk * kChunkEdge;
  LightEdit edit = edit_of(state, grid, {low, low + kChunkEdge});
  edit.below = {};
  edit.lowered = 0;
  return edit;
}

// Returns true if sky light falls into a chunk of air from all columns above it, by the light before the edits.
bool is_below_open_sky(const LightState& state, const Grid& grid, IVec3 chunk) {
  if (grid.find_chunk(chunk) != nullptr) return false;
  const IVec3 low = chunk * kChunkEdge;
  const ColumnSet open = falling_columns(state, grid, {low, low + kChunkEdge}, low.y + kChunkEdge);
  return std::all_of(open.begin(), open.end(), [](std::uint64_t row) { return row == propagated::kAll; });
}

// Returns the edit of a chunk that was dark, as in `edit_of_entering`, and whose sky light is known to be 15 now.
LightEdit edit_of_opened(const LightState& state, const Grid& grid, IVec3 chunk) {
  const IVec3 low = chunk * kChunkEdge;
  LightEdit edit;
  edit.voxels = {low, low + kChunkEdge};
  edit.highest = highest_levels(state, grid, edit.voxels);
  edit.lowered = 0;
  return edit;
}

// Returns the edit of a chunk that was in the domain and is dark now, since it is below it. Requires: the store still
// has its light.
LightEdit edit_of_leaving(const LightState& state, IVec3 chunk) {
  const IVec3 low = chunk * kChunkEdge;
  LightEdit edit;
  edit.voxels = {low, low + kChunkEdge};
  edit.raised = 0;
  const LightChunk* light = state.store.find(chunk);
  for (std::size_t c = 0; light != nullptr && c < kChannels; ++c) {
    edit.highest[c] = highest_level(light->channels[c], kWholeChunk);
  }
  return edit;
}

// Appends the boxes in which light may change because of an edit: around the box, and around each sky column that it
// opens or closes. Skips slabs whose light cannot change: dark ones if light only falls, fully lit ones if it only
// rises. Requires: `grid` and `state.domain` are those after all edits of the update, `state.store` is the light
// before.
// Cost: O(slabs around the boxes + rows of 64 voxels along columns that change, and a step per chunk of air).
void add_reach(const LightState& state, const Grid& grid, const LightEdit& edit, std::vector<LightBoxes>& reached) {
  QUOIN_ASSERT(edit.raised <= kAllChannels && edit.lowered <= kAllChannels, "a bit per channel");
  LightBoxes around;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const int steps = static_cast<int>(edit.highest[c]) - 1;
    if (steps >= 0) around[c] = {edit.voxels.min - steps, edit.voxels.max + steps};
  }
  add_if_any(reach_of(state, edit, around, edit.voxels), reached);
  follow_columns(state, grid, edit, [&](const IBox& columns) {
    LightBoxes of_sky;
    of_sky[kSky] = {columns.min - kReach, columns.max + kReach};
    add_if_any(reach_of(state, edit, of_sky, columns), reached);
  });
}

}  // namespace

struct PropagatedLight::Impl {
  Impl() = default;
  /// Shares all shareable data. Requires: no update is in progress.
  Impl(const Impl& other)
      : options(other.options),
        followed_grid(other.followed_grid),
        followed_types(other.followed_types),
        shared_lights(other.shared_lights),
        rim(other.rim),
        columns(other.columns),
        store(other.store),
        visited_rows(other.visited_rows) {}
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] const std::vector<TypeLight>& lights() const { return *shared_lights; }
  [[nodiscard]] const LightDomain& domain() const { return columns; }
  [[nodiscard]] LightReader reader() const { return {store, domain()}; }
  void follow_types(const VoxelRegistry& types);
  void begin_anew(const Grid& grid);
  void take_over(const Grid& grid, const GridChanges& changes, const DataChanges& data);
  [[nodiscard]] LightState state() const { return {store, domain(), lights(), shapes}; }
  [[nodiscard]] std::map<IVec3, IBox, ByZyx> boxes_with_shapes(const Grid& grid, const GridChanges& changes,
                                                               const DataChanges& data) const;
  [[nodiscard]] std::optional<LightEdit> edit_of(const Grid& grid, IVec3 chunk, const IBox& changed) const;
  void change_domain(const Grid& grid, const std::vector<IVec3>& chunks, BlockVector<LightEdit>& edits);
  void light_entering(const Grid& grid);
  void solve_dirty(const Grid& grid, Threads threads);
  void solve_queue(const Grid& grid, Threads threads);
  void read_masks(const Grid& grid, const std::vector<LightRegion>& regions, Threads threads);
  [[nodiscard]] ChunkAround around(IVec3 chunk) const;
  void look_around(LightRegion& region) const;
  void solve(std::vector<LightRegion>& regions, Threads threads, FunctionRef<void(LightSolver&, LightRegion&)> prepare);

  PropagatedLightOptions options;
  ChangeCursor followed_grid;
  ChangeCursor followed_types;
  const VoxelRegistry* shapes = nullptr;  // during an update: the types, or null if none covers sides
  std::shared_ptr<const std::vector<TypeLight>> shared_lights = std::make_shared<const std::vector<TypeLight>>();
  int rim = 0;  // see rim_of
  LightDomain columns;
  LightStore store;                // of the chunks of the domain
  std::uint64_t visited_rows = 0;  // see PropagatedLight::visited_rows
  std::vector<LightBoxes> dirty;   // boxes that are to be solved by themselves
  LightQueue queue;                // boxes of chunks that are to be solved, from above
  std::vector<IVec3> entering;     // chunks that entered the domain from below it, from below in each column
  std::vector<LightDomain::Change> changed_columns;  // during an update, until the store has recorded them
  std::unordered_map<IVec3, std::unique_ptr<CachedMasks>, CoordinateHash> masks;  // during an update
};

// Unregistered types count as opaque, so new types change light.
void PropagatedLight::Impl::follow_types(const VoxelRegistry& types) {
  PendingChanges changes(followed_types, types);
  if (changes->empty()) return;
  std::vector<TypeLight> now = type_lights(types, options);
  const auto is_reshaped = [&](const TypeChange& change) {
    return change.shape_changed && propagated::light_of(now, change.type).has_sides;
  };
  const bool has_reshaped =
      changes->all ? has_sides(now) : std::ranges::any_of(changes->items_unless_all(), is_reshaped);
  if (has_reshaped || now != lights()) {
    followed_grid = {};
    rim = rim_of(now);
    shared_lights = std::make_shared<const std::vector<TypeLight>>(std::move(now));
  }
  changes.commit();
}

void PropagatedLight::Impl::begin_anew(const Grid& grid) {
  queue.clear();
  dirty.clear();
  masks.clear();
  entering.clear();
  const auto darken = [&](int x, int z, const LightDomain::Range& range) {
    for (int y = range.begin; y < range.end; ++y) store.begin({x, y, z});
  };
  // Also the chunks that leave the domain, and those that left it in an update that failed.
  domain().for_each_range(darken);
  for (const LightDomain::Change& column : changed_columns) darken(column.x, column.z, column.before);
  changed_columns.clear();
  columns = {};
  store.clear();
  std::vector<LightDomain::Change> changed;
  for (const IVec3 chunk : grid.chunks()) columns.set(chunk, true, changed);
  domain().for_each_range(darken);
  domain().for_each_range([&](int x, int z, const LightDomain::Range& range) {
    const IBox column{IVec3(x, range.begin, z) * kChunkEdge, IVec3(x + 1, range.end, z + 1) * kChunkEdge};
    queue.add(column, kAllChannels, domain());
  });
}

// Returns the edit of a chunk that changed. None: the chunk was air and still is, or it was dark (see change_domain).
// Uses the domain before the edit.
std::optional<LightEdit> PropagatedLight::Impl::edit_of(const Grid& grid, IVec3 chunk, const IBox& changed) const {
  const Chunk* const now = grid.find_chunk(chunk);
  const bool had_voxels = domain().has_voxels(chunk);
  if (!had_voxels && (now == nullptr || (!domain().holds(chunk) && domain().beyond(chunk) == 0))) return {};
  const IVec3 low = chunk * kChunkEdge;
  const IBox box = had_voxels ? changed : intersect(changed, now->bounds());
  LightEdit edit = quoin::edit_of(state(), grid, {box.min + low, box.max + low});
  if (!had_voxels) edit.raised = lamp_channels(*now, lights());
  if (now == nullptr) edit.lowered &= ~(1U << kSky);
  return edit;
}

// Handles chunks that came or went, or may have. Chunks that enter the domain or leave it are air, or have an edit of
// their own, unless their light was dark or will be: then this appends an edit.
void PropagatedLight::Impl::change_domain(const Grid& grid, const std::vector<IVec3>& chunks,
                                          BlockVector<LightEdit>& edits) {
  QUOIN_ASSERT(changed_columns.empty(), "no changes that a failed update left");
  for (const IVec3 chunk : chunks) {
    const bool has_voxels = grid.find_chunk(chunk) != nullptr;
    if (has_voxels == domain().has_voxels(chunk)) continue;
    columns.set(chunk, has_voxels, changed_columns);
  }
  std::map<IVec3, LightDomain::Range, ByZyx> before;  // [x, 0, z]
  for (const LightDomain::Change& column : changed_columns) {
    before.try_emplace({column.x, 0, column.z}, column.before);
  }
  for (const auto& each : before) {
    const IVec3 column = each.first;
    const LightDomain::Range old = each.second;
    const LightDomain::Range now = domain().range(column.x, column.z);
    const auto change = [&](int begin, int end, bool is_entering, const LightDomain::Range& other) {
      for (int y = begin; y < end; ++y) {
        const IVec3 chunk{column.x, y, column.z};
        const bool is_dark = other.begin != other.end && y < other.begin;  // before, or now
        if (is_entering) {
          is_dark ? entering.push_back(chunk) : store.open(chunk);
        } else {
          if (is_dark) edits.push_back(edit_of_leaving(state(), chunk));
          store.begin(chunk);
        }
      }
    };
    const auto for_each_only_in = [&](const LightDomain::Range& a, const LightDomain::Range& b, bool is_entering) {
      const bool is_apart = b.begin == b.end;
      change(a.begin, is_apart ? a.end : std::clamp(b.begin, a.begin, a.end), is_entering, b);
      if (!is_apart) change(std::clamp(b.end, a.begin, a.end), a.end, is_entering, b);
    };
    for_each_only_in(old, now, false);
    for_each_only_in(now, old, true);
  }
  changed_columns.clear();
}

// Lights the chunks that entered the domain from below it, where it is dark. Their light only rises, so all other edits
// are solved first, with these chunks dark.
void PropagatedLight::Impl::light_entering(const Grid& grid) {
  // From above, in each column of chunks.
  BlockVector<LightEdit> edits;
  for (auto chunk = entering.rbegin(); chunk != entering.rend(); ++chunk) {
    if (!is_below_open_sky(state(), grid, *chunk)) {
      edits.push_back(edit_of_entering(state(), grid, *chunk));
      continue;
    }
    ChunkLightChange opened;
    opened.chunk = *chunk;
    opened.channels[kSky].is_uniform = true;
    opened.channels[kSky].level = kBrightest;
    opened.record.add_all();
    store.take(std::move(opened));
    edits.push_back(edit_of_opened(state(), grid, *chunk));
  }
  entering.clear();
  for (const LightEdit& edit : edits) add_reach(state(), grid, edit, dirty);
  propagated::sort_boxes(dirty, queue, domain());
}

// Returns the changed boxes of chunks, with the voxels whose shapes may cover other sides than before: those with other
// data, and neighbours of changed voxels.
std::map<IVec3, IBox, ByZyx> PropagatedLight::Impl::boxes_with_shapes(const Grid& grid, const GridChanges& changes,
                                                                      const DataChanges& data) const {
  std::map<IVec3, IBox, ByZyx> boxes;
  const auto add = [&](IVec3 chunk, const IBox& box) {
    const IVec3 low = chunk * kChunkEdge;
    for_each_chunk({box.min + low - 1, box.max + low + 1}, [&](IVec3 other, const IBox& part) {
      if (!CoveredSides(grid, shapes, lights(), other).none()) boxes[other] = unite(boxes[other], part);
    });
  };
  for (const DataChange& change : data.items_unless_all()) add(change.chunk, change.box);
  for (const ChunkChange& change : changes.items_unless_all()) {
    add(change.chunk, change.box);
    boxes[change.chunk] = unite(boxes[change.chunk], change.box);
  }
  return boxes;
}

void PropagatedLight::Impl::take_over(const Grid& grid, const GridChanges& changes, const DataChanges& data) {
  std::vector<IVec3> chunks;
  BlockVector<LightEdit> edits;
  const auto add = [&](IVec3 chunk, const IBox& box) {
    if (std::optional<LightEdit> edit = edit_of(grid, chunk, box)) edits.push_back(*edit);
  };
  for (const ChunkChange& change : changes.items_unless_all()) {
    chunks.push_back(change.chunk);
    store.add_lamps(change.chunk, change.slabs);
    if (shapes == nullptr) add(change.chunk, change.box);
  }
  if (shapes != nullptr) {
    for (const auto& [chunk, box] : boxes_with_shapes(grid, changes, data)) add(chunk, box);
  }
  change_domain(grid, chunks, edits);
  for (const LightEdit& edit : edits) add_reach(state(), grid, edit, dirty);
  propagated::sort_boxes(dirty, queue, domain());
}

ChunkAround PropagatedLight::Impl::around(IVec3 chunk) const {
  ChunkAround found;
  found.is_held = domain().holds(chunk);
  if (!found.is_held) {
    found.is_open = domain().beyond(chunk) != 0;
    return found;
  }
  found.light = store.find(chunk);
  found.unknown = queue.unknown(chunk);
  if (const auto known = masks.find(chunk); known != masks.end()) found.masks = &known->second->masks;
  return found;
}

void PropagatedLight::Impl::look_around(LightRegion& region) const {
  region.chunks = {chunk_of(region.all.voxels.min - 1), chunk_of(region.all.voxels.max) + 1};
  region.around.clear();
  for (int z = region.chunks.min.z; z < region.chunks.max.z; ++z) {
    for (int y = region.chunks.min.y; y < region.chunks.max.y; ++y) {
      for (int x = region.chunks.min.x; x < region.chunks.max.x; ++x) region.around.push_back(around({x, y, z}));
    }
  }
}

void PropagatedLight::Impl::solve(std::vector<LightRegion>& regions, Threads threads,
                                  FunctionRef<void(LightSolver&, LightRegion&)> prepare) {
  std::vector<std::vector<ChunkLightChange>> changes(regions.size());
  for (const LightRegion& region : regions) visited_rows += rows_of(region.all.voxels);
  parallel_for(regions.size(), threads, [&](std::size_t i) {
    thread_local LightSolver solver;
    look_around(regions[i]);
    prepare(solver, regions[i]);
    solver.solve(regions[i], changes[i]);
  });
  for (std::vector<ChunkLightChange>& of_region : changes) {
    for (ChunkLightChange& change : of_region) {
      if (!change.empty()) store.take(std::move(change));
    }
  }
}

// Solves each box as a whole.
void PropagatedLight::Impl::solve_dirty(const Grid& grid, Threads threads) {
  std::vector<LightRegion> regions;
  for (const LightBoxes& each : dirty) {
    const IBox all = around_all(each);
    LightRegion& region = regions.emplace_back();
    region.all = {LightSolver::widened({all, all}), all};
    for (std::size_t c = 0; c < kChannels; ++c) {
      if (each[c].empty()) continue;
      region.channels[c] = {intersect(LightSolver::widened({each[c], each[c]}), region.all.voxels), each[c]};
    }
  }
  solve(regions, threads, [&](LightSolver& solver, LightRegion& region) {
    // These boxes touch no queued part. But the queue's box of a chunk is the box around its parts, with known light.
    for (ChunkAround& each : region.around) each.unknown = {};
    std::size_t i = 0;
    const IBox voxels{region.all.voxels.min - rim, region.all.voxels.max + rim};
    const IBox chunks{chunk_of(voxels.min), chunk_of(voxels.max - 1) + 1};
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const IVec3 chunk{x, y, z};
          const IVec3 low = chunk * kChunkEdge;
          ChunkAround& around = region.at(chunk);
          if (!around.is_held) continue;
          ChunkMasks& read = solver.own_masks(i++);
          around.masks = &read;
          read.read(grid.find_chunk(chunk), lights(), CoveredSides(grid, shapes, lights(), chunk),
                    intersect({voxels.min - low, voxels.max - low}, kWholeChunk),
                    around.light == nullptr ? propagated::all_slabs() : around.light->lamp_slabs);
        }
      }
    }
  });
  dirty.clear();
}

// Reads the masks of the regions' chunks, as far as they are visited and not cached.
void PropagatedLight::Impl::read_masks(const Grid& grid, const std::vector<LightRegion>& regions, Threads threads) {
  std::map<IVec3, IBox, ByZyx> wanted;
  for (const LightRegion& region : regions) {
    const IBox voxels{region.all.voxels.min - rim, region.all.voxels.max + rim};
    const IBox chunks{chunk_of(voxels.min), chunk_of(voxels.max - 1) + 1};
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const IVec3 low = IVec3(x, y, z) * kChunkEdge;
          if (!domain().holds({x, y, z})) continue;
          IBox& box = wanted[{x, y, z}];
          box = unite(box, intersect({voxels.min - low, voxels.max - low}, kWholeChunk));
          box.min.x = 0;  // rows are read as a whole
          box.max.x = kChunkEdge;
        }
      }
    }
  }
  std::vector<std::pair<IVec3, CachedMasks*>> missing;
  for (const auto& [chunk, box] : wanted) {
    std::unique_ptr<CachedMasks>& known = masks[chunk];
    if (known == nullptr) known = std::make_unique<CachedMasks>();
    if (unite(known->read, box) == known->read) continue;
    // All that later regions want of this chunk, so that it is read once.
    known->read = unite(unite(known->read, box), queue.unknown(chunk));
    missing.emplace_back(chunk, known.get());
  }
  parallel_for(missing.size(), threads, [&](std::size_t i) {
    const auto& [chunk, known] = missing[i];
    const LightChunk* light = store.find(chunk);
    known->masks.read(grid.find_chunk(chunk), lights(), CoveredSides(grid, shapes, lights(), chunk), known->read,
                      light == nullptr ? propagated::all_slabs() : light->lamp_slabs);
  });
}

void PropagatedLight::Impl::solve_queue(const Grid& grid, Threads threads) {
  constexpr std::size_t kMaskLimit = 1024;                // chunks with cached masks: 32 MB
  const std::size_t batch = threads.count == 1 ? 1 : 64;  // regions at a time
  while (!queue.empty()) {
    std::vector<LightRegion> regions = queue.next(batch);
    if (masks.size() > kMaskLimit) masks.clear();
    read_masks(grid, regions, threads);
    solve(regions, threads, [](LightSolver&, LightRegion&) {});
    queue.remove_solved();
  }
  masks.clear();
}

PropagatedLight::PropagatedLight(PropagatedLightOptions options) : impl_(std::make_unique<Impl>()) {
  impl_of(impl_).options = std::move(options);
}
PropagatedLight::PropagatedLight(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PropagatedLight::PropagatedLight(PropagatedLight&&) noexcept = default;
PropagatedLight& PropagatedLight::operator=(PropagatedLight&&) noexcept = default;
PropagatedLight::~PropagatedLight() = default;

void PropagatedLight::update(const Grid& grid, const VoxelRegistry& types, Threads threads) {
  Impl& me = impl_of(impl_);
  me.follow_types(types);
  me.shapes = has_sides(me.lights()) ? &types : nullptr;
  ChangeCursor followed_data = me.followed_grid;
  PendingChanges changes(me.followed_grid, grid);
  DataChanges data;
  if (me.shapes != nullptr) data = grid.data_changes_since(followed_data);
  if (!data.empty()) me.followed_grid = {};  // until `commit`
  changes->all || data.all ? me.begin_anew(grid) : me.take_over(grid, *changes, data);
  me.solve_dirty(grid, threads);
  me.solve_queue(grid, threads);
  if (!me.entering.empty()) {
    me.light_entering(grid);
    me.solve_dirty(grid, threads);
    me.solve_queue(grid, threads);
  }
  QUOIN_ASSERT(me.dirty.empty() && me.queue.empty(), "no light is left to be solved");
  changes.commit();
}

PropagatedLight PropagatedLight::snapshot() const {
  return PropagatedLight(std::make_unique<Impl>(impl_of(impl_)));
}

LightLevels PropagatedLight::at(IVec3 voxel) const {
  return unpacked_light(impl_of(impl_).reader().at(voxel));
}

void PropagatedLight::read_row(IVec3 voxel, std::span<std::uint16_t, kChunkEdge> out) const {
  impl_of(impl_).reader().read_row(voxel, out);
}

GridChanges PropagatedLight::changes_since(ChangeCursor& cursor) const {
  return impl_of(impl_).store.changes_since(cursor);
}

namespace {

// The light in front of a quad's faces: [u + width * v].
struct QuadLight {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> words;

  [[nodiscard]] std::uint16_t at(int u, int v) const {
    QUOIN_ASSERT(u >= 0 && u < width && v >= 0 && v < height, "a face of the quad");
    return words[static_cast<std::size_t>(u + width * v)];
  }
  [[nodiscard]] bool is_uniform() const {
    return std::all_of(words.begin(), words.end(), [&](std::uint16_t word) { return word == words.front(); });
  }
};

// A rectangle of constant light.
struct LightPiece {
  const QuadLight& light;
  std::uint16_t word;
  static constexpr bool goes_along_u = true;
  static constexpr bool goes_along_v = true;

  [[nodiscard]] bool joins(int u, int v) const { return light.at(u, v) == word; }
};

// The light in a chunk and one voxel around it. Rows are unpacked on demand: there are several faces per row.
class ChunkWords {
 public:
  void begin(const LightReader& reader, IVec3 chunk) {
    reader_.emplace(reader);
    low_ = chunk * kChunkEdge;
    words_.resize(kRows * kChunkEdge);
    is_read_.assign(kRows, false);
  }
  /// In the chunk's coordinates, -1 to 64.
  [[nodiscard]] std::uint16_t at(IVec3 voxel) {
    if (voxel.x < 0 || voxel.x >= kChunkEdge) return reader_->at(low_ + voxel);
    const auto row = static_cast<std::size_t>((voxel.y + 1) + kStride * (voxel.z + 1));
    QUOIN_ASSERT(row < kRows, "a row of the chunk or next to it");
    std::uint16_t* words = words_.data() + row * kChunkEdge;
    if (!is_read_[row]) {
      is_read_[row] = true;
      reader_->read_row(low_ + IVec3(0, voxel.y, voxel.z), std::span<std::uint16_t, kChunkEdge>(words, kChunkEdge));
    }
    return words[voxel.x];
  }

 private:
  static constexpr int kStride = kChunkEdge + 2;
  static constexpr std::size_t kRows = std::size_t{kStride} * kStride;
  std::optional<LightReader> reader_;
  IVec3 low_{0};
  BlockVector<std::uint16_t> words_;   // [z + 1][y + 1][x]
  BlockVector<std::uint8_t> is_read_;  // [z + 1][y + 1]
};

/// See PropagatedLight::split.
void split_quads(const LightReader& reader, const QuadBuffer& quads, IVec3 chunk, QuadBuffer& out,
                 std::vector<std::uint16_t>& light) {
  out.clear();
  light.clear();
  thread_local ChunkWords words;
  words.begin(reader, chunk);
  QuadLight of_quad;
  QuadCutter cutter;
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    const IVec3 first = quad.voxel() + normal_of(quad.direction());
    if (quad.size_u() == 1 && quad.size_v() == 1) {
      out.push_back(quad);
      light.push_back(words.at(first));
      continue;
    }
    of_quad.width = quad.size_u();
    of_quad.height = quad.size_v();
    of_quad.words.clear();
    for (int v = 0; v < quad.size_v(); ++v) {
      for (int u = 0; u < quad.size_u(); ++u) {
        IVec3 at = first;
        at[frame.u] += u;
        at[frame.v] += v;
        of_quad.words.push_back(words.at(at));
      }
    }
    if (of_quad.is_uniform()) {
      out.push_back(quad);
      light.push_back(of_quad.words.front());
      continue;
    }
    const auto start = [&](int u, int v) { return LightPiece{of_quad, of_quad.at(u, v)}; };
    cutter.cut(of_quad.width, of_quad.height, start, [&](int u, int v, int along_u, int along_v) {
      out.push_back(quad_part(quad, u, v, along_u, along_v));
      light.push_back(of_quad.at(u, v));
    });
  }
  QUOIN_ASSERT(light.size() == out.size(), "one light per quad");
}

}  // namespace

void PropagatedLight::split(const QuadBuffer& quads, IVec3 chunk, QuadBuffer& out,
                            std::vector<std::uint16_t>& light) const {
  split_quads(impl_of(impl_).reader(), quads, chunk, out, light);
}

std::uint64_t PropagatedLight::visited_rows() const {
  return impl_of(impl_).visited_rows;
}

std::size_t PropagatedLight::bytes() const {
  return impl_of(impl_).store.bytes() + impl_of(impl_).lights().capacity() * sizeof(TypeLight);
}

}  // namespace quoin
