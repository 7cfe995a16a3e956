#include "light/propagated/light_solver.h"

#include <algorithm>
#include <bit>

#include "grid/chunk/chunk_storage.h"
#include "grid/chunk/packed_row.h"
#include "trace/chunk_rows.h"

namespace quoin::propagated {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr std::size_t kSky = 0;

// Where all bits of a level are as in `level`.
std::uint64_t equal_to(const std::array<std::uint64_t, kPlanes>& planes, unsigned level) {
  std::uint64_t equal = kAll;
  for (std::size_t i = 0; i < kPlanes; ++i) equal &= (level >> i & 1U) != 0 ? planes[i] : ~planes[i];
  return equal;
}

void add_word(std::uint64_t where, std::uint16_t word, RowPlanes& planes) {
  for (std::size_t bit = 0; bit < 16; ++bit) {
    if ((word >> bit & 1U) != 0) planes[bit / kPlanes][bit % kPlanes] |= where;
  }
}

// Bit j of byte i becomes bit i of byte j.
std::uint64_t transpose_bytes(std::uint64_t w) {
  const auto swap = [&w](int distance, std::uint64_t mask) {
    const std::uint64_t other = (w ^ (w >> distance)) & mask;
    w ^= other ^ (other << distance);
  };
  swap(7, 0x00AA'00AA'00AA'00AAU);
  swap(14, 0x0000'CCCC'0000'CCCCU);
  swap(28, 0x0000'0000'F0F0'F0F0U);
  return w;
}

RowPlanes planes_of(std::span<const VoxelType, kChunkEdge> words) {
  RowPlanes planes{};
  for (std::size_t first = 0; first < kChunkEdge; first += 8) {
    for (std::size_t half = 0; half < 2; ++half) {
      std::uint64_t bytes = 0;
      for (std::size_t i = 0; i < 8; ++i) bytes |= std::uint64_t{words[first + i] >> (8 * half) & 255U} << (8 * i);
      bytes = transpose_bytes(bytes);
      for (std::size_t bit = 0; bit < 8; ++bit) {
        planes[2 * half + bit / kPlanes][bit % kPlanes] |= (bytes >> (8 * bit) & 255U) << first;
      }
    }
  }
  return planes;
}

TypeLight light_of(const std::vector<TypeLight>& types, VoxelType type) {
  // What is not registered is opaque.
  return type < types.size() ? types[type] : TypeLight{0, 0};
}

}  // namespace

RowPlanes uniform_planes(std::uint16_t word) {
  RowPlanes planes{};
  add_word(kAll, word, planes);
  return planes;
}

RowPlanes read_planes(const Chunk* light, int y, int z) {
  if (light == nullptr) return {};
  const ChunkStorage* mixed = ChunkStorage::of(*light);
  if (mixed == nullptr) return uniform_planes(*light->uniform());
  const std::uint32_t slab = mixed->slabs[ChunkStorage::slab_index(y, z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) {
    const std::uint32_t index = slab & ~ChunkStorage::kUniformSlab;
    return uniform_planes(mixed->direct() ? static_cast<VoxelType>(index) : mixed->palette[index]);
  }
  constexpr std::size_t kFew = 32;  // of a palette: so many masks take less time than the types one by one
  if (mixed->direct() || mixed->palette.size() > kFew) {
    std::array<VoxelType, kChunkEdge> words;
    light->read_row(y, z, words);
    return planes_of(words);
  }
  const std::uint64_t* row = mixed->row(slab, ChunkStorage::row_in_slab(y, z));
  RowPlanes planes{};
  for (std::size_t i = 0; i < mixed->palette.size(); ++i) {
    const std::uint64_t where = packed_row::equal_mask(row, mixed->bits, static_cast<std::uint32_t>(i));
    if (where != 0) add_word(where, mixed->palette[i], planes);
  }
  return planes;
}

void write_planes(const RowPlanes& planes, std::span<std::uint16_t, kChunkEdge> out) {
  for (std::size_t first = 0; first < kChunkEdge; first += 8) {
    std::array<std::uint64_t, 2> halves{};
    for (std::size_t half = 0; half < 2; ++half) {
      for (std::size_t bit = 0; bit < 8; ++bit) {
        halves[half] |= (planes[2 * half + bit / kPlanes][bit % kPlanes] >> first & 255U) << (8 * bit);
      }
      halves[half] = transpose_bytes(halves[half]);
    }
    for (std::size_t i = 0; i < 8; ++i) {
      out[first + i] = static_cast<std::uint16_t>((halves[0] >> (8 * i) & 255U) | (halves[1] >> (8 * i) & 255U) << 8);
    }
  }
}

void LightSolver::RowRange::add(int y, int z) {
  low_y = std::min(low_y, y);
  low_z = std::min(low_z, z);
  high_y = std::max(high_y, y);
  high_z = std::max(high_z, z);
}

void LightSolver::RowRange::add(const RowRange& other) {
  if (other.empty()) return;
  add(other.low_y, other.low_z);
  add(other.high_y, other.high_z);
}

void LightSolver::RowRange::grow() {
  if (!empty()) *this = {low_y - 1, low_z - 1, high_y + 1, high_z + 1};
}

LightSolver::RowRange LightSolver::RowRange::within(const IBox& box) const {
  return {std::max(low_y, box.min.y), std::max(low_z, box.min.z), std::min(high_y, box.max.y - 1),
          std::min(high_z, box.max.z - 1)};
}

template <class Visit>
void LightSolver::for_each_row(Visit&& visit) const {
  for (int z = box_.min.z; z < box_.max.z; ++z) {
    for (int y = box_.min.y; y < box_.max.y; ++y) visit(y, z, at(y, z));
  }
}

void LightSolver::add_lamps(const Chunk& voxels, const std::vector<TypeLight>& types) {
  for (const VoxelType type : voxels.types()) {
    const std::uint16_t lamp = light_of(types, type).lamp;
    if (lamp == 0) continue;
    trace::ChunkRows(voxels, type).for_each_row(box_, [&](int y, int z, std::uint64_t where) {
      add_word(where & inside_, lamp, source_[at(y, z)]);
    });
  }
}

void LightSolver::read_voxels(const Chunk* voxels, const std::vector<TypeLight>& types) {
  for (std::vector<std::uint64_t>& pass : pass_) pass.assign(kRows, 0);
  std::uint8_t any = 15;  // channels that pass by all that lets any pass
  std::vector<VoxelType> found;
  if (voxels != nullptr) found = voxels->types();
  for (const VoxelType type : found) {
    const std::uint8_t passes = type == kAir ? 15 : light_of(types, type).passes;
    if (passes != 0) any &= passes;
  }
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    std::vector<std::uint64_t>& pass = pass_[channel];
    if (channel > 0 && (any >> channel & 1U) != 0 && (any & 1U) != 0) {
      pass = pass_[0];
      continue;
    }
    for_each_row([&](int, int, std::size_t i) { pass[i] = inside_; });
    if (voxels == nullptr) continue;
    const auto stops = [&](VoxelType type) { return (light_of(types, type).passes >> channel & 1U) == 0; };
    const FunctionRef<bool(VoxelType)> asked(stops);
    trace::ChunkRows(*voxels, asked).for_each_row(box_, [&](int y, int z, std::uint64_t where) {
      pass[at(y, z)] &= ~where;
    });
  }
}

// Of the voxels beside the box in its rows, of the rows around it, and what was in it.
void LightSolver::read_light(const Chunk* light, const LightBorder& border) {
  const auto beside = [&](Direction direction, int y, int z) {
    const auto i = static_cast<std::size_t>(direction);
    if (border.chunk[i] == nullptr) return uniform_planes(border.beyond[i]);
    return read_planes(border.chunk[i], y & (kChunkEdge - 1), z & (kChunkEdge - 1));
  };
  const auto read = [&](int y, int z) {
    if (y < 0) return beside(Direction::NegY, y, z);
    if (y >= kChunkEdge) return beside(Direction::PosY, y, z);
    if (z < 0) return beside(Direction::NegZ, y, z);
    if (z >= kChunkEdge) return beside(Direction::PosZ, y, z);
    return read_planes(light, y, z);
  };
  for_each_row([&](int y, int z, std::size_t i) {
    before_[i] = read_planes(light, y, z);
    source_[i] = before_[i];
    if (inside_ == kAll) {
      source_[i] = {};
    } else {
      for (auto& channel : source_[i]) {
        for (std::uint64_t& plane : channel) plane &= ~inside_;
      }
    }
  });
  for (int z = box_.min.z; z < box_.max.z; ++z) {
    for (const int y : {box_.min.y - 1, box_.max.y}) source_[at(y, z)] = read(y, z);
  }
  for (int y = box_.min.y; y < box_.max.y; ++y) {
    for (const int z : {box_.min.z - 1, box_.max.z}) source_[at(y, z)] = read(y, z);
  }
}

void LightSolver::read_sides(const LightBorder& border) {
  const auto beside = [&](Direction direction, int x, int y, int z) {
    const auto i = static_cast<std::size_t>(direction);
    return border.chunk[i] == nullptr ? border.beyond[i] : border.chunk[i]->get(x, y, z);
  };
  const bool at_low = box_.min.x == 0;
  const bool at_high = box_.max.x == kChunkEdge;
  for_each_row([&](int y, int z, std::size_t i) {
    sides_[i] = {at_low ? beside(Direction::NegX, kChunkEdge - 1, y, z) : std::uint16_t{0},
                 at_high ? beside(Direction::PosX, 0, y, z) : std::uint16_t{0}};
  });
}

// The highest level of a row's sources; 0: none.
unsigned LightSolver::highest_source(std::size_t channel, std::size_t i) const {
  std::uint64_t with = kAll;
  unsigned level = 0;
  for (std::size_t bit = kPlanes; bit-- > 0;) {
    const std::uint64_t also = with & source_[i][channel][bit];
    if (also == 0) continue;
    with = also;
    level |= 1U << bit;
  }
  for (const std::uint16_t side : sides_[i]) level = std::max(level, side >> (4 * channel) & 15U);
  return level;
}

// [level]: the rows whose highest source that is.
std::array<LightSolver::RowRange, 16> LightSolver::source_rows(std::size_t channel) const {
  std::array<RowRange, 16> ranges;
  for (int z = box_.min.z - 1; z <= box_.max.z; ++z) {
    const bool is_beside = z < box_.min.z || z == box_.max.z;
    for (int y = box_.min.y - (is_beside ? 0 : 1); y < box_.max.y + (is_beside ? 0 : 1); ++y) {
      const unsigned level = highest_source(channel, at(y, z));
      if (level > 0) ranges.at(level).add(y, z);
    }
  }
  return ranges;
}

// What of the rows around the box has the level joins what is lit.
void LightSolver::add_level(std::size_t channel, unsigned level) {
  const auto add = [&](int y, int z) {
    const std::size_t i = at(y, z);
    lit_[i] |= equal_to(source_[i][channel], level);
  };
  for (int z = box_.min.z; z < box_.max.z; ++z) add(box_.min.y - 1, z), add(box_.max.y, z);
  for (int y = box_.min.y; y < box_.max.y; ++y) add(y, box_.min.z - 1), add(y, box_.max.z);
}

void LightSolver::let_sky_fall() {
  for (int z = box_.min.z; z < box_.max.z; ++z) {
    for (int y = box_.max.y - 1; y >= box_.min.y; --y) lit_[at(y, z)] |= lit_[at(y + 1, z)] & pass_[kSky][at(y, z)];
  }
}

void LightSolver::spread(std::size_t channel) {
  const std::array<RowRange, 16> sources = source_rows(channel);
  if (std::all_of(sources.begin(), sources.end(), [](const RowRange& range) { return range.empty(); })) return;
  std::fill(lit_.begin(), lit_.end(), 0);
  RowRange range;  // of rows that may be lit
  const std::vector<std::uint64_t>& pass = pass_[channel];
  for (unsigned level = 15; level > 0; --level) {
    const auto side = [&](std::uint16_t word) { return std::uint64_t{(word >> (4 * channel) & 15U) > level}; };
    range.grow();
    range.add(sources.at(level));
    const RowRange rows = range.within(box_);
    // Before anything of this level is added around the box: only what is brighter spreads.
    rows.for_each([&](int y, int z) {
      const std::size_t i = at(y, z);
      const std::uint64_t own = lit_[i];
      const std::uint64_t along_x = own << 1 | own >> 1 | side(sides_[i][0]) | side(sides_[i][1]) << 63;
      const std::uint64_t around = along_x | lit_[i - 1] | lit_[i + 1] | lit_[i - kStride] | lit_[i + kStride];
      next_[i] = own | (around & pass[i]) | equal_to(source_[i][channel], level);
    });
    rows.for_each([&](int y, int z) {
      const std::size_t i = at(y, z);
      const std::uint64_t first = next_[i] & ~lit_[i];
      lit_[i] = next_[i];
      for (std::size_t bit = 0; bit < kPlanes; ++bit) {
        if ((level >> bit & 1U) != 0) now_[i][channel][bit] |= first;
      }
    });
    add_level(channel, level);
    if (level != 15 || channel != kSky) continue;
    let_sky_fall();
    if (!range.empty()) range.add(box_.min.y, range.low_z), range.add(box_.min.y, range.high_z);
    for_each_row([&](int, int, std::size_t i) { now_[i][kSky].fill(lit_[i]); });
  }
}

LightChange LightSolver::differences() const {
  LightChange change;
  IVec3 low{kChunkEdge};
  IVec3 high{0};
  std::uint64_t any = 0;
  for_each_row([&](int y, int z, std::size_t i) {
    std::uint64_t changed = 0;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
      for (std::size_t bit = 0; bit < kPlanes; ++bit) {
        changed |= before_[i][channel][bit] ^ now_[i][channel][bit];
      }
    }
    changed &= inside_;
    if (changed == 0) return;
    any |= changed;
    low = glm::min(low, IVec3(0, y, z));
    high = glm::max(high, IVec3(0, y + 1, z + 1));
    change.rows.push_back({static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(z), changed, {}});
    write_planes(now_[i], change.rows.back().now);
  });
  if (any == 0) return change;
  low.x = std::countr_zero(any);
  high.x = 64 - std::countl_zero(any);
  change.box = {low, high};
  return change;
}

LightChange LightSolver::solve(const Chunk* voxels, const std::vector<TypeLight>& types, const Chunk* light,
                               const LightBorder& border, const IBox& box) {
  box_ = box;
  const int width = box.max.x - box.min.x;
  inside_ = (width == kChunkEdge ? kAll : (std::uint64_t{1} << width) - 1) << box.min.x;
  source_.assign(kRows, {});
  before_.resize(kRows);
  now_.assign(kRows, {});
  sides_.assign(kRows, {});
  lit_.resize(kRows);
  next_.resize(kRows);
  read_voxels(voxels, types);
  read_light(light, border);
  read_sides(border);
  if (voxels != nullptr) add_lamps(*voxels, types);
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    spread(channel);
  }
  return differences();
}

}  // namespace quoin::propagated
