#pragma once

#include <cstddef>
#include <span>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>

#include "io/format_driver.h"

// Pieces of Minecraft worlds, as players and programs share them:
//   .schem      https://github.com/SpongePowered/Schematic-Specification, versions 1 to 3
//   .schematic  https://minecraft.wiki/w/Schematic_file_format
//   .litematic  of the mod Litematica, versions 1 to 7
//   .nbt        structures of the game: https://minecraft.wiki/w/Structure_file

namespace quoin::minecraft {

/// Returns true if an NBT file begins here, gzipped or plain; the reader decides if it is a schematic. `beginning`:
/// about a hundred bytes suffice.
[[nodiscard]] bool begins_nbt(std::span<const std::byte> beginning);

/// Reads any schematic format, detected by content. Makes one grid per region, in blocks from its minimum corner, at
/// the offset in a .schem. The regions of a litematic keep their relative positions; regions of equal names get a
/// number.
///
/// Types and states: as in worlds, docs/formats/minecraft.md.
/// Warnings: dropped data: entities, block contents, biomes.
/// Errors: BadFormat, with the offset in the decompressed file; LimitExceeded (2^30 blocks, 65,535 kinds, 1 GiB);
///         Unsupported for other NBT files; Cancelled.
[[nodiscard]] Result<LoadedScene> read_schematic(std::span<const std::byte> bytes, const Progress& progress = {});

/// Writes a scene as a .schem, version 2: its instances are merged. Types named like blocks become these blocks, with
/// their states. Others become blocks of the nearest colour: concrete, wool, clay and some more, glass for transparent
/// types, lights for emissive types.
///
/// Errors, warnings: as in placed_grids.h; LimitExceeded beyond 65,535 blocks per side or 2^30 in total.
[[nodiscard]] Result<EncodedFile> write_schematic(const Scene& scene, const Progress& progress = {});

}  // namespace quoin::minecraft
