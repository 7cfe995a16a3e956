#pragma once

#include <functional>

namespace quoin {

/// Told how far a long piece of work has come (0 to 1, never falling). Returns whether to go on: false cancels the
/// work, which then gives ErrorCode::Cancelled.
///
/// May be called from any thread, never from two at once, and never after the work has returned. An empty function
/// means nobody listens.
using Progress = std::function<bool(double fraction)>;

}  // namespace quoin
