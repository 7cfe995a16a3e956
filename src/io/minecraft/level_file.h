#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace quoin::minecraft {

/// The world properties in level.dat.
struct LevelFile {
  std::string name;
  std::string version;  ///< "1.18.2"; empty before 1.9
  std::optional<DVec3> spawn;
  std::string spawn_dimension = "minecraft:overworld";
};

/// Errors: BadFormat, with the offset (in the decompressed bytes if it is compressed); LimitExceeded.
[[nodiscard]] Result<LevelFile> parse_level_file(std::span<const std::byte> bytes);

}  // namespace quoin::minecraft
