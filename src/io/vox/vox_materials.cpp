#include <quoin/core/assert.h>

#include "io/vox/vox_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <string_view>

#include "core/bytes/text.h"
#include "io/vox/chunks.h"

namespace quoin::vox {

namespace {

// MATT's properties by bit: a float each, except the last, which has no value.
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

/// Requires: the palette has that entry.
Rgba8 palette_entry(std::span<const std::byte> palette, std::size_t colour_index) {
  QUOIN_ASSERT(colour_index > 0 && 4 * colour_index <= palette.size(), "an entry of the palette");
  const std::span<const std::byte> entry = palette.subspan((colour_index - 1) * 4, 4);
  return {static_cast<std::uint8_t>(entry[0]), static_cast<std::uint8_t>(entry[1]), static_cast<std::uint8_t>(entry[2]),
          static_cast<std::uint8_t>(entry[3])};
}

/// Returns the colour index of a MATL or MATT id. Some versions count 0 to 255, others 1 to 256; 256 is air, like 0.
std::optional<std::size_t> colour_index_of(std::int32_t id) {
  if (id < 0 || id > static_cast<std::int32_t>(kColours)) return std::nullopt;
  return static_cast<std::size_t>(id) % kColours;
}

/// Returns the attributes for an id, and links the current chunk to that colour. Returns null for an invalid id, and
/// counts it.
Attributes* slot_for(std::int32_t id, Document& out) {
  const std::optional<std::size_t> index = colour_index_of(id);
  if (index.has_value()) {
    if (!out.chunks.empty()) {
      out.chunks.back().kind = ChunkKind::Material;
      out.chunks.back().number = *index;
    }
    return &out.materials[*index];
  }
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
  // The first entries are a cube of six steps per channel, white first and blue fastest. Its last entry, black, is
  // replaced by ramps of ten steps in red, green, blue and grey.
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
  // IMAP's byte i is the colour index that the palette shows at position i + 1; position 256 is air's.
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
  QUOIN_ASSERT(types.size() == 1, "types hold air only");
  const std::array<Rgba8, kColours> fallback = default_palette();
  std::array<std::size_t, kColours> colour_index_of_type{};
  for (std::size_t i = 0; i < kColours; ++i) colour_index_of_type[type_of[i]] = i;
  for (std::size_t type = 1; type < kColours; ++type) {
    const std::size_t index = colour_index_of_type[type];
    const bool has_entry = 4 * index <= document.palette.size();
    const Rgba8 colour = has_entry ? palette_entry(document.palette, index) : fallback[index];
    const std::string name = default_type_name(static_cast<int>(type));
    const Result<VoxelType> added = types.add(decode_material(name, colour, document.materials[index]));
    if (!added) return added.error();
  }
  return {};
}

namespace {

constexpr float kDefaultRoughness = 0.1F;
constexpr float kDefaultTransparency = 0.5F;
constexpr float kLeastAlpha = 0.1F;
constexpr float kMaxFlux = 16.0F;
constexpr float kMaxRefraction = 10.0F;
const float kDefaultRefraction = VoxelProperties{}.ior;

constexpr float kDefaultScattering = 0.05F;
constexpr float kMaxScattering = 1e6F;

const std::array<std::string, 14> kDecodedKeys = {"_type",  "_rough", "_metal",      "_plastic", "_weight",
                                                  "_alpha", "_trans", "_emit",       "_flux",    "_ior",
                                                  "_ri",    "_d",     "_media_type", "_g"};
constexpr std::string_view kOwnPrefix = "quoin_";

std::optional<float> number(const Attributes& attributes, const std::string& key) {
  const auto found = attributes.find(key);
  return found == attributes.end() ? std::nullopt : parse_float(found->second);
}

float unit(std::optional<float> value, float fallback) {
  return std::clamp(value.value_or(fallback), 0.0F, 1.0F);
}

std::optional<float> either(std::optional<float> first, std::optional<float> second) {
  return first.has_value() ? first : second;
}

std::uint8_t byte_from_unit(float value) {
  QUOIN_ASSERT(value >= 0.0F && value <= 1.0F, "0 <= value <= 1");
  return static_cast<std::uint8_t>(std::lround(value * 255.0F));
}

void make_transparent(VoxelProperties& out, float transparency) {
  out.visibility = Visibility::Transparent;
  out.colour.a = byte_from_unit(std::max(kLeastAlpha, 1.0F - transparency));
}

float emitted(const Attributes& attributes) {
  const float share = unit(either(number(attributes, "_emit"), number(attributes, "_weight")), 1.0F);
  const float flux = std::clamp(number(attributes, "_flux").value_or(0.0F), -kMaxFlux, kMaxFlux);
  return share * std::exp2(flux);
}

/// Clouds and subsurface materials scatter; other media are drawn as glass.
void decode_cloud(const Attributes& attributes, VoxelProperties& out) {
  const auto kind = attributes.find("_media_type");
  if (kind == attributes.end() || (kind->second != "_scatter" && kind->second != "_sss")) return;
  out.scattering = std::clamp(number(attributes, "_d").value_or(kDefaultScattering), 0.0F, kMaxScattering);
  out.anisotropy = std::clamp(number(attributes, "_g").value_or(0.0F), -1.0F, 1.0F);
}

/// Decodes the published keys.
void decode_published(const Attributes& attributes, VoxelProperties& out) {
  const auto type_entry = attributes.find("_type");
  const std::string type = type_entry == attributes.end() ? "_diffuse" : type_entry->second;
  const float rough = unit(number(attributes, "_rough"), kDefaultRoughness);
  const std::optional<float> weight = number(attributes, "_weight");
  const std::optional<float> transparency = either(number(attributes, "_trans"), number(attributes, "_alpha"));
  const bool plastic = number(attributes, "_plastic").value_or(0.0F) != 0.0F;
  if (type == "_metal") {
    out.roughness = rough;
    out.metalness = plastic ? 0.0F : unit(either(number(attributes, "_metal"), weight), 1.0F);
  } else if (type == "_plastic") {
    out.roughness = rough;
  } else if (type == "_glass" || type == "_media") {
    out.roughness = rough;
    make_transparent(out, unit(either(transparency, weight), kDefaultTransparency));
    if (type == "_media") decode_cloud(attributes, out);
  } else if (type == "_blend") {
    out.roughness = rough;
    out.metalness = unit(number(attributes, "_metal"), 0.0F);
    if (unit(transparency, 0.0F) > 0.0F) make_transparent(out, unit(transparency, 0.0F));
  } else if (type == "_emit") {
    out.emission = emitted(attributes);
  }
  std::optional<float> refraction = number(attributes, "_ri");
  if (!refraction.has_value() && number(attributes, "_ior").has_value())
    refraction = 1.0F + *number(attributes, "_ior");
  out.ior = std::clamp(refraction.value_or(kDefaultRefraction), 1.0F, kMaxRefraction);
}

/// Decodes Quoin's own keys, in the order of encode_own.
void decode_own(const Attributes& attributes, VoxelProperties& out) {
  const auto text = [&](const char* key) -> const std::string* {
    const auto found = attributes.find(std::string(kOwnPrefix) + key);
    return found == attributes.end() ? nullptr : &found->second;
  };
  const auto set = [&](const char* key, float& value) {
    const std::string* found = text(key);
    if (found != nullptr) value = parse_float(*found).value_or(value);
  };
  if (const std::string* name = text("name")) out.name = *name;
  if (const std::string* collides = text("collides")) out.collides = *collides != "0";
  float state_bits = 0.0F;
  set("state_bits", state_bits);
  out.state_bits = static_cast<std::uint8_t>(std::clamp(state_bits, 0.0F, float{kMaxStateBits}));
  if (const std::string* remesh = text("remesh_on_data")) out.remesh_on_data = *remesh != "0";
  if (const std::string* visibility = text("visibility")) {
    out.visibility = *visibility == "transparent" ? Visibility::Transparent : Visibility::Opaque;
  }
  const auto set_own = [&](const char* key, std::optional<bool>& value) {
    if (const std::string* found = text(key)) value = *found != "0";
  };
  set_own("blocks_light", out.blocks_light);
  set_own("occludes", out.occludes);
  if (out.visibility == Visibility::Transparent) out.occludes.reset();  // no transparent type occludes
  float light_cost = 0.0F;
  set("light_cost", light_cost);
  out.light_cost = static_cast<std::uint8_t>(std::clamp(light_cost, 0.0F, float{kMaxLightCost}));
  float alpha = out.colour.a;
  set("alpha", alpha);
  out.colour.a = static_cast<std::uint8_t>(std::clamp(alpha, 0.0F, 255.0F));
  set("roughness", out.roughness);
  set("metalness", out.metalness);
  set("emission", out.emission);
  set("ior", out.ior);
  set("scattering", out.scattering);
  set("anisotropy", out.anisotropy);
  out.roughness = std::clamp(out.roughness, 0.0F, 1.0F);
  out.metalness = std::clamp(out.metalness, 0.0F, 1.0F);
  out.emission = std::max(out.emission, 0.0F);
  out.ior = std::clamp(out.ior, 1.0F, kMaxRefraction);
  out.scattering = std::clamp(out.scattering, 0.0F, kMaxScattering);
  out.anisotropy = std::clamp(out.anisotropy, -1.0F, 1.0F);
}

void encode_emission(float emission, Attributes& out) {
  int flux = 0;
  while (emission > std::exp2(static_cast<float>(flux)) && flux < static_cast<int>(kMaxFlux)) ++flux;
  out["_emit"] = to_text(emission / std::exp2(static_cast<float>(flux)));
  if (flux > 0) out["_flux"] = std::to_string(flux);
}

/// Writes the keys of MagicaVoxel's nearest material.
void encode_published(const VoxelProperties& properties, Attributes& out) {
  const bool transparent = properties.visibility == Visibility::Transparent;
  if (properties.emission > 0.0F) {
    out["_type"] = "_emit";
    encode_emission(properties.emission, out);
  } else if (transparent) {
    out["_type"] = properties.scattering > 0.0F ? "_media" : properties.metalness > 0.0F ? "_blend" : "_glass";
  } else if (properties.metalness > 0.0F) {
    out["_type"] = "_metal";
  } else if (properties.roughness < 1.0F) {
    out["_type"] = "_plastic";
  }
  if (out.empty() || out.find("_type") == out.end()) return;
  if (properties.roughness < 1.0F) out["_rough"] = to_text(properties.roughness);
  if (properties.metalness > 0.0F) out["_metal"] = to_text(properties.metalness);
  if (out["_type"] == "_media") {
    out["_media_type"] = "_scatter";
    out["_d"] = to_text(properties.scattering);
    if (properties.anisotropy != 0.0F) out["_g"] = to_text(properties.anisotropy);
  }
  if (transparent) out["_trans"] = to_text(static_cast<float>(255 - properties.colour.a) / 255.0F);
}

/// Adds Quoin's own keys for properties that `decoded`, the result of the published keys, lacks.
void encode_own(const VoxelProperties& wanted, const VoxelProperties& decoded, Attributes& out) {
  const auto set = [&](const char* key, const std::string& value) { out[std::string(kOwnPrefix) + key] = value; };
  if (wanted.name != decoded.name) set("name", printable(wanted.name));
  if (wanted.collides != decoded.collides) set("collides", wanted.collides ? "1" : "0");
  if (wanted.state_bits != decoded.state_bits) set("state_bits", std::to_string(wanted.state_bits));
  if (wanted.blocks_light && wanted.blocks_light != decoded.blocks_light) {
    set("blocks_light", *wanted.blocks_light ? "1" : "0");
  }
  if (wanted.occludes && wanted.occludes != decoded.occludes) set("occludes", *wanted.occludes ? "1" : "0");
  if (wanted.light_cost != decoded.light_cost) set("light_cost", std::to_string(wanted.light_cost));
  if (wanted.remesh_on_data != decoded.remesh_on_data) set("remesh_on_data", wanted.remesh_on_data ? "1" : "0");
  if (wanted.visibility != decoded.visibility) {
    set("visibility", wanted.visibility == Visibility::Transparent ? "transparent" : "opaque");
  }
  if (wanted.colour.a != decoded.colour.a) set("alpha", std::to_string(wanted.colour.a));
  if (wanted.roughness != decoded.roughness) set("roughness", to_text(wanted.roughness));
  if (wanted.metalness != decoded.metalness) set("metalness", to_text(wanted.metalness));
  if (wanted.emission != decoded.emission) set("emission", to_text(wanted.emission));
  if (wanted.ior != decoded.ior) set("ior", to_text(wanted.ior));
  if (wanted.scattering != decoded.scattering) set("scattering", to_text(wanted.scattering));
  if (wanted.anisotropy != decoded.anisotropy) set("anisotropy", to_text(wanted.anisotropy));
}

}  // namespace

VoxelProperties decode_material(const std::string& default_name, Rgba8 colour, const Attributes& attributes) {
  VoxelProperties out;
  out.name = default_name;
  out.colour = {colour.r, colour.g, colour.b, 255};
  if (attributes.empty()) return out;
  decode_published(attributes, out);
  decode_own(attributes, out);
  out.attributes = attributes;
  return out;
}

Attributes encode_material(const std::string& default_name, const VoxelProperties& properties) {
  if (decode_material(default_name, properties.colour, properties.attributes) == properties) {
    return properties.attributes;
  }
  Attributes out;
  for (const auto& [key, value] : properties.attributes) {
    const bool decoded = std::ranges::find(kDecodedKeys, key) != kDecodedKeys.end() || key.starts_with(kOwnPrefix);
    if (!decoded) out.emplace(key, value);
  }
  encode_published(properties, out);
  if (properties.ior != kDefaultRefraction) {
    out["_ri"] = to_text(properties.ior);
    out["_ior"] = to_text(properties.ior - 1.0F);
  }
  encode_own(properties, decode_material(default_name, properties.colour, out), out);
  return out;
}

}  // namespace quoin::vox
