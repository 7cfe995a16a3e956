#include <quoin/grid/density_grid.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include <quoin/core/assert.h>

#include "core/trilinear.h"
#include "grid/density/density_grid_impl.h"
#include "grid/density/density_storage.h"

namespace quoin {

DensityGrid::DensityGrid(float band) : impl_(std::make_unique<Impl>(band)) {}
DensityGrid::DensityGrid(DensityGrid&&) noexcept = default;
DensityGrid& DensityGrid::operator=(DensityGrid&&) noexcept = default;
DensityGrid::~DensityGrid() = default;

DensityGrid::DensityGrid(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

DensityGrid DensityGrid::snapshot() const {
  impl().solid.prepare(impl().store.journal(), impl().store.entries());
  return DensityGrid(std::make_unique<Impl>(impl()));
}

DensityGrid DensityGrid::snapshot(BulkMemory& memory) const {
  impl().solid.prepare(impl().store.journal(), impl().store.entries());
  return DensityGrid(std::unique_ptr<Impl>(new (memory) Impl(impl())));
}

float DensityGrid::band() const {
  return impl().store.band();
}

float DensityGrid::density(IVec3 sample) const {
  return float_from_half(impl_->store.get(sample));
}

VoxelType DensityGrid::material(IVec3 sample) const {
  return impl_->store.material(sample);
}

std::int64_t DensityGrid::put_chunk(IVec3 chunk, DensityChunk samples) {
  const NotifyOnExit notify(impl().store, notifier_);
  return impl().store.put(chunk, std::move(samples));
}

void DensityGrid::make_partial() {
  const NotifyOnExit notify(impl().store, notifier_);
  impl().store.make_partial();
}

bool DensityGrid::is_partial() const {
  return impl().store.loaded().is_partial();
}

void DensityGrid::set_extent(const IBox& chunks, std::span<const IVec3> others) {
  const NotifyOnExit notify(impl().store, notifier_);
  impl().store.set_extent(chunks, others);
}

IBox DensityGrid::extent() const {
  return impl().store.loaded().bounds();
}

bool DensityGrid::load_chunk(IVec3 chunk, DensityChunk samples) {
  const NotifyOnExit notify(impl().store, notifier_);
  return impl().store.load(chunk, std::move(samples));
}

bool DensityGrid::load_air_chunk(IVec3 chunk) {
  return load_chunk(chunk, DensityChunk(impl().store.far()));
}

bool DensityGrid::unload_chunk(IVec3 chunk) {
  const NotifyOnExit notify(impl().store, notifier_);
  return impl().store.unload(chunk);
}

LoadedChunks& DensityGrid::loaded() {
  return impl().store.loaded();
}

void DensityGrid::replace_loaded(IVec3 chunk, std::optional<DensityChunk> samples) {
  const NotifyOnExit notify(impl().store, notifier_);
  impl().store.replace(chunk, samples ? std::move(*samples) : DensityChunk(impl().store.far()));
}

bool DensityGrid::is_loaded(IVec3 chunk) const {
  return impl().store.loaded().has(chunk);
}

bool DensityGrid::is_loaded_around(IVec3 chunk, int distance) const {
  return impl().store.loaded().has_around(chunk, distance);
}

std::vector<IVec3> DensityGrid::loaded_chunks() const {
  std::vector<IVec3> all = chunks();
  if (!is_partial()) return all;
  impl().store.loaded().for_each([&](IVec3 at) { all.push_back(at); });
  sort_and_unite(all);
  return all;
}

bool DensityGrid::is_loaded_within(const IBox& samples) const {
  return impl().store.loaded().has_within(samples);
}

void DensityGrid::clear() {
  const NotifyOnExit notify(impl().store, notifier_);
  impl().store.clear();
}

const DensityChunk* DensityGrid::find_chunk(IVec3 chunk) const {
  const DensityStore::Entry* entry = impl_->store.find(chunk);
  return entry == nullptr ? nullptr : &entry->samples;
}

std::vector<IVec3> DensityGrid::chunks() const {
  return impl().store.chunks();
}

std::size_t DensityGrid::chunk_count() const {
  return impl().store.entries().size();
}

DensityNeighbourhood DensityGrid::neighbourhood(IVec3 chunk) const {
  DensityNeighbourhood result;
  result.outside = impl_->store.far();
  for (std::size_t i = 0; i < result.chunks.size(); ++i) {
    const IVec3 offset = Neighbourhood::offset(static_cast<int>(i));
    if (has_neighbour(chunk, offset)) result.chunks[i] = find_chunk(chunk + offset);
  }
  return result;
}

IBox DensityGrid::solid_bounds() const {
  return impl().solid.update(impl().store.journal(), impl().store.entries());
}

IBox DensityGrid::bounds() const {
  const IBox solid = solid_bounds();
  return solid.empty() ? IBox{} : IBox{solid.min - 1, solid.max};
}

std::int64_t DensityGrid::solid_count() const {
  std::int64_t count = 0;
  impl().store.entries().for_each([&](IVec3, const DensityStore::Entry& entry) {
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) count += std::popcount(entry.samples.solid_row(y, z));
    }
  });
  return count;
}

DensityChanges DensityGrid::changes_since(ChangeCursor& cursor) const {
  DensityChanges changes;
  changes_since(cursor, changes);
  return changes;
}

void DensityGrid::changes_since(ChangeCursor& cursor, DensityChanges& changes) const {
  impl().store.journal().changes_since(cursor, by_chunk, changes);
}

bool DensityGrid::has_changed_since(const ChangeCursor& cursor) const {
  return impl().store.journal().has_changed_since(cursor);
}

ChangeCursor DensityGrid::cursor() const {
  return impl().store.journal().present();
}

std::vector<IVec3> chunks_to_mesh(const DensityGrid& grid, const DensityChanges& changes, int reach) {
  QUOIN_ASSERT(reach >= 0 && reach <= kChunkEdge, "0 <= reach <= 64");
  std::vector<IVec3> chunks;
  const auto add_around = [&](IVec3 chunk, auto&& is_affected) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 offset = Neighbourhood::offset(i);
      if (is_affected(offset)) chunks.push_back(chunk + offset);
    }
  };
  if (changes.all) {
    for (const IVec3 chunk : grid.chunks()) add_around(chunk, [](IVec3) { return true; });
  }
  for (const DensityChange& change : changes.items_unless_all()) {
    add_around(change.chunk, [&](IVec3 offset) { return change.affects(offset, reach); });
  }
  sort_and_unite(chunks);
  return chunks;
}

std::size_t DensityGrid::bytes() const {
  return impl().store.bytes();
}

void DensityGrid::compact() {
  impl().store.compact();
}

namespace {

/// A cell between samples and a point in it.
struct Cell {
  IVec3 low{0};
  DVec3 fraction{0.0};

  /// Returns true if all corners have int32 coordinates; false for NaN.
  bool locate(DVec3 point) {
    constexpr double kLow = -2'147'483'648.0;
    constexpr double kHigh = 2'147'483'647.0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(point[axis] >= kLow && point[axis] < kHigh)) return false;
      const double whole = std::floor(point[axis]);
      low[axis] = static_cast<int>(whole);
      fraction[axis] = point[axis] - whole;
    }
    return true;
  }
};

CellCorners corners_of(const DensityStore& store, IVec3 low) {
  CellCorners corners{};
  const auto find_chunk = [&](IVec3 chunk) {
    const DensityStore::Entry* const entry = store.find(chunk);
    return entry == nullptr ? nullptr : &entry->samples;
  };
  read_cell_corners(
      low, 1, find_chunk, [&] { return store.band(); }, corners.data());
  return corners;
}

}  // namespace

float DensityGrid::density_at(DVec3 point) const {
  Cell cell;
  if (!cell.locate(point)) return band();
  return static_cast<float>(trilinear(corners_of(impl_->store, cell.low), cell.fraction));
}

namespace {

// The densities around a cell of a chunk with storage, from one sample before it to one after it: [z][y][x]. Without
// the rows that are outside the cell along both y and z.
class SamplesAround {
 public:
  // Requires: 1 <= x, y, z <= 61.
  SamplesAround(const DensityStorage& chunk, IVec3 low) {
    for (int i = 0; i < 16; ++i) {
      const int y = i & 3;
      const int z = i >> 2;
      if ((y == 0 || y == 3) && (z == 0 || z == 3)) continue;
      read_row(chunk, low + IVec3{-1, y - 1, z - 1}, at_[z][y]);
    }
  }

  // Returns the corners of the cell that is `shift` cells away.
  [[nodiscard]] CellCorners corners(IVec3 shift) const {
    CellCorners corners;
    for (int i = 0; i < 8; ++i) {
      corners[static_cast<std::size_t>(i)] =
          at_[1 + shift.z + (i >> 2)][1 + shift.y + (i >> 1 & 1)][1 + shift.x + (i & 1)];
    }
    return corners;
  }

 private:
  static void read_row(const DensityStorage& chunk, IVec3 first, float (&row)[4]) {
    const std::uint32_t slab = chunk.slabs[ChunkStorage::slab_index(first.y, first.z)];
    if (!DensityStorage::is_mixed(slab)) {
      std::fill_n(row, 4, float_from_half(static_cast<Half>(slab)));
      return;
    }
    const Half* const samples = chunk.row(slab, ChunkStorage::row_in_slab(first.y, first.z)) + first.x;
    for (int x = 0; x < 4; ++x) row[x] = float_from_half(samples[x]);
  }

  float at_[4][4][4];
};

// Returns the densities one sample before and after a point along an axis. Requires: `point` is in `cell`.
struct TwoDensities {
  float before = 0.0F;
  float after = 0.0F;
};
std::optional<TwoDensities> densities_along(const SamplesAround& around, const DVec3& point, const Cell& cell,
                                            int axis) {
  const auto density_of = [&](double at, int side, float& density) {
    const double whole = std::floor(at);
    if (whole != static_cast<double>(cell.low[axis] + side)) return false;  // the sum was rounded to the next cell
    IVec3 shift{0};
    shift[axis] = side;
    DVec3 fraction = cell.fraction;
    fraction[axis] = at - whole;
    density = static_cast<float>(trilinear(around.corners(shift), fraction));
    return true;
  };
  TwoDensities both;
  const bool are_near = density_of(point[axis] - 1.0, -1, both.before) && density_of(point[axis] + 1.0, 1, both.after);
  return are_near ? std::optional(both) : std::nullopt;
}

// Returns the storage with all samples around a cell, if one chunk has them.
const DensityStorage* storage_around(const DensityGrid& field, IVec3 low) {
  const IVec3 local = local_of(low);
  for (int axis = 0; axis < 3; ++axis) {
    if (local[axis] < 1 || local[axis] > kChunkEdge - 3) return nullptr;
  }
  const DensityChunk* const chunk = field.find_chunk(chunk_of(low));
  return chunk == nullptr ? nullptr : DensityStorage::of(*chunk);
}

}  // namespace

DVec3 density_differences(const DensityGrid& field, const DVec3& point) {
  DVec3 differences;
  Cell cell;
  const DensityStorage* const storage = cell.locate(point) ? storage_around(field, cell.low) : nullptr;
  std::optional<SamplesAround> around;
  if (storage != nullptr) around.emplace(*storage, local_of(cell.low));
  for (int axis = 0; axis < 3; ++axis) {
    const auto both = around ? densities_along(*around, point, cell, axis) : std::nullopt;
    if (both) {
      differences[axis] = double{both->after} - double{both->before};
      continue;
    }
    DVec3 step(0.0);
    step[axis] = 1.0;
    differences[axis] = double{field.density_at(point + step)} - double{field.density_at(point - step)};
  }
  return differences;
}

DVec3 DensityGrid::gradient_at(DVec3 point) const {
  Cell cell;
  if (!cell.locate(point)) return DVec3(0.0);
  return trilinear_gradient(corners_of(impl_->store, cell.low), cell.fraction);
}

namespace {

template <class Holds>
std::uint64_t mask_where(int first, int end, Holds&& holds) {
  std::uint64_t mask = 0;
  for (int x = first; x < end; ++x) mask |= std::uint64_t{holds(static_cast<std::size_t>(x))} << x;
  return mask;
}

std::uint64_t mask_where_not(const std::array<Half, kChunkEdge>& row, Half value) {
  return mask_where(0, kChunkEdge, [&](std::size_t x) { return row[x] != value; });
}

void read_densities(const DensityChunk* samples, Half far, int y, int z, std::array<Half, kChunkEdge>& out) {
  if (samples != nullptr) {
    samples->read_row(y, z, out);
  } else {
    out.fill(far);
  }
}

// Returns true if both rows of densities, and of materials, are uniform and equal.
bool are_one_value(const DensityChunk& a, const DensityChunk& b, int y, int z) {
  if (a.row(y, z) != nullptr || b.row(y, z) != nullptr || a.get(0, y, z) != b.get(0, y, z)) return false;
  const auto material = a.materials().uniform();
  return material.has_value() && material == b.materials().uniform();
}

// Returns true if a row is known to lie beyond the band throughout. Null: there is no chunk.
bool is_far(const DensityChunk* samples, Half far, int y, int z) {
  return samples == nullptr || (samples->row(y, z) == nullptr && samples->get(0, y, z) == far);
}

// Returns true if edits within this band could have stored every density.
[[maybe_unused]] bool is_stored_within(const DensityChunk& samples, Half far) {
  const auto is_stored = [far](Half density) { return stored_within(float_from_half(density), far) == density; };
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const Half* const row = samples.row(y, z);
      if (row == nullptr ? !is_stored(samples.get(0, y, z)) : !std::all_of(row, row + kChunkEdge, is_stored))
        return false;
    }
  }
  return true;
}

}  // namespace

DensityStore::DensityStore(float band) : far_(largest_within(band)) {
  QUOIN_ASSERT(band > 0.0F && band <= kMaxHalf, "0 < band <= 65,504");
}

VoxelType DensityStore::material(IVec3 sample) const {
  const Entry* entry = find(chunk_of(sample));
  if (entry == nullptr) return kAir;
  const IVec3 local = local_of(sample);
  if (entry->samples.get(local.x, local.y, local.z) == far_) return kAir;
  return entry->samples.materials().get(local);
}

void DensityStore::read_row(const DensityChunk& samples, int y, int z, SampleRow& out) const {
  std::array<Half, kChunkEdge> halves;
  samples.read_row(y, z, halves);
  samples.materials().read_row(y, z, out.materials);
  for (std::size_t x = 0; x < kChunkEdge; ++x) {
    out.densities[x] = float_from_half(halves[x]);
    if (halves[x] == far_) out.materials[x] = kAir;
  }
}

std::uint64_t DensityStore::write_row(DensityChunk& samples, int y, int z, int first, int end,
                                      const SampleRow& row) const {
  QUOIN_ASSERT(first >= 0 && first < end && end <= kChunkEdge, "0 <= first < end <= 64");
  std::array<Half, kChunkEdge> halves;
  samples.read_row(y, z, halves);
  const std::uint64_t had_material = mask_where_not(halves, far_);
  for (int x = first; x < end; ++x) {
    halves[static_cast<std::size_t>(x)] = stored_within(row.densities[static_cast<std::size_t>(x)], far_);
  }
  const std::uint64_t changed = samples.write_row(y, z, halves);
  const std::uint64_t has_material = mask_where(first, end, [&](std::size_t x) { return halves[x] != far_; });
  std::uint64_t repainted = 0;
  for (std::uint64_t left = has_material; left != 0;) {
    const VoxelType type = row.materials[static_cast<std::size_t>(std::countr_zero(left))];
    const std::uint64_t same = left & mask_where(first, end, [&](std::size_t x) { return row.materials[x] == type; });
    repainted |= samples.materials().fill_row(y, z, same, type);
    left &= ~same;
  }
  return changed | (repainted & had_material);
}

ChangeReach DensityStore::differences(const DensityChunk* before, const DensityChunk* after) const {
  ChangeReach changes;
  std::array<Half, kChunkEdge> old_row;
  std::array<Half, kChunkEdge> new_row;
  std::array<VoxelType, kChunkEdge> old_materials{};
  std::array<VoxelType, kChunkEdge> new_materials{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const bool are_both = before != nullptr && after != nullptr;
      if (are_both ? are_one_value(*before, *after, y, z) : is_far(before == nullptr ? after : before, far_, y, z))
        continue;
      read_densities(before, far_, y, z, old_row);
      read_densities(after, far_, y, z, new_row);
      if (are_both) {
        before->materials().read_row(y, z, old_materials);
        after->materials().read_row(y, z, new_materials);
      }
      changes.add(y, z, mask_where(0, kChunkEdge, [&](std::size_t x) {
                    return old_row[x] != new_row[x] || (new_row[x] != far_ && old_materials[x] != new_materials[x]);
                  }));
    }
  }
  return changes;
}

DensityStore::Entry& DensityStore::find_or_create(IVec3 chunk) {
  const auto stay = [](auto&) {};
  if (Entry* entry = entries_.find_to_edit(chunk, stay)) return *entry;
  Entry& made = entries_.find_or_create(chunk, stay);
  made.samples = DensityChunk(far_);
  return made;
}

void DensityStore::finish_edit(IVec3 chunk, Entry& entry, const ChangeReach& changes, bool has_even_row, bool is_edit) {
  QUOIN_ASSERT(find(chunk) == &entry, "the entry is the chunk's");
  if (changes.samples != 0) {
    ++edits_;
    journal_.note(entry.serial, {chunk, changes, is_edit}, entries_.size());
    if (has_even_row) entry.samples.unite_slabs();
  }
  if (entry.samples.uniform() == far_) entries_.erase(chunk, [](auto&) {});
}

std::int64_t DensityStore::make_solid(IVec3 chunk, VoxelType material) {
  Entry& entry = find_or_create(chunk);
  entry.samples = DensityChunk(stored_within(-band(), far_), material);
  ChangeReach changes;
  changes.add_all();
  finish_edit(chunk, entry, changes, false);
  return changes.samples;
}

std::int64_t DensityStore::put(IVec3 chunk, DensityChunk samples) {
  QUOIN_ASSERT(is_stored_within(samples, far_), "densities are stored_density of the band");
  if (!loaded_.may_edit(chunk)) return 0;
  samples.unite_slabs();
  const Entry* present = find(chunk);
  if (present != nullptr && present->samples.shares_storage_with(samples)) return 0;
  const ChangeReach changes = differences(present == nullptr ? nullptr : &present->samples, &samples);
  if (present == nullptr && changes.samples == 0) return 0;
  journal_.begin_change();
  Entry& entry = find_or_create(chunk);
  entry.samples = std::move(samples);
  finish_edit(chunk, entry, changes, false);
  return changes.samples;
}

// Skips the per-sample checks of `put`: chunks are loaded on threads that must not wait.
void DensityStore::replace(IVec3 chunk, DensityChunk samples) {
  samples.unite_slabs();
  journal_.begin_change();
  ChangeReach all;
  all.add_all();
  if (samples.uniform() == far_ && find(chunk) == nullptr) {  // air replaces nothing: no chunk is created or removed
    ++edits_;
    std::uint64_t serial = 0;
    return journal_.note(serial, {chunk, all, false}, entries_.size());
  }
  Entry& entry = find_or_create(chunk);
  entry.samples = std::move(samples);
  finish_edit(chunk, entry, all, false, false);
}

void DensityStore::make_partial() {
  clear();
  ++edits_;
  loaded_.begin();
}

void DensityStore::set_extent(const IBox& chunks, std::span<const IVec3> others) {
  QUOIN_ASSERT(loaded_.is_partial(), "a partial field");
  LoadedChunks next = loaded_;
  entries_.for_each([&](IVec3 at, const Entry&) { next.mark(at); });
  next.set_extent(chunks, others);
  loaded_ = std::move(next);
  ++edits_;
  journal_.begin_change();
  loaded_.for_each([this](IVec3 at) {
    ChangeReach all;
    all.add_all();
    std::uint64_t serial = 0;
    journal_.note(serial, {at, all, false}, entries_.size());
  });
}

bool DensityStore::load(IVec3 chunk, DensityChunk samples) {
  if (!loaded_.add(chunk)) return false;
  replace(chunk, std::move(samples));
  return true;
}

bool DensityStore::unload(IVec3 chunk) {
  if (!loaded_.remove(chunk)) return false;
  replace(chunk, DensityChunk(far_));
  return true;
}

void DensityStore::clear() {
  if (entries_.size() == 0) return;
  ++edits_;
  journal_.begin_change();
  entries_.for_each([this](IVec3 at, const Entry& entry) {
    std::uint64_t serial = entry.serial;
    journal_.note(serial, {at, differences(&entry.samples, nullptr)}, entries_.size());
  });
  entries_.clear();
}

std::vector<IVec3> DensityStore::chunks() const {
  std::vector<IVec3> all;
  all.reserve(entries_.size());
  entries_.for_each([&](IVec3 at, const Entry&) { all.push_back(at); });
  std::sort(all.begin(), all.end(), by_zyx);
  return all;
}

std::size_t DensityStore::bytes() const {
  std::size_t total =
      sizeof(DensityGrid) + sizeof(DensityStore) + entries_.bytes() + loaded_.bytes() + journal_.bytes();
  entries_.for_each([&](IVec3, const Entry& entry) { total += entry.samples.bytes() - sizeof(DensityChunk); });
  return total;
}

void DensityStore::compact() {
  for (const IVec3 at : chunks()) find_or_create(at).samples.compact();
}

}  // namespace quoin
