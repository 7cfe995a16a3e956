#include "render/light/propagated/chunk_masks.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "render/light/propagated/kernel/light_kernel.h"
#include "trace/chunk_rows.h"

namespace quoin::propagated {
LightLevels lamp_levels(const VoxelProperties& properties) {
  const float strength = 15.0F * std::clamp(properties.emission, 0.0F, 1.0F);
  const Rgba8& colour = properties.colour;
  const float greatest = std::max({colour.r, colour.g, colour.b, std::uint8_t{1}});
  const auto level = [&](std::uint8_t channel) {
    return static_cast<std::uint8_t>(std::lround(strength * static_cast<float>(channel) / greatest));
  };
  return {0, level(colour.r), level(colour.g), level(colour.b)};
}

CoveredSides::CoveredSides(const Grid& grid, const VoxelRegistry* types, const std::vector<TypeLight>& lights,
                           IVec3 chunk)
    : types_(types) {
  const Chunk* voxels = types == nullptr ? nullptr : grid.find_chunk(chunk);
  if (voxels == nullptr) return;
  for (const VoxelType type : voxels->types()) {
    if (type < lights.size() && lights[type].has_sides) shaped_.push_back(type);
  }
  if (!shaped_.empty()) near_ = grid.neighbourhood(chunk);
}

std::uint64_t CoveredSides::row(int y, int z) const {
  std::uint64_t found = 0;
  for (const VoxelType type : shaped_) found |= near_.centre()->row_mask(y, z, type);
  return found;
}

DirectionSet CoveredSides::at(IVec3 local) const {
  DirectionSet covered;
  const ShapeModel* model = shape_at(near_, *types_, local);
  QUOIN_ASSERT(model != nullptr, "a voxel with a shape");
  for (const Direction side : kDirections) {
    if (model->covers_side[static_cast<std::size_t>(side)]) covered.insert(side);
  }
  return covered;
}

std::uint64_t CoveredSides::covered(int y, int z, Direction side, std::uint64_t where) const {
  std::uint64_t found = 0;
  for (std::uint64_t left = where & (none() ? 0 : row(y, z)); left != 0; left &= left - 1) {
    if (at({std::countr_zero(left), y, z}).contains(side)) found |= left & (~left + 1);
  }
  return found;
}

void set_passage(const VoxelRegistry& types, VoxelType type, unsigned colours, TypeLight& light) {
  constexpr unsigned kOfSky = 1U << kSky;
  const unsigned cost = types[type].light_cost;
  unsigned passes = colours;
  unsigned tolls = 0;
  if (types.blocks_light(type)) {
    light.absorbs = types.is_transparent(type);
    passes = 0;
    // A lamp's own light is the light of its voxel.
    for (std::size_t c = 0; light.absorbs && c < kChannels; ++c) {
      tolls |= static_cast<unsigned>((light.lamp >> (4 * c) & 15U) == 0) << c;
    }
  } else if (cost > 0) {
    passes = cost == 1 ? colours & ~kOfSky : 0;  // one level, as in air; but the sky's light falls freely in air only
    tolls = colours & ~passes;
  }
  light.passes = static_cast<std::uint8_t>(passes);
  light.tolls = static_cast<std::uint8_t>(tolls);
  light.cost = static_cast<std::uint8_t>(tolls == 0 ? 1 : std::max(cost, 1U));
  const VoxelProperties& properties = types[type];
  light.has_sides =
      types.is_shaped(type) && properties.visibility == Visibility::Opaque && !properties.blocks_light.has_value();
}

std::vector<TypeLight> type_lights(const VoxelRegistry& types, const PropagatedLightOptions& options) {
  std::vector<TypeLight> lights(types.size());
  for (std::size_t i = 1; i < lights.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    const VoxelProperties& properties = types[type];
    LightLevels lamp = options.lamp ? options.lamp(type, properties) : lamp_levels(properties);
    lamp.sky = 0;
    for (std::uint8_t* level : {&lamp.red, &lamp.green, &lamp.blue}) {
      *level = static_cast<std::uint8_t>(std::min<unsigned>(*level, 15U));
    }
    lights[i].lamp = packed(lamp);
    const Rgba8 colour = properties.colour;
    const int half = (std::max({colour.r, colour.g, colour.b}) + 1) / 2;
    const int tinted = 1 | (colour.r >= half) << 1 | (colour.g >= half) << 2 | (colour.b >= half) << 3;
    // Light passes an opaque type where the type leaves room, not through its material.
    const bool is_clear = properties.visibility == Visibility::Transparent;  // the material of shapes
    const unsigned colours = is_clear ? static_cast<unsigned>(tinted) : (1U << kChannels) - 1;
    set_passage(types, type, colours, lights[i]);
  }
  return lights;
}

bool has_sides(const std::vector<TypeLight>& lights) {
  return std::ranges::any_of(lights, &TypeLight::has_sides);
}

namespace {

// Reads the rows of a box that hold types that `counts` accepts; [y + 64 z]. `inverted`: or all others.
void read_box(const Chunk& voxels, const FunctionRef<bool(VoxelType)>& counts, std::uint64_t inverted, const IBox& box,
              BlockVector<std::uint64_t>& words) {
  words.resize(static_cast<std::size_t>(kChunkEdge) * kChunkEdge);
  const trace::ChunkRows counted(voxels, counts);
  trace::SlabRows slab;
  for (int z = box.min.z & ~3; z < box.max.z; z += 4) {
    for (int y = box.min.y & ~3; y < box.max.y; y += 4) {
      const trace::Slab kind = counted.read(y, z, slab);
      if (kind != trace::Slab::Mixed) slab.fill(kind == trace::Slab::Full ? kAll : 0);
      std::uint64_t* to = words.data() + y + kChunkEdge * z;
      for (std::size_t i = 0; i < slab.size(); ++i) to[(i & 3) + kChunkEdge * (i >> 2)] = slab[i] ^ inverted;
    }
  }
}

}  // namespace

void ChunkMasks::read_rows(const Chunk& voxels, const std::vector<TypeLight>& types, std::size_t channel,
                           const IBox& box) {
  Rows& rows = rows_[channel];
  const auto stopped =
      std::count_if(found_.begin(), found_.end(), [&](VoxelType type) { return !passes(types, type, channel); });
  rows.is_uniform = stopped == 0 || static_cast<std::size_t>(stopped) == found_.size();
  rows.uniform = stopped == 0 ? kAll : 0;
  if (rows.is_uniform) return;
  const auto stops = [&](VoxelType type) { return !passes(types, type, channel); };
  read_box(voxels, stops, kAll, box, rows.words);
}

// Finds no voxel, in a few steps per type, unless some type of the chunk has a cost.
void ChunkMasks::read_tolls(const Chunk& voxels, const std::vector<TypeLight>& types, const IBox& box) {
  for (const VoxelType found : found_) {
    const TypeLight light = light_of(types, found);
    if (found == kAir || light.tolls == 0) continue;
    if (std::ranges::any_of(tolls(), [&](const Toll& toll) { return toll.is_of(light); })) continue;
    if (toll_count_ == tolls_.size()) tolls_.emplace_back();
    Toll& toll = tolls_[toll_count_++];
    toll.like = light;
    const auto is_like = [&](VoxelType type) { return type != kAir && toll.is_of(light_of(types, type)); };
    toll.is_uniform = std::all_of(found_.begin(), found_.end(), is_like);
    toll.uniform = toll.is_uniform ? kAll : 0;
    if (!toll.is_uniform) read_box(voxels, is_like, 0, box, toll.words);
  }
}

// Lamps of a row, each type once.
void ChunkMasks::add_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, int y, int z,
                           std::uint64_t where) {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  while (where != 0) {
    const VoxelType type = voxels.get(std::countr_zero(where), y, z);
    const std::uint64_t alike = where & voxels.row_mask(y, z, type);
    lamps_.push_back({static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(z), light_of(types, type).lamp, alike});
    where &= ~alike;
  }
}

void ChunkMasks::read_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, const IBox& box,
                            const SlabSet& slabs) {
  const auto is_lamp = [&](VoxelType type) { return light_of(types, type).lamp != 0; };
  if (std::none_of(found_.begin(), found_.end(), is_lamp)) {
    without_lamps_ = all_slabs();
    return;
  }
  const FunctionRef<bool(VoxelType)> asked(is_lamp);
  const trace::ChunkRows lamps(voxels, asked);
  trace::SlabRows rows;
  for (int z = box.min.z & ~3; z < box.max.z; z += 4) {
    for (int y = box.min.y & ~3; y < box.max.y; y += 4) {
      const auto bit = static_cast<std::uint16_t>(1U << (y / 4));
      const auto of_z = static_cast<std::size_t>(z / 4);
      if ((slabs[of_z] & bit) == 0) continue;
      const trace::Slab kind = lamps.read(y, z, rows);
      if (kind == trace::Slab::Empty) without_lamps_[of_z] |= bit;
      if (kind == trace::Slab::Empty) continue;
      if (kind == trace::Slab::Full) rows.fill(kAll);
      for (int i = 0; i < 16; ++i)
        add_lamps(voxels, types, y + (i & 3), z + (i >> 2), rows[static_cast<std::size_t>(i)]);
    }
  }
}

void ChunkMasks::read_sides(const CoveredSides& sides, const IBox& box) {
  const std::uint64_t inside = box.empty() ? 0 : kAll >> (kChunkEdge - box.size().x) << box.min.x;
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      SideRow row{static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(z), {}};
      bool is_any = false;
      for (std::uint64_t left = sides.row(y, z) & inside; left != 0; left &= left - 1) {
        for (const Direction side : sides.at({std::countr_zero(left), y, z})) {
          row.covered[static_cast<std::size_t>(side)] |= left & (~left + 1);
          is_any = true;
        }
      }
      if (is_any) side_rows_.push_back(row);
    }
  }
}

void ChunkMasks::read(const Chunk* voxels, const std::vector<TypeLight>& types, const CoveredSides& sides,
                      const IBox& box, const SlabSet& lamp_slabs) {
  QUOIN_ASSERT(intersect(box, kWholeChunk) == box, "a box of the chunk");
  lamps_.clear();
  side_rows_.clear();
  toll_count_ = 0;
  without_lamps_.fill(0);
  rows_of_.fill(0);
  rows_[0].is_uniform = true;
  rows_[0].uniform = kAll;
  if (voxels == nullptr) return;
  found_ = voxels->types();
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    const auto is_like = [&](std::size_t other) {
      return std::all_of(found_.begin(), found_.end(),
                         [&](VoxelType type) { return passes(types, type, channel) == passes(types, type, other); });
    };
    std::size_t other = 0;
    while (other < channel && !is_like(other)) ++other;
    rows_of_[channel] = other;
    if (other == channel) read_rows(*voxels, types, channel, box);
  }
  read_lamps(*voxels, types, box, lamp_slabs);
  read_tolls(*voxels, types, box);
  if (!sides.none()) read_sides(sides, box);
}

namespace {

// Lets columns fall through 4x4 rows, from `begin` to `end` within the slab. Returns the lowest row that any reaches.
int fall_in_slab(const trace::SlabRows& stops, int begin, int end, std::uint64_t* open) {
  int low = end;
  for (int y = end; y-- > begin;) {
    std::uint64_t any = 0;
    for (std::size_t z = 0; z < 4; ++z) {
      open[z] &= ~stops[static_cast<std::size_t>(y) + 4 * z];
      any |= open[z];
    }
    if (any == 0) break;
    low = y;
  }
  return low;
}

}  // namespace

namespace {

// Lets columns fall row by row, past sides of shapes.
int fall_past_sides(const trace::ChunkRows& stops, const CoveredSides& sides, int begin, int end, ColumnSet& open) {
  trace::SlabRows rows;
  int low = end;
  for (int first_z = 0; first_z < kChunkEdge; first_z += 4) {
    std::uint64_t* columns = open.data() + first_z;
    for (int first_y = (end - 1) & ~3; first_y > begin - 4; first_y -= 4) {
      if ((columns[0] | columns[1] | columns[2] | columns[3]) == 0) break;
      const trace::Slab kind = stops.read(first_y, first_z, rows);
      if (kind != trace::Slab::Mixed) rows.fill(kind == trace::Slab::Full ? kAll : 0);
      for (int z = 0; z < 4; ++z) {
        for (int y = std::min(end, first_y + 4); y-- > std::max(begin, first_y) && columns[z] != 0;) {
          columns[z] &= ~rows[static_cast<std::size_t>((y & 3) + 4 * z)];
          columns[z] &= ~sides.covered(y, first_z + z, Direction::PosY, columns[z]);
          if (columns[z] == 0) break;
          low = std::min(low, y);
          columns[z] &= ~sides.covered(y, first_z + z, Direction::NegY, columns[z]);
        }
      }
    }
  }
  return low;
}

}  // namespace

int fall(const Chunk* voxels, const std::vector<TypeLight>& types, const CoveredSides& sides, int begin, int end,
         ColumnSet& open) {
  QUOIN_ASSERT(begin >= 0 && begin < end && end <= kChunkEdge, "rows of a chunk");
  if (!is_any(open)) return end;
  const auto is_stop = [&](VoxelType type) { return !passes(types, type, kSky); };
  const FunctionRef<bool(VoxelType)> asked(is_stop);
  if (voxels == nullptr) return begin;
  const trace::ChunkRows stops(*voxels, asked);
  if (!sides.none()) return fall_past_sides(stops, sides, begin, end, open);
  if (stops.none()) return begin;
  int low = end;
  trace::SlabRows rows;
  for (int y = (end - 1) & ~3; y > begin - 4; y -= 4) {
    bool goes_on = false;
    for (int z = 0; z < kChunkEdge; z += 4) {
      std::uint64_t* columns = open.data() + z;
      if ((columns[0] | columns[1] | columns[2] | columns[3]) == 0) continue;
      const trace::Slab kind = stops.read(y, z, rows);
      if (kind != trace::Slab::Mixed) rows.fill(kind == trace::Slab::Full ? kAll : 0);
      const int last = std::max(begin - y, 0);
      low = std::min(low, y + fall_in_slab(rows, last, std::min(end - y, 4), columns));
      goes_on |= (columns[0] | columns[1] | columns[2] | columns[3]) != 0;
    }
    if (!goes_on) break;
  }
  return low;
}

}  // namespace quoin::propagated
