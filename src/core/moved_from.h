#pragma once

#include <memory>

#include <quoin/core/assert.h>

namespace quoin {

/// Returns the implementation of an object. Requires: the object was not moved from.
template <class Content>
[[nodiscard]] Content& impl_of(const std::unique_ptr<Content>& content) {
  QUOIN_ASSERT(content != nullptr, "an object that was not moved from");
  return *content;
}

}  // namespace quoin
