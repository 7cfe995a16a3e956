#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include <quoin/stream/chunk_generator.h>

namespace quoin::stream {

/// A landscape as a world keeps it: JSON.
[[nodiscard]] std::string text_of(const EndlessTerrain& terrain);
/// Parses a terrain; nullopt for one that this version cannot generate.
[[nodiscard]] std::optional<EndlessTerrain> terrain_from(std::span<const std::byte> bytes);

}  // namespace quoin::stream
