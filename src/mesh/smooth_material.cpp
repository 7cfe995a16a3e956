#include "mesh/smooth_material.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/srgb.h"

namespace quoin {
namespace {

constexpr LinearRgba16 kWhite = {65'535, 65'535, 65'535, 65'535};

std::uint16_t linear16(std::uint8_t encoded) {
  return static_cast<std::uint16_t>(std::lround(linear_from_srgb(encoded) * 65'535.0F));
}

// The materials of the solid samples of the closed box from `first`, `count` a side and `step` apart.
std::size_t solid_materials(const DensityNeighbourhood& chunks, IVec3 first, int count, int step, VoxelType* out) {
  std::size_t found = 0;
  for (int z = 0; z < count; ++z) {
    for (int y = 0; y < count; ++y) {
      for (int x = 0; x < count; ++x) {
        const IVec3 sample = first + IVec3{x, y, z} * step;
        const IVec3 offset = chunk_of(sample);
        const DensityChunk* chunk = chunks.at(offset.x, offset.y, offset.z);
        if (chunk == nullptr) continue;
        const IVec3 local = local_of(sample);
        if ((chunk->solid_row(local.y, local.z) >> local.x & 1U) == 0) continue;
        out[found++] = chunk->materials().get(local);
      }
    }
  }
  return found;
}

}  // namespace

SurfaceMaterials::SurfaceMaterials(const VoxelRegistry& types) : albedo_(types.size(), kWhite) {
  std::array<std::uint16_t, 256> decoded;
  for (std::size_t i = 0; i < 256; ++i) decoded[i] = linear16(static_cast<std::uint8_t>(i));
  for (std::size_t i = kAir + 1; i < albedo_.size(); ++i) {
    const Rgba8 colour = types[static_cast<VoxelType>(i)].colour;
    albedo_[i] = {decoded[colour.r], decoded[colour.g], decoded[colour.b], static_cast<std::uint16_t>(colour.a * 257)};
  }
}

LinearRgba16 SurfaceMaterials::albedo(VoxelType type) const {
  return type < albedo_.size() ? albedo_[type] : kWhite;
}

SurfaceMaterial SurfaceMaterials::blend(std::span<VoxelType> solid) const {
  std::sort(solid.begin(), solid.end());
  std::array<std::uint32_t, 4> sum{};
  SurfaceMaterial blended;
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

SurfaceMaterial SurfaceMaterials::of_cell(const DensityNeighbourhood& chunks, IVec3 cell, int level) const {
  const int size = 1 << level;
  const IVec3 first = cell * size;
  const int last = std::max({first.x, first.y, first.z}) + size;
  const DensityChunk* centre = chunks.centre();
  if (last < kChunkEdge && centre != nullptr) {
    if (const auto only = centre->materials().uniform()) return {albedo(*only), *only};
  }
  std::array<VoxelType, 729> solid;
  for (int step = size; step >= 1; step /= 2) {
    const std::size_t found = solid_materials(chunks, first, size / step + 1, step, solid.data());
    if (found != 0) return blend({solid.data(), found});
  }
  return {kWhite, kAir};
}

}  // namespace quoin
