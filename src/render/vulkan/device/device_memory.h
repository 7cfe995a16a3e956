#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>

#include "render/vulkan/device/device.h"
#include "render/vulkan/trees/shader_memory.h"

namespace quoin::vulkan {

/// Returns a memory type among `allowed` that has all wanted properties.
[[nodiscard]] std::optional<std::uint32_t> memory_type(const VkPhysicalDeviceMemoryProperties& memory,
                                                       std::uint32_t allowed, VkMemoryPropertyFlags wanted);

/// A buffer with its own memory.
class Buffer {
 public:
  enum class Where : std::uint8_t {
    Device,  ///< fastest for the device to read
    Upload,  ///< written by the CPU through `mapped`
    Read,    ///< read by the CPU through `mapped`
  };

  Buffer() = default;
  /// Errors: LimitExceeded if that memory is full.
  [[nodiscard]] static Result<Buffer> create(const Device& device, VkDeviceSize size, Where where,
                                             const std::string& doing);
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Buffer();

  [[nodiscard]] VkBuffer handle() const { return handle_; }
  [[nodiscard]] VkDeviceSize size() const { return size_; }
  [[nodiscard]] VkDeviceAddress address() const { return address_; }
  [[nodiscard]] std::byte* mapped() const { return mapped_; }

 private:
  void swap(Buffer& other) noexcept;

  const Device* device_ = nullptr;
  VkBuffer handle_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkDeviceSize size_ = 0;
  VkDeviceAddress address_ = 0;
  std::byte* mapped_ = nullptr;
};

/// Device memory in blocks as needed, each a buffer that is suballocated; and uploads to it.
class DeviceMemory final : public ShaderMemory {
 public:
  DeviceMemory(Device& device, VkDeviceSize block_bytes) : device_(&device), block_bytes_(block_bytes) {}

  /// Allocates memory; requests larger than a block get their own block. Errors: LimitExceeded when the device's memory
  /// is full.
  [[nodiscard]] Result<Place> allocate(VkDeviceSize size, const std::string& doing) override;
  void release(Place& place) override;

  [[nodiscard]] Status write(const Place& place, std::span<const std::byte> bytes, VkDeviceSize offset = 0) override;
  [[nodiscard]] Status flush() override;
  void discard() override;

  /// Returns the buffer that contains a place, at its offset.
  [[nodiscard]] VkBuffer buffer_of(const Place& place) const {
    QUOIN_ASSERT(is_allocated(place), "an allocated place");
    return blocks_[place.block]->buffer.handle();
  }
  [[nodiscard]] std::size_t block_count() const;
  /// Returns the bytes written so far by `write`.
  [[nodiscard]] std::uint64_t written() const { return written_; }

 private:
  struct Block {
    Buffer buffer;
    std::map<VkDeviceSize, VkDeviceSize> free;  // size by offset
  };
  struct Copy {
    VkBuffer to;
    VkBufferCopy region;
  };
  [[nodiscard]] Place take(std::size_t block, VkDeviceSize size);
  [[nodiscard]] bool is_allocated(const Place& place) const {
    return place.size != 0 && place.block < blocks_.size() && blocks_[place.block] != nullptr;
  }

  Device* device_;
  VkDeviceSize block_bytes_;
  std::vector<std::unique_ptr<Block>> blocks_;  // null: freed
  Buffer staging_;
  VkDeviceSize staged_ = 0;
  std::vector<Copy> copies_;
  std::uint64_t written_ = 0;
};

/// Parts of device memory that are released together; their unsent data is discarded.
class Places {
 public:
  /// `doing`: as in "drawing".
  Places(DeviceMemory& memory, const char* doing) : memory_(&memory), doing_(doing) {}
  ~Places();
  Places(const Places&) = delete;
  Places& operator=(const Places&) = delete;

  [[nodiscard]] Status reserve(std::size_t bytes, std::uint64_t& address);
  /// Queues bytes for the next `DeviceMemory::flush`. Leaves `address` unchanged for empty input.
  [[nodiscard]] Status upload(std::span<const std::byte> bytes, std::uint64_t& address);
  template <class T>
  [[nodiscard]] Status upload(const std::vector<T>& values, std::uint64_t& address) {
    return upload(std::as_bytes(std::span(values)), address);
  }
  /// Returns the last place. Requires: there is one.
  [[nodiscard]] const Place& last() const {
    QUOIN_ASSERT(!places_.empty(), "at least one place");
    return places_.back();
  }

 private:
  DeviceMemory* memory_;
  const char* doing_;
  std::vector<Place> places_;
};

}  // namespace quoin::vulkan
