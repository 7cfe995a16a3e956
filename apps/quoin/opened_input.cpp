#include "opened_input.h"

#include <string>

namespace quoin::tool {

Result<OpenedInput> open_input(const std::filesystem::path& path, const LoadOptions& load) {
  OpenedInput input{{path, std::nullopt}, load.raw.has_value()};
  std::optional<FileFormat>& format = input.file.format;
  if (!load.raw) {
    const auto found = detect_format(path);
    if (!found) return found.error();
    format = *found;
    input.is_volume = can(format, FormatCapability::Volume);
  }
  const bool may_have_dimensions = format == FileFormat::Minecraft || format == FileFormat::Scene;
  if (load.dimension.empty() || may_have_dimensions) return input;
  return make_error(ErrorCode::InvalidArgument,
                    "cannot select a dimension: --dimension needs a Minecraft world, and the file format is " +
                        (format ? std::string(format->name()) : "unknown"),
                    path.string());
}

}  // namespace quoin::tool
