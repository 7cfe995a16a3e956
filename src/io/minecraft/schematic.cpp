#include "io/minecraft/minecraft.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"
#include "io/byte_stream.h"
#include "io/minecraft/bedrock_blocks.h"
#include "io/minecraft/block_looks.h"
#include "io/minecraft/block_types.h"
#include "io/minecraft/nbt.h"
#include "io/minecraft/region_file.h"
#include "io/minecraft/sections.h"

namespace quoin::minecraft {

namespace {

constexpr std::size_t kMaxSchematicBytes = std::size_t{1} << 30;
constexpr std::int64_t kMaxBlocks = std::int64_t{1} << 30;
constexpr std::size_t kMaxPalette = 65'535;
constexpr int kMaxEdge = 1 << 20;
constexpr std::int64_t kMaxPlace = 1 << 26;

std::string text_of(IVec3 size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y) + " x " + std::to_string(size.z);
}

/// The biomes that tint the grass of columns: one per column, or one per slab of 16 layers.
struct ColumnBiomes {
  std::vector<BiomeTints> tints;
  std::vector<std::uint8_t> of_columns;  ///< by slab, z, x; empty: all have the first one's, or plains'

  /// Writes the biomes of 16 x 16 columns from (x, z). Beyond the region the first one is used.
  void put_into(Section& section, IVec3 corner, IVec3 size) const;
};

/// The blocks of one array.
struct SchematicRegion {
  std::string name;
  IVec3 min{0};
  IVec3 size{0};
  std::vector<Block> palette;
  ColumnBiomes biomes;
  /// Fills a layer with palette indices, by z, then x. Called once per layer, from below. May be null for a region of
  /// one block.
  std::function<Status(int y, std::span<std::uint16_t> layer)> read_layer;
  /// Returns the common index of all blocks in the next layers, and skips them. Returns nullopt and skips nothing if
  /// they differ, or if that is not known. May be null.
  std::function<std::optional<std::uint16_t>(int layers)> read_uniform{};
};

/// Reads variable-length numbers: seven bits per byte, lowest first; the eighth bit marks that more bytes follow. The
/// bytes are an array of the document, or a long array stored separately.
class VarintReader {
 public:
  VarintReader(std::span<const std::byte> bytes, const PagedBytes* pages)
      : bytes_(bytes), pages_(pages), size_(pages != nullptr ? pages->size() : bytes.size()) {}

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::optional<std::uint32_t> next() {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 35 && at_ < size_; shift += 7) {
      const auto byte = std::to_integer<std::uint32_t>(run().front());
      ++at_;
      value |= (byte & 127U) << shift;
      if (byte < 128U) return value;
    }
    return std::nullopt;
  }
  /// Reads numbers until `out` is full; larger ones become 65,535. Returns how many were read.
  [[nodiscard]] std::size_t read(std::span<std::uint16_t> out) {
    std::size_t count = 0;
    while (count < out.size() && at_ < size_) {
      const std::size_t small = read_small(out.subspan(count));
      count += small;
      at_ += small;
      if (count == out.size() || at_ == size_) break;
      const auto number = next();
      if (!number) break;
      out[count++] = static_cast<std::uint16_t>(std::min<std::uint32_t>(*number, kNoIndex));
    }
    return count;
  }
  /// Returns the common value of the next `count` numbers, and skips them. Returns nullopt and does not move if they
  /// differ, or if finding out would take long.
  [[nodiscard]] std::optional<std::uint32_t> next_same(std::uint64_t count) {
    if (pages_ == nullptr || count == 0 || count > size_ - at_) return std::nullopt;
    const auto value = pages_->uniform(at_, at_ + count);
    if (!value || std::to_integer<unsigned>(*value) > 127U) return std::nullopt;
    at_ += count;
    return std::to_integer<std::uint32_t>(*value);
  }

 private:
  /// Returns the contiguous bytes at the position. Requires: at_ < size_.
  [[nodiscard]] std::span<const std::byte> run() {
    QUOIN_ASSERT(at_ < size_, "a position within the bytes");
    if (pages_ == nullptr) return bytes_.subspan(static_cast<std::size_t>(at_));
    const auto page = static_cast<std::size_t>(at_ / PagedBytes::kPageBytes);
    if (page != page_) pages_->read_page(page, content_);
    page_ = page;
    const auto first = static_cast<std::size_t>(at_ % PagedBytes::kPageBytes);
    const auto end = std::min<std::uint64_t>(PagedBytes::kPageBytes, size_ - page * PagedBytes::kPageBytes);
    return std::span(content_).subspan(first, static_cast<std::size_t>(end) - first);
  }
  /// Copies bytes below 128, in steps of sixteen. Does not move the position. Returns how many were copied.
  std::size_t read_small(std::span<std::uint16_t> out) {
    constexpr std::size_t kStep = 16;
    const std::span<const std::byte> bytes = run();
    const std::size_t count = std::min(bytes.size(), out.size());
    std::size_t done = 0;
    for (; done + kStep <= count; done += kStep) {
      std::array<std::byte, kStep> some;
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(done), kStep, some.begin());
      const auto any = std::bit_cast<std::array<std::uint64_t, 2>>(some);
      if (((any[0] | any[1]) & 0x8080'8080'8080'8080U) != 0) return done;
      for (std::size_t i = 0; i < kStep; ++i) out[done + i] = std::to_integer<std::uint16_t>(some[i]);
    }
    for (; done < count && std::to_integer<unsigned>(bytes[done]) < 128U; ++done) {
      out[done] = std::to_integer<std::uint16_t>(bytes[done]);
    }
    return done;
  }

  static constexpr std::size_t kNoPage = ~std::size_t{0};
  std::span<const std::byte> bytes_;
  const PagedBytes* pages_;
  std::uint64_t size_;
  std::uint64_t at_ = 0;
  std::size_t page_ = kNoPage;  ///< the page in `content_`
  PagedBytes::PageContent content_;
};

class SchematicReader {
 public:
  /// `arrays`: long arrays outside the document, by the offset where their elements would begin.
  SchematicReader(nbt::Value root, const std::map<std::size_t, PagedBytes>& arrays, const Progress& progress)
      : root_(root), arrays_(arrays), progress_(progress) {}

  Result<LoadedScene> read() {
    loaded_.format = "schematic";
    Status done = read_any();
    if (!done) return done.error();
    loaded_.scene.types = types_.types();
    note_left_out();
    return std::move(loaded_);
  }

 private:
  Status read_any();
  Status read_sponge(nbt::Value schematic);
  Status read_mcedit();
  Status read_litematic(nbt::Value regions);
  Status read_litematic_region(nbt::Value from);
  Status read_structure();
  Status read_bedrock();
  Result<Block> bedrock_block(nbt::Value entry, std::optional<bool> is_waterlogged);
  Status put_structure(SchematicRegion& region, nbt::Value blocks);
  void take_biomes(SchematicRegion& region, nbt::Value palette, nbt::Value data, int layers);
  void take_numbered_biomes(SchematicRegion& region, nbt::Value numbers);
  Status put(const SchematicRegion& region);
  void take_invisible(const SchematicRegion& region);
  Status fill(const SchematicRegion& region, int first_y, std::span<const std::uint16_t> layers);
  Result<IVec3> size_of(nbt::Value schematic) const;
  void note_left_out();

  [[nodiscard]] VarintReader varints(nbt::Value array) const;
  bool put_uniform(const SchematicRegion& region, int first_y, int height, Grid& grid);

  nbt::Value root_;
  const std::map<std::size_t, PagedBytes>& arrays_;
  const Progress& progress_;
  BlockTypes types_;
  LoadedScene loaded_;
  ColumnBuilder builder_{types_};
  std::size_t entities_ = 0;
  std::size_t block_entities_ = 0;
  std::size_t second_blocks_ = 0;
  std::map<std::string, std::uint64_t> invisible_;
  bool has_lost_biomes_ = false;
};

std::uint64_t volume_of(IVec3 size) {
  return static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) * static_cast<std::uint64_t>(size.z);
}

Status check_size(IVec3 size, nbt::Value at) {
  const bool is_sound = size.x > 0 && size.y > 0 && size.z > 0;
  if (!is_sound) return fault("invalid region size " + text_of(size) + " blocks", at);
  const std::int64_t blocks = std::int64_t{size.x} * size.z;
  if (std::max({size.x, size.y, size.z}) > kMaxEdge || blocks > kMaxBlocks / size.y) {
    return make_error(ErrorCode::LimitExceeded, "the region of " + text_of(size) + " blocks is too large", {},
                      at.offset());
  }
  return {};
}

std::optional<IVec3> vector_of(nbt::Value compound) {
  IVec3 vector{0};
  constexpr std::array kNames = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = compound[kNames.at(static_cast<std::size_t>(axis))].integer();
    if (!number || *number < -kMaxPlace || *number > kMaxPlace) return std::nullopt;
    vector[axis] = static_cast<int>(*number);
  }
  return vector;
}

std::optional<IVec3> vector_of_list(nbt::Value list) {
  if (!list.is_integers() || list.count() != 3) return std::nullopt;
  IVec3 vector{0};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t number = list.integer(static_cast<std::size_t>(axis));
    if (number < -kMaxPlace || number > kMaxPlace) return std::nullopt;
    vector[axis] = static_cast<int>(number);
  }
  return vector;
}

// The three sizes are unsigned shorts.
Result<IVec3> SchematicReader::size_of(nbt::Value schematic) const {
  IVec3 size{0};
  constexpr std::array kNames = {"Width", "Height", "Length"};
  for (int axis = 0; axis < 3; ++axis) {
    const nbt::Value of_axis = schematic[kNames.at(static_cast<std::size_t>(axis))];
    const auto number = of_axis.integer();
    if (!number) return fault(std::string("the schematic has no ") + kNames.at(static_cast<std::size_t>(axis)), root_);
    const bool is_short = of_axis.tag() == nbt::Tag::Short;
    size[axis] = static_cast<int>(is_short ? *number & 0xFFFF : std::clamp<std::int64_t>(*number, 0, kMaxEdge + 1));
  }
  if (auto sound = check_size(size, schematic); !sound) return sound.error();
  return size;
}

// Reads a compound of block texts and their indices.
Result<std::vector<Block>> palette_of_texts(nbt::Value palette, BlockTypes& types) {
  std::vector<Block> blocks;
  Status done;
  palette.for_each([&](nbt::Value entry) {
    if (!done) return;
    const auto index = entry.integer();
    const auto block = parse_block(entry.name());
    if (!index || *index < 0 || !block) {
      done = fault("the block \"" + std::string(entry.name()) + "\" has no index", entry);
      return;
    }
    if (static_cast<std::uint64_t>(*index) >= kMaxPalette) {
      done = make_error(ErrorCode::LimitExceeded, "the palette has more than 65,535 blocks", {}, entry.offset());
      return;
    }
    const auto made = types.block(block->name, block->properties);
    if (!made) {
      done = made.error();
      return;
    }
    const auto at = static_cast<std::size_t>(*index);
    if (blocks.size() <= at) blocks.resize(at + 1);
    blocks[at] = *made;
  });
  if (!done) return done.error();
  if (blocks.empty()) return fault("the schematic has no palette", palette);
  return blocks;
}

Status SchematicReader::read_sponge(nbt::Value schematic) {
  const auto size = size_of(schematic);
  if (!size) return size.error();
  const nbt::Value blocks = schematic["Blocks"];
  const bool is_third = blocks.tag() == nbt::Tag::Compound;
  const nbt::Value holder = is_third ? blocks : schematic;
  const nbt::Value data = is_third ? blocks["Data"] : schematic["BlockData"];
  auto palette = palette_of_texts(holder["Palette"], types_);
  if (!palette) return palette.error();
  SchematicRegion region;
  region.name = schematic["Metadata"]["Name"].text().value_or("");
  region.min = vector_of_list(schematic["Offset"]).value_or(IVec3(0));
  region.size = *size;
  region.palette = std::move(*palette);
  block_entities_ += nbt::first_of(holder, "BlockEntities", "TileEntities").count();
  entities_ += schematic["Entities"].count();
  if (const nbt::Value second = schematic["BiomeData"]) {
    take_biomes(region, schematic["BiomePalette"], second, 1);
  } else if (const nbt::Value third = schematic["Biomes"]) {
    take_biomes(region, third["Palette"], third["Data"], region.size.y);
  }
  VarintReader indices = varints(data);
  if (indices.size() < volume_of(*size)) {
    return fault(
        "the schematic of " + text_of(*size) + " blocks has " + std::to_string(indices.size()) + " bytes of block data",
        schematic);
  }
  region.read_layer = [&indices, data, kinds = region.palette.size()](int y, std::span<std::uint16_t> layer) -> Status {
    const std::size_t count = indices.read(layer);
    const auto read = layer.first(count);
    if (count > 0 && *std::ranges::max_element(read) >= kinds) {
      return fault("a block index is beyond the " + std::to_string(kinds) + " blocks of the palette", data);
    }
    return count < layer.size() ? fault("the block data ends in layer " + std::to_string(y), data) : Status();
  };
  const std::uint64_t area = volume_of({size->x, 1, size->z});
  region.read_uniform = [&indices, area, kinds = region.palette.size()](int layers) -> std::optional<std::uint16_t> {
    VarintReader ahead = indices;
    const auto index = ahead.next_same(area * static_cast<std::uint64_t>(layers));
    if (!index || *index >= kinds) return std::nullopt;
    indices = ahead;
    return static_cast<std::uint16_t>(*index);
  };
  return put(region);
}

VarintReader SchematicReader::varints(nbt::Value array) const {
  const auto found = arrays_.find(array.offset());
  return {array.bytes(), found != arrays_.end() ? &found->second : nullptr};
}

// Reads biome indices into a palette of names: one per column, or one per block, where the lowest of 16 is used.
void SchematicReader::take_biomes(SchematicRegion& region, nbt::Value palette, nbt::Value data, int layers) {
  ColumnBiomes& biomes = region.biomes;
  std::vector<std::uint8_t> of_palette;
  palette.for_each([&](nbt::Value entry) {
    const auto index = entry.integer();
    if (!index || *index < 0 || static_cast<std::uint64_t>(*index) >= kMaxPalette) return;
    const auto at = static_cast<std::size_t>(*index);
    if (of_palette.size() <= at) of_palette.resize(at + 1);
    of_palette[at] = index_of_tints(biomes.tints, tints_of_biome(entry.name()));
  });
  const auto area = static_cast<std::size_t>(region.size.x) * static_cast<std::size_t>(region.size.z);
  VarintReader indices = varints(data);
  for (int y = 0; y < layers; ++y) {
    const bool is_taken = y % kSectionEdge == 0;
    if (const auto same = indices.next_same(area); same && *same < of_palette.size()) {
      if (is_taken) biomes.of_columns.insert(biomes.of_columns.end(), area, of_palette[*same]);
      continue;
    }
    for (std::size_t i = 0; i < area; ++i) {
      const auto next = indices.next();
      if (!next || *next >= of_palette.size()) {
        has_lost_biomes_ = true;
        biomes = {};
        return;
      }
      if (is_taken) biomes.of_columns.push_back(of_palette[*next]);
    }
  }
}

// One number per column.
void SchematicReader::take_numbered_biomes(SchematicRegion& region, nbt::Value numbers) {
  if (numbers.count() == 0) return;
  const auto area = static_cast<std::size_t>(region.size.x) * static_cast<std::size_t>(region.size.z);
  has_lost_biomes_ = !numbers.is_integers() || numbers.count() != area;
  if (has_lost_biomes_) return;
  for (std::size_t i = 0; i < area; ++i) {
    const BiomeTints tints = tints_of_biome(name_of_biome(numbers.integer(i) & 255));
    region.biomes.of_columns.push_back(index_of_tints(region.biomes.tints, tints));
  }
}

// Reads blocks by their numbers before 1.13.
Status SchematicReader::read_mcedit() {
  const auto size = size_of(root_);
  if (!size) return size.error();
  const std::span<const std::byte> blocks = root_["Blocks"].bytes();
  const std::span<const std::byte> data = root_["Data"].bytes();
  const std::span<const std::byte> add = root_["AddBlocks"].bytes();
  const std::size_t count =
      static_cast<std::size_t>(size->x) * static_cast<std::size_t>(size->y) * static_cast<std::size_t>(size->z);
  if (blocks.size() != count || (!data.empty() && data.size() != count)) {
    return fault("the schematic of " + text_of(*size) + " blocks has " + std::to_string(blocks.size()) +
                     " blocks and " + std::to_string(data.size()) + " data values",
                 root_["Blocks"]);
  }
  const std::string materials(root_["Materials"].text().value_or("Alpha"));
  if (materials != "Alpha") {
    loaded_.warnings.push_back("block numbers are read as the Java edition's, although Materials is \"" + materials +
                               "\"");
  }
  if (root_["SchematicaMapping"] || root_["BlockIDs"]) {
    loaded_.warnings.emplace_back("the file's own block numbers are ignored; the game's are used");
  }
  SchematicRegion region;
  region.size = *size;
  block_entities_ += root_["TileEntities"].count();
  entities_ += root_["Entities"].count();
  take_numbered_biomes(region, root_["Biomes"]);
  std::vector<std::uint16_t> index_of(std::size_t{4096} * 16, kNoIndex);
  const auto code_of = [&](std::size_t i) {
    const int id = nibble(add, i) << 8 | std::to_integer<int>(blocks[i]);
    return static_cast<std::size_t>(id * 16 + (data.empty() ? 0 : std::to_integer<int>(data[i]) & 15));
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t code = code_of(i);
    if (index_of[code] != kNoIndex) continue;
    const auto [name, properties] = legacy_block(static_cast<int>(code / 16), static_cast<int>(code % 16));
    const auto block = types_.block(name, properties);
    if (!block) return block.error();
    index_of[code] = static_cast<std::uint16_t>(region.palette.size());
    region.palette.push_back(*block);
  }
  region.read_layer = [&](int y, std::span<std::uint16_t> layer) -> Status {
    const std::size_t first = static_cast<std::size_t>(y) * layer.size();
    for (std::size_t i = 0; i < layer.size(); ++i) layer[i] = index_of[code_of(first + i)];
    return {};
  };
  return put(region);
}

Status SchematicReader::read_litematic(nbt::Value regions) {
  Status done;
  regions.for_each([&](nbt::Value region) {
    if (done) done = read_litematic_region(region);
  });
  if (done && loaded_.scene.grids().empty()) return fault("the litematic has no regions", regions);
  return done;
}

// A negative size extends downwards from the position.
Status SchematicReader::read_litematic_region(nbt::Value from) {
  const auto place = vector_of(from["Position"]);
  const auto reach = vector_of(from["Size"]);
  if (!place || !reach) return fault("a region has no position or no size", from);
  SchematicRegion region;
  region.name = from.name();
  region.size = glm::abs(*reach);
  region.min = *place;
  for (int axis = 0; axis < 3; ++axis) {
    if ((*reach)[axis] < 0) region.min[axis] += (*reach)[axis] + 1;
  }
  if (auto sound = check_size(region.size, from); !sound) return sound;
  if (auto read = read_block_palette(from["BlockStatePalette"], types_, region.palette); !read) return read;
  const std::size_t kinds = region.palette.size();
  if (kinds == 0 || kinds > kMaxPalette) {
    return fault("invalid palette size " + std::to_string(kinds), from["BlockStatePalette"]);
  }
  block_entities_ += from["TileEntities"].count();
  entities_ += from["Entities"].count();
  const nbt::Value states = from["BlockStates"];
  if (kinds == 1 && states.count() == 0) {
    region.read_layer = [](int, std::span<std::uint16_t> layer) -> Status {
      std::ranges::fill(layer, std::uint16_t{0});
      return {};
    };
    return put(region);
  }
  const int bits = bits_of_palette(kinds, 2);
  if (states.count() < (volume_of(region.size) * static_cast<std::uint64_t>(bits) + 63) / 64) {
    return fault(
        "the indices of " + text_of(region.size) + " blocks do not fit in " + std::to_string(states.count()) + " longs",
        from);
  }
  region.read_layer = [states, bits, kinds](int y, std::span<std::uint16_t> layer) -> Status {
    unpack_spanning(states, bits, static_cast<std::size_t>(y) * layer.size(), layer);
    if (std::ranges::all_of(layer, [kinds](std::uint16_t index) { return index < kinds; })) return {};
    return fault("a block index is beyond the " + std::to_string(kinds) + " blocks of the palette", states);
  };
  return put(region);
}

Status SchematicReader::read_structure() {
  const auto size = vector_of_list(root_["size"]);
  if (!size) return fault("the structure has no size", root_);
  if (auto sound = check_size(*size, root_["size"]); !sound) return sound;
  // Only the content determines the size of these files.
  constexpr std::int64_t kMaxArea = std::int64_t{1} << 22;
  if (std::int64_t{size->x} * size->z > kMaxArea) {
    return make_error(ErrorCode::LimitExceeded, "the structure of " + text_of(*size) + " blocks is too large");
  }
  SchematicRegion region;
  region.size = *size;
  nbt::Value palette = root_["palette"];
  if (!palette) {  // the game picks one of several at random; this reads the first
    bool is_first = true;
    root_["palettes"].for_each([&](nbt::Value each) {
      if (std::exchange(is_first, false)) palette = each;
    });
    if (root_["palettes"].count() > 1) {
      loaded_.warnings.push_back("only the first of " + std::to_string(root_["palettes"].count()) +
                                 " palettes is read");
    }
  }
  if (auto read = read_block_palette(palette, types_, region.palette); !read) return read;
  if (region.palette.size() >= kMaxPalette) return fault("the palette has more than 65,534 blocks", palette);
  entities_ += root_["entities"].count();
  return put_structure(region, root_["blocks"]);
}

/// Returns true for a block of water in a Bedrock palette.
bool is_bedrock_water(nbt::Value block) {
  const std::string_view name = block["name"].text().value_or("");
  return name == "minecraft:water" || name == "minecraft:flowing_water";
}

// A name and states, which are bytes (switches), numbers or texts.
Result<Block> SchematicReader::bedrock_block(nbt::Value entry, std::optional<bool> is_waterlogged) {
  const auto name = entry["name"].text();
  if (!name) return fault("a block without a name", entry);
  std::vector<Property> states;
  entry["states"].for_each([&](nbt::Value state) {
    const auto number = state.integer();
    states.emplace_back(state.name(), number ? std::to_string(*number) : std::string(state.text().value_or("")));
  });
  const BlockText block = java_block(*name, states, is_waterlogged);
  return types_.block(block.name, block.properties);
}

/// The content of a voxel of a Bedrock structure.
struct BedrockVoxel {
  std::uint16_t block;  ///< index in the palette; BedrockIndices::kNone: no block
  bool has_water;       ///< in its rest
  bool loses_second;    ///< a second block, that is not water, is left out
};

/// The block indices of a Bedrock structure, ordered by x, then y, then z. A second list has the water in blocks, and
/// snow around plants.
struct BedrockIndices {
  nbt::Value blocks;
  nbt::Value seconds;  ///< may be none
  IVec3 size{0};
  std::vector<bool> is_water;         ///< by palette index
  std::vector<bool> is_air;           ///< by palette index
  std::vector<std::uint16_t> filled;  ///< by palette index: that of the block with water, or 0
  static constexpr std::uint16_t kNone = 0xFFFF;

  /// Returns the content of the voxel (x, y, z). Errors: BadFormat.
  [[nodiscard]] Result<BedrockVoxel> at(IVec3 voxel) const {
    const std::size_t at =
        (static_cast<std::size_t>(voxel.x) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(voxel.y)) *
            static_cast<std::size_t>(size.z) +
        static_cast<std::size_t>(voxel.z);
    const std::int64_t block = blocks.integer(at);
    const std::int64_t second = seconds ? seconds.integer(at) : -1;
    const auto kinds = static_cast<std::int64_t>(is_water.size());
    if (std::min(block, second) < -1 || std::max(block, second) >= kinds) {
      return fault("a block index is beyond the " + std::to_string(kinds) + " blocks of the palette", blocks);
    }
    if (second < 0) return BedrockVoxel{block < 0 ? kNone : static_cast<std::uint16_t>(block), false, false};
    if (block < 0) return BedrockVoxel{static_cast<std::uint16_t>(second), false, false};
    const bool has_water = is_water[static_cast<std::size_t>(second)];
    return BedrockVoxel{static_cast<std::uint16_t>(block), has_water && !is_water[static_cast<std::size_t>(block)],
                        !has_water && !is_air[static_cast<std::size_t>(second)]};
  }
};

Status SchematicReader::read_bedrock() {
  const auto size = vector_of_list(root_["size"]);
  if (!size) return fault("the structure has no size", root_);
  if (auto sound = check_size(*size, root_["size"]); !sound) return sound;
  const nbt::Value structure = root_["structure"];
  std::vector<nbt::Value> layers;
  structure["block_indices"].for_each([&](nbt::Value layer) { layers.push_back(layer); });
  layers.resize(2);
  const auto is_whole = [&](nbt::Value layer) { return layer.is_integers() && layer.count() == volume_of(*size); };
  if (!is_whole(layers[0])) {
    return fault(
        "the structure of " + text_of(*size) + " blocks has " + std::to_string(layers[0].count()) + " block indices",
        structure);
  }
  BedrockIndices indices{layers[0], is_whole(layers[1]) ? layers[1] : nbt::Value(), *size, {}, {}, {}};
  const nbt::Value contents = structure["palette"]["default"];
  std::vector<nbt::Value> entries;
  contents["block_palette"].for_each([&](nbt::Value entry) {
    entries.push_back(entry);
    indices.is_water.push_back(is_bedrock_water(entry));
    indices.is_air.push_back(entry["name"].text() == "minecraft:air");
  });
  constexpr std::size_t kMaxKinds = kMaxPalette / 2;
  if (entries.size() > kMaxKinds) return fault("the palette has more than 32,767 blocks", contents);
  indices.filled.resize(entries.size());
  for (int x = 0; x < size->x; ++x) {
    for (int y = 0; y < size->y; ++y) {
      for (int z = 0; z < size->z; ++z) {
        const auto block = indices.at({x, y, z});
        if (!block) return block.error();
        if (block->has_water) indices.filled[block->block] = 1;
        second_blocks_ += block->loses_second ? 1 : 0;
      }
    }
  }
  SchematicRegion region;
  region.size = *size;
  for (const bool is_waterlogged : {false, true}) {
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (is_waterlogged && indices.filled[i] == 0) continue;
      const auto block =
          bedrock_block(entries[i], indices.filled[i] == 0 ? std::nullopt : std::optional(is_waterlogged));
      if (!block) return block.error();
      if (is_waterlogged) indices.filled[i] = static_cast<std::uint16_t>(region.palette.size());
      region.palette.push_back(*block);
    }
  }
  const auto air = static_cast<std::uint16_t>(region.palette.size());
  region.palette.emplace_back();
  contents["block_position_data"].for_each([&](nbt::Value data) {
    if (data["block_entity_data"]) ++block_entities_;
  });
  entities_ += structure["entities"].count();
  region.read_layer = [&indices, air](int y, std::span<std::uint16_t> layer) -> Status {
    for (std::size_t i = 0; i < layer.size(); ++i) {
      const auto width = static_cast<std::size_t>(indices.size.x);
      const auto block = indices.at({static_cast<int>(i % width), y, static_cast<int>(i / width)});
      if (!block) return block.error();
      const std::uint16_t index = block->block;
      layer[i] = index == BedrockIndices::kNone ? air : block->has_water ? indices.filled[index] : index;
    }
    return {};
  };
  return put(region);
}

void ColumnBiomes::put_into(Section& section, IVec3 corner, IVec3 size) const {
  section.biomes = tints;
  if (section.biomes.empty()) section.biomes.emplace_back();
  section.biome_indices.assign(of_columns.empty() ? 64 : 256, 0);
  if (of_columns.empty()) return;
  const auto width = static_cast<std::size_t>(size.x);
  const std::size_t area = width * static_cast<std::size_t>(size.z);
  const std::size_t slab = of_columns.size() == area ? 0 : static_cast<std::size_t>(corner.y / kSectionEdge);
  const auto row = static_cast<std::size_t>(std::min(kSectionEdge, size.x - corner.x));
  for (int dz = 0; dz < std::min(kSectionEdge, size.z - corner.z); ++dz) {
    const std::size_t from =
        slab * area + static_cast<std::size_t>(corner.z + dz) * width + static_cast<std::size_t>(corner.x);
    QUOIN_ASSERT(from + row <= of_columns.size(), "columns of the region");
    std::copy_n(of_columns.begin() + static_cast<std::ptrdiff_t>(from), row,
                section.biome_indices.begin() + static_cast<std::ptrdiff_t>(dz) * kSectionEdge);
  }
}

// Positions without a block are air.
Status SchematicReader::put_structure(SchematicRegion& region, nbt::Value blocks) {
  struct Placed {
    int y;
    std::uint32_t at;
    std::uint16_t index;
  };
  const auto air = static_cast<std::uint16_t>(region.palette.size());
  std::vector<Placed> placed;
  Status done;
  blocks.for_each([&](nbt::Value block) {
    if (!done) return;
    const auto at = vector_of_list(block["pos"]);
    const auto index = block["state"].integer();
    const bool is_sound = at && index && IBox{IVec3(0), region.size}.contains(*at) && *index >= 0 && *index < air;
    if (!is_sound) {
      done = fault("a block is outside the structure or its palette", block);
      return;
    }
    if (block["nbt"]) ++block_entities_;
    const auto in_layer = static_cast<std::uint32_t>(at->z) * static_cast<std::uint32_t>(region.size.x) +
                          static_cast<std::uint32_t>(at->x);
    placed.push_back({at->y, in_layer, static_cast<std::uint16_t>(*index)});
  });
  if (!done) return done;
  std::ranges::stable_sort(placed, {}, &Placed::y);
  region.palette.emplace_back();
  std::size_t next = 0;
  region.read_layer = [&placed, &next, air](int y, std::span<std::uint16_t> layer) -> Status {
    std::ranges::fill(layer, air);
    for (; next < placed.size() && placed[next].y == y; ++next) layer[placed[next].at] = placed[next].index;
    return {};
  };
  return put(region);
}

// Cuts one slab of 16 layers at a time into sections.
Status SchematicReader::fill(const SchematicRegion& region, int first_y, std::span<const std::uint16_t> layers) {
  const auto width = static_cast<std::size_t>(region.size.x);
  const std::size_t area = width * static_cast<std::size_t>(region.size.z);
  const int height = static_cast<int>(layers.size() / area);
  QUOIN_ASSERT(layers.size() % area == 0 && height <= kSectionEdge, "up to 16 whole layers");
  const auto air = static_cast<std::uint16_t>(region.palette.size());
  Section section;
  section.palette = region.palette;
  section.palette.emplace_back();
  for (int z = 0; z < region.size.z; z += kSectionEdge) {
    for (int x = 0; x < region.size.x; x += kSectionEdge) {
      const IVec3 corner(x, first_y, z);
      const IVec3 count = glm::min(IVec3(region.size.x - x, height, region.size.z - z), IVec3(kSectionEdge));
      const bool is_whole = count == IVec3(kSectionEdge);
      if (!is_whole) section.indices.fill(air);
      const auto row = static_cast<std::size_t>(count.x);
      const std::uint16_t first = layers[static_cast<std::size_t>(z) * width + static_cast<std::size_t>(x)];
      std::uint16_t differences = 0;
      for (int dy = 0; dy < count.y; ++dy) {
        for (int dz = 0; dz < count.z; ++dz) {
          const std::uint16_t* const from = layers.data() + static_cast<std::size_t>(dy) * area +
                                            static_cast<std::size_t>(z + dz) * width + static_cast<std::size_t>(x);
          std::uint16_t* const to = section.indices.data() + (dy * kSectionEdge + dz) * kSectionEdge;
          for (std::size_t i = 0; i < row; ++i) {
            to[i] = from[i];
            differences |= static_cast<std::uint16_t>(from[i] ^ first);
          }
        }
      }
      QUOIN_ASSERT(first < region.palette.size(), "an index into the palette");
      const Block& block = region.palette[first];
      if (differences == 0 && block.is_air()) continue;
      if (differences == 0 && is_whole && block.is_plain()) {
        builder_.put_block(block, corner);
        continue;
      }
      region.biomes.put_into(section, corner, region.size);
      if (auto put = builder_.put(section, corner); !put) return put;
    }
  }
  return {};
}

void SchematicReader::take_invisible(const SchematicRegion& region) {
  SourcePart part;
  builder_.take_invisible(part);
  for (const auto& [name, count] : part.skipped_blocks) invisible_[name] += count;
  for (Lamp& lamp : part.lamps) {
    lamp.position += DVec3(region.min);
    loaded_.scene.lamps.push_back(std::move(lamp));
  }
}

// Adds layers of one block up to the next chunk border, without visiting each block. Returns false and reads nothing if
// a block has more than its type, or if blocks differ.
bool SchematicReader::put_uniform(const SchematicRegion& region, int first_y, int height, Grid& grid) {
  if (!region.read_uniform || !std::ranges::all_of(region.palette, &Block::is_plain)) return false;
  const auto index = region.read_uniform(height);
  if (!index) return false;
  QUOIN_ASSERT(*index < region.palette.size(), "an index into the palette");
  const VoxelType type = region.palette[*index].type;
  if (type == kAir) return true;
  grid.fill_box({{0, first_y, 0}, {region.size.x, first_y + height, region.size.z}}, type);
  return true;
}

Status SchematicReader::put(const SchematicRegion& region) {
  SceneGrid grid;
  grid.name = region.name;
  const auto area = static_cast<std::size_t>(region.size.x) * static_cast<std::size_t>(region.size.z);
  std::vector<std::uint16_t> layers;
  const auto cancelled = [&](int done) { return progress_ && !progress_(static_cast<double>(done) / region.size.y); };
  for (int y = 0; y < region.size.y; y += kSectionEdge) {
    const int rest = std::min(kChunkEdge, region.size.y - y);
    if (y % kChunkEdge == 0 && put_uniform(region, y, rest, grid.grid)) {
      if (cancelled(y + rest)) return make_error(ErrorCode::Cancelled, "cancelled");
      y += rest - kSectionEdge;
      continue;
    }
    const int height = std::min(kSectionEdge, region.size.y - y);
    layers.resize(area * static_cast<std::size_t>(height));
    for (int dy = 0; dy < height; ++dy) {
      auto read = region.read_layer(y + dy, std::span(layers).subspan(static_cast<std::size_t>(dy) * area, area));
      if (!read) return read;
    }
    if (auto filled = fill(region, y, layers); !filled) return filled;
    const bool is_chunk_done = (y + height) % kChunkEdge == 0 || y + height == region.size.y;
    if (!is_chunk_done) continue;
    for (SourceChunk& each : builder_.take()) grid.grid.put_chunk(each.chunk, std::move(each.voxels));
    if (cancelled(y + height)) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  take_invisible(region);
  grid.canvas = {IVec3(0), region.size};
  Instance instance;
  instance.name = region.name;
  instance.position = DVec3(region.min);
  instance.grid = loaded_.scene.add_grid(std::move(grid));
  loaded_.scene.add_instance(std::move(instance));
  return {};
}

void SchematicReader::note_left_out() {
  const auto note = [&](std::size_t count, const char* what) {
    if (count > 0) loaded_.warnings.push_back("left out: " + std::to_string(count) + " " + what);
  };
  note(block_entities_, "block entities (chests, signs and others)");
  note(entities_, "entities");
  note(second_blocks_, "blocks in the same voxels as others (snow around flowers)");
  if (!invisible_.empty()) loaded_.warnings.push_back(text_of_skipped_blocks(invisible_));
  if (has_lost_biomes_) {
    loaded_.warnings.emplace_back("left out: damaged biomes; plains colours are used there");
  }
}

Status SchematicReader::read_any() {
  if (const nbt::Value third = root_["Schematic"]; third["Blocks"]) return read_sponge(third);
  if (root_["BlockData"]) return read_sponge(root_);
  if (root_["Regions"].tag() == nbt::Tag::Compound) return read_litematic(root_["Regions"]);
  if (root_["structure"]["block_indices"]) return read_bedrock();
  if (root_["size"] && (root_["palette"] || root_["palettes"])) return read_structure();
  if (root_["Blocks"].tag() == nbt::Tag::ByteArray && root_["Width"]) return read_mcedit();
  std::string keys;
  root_.for_each([&](nbt::Value value) {
    constexpr std::size_t kEnough = 80;
    if (keys.size() < kEnough) keys.append(keys.empty() ? "" : ", ").append(printable(value.name()));
  });
  return make_error(ErrorCode::Unsupported,
                    "an NBT file that is not a schematic; it has " + (keys.empty() ? std::string("nothing") : keys));
}

// Bedrock NBT is little-endian: a compound without a name, whose first value has a printable name in that byte order.
bool is_bedrock_structure(std::span<const std::byte> bytes) {
  constexpr std::size_t kNameAt = 6;
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(bytes[i]); };
  if (bytes.size() < kNameAt || at(0) != static_cast<unsigned>(nbt::Tag::Compound) || at(1) != 0 || at(2) != 0)
    return false;
  const std::size_t length = at(4) | at(5) << 8;
  if (at(5) != 0 || length == 0 || bytes.size() < kNameAt + length) return false;
  return std::ranges::all_of(bytes.subspan(kNameAt, length), [](std::byte b) {
    const auto c = std::to_integer<unsigned>(b);
    return c >= 0x20 && c < 0x7F;
  });
}

}  // namespace

bool begins_nbt(std::span<const std::byte> beginning) {
  constexpr std::size_t kLongestName = 64;
  constexpr std::size_t kEnough = 3 + kLongestName + 1;
  std::vector<std::byte> expanded;
  std::span<const std::byte> bytes = beginning;
  if (begins_gzip(beginning)) {
    auto first = first_bytes(beginning, kEnough);
    if (!first) return false;
    expanded = std::move(*first);
    bytes = expanded;
  }
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(bytes[i]); };
  if (bytes.size() < 4 || at(0) != static_cast<unsigned>(nbt::Tag::Compound)) return false;
  const std::size_t name = at(1) << 8 | at(2);
  if (name > kLongestName || bytes.size() < 4 + name) return false;
  for (std::size_t i = 3; i < 3 + name; ++i) {
    if (at(i) < 0x20) return false;
  }
  const unsigned first = at(3 + name);
  return first != static_cast<unsigned>(nbt::Tag::End) && first <= static_cast<unsigned>(nbt::Tag::LongArray);
}

Result<LoadedScene> read_schematic(std::span<const std::byte> bytes, const Progress& progress) {
  const bool is_bedrock = is_bedrock_structure(bytes);
  LargeNbt content;
  if (begins_gzip(bytes)) {
    auto large = read_large_nbt(bytes, kMaxSchematicBytes);
    if (!large) return large.error();
    content = std::move(*large);
  } else {
    auto expanded = decompress_file(bytes, kMaxSchematicBytes);
    if (!expanded) return expanded.error();
    content.bytes = std::move(*expanded);
  }
  const auto document = nbt::Document::parse(
      content.bytes,
      {.depth = 512, .nodes = std::size_t{1} << 24, .order = is_bedrock ? std::endian::little : std::endian::big});
  if (!document) return document.error();
  return SchematicReader(document->root(), content.arrays, progress).read();
}

}  // namespace quoin::minecraft

namespace quoin {

extern constinit const FormatDriver kSchematicFormat = {
    .info = {FileFormat::Schematic, ".schem",
             "Minecraft schematic, also .schematic, .litematic and structures (.nbt, .mcstructure)",
             FormatCapability::Read | FormatCapability::Write, ".schematic .litematic .nbt .mcstructure"},
    .detect = minecraft::begins_nbt,
    .read = [](const FormatInput& input) -> Result<LoadedScene> {
      return minecraft::read_schematic(input.bytes, input.progress);
    },
    .encode = [](const FormatOutput& output) -> Result<EncodedFile> {
      return minecraft::write_schematic(output.scene, output.progress);
    },
};

}  // namespace quoin
