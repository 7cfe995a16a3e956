#pragma once

#include <cstdint>
#include <optional>

namespace [[gnu::visibility("default")]] quoin {

/// Returns the memory still available to this process, in bytes. Exceeding it can end the process. The result is the
/// lowest of three limits: available system memory plus swap, the cgroup limit, and RLIMIT_AS. Returns nullopt if the
/// system reports none of them.
[[nodiscard]] std::optional<std::uint64_t> available_memory();

/// Makes the C library return each freed block of 32 KiB or more to the system at once, for the whole process.
///
/// Resident memory then follows the memory in use. Programs that stream worlds need this to keep their memory budget;
/// without it they use about 20 % more. Call it first in `main`.
/// Cost:     8 to 20 % more processor time in a streamed world, because the system must supply new pages. Each block's
///           release takes time of the thread that frees it. Workers free surfaces of LiveMeshes and unloaded chunks of
///           StreamedWorld; large blocks of the program itself are freed by its own threads.
/// Returns:  false, without a change, if the C library is not glibc. Has no effect if another allocator replaces
///           malloc.
/// See docs/performance.md, "Worlds larger than memory".
bool return_freed_memory();

}  // namespace quoin
