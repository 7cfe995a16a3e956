#include "mesh/surface/bodies.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "grid/chunk_order.h"

namespace quoin::smooth {
namespace {

bool holds(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body, bool any_other) {
  const std::vector<VoxelType> materials = chunk.materials().types();
  return std::any_of(materials.begin(), materials.end(), [&](VoxelType material) {
    return material != kAir && (body_of(types, material) == body) != any_other;
  });
}

}  // namespace

bool holds_others(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body) {
  return holds(chunk, types, body, true);
}

DensityChunk without_others(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body) {
  DensityChunk made = whole;
  std::array<Half, kChunkEdge> row;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      std::uint64_t others = whole.solid_row(y, z);
      for (int x = 0; x < kChunkEdge; ++x) {
        const bool is_solid = (others >> x & 1U) != 0;
        const bool is_own = is_solid && body_of(types, whole.materials().get({x, y, z})) == body;
        if (is_own) others &= ~(std::uint64_t{1} << x);
      }
      if (others == 0) continue;
      whole.read_row(y, z, row);
      for (std::size_t x = 0; x < kChunkEdge; ++x) {
        if ((others >> x & 1U) != 0) row[x] &= 0x7FFFU;
      }
      made.write_row(y, z, row);
    }
  }
  made.unite_slabs();
  return made;
}

std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const std::vector<VoxelType>& materials) {
  std::vector<std::uint32_t> bodies;
  for (const VoxelType material : materials) {
    if (material != kAir) bodies.push_back(body_of(types, material));
  }
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const DensityGrid& field) {
  std::vector<VoxelType> transparent;
  if (types.has_transparent()) {
    for (const IVec3 place : field.chunks()) {
      for (const VoxelType material : field.find_chunk(place)->materials().types()) {
        if (types.is_transparent(material)) transparent.push_back(material);
      }
    }
  }
  std::vector<std::uint32_t> bodies = bodies_of(types, transparent);
  bodies.insert(bodies.begin(), 0);
  return bodies;
}

DensityChunk chunk_of_body(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body) {
  return holds_others(whole, types, body) ? without_others(whole, types, body) : whole;
}

DensityGrid field_of_body(const DensityGrid& whole, const VoxelRegistry& types, std::uint32_t body, Threads threads) {
  DensityGrid field(whole.band());
  std::vector<IVec3> places = whole.chunks();
  if (body != 0) {
    std::vector<IVec3> near;
    for (const IVec3 place : places) {
      if (!holds(*whole.find_chunk(place), types, body, false)) continue;
      for (int i = 0; i < 27; ++i) near.push_back(place + Neighbourhood::offset(i));
    }
    sort_and_unite(near);
    std::erase_if(near, [&](IVec3 place) { return whole.find_chunk(place) == nullptr; });
    places = std::move(near);
  }
  std::vector<std::optional<DensityChunk>> made(places.size());
  parallel_for(places.size(), threads,
               [&](std::size_t i) { made[i] = chunk_of_body(*whole.find_chunk(places[i]), types, body); });
  for (std::size_t i = 0; i < places.size(); ++i) field.put_chunk(places[i], std::move(*made[i]));
  return field;
}

}  // namespace quoin::smooth
