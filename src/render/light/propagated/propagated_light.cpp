// An edit changes light at most (level - 1) voxels around it and around the sky columns that it opens or blocks. This
// box is solved from scratch, with the light around it as boundary. Boxes that touch are merged. If the merged box is
// too large, whole chunks are solved in layers from the top down. Each region includes the surroundings within
// the range of light, so that no chunk is solved twice.
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
#include <quoin/core/ref.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "render/light/propagated/chunk_masks.h"
#include "render/light/propagated/light_solver.h"
#include "render/light/propagated/light_store.h"
#include "render/light/quad_cutter.h"

namespace quoin {
namespace {

using propagated::ChunkAround;
using propagated::ChunkLightChange;
using propagated::ChunkMasks;
using propagated::kChannels;
using propagated::kReach;
using propagated::kSky;
using propagated::lamp_levels;
using propagated::LightDomain;
using propagated::LightReader;
using propagated::LightRegion;
using propagated::LightSolver;
using propagated::LightStore;
using propagated::TypeLight;

constexpr unsigned kBrightest = 15;

std::vector<TypeLight> type_lights(const VoxelRegistry& types, const PropagatedLightOptions& options) {
  std::vector<TypeLight> lights(types.size());
  for (std::size_t i = 1; i < lights.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    const VoxelProperties& properties = types[type];
    LightLevels lamp = options.lamp ? options.lamp(type, properties) : lamp_levels(properties);
    lamp.sky = 0;
    for (std::uint8_t* level : {&lamp.red, &lamp.green, &lamp.blue}) {
      *level = static_cast<std::uint8_t>(std::min<unsigned>(*level, kBrightest));
    }
    lights[i].lamp = packed(lamp);
    if (types.is_opaque(type)) {
      lights[i].passes = 0;
    } else {
      const Rgba8 colour = properties.colour;
      const int half = (std::max({colour.r, colour.g, colour.b}) + 1) / 2;
      lights[i].passes =
          static_cast<std::uint8_t>(1 | (colour.r >= half) << 1 | (colour.g >= half) << 2 | (colour.b >= half) << 3);
    }
  }
  return lights;
}

// Bit c is set if any type emits light in channel c.
unsigned lamp_channels(const std::vector<TypeLight>& lights) {
  unsigned channels = 0;
  for (const TypeLight& light : lights) {
    for (std::size_t c = 0; c < kChannels; ++c)
      channels |= static_cast<unsigned>((light.lamp >> (4 * c) & 15U) != 0) << c;
  }
  return channels;
}

// Snapshots have it in common until chunks come or go.
struct SharedDomain : RefCounted {
  LightDomain columns;
};

IBox around_all(const std::array<IBox, kChannels>& boxes) {
  IBox all;
  for (const IBox& box : boxes) all = unite(all, box);
  return all;
}

IBox grown(const IBox& box, int by) {
  QUOIN_ASSERT(by >= 0, "a distance that is not negative");
  return {box.min - by, box.max + by};
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
        lamp_channels(other.lamp_channels),
        shared_domain(other.shared_domain),
        store(other.store) {}
  Impl& operator=(const Impl&) = delete;

  /// Voxels whose light may be another.
  using Dirty = std::array<IBox, kChannels>;  // [channel]
  using Queue = std::map<IVec3, IBox, ByZyx>;

  [[nodiscard]] const std::vector<TypeLight>& lights() const { return *shared_lights; }
  [[nodiscard]] const LightDomain& domain() const { return shared_domain->columns; }
  [[nodiscard]] LightReader reader() const { return {store, domain()}; }
  void follow_types(const VoxelRegistry& types);
  void begin_anew(const Grid& grid);
  void take_over(const Grid& grid, const GridChanges& changes);
  [[nodiscard]] Dirty reach_of(const Grid& grid, const IBox& voxels) const;
  [[nodiscard]] std::array<unsigned, kChannels> highest_levels(const Grid& grid, const IBox& voxels) const;
  [[nodiscard]] int end_of_sky(const Grid& grid, const IBox& voxels) const;
  void change_domain(const Grid& grid, const std::vector<IVec3>& chunks);
  void add_chunks(const IBox& voxels);
  void sort_dirty();
  void solve_dirty(const Grid& grid, Threads threads);
  void solve_queue(const Grid& grid, Threads threads);
  [[nodiscard]] std::vector<LightRegion> next_layer() const;
  void read_masks(const Grid& grid, const std::vector<LightRegion>& regions, Threads threads);
  [[nodiscard]] ChunkAround around(IVec3 chunk) const;
  void look_around(LightRegion& region) const;
  void solve(std::vector<LightRegion>& regions, Threads threads, FunctionRef<void(LightSolver&, LightRegion&)> prepare);

  PropagatedLightOptions options;
  ChangeCursor followed_grid;
  ChangeCursor followed_types;
  std::shared_ptr<const std::vector<TypeLight>> shared_lights = std::make_shared<const std::vector<TypeLight>>();
  unsigned lamp_channels = 0;  // channels that any type emits
  Ref<SharedDomain> shared_domain = make_ref<SharedDomain>();
  LightStore store;          // of the chunks of the domain
  std::vector<Dirty> dirty;  // boxes that are to be solved by themselves
  Queue queue;               // boxes of chunks that are to be solved, a layer at a time
  std::unordered_map<IVec3, std::unique_ptr<ChunkMasks>, CoordinateHash> masks;  // during an update
};

// Unregistered types count as opaque, so new types change light.
void PropagatedLight::Impl::follow_types(const VoxelRegistry& types) {
  PendingChanges changes(followed_types, types);
  if (changes->empty()) return;
  std::vector<TypeLight> now = type_lights(types, options);
  if (now != lights()) {
    followed_grid = {};
    lamp_channels = quoin::lamp_channels(now);
    shared_lights = std::make_shared<const std::vector<TypeLight>>(std::move(now));
  }
  changes.commit();
}

void PropagatedLight::Impl::begin_anew(const Grid& grid) {
  queue.clear();
  dirty.clear();
  masks.clear();
  shared_domain = make_ref<SharedDomain>();
  store.clear();
  change_domain(grid, grid.chunks());
}

// Handles chunks that came or went, or may have: computes the light of the new parts of the domain and around them from
// scratch.
void PropagatedLight::Impl::change_domain(const Grid& grid, const std::vector<IVec3>& chunks) {
  std::vector<LightDomain::Change> changed;
  for (const IVec3 chunk : chunks) {
    const bool has_voxels = grid.find_chunk(chunk) != nullptr;
    if (has_voxels == domain().has_voxels(chunk)) continue;
    shared_domain.make_own();
    shared_domain->columns.set(chunk, has_voxels, changed);
  }
  std::vector<IVec3> others;
  for (const LightDomain::Change& column : changed) {
    const LightDomain::Range old = column.before;
    const LightDomain::Range now = column.now;
    for (int y = std::min(old.begin, now.begin); y < std::max(old.end, now.end); ++y) {
      const bool was_held = y >= old.begin && y < old.end;
      const bool is_held = y >= now.begin && y < now.end;
      if (was_held == is_held) continue;
      store.begin({column.x, y, column.z});
      others.push_back({column.x, y, column.z});
    }
  }
  for (const IVec3 chunk : others) {
    const IVec3 low = chunk * kChunkEdge;
    add_chunks(grown({low, low + kChunkEdge}, kReach + 1));
  }
}

// Queues a box of voxels by chunks, limited to chunks of the domain.
void PropagatedLight::Impl::add_chunks(const IBox& voxels) {
  QUOIN_ASSERT(!voxels.empty(), "a box of voxels");
  const IVec3 first = chunk_of(voxels.min);
  const IVec3 last = chunk_of(voxels.max - 1);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const IVec3 chunk{x, y, z};
        if (!domain().holds(chunk)) continue;
        const IVec3 low = chunk * kChunkEdge;
        IBox& known = queue[chunk];
        known = unite(known, intersect({voxels.min - low, voxels.max - low}, kWholeChunk));
      }
    }
  }
}

// Returns upper bounds of the light levels in and next to the voxels, including the lamps that they are now.
std::array<unsigned, kChannels> PropagatedLight::Impl::highest_levels(const Grid& grid, const IBox& voxels) const {
  constexpr int kMany = 512;
  std::array<unsigned, kChannels> highest{};
  const auto add = [&](std::uint16_t word) {
    for (std::size_t c = 0; c < kChannels; ++c) highest[c] = std::max(highest[c], word >> (4 * c) & 15U);
  };
  const IVec3 size = voxels.size();
  if (std::int64_t{size.x} * size.y * size.z > kMany) {
    for (std::size_t c = 0; c < kChannels; ++c)
      highest[c] = c == kSky || (lamp_channels >> c & 1U) != 0 ? kBrightest : 0;
    return highest;
  }
  LightReader words = reader();
  const IBox around = grown(voxels, 1);
  for (int z = around.min.z; z < around.max.z; ++z) {
    for (int y = around.min.y; y < around.max.y; ++y) {
      for (int x = around.min.x; x < around.max.x; ++x) {
        add(words.at({x, y, z}));
        if (!voxels.contains({x, y, z})) continue;
        const VoxelType type = grid.get(x, y, z);
        if (type < lights().size()) add(lights()[type].lamp);
      }
    }
  }
  return highest;
}

// Returns the lower end of the sky columns that change because of these voxels.
int PropagatedLight::Impl::end_of_sky(const Grid& grid, const IBox& voxels) const {
  int low = voxels.max.y;
  LightReader words = reader();
  for (int z = voxels.min.z; z < voxels.max.z; ++z) {
    for (int x = voxels.min.x; x < voxels.max.x; ++x) {
      int y = voxels.max.y;
      while (y >= voxels.min.y && (words.at({x, y, z}) & 15U) != kBrightest) --y;
      if (y < voxels.min.y) continue;
      const LightDomain::Range range = domain().range(x >> kChunkShift, z >> kChunkShift);
      const auto passes = [&](int below) {
        const VoxelType type = grid.get(x, below, z);
        return type < lights().size() && (type == kAir || (lights()[type].passes >> kSky & 1U) != 0);
      };
      y = voxels.min.y;
      while (y - 1 >= range.begin * kChunkEdge && passes(y - 1)) --y;
      low = std::min(low, y);
    }
  }
  return low;
}

// Returns the boxes in which light may change after edits of these voxels. Uses the domain before the edit.
PropagatedLight::Impl::Dirty PropagatedLight::Impl::reach_of(const Grid& grid, const IBox& voxels) const {
  std::array<unsigned, kChannels> highest = highest_levels(grid, voxels);
  IBox from = voxels;
  if (highest[kSky] == kBrightest) from.min.y = std::min(from.min.y, end_of_sky(grid, voxels));
  Dirty reached;
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (highest[c] > 0) reached[c] = grown(c == kSky ? from : voxels, static_cast<int>(highest[c]) - 1);
  }
  return reached;
}

void PropagatedLight::Impl::take_over(const Grid& grid, const GridChanges& changes) {
  std::vector<IVec3> chunks;
  chunks.reserve(changes.items.size());
  for (const ChunkChange& change : changes.items) {
    chunks.push_back(change.chunk);
    const IVec3 low = change.chunk * kChunkEdge;
    store.add_lamps(change.chunk, change.slabs);
    dirty.push_back(reach_of(grid, {change.box.min + low, change.box.max + low}));
  }
  change_domain(grid, chunks);
  sort_dirty();
}

namespace {

// Boxes that touch or share a chunk slab, so that their results would overwrite each other.
struct Cluster {
  std::array<IBox, kChannels> boxes;
  IBox all;
  IBox slabs;  // around it and its rim
  std::vector<IBox> parts;

  explicit Cluster(const std::array<IBox, kChannels>& one) : boxes(one), all(around_all(one)), parts{all} {
    const IVec3 size{kChunkEdge, 4, 4};
    slabs = {(all.min - 1) & ~(size - 1), (all.max + size) & ~(size - 1)};
  }
  [[nodiscard]] bool touches(const Cluster& other) const { return !intersect(slabs, other.slabs).empty(); }
  void add(const Cluster& other) {
    for (std::size_t c = 0; c < kChannels; ++c) boxes[c] = unite(boxes[c], other.boxes[c]);
    all = unite(all, other.all);
    slabs = unite(slabs, other.slabs);
    parts.insert(parts.end(), other.parts.begin(), other.parts.end());
  }
};

}  // namespace

// Merges dirty boxes. If the result is too large or there are too many, queues chunks instead.
void PropagatedLight::Impl::sort_dirty() {
  constexpr std::size_t kMany = 1024;
  std::vector<Cluster> clusters;
  const bool is_alone = queue.empty() && dirty.size() <= kMany;
  for (const Dirty& each : dirty) {
    Cluster cluster(each);
    if (cluster.all.empty()) continue;
    for (std::size_t i = 0; is_alone && i < clusters.size();) {
      if (!clusters[i].touches(cluster)) {
        ++i;
        continue;
      }
      cluster.add(clusters[i]);
      clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(i));
      i = 0;
    }
    clusters.push_back(std::move(cluster));
  }
  dirty.clear();
  for (const Cluster& cluster : clusters) {
    if (is_alone && LightSolver::fits(cluster.all.size())) {
      dirty.push_back(cluster.boxes);
    } else {
      for (const IBox& part : cluster.parts) add_chunks(part);
    }
  }
}

ChunkAround PropagatedLight::Impl::around(IVec3 chunk) const {
  ChunkAround found;
  found.is_held = domain().holds(chunk);
  if (!found.is_held) {
    found.is_open = domain().beyond(chunk) != 0;
    return found;
  }
  found.light = store.find(chunk);
  if (const auto unknown = queue.find(chunk); unknown != queue.end()) found.unknown = unknown->second;
  if (const auto known = masks.find(chunk); known != masks.end()) found.masks = known->second.get();
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
  for (const Dirty& each : dirty) {
    const IBox all = around_all(each);
    LightRegion& region = regions.emplace_back();
    region.all = {all, all};
    for (std::size_t c = 0; c < kChannels; ++c) region.channels[c] = {each[c], each[c]};
  }
  solve(regions, threads, [&](LightSolver& solver, LightRegion& region) {
    std::size_t i = 0;
    const IBox chunks{chunk_of(region.all.voxels.min), chunk_of(region.all.voxels.max - 1) + 1};
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const IVec3 chunk{x, y, z};
          const IVec3 low = chunk * kChunkEdge;
          ChunkMasks& read = solver.own_masks(i++);
          ChunkAround& around = region.at(chunk);
          around.masks = &read;
          read.read(grid.find_chunk(chunk), lights(),
                    intersect({region.all.voxels.min - low, region.all.voxels.max - low}, kWholeChunk),
                    around.light == nullptr ? propagated::all_slabs() : around.light->lamp_slabs);
        }
      }
    }
  });
  dirty.clear();
}

// Returns the highest chunks of the queue. Sky light falls, so the light above them is known. Whole chunks next to each
// other are solved together, because they share surroundings.
std::vector<LightRegion> PropagatedLight::Impl::next_layer() const {
  constexpr int kRun = 4;
  QUOIN_ASSERT(!queue.empty(), "chunks that are to be solved");
  int highest = queue.begin()->first.y;
  for (const auto& [chunk, box] : queue) highest = std::max(highest, chunk.y);
  std::vector<LightRegion> regions;
  int run = 0;
  for (const auto& [chunk, box] : queue) {
    if (chunk.y != highest) continue;
    const IVec3 low = chunk * kChunkEdge;
    const bool goes_on = run > 0 && run < kRun && box == kWholeChunk && regions.back().all.wanted.max.x == low.x &&
                         regions.back().all.wanted.min.z == low.z;
    if (goes_on) {
      regions.back().all.wanted.max.x += kChunkEdge;
      ++run;
    } else {
      regions.emplace_back().all.wanted = {low + box.min, low + box.max};
      run = box == kWholeChunk ? 1 : 0;
    }
  }
  for (LightRegion& region : regions) {
    region.all.voxels = grown(region.all.wanted, kReach);
    region.all.voxels.max.y = std::min(region.all.voxels.max.y, (highest + 1) * kChunkEdge);
    region.channels.fill(region.all);
  }
  return regions;
}

// Reads the masks of the chunks of a layer and of the chunks around them.
void PropagatedLight::Impl::read_masks(const Grid& grid, const std::vector<LightRegion>& regions, Threads threads) {
  std::vector<std::pair<IVec3, ChunkMasks*>> missing;
  for (const LightRegion& region : regions) {
    const IBox chunks{chunk_of(region.all.voxels.min), chunk_of(region.all.voxels.max - 1) + 1};
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const IVec3 chunk{x, y, z};
          if (!domain().holds(chunk)) continue;
          std::unique_ptr<ChunkMasks>& made = masks[chunk];
          if (made != nullptr) continue;
          made = std::make_unique<ChunkMasks>();
          missing.emplace_back(chunk, made.get());
        }
      }
    }
  }
  parallel_for(missing.size(), threads, [&](std::size_t i) {
    const auto& [chunk, read] = missing[i];
    const propagated::LightChunk* light = store.find(chunk);
    read->read(grid.find_chunk(chunk), lights(), kWholeChunk,
               light == nullptr ? propagated::all_slabs() : light->lamp_slabs);
  });
}

void PropagatedLight::Impl::solve_queue(const Grid& grid, Threads threads) {
  constexpr std::size_t kBatch = 64;        // regions at a time
  constexpr std::size_t kMaskLimit = 1024;  // chunks with cached masks: 32 MB
  while (!queue.empty()) {
    const std::vector<LightRegion> layer = next_layer();
    for (std::size_t first = 0; first < layer.size(); first += kBatch) {
      const std::size_t end = std::min(first + kBatch, layer.size());
      std::vector<LightRegion> batch(layer.begin() + static_cast<std::ptrdiff_t>(first),
                                     layer.begin() + static_cast<std::ptrdiff_t>(end));
      if (masks.size() > kMaskLimit) masks.clear();
      read_masks(grid, batch, threads);
      solve(batch, threads, [](LightSolver&, LightRegion&) {});
      for (const LightRegion& region : batch) {
        IVec3 chunk = chunk_of(region.all.wanted.min);
        for (; chunk.x * kChunkEdge < region.all.wanted.max.x; ++chunk.x) queue.erase(chunk);
      }
    }
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
  PendingChanges changes(me.followed_grid, grid);
  changes->all ? me.begin_anew(grid) : me.take_over(grid, *changes);
  me.solve_dirty(grid, threads);
  me.solve_queue(grid, threads);
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
  std::vector<std::uint16_t> words_;   // [z + 1][y + 1][x]
  std::vector<std::uint8_t> is_read_;  // [z + 1][y + 1]
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

std::size_t PropagatedLight::bytes() const {
  return impl_of(impl_).store.bytes() + impl_of(impl_).lights().capacity() * sizeof(TypeLight);
}

}  // namespace quoin
