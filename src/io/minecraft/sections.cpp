#include "io/minecraft/sections.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <iterator>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"

namespace quoin::minecraft {

namespace {

constexpr std::int64_t kMaxSection = 1'000;  // beyond all heights that read_section accepts
constexpr std::size_t kLegacyCodes = std::size_t{4096} * 16;

std::uint64_t word(std::span<const std::byte> longs, std::size_t i) {
  QUOIN_ASSERT(8 * i + 8 <= longs.size(), "one of the longs");
  return load<std::uint64_t>(longs.data() + 8 * i, std::endian::big);
}

}  // namespace

int nibble(std::span<const std::byte> bytes, std::size_t i) {
  if (i / 2 >= bytes.size()) return 0;
  return std::to_integer<int>(bytes[i / 2]) >> (i % 2 * 4) & 15;
}

int bits_of_palette(std::size_t size, int least) {
  QUOIN_ASSERT(size > 0, "a palette with entries");
  return std::max(static_cast<int>(std::bit_width(size - 1)), least);
}

bool unpack_indices(nbt::Value longs, int bits, std::span<std::uint16_t> out) {
  QUOIN_ASSERT(bits >= 1 && bits <= 16, "1 <= bits <= 16");
  const std::span<const std::byte> bytes = longs.long_bytes();
  const std::size_t words = bytes.size() / 8;
  const auto width = static_cast<std::size_t>(bits);
  const std::size_t per_word = 64 / width;
  const std::uint64_t mask = (std::uint64_t{1} << width) - 1;
  if (words == (out.size() + per_word - 1) / per_word) {  // no index spans two longs
    std::size_t at = 0;
    for (std::size_t i = 0; i < words; ++i) {
      std::uint64_t rest = word(bytes, i);
      for (std::size_t k = 0; k < per_word && at < out.size(); ++k, rest >>= width) {
        out[at++] = static_cast<std::uint16_t>(rest & mask);
      }
    }
    return true;
  }
  if (words != (out.size() * width + 63) / 64) return false;
  unpack_spanning(longs, bits, 0, out);
  return true;
}

void unpack_spanning(nbt::Value longs, int bits, std::size_t first, std::span<std::uint16_t> out) {
  const std::span<const std::byte> bytes = longs.long_bytes();
  const auto width = static_cast<std::size_t>(bits);
  QUOIN_ASSERT(bits >= 1 && bits <= 16, "1 <= bits <= 16");
  QUOIN_ASSERT(((first + out.size()) * width + 63) / 64 <= bytes.size() / 8, "longs that hold all indices");
  const std::uint64_t mask = (std::uint64_t{1} << width) - 1;
  for (std::size_t at = 0; at < out.size(); ++at) {
    const std::size_t bit = (first + at) * width;
    std::uint64_t value = word(bytes, bit / 64) >> (bit % 64);
    if (bit % 64 + width > 64) value |= word(bytes, bit / 64 + 1) << (64 - bit % 64);
    out[at] = static_cast<std::uint16_t>(value & mask);
  }
}

Status read_block_palette(nbt::Value palette, BlockTypes& types, std::vector<Block>& out) {
  out.clear();
  Status done;
  std::vector<Property> properties;
  palette.for_each([&](nbt::Value entry) {
    if (!done) return;
    // A compound before 20w17 and today; a few snapshots stored only the name.
    const auto name = entry.tag() == nbt::Tag::String ? entry.text() : entry["Name"].text();
    if (!name) {
      done = fault("a block has no name", entry);
      return;
    }
    properties.clear();
    entry["Properties"].for_each([&](nbt::Value value) {
      if (const auto text = value.text()) properties.emplace_back(value.name(), *text);
    });
    const auto block = types.block(*name, properties);
    if (block) {
      out.push_back(*block);
    } else {
      done = block.error();
    }
  });
  return done;
}

void SectionReader::begin_legacy() {
  QUOIN_ASSERT(legacy_used_.empty(), "the previous section has ended");
  section_.palette.clear();
  legacy_index_.resize(kLegacyCodes, kNoIndex);
}

void SectionReader::end_legacy() {
  for (const std::uint32_t code : legacy_used_) legacy_index_[code] = kNoIndex;
  legacy_used_.clear();
}

Status SectionReader::put_legacy(std::size_t at, int id, int data) {
  QUOIN_ASSERT(id >= 0 && id < 4096 && data >= 0 && data < 16 && at < kSectionBlocks, "0 <= id < 4096, 0 <= data < 16");
  const auto code = static_cast<std::uint32_t>(id * 16 + data);
  if (legacy_index_[code] == kNoIndex) {
    const auto [name, properties] = legacy_block(id, data);
    const auto block = types_.block(name, properties);
    if (!block) return block.error();
    legacy_index_[code] = static_cast<std::uint16_t>(section_.palette.size());
    legacy_used_.push_back(code);
    section_.palette.push_back(*block);
  }
  section_.indices[at] = legacy_index_[code];
  return {};
}

Status SectionReader::read_legacy(nbt::Value section) {
  const auto blocks = section["Blocks"].bytes();
  if (blocks.size() != kSectionBlocks)
    return fault("a section has " + std::to_string(blocks.size()) + " blocks", section);
  const auto data = section["Data"].bytes();
  const auto add = section["Add"].bytes();
  begin_legacy();
  Status done;
  for (std::size_t i = 0; i < kSectionBlocks && done; ++i) {
    done = put_legacy(i, nibble(add, i) << 8 | std::to_integer<int>(blocks[i]), nibble(data, i));
  }
  end_legacy();
  return done;
}

// 16 x 128 x 16 blocks in one array, by x, then z, then y.
Status SectionReader::read_mcregion(nbt::Value level, SectionOrder order, int top,
                                    FunctionRef<bool(const Section&)> take) {
  constexpr std::size_t kHeight = 128;
  const auto blocks = level["Blocks"].bytes();
  const auto data = level["Data"].bytes();
  if (blocks.size() != kHeight * 256) return fault("a chunk has " + std::to_string(blocks.size()) + " blocks", level);
  constexpr int kSections = 8;
  for (int number = 0; number < kSections; ++number) {
    const int y = order == SectionOrder::Downwards ? kSections - 1 - number : number;
    if (y * kSectionEdge > top) continue;
    begin_legacy();
    Status done;
    for (std::size_t i = 0; i < kSectionBlocks && done; ++i) {
      const std::size_t x = i & 15U;
      const std::size_t z = i >> 4 & 15U;
      const std::size_t from = (x * 16 + z) * kHeight + static_cast<std::size_t>(y) * 16 + (i >> 8);
      done = put_legacy(i, std::to_integer<int>(blocks[from]), nibble(data, from));
    }
    end_legacy();
    if (!done) return done;
    section_.y = y;
    read_biomes({}, level);
    if (!is_air() && !take(section_)) return {};
  }
  return {};
}

void SectionReader::read_biomes(nbt::Value section, nbt::Value level) {
  std::vector<BiomeTints>& biomes = section_.biomes;
  std::vector<std::uint8_t>& indices = section_.biome_indices;
  biomes.clear();
  indices.assign(64, 0);
  const auto index_of = [&](const BiomeTints& tints) { return index_of_tints(biomes, tints); };
  if (const nbt::Value palette = section["biomes"]["palette"]; palette.count() > 0) {
    std::vector<std::uint8_t> of_palette;
    palette.for_each(
        [&](nbt::Value name) { of_palette.push_back(index_of(tints_of_biome(name.text().value_or("")))); });
    std::array<std::uint16_t, 64> cells{};
    const nbt::Value data = section["biomes"]["data"];
    if (data && !of_palette.empty() && of_palette.size() <= 64) {
      if (!unpack_indices(data, bits_of_palette(of_palette.size(), 1), cells)) cells = {};
    }
    for (std::size_t i = 0; i < cells.size() && !of_palette.empty(); ++i) {
      indices[i] = of_palette[std::min<std::size_t>(cells[i], of_palette.size() - 1)];
    }
  } else if (const nbt::Value numbers = level["Biomes"]; numbers.is_integers() && numbers.count() == 256) {
    indices.resize(256);
    for (std::size_t i = 0; i < 256; ++i) {
      const std::int64_t number = numbers.integer(i);
      indices[i] =
          index_of(tints_of_biome(name_of_biome(numbers.tag() == nbt::Tag::ByteArray ? number & 255 : number)));
    }
  } else if (numbers.is_integers() && numbers.count() >= 1024 && section_.y >= 0) {
    // Cells of the whole chunk, from the bottom.
    const std::size_t first = std::min(static_cast<std::size_t>(section_.y) * 64, numbers.count() - 64);
    for (std::size_t i = 0; i < 64; ++i)
      indices[i] = index_of(tints_of_biome(name_of_biome(numbers.integer(first + i))));
  }
  if (biomes.empty()) biomes.emplace_back();
}

bool SectionReader::is_air() const {
  return std::ranges::all_of(section_.palette, [](const Block& block) { return block.is_air(); });
}

Status SectionReader::read_section(nbt::Value section, nbt::Value level) {
  const auto y = section["Y"].integer();
  if (!y || *y < -128 || *y > 127) return fault("a section has no valid height Y", section);
  section_.y = static_cast<int>(*y);
  const nbt::Value states = section["block_states"];
  const nbt::Value palette = states ? states["palette"] : section["Palette"];
  section_.palette.clear();
  if (palette) {
    const nbt::Value data = states ? states["data"] : section["BlockStates"];
    if (auto read = read_block_palette(palette, types_, section_.palette); !read) return read;
    const std::size_t size = section_.palette.size();
    if (size == 0 || size > kSectionBlocks) return fault("invalid palette size " + std::to_string(size), palette);
    // Some servers write the array of a section of one block without longs.
    if (data && (size > 1 || data.count() > 0)) {
      if (is_air()) return {};
      // The game uses at least 4 bits; some servers use no more than the palette needs.
      if (!unpack_indices(data, bits_of_palette(size, 4), section_.indices) &&
          !unpack_indices(data, bits_of_palette(size, 1), section_.indices)) {
        return fault("the indices into " + std::to_string(size) + " blocks do not fit in " +
                         std::to_string(data.count()) + " longs",
                     data);
      }
      if (*std::ranges::max_element(section_.indices) >= size) {
        return fault("a block index is beyond the " + std::to_string(size) + " blocks of the palette", data);
      }
    } else {
      if (size > 1) return fault("the palette of " + std::to_string(size) + " blocks has no indices", palette);
      section_.indices.fill(0);
    }
  } else if (section["Blocks"]) {
    if (auto read = read_legacy(section); !read) return read;
  }
  if (!section_.palette.empty()) read_biomes(section, level);
  return {};
}

Status SectionReader::read(nbt::Value root, SectionOrder order, int top, FunctionRef<bool(const Section&)> take,
                           FunctionRef<void(const Error&)> broken) {
  const nbt::Value level = chunk_content(root);
  const nbt::Value stored = nbt::first_of(level, "sections", "Sections");
  if (!stored && level["Blocks"]) return read_mcregion(level, order, top, take);
  sections_.clear();
  // A section without a height is broken, which `read_section` reports.
  stored.for_each([&](nbt::Value section) {
    const auto y = std::clamp<std::int64_t>(section["Y"].integer().value_or(0), -kMaxSection, kMaxSection);
    const bool is_valid = y >= -128 && y <= 127;
    if (!is_valid || y * kSectionEdge <= top) sections_.emplace_back(static_cast<int>(y), section);
  });
  if (order == SectionOrder::Downwards) {
    std::ranges::stable_sort(sections_, std::greater(), [](const auto& each) { return each.first; });
  }
  for (const auto& [y, section] : sections_) {
    const Status read = read_section(section, level);
    if (!read && read.error().code == ErrorCode::BadFormat) {
      broken(read.error());
    } else if (!read) {
      return read;
    } else if (!is_air() && !take(section_)) {
      return {};
    }
  }
  return {};
}

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

Status SectionTypes::find(const Section& section, BlockTypes& types) {
  const std::size_t size = section.palette.size();
  has_tints_ = std::ranges::any_of(section.palette, [](const Block& block) { return block.tint != Tint::None; });
  const std::size_t biomes = has_tints_ ? section.biomes.size() : 1;
  QUOIN_ASSERT(!has_tints_ || section.biome_indices.size() == 256 || section.biome_indices.size() == 64,
               "biomes of columns or of cells");
  types_.resize(size * biomes);
  for (std::size_t biome = 0; biome < biomes; ++biome) {
    for (std::size_t i = 0; i < size; ++i) {
      const Block& block = section.palette[i];
      VoxelType& type = types_[biome * size + i];
      type = block.type;
      if (block.tint == Tint::None) continue;
      const auto tinted = types.tinted(block, section.biomes[biome]);
      if (!tinted) return tinted.error();
      type = *tinted;
    }
  }
  return {};
}

void ColumnBuilder::fill(const Section& section, Cell& cell, IVec3 first) const {
  const std::size_t size = section.palette.size();
  const bool is_by_column = section.biome_indices.size() == 256;
  const std::vector<VoxelType>& types = types_of_.types();
  QUOIN_ASSERT(types.size() >= size, "types of the whole palette");
  for (int y = 0; y < kSectionEdge; ++y) {
    for (int z = 0; z < kSectionEdge; ++z) {
      const auto row = static_cast<std::size_t>((first.z + z) * kChunkEdge + first.y + y) * kChunkEdge +
                       static_cast<std::size_t>(first.x);
      const std::uint16_t* const indices = section.indices.data() + (y * kSectionEdge + z) * kSectionEdge;
      VoxelType* const out = cell.types.data() + row;
      if (!types_of_.has_tints()) {
        for (std::size_t x = 0; x < kSectionEdge; ++x) out[x] = types[indices[x]];
      } else {
        const std::uint8_t* const biomes =
            section.biome_indices.data() + (is_by_column ? z * 16 : (y >> 2) * 16 + (z >> 2) * 4);
        for (std::size_t x = 0; x < kSectionEdge; ++x) {
          out[x] = types[biomes[is_by_column ? x : x >> 2] * size + indices[x]];
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
  if (auto found = types_of_.find(section, types_); !found) return found;
  has_states_ = std::ranges::any_of(section.palette, [](const Block& block) { return block.state != 0; });
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
