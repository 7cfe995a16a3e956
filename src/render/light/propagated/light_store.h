#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/chunk.h>

#include "core/change_journal.h"
#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "grid/change_records.h"
#include "render/light/propagated/light_chunk.h"

namespace quoin::propagated {

/// The chunks whose light is stored: chunks at most one away from a chunk with voxels, and the gaps between them in
/// each column. Space above them, and columns without them, are open sky; space below is dark. Light that leaves the
/// domain reaches no surface, since a chunk is wider than the range of light. A copy costs a pointer and shares columns
/// until they change.
class LightDomain {
 public:
  struct Range {
    int begin = 0;
    int end = 0;
    bool operator==(const Range&) const = default;
  };
  /// A column whose range of chunks is another than before.
  struct Change {
    int x, z;
    Range before, now;
  };

  [[nodiscard]] bool has_voxels(IVec3 chunk) const {
    const Column* const column = find(chunk.x, chunk.z);
    if (column == nullptr || column->filled == nullptr) return false;
    return std::ranges::binary_search(column->filled->ys, chunk.y);
  }
  /// Records that a chunk has voxels now, or has none any more. Appends the columns whose stored range changed.
  /// Cost: a copy of the columns next to it, if copies of the domain share them.
  void set(IVec3 chunk, bool has_voxels, std::vector<Change>& changed) {
    if (has_voxels == this->has_voxels(chunk)) return;
    Column& column = columns_.find_or_create(place_of(chunk.x, chunk.z), kStays);
    if (column.filled == nullptr) column.filled = make_ref<Filled>();
    column.filled.make_own();
    std::vector<int>& ys = column.filled->ys;
    const auto at = std::ranges::lower_bound(ys, chunk.y);
    if (has_voxels) {
      ys.insert(at, chunk.y);
    } else {
      ys.erase(at);
    }
    if (ys.empty()) column.filled.reset();
    for (int z = chunk.z - 1; z <= chunk.z + 1; ++z) {
      for (int x = chunk.x - 1; x <= chunk.x + 1; ++x) {
        const Range before = range(x, z);
        const Range now = found_range(x, z);
        if (before == now) continue;
        changed.push_back({x, z, before, now});
        if (now == Range{}) {
          columns_.erase(place_of(x, z), kStays);
        } else {
          columns_.find_or_create(place_of(x, z), kStays).range = now;
        }
      }
    }
  }

  /// y of the chunks of a column; empty for one that is open to the sky.
  [[nodiscard]] Range range(int x, int z) const {
    const Column* const column = find(x, z);
    return column == nullptr ? Range{} : column->range;
  }
  [[nodiscard]] bool holds(IVec3 chunk) const {
    const Range found = range(chunk.x, chunk.z);
    return chunk.y >= found.begin && chunk.y < found.end;
  }
  /// Packed light of a chunk that it does not hold.
  [[nodiscard]] std::uint16_t beyond(IVec3 chunk) const {
    QUOIN_ASSERT(!holds(chunk), "a chunk that is not held");
    const Range found = range(chunk.x, chunk.z);
    const bool is_below = found.begin != found.end && chunk.y < found.begin;
    return is_below ? 0 : 15;
  }
  /// Calls `visit(x, z, range)` for each column with chunks, in no particular order.
  template <class Visit>
  void for_each_range(Visit&& visit) const {
    columns_.for_each([&](IVec3 place, const Column& column) { visit(place.x, place.y + 4 * place.z, column.range); });
  }

 private:
  [[nodiscard]] Range found_range(int x, int z) const {
    std::optional<Range> all;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Column* const column = find(x + dx, z + dz);
        if (column == nullptr || column->filled == nullptr) continue;
        QUOIN_ASSERT(!column->filled->ys.empty(), "some chunks with voxels");
        const int begin = column->filled->ys.front() - 1;
        const int end = column->filled->ys.back() + 2;
        all = all ? Range{std::min(all->begin, begin), std::max(all->end, end)} : Range{begin, end};
      }
    }
    return all.value_or(Range{});
  }

  struct Filled : RefCounted {
    std::vector<int> ys;  // of the chunks with voxels, ascending
  };
  struct Column {
    Range range;         // empty only during `set`
    Ref<Filled> filled;  // null: no chunk of the column has voxels
  };
  static constexpr auto kStays = [](auto&) {};

  // 64 columns share a leaf of the trie: 4 along x, 16 along z.
  static IVec3 place_of(int x, int z) { return {x, z & 3, z >> 2}; }
  [[nodiscard]] const Column* find(int x, int z) const {
    const IVec3 place = place_of(x, z);
    return columns_.find(place.x, place.y, place.z);
  }

  ChunkTrie<Column> columns_;
};

/// The new light of one chunk.
struct ChunkLightChange {
  IVec3 chunk{0};
  std::array<ChannelChange, kChannels> channels;
  VoxelRecord record;       ///< the changed voxels
  SlabSet without_lamps{};  ///< slabs that were found to contain no lamp

  [[nodiscard]] bool empty() const {
    return std::all_of(channels.begin(), channels.end(), [](const ChannelChange& channel) { return channel.empty(); });
  }
};

/// The light of chunks and the journal of its changes. Missing chunks are dark. A copy costs a few pointers and shares
/// light until it is changed. Its journal is a copy (see ChangeJournal).
class LightStore {
 public:
  [[nodiscard]] const LightChunk* find(IVec3 chunk) const {
    const Entry* entry = entries_.find(chunk.x, chunk.y, chunk.z);
    return entry == nullptr ? nullptr : &entry->light;
  }
  void take(ChunkLightChange change) {
    QUOIN_ASSERT(!change.empty(), "a change of some voxels");
    journal_.begin_change();
    Entry& entry = entries_.find_or_create(change.chunk, [](auto&) {});
    for (std::size_t c = 0; c < kChannels; ++c) {
      if (!change.channels[c].empty()) entry.light.channels[c].take(std::move(change.channels[c]));
    }
    for (std::size_t i = 0; i < change.without_lamps.size(); ++i) {
      entry.light.lamp_slabs[i] &= static_cast<std::uint16_t>(~change.without_lamps[i]);
    }
    change.record.chunk = change.chunk;
    journal_.note(entry.serial, change.record, entries_.size());
    if (entry.light.is_dark()) entries_.erase(change.chunk, [](auto&) {});
  }
  /// Marks slabs of a chunk that may now contain lamps.
  void add_lamps(IVec3 chunk, const ChunkSlabs& slabs) {
    Entry* entry = entries_.find_to_edit(chunk, [](auto&) {});
    for (int z = 0; entry != nullptr && z < kChunkEdge; z += 4) {
      entry->light.lamp_slabs[static_cast<std::size_t>(z / 4)] |= static_cast<std::uint16_t>(slabs.along_y(z));
    }
  }
  /// Makes a chunk dark and reports all of it as changed: for a chunk that is added or removed.
  void begin(IVec3 chunk) {
    journal_.begin_change();
    note_all(chunk);
    entries_.erase(chunk, [](auto&) {});
  }
  /// Stores open sky for a chunk that enters the domain from open sky: no light changes.
  void open(IVec3 chunk) {
    journal_.begin_change();
    Entry& entry = entries_.find_or_create(chunk, [](auto&) {});
    ChannelChange all;
    all.is_uniform = true;
    all.level = 15;
    entry.light.channels[kSky].take(std::move(all));
  }
  void clear() {
    journal_.begin_change();
    std::vector<IVec3> chunks;
    entries_.for_each([&](IVec3 chunk, const Entry&) { chunks.push_back(chunk); });
    for (const IVec3 chunk : chunks) note_all(chunk);
    entries_.clear();
  }
  [[nodiscard]] GridChanges changes_since(ChangeCursor& cursor) const {
    return journal_.changes_since<ChunkChange>(cursor, by_chunk);
  }
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = entries_.bytes();
    entries_.for_each([&](IVec3, const Entry& entry) { sum += entry.light.bytes(); });
    return sum;
  }

 private:
  struct Entry {
    LightChunk light;
    std::uint64_t serial = 0;
  };
  void note_all(IVec3 chunk) {
    VoxelRecord record;
    record.chunk = chunk;
    record.add_all();
    std::uint64_t none = 0;
    Entry* entry = entries_.find_to_edit(chunk, [](auto&) {});
    journal_.note(entry == nullptr ? none : entry->serial, record, entries_.size());
  }

  ChunkTrie<Entry> entries_;
  ChangeJournal<VoxelRecord> journal_;
};

/// Reads light at voxels that lie near each other: remembers the slab of the last one.
class LightReader {
 public:
  LightReader(const LightStore& store, const LightDomain& domain) : store_(&store), domain_(&domain) {}

  /// Packed.
  [[nodiscard]] std::uint16_t at(IVec3 voxel) {
    if (!is_known_ || slab_of(voxel) != slab_) look_at(voxel);
    unsigned word = even_;
    if (mixed_ == 0) return static_cast<std::uint16_t>(word);
    const auto x = static_cast<unsigned>(voxel.x & (kChunkEdge - 1));
    const std::size_t row = row_in_slab(voxel.y, voxel.z);
    for (std::size_t i = 0; i < mixed_; ++i) word |= slabs_[i]->at(row, x) << shifts_[i];
    return static_cast<std::uint16_t>(word);
  }

  /// The 64 voxels along x in whose row `voxel` lies.
  void read_row(IVec3 voxel, std::span<std::uint16_t, kChunkEdge> out) {
    if (const IVec3 chunk = chunk_of(voxel); !is_known_ || chunk != chunk_) look_at(voxel);
    if (light_ == nullptr) {
      std::fill(out.begin(), out.end(), static_cast<std::uint16_t>(even_));
    } else {
      light_->read_row(voxel.y & (kChunkEdge - 1), voxel.z & (kChunkEdge - 1), out);
    }
  }

 private:
  static IVec3 slab_of(IVec3 voxel) { return {voxel.x >> kChunkShift, voxel.y >> 2, voxel.z >> 2}; }
  void look_at(IVec3 voxel) {
    const IVec3 chunk = chunk_of(voxel);
    if (!is_known_ || chunk != chunk_) {
      is_held_ = domain_->holds(chunk);
      light_ = is_held_ ? store_->find(chunk) : nullptr;
    }
    is_known_ = true;
    chunk_ = chunk;
    slab_ = slab_of(voxel);
    mixed_ = 0;
    even_ = is_held_ ? std::uint16_t{0} : domain_->beyond(chunk);
    if (light_ == nullptr) return;
    const IVec3 local = local_of(voxel);
    for (std::size_t c = 0; c < kChannels; ++c) {
      const ChannelLight& channel = light_->channels[c];
      const auto shift = static_cast<unsigned>(4 * c);
      const LightSlab* slab = channel.is_uniform() ? nullptr : &channel.stored(slab_index(local.y, local.z));
      if (slab == nullptr || slab->is_uniform()) {
        even_ |= (slab == nullptr ? channel.level() : slab->level()) << shift;
      } else {
        slabs_[mixed_] = slab;
        shifts_[mixed_++] = shift;
      }
    }
  }

  const LightStore* store_;
  const LightDomain* domain_;
  bool is_known_ = false;
  bool is_held_ = false;
  IVec3 chunk_{0};
  IVec3 slab_{0};
  const LightChunk* light_ = nullptr;
  unsigned even_ = 0;  // of the channels that have one level in the slab
  std::size_t mixed_ = 0;
  std::array<const LightSlab*, kChannels> slabs_{};  // of the others
  std::array<unsigned, kChannels> shifts_{};
};

}  // namespace quoin::propagated
