#pragma once

#include <cstddef>
#include <span>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace quoin {

/// Reads the channels R, G and B, or Y, of an OpenEXR file. Errors: as read_radiance.
[[nodiscard]] Result<RadianceImage> decode_exr(std::span<const std::byte> bytes, std::size_t max_pixels);

}  // namespace quoin
