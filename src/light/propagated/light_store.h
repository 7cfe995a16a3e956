#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/changes.h>

#include "core/change_journal.h"
#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "grid/change_records.h"
#include "light/propagated/light_chunk.h"

namespace quoin::propagated {

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

}  // namespace quoin::propagated
