#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

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

/// The same memory as bytes, for devices outside this library: addresses start at the first byte. It is filled once:
/// released parts are not reused.
class ShaderBytes final : public ShaderMemory {
 public:
  /// The largest size that 32-bit programs can hold, including its growth.
  static constexpr std::uint64_t kMost = std::uint64_t{1} << 30;

  [[nodiscard]] Result<Place> allocate(std::uint64_t size, const std::string& doing) override;
  void release(Place& place) override { place = {}; }
  [[nodiscard]] Status write(const Place& place, std::span<const std::byte> bytes, std::uint64_t offset = 0) override;
  [[nodiscard]] Status flush() override { return {}; }
  void discard() override {}

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_ = std::vector<std::byte>(kAlignment);  // no table has the address 0
};

}  // namespace quoin::vulkan
