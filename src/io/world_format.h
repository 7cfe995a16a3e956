#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>

// Worlds on disk as a file format. The store, a layer above this one, defines these functions; builds without SQLite
// return an error.

namespace quoin {

/// The SQLite application id of a world: "Quon".
inline constexpr std::uint32_t kWorldApplicationId = 0x51756F6E;
/// The number of bytes that `is_world_format` needs.
inline constexpr std::size_t kWorldHeaderBytes = 100;

/// Returns true if bytes begin like a world: with SQLite's header, and Quoin's application id.
[[nodiscard]] bool is_world_format(std::span<const std::byte> beginning);
[[nodiscard]] Result<LoadedScene> read_world_format(const std::filesystem::path& path, const LoadOptions& options,
                                                    Threads threads, const Progress& progress);
[[nodiscard]] Result<LoadedScene> read_world_format(std::span<const std::byte> bytes, const LoadOptions& options,
                                                    Threads threads, const Progress& progress);
/// `loaded`: the scene with its additional loaded data; null if it was not loaded.
[[nodiscard]] Result<SavedScene> write_world_format(const Scene& scene, const LoadedScene* loaded,
                                                    const std::filesystem::path& path, Threads threads,
                                                    const Progress& progress);

}  // namespace quoin
