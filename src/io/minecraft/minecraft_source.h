#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include <quoin/io/chunk_source.h>

namespace quoin::minecraft {

/// Whether a folder holds region files, or a folder "region" that does.
[[nodiscard]] bool is_minecraft_folder(const std::filesystem::path& path);

/// A world of Minecraft's (Java): its folder, that of another dimension (DIM-1), a folder of region files, or one of
/// these. Errors: CannotRead; BadFormat where there is no region that can be read.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_minecraft(const std::filesystem::path& path);

/// A region file's bytes, which are copied. Errors: BadFormat.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_minecraft(std::span<const std::byte> region);

}  // namespace quoin::minecraft
