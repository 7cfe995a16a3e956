#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/stream/streamed_world.h>

namespace quoin::stream {

/// Returns the name of the value that stores a grid's terrain.
[[nodiscard]] std::string terrain_value(std::uint32_t grid);
/// Returns a terrain as JSON, the form that worlds store.
[[nodiscard]] std::vector<std::byte> bytes_of(const EndlessTerrain& terrain);
/// Parses a terrain. Returns nullopt for terrains that this version cannot generate.
[[nodiscard]] std::optional<EndlessTerrain> terrain_from(std::span<const std::byte> bytes);

}  // namespace quoin::stream
