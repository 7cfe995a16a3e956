#pragma once

#include <functional>

namespace quoin {

/// Told how far a long piece of work has come (0 to 1, never falling). Returns whether to go on: false cancels the
/// work. What returns a Result then gives ErrorCode::Cancelled. Edits of a Grid or a DensityGrid return how much they
/// had changed by then, which stays.
///
/// May be called from any thread, never from two at once, and never after the work has returned. An empty function
/// means nobody listens.
using Progress = std::function<bool(double fraction)>;

}  // namespace quoin
