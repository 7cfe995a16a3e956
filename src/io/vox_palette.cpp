#include "io/vox_palette.h"

#include <bit>

#include "io/text.h"
#include "io/vox_chunk_reader.h"
#include "io/vox_material.h"

namespace quoin::vox {

namespace {

// MATT's properties by bit: a float each, but for the last, which has no value.
struct OldProperty {
  const char* key;
  bool has_value;
};
constexpr std::array<OldProperty, 8> kOldProperties = {{{"_plastic", true},
                                                        {"_rough", true},
                                                        {"_spec", true},
                                                        {"_ior", true},
                                                        {"_att", true},
                                                        {"_flux", true},
                                                        {"_glow", true},
                                                        {"_total_power", false}}};
constexpr std::array<const char*, 4> kOldTypes = {"_diffuse", "_metal", "_glass", "_emit"};

Rgba8 palette_entry(std::span<const std::byte> palette, std::size_t colour_index) {
  const std::span<const std::byte> entry = palette.subspan((colour_index - 1) * 4, 4);
  return {static_cast<std::uint8_t>(entry[0]), static_cast<std::uint8_t>(entry[1]), static_cast<std::uint8_t>(entry[2]),
          static_cast<std::uint8_t>(entry[3])};
}

/// The colour index that a MATL or MATT id names: some versions count 0 to 255, others 1 to 256; 256 is air's, as 0.
std::optional<std::size_t> colour_index_of(std::int32_t id) {
  if (id < 0 || id > static_cast<std::int32_t>(kColours)) return std::nullopt;
  return static_cast<std::size_t>(id) % kColours;
}

/// Null, and counted, when the id belongs to no colour.
Attributes* slot_for(std::int32_t id, Document& out) {
  const std::optional<std::size_t> index = colour_index_of(id);
  if (index.has_value()) return &out.materials[*index];
  ++out.stray_materials;
  return nullptr;
}

float float_from_bits(std::uint32_t bits) {
  return std::bit_cast<float>(bits);
}

}  // namespace

Status parse_material(ChunkReader& chunk, Document& out) {
  const std::int32_t id = chunk.i32();
  const Dict dict = chunk.dict();
  if (chunk.failed()) return chunk.too_short();
  Attributes* slot = slot_for(id, out);
  if (slot == nullptr) return {};
  slot->clear();
  for (const auto& [key, value] : dict.entries) slot->insert_or_assign(printable(key), printable(value));
  return {};
}

Status parse_old_material(ChunkReader& chunk, Document& out) {
  const std::int32_t id = chunk.i32();
  const std::uint32_t type = chunk.u32();
  const float weight = float_from_bits(chunk.u32());
  const std::uint32_t bits = chunk.u32();
  Attributes attributes;
  attributes["_type"] = kOldTypes[type < kOldTypes.size() ? type : 0];
  attributes["_weight"] = to_text(weight);
  for (std::size_t i = 0; i < kOldProperties.size(); ++i) {
    if ((bits >> i & 1U) == 0) continue;
    attributes[kOldProperties[i].key] = kOldProperties[i].has_value ? to_text(float_from_bits(chunk.u32())) : "1";
  }
  if (chunk.failed()) return chunk.too_short();
  if (Attributes* slot = slot_for(id, out)) *slot = std::move(attributes);
  return {};
}

std::array<Rgba8, kColours> default_palette() {
  // A cube of six steps a channel, white first and blue fastest, whose last entry, black, gives way to ramps of ten
  // steps in red, green, blue and grey.
  constexpr std::array<std::uint8_t, 6> kSteps = {0xFF, 0xCC, 0x99, 0x66, 0x33, 0x00};
  constexpr std::array<std::uint8_t, 10> kRamp = {0xEE, 0xDD, 0xBB, 0xAA, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11};
  constexpr std::size_t kCube = 215;
  std::array<Rgba8, kColours> colours{};
  colours[0] = {0, 0, 0, 0};
  for (std::size_t i = 0; i < kCube; ++i) {
    colours[i + 1] = {kSteps[i / 36], kSteps[i / 6 % 6], kSteps[i % 6], 255};
  }
  for (std::size_t i = 0; i < kRamp.size(); ++i) {
    const std::uint8_t step = kRamp[i];
    colours[kCube + 1 + i] = {step, 0, 0, 255};
    colours[kCube + 11 + i] = {0, step, 0, 255};
    colours[kCube + 21 + i] = {0, 0, step, 255};
    colours[kCube + 31 + i] = {step, step, step, 255};
  }
  return colours;
}

std::string default_type_name(int type) {
  return "palette " + std::to_string(type);
}

std::array<std::uint8_t, kColours> types_by_colour_index(const Document& document, std::vector<std::string>& warnings) {
  std::array<std::uint8_t, kColours> type_of{};
  for (std::size_t i = 0; i < kColours; ++i) type_of[i] = static_cast<std::uint8_t>(i);
  if (document.index_map.empty()) return type_of;
  // IMAP's byte i is the colour index that the palette shows in place i + 1; place 256 is air's.
  std::array<std::uint8_t, kColours> shown_as{};
  for (std::size_t i = 0; i + 1 < kColours; ++i) {
    const auto colour_index = static_cast<std::uint8_t>(document.index_map[i]);
    if (colour_index == 0 || shown_as[colour_index] != 0) {
      warnings.emplace_back("IMAP is not a permutation of the palette; ignored");
      return type_of;
    }
    shown_as[colour_index] = static_cast<std::uint8_t>(i + 1);
  }
  return shown_as;
}

Status register_palette(const Document& document, const std::array<std::uint8_t, kColours>& type_of,
                        VoxelRegistry& types) {
  const std::array<Rgba8, kColours> fallback = default_palette();
  std::array<std::size_t, kColours> colour_index_of_type{};
  for (std::size_t i = 0; i < kColours; ++i) colour_index_of_type[type_of[i]] = i;
  for (std::size_t type = 1; type < kColours; ++type) {
    const std::size_t index = colour_index_of_type[type];
    const Rgba8 colour = document.palette.empty() ? fallback[index] : palette_entry(document.palette, index);
    const std::string name = default_type_name(static_cast<int>(type));
    const Result<VoxelType> added = types.add(decode_material(name, colour, document.materials[index]));
    if (!added) return tl::unexpected(added.error());
  }
  return {};
}

}  // namespace quoin::vox
