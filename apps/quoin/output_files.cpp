#include "output_files.h"

#include <string>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

namespace quoin::tool {

Status check_outputs(std::initializer_list<std::filesystem::path> files) {
  for (const auto& path : files) {
    if (path.empty()) continue;
    if (auto file = AtomicFile::create(path); !file) return file.error();
  }
  return {};
}

bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code missing;
  return std::filesystem::equivalent(a, b, missing);
}

Status check_replaced(const std::filesystem::path& output, std::span<const std::filesystem::path> inputs, bool force) {
  for (const auto& input : inputs) {
    if (is_same_file(output, input)) {
      return make_error(ErrorCode::InvalidArgument, "an input is never replaced; write to another name",
                        output.string());
    }
  }
  std::error_code unknown;
  if (force || !std::filesystem::is_regular_file(output, unknown)) return {};
  const auto format = detect_format(output);
  // What cannot be read may be a model, too.
  if (!format) return make_error(ErrorCode::CannotWrite, "there already, and cannot be read", output.string());
  if (!*format) return {};
  return make_error(ErrorCode::InvalidArgument,
                    "there already, a " + std::string(format_info(**format).name) + " file; --force replaces it",
                    output.string());
}

}  // namespace quoin::tool
