#pragma once

#include <filesystem>
#include <initializer_list>

#include <quoin/core/result.h>

namespace quoin::tool {

/// Fails now rather than after all the work where one of the files cannot be written. Empty names are left out.
[[nodiscard]] Status check_outputs(std::initializer_list<std::filesystem::path> files);

}  // namespace quoin::tool
