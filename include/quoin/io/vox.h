#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// What reading a file gave.
struct LoadedScene {
  Scene scene;
  std::string format;                 ///< "vox", ...
  std::vector<std::string> warnings;  ///< one line each: what was skipped, and why
};

struct LoadOptions {
  bool hidden = false;  ///< instances of hidden layers and nodes become visible ones; otherwise `visible` is false
  int frame = 0;        ///< which animation frame to take
};

/// MagicaVoxel's format, versions 150 and 200.
///
/// Source: the published format description of MagicaVoxel and its extension.
/// Axes:   (x, y, z) becomes (x, z, -y): Quoin's +Y is MagicaVoxel's +Z.
/// Errors: BadFormat with the byte offset; memory stays within a small multiple of the input's size.
[[nodiscard]] Result<LoadedScene> read_vox(std::span<const std::byte> bytes, const LoadOptions& options = {});

/// Errors: Unsupported when a transform is not one of the 48 axis-aligned ones or a voxel size is not 1.
[[nodiscard]] Result<std::vector<std::byte>> write_vox(const Scene& scene, std::vector<std::string>& warnings);

}  // namespace quoin
