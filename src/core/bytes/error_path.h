#pragma once

#include <filesystem>

#include <quoin/core/result.h>

namespace quoin {

/// Returns `result`; its error names `path` unless it already names a file.
template <class T>
[[nodiscard]] Result<T> with_path(Result<T> result, const std::filesystem::path& path) {
  if (!result && result.error().path.empty()) result.error().path = path.string();
  return result;
}

}  // namespace quoin
