#pragma once

namespace quoin::tool {

/// Makes writes to a closed pipe or beyond the file size limit fail with an error. By default SIGPIPE and SIGXFSZ
/// end the program and leave incomplete files.
void let_writes_fail();

/// Makes the first Ctrl-C (or SIGTERM, or SIGHUP from a closed terminal) only request a stop, so that incomplete files
/// are removed. A second one ends the program at once. Ignored signals stay ignored.
void catch_interrupts();

/// Makes caught signals also end a blocking read, which then fails with EINTR. Call after `catch_interrupts`.
void let_interrupts_end_reads();

[[nodiscard]] bool was_interrupted();

/// Ends the program with the caught signal, so that shells and scripts see the cause. Returns if no signal was caught.
void die_if_interrupted();

}  // namespace quoin::tool
