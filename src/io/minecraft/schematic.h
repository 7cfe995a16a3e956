#pragma once

#include <cstddef>
#include <span>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>

#include "io/placed/placed_grids.h"

// Pieces of Minecraft's worlds, as players and programs pass them on:
//   .schem      https://github.com/SpongePowered/Schematic-Specification, versions 1 to 3
//   .schematic  https://minecraft.wiki/w/Schematic_file_format
//   .litematic  of the mod Litematica, versions 1 to 7
//   .nbt        structures of the game: https://minecraft.wiki/w/Structure_file

namespace quoin::minecraft {

/// Whether a file of NBT begins here, within gzip or as it is: what of it is a schematic its reader says.
/// `beginning`: some hundred bytes suffice.
[[nodiscard]] bool begins_nbt(std::span<const std::byte> beginning);

/// Reads any of them, by what stands in it. A grid for each region, in blocks from its least corner, at the offset that
/// a .schem says; those of a litematic are placed as they stand to each other; regions of equal names are told apart by
/// their number.
///
/// Types and states: as worlds have them, docs/formats/minecraft.md.
/// Warnings: what is left out: entities, what blocks hold, biomes.
/// Errors: BadFormat, with the offset in what the file expands to; LimitExceeded (2^30 blocks, 65,535 kinds, 1 GiB);
///         Unsupported for other files of NBT; Cancelled.
[[nodiscard]] Result<LoadedScene> read_schematic(std::span<const std::byte> bytes, const Progress& progress = {});

/// Writes a scene as a .schem, version 2: its instances become one. Types that are named as blocks are these, with
/// their states; others become blocks of the nearest colour: concrete, wool, clay and some more, glass where they are
/// transparent, lights where they shine.
///
/// Errors, warnings: as those of placed/placed_grids.h; LimitExceeded beyond 65,535 blocks a side or 2^30 in all.
[[nodiscard]] Result<models::ModelBytes> write_schematic(const Scene& scene, const Progress& progress = {});

}  // namespace quoin::minecraft
