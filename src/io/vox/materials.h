#pragma once

#include <array>
#include <cstdint>
#include <string>

#include <quoin/grid/voxel_registry.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

/// MagicaVoxel's colours for a file without RGBA, by colour index; 0 is air.
[[nodiscard]] std::array<Rgba8, kColours> default_palette();

/// The name of a type that has no name of its own.
[[nodiscard]] std::string default_type_name(int type);

/// Returns the type of each colour index of XYZI: the index itself, unless IMAP reorders the palette. Then type i is
/// the i-th colour in the displayed palette. An IMAP that is no permutation is ignored, with a warning.
[[nodiscard]] std::array<std::uint8_t, kColours> types_by_colour_index(const Document& document,
                                                                       std::vector<std::string>& warnings);

/// Registers types 1 to 255: colours of RGBA (its alpha is ignored), materials of MATL or MATT.
///
/// Requires: `types` holds air only.
[[nodiscard]] Status register_palette(const Document& document, const std::array<std::uint8_t, kColours>& type_of,
                                      VoxelRegistry& types);

/// Converts MagicaVoxel's material keys to Quoin's properties. `attributes` are kept unchanged.
///
/// `_type` decides which keys count; without one, or with an unknown one, the material is diffuse regardless of other
/// keys (MagicaVoxel keeps the sliders of a material that was made diffuse again):
///  _diffuse  roughness 1
///  _metal    metalness `_metal`, else `_weight`, else 1; 0 with `_plastic`; roughness `_rough`
///  _plastic  roughness `_rough`
///  _glass    transparent; alpha 1 - `_trans` (else `_alpha`, which holds the same; else `_weight`; else 0.5), at
///            least a tenth so that clear glass still shows; roughness `_rough`
///  _blend    metalness `_metal`; transparent when `_trans` (`_alpha`) is above 0; roughness `_rough`
///  _media    (cloud) as glass; with `_media_type` _scatter or _sss, scattering `_d` (0.05 per voxel), anisotropy `_g`
///  _emit     emission (`_emit`, else `_weight`, else 1) * 2^`_flux`
/// For all: index of refraction `_ri`, else 1 + `_ior`. `_rough` missing is 0.1, MagicaVoxel's default.
/// Keys that start with "quoin_" override these; `encode_material` writes them for properties without a MagicaVoxel
/// key.
[[nodiscard]] VoxelProperties decode_material(const std::string& default_name, Rgba8 colour,
                                              const Attributes& attributes);

/// Returns keys and values that `decode_material` converts to the same properties: `properties.attributes` unchanged if
/// they still do, otherwise with the keys above updated.
[[nodiscard]] Attributes encode_material(const std::string& default_name, const VoxelProperties& properties);

}  // namespace quoin::vox
