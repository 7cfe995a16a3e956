#include "stream/terrain_text.h"

#include <cstdint>

#include <nlohmann/json.hpp>

namespace quoin::stream {

std::string text_of(const EndlessTerrain& terrain) {
  return nlohmann::json{{"seed", terrain.seed}, {"height", terrain.height}, {"smooth", terrain.is_smooth}}.dump();
}

std::optional<EndlessTerrain> terrain_from(std::span<const std::byte> bytes) {
  const auto* const text = reinterpret_cast<const char*>(bytes.data());  // NOLINT: UTF-8 as it was written
  const auto json = nlohmann::json::parse(text, text + bytes.size(), nullptr, false);
  if (!json.is_object() || !json.contains("seed") || !json["seed"].is_number_unsigned() || !json.contains("height") ||
      !json["height"].is_number_integer() || !json.contains("smooth") || !json["smooth"].is_boolean()) {
    return std::nullopt;
  }
  const auto height = json["height"].get<std::int64_t>();
  if (height < 1 || height > 16) return std::nullopt;
  return EndlessTerrain{json["seed"].get<std::uint64_t>(), static_cast<int>(height), json["smooth"].get<bool>()};
}

}  // namespace quoin::stream
