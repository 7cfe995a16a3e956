#include "mesh/surface/bodies.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "core/coordinates/chunk_order.h"
#include "grid/density/density_storage.h"

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

// For the opaque body, lists the transparent types, which are the others. For a transparent body, lists its own type.
OtherBodies::OtherBodies(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body)
    : chunk_(chunk), listed_(chunk.materials().types()), listed_are_others_(body == 0) {
  std::erase_if(listed_, [&](VoxelType material) {
    return material == kAir ||
           (listed_are_others_ ? !types.is_transparent(material) : body_of(types, material) != body);
  });
}

std::uint64_t OtherBodies::row(int y, int z) const {
  const std::uint64_t solid = chunk_.solid_row(y, z);
  std::uint64_t listed = 0;
  for (std::size_t i = 0; i < listed_.size() && solid != 0; ++i)
    listed |= chunk_.materials().row_mask(y, z, listed_[i]);
  return solid & (listed_are_others_ ? listed : ~listed);
}

DensityChunk without_others(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body) {
  const OtherBodies bodies(whole, types, body);
  std::array<std::uint64_t, kChunkEdge * kChunkEdge> others;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) others[static_cast<std::size_t>(z * kChunkEdge + y)] = bodies.row(y, z);
  }
  DensityChunk made = whole;
  DensityStorage::turn_outward(made, others);
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
