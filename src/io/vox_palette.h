#pragma once

#include <array>
#include <cstdint>
#include <string>

#include <quoin/grid/voxel_registry.h>

#include "io/vox_chunks.h"

namespace quoin::vox {

/// MagicaVoxel's colours for a file without RGBA, by colour index; 0 is air.
[[nodiscard]] std::array<Rgba8, kColours> default_palette();

/// The name of a type that has no name of its own.
[[nodiscard]] std::string default_type_name(int type);

/// Which type each colour index of XYZI becomes: itself, unless IMAP shows the palette in another order. Then type i is
/// the i-th colour as the artist sees it. An IMAP that is no permutation is ignored, with a warning.
[[nodiscard]] std::array<std::uint8_t, kColours> types_by_colour_index(const Document& document,
                                                                       std::vector<std::string>& warnings);

/// Registers types 1 to 255: colours of RGBA (its alpha means nothing), materials of MATL or MATT.
///
/// Requires: `types` holds air only.
[[nodiscard]] Status register_palette(const Document& document, const std::array<std::uint8_t, kColours>& type_of,
                                      VoxelRegistry& types);

}  // namespace quoin::vox
