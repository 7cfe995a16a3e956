#include "io/vox_material.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "io/text.h"

namespace quoin::vox {

namespace {

constexpr float kDefaultRoughness = 0.1F;
constexpr float kDefaultTransparency = 0.5F;
constexpr float kLeastAlpha = 0.1F;
constexpr float kMostFlux = 16.0F;
constexpr float kMostRefraction = 10.0F;
const float kDefaultRefraction = VoxelProperties{}.ior;

const std::array<std::string, 11> kDecodedKeys = {"_type",  "_rough", "_metal", "_plastic", "_weight", "_alpha",
                                                  "_trans", "_emit",  "_flux",  "_ior",     "_ri"};
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
  return static_cast<std::uint8_t>(std::lround(value * 255.0F));
}

void make_transparent(VoxelProperties& out, float transparency) {
  out.visibility = Visibility::Transparent;
  out.colour.a = byte_from_unit(std::max(kLeastAlpha, 1.0F - transparency));
}

float emitted(const Attributes& attributes) {
  const float share = unit(either(number(attributes, "_emit"), number(attributes, "_weight")), 1.0F);
  const float flux = std::clamp(number(attributes, "_flux").value_or(0.0F), -kMostFlux, kMostFlux);
  return share * std::exp2(flux);
}

/// What the published keys say.
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
  out.ior = std::clamp(refraction.value_or(kDefaultRefraction), 1.0F, kMostRefraction);
}

/// What Quoin's own keys say, in the order of encode_own.
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
  if (const std::string* visibility = text("visibility")) {
    out.visibility = *visibility == "transparent" ? Visibility::Transparent : Visibility::Opaque;
  }
  float alpha = out.colour.a;
  set("alpha", alpha);
  out.colour.a = static_cast<std::uint8_t>(std::clamp(alpha, 0.0F, 255.0F));
  set("roughness", out.roughness);
  set("metalness", out.metalness);
  set("emission", out.emission);
  set("ior", out.ior);
  out.roughness = std::clamp(out.roughness, 0.0F, 1.0F);
  out.metalness = std::clamp(out.metalness, 0.0F, 1.0F);
  out.emission = std::max(out.emission, 0.0F);
  out.ior = std::clamp(out.ior, 1.0F, kMostRefraction);
}

void encode_emission(float emission, Attributes& out) {
  int flux = 0;
  while (emission > std::exp2(static_cast<float>(flux)) && flux < static_cast<int>(kMostFlux)) ++flux;
  out["_emit"] = to_text(emission / std::exp2(static_cast<float>(flux)));
  if (flux > 0) out["_flux"] = std::to_string(flux);
}

/// The material of MagicaVoxel that comes nearest.
void encode_published(const VoxelProperties& properties, Attributes& out) {
  const bool transparent = properties.visibility == Visibility::Transparent;
  if (properties.emission > 0.0F) {
    out["_type"] = "_emit";
    encode_emission(properties.emission, out);
  } else if (transparent) {
    out["_type"] = properties.metalness > 0.0F ? "_blend" : "_glass";
  } else if (properties.metalness > 0.0F) {
    out["_type"] = "_metal";
  } else if (properties.roughness < 1.0F) {
    out["_type"] = "_plastic";
  }
  if (out.empty() || out.find("_type") == out.end()) return;
  if (properties.roughness < 1.0F) out["_rough"] = to_text(properties.roughness);
  if (properties.metalness > 0.0F) out["_metal"] = to_text(properties.metalness);
  if (transparent) out["_trans"] = to_text(static_cast<float>(255 - properties.colour.a) / 255.0F);
}

/// Adds Quoin's own keys for what `decoded`, the reading of the published ones, lacks.
void encode_own(const VoxelProperties& wanted, const VoxelProperties& decoded, Attributes& out) {
  const auto set = [&](const char* key, const std::string& value) { out[std::string(kOwnPrefix) + key] = value; };
  if (wanted.name != decoded.name) set("name", printable(wanted.name));
  if (wanted.collides != decoded.collides) set("collides", wanted.collides ? "1" : "0");
  if (wanted.visibility != decoded.visibility) {
    set("visibility", wanted.visibility == Visibility::Transparent ? "transparent" : "opaque");
  }
  if (wanted.colour.a != decoded.colour.a) set("alpha", std::to_string(wanted.colour.a));
  if (wanted.roughness != decoded.roughness) set("roughness", to_text(wanted.roughness));
  if (wanted.metalness != decoded.metalness) set("metalness", to_text(wanted.metalness));
  if (wanted.emission != decoded.emission) set("emission", to_text(wanted.emission));
  if (wanted.ior != decoded.ior) set("ior", to_text(wanted.ior));
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
