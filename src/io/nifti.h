#pragma once

#include <span>

#include "io/volume_header.h"

namespace quoin::nifti {

/// How many bytes `read_header` wants at most.
inline constexpr std::size_t kMostHeaderBytes = 540;

/// Whether a NIfTI-1 or -2 header of either byte order begins here, alone or of a pair.
[[nodiscard]] bool is_header(std::span<const std::byte> bytes);

/// Reads a header; sources as in decode_volume. Requires: is_header(bytes). Offsets in errors count from `bytes`.
[[nodiscard]] Result<VolumeHeader> read_header(std::span<const std::byte> bytes, const VolumeOptions& options);

}  // namespace quoin::nifti
