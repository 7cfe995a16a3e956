#include <quoin/grid/density_grid.h>

#include <bit>
#include <cmath>
#include <utility>

#include "grid/density_grid_impl.h"

namespace quoin {

DensityGrid::DensityGrid(float band) : impl_(std::make_unique<Impl>(Impl{DensityStore(band)})) {}
DensityGrid::DensityGrid(DensityGrid&&) noexcept = default;
DensityGrid& DensityGrid::operator=(DensityGrid&&) noexcept = default;
DensityGrid::~DensityGrid() = default;

DensityGrid DensityGrid::clone() const {
  DensityGrid copy;
  copy.impl_ = std::make_unique<Impl>(*impl_);
  return copy;
}

float DensityGrid::band() const {
  return impl_->store.band();
}

float DensityGrid::density(IVec3 sample) const {
  return float_from_half(impl_->store.get(sample));
}

VoxelType DensityGrid::material(IVec3 sample) const {
  return impl_->store.material(sample);
}

void DensityGrid::put_chunk(IVec3 chunk, DensityChunk samples) {
  impl_->store.put(chunk, std::move(samples));
}

void DensityGrid::clear() {
  impl_->store.clear();
}

const DensityChunk* DensityGrid::find_chunk(IVec3 chunk) const {
  const DensityStore::Entry* entry = impl_->store.find(chunk);
  return entry == nullptr ? nullptr : &entry->samples;
}

std::vector<IVec3> DensityGrid::chunks() const {
  return impl_->store.chunks();
}

std::size_t DensityGrid::chunk_count() const {
  return impl_->store.entries().size();
}

DensityNeighbourhood DensityGrid::neighbourhood(IVec3 chunk) const {
  DensityNeighbourhood result;
  result.outside = impl_->store.far();
  std::size_t i = 0;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) result.chunks[i++] = find_chunk(chunk + IVec3{dx, dy, dz});
    }
  }
  return result;
}

IBox DensityGrid::solid_bounds() const {
  IBox box;
  for (const auto& [at, entry] : impl_->store.entries()) {
    IBox inside;
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        const std::uint64_t solid = entry->samples.solid_row(y, z);
        if (solid == 0) continue;
        inside = unite(inside, {{std::countr_zero(solid), y, z}, {kChunkEdge - std::countl_zero(solid), y + 1, z + 1}});
      }
    }
    if (!inside.empty()) box = unite(box, {inside.min + at * kChunkEdge, inside.max + at * kChunkEdge});
  }
  return box;
}

std::int64_t DensityGrid::solid_count() const {
  std::int64_t count = 0;
  for (const auto& [at, entry] : impl_->store.entries()) {
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) count += std::popcount(entry->samples.solid_row(y, z));
    }
  }
  return count;
}

std::uint64_t DensityGrid::version(IVec3 chunk) const {
  const DensityStore::Entry* entry = impl_->store.find(chunk);
  return entry == nullptr ? 0 : entry->version;
}

std::uint64_t DensityGrid::version() const {
  return impl_->store.version();
}

std::vector<IVec3> DensityGrid::take_dirty(int reach) {
  return impl_->store.take_dirty(reach);
}

std::size_t DensityGrid::bytes() const {
  return impl_->store.bytes();
}

void DensityGrid::compact() {
  impl_->store.compact();
}

}  // namespace quoin
