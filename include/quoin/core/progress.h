#pragma once

#include <functional>

namespace quoin {

/// Told how far a long piece of work has come (0 to 1, never falling); returns whether to go on.
///
/// May be called from any thread, never from two at once. An empty function means nobody listens.
using Progress = std::function<bool(double fraction)>;

}  // namespace quoin
