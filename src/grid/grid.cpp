#include <quoin/grid/grid.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <set>

#include "grid/chunk_order.h"
#include "grid/chunk_table.h"
#include "grid/long_box.h"
#include "grid/reach.h"

namespace quoin {
namespace {

std::uint64_t next_identity() {
  static std::atomic<std::uint64_t> count{0};
  return count.fetch_add(1, std::memory_order_relaxed) + 1;
}

}  // namespace

struct Grid::Impl {
  ChunkTable entries;
  std::vector<IVec3> dirty;  // a chunk that was dropped and came again may stand in it more than once
  std::uint64_t version = 0;
  std::uint64_t identity = next_identity();

  // Books that the mesh of a chunk may have changed.
  void touch(const IVec3& chunk, ChunkEntry& entry) {
    entry.neighbourhood_version = version;
    if (entry.is_dirty) return;
    if (dirty.size() == dirty.capacity()) make_room_in_dirty();
    dirty.push_back(chunk);
    entry.is_dirty = true;
  }

  // Chunks that come and go would let the list grow for ever where nobody takes it.
  void make_room_in_dirty() {
    sort_and_unite(dirty);
    dirty.reserve(std::max<std::size_t>(16, 2 * dirty.size()));
  }

  // Books an edit of one chunk: versions, dirty neighbours, and the chunk dropped where nothing is left in it.
  void finish_edit(const IVec3& chunk, ChunkEntry& entry, const Reach& reach) {
    // Before anything that may throw: the storage that was known may be gone.
    entries.voxels_changed(chunk, entry);
    if (reach.voxels != 0) {
      entry.version = version;
      touch(chunk, entry);
      if (reach.mask != Reach::kCentreOnly) touch_neighbours(chunk, reach.mask);
    }
    if (entry.chunk.non_air_count() == 0) entries.erase(chunk);
  }

  void touch_neighbours(const IVec3& chunk, std::uint32_t mask) {
    for (std::uint32_t left = mask & ~Reach::kCentreOnly; left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      const IVec3 at = chunk + IVec3{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
      if (ChunkEntry* neighbour = entries.find(at)) touch(at, *neighbour);
    }
  }

  // Calls `change(chunk, entry, part of the box in chunk coordinates, reach)` for every chunk of a box. Chunks that are
  // not there are created where `create`, left out otherwise.
  template <class Change>
  std::int64_t edit_box(const LongBox& wanted, bool create, Change&& change);
};

template <class Change>
std::int64_t Grid::Impl::edit_box(const LongBox& wanted, bool create, Change&& change) {
  const LongBox box = clipped(wanted);
  if (is_empty(box)) return 0;
  const IBox chunks = chunks_of(box);
  ++version;
  std::int64_t changed = 0;
  const auto edit_chunk = [&](IVec3 chunk, ChunkEntry& entry) {
    Reach reach;
    entries.voxels_will_change(chunk);
    try {
      change(chunk, entry.chunk, part_of(box, chunk), reach);
    } catch (...) {
      reach.add_all();
      finish_edit(chunk, entry, reach);
      throw;
    }
    changed += reach.voxels;
    finish_edit(chunk, entry, reach);
  };
  if (create) {
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) edit_chunk({x, y, z}, entries.find_or_create({x, y, z}));
      }
    }
  } else {
    std::vector<IVec3> present;
    entries.for_each([&](IVec3 at, const ChunkEntry&) {
      if (chunks.contains(at)) present.push_back(at);
    });
    std::sort(present.begin(), present.end(), by_zyx);
    for (const IVec3 at : present) edit_chunk(at, *entries.find(at));
  }
  if (changed == 0) --version;
  return changed;
}

Grid::Grid() : impl_(std::make_unique<Impl>()) {}
Grid::Grid(Grid&&) noexcept = default;
Grid& Grid::operator=(Grid&&) noexcept = default;
Grid::~Grid() = default;

Grid Grid::clone() const {
  Grid copy;
  copy.impl_->version = impl_->version;
  copy.impl_->dirty = impl_->dirty;
  impl_->entries.for_each([&](IVec3 at, const ChunkEntry& entry) {
    ChunkEntry& made = copy.impl_->entries.find_or_create(at);
    made = entry;
    copy.impl_->entries.voxels_changed(at, made);
  });
  return copy;
}

VoxelType Grid::get(int x, int y, int z) const {
  return impl_->entries.voxel(x, y, z);
}

bool Grid::set(int x, int y, int z, VoxelType type) {
  const IVec3 at{x >> kChunkShift, y >> kChunkShift, z >> kChunkShift};
  const IVec3 local{x & (kChunkEdge - 1), y & (kChunkEdge - 1), z & (kChunkEdge - 1)};
  ChunkEntry* entry = impl_->entries.find(at);
  if (entry == nullptr) {
    if (type == kAir || !is_inside_world(at)) return false;
    entry = &impl_->entries.find_or_create(at);
  }
  Reach reach;
  try {
    if (!entry->chunk.set(local, type)) return false;
  } catch (...) {
    impl_->finish_edit(at, *entry, reach);
    throw;
  }
  ++impl_->version;
  const auto is_inner = [](int i) { return i != 0 && i != kChunkEdge - 1; };
  if (is_inner(local.x) && is_inner(local.y) && is_inner(local.z)) {
    impl_->finish_edit(at, *entry, {.voxels = 1, .mask = Reach::kCentreOnly});
    return true;
  }
  reach.add(local.y, local.z, std::uint64_t{1} << local.x);
  impl_->finish_edit(at, *entry, reach);
  return true;
}

std::int64_t Grid::set_row(IVec3 row, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types) {
  const IVec3 at = chunk_of(row);
  const IVec3 local = local_of(row);
  if (mask == 0 || !is_inside_world(at)) return 0;
  ChunkEntry& entry = impl_->entries.find_or_create(at);
  ++impl_->version;
  Reach reach;
  try {
    reach.add(local.y, local.z, entry.chunk.write_row(local.y, local.z, mask, types));
  } catch (...) {
    reach.add_all();
    impl_->finish_edit(at, entry, reach);
    throw;
  }
  if (reach.voxels == 0) --impl_->version;
  impl_->finish_edit(at, entry, reach);
  return reach.voxels;
}

std::int64_t Grid::fill_box(IVec3 first, IVec3 last, VoxelType type) {
  const LongBox box = box_from(glm::min(first, last), glm::max(first, last));
  return impl_->edit_box(box, type != kAir, [&](IVec3, Chunk& chunk, const IBox& part, Reach& reach) {
    chunk.fill_box(part, type, [&](int y, int z, std::uint64_t changed) { reach.add(y, z, changed); });
  });
}

std::int64_t Grid::fill_sphere(DVec3 centre, double radius, VoxelType type) {
  if (!(radius >= 0.0) || !is_finite(centre)) return 0;
  const LongBox box = box_around(centre - radius, centre + radius);
  return impl_->edit_box(box, type != kAir, [&](IVec3 at, Chunk& chunk, const IBox& part, Reach& reach) {
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
        const std::uint64_t changed = chunk.set_row(y, z, mask, type);
        if (changed != 0) reach.add(y, z, changed);
      }
    }
  });
}

std::int64_t Grid::edit(const IBox& wanted, const std::function<VoxelType(IVec3 voxel, VoxelType current)>& pick) {
  return impl_->edit_box(box_from(wanted), true, [&](IVec3 at, Chunk& chunk, const IBox& part, Reach& reach) {
    std::array<VoxelType, kChunkEdge> row{};
    for (int z = part.min.z; z < part.max.z; ++z) {
      for (int y = part.min.y; y < part.max.y; ++y) {
        chunk.read_row(y, z, row);
        for (int x = part.min.x; x < part.max.x; ++x) {
          VoxelType& type = row[static_cast<std::size_t>(x)];
          type = pick(at * kChunkEdge + IVec3{x, y, z}, type);
        }
        const std::uint64_t changed = chunk.write_row(y, z, row);
        if (changed != 0) reach.add(y, z, changed);
      }
    }
  });
}

void Grid::put_chunk(IVec3 at, Chunk voxels) {
  if (!is_inside_world(at)) return;
  ChunkEntry* present = impl_->entries.find(at);
  if (present == nullptr && voxels.non_air_count() == 0) return;
  ChunkEntry& entry = present != nullptr ? *present : impl_->entries.find_or_create(at);
  Reach reach;
  std::array<VoxelType, kChunkEdge> old_row{};
  std::array<VoxelType, kChunkEdge> new_row{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      if (present == nullptr) {
        reach.add(y, z, ~voxels.row_mask(y, z, kAir));
        continue;
      }
      entry.chunk.read_row(y, z, old_row);
      voxels.read_row(y, z, new_row);
      std::uint64_t changed = 0;
      for (std::size_t x = 0; x < kChunkEdge; ++x) changed |= std::uint64_t{old_row[x] != new_row[x]} << x;
      if (changed != 0) reach.add(y, z, changed);
    }
  }
  entry.chunk = std::move(voxels);
  if (reach.voxels != 0) ++impl_->version;
  impl_->finish_edit(at, entry, reach);
}

void Grid::clear() {
  if (impl_->entries.empty()) return;
  ++impl_->version;
  impl_->entries.for_each([&](IVec3 at, ChunkEntry& entry) { impl_->touch(at, entry); });
  impl_->entries.clear();
}

const Chunk* Grid::find_chunk(int x, int y, int z) const {
  const ChunkEntry* entry = impl_->entries.find(x, y, z);
  return entry == nullptr ? nullptr : &entry->chunk;
}

std::vector<IVec3> Grid::chunks() const {
  std::vector<IVec3> all;
  all.reserve(impl_->entries.size());
  impl_->entries.for_each([&](IVec3 at, const ChunkEntry&) { all.push_back(at); });
  std::sort(all.begin(), all.end(), by_zyx);
  return all;
}

std::size_t Grid::chunk_count() const {
  return impl_->entries.size();
}

Neighbourhood Grid::neighbourhood(IVec3 chunk) const {
  Neighbourhood result;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        result.chunks[Neighbourhood::index(dx, dy, dz)] = find_chunk(chunk + IVec3{dx, dy, dz});
      }
    }
  }
  return result;
}

std::uint64_t Grid::version(IVec3 chunk) const {
  const ChunkEntry* entry = impl_->entries.find(chunk);
  return entry == nullptr ? 0 : entry->version;
}

std::uint64_t Grid::neighbourhood_version(IVec3 chunk) const {
  const ChunkEntry* entry = impl_->entries.find(chunk);
  return entry == nullptr ? 0 : entry->neighbourhood_version;
}

std::uint64_t Grid::version() const {
  return impl_->version;
}

std::uint64_t Grid::identity() const {
  return impl_->identity;
}

std::vector<IVec3> Grid::take_dirty() {
  std::vector<IVec3> taken = std::move(impl_->dirty);
  impl_->dirty.clear();
  for (const IVec3 at : taken) {
    if (ChunkEntry* entry = impl_->entries.find(at)) entry->is_dirty = false;
  }
  sort_and_unite(taken);
  return taken;
}

IBox Grid::bounds() const {
  IBox box;
  impl_->entries.for_each([&](IVec3 at, const ChunkEntry& entry) {
    const IBox inside = entry.chunk.bounds();
    box = unite(box, {inside.min + at * kChunkEdge, inside.max + at * kChunkEdge});
  });
  return box;
}

std::int64_t Grid::voxel_count() const {
  std::int64_t total = 0;
  impl_->entries.for_each([&](IVec3, const ChunkEntry& entry) { total += entry.chunk.non_air_count(); });
  return total;
}

std::vector<VoxelType> Grid::types() const {
  std::set<VoxelType> all;
  impl_->entries.for_each([&](IVec3, const ChunkEntry& entry) {
    for (const VoxelType type : entry.chunk.types()) {
      if (type != kAir) all.insert(type);
    }
  });
  return {all.begin(), all.end()};
}

void Grid::for_each(const std::function<void(IVec3 voxel, VoxelType type)>& visit) const {
  std::array<VoxelType, kChunkEdge> row{};
  for (const IVec3 at : chunks()) {
    const Chunk& chunk = *find_chunk(at);
    const IBox box = chunk.bounds();
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        chunk.read_row(y, z, row);
        for (int x = box.min.x; x < box.max.x; ++x) {
          const VoxelType type = row[static_cast<std::size_t>(x)];
          if (type != kAir) visit(at * kChunkEdge + IVec3{x, y, z}, type);
        }
      }
    }
  }
}

std::size_t Grid::bytes() const {
  std::size_t total = sizeof(Grid) + sizeof(Impl) + impl_->entries.bytes() + impl_->dirty.capacity() * sizeof(IVec3);
  impl_->entries.for_each(
      [&](IVec3, const ChunkEntry& entry) { total += sizeof(ChunkEntry) - sizeof(Chunk) + entry.chunk.bytes(); });
  return total;
}

void Grid::compact() {
  impl_->entries.for_each([&](IVec3 at, ChunkEntry& entry) {
    entry.chunk.compact();
    impl_->entries.voxels_changed(at, entry);
  });
}

}  // namespace quoin
