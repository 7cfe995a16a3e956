#pragma once

#include <cstdint>
#include <optional>

namespace quoin {

/// Bytes that this process can still use before it is ended for it: by the machine's memory and swap, by its group's
/// limit (cgroups) and by its own (RLIMIT_AS). Nothing where the system does not say.
[[nodiscard]] std::optional<std::uint64_t> available_memory();

/// From now on each large block (of 32 KiB or more) that this process frees goes back to the system at once, so that
/// what is resident follows what is used: a streamed world keeps its budget by it, and takes a fifth more without. It
/// is a setting of the whole process, for programs that stream worlds: call it first in `main`. The price is time for
/// new pages, 8 to 20 % of a flight's. False, and nothing is changed, where the C library is not glibc; no effect where
/// another allocator took its place. See docs/performance.md, "Worlds larger than memory".
bool return_freed_memory();

}  // namespace quoin
