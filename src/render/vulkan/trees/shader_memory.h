#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <quoin/core/result.h>

namespace quoin::vulkan {

/// An allocation that shaders read. They find it by its address, a multiple of 32.
struct Place {
  std::size_t block = 0;
  std::uint64_t offset = 0;
  std::uint64_t size = 0;  ///< 0: none
  std::uint64_t address = 0;
};

/// The memory for a scene's trees and tables in shaders.
class ShaderMemory {
 public:
  static constexpr std::uint64_t kAlignment = 32;

  ShaderMemory() = default;
  ShaderMemory(const ShaderMemory&) = delete;
  ShaderMemory& operator=(const ShaderMemory&) = delete;
  virtual ~ShaderMemory() = default;

  /// `doing`: as in "drawing". Errors: LimitExceeded if it is full.
  [[nodiscard]] virtual Result<Place> allocate(std::uint64_t size, const std::string& doing) = 0;
  /// Leaves `place` empty. Requires: no shader that reads it runs.
  virtual void release(Place& place) = 0;

  /// Queues bytes for the next `flush`.
  [[nodiscard]] virtual Status write(const Place& place, std::span<const std::byte> bytes,
                                     std::uint64_t offset = 0) = 0;
  [[nodiscard]] virtual Status flush() = 0;
  /// Discards the writes since the last `flush`.
  virtual void discard() = 0;
};

}  // namespace quoin::vulkan
