#pragma once

namespace quoin::tool {

/// From now on a closed pipe and a limit on the size of files make writing fail, which is then reported like any other
/// failure; by default they end the program and leave half-written files behind.
void let_writes_fail();

/// From now on the first Ctrl-C (or SIGTERM, or SIGHUP from a closed terminal) only asks the work to stop, so that
/// files under way are taken back; a second one ends the program at once. Signals that are ignored stay so.
void catch_interrupts();

/// After `catch_interrupts`: a signal that is caught also ends a read that waits, which then fails with EINTR.
void let_interrupts_end_reads();

[[nodiscard]] bool was_interrupted();

/// Ends the program as the caught signal would have, so that shells and scripts see what happened. Returns when none
/// was caught.
void die_if_interrupted();

}  // namespace quoin::tool
