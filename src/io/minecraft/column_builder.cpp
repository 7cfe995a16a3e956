#include "io/minecraft/column_builder.h"

#include <algorithm>
#include <tuple>

namespace quoin::minecraft {

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

Status ColumnBuilder::put(const Section& section, IVec3 corner) {
  if (auto found = find_types(section); !found) return found;
  fill(section, cell(chunk_of(corner)), local_of(corner));
  return {};
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
