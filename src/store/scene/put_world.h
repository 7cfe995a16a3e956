#pragma once

#include <filesystem>

#include <quoin/core/result.h>

namespace quoin::store {

/// Gives a closed world the name of another file, in place of a world or a file that had it, whole after any power cut.
/// Errors: CannotWrite.
[[nodiscard]] Status put_world_in_place(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace quoin::store
