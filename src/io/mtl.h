#pragma once

#include <filesystem>
#include <string>

#include "io/material_palette.h"

namespace quoin {

/// The text of a Wavefront MTL file: one material for each of the palette's, by name.
///
/// `emissive_texture` is only named where a material emits. MTL has no strength beyond the colour, so Ke holds it.
/// Source: Alias/Wavefront's MTL description; Ke and map_Ke are a common extension.
[[nodiscard]] std::string mtl_text(const MaterialPalette& palette, const std::string& texture,
                                   const std::string& emissive_texture);

/// A material's name as OBJ and MTL can say it: without spaces.
[[nodiscard]] std::string mtl_name(const SurfaceMaterial& material);

}  // namespace quoin
