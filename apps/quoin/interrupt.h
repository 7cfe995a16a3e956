#pragma once

namespace quoin::tool {

/// From now on the first Ctrl-C (or SIGTERM) only asks the work to stop, so that files under way are taken back; a
/// second one ends the program at once.
void catch_interrupts();

[[nodiscard]] bool was_interrupted();

/// Ends the program as the caught signal would have, so that shells and scripts see what happened. Returns when none
/// was caught.
void die_if_interrupted();

}  // namespace quoin::tool
