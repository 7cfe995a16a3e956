#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::vulkan {

/// A part of what shaders read. They know it by its address, a multiple of 32.
struct Place {
  std::size_t block = 0;
  std::uint64_t offset = 0;
  std::uint64_t size = 0;  ///< 0: nothing
  std::uint64_t address = 0;
};

/// Where trees and tables of a scene are put for shaders.
class ShaderMemory {
 public:
  static constexpr std::uint64_t kAlignment = 32;

  ShaderMemory() = default;
  ShaderMemory(const ShaderMemory&) = delete;
  ShaderMemory& operator=(const ShaderMemory&) = delete;
  virtual ~ShaderMemory() = default;

  /// `doing`: as in "drawing". Errors: LimitExceeded when it is full.
  [[nodiscard]] virtual Result<Place> allocate(std::uint64_t size, const std::string& doing) = 0;
  /// Leaves `place` empty. Requires: no shader that reads it runs.
  virtual void release(Place& place) = 0;

  /// Puts bytes in place, before what `flush` is followed by.
  [[nodiscard]] virtual Status write(const Place& place, std::span<const std::byte> bytes,
                                     std::uint64_t offset = 0) = 0;
  [[nodiscard]] virtual Status flush() = 0;
  /// Forgets what was written since the last `flush`.
  virtual void discard() = 0;
};

/// The same as bytes, for devices that are reached from elsewhere: addresses count from the first. It is filled once:
/// what is released is not given anew.
class ShaderBytes final : public ShaderMemory {
 public:
  /// What programs of 32 bits can hold, also while it grows.
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
