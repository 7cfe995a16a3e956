#pragma once

#include <string>
#include <vector>

#include <quoin/io/chunk_source.h>

#include "io/minecraft/nbt.h"

namespace quoin::minecraft {

/// Adds the signs of a chunk that have text, of any version from McRegion on. A sign with an unreadable text is shown
/// as stored, on one line.
///
/// Sources: https://minecraft.wiki/w/Chunk_format, /w/Sign, /w/Text_component_format.
void add_signs(nbt::Value root, std::vector<SourceSign>& signs);

/// Returns the text of a line of a sign: a JSON text component (until 1.21.4), plain text, or a component in NBT.
[[nodiscard]] std::string text_of_line(nbt::Value line);

}  // namespace quoin::minecraft
