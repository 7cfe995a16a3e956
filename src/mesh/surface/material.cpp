#include "mesh/surface/material.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <quoin/core/assert.h>

#include "core/srgb.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

constexpr LinearRgba16 kWhite = {65'535, 65'535, 65'535, 65'535};

std::uint16_t linear16(std::uint8_t encoded) {
  return static_cast<std::uint16_t>(std::lround(linear_from_srgb(encoded) * 65'535.0F));
}

bool is_solid(const DensityNeighbourhood& chunks, IVec3 sample) {
  return DensityChunk::is_solid(chunks.get(sample));
}

VoxelType material_at(const DensityNeighbourhood& chunks, IVec3 sample) {
  const IVec3 offset = chunk_of(sample);
  const DensityChunk* chunk = chunks.at(offset.x, offset.y, offset.z);
  return chunk == nullptr ? kAir : chunk->materials().get(local_of(sample));
}

// Reads the materials of the solid corners of a cell within a chunk, row by row.
std::size_t materials_of_corners(const DensityChunk& chunk, IVec3 first, VoxelType* out) {
  const ChunkStorage* mixed = ChunkStorage::of(chunk.materials());
  QUOIN_ASSERT(mixed != nullptr, "several materials");
  std::size_t found = 0;
  for (int row = 0; row < 4; ++row) {
    const int y = first.y + (row & 1);
    const int z = first.z + (row >> 1);
    const auto solid = static_cast<std::uint32_t>(chunk.solid_row(y, z) >> first.x & 3U);
    if (solid == 0) continue;
    const std::uint32_t slab = mixed->slabs[ChunkStorage::slab_index(y, z)];
    const bool is_uniform = (slab & ChunkStorage::kUniformSlab) != 0;
    for (int x = 0; x < 2; ++x) {
      if ((solid >> x & 1U) == 0) continue;
      const std::uint32_t index = is_uniform ? slab & ~ChunkStorage::kUniformSlab
                                             : mixed->read(slab, ChunkStorage::row_in_slab(y, z), first.x + x);
      out[found++] = mixed->direct() ? static_cast<VoxelType>(index) : mixed->palette[index];
    }
  }
  return found;
}

// Reads the materials of the solid samples in the closed box that starts at `first`, `count` per side and `step` apart.
std::size_t solid_materials(const DensityNeighbourhood& chunks, IVec3 first, int count, int step, VoxelType* out) {
  std::size_t found = 0;
  for (int z = 0; z < count; ++z) {
    for (int y = 0; y < count; ++y) {
      for (int x = 0; x < count; ++x) {
        const IVec3 sample = first + IVec3{x, y, z} * step;
        if (is_solid(chunks, sample)) out[found++] = material_at(chunks, sample);
      }
    }
  }
  return found;
}

// Reads the materials of the solid samples nearest to the surface along the crossed edges of a cell of width `size`:
// the top layer of the ground, even if the corners are far below it.
std::size_t materials_under_crossings(const DensityNeighbourhood& chunks, IVec3 first, int size, VoxelType* out) {
  std::size_t found = 0;
  for (int edge = 0; edge < 12; ++edge) {
    const int axis = edge / 4;
    IVec3 solid = first;
    solid[(axis + 1) % 3] += (edge & 1) * size;
    solid[(axis + 2) % 3] += (edge >> 1 & 1) * size;
    IVec3 air = solid;
    air[axis] += size;
    if (is_solid(chunks, solid) == is_solid(chunks, air)) continue;
    if (is_solid(chunks, air)) std::swap(solid, air);
    for (int width = size / 2; width >= 1; width /= 2) {
      const IVec3 middle = (solid + air) / 2;
      (is_solid(chunks, middle) ? solid : air) = middle;
    }
    out[found++] = material_at(chunks, solid);
  }
  return found;
}

}  // namespace

LinearRgba16 linear_colour_of(Rgba8 colour) {
  return {linear16(colour.r), linear16(colour.g), linear16(colour.b), static_cast<std::uint16_t>(colour.a * 257)};
}

SurfaceMaterials::SurfaceMaterials(const VoxelRegistry& types) : albedo_(types.size(), kWhite) {
  std::array<std::uint16_t, 256> linear;
  for (std::size_t i = 0; i < 256; ++i) linear[i] = linear16(static_cast<std::uint8_t>(i));
  const auto decoded = [&](Rgba8 colour) -> LinearRgba16 {
    return {linear[colour.r], linear[colour.g], linear[colour.b], static_cast<std::uint16_t>(colour.a * 257)};
  };
  for (std::size_t i = kAir + 1; i < albedo_.size(); ++i) {
    albedo_[i] = decoded(types[static_cast<VoxelType>(i)].colour);
  }
}

LinearRgba16 SurfaceMaterials::albedo(VoxelType type) const {
  return type < albedo_.size() ? albedo_[type] : kWhite;
}

CellMaterial SurfaceMaterials::blend(std::span<VoxelType> solid) const {
  QUOIN_ASSERT(!solid.empty(), "at least one material");
  if (std::all_of(solid.begin(), solid.end(), [&](VoxelType type) { return type == solid[0]; })) {
    return {albedo(solid[0]), solid[0]};
  }
  std::sort(solid.begin(), solid.end());
  std::array<std::uint32_t, 4> sum{};
  CellMaterial blended;
  std::size_t most = 0;
  for (auto first = solid.begin(); first != solid.end();) {
    const auto end = std::upper_bound(first, solid.end(), *first);
    const auto count = static_cast<std::size_t>(end - first);
    const LinearRgba16 colour = albedo(*first);
    for (std::size_t i = 0; i < 4; ++i) sum[i] += static_cast<std::uint32_t>(count) * colour[i];
    if (count > most) {
      most = count;
      blended.type = *first;
    }
    first = end;
  }
  const auto total = static_cast<std::uint32_t>(solid.size());
  for (std::size_t i = 0; i < 4; ++i) blended.albedo[i] = static_cast<std::uint16_t>((sum[i] + total / 2) / total);
  return blended;
}

CellMaterial SurfaceMaterials::of_cell(const DensityNeighbourhood& chunks, IVec3 cell, int level) const {
  QUOIN_ASSERT(level >= 0 && level <= kMaxSmoothLevel, "a level of detail");
  const int size = 1 << level;
  const IVec3 first = cell * size;
  std::array<VoxelType, 729> solid;
  std::size_t found = 0;
  const DensityChunk* centre = chunks.centre();
  if (centre != nullptr && std::min({first.x, first.y, first.z}) >= 0 &&
      std::max({first.x, first.y, first.z}) + size < kChunkEdge) {
    if (const auto only = centre->materials().uniform()) return {albedo(*only), *only};
    if (level == 0) found = materials_of_corners(*centre, first, solid.data());
  }
  if (level > 0) found = materials_under_crossings(chunks, first, size, solid.data());
  if (found != 0) return blend({solid.data(), found});
  for (int step = size; step >= 1; step /= 2) {
    found = solid_materials(chunks, first, size / step + 1, step, solid.data());
    if (found != 0) return blend({solid.data(), found});
  }
  return {kWhite, kAir};
}

}  // namespace quoin
