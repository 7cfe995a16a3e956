#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>

namespace quoin {

/// Encodes bytes as base64 with padding (RFC 4648, section 4).
[[nodiscard]] std::string to_base64(std::span<const std::byte> bytes);

/// Errors: BadFormat for text that `to_base64` does not produce, with the offset in `text`.
[[nodiscard]] Result<std::vector<std::byte>> from_base64(std::string_view text);

}  // namespace quoin
