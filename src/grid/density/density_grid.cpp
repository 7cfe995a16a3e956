#include <quoin/grid/density_grid.h>

#include <algorithm>
#include <bit>
#include <utility>

#include <quoin/core/assert.h>

#include "grid/density/density_grid_impl.h"

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
  const NoticeOfEdits notice(impl().store, notice_);
  return impl().store.put(chunk, std::move(samples));
}

void DensityGrid::make_partial() {
  const NoticeOfEdits notice(impl().store, notice_);
  impl().store.make_partial();
}

bool DensityGrid::is_partial() const {
  return impl().store.loaded().is_partial();
}

bool DensityGrid::load_chunk(IVec3 chunk, DensityChunk samples) {
  const NoticeOfEdits notice(impl().store, notice_);
  return impl().store.load(chunk, std::move(samples));
}

bool DensityGrid::load_air_chunk(IVec3 chunk) {
  return load_chunk(chunk, DensityChunk(impl().store.far()));
}

bool DensityGrid::unload_chunk(IVec3 chunk) {
  const NoticeOfEdits notice(impl().store, notice_);
  return impl().store.unload(chunk);
}

bool DensityGrid::is_loaded(IVec3 chunk) const {
  return impl().store.loaded().has(chunk);
}

bool DensityGrid::is_loaded_around(IVec3 chunk, int distance) const {
  return impl().store.loaded().has_around(chunk, distance);
}

std::vector<IVec3> DensityGrid::loaded_chunks() const {
  const LoadedChunks& loaded = impl().store.loaded();
  return loaded.is_partial() ? loaded.sorted() : chunks();
}

bool DensityGrid::is_loaded_within(const IBox& samples) const {
  return impl().store.loaded().has_within(samples);
}

void DensityGrid::clear() {
  const NoticeOfEdits notice(impl().store, notice_);
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
  return impl().store.journal().changes_since<DensityChange>(cursor, by_chunk);
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
  for (const DensityChange& change : changes.items) {
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

}  // namespace quoin
