#pragma once

#include <filesystem>

#include <quoin/core/result.h>

namespace quoin::store {

/// Renames a closed world and replaces any file with that name. After a power cut the file is complete, old or new.
/// Errors: CannotWrite.
[[nodiscard]] Status put_world_in_place(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace quoin::store
