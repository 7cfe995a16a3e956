#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>

namespace quoin::vdb {

/// Reads .vdb and .nvdb: a grid each, as docs/formats/vdb.md says it. `LoadOptions::iso` is what fog is solid above.
///
/// Errors: BadFormat with the offset; LimitExceeded beyond 2^27 values of fog, or 2^20 chunks that tiles fill;
///         Unsupported where there is no grid that can be read; Cancelled.
[[nodiscard]] Result<LoadedScene> read_vdb(std::span<const std::byte> bytes, const LoadOptions& options,
                                           Threads threads, const Progress& progress);

/// A scene as .vdb, version 224, zip: for each instance its densities as a level set, and its voxels as a bool grid.
/// An instance whose grid is there already shares its tree. The same scene gives the same bytes.
[[nodiscard]] Result<std::vector<std::byte>> write_vdb(const Scene& scene);
/// Returns the parts of a scene that a VDB file cannot store, one line each.
[[nodiscard]] std::vector<std::string> losses_of_vdb(const Scene& scene);

}  // namespace quoin::vdb
