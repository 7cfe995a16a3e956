#pragma once

#include <cstdint>
#include <optional>

namespace quoin {

/// Bytes that this process can still use before it is ended for it: by the machine's memory and swap, by its group's
/// limit (cgroups) and by its own (RLIMIT_AS). Nothing where the system does not say.
[[nodiscard]] std::optional<std::uint64_t> available_memory();

}  // namespace quoin
