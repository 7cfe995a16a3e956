#pragma once

#include <filesystem>

#include <quoin/io/formats.h>

namespace quoin::tool {

/// The input of a command, recognised once.
struct OpenedInput {
  DetectedFile file;
  bool is_volume = false;  ///< by --raw-size or by its content

  /// Returns true if --iso applies: to a volume, or to a .vdb, which may have fog grids.
  [[nodiscard]] bool heeds_iso() const { return is_volume || file.format == FileFormat::Vdb; }
};

/// Recognises the input. Errors: CannotRead; InvalidArgument if --dimension was given and the file has no dimensions.
[[nodiscard]] Result<OpenedInput> open_input(const std::filesystem::path& path, const LoadOptions& load);

}  // namespace quoin::tool
