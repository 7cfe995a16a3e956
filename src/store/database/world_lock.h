#pragma once

#include <filesystem>

#include <quoin/core/result.h>

namespace quoin::store {

/// That this process alone writes a world: a lock on NAME-lock, which ends with the process, however that ends.
class WorldLock {
 public:
  /// Errors: CannotWrite: another writer has it, or there are no locks on this file system.
  [[nodiscard]] static Result<WorldLock> take(const std::filesystem::path& world);
  /// Of nothing.
  WorldLock() = default;
  WorldLock(WorldLock&& other) noexcept;
  WorldLock& operator=(WorldLock&& other) noexcept;
  ~WorldLock();

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

/// Whether the file system of a world's folder knows locks. True where that cannot be told.
[[nodiscard]] bool has_locks(const std::filesystem::path& world);

/// Whether a world's folder is on another machine, so that programs cannot share memory about it.
[[nodiscard]] bool is_on_network(const std::filesystem::path& world);

}  // namespace quoin::store
