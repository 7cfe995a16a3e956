#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include <quoin/io/chunk_source.h>

namespace quoin::minecraft {

/// Returns true if a folder is a Minecraft (Java) world or one of its dimensions, or holds region files. Also accepts
/// the path of a world's level.dat.
[[nodiscard]] bool is_minecraft_folder(const std::filesystem::path& path);

/// Opens a Minecraft (Java) world: its folder or level.dat, the folder of a dimension, a folder of region files, or a
/// region file. `dimension`: "overworld", "nether", "end" or NAMESPACE:NAME; empty: the overworld, or the first.
/// Errors: CannotRead; BadFormat if no region can be read; Unsupported for regions of entities or points of interest;
/// InvalidArgument for a missing dimension, with a list of the present ones.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_minecraft(const std::filesystem::path& path,
                                                                  std::string_view dimension = {});

/// Opens the bytes of a region file, which are copied. Errors: BadFormat.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_minecraft(std::span<const std::byte> region);

}  // namespace quoin::minecraft
