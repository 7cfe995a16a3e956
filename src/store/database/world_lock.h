#pragma once

#include <filesystem>

#include <quoin/core/result.h>

namespace quoin::store {

/// Ensures that only this process writes a world: a lock on NAME-lock that the system releases when the process ends.
class WorldLock {
 public:
  /// Errors: CannotWrite if another writer has it, or the file system has no locks.
  [[nodiscard]] static Result<WorldLock> take(const std::filesystem::path& world);
  /// Holds no lock.
  WorldLock() = default;
  WorldLock(WorldLock&& other) noexcept;
  WorldLock& operator=(WorldLock&& other) noexcept;
  ~WorldLock();

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

/// Returns true if the file system of a world's folder supports locks, or if that is unknown.
[[nodiscard]] bool has_locks(const std::filesystem::path& world);

/// Returns true if a world's folder is on another machine, where programs cannot share memory.
[[nodiscard]] bool is_on_network(const std::filesystem::path& world);

}  // namespace quoin::store
