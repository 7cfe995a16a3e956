#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include <quoin/stream/streamed_world.h>

namespace quoin::stream {

/// Returns a terrain as JSON, the form that worlds store.
[[nodiscard]] std::string text_of(const EndlessTerrain& terrain);
/// Parses a terrain. Returns nullopt for terrains that this version cannot generate.
[[nodiscard]] std::optional<EndlessTerrain> terrain_from(std::span<const std::byte> bytes);

}  // namespace quoin::stream
