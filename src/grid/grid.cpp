#include <quoin/grid/grid.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/grid/density_grid.h>

#include "core/change_journal.h"
#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "core/coordinates/long_box.h"
#include "core/moved_from.h"
#include "core/rows/packed_row.h"
#include "grid/bounds_cache.h"
#include "grid/change_records.h"
#include "grid/chunk/chunk_data.h"
#include "grid/chunk/chunk_storage.h"
#include "grid/chunk_table.h"
#include "grid/loaded_chunks.h"

namespace quoin {
namespace {

struct VoxelBox {
  static IBox of(const ChunkEntry& entry) { return entry.chunk.bounds(); }
};

// Shorter lists are not worth several threads.
constexpr std::size_t kVoxelsForThreads = 1024;

// The voxels of a list in one chunk, and their edit.
struct VoxelsOfChunk {
  IVec3 chunk{0};
  std::size_t count = 0;
  std::span<const PlacedVoxel> voxels{};
  Chunk* target = nullptr;
  VoxelEdit edit{};
};

// Returns the first voxels of a list that lie in the same chunk. Requires: the list is not empty.
std::span<const PlacedVoxel> first_run(std::span<const PlacedVoxel> voxels) {
  const IVec3 chunk = chunk_of(voxels.front().voxel);
  const auto end = std::ranges::find_if(voxels, [&](const PlacedVoxel& each) { return chunk_of(each.voxel) != chunk; });
  return voxels.first(static_cast<std::size_t>(end - voxels.begin()));
}

// Copies a list to `sorted`: the voxels of each chunk one after another, in the order of the list.
std::vector<VoxelsOfChunk> grouped(std::span<const PlacedVoxel> list, std::vector<PlacedVoxel>& sorted) {
  struct Number {
    std::size_t plus_one = 0;
  };
  struct Run {
    std::span<const PlacedVoxel> voxels;
    std::size_t of = 0;
  };
  ChunkTrie<Number> numbers;
  std::vector<Run> runs;
  std::vector<VoxelsOfChunk> chunks;
  while (!list.empty()) {
    const std::span<const PlacedVoxel> run = first_run(list);
    const IVec3 chunk = chunk_of(run.front().voxel);
    Number& number = numbers.find_or_create(chunk, [](auto&) {});
    if (number.plus_one == 0) {
      chunks.push_back({.chunk = chunk});
      number.plus_one = chunks.size();
    }
    chunks[number.plus_one - 1].count += run.size();
    runs.push_back({run, number.plus_one - 1});
    list = list.subspan(run.size());
  }
  std::vector<std::size_t> next;  // place in `sorted`, by chunk
  next.reserve(chunks.size());
  std::size_t end = 0;
  for (const VoxelsOfChunk& of : chunks) next.push_back(std::exchange(end, end + of.count));
  sorted.resize(end);
  for (const Run& run : runs) {
    std::ranges::copy(run.voxels, sorted.begin() + static_cast<std::ptrdiff_t>(next[run.of]));
    next[run.of] += run.voxels.size();
  }
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    chunks[i].voxels = std::span(sorted).subspan(next[i] - chunks[i].count, chunks[i].count);
  }
  return chunks;
}

// Most of the time passes while rows come from memory, so that they are requested some voxels ahead.
void set_voxels(VoxelsOfChunk& of) {
  constexpr std::size_t kAhead = 8;
  QUOIN_ASSERT(of.target != nullptr, "an existing chunk");
  VoxelEdit edit = of.edit;  // the next one may be another thread's, in the same line of the cache
  try {
    for (std::size_t i = 0; i < of.voxels.size(); ++i) {
      if (i + kAhead < of.voxels.size()) ChunkStorage::prefetch(*of.target, local_of(of.voxels[i + kAhead].voxel));
      const IVec3 at = local_of(of.voxels[i].voxel);
      if (of.target->set(at.x, at.y, at.z, of.voxels[i].type)) edit.add_voxel(at.x, at.y, at.z);
    }
  } catch (...) {
    of.edit.add_all();
    throw;
  }
  of.edit = edit;
}

}  // namespace

struct Grid::Impl : BulkAllocated {
  ChunkTable entries;
  LoadedChunks loaded;
  ChangeJournal<VoxelRecord> journal;
  BoundsCache<VoxelRecord, ChunkTable, VoxelBox> bounds;
  std::int64_t voxel_count = 0;    // that are not air
  std::int64_t data_count = 0;     // that have data
  std::uint64_t types_serial = 0;  // last record with a change of types
  std::uint64_t data_serial = 0;   // last record with a change of data

  void note(std::uint64_t& serial, const VoxelRecord& record) {
    journal.note(serial, record, entries.size());
    if (record.has_types()) types_serial = std::max(types_serial, serial);
    if (record.has_data()) data_serial = std::max(data_serial, serial);
  }

  // Records an edit of one chunk, notifies followers of the grid, and drops the chunk if it is empty.
  void finish_edit(const IVec3& chunk, const ChunkTable::Slot& slot, VoxelEdit& edit, ChangeNotifier& notifier) {
    QUOIN_ASSERT(slot.entry != nullptr && entries.find(chunk) == slot.entry, "the slot is the chunk's");
    // Runs before any step that may throw: the known storage may be freed.
    entries.voxels_changed(slot);
    if (const int data = quoin::data_count(slot.entry->chunk); data != edit.data_before) {
      if (!edit.record.has_data()) edit.record.data = edit.record.box;
      data_count += data - edit.data_before;
      QUOIN_ASSERT(data_count >= data, "a grid has the data of its chunks");
    }
    if (edit.voxels != 0 || edit.record.has_data()) {
      journal.begin_change();
      edit.record.chunk = chunk;
      note(slot.entry->serial, edit.record);
      notifier.notify();
    }
    const int voxels = non_air_count(slot.entry->chunk);
    voxel_count += voxels - slot.entry->counted;
    slot.entry->counted = voxels;
    QUOIN_ASSERT(voxel_count >= voxels, "a grid has the voxels of its chunks");
    if (voxels == 0) entries.erase(chunk);
  }

  // Replaces the voxels of a chunk that was loaded or unloaded. The change is reported as a load, not as an edit.
  void replace(const IVec3& chunk, Chunk voxels, ChangeNotifier& notifier) {
    if (non_air_count(voxels) == 0 && quoin::data_count(voxels) == 0 && entries.find(chunk) == nullptr) {
      VoxelRecord record;  // air replaces nothing: no chunk is created or removed
      record.chunk = chunk;
      record.add_all();
      record.is_edit = false;
      journal.begin_change();
      std::uint64_t serial = 0;
      note(serial, record);
      return notifier.notify();
    }
    const ChunkTable::Slot slot = entries.find_or_create(chunk);
    VoxelEdit edit{.data_before = quoin::data_count(slot.entry->chunk)};
    edit.add_all();
    edit.record.is_edit = false;
    entries.voxels_will_change(slot);
    slot.entry->chunk = std::move(voxels);
    finish_edit(chunk, slot, edit, notifier);
  }

  // Sets the voxels of several chunks, each once in `chunks`.
  std::int64_t set(std::span<VoxelsOfChunk> chunks, Threads threads, ChangeNotifier& notifier);

  // Calls `change(chunk, voxels, part of the box in chunk coordinates, edit)` for every chunk of a box. Chunks that are
  // not there are created where `create`, left out otherwise.
  template <class Change>
  std::int64_t edit_box(const LongBox& wanted, bool create, ChangeNotifier& notifier, const Progress& progress,
                        Change&& change);
  template <class Change>
  std::int64_t edit_chunk(IVec3 chunk, const ChunkTable::Slot& slot, const IBox& part, ChangeNotifier& notifier,
                          Change& change);
};

template <class Change>
std::int64_t Grid::Impl::edit_chunk(IVec3 chunk, const ChunkTable::Slot& slot, const IBox& part,
                                    ChangeNotifier& notifier, Change& change) {
  QUOIN_ASSERT(slot.entry != nullptr && !part.empty() && intersect(part, kWholeChunk) == part, "a part of a chunk");
  VoxelEdit edit{.data_before = quoin::data_count(slot.entry->chunk)};
  entries.voxels_will_change(slot);
  try {
    change(chunk, slot.entry->chunk, part, edit);
  } catch (...) {
    edit.add_all();
    finish_edit(chunk, slot, edit, notifier);
    throw;
  }
  finish_edit(chunk, slot, edit, notifier);
  return edit.voxels;
}

// The table of chunks and the journal change on this thread only, before and after the voxels.
std::int64_t Grid::Impl::set(std::span<VoxelsOfChunk> chunks, Threads threads, ChangeNotifier& notifier) {
  std::size_t begun = 0;
  const auto finish = [&] {
    std::int64_t changed = 0;
    for (VoxelsOfChunk& of : chunks.first(begun)) {
      finish_edit(of.chunk, entries.find_to_edit(of.chunk), of.edit, notifier);
      changed += of.edit.voxels;
    }
    return changed;
  };
  try {
    for (VoxelsOfChunk& of : chunks) {
      of.edit.data_before = quoin::data_count(entries.find_or_create(of.chunk).entry->chunk);
      ++begun;
    }
    // No entry is shared now, so that their addresses stay.
    for (VoxelsOfChunk& of : chunks) of.target = &entries.find_to_edit(of.chunk).entry->chunk;
    parallel_for(chunks.size(), threads, [&](std::size_t i) { set_voxels(chunks[i]); });
  } catch (...) {
    finish();
    throw;
  }
  return finish();
}

template <class Change>
std::int64_t Grid::Impl::edit_box(const LongBox& wanted, bool create, ChangeNotifier& notifier,
                                  const Progress& progress, Change&& change) {
  const LongBox box = clipped(wanted);
  if (is_empty(box)) return 0;
  const IBox chunks = chunks_of(box);
  std::int64_t changed = 0;
  double done = 0.0;
  const auto goes_on = [&](double total) { return !progress || progress(std::min(++done / total, 1.0)); };
  if (create && loaded.has_marks_only(chunks)) {  // however large the box is
    const std::vector<IVec3> here = loaded.within(chunks);
    for (const IVec3 at : here) {
      changed += edit_chunk(at, entries.find_or_create(at), part_of(box, at), notifier, change);
      if (!goes_on(static_cast<double>(here.size()))) return changed;
    }
    return changed;
  }
  if (create) {
    const DVec3 size(chunks.size());
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const IVec3 at{x, y, z};
          if (loaded.has(at)) changed += edit_chunk(at, entries.find_or_create(at), part_of(box, at), notifier, change);
          if (!goes_on(size.x * size.y * size.z)) return changed;
        }
      }
    }
    return changed;
  }
  std::vector<IVec3> present;
  entries.for_each_in(chunks, [&](IVec3 at, const ChunkEntry&) { present.push_back(at); });
  std::sort(present.begin(), present.end(), by_zyx);
  for (const IVec3 at : present) {
    changed += edit_chunk(at, entries.find_to_edit(at), part_of(box, at), notifier, change);
    if (!goes_on(static_cast<double>(present.size()))) return changed;
  }
  return changed;
}

// Asserts that the grid was not moved from. Accesses to single voxels, rows and chunks skip this check.
inline Grid::Impl& Grid::impl() const {
  QUOIN_ASSERT(impl_ != nullptr, "a grid that was not moved from");
  return *impl_;
}

Grid::Grid() : impl_(std::make_unique<Impl>()) {}
Grid::Grid(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Grid::Grid(Grid&&) noexcept = default;
Grid& Grid::operator=(Grid&&) noexcept = default;
Grid::~Grid() = default;

Grid Grid::snapshot() const {
  impl().bounds.prepare(impl().journal, impl().entries);
  return Grid(std::make_unique<Impl>(impl()));
}

Grid Grid::snapshot(BulkMemory& memory) const {
  impl().bounds.prepare(impl().journal, impl().entries);
  return Grid(std::unique_ptr<Impl>(new (memory) Impl(impl())));
}

VoxelType Grid::get(int x, int y, int z) const {
  return impl_->entries.voxel(x, y, z);
}

bool Grid::set(int x, int y, int z, VoxelType type) {
  const IVec3 at{x >> kChunkShift, y >> kChunkShift, z >> kChunkShift};
  const IVec3 local{x & (kChunkEdge - 1), y & (kChunkEdge - 1), z & (kChunkEdge - 1)};
  ChunkTable::Slot slot = impl_->entries.find_to_edit(at);
  if (slot.entry == nullptr) {
    if (type == kAir || !impl_->loaded.may_edit(at)) return false;
    slot = impl_->entries.find_or_create(at);
  }
  VoxelEdit edit{.data_before = quoin::data_count(slot.entry->chunk)};
  try {
    if (!slot.entry->chunk.set(local, type)) return false;
  } catch (...) {
    edit.add_all();
    impl_->finish_edit(at, slot, edit, notifier_);
    throw;
  }
  edit.add_voxel(local.x, local.y, local.z);
  impl_->finish_edit(at, slot, edit, notifier_);
  return true;
}

std::int64_t Grid::write_row(IVec3 row, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types) {
  const IVec3 at = chunk_of(row);
  const IVec3 local = local_of(row);
  if (mask == 0 || !impl_->loaded.may_edit(at)) return 0;
  const ChunkTable::Slot slot = impl_->entries.find_or_create(at);
  VoxelEdit edit{.data_before = quoin::data_count(slot.entry->chunk)};
  try {
    edit.add(local.y, local.z, slot.entry->chunk.write_row(local.y, local.z, mask, types));
  } catch (...) {
    edit.add_all();
    impl_->finish_edit(at, slot, edit, notifier_);
    throw;
  }
  impl_->finish_edit(at, slot, edit, notifier_);
  return edit.voxels;
}

VoxelData Grid::data(IVec3 voxel) const {
  const Chunk* const chunk = find_chunk(chunk_of(voxel));
  return chunk == nullptr ? VoxelData{} : chunk->data(local_of(voxel));
}

bool Grid::set_data(IVec3 voxel, const VoxelData& data) {
  const IVec3 at = chunk_of(voxel);
  const IVec3 local = local_of(voxel);
  const Chunk* const present = find_chunk(at);
  // Checked first, so that nothing is copied without a change.
  if (present == nullptr || present->get(local) == kAir || present->data(local) == data) return false;
  const ChunkTable::Slot slot = impl().entries.find_to_edit(at);
  VoxelEdit edit{.data_before = quoin::data_count(slot.entry->chunk)};
  edit.record.data = PackedBox::of(local.x, local.y, local.z);
  slot.entry->chunk.set_data(local, data);
  impl().finish_edit(at, slot, edit, notifier_);
  return true;
}

bool Grid::set(IVec3 voxel, VoxelType type, const VoxelData& data) {
  const std::vector<std::byte> bytes(data.bytes.begin(), data.bytes.end());
  const VoxelData kept{data.state, bytes};
  const bool is_other = set(voxel, type);
  return set_data(voxel, kept) || is_other;
}

std::int64_t Grid::data_count() const {
  return impl().data_count;
}

void Grid::for_each_data(FunctionRef<void(IVec3 voxel, VoxelType type, const VoxelData& data)> visit) const {
  if (data_count() == 0) return;
  for (const IVec3 at : chunks()) {
    const Chunk& chunk = *find_chunk(at);
    chunk.for_each_data(
        [&](IVec3 local, const VoxelData& data) { visit(at * kChunkEdge + local, chunk.get(local), data); });
  }
}

std::int64_t Grid::set(std::span<const PlacedVoxel> voxels, Threads threads) {
  const auto has_no_change = [this](const VoxelsOfChunk& of) {
    const auto is_air = [](const PlacedVoxel& each) { return each.type == kAir; };
    return !impl().loaded.may_edit(of.chunk) ||
           (impl().entries.find(of.chunk) == nullptr && std::ranges::all_of(of.voxels, is_air));
  };
  if (voxels.empty()) return 0;
  if (first_run(voxels).size() == voxels.size()) {  // in one chunk: allocates nothing
    VoxelsOfChunk one{.chunk = chunk_of(voxels.front().voxel), .voxels = voxels};
    return has_no_change(one) ? 0 : impl().set({&one, 1}, {1}, notifier_);
  }
  std::vector<PlacedVoxel> sorted;
  std::vector<VoxelsOfChunk> chunks = grouped(voxels, sorted);
  std::erase_if(chunks, has_no_change);
  return impl().set(chunks, voxels.size() < kVoxelsForThreads ? Threads{1} : threads, notifier_);
}

namespace {

void fill_whole(Chunk& chunk, VoxelType type, VoxelEdit& edit) {
  if (chunk.uniform() == type) return;
  if (chunk.count(type) == 0) {
    edit.add_all();
  } else {
    difference_of_types(chunk, Chunk(type), edit);
  }
  chunk.fill(type);
}

}  // namespace

std::int64_t Grid::fill_box(const IBox& box, VoxelType type, const Progress& progress) {
  const auto fill = [&](IVec3, Chunk& chunk, const IBox& part, VoxelEdit& edit) {
    if (part == kWholeChunk) return fill_whole(chunk, type, edit);
    chunk.fill_box(part, type, [&](int y, int z, std::uint64_t changed) { edit.add(y, z, changed); });
  };
  return impl().edit_box(box_from(box), type != kAir, notifier_, progress, fill);
}

std::int64_t Grid::fill_sphere(DVec3 centre, double radius, VoxelType type, const Progress& progress) {
  if (!(radius >= 0.0) || !std::isfinite(radius) || !is_finite(centre)) return 0;
  const LongBox box = box_around(centre - radius, centre + radius);
  const auto fill = [&](IVec3 at, Chunk& chunk, const IBox& part, VoxelEdit& edit) {
    const DVec3 local_centre = centre - DVec3(at) * double{kChunkEdge} - 0.5;
    for (int z = part.min.z; z < part.max.z; ++z) {
      for (int y = part.min.y; y < part.max.y; ++y) {
        const double dy = y - local_centre.y;
        const double dz = z - local_centre.z;
        std::uint64_t mask = 0;
        for (int x = part.min.x; x < part.max.x; ++x) {
          const double dx = x - local_centre.x;
          mask |= std::uint64_t{dx * dx + dy * dy + dz * dz <= radius * radius} << x;
        }
        const std::uint64_t changed = chunk.fill_row(y, z, mask, type);
        edit.add(y, z, changed);
      }
    }
  };
  return impl().edit_box(box, type != kAir, notifier_, progress, fill);
}

std::int64_t Grid::edit_rows(const IBox& wanted, FunctionRef<void(IVec3 first, std::span<VoxelType> types)> change,
                             const Progress& progress) {
  const auto change_part = [&](IVec3 at, Chunk& chunk, const IBox& part, VoxelEdit& edit) {
    std::array<VoxelType, kChunkEdge> row{};
    const auto first = static_cast<std::size_t>(part.min.x);
    const auto count = static_cast<std::size_t>(part.max.x - part.min.x);
    for (int z = part.min.z; z < part.max.z; ++z) {
      for (int y = part.min.y; y < part.max.y; ++y) {
        chunk.read_row(y, z, row);
        change(at * kChunkEdge + IVec3{part.min.x, y, z}, std::span(row).subspan(first, count));
        edit.add(y, z, chunk.write_row(y, z, row));
      }
    }
  };
  return impl().edit_box(box_from(wanted), true, notifier_, progress, change_part);
}

std::int64_t Grid::put_chunk(IVec3 at, Chunk voxels) {
  if (!impl().loaded.may_edit(at)) return 0;
  const ChunkEntry* present = impl().entries.find(at);
  if (present == nullptr && voxels.non_air_count() == 0) return 0;
  if (present != nullptr && present->chunk.shares_storage_with(voxels)) return 0;
  const ChunkTable::Slot slot = impl().entries.find_or_create(at);
  VoxelEdit edit{.data_before = quoin::data_count(slot.entry->chunk)};
  difference_of_types(slot.entry->chunk, voxels, edit);
  visit_other_data(&slot.entry->chunk, &voxels, [&](IVec3 local, const VoxelData&, const VoxelData&) {
    edit.record.data.unite(PackedBox::of(local.x, local.y, local.z));
  });
  slot.entry->chunk = std::move(voxels);
  impl().finish_edit(at, slot, edit, notifier_);
  return edit.voxels;
}

void Grid::make_partial() {
  clear();
  impl().loaded.begin();
  notifier_.notify();
}

bool Grid::is_partial() const {
  return impl().loaded.is_partial();
}

void Grid::set_extent(const IBox& chunks, std::span<const IVec3> others) {
  QUOIN_ASSERT(is_partial(), "a partial grid");
  LoadedChunks next = impl().loaded;
  impl().entries.for_each([&](IVec3 at, const ChunkEntry&) { next.mark(at); });
  next.set_extent(chunks, others);
  impl().loaded = std::move(next);
  impl().journal.begin_change();
  impl().loaded.for_each([this](IVec3 at) {
    VoxelRecord record;
    record.chunk = at;
    record.add_all();
    record.is_edit = false;
    std::uint64_t serial = 0;
    impl().note(serial, record);
  });
  notifier_.notify();
}

IBox Grid::extent() const {
  return impl().loaded.bounds();
}

bool Grid::is_loaded(IVec3 chunk) const {
  return impl().loaded.has(chunk);
}

bool Grid::is_loaded_around(IVec3 chunk, int distance) const {
  return impl().loaded.has_around(chunk, distance);
}

bool Grid::is_loaded_within(const IBox& voxels) const {
  return impl().loaded.has_within(voxels);
}

std::vector<IVec3> Grid::loaded_chunks() const {
  std::vector<IVec3> all = chunks();
  if (!is_partial()) return all;
  impl().loaded.for_each([&](IVec3 at) { all.push_back(at); });
  sort_and_unite(all);
  return all;
}

bool Grid::load_chunk(IVec3 chunk, Chunk voxels) {
  if (!impl().loaded.add(chunk)) return false;
  impl().replace(chunk, std::move(voxels), notifier_);
  return true;
}

bool Grid::unload_chunk(IVec3 chunk) {
  if (!impl().loaded.remove(chunk)) return false;
  impl().replace(chunk, Chunk(kAir), notifier_);
  return true;
}

bool Grid::load_chunk(IVec3 chunk, Chunk voxels, DensityGrid& field, std::optional<DensityChunk> samples) {
  const auto [is_new, is_new_in_field] =
      LoadedChunks::change_both(impl().loaded, field.loaded(), [&](LoadedChunks& loaded) { return loaded.add(chunk); });
  if (is_new) impl().replace(chunk, std::move(voxels), notifier_);
  if (is_new_in_field) field.replace_loaded(chunk, std::move(samples));
  return is_new;
}

bool Grid::unload_chunk(IVec3 chunk, DensityGrid& field) {
  const auto [is_gone, is_gone_in_field] = LoadedChunks::change_both(
      impl().loaded, field.loaded(), [&](LoadedChunks& loaded) { return loaded.remove(chunk); });
  if (is_gone) impl().replace(chunk, Chunk(kAir), notifier_);
  if (is_gone_in_field) field.replace_loaded(chunk, std::nullopt);
  return is_gone;
}

void Grid::share_loaded(DensityGrid& field) const {
  if (field.loaded().is_same(impl().loaded)) field.loaded() = impl().loaded;
}

void Grid::clear() {
  if (impl().entries.empty()) return;
  impl().journal.begin_change();
  impl().entries.for_each([this](IVec3 at, const ChunkEntry& entry) {
    const IBox box = entry.chunk.bounds();
    VoxelRecord record;
    record.chunk = at;
    record.add_box(box);
    if (entry.chunk.data_count() != 0) record.data = record.box;
    std::uint64_t serial = entry.serial;
    impl().note(serial, record);
  });
  impl().entries.clear();
  impl().voxel_count = 0;
  impl().data_count = 0;
  notifier_.notify();
}

const Chunk* Grid::find_chunk(int x, int y, int z) const {
  const ChunkEntry* entry = impl_->entries.find(x, y, z);
  return entry == nullptr ? nullptr : &entry->chunk;
}

std::vector<IVec3> Grid::chunks() const {
  std::vector<IVec3> all;
  all.reserve(impl().entries.size());
  impl().entries.for_each([&](IVec3 at, const ChunkEntry&) { all.push_back(at); });
  std::sort(all.begin(), all.end(), by_zyx);
  return all;
}

std::size_t Grid::chunk_count() const {
  return impl().entries.size();
}

Neighbourhood Grid::neighbourhood(IVec3 chunk) const {
  Neighbourhood result;
  if (!is_loaded_around(chunk)) return result;
  result.origin = chunk * kChunkEdge;
  for (std::size_t i = 0; i < result.chunks.size(); ++i) {
    const IVec3 offset = Neighbourhood::offset(static_cast<int>(i));
    if (has_neighbour(chunk, offset)) result.chunks[i] = find_chunk(chunk + offset);
  }
  return result;
}

GridChanges Grid::changes_since(ChangeCursor& cursor) const {
  GridChanges changes;
  changes_since(cursor, changes);
  return changes;
}

void Grid::changes_since(ChangeCursor& cursor, GridChanges& changes) const {
  impl().journal.changes_since(cursor, by_chunk, changes, [](const VoxelRecord& record, auto& items) {
    if (record.has_types()) items.push_back(record.change());
  });
}

bool Grid::has_changed_since(const ChangeCursor& cursor) const {
  return impl().journal.has_changed_since(cursor, impl().types_serial);
}

DataChanges Grid::data_changes_since(ChangeCursor& cursor) const {
  DataChanges changes;
  impl().journal.changes_since(cursor, by_chunk, changes, [](const VoxelRecord& record, auto& items) {
    if (record.has_data()) items.push_back({record.chunk, record.data.box(), record.is_edit});
  });
  return changes;
}

bool Grid::has_data_changed_since(const ChangeCursor& cursor) const {
  return impl().journal.has_changed_since(cursor, impl().data_serial);
}

ChangeCursor Grid::cursor() const {
  return impl().journal.present();
}

std::vector<IVec3> chunks_to_mesh(const Grid& grid, const GridChanges& changes) {
  if (changes.all) return grid.chunks();
  std::vector<IVec3> chunks;
  for (const ChunkChange& change : changes.items_unless_all()) {
    chunks.push_back(change.chunk);
    for (std::uint32_t left = change.neighbours & ~VoxelRecord::kCentreOnly; left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      const IVec3 at = change.chunk + Neighbourhood::offset(i);
      if (grid.find_chunk(at) != nullptr) chunks.push_back(at);
    }
  }
  sort_and_unite(chunks);
  return chunks;
}

ChunkSlabs ChunkSlabs::of(const IBox& box) {
  QUOIN_ASSERT(intersect(box, kWholeChunk) == box, "within 0 to 64");
  ChunkSlabs slabs;
  if (box.empty()) return slabs;
  const std::uint64_t along_y = (std::uint64_t{2} << ((box.max.y - 1) >> 2)) - (std::uint64_t{1} << (box.min.y >> 2));
  for (int z = box.min.z >> 2; z <= (box.max.z - 1) >> 2; ++z) {
    slabs.words_[static_cast<std::size_t>(z >> 2)] |= along_y << (16 * (z & 3));
  }
  return slabs;
}

namespace {

std::vector<IVec3> chunks_of_either(const Grid& a, const Grid& b) {
  std::vector<IVec3> chunks = a.chunks();
  const std::vector<IVec3> others = b.chunks();
  chunks.insert(chunks.end(), others.begin(), others.end());
  sort_and_unite(chunks);
  return chunks;
}

}  // namespace

void visit_changes(const Grid& before, const Grid& now, const GridChanges& changes,
                   FunctionRef<void(const RowChange&)> visit) {
  const auto compare = [&](IVec3 chunk, const IBox& box, const ChunkSlabs& slabs) {
    if (!before.is_loaded(chunk) || !now.is_loaded(chunk)) return;
    visit_other_rows(before.find_chunk(chunk), now.find_chunk(chunk), chunk, box, slabs, visit);
  };
  if (!changes.all) {
    for (const ChunkChange& change : changes.items_unless_all()) compare(change.chunk, change.box, change.slabs);
    return;
  }
  for (const IVec3 chunk : chunks_of_either(before, now)) compare(chunk, kWholeChunk, ChunkSlabs::all());
}

void visit_data_changes(const Grid& before, const Grid& now, const DataChanges& changes,
                        FunctionRef<void(IVec3 voxel, const VoxelData& before, const VoxelData& now)> visit) {
  std::vector<IVec3> chunks;
  if (changes.all) {
    chunks = chunks_of_either(before, now);
  } else {
    for (const DataChange& change : changes.items_unless_all()) chunks.push_back(change.chunk);
  }
  for (const IVec3 chunk : chunks) {
    if (!before.is_loaded(chunk) || !now.is_loaded(chunk)) continue;
    visit_other_data(before.find_chunk(chunk), now.find_chunk(chunk),
                     [&](IVec3 local, const VoxelData& one, const VoxelData& other) {
                       visit(chunk * kChunkEdge + local, one, other);
                     });
  }
}

IBox Grid::bounds() const {
  return impl().bounds.update(impl().journal, impl().entries);
}

std::int64_t Grid::voxel_count() const {
  return impl().voxel_count;
}

std::vector<VoxelType> Grid::types() const {
  std::set<VoxelType> all;
  impl().entries.for_each([&](IVec3, const ChunkEntry& entry) {
    for (const VoxelType type : entry.chunk.types()) {
      if (type != kAir) all.insert(type);
    }
  });
  return {all.begin(), all.end()};
}

void Grid::for_each_row(FunctionRef<void(IVec3 first, std::span<const VoxelType> types)> visit) const {
  std::array<VoxelType, kChunkEdge> row{};
  for (const IVec3 at : chunks()) {
    const Chunk& chunk = *find_chunk(at);
    const IBox box = chunk.bounds();
    const auto first = static_cast<std::size_t>(box.min.x);
    const auto count = static_cast<std::size_t>(box.max.x - box.min.x);
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        chunk.read_row(y, z, row);
        visit(at * kChunkEdge + IVec3{box.min.x, y, z}, std::span<const VoxelType>(row).subspan(first, count));
      }
    }
  }
}

std::size_t Grid::bytes() const {
  std::size_t total = sizeof(Grid) + sizeof(Impl) + impl().entries.bytes() + impl().loaded.bytes() +
                      impl().journal.bytes() + impl().bounds.bytes();
  impl().entries.for_each([&](IVec3, const ChunkEntry& entry) { total += entry.chunk.bytes() - sizeof(Chunk); });
  return total;
}

void Grid::compact() {
  for (const IVec3 at : chunks()) {
    const ChunkTable::Slot slot = impl().entries.find_to_edit(at);
    slot.entry->chunk.compact();
    impl().entries.voxels_changed(slot);
  }
}

VoxelType GridReader::get_elsewhere(int x, int y, int z) {
  const auto other_yz = static_cast<std::uint32_t>((y ^ last_y_) | (z ^ last_z_));
  const std::uint32_t other = other_yz | static_cast<std::uint32_t>(x ^ last_x_) | unknown_;
  if (other >= kChunkEdge) return get_in_other_chunk(x, y, z);
  if (other_yz != 0) {
    if (goes_on(x)) return get_in_new_row(x, y, z);
    last_y_ = y;
    last_z_ = z;
    reads_of_row_ = 0;
  } else if (++reads_of_row_ == kReadsAlongX) {
    return get_in_new_row(x, y, z);
  }
  if (voxels_ == nullptr) return uniform_;
  return voxels_->type(x & (kChunkEdge - 1), y & (kChunkEdge - 1), z & (kChunkEdge - 1));
}

VoxelType GridReader::get_in_other_chunk(int x, int y, int z) {
  unknown_ = 0;
  chunk_ = grid_->find_chunk(x >> kChunkShift, y >> kChunkShift, z >> kChunkShift);
  voxels_ = chunk_ == nullptr ? nullptr : ChunkStorage::of(*chunk_);
  uniform_ = chunk_ == nullptr ? kAir : chunk_->uniform().value_or(kAir);
  last_x_ = x;
  if (goes_on(x)) return get_in_new_row(x, y, z);
  last_y_ = y;
  last_z_ = z;
  reads_of_row_ = 0;
  if (voxels_ == nullptr) return uniform_;
  return voxels_->type(x & (kChunkEdge - 1), y & (kChunkEdge - 1), z & (kChunkEdge - 1));
}

// Unpacks the row. Requires: it lies in the chunk.
VoxelType GridReader::get_in_new_row(int x, int y, int z) {
  QUOIN_ASSERT(chunk_ == grid_->find_chunk(x >> kChunkShift, y >> kChunkShift, z >> kChunkShift), "a row of the chunk");
  last_y_ = y;
  last_z_ = z;
  reads_of_row_ = kReadsAlongX;
  row_x_ = static_cast<std::uint32_t>(x & ~(kChunkEdge - 1));
  row_yz_ = both(y, z);
  row_length_ = kChunkEdge;
  if (voxels_ == nullptr) {
    row_.fill(uniform_);
  } else {
    chunk_->read_row(y & (kChunkEdge - 1), z & (kChunkEdge - 1), row_);
  }
  return row_[static_cast<std::size_t>(x & (kChunkEdge - 1))];
}

void GridWriter::go_to(int x, int y, int z) {
  flush();
  row_x_ = x & ~(kChunkEdge - 1);
  row_y_ = y;
  row_z_ = z;
}

void GridWriter::flush() {
  const std::uint64_t mask = packed_row::where_equal(is_set_.data(), std::uint8_t{1});
  is_set_.fill(0);
  if (mask != 0) grid_->write_row({row_x_, row_y_, row_z_}, mask, types_);
}

}  // namespace quoin
