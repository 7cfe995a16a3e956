#pragma once

#include <filesystem>
#include <initializer_list>
#include <span>

#include <quoin/core/result.h>

namespace quoin::tool {

/// Fails now rather than after all the work where one of the files cannot be written. Empty names are left out.
[[nodiscard]] Status check_outputs(std::initializer_list<std::filesystem::path> files);

/// Whether both are one file.
[[nodiscard]] bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Refuses to lose what a person made: to replace one of `inputs`, and, unless `force`, a file that can be read as a
/// model, a world or a volume. Meshes, pictures and what is no format of ours are replaced.
[[nodiscard]] Status check_replaced(const std::filesystem::path& output, std::span<const std::filesystem::path> inputs,
                                    bool force);

}  // namespace quoin::tool
