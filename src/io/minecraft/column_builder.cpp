#include "io/minecraft/column_builder.h"

#include <algorithm>
#include <iterator>
#include <numbers>
#include <tuple>

#include <quoin/core/assert.h>

namespace quoin::minecraft {

namespace {

bool is_unseen(const Section& section) {
  return std::ranges::all_of(section.palette,
                             [](const Block& block) { return block.type == kAir && block.tint == Tint::None; });
}

}  // namespace

ColumnBuilder::Cell& ColumnBuilder::cell(IVec3 place) {
  const auto found = std::ranges::find(cells_, place, &Cell::place);
  if (found != cells_.end()) return *found;
  Cell fresh;
  if (!spare_.empty()) {
    fresh = std::move(spare_.back());
    spare_.pop_back();
  }
  fresh.place = place;
  fresh.types.assign(kChunkVoxels, kAir);
  fresh.states.clear();
  return cells_.emplace_back(std::move(fresh));
}

Status ColumnBuilder::find_types(const Section& section) {
  const std::size_t size = section.palette.size();
  has_states_ = std::ranges::any_of(section.palette, [](const Block& block) { return block.state != 0; });
  has_tints_ = std::ranges::any_of(section.palette, [](const Block& block) { return block.tint != Tint::None; });
  const std::size_t biomes = has_tints_ ? section.biomes.size() : 1;
  types_of_.resize(size * biomes);
  for (std::size_t biome = 0; biome < biomes; ++biome) {
    for (std::size_t i = 0; i < size; ++i) {
      const Block& block = section.palette[i];
      VoxelType& type = types_of_[biome * size + i];
      type = block.type;
      if (block.tint == Tint::None) continue;
      const auto tinted = types_.tinted(block, section.biomes[biome]);
      if (!tinted) return tinted.error();
      type = *tinted;
    }
  }
  return {};
}

void ColumnBuilder::fill(const Section& section, Cell& cell, IVec3 first) const {
  const std::size_t size = section.palette.size();
  const bool is_by_column = section.biome_indices.size() == 256;
  QUOIN_ASSERT(is_by_column || section.biome_indices.size() == 64 || !has_tints_, "biomes of columns or of cells");
  QUOIN_ASSERT(types_of_.size() >= size, "types of the whole palette");
  for (int y = 0; y < kSectionEdge; ++y) {
    for (int z = 0; z < kSectionEdge; ++z) {
      const auto row = static_cast<std::size_t>((first.z + z) * kChunkEdge + first.y + y) * kChunkEdge +
                       static_cast<std::size_t>(first.x);
      const std::uint16_t* const indices = section.indices.data() + (y * kSectionEdge + z) * kSectionEdge;
      VoxelType* const out = cell.types.data() + row;
      if (!has_tints_) {
        for (std::size_t x = 0; x < kSectionEdge; ++x) out[x] = types_of_[indices[x]];
      } else {
        const std::uint8_t* const biomes =
            section.biome_indices.data() + (is_by_column ? z * 16 : (y >> 2) * 16 + (z >> 2) * 4);
        for (std::size_t x = 0; x < kSectionEdge; ++x) {
          out[x] = types_of_[biomes[is_by_column ? x : x >> 2] * size + indices[x]];
        }
      }
      if (!has_states_) continue;
      for (std::size_t x = 0; x < kSectionEdge; ++x) {
        const std::uint32_t state = section.palette[indices[x]].state;
        if (state != 0 && out[x] != kAir) cell.states.emplace_back(static_cast<std::uint32_t>(row + x), state);
      }
    }
  }
}

// A lamp lights like a voxel of the same level and emission 1: a face of area 1 and radiance 1 lights a white surface 1
// unit away by 1 / pi.
void ColumnBuilder::count_invisible(const Section& section, IVec3 corner) {
  constexpr double kMaxLevel = 15.0;
  for (std::size_t i = 0; i < kSectionBlocks; ++i) {
    QUOIN_ASSERT(section.indices[i] < section.palette.size(), "an index into the palette");
    const Block& block = section.palette[section.indices[i]];
    if (block.invisible == 0) continue;
    if (invisible_.size() <= block.invisible) invisible_.resize(std::size_t{block.invisible} + 1);
    ++invisible_[block.invisible];
    if (block.light == 0) continue;
    const auto at = static_cast<int>(i);
    Lamp lamp;
    lamp.name = types_.invisible_name(block.invisible);
    lamp.position = DVec3(corner + IVec3(at & 15, at >> 8, at >> 4 & 15)) + 0.5;
    lamp.intensity = block.light / kMaxLevel / std::numbers::pi;
    lamp.range = block.light;
    lamps_.push_back(std::move(lamp));
  }
}

void ColumnBuilder::take_invisible(SourcePart& part) {
  for (std::size_t number = 1; number < invisible_.size(); ++number) {
    if (invisible_[number] == 0) continue;
    part.skipped_blocks[types_.invisible_name(static_cast<std::uint16_t>(number))] += invisible_[number];
  }
  std::ranges::move(lamps_, std::back_inserter(part.lamps));
  invisible_.clear();
  lamps_.clear();
}

Status ColumnBuilder::put(const Section& section, IVec3 corner) {
  QUOIN_ASSERT(((corner.x | corner.y | corner.z) & (kSectionEdge - 1)) == 0, "a multiple of 16");
  if (std::ranges::any_of(section.palette, [](const Block& block) { return block.invisible != 0; })) {
    count_invisible(section, corner);
    if (is_unseen(section)) return {};
  }
  if (auto found = find_types(section); !found) return found;
  fill(section, cell(chunk_of(corner)), local_of(corner));
  return {};
}

void ColumnBuilder::put_block(const Block& block, IVec3 corner) {
  QUOIN_ASSERT(block.is_plain(), "a block that has only a type");
  QUOIN_ASSERT(((corner.x | corner.y | corner.z) & (kSectionEdge - 1)) == 0, "a multiple of 16");
  Cell& to = cell(chunk_of(corner));
  const IVec3 first = local_of(corner);
  for (int z = first.z; z < first.z + kSectionEdge; ++z) {
    for (int y = first.y; y < first.y + kSectionEdge; ++y) {
      const auto row = (z * kChunkEdge + y) * kChunkEdge + first.x;
      std::fill_n(to.types.begin() + row, kSectionEdge, block.type);
    }
  }
}

std::vector<SourceChunk> ColumnBuilder::take() {
  std::ranges::sort(cells_, {}, [](const Cell& c) { return std::tuple(c.place.y, c.place.z, c.place.x); });
  std::vector<SourceChunk> chunks;
  for (Cell& each : cells_) {
    Chunk chunk = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(each.types));
    if (chunk.uniform() == kAir) continue;
    std::ranges::sort(each.states);
    for (const auto& [voxel, state] : each.states) {
      const auto at = static_cast<int>(voxel);
      chunk.set_data({at & 63, at >> 6 & 63, at >> 12}, {.state = state});
    }
    chunks.push_back({each.place, std::move(chunk)});
  }
  spare_ = std::move(cells_);
  cells_.clear();
  return chunks;
}

}  // namespace quoin::minecraft
