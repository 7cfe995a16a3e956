#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/core/progress.h>
#include <quoin/grid/density_grid.h>

#include "core/change_journal.h"
#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "core/coordinates/long_box.h"
#include "core/moved_from.h"
#include "grid/bounds_cache.h"
#include "grid/change_records.h"
#include "grid/loaded_chunks.h"

namespace quoin {

/// The samples of one row, as edits read and change them.
struct SampleRow {
  std::array<float, kChunkEdge> densities{};
  std::array<VoxelType, kChunkEdge> materials{};  ///< air where the density is far air
};

/// The effect of an edit on a whole chunk.
enum class ChunkEdit : std::uint8_t {
  Nothing,
  Rows,   ///< the edit must process the samples
  Solid,  ///< all samples become solid, as far from the surface as possible
};

/// A part of a chunk; `box` is in the chunk's coordinates.
struct ChunkPart {
  IVec3 chunk{0};
  IBox box;
};

/// The chunks of a density grid with the bookkeeping of edits.
class DensityStore {
 public:
  struct Entry {
    DensityChunk samples{Half{0}};
    std::uint64_t serial = 0;  ///< of its last record in the journal
  };

  explicit DensityStore(float band);

  [[nodiscard]] Half far() const { return far_; }
  [[nodiscard]] float band() const { return float_from_half(far_); }
  [[nodiscard]] const ChunkTrie<Entry>& entries() const { return entries_; }
  [[nodiscard]] const ChangeJournal<DensityRecord>& journal() const { return journal_; }
  /// Returns a number that increases with every change of a chunk.
  [[nodiscard]] std::uint64_t edits() const { return edits_; }
  [[nodiscard]] const Entry* find(IVec3 chunk) const { return entries_.find(chunk.x, chunk.y, chunk.z); }
  [[nodiscard]] Half get(IVec3 sample) const {
    const Entry* entry = find(chunk_of(sample));
    if (entry == nullptr) return far_;
    const IVec3 local = local_of(sample);
    return entry->samples.get(local.x, local.y, local.z);
  }
  /// Returns air if the density is far air, even if another material is stored.
  [[nodiscard]] VoxelType material(IVec3 sample) const;

  /// Edits the samples of a box, clipped to the world, chunk by chunk in the order of z, y, x. Returns how many
  /// changed.
  ///
  /// `chunk_edit(chunk)` returns the effect on a chunk; with `creates` it is also called for missing chunks. Solid
  /// applies only to missing chunks, which become `material`; existing ones are edited by rows. `change(sample, first,
  /// end, row)` changes part of a row and returns false if nothing changed; `sample` is the row's first sample (local x
  /// = 0). `progress` is called after each chunk.
  template <class ChooseChunk, class ChangeRow>
  std::int64_t edit(const LongBox& box, bool creates, VoxelType material, ChooseChunk&& chunk_edit, ChangeRow&& change,
                    const Progress& progress);

  /// Edits rows of parts of chunks that lie within the world and are loaded.
  template <class ChangeRow>
  std::int64_t edit_parts(const std::vector<ChunkPart>& parts, ChangeRow&& change);

  /// Returns how many samples changed.
  std::int64_t put(IVec3 chunk, DensityChunk samples);
  [[nodiscard]] const LoadedChunks& loaded() const { return loaded_; }
  [[nodiscard]] LoadedChunks& loaded() { return loaded_; }
  void make_partial();
  void set_extent(const IBox& chunks, std::span<const IVec3> others);
  bool load(IVec3 chunk, DensityChunk samples);
  bool unload(IVec3 chunk);
  /// Replaces the samples of a chunk that was loaded or unloaded. The change is reported as a load, not as an edit.
  void replace(IVec3 chunk, DensityChunk samples);
  void clear();
  [[nodiscard]] std::vector<IVec3> chunks() const;
  [[nodiscard]] std::size_t bytes() const;
  void compact();

 private:
  void read_row(const DensityChunk& samples, int y, int z, SampleRow& out) const;
  // Returns true if all 64 densities of a stored row are equal.
  static bool is_even(const Half* row) {
    return row != nullptr && std::memcmp(row, row + 1, sizeof(Half) * (kChunkEdge - 1)) == 0;
  }
  // Returns the changed samples.
  std::uint64_t write_row(DensityChunk& samples, int y, int z, int first, int end, const SampleRow& row) const;
  [[nodiscard]] ChangeReach differences(const DensityChunk* before, const DensityChunk* after) const;
  Entry& find_or_create(IVec3 chunk);
  // Records an edit of one chunk, and removes the chunk if it is all far air. `has_even_row`: an edited row became
  // uniform, so slabs may need to be united.
  void finish_edit(IVec3 chunk, Entry& entry, const ChangeReach& changes, bool has_even_row, bool is_edit = true);
  template <class ChangeRow>
  std::int64_t edit_rows(IVec3 chunk, const IBox& part, ChangeRow& change);
  std::int64_t make_solid(IVec3 chunk, VoxelType material);

  Half far_;
  ChunkTrie<Entry> entries_;
  LoadedChunks loaded_;
  ChangeJournal<DensityRecord> journal_;
  std::uint64_t edits_ = 0;
};

template <class ChangeRow>
std::int64_t DensityStore::edit_rows(IVec3 chunk, const IBox& part, ChangeRow& change) {
  QUOIN_ASSERT(!part.empty() && intersect(part, kWholeChunk) == part, "a part of the chunk");
  Entry& entry = find_or_create(chunk);
  ChangeReach changes;
  SampleRow row;
  bool has_even_row = false;
  try {
    for (int z = part.min.z; z < part.max.z; ++z) {
      for (int y = part.min.y; y < part.max.y; ++y) {
        read_row(entry.samples, y, z, row);
        if (!change(chunk * kChunkEdge + IVec3{0, y, z}, part.min.x, part.max.x, row)) continue;
        changes.add(y, z, write_row(entry.samples, y, z, part.min.x, part.max.x, row));
        has_even_row = has_even_row || is_even(entry.samples.row(y, z));
      }
    }
  } catch (...) {
    changes.add_all();
    finish_edit(chunk, entry, changes, true);
    throw;
  }
  finish_edit(chunk, entry, changes, has_even_row);
  return changes.samples;
}

template <class ChangeRow>
std::int64_t DensityStore::edit_parts(const std::vector<ChunkPart>& parts, ChangeRow&& change) {
  journal_.begin_change();
  std::int64_t changed = 0;
  for (const ChunkPart& part : parts) {
    QUOIN_ASSERT(loaded_.may_edit(part.chunk), "a loaded chunk within the world");
    changed += edit_rows(part.chunk, part.box, change);
  }
  return changed;
}

template <class ChooseChunk, class ChangeRow>
std::int64_t DensityStore::edit(const LongBox& wanted, bool creates, VoxelType material, ChooseChunk&& chunk_edit,
                                ChangeRow&& change, const Progress& progress) {
  const LongBox box = clipped(wanted);
  if (is_empty(box)) return 0;
  const IBox chunks = chunks_of(box);
  journal_.begin_change();
  std::int64_t changed = 0;
  const auto visit = [&](IVec3 chunk) {
    const ChunkEdit request = chunk_edit(chunk);
    if (request == ChunkEdit::Nothing) return;
    if (request == ChunkEdit::Solid && find(chunk) == nullptr) {
      changed += make_solid(chunk, material);
    } else {
      changed += edit_rows(chunk, part_of(box, chunk), change);
    }
  };
  double done = 0.0;
  const auto goes_on = [&](double total) { return !progress || progress(std::min(++done / total, 1.0)); };
  if (creates && loaded_.has_marks_only(chunks)) {  // however large the box is
    const std::vector<IVec3> here = loaded_.within(chunks);
    for (const IVec3 at : here) {
      visit(at);
      if (!goes_on(static_cast<double>(here.size()))) return changed;
    }
  } else if (creates) {
    const DVec3 size(chunks.size());
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          if (loaded_.has({x, y, z})) visit({x, y, z});
          if (!goes_on(size.x * size.y * size.z)) return changed;
        }
      }
    }
  } else {
    std::vector<IVec3> present;
    entries_.for_each_in(chunks, [&](IVec3 at, const Entry&) { present.push_back(at); });
    std::sort(present.begin(), present.end(), by_zyx);
    for (const IVec3 at : present) {
      visit(at);
      if (!goes_on(static_cast<double>(present.size()))) return changed;
    }
  }
  return changed;
}

/// The box of a chunk's solid samples. Cost: O(4096).
struct SolidBox {
  static IBox of(const DensityStore::Entry& entry) {
    IBox box;
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        const std::uint64_t solid = entry.samples.solid_row(y, z);
        if (solid == 0) continue;
        box = unite(box, {{std::countr_zero(solid), y, z}, {kChunkEdge - std::countl_zero(solid), y + 1, z + 1}});
      }
    }
    return box;
  }
};

struct DensityGrid::Impl : BulkAllocated {
  explicit Impl(float band) : store(band) {}
  DensityStore store;
  BoundsCache<DensityRecord, ChunkTrie<DensityStore::Entry>, SolidBox> solid;
};

// Asserts that the field was not moved from. Accesses to single samples and chunks skip this check.
inline DensityGrid::Impl& DensityGrid::impl() const {
  QUOIN_ASSERT(impl_ != nullptr, "a field that was not moved from");
  return *impl_;
}

/// Notifies followers, on destruction, of edits made during its lifetime, even after an exception.
class NotifyOnExit {
 public:
  NotifyOnExit(const DensityStore& store, ChangeNotifier& notifier)
      : store_(store), notifier_(notifier), before_(store.edits()) {}
  NotifyOnExit(const NotifyOnExit&) = delete;
  NotifyOnExit& operator=(const NotifyOnExit&) = delete;
  ~NotifyOnExit() {
    if (store_.edits() != before_) notifier_.notify();
  }

 private:
  const DensityStore& store_;
  ChangeNotifier& notifier_;
  std::uint64_t before_;
};

}  // namespace quoin
