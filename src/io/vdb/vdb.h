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

/// Reads .vdb and .nvdb: one grid per VDB grid, see docs/formats/vdb.md. `LoadOptions::iso`: the value above which fog
/// is solid.
///
/// Errors: BadFormat with the offset; LimitExceeded beyond 2^27 fog values, or 2^20 chunks filled by tiles; Unsupported
/// if no grid can be read; Cancelled.
[[nodiscard]] Result<LoadedScene> read_vdb(std::span<const std::byte> bytes, const LoadOptions& options,
                                           Threads threads, const Progress& progress);

/// Writes a scene as .vdb, version 224, zip: for each instance its densities as a level set, and its voxels as a bool
/// grid. Instances of one grid share its tree. Instances with an invalid transform are left out. Equal scenes give
/// equal bytes.
[[nodiscard]] Result<std::vector<std::byte>> write_vdb(const Scene& scene);
/// Returns the parts of a scene that a VDB file cannot store, one line each.
[[nodiscard]] std::vector<std::string> vdb_unsupported_features(const Scene& scene);

}  // namespace quoin::vdb
