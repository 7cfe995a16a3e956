#include "render/vulkan/device/device_memory.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::vulkan {
namespace {

constexpr VkDeviceSize kStagingBytes = VkDeviceSize{8} << 20;

// Returns the acceptable kinds of memory, best first.
std::vector<VkMemoryPropertyFlags> preferences(Buffer::Where where) {
  constexpr VkMemoryPropertyFlags kShared = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  switch (where) {
    case Buffer::Where::Device:
      return {VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0};
    case Buffer::Where::Upload:
      return {kShared};
    default:
      return {kShared | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, kShared};
  }
}

// Allocates from the best kind of memory with room.
VkResult allocate(const Device& device, VkBuffer buffer, Buffer::Where where, VkDeviceMemory& memory) {
  VkMemoryRequirements needs{};
  device.api().vkGetBufferMemoryRequirements(device.handle(), buffer, &needs);
  const VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, nullptr,
                                        VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT, 0};
  VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
  for (const VkMemoryPropertyFlags wanted : preferences(where)) {
    const auto type = memory_type(device.memory(), needs.memoryTypeBits, wanted);
    if (!type) continue;
    // Rejects heaps that are too small here: drivers handle such allocations differently.
    const std::uint32_t heap = device.memory().memoryTypes[*type].heapIndex;
    if (needs.size > device.memory().memoryHeaps[heap].size) continue;
    const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, &flags, needs.size, *type};
    result = device.api().vkAllocateMemory(device.handle(), &info, nullptr, &memory);
    if (result == VK_SUCCESS) return result;
  }
  return result;
}

}  // namespace

std::optional<std::uint32_t> memory_type(const VkPhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                                         VkMemoryPropertyFlags wanted) {
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
    if ((allowed >> i & 1U) != 0 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  }
  return std::nullopt;
}

Result<Buffer> Buffer::create(const Device& device, VkDeviceSize size, Where where, const std::string& doing) {
  QUOIN_ASSERT(size > 0, "a positive size");
  const Api& api = device.api();
  Buffer buffer;
  buffer.device_ = &device;
  buffer.size_ = size;
  auto info = info_of<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = size;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT |
               VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_INDEX_BUFFER_BIT;
  info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  VkResult result = api.vkCreateBuffer(device.handle(), &info, nullptr, &buffer.handle_);
  if (result == VK_SUCCESS) result = allocate(device, buffer.handle_, where, buffer.memory_);
  if (result == VK_SUCCESS) result = api.vkBindBufferMemory(device.handle(), buffer.handle_, buffer.memory_, 0);
  if (result == VK_SUCCESS && where != Where::Device) {
    void* mapped = nullptr;
    result = api.vkMapMemory(device.handle(), buffer.memory_, 0, VK_WHOLE_SIZE, 0, &mapped);
    buffer.mapped_ = static_cast<std::byte*>(mapped);
  }
  if (Status status = device.check(result, doing); !status) return status.error();
  const VkBufferDeviceAddressInfo address{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr, buffer.handle_};
  buffer.address_ = api.vkGetBufferDeviceAddress(device.handle(), &address);
  return buffer;
}

Buffer::~Buffer() {
  if (device_ == nullptr) return;
  const Api& api = device_->api();
  if (handle_ != VK_NULL_HANDLE) api.vkDestroyBuffer(device_->handle(), handle_, nullptr);
  if (memory_ != VK_NULL_HANDLE) api.vkFreeMemory(device_->handle(), memory_, nullptr);
}

void Buffer::swap(Buffer& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(handle_, other.handle_);
  std::swap(memory_, other.memory_);
  std::swap(size_, other.size_);
  std::swap(address_, other.address_);
  std::swap(mapped_, other.mapped_);
}

// Takes the first gap that is large enough; returns an empty place if there is none.
Place DeviceMemory::take(std::size_t block, VkDeviceSize size) {
  QUOIN_ASSERT(block < blocks_.size() && blocks_[block] != nullptr && size % kAlignment == 0,
               "an aligned size in a block");
  Block& from = *blocks_[block];
  const auto gap = std::find_if(from.free.begin(), from.free.end(), [&](const auto& g) { return g.second >= size; });
  if (gap == from.free.end()) return {};
  const auto [offset, room] = *gap;
  from.free.erase(gap);
  if (room > size) from.free[offset + size] = room - size;
  QUOIN_ASSERT((from.buffer.address() + offset) % kAlignment == 0, "an aligned address");
  return {block, offset, size, from.buffer.address() + offset};
}

Result<Place> DeviceMemory::allocate(VkDeviceSize wanted, const std::string& doing) {
  const VkDeviceSize size = std::max((wanted + kAlignment - 1) / kAlignment, VkDeviceSize{1}) * kAlignment;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (blocks_[i] == nullptr) continue;
    if (const Place place = take(i, size); place.size != 0) return place;
  }
  // Leaves room to align the address, for any alignment of the buffer.
  const VkDeviceSize bytes = std::max(size, block_bytes_ / kAlignment * kAlignment);
  auto buffer = Buffer::create(*device_, bytes + kAlignment, Buffer::Where::Device, doing);
  if (!buffer) return buffer.error();
  auto block = std::make_unique<Block>();
  block->free[(kAlignment - buffer->address() % kAlignment) % kAlignment] = bytes;
  block->buffer = std::move(*buffer);
  const auto unused = std::find(blocks_.begin(), blocks_.end(), nullptr);
  const auto index = static_cast<std::size_t>(unused - blocks_.begin());
  if (unused == blocks_.end()) blocks_.emplace_back();
  blocks_[index] = std::move(block);
  return take(index, size);
}

void DeviceMemory::release(Place& place) {
  const Place old = std::exchange(place, {});
  if (old.size == 0) return;
  QUOIN_ASSERT(is_allocated(old), "an allocated place");
  std::map<VkDeviceSize, VkDeviceSize>& free = blocks_[old.block]->free;
  const auto [freed, is_new] = free.emplace(old.offset, old.size);
  QUOIN_ASSERT(is_new, "each allocation is freed once");
  auto at = freed;
  QUOIN_ASSERT(std::next(at) == free.end() || at->first + at->second <= std::next(at)->first, "gaps lie apart");
  if (const auto next = std::next(at); next != free.end() && at->first + at->second == next->first) {
    at->second += next->second;
    free.erase(next);
  }
  if (at != free.begin()) {
    const auto before = std::prev(at);
    if (before->first + before->second == at->first) {
      before->second += at->second;
      free.erase(at);
      at = before;
    }
  }
  const bool is_empty = at->second + kAlignment >= blocks_[old.block]->buffer.size();
  if (is_empty && copies_.empty() && block_count() > 1) blocks_[old.block].reset();
}

Status DeviceMemory::write(const Place& place, std::span<const std::byte> bytes, VkDeviceSize offset) {
  QUOIN_ASSERT(offset + bytes.size() <= place.size || bytes.empty(), "bytes within the place");
  QUOIN_ASSERT(bytes.empty() || is_allocated(place), "an allocated place");
  written_ += bytes.size();
  if (staging_.handle() == VK_NULL_HANDLE && !bytes.empty()) {
    auto staging = Buffer::create(*device_, kStagingBytes, Buffer::Where::Upload, "uploading");
    if (!staging) return staging.error();
    staging_ = std::move(*staging);
  }
  while (!bytes.empty()) {
    if (staged_ == kStagingBytes) {
      if (Status flushed = flush(); !flushed) return flushed;
    }
    const std::size_t part = std::min<std::size_t>(bytes.size(), kStagingBytes - staged_);
    std::memcpy(staging_.mapped() + staged_, bytes.data(), part);
    copies_.push_back({blocks_[place.block]->buffer.handle(), {staged_, place.offset + offset, part}});
    staged_ += part;
    offset += part;
    bytes = bytes.subspan(part);
  }
  return {};
}

Status DeviceMemory::flush() {
  if (copies_.empty()) return {};
  Status done = device_->run("uploading", [&](VkCommandBuffer commands) {
    for (const Copy& copy : copies_) {
      device_->api().vkCmdCopyBuffer(commands, staging_.handle(), copy.to, 1, &copy.region);
    }
  });
  discard();
  return done;
}

void DeviceMemory::discard() {
  copies_.clear();
  staged_ = 0;
}

std::size_t DeviceMemory::block_count() const {
  return static_cast<std::size_t>(
      std::count_if(blocks_.begin(), blocks_.end(), [](const auto& block) { return block != nullptr; }));
}

Places::~Places() {
  memory_->discard();
  for (Place& place : places_) memory_->release(place);
}

Status Places::reserve(std::size_t bytes, std::uint64_t& address) {
  const auto place = memory_->allocate(bytes, doing_);
  if (!place) return place.error();
  places_.push_back(*place);
  address = place->address;
  return {};
}

Status Places::upload(std::span<const std::byte> bytes, std::uint64_t& address) {
  if (bytes.empty()) return {};
  if (Status done = reserve(bytes.size(), address); !done) return done;
  return memory_->write(places_.back(), bytes);
}

}  // namespace quoin::vulkan
