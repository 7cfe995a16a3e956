#ifdef QUOIN_HAVE_VULKAN

#include "render/vulkan/device/device_memory.h"

#include <algorithm>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

namespace quoin::vulkan {
namespace {

class VulkanMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    auto made = Device::create({});
    if (!made) GTEST_SKIP() << made.error().message;
    device_ = std::move(*made);
  }

  std::unique_ptr<Device> device_;
};

TEST_F(VulkanMemory, PlacesNeverOverlapAndFreeTheirBlocks) {
  DeviceMemory memory(*device_, 1 << 16);
  const unsigned seed = 11;
  std::mt19937 random(seed);
  std::vector<Place> places;
  for (int step = 0; step < 3000; ++step) {
    if (!places.empty() && random() % 5 < 2) {
      const std::size_t i = random() % places.size();
      memory.release(places[i]);
      EXPECT_EQ(places[i].size, 0U);
      places.erase(places.begin() + static_cast<std::ptrdiff_t>(i));
      continue;
    }
    const VkDeviceSize size = 1 + random() % (random() % 50 == 0 ? 200'000 : 3000);
    const auto place = memory.allocate(size, "testing");
    ASSERT_TRUE(place) << to_string(place.error());
    EXPECT_GE(place->size, size);
    EXPECT_EQ(place->address % DeviceMemory::kAlignment, 0U);
    places.push_back(*place);
  }
  std::vector<Place> sorted = places;
  std::sort(sorted.begin(), sorted.end(), [](const Place& a, const Place& b) { return a.address < b.address; });
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    ASSERT_LE(sorted[i - 1].address + sorted[i - 1].size, sorted[i].address) << "seed " << seed;
  }
  EXPECT_GT(memory.block_count(), 10U);
  for (Place& place : places) memory.release(place);
  EXPECT_EQ(memory.block_count(), 1U);
}

TEST_F(VulkanMemory, WritesMoreThanStagingBuffer) {
  DeviceMemory memory(*device_, 1 << 20);
  // More than the staging buffer holds.
  std::vector<std::uint32_t> values(5'000'000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint32_t>(i * 2654435761U);
  const Place other = memory.allocate(100, "testing").value();
  ASSERT_TRUE(memory.write(other, std::as_bytes(std::span(values).first(25))));
  const Place place = memory.allocate(values.size() * 4, "testing").value();
  ASSERT_TRUE(memory.write(place, std::as_bytes(std::span(values))));
  ASSERT_TRUE(memory.flush());
  EXPECT_EQ(memory.written(), values.size() * 4 + 100);
}

TEST_F(VulkanMemory, ReportsExhaustedMemoryAndContinues) {
  DeviceMemory memory(*device_, 1 << 16);
  const auto refused = memory.allocate(VkDeviceSize{1} << 50, "testing");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_NE(refused.error().message.find("out of device memory while testing"), std::string::npos)
      << refused.error().message;
  EXPECT_TRUE(memory.allocate(100, "testing"));
}

TEST_F(VulkanMemory, ReportsLostDevice) {
  const Error lost = device_->error_of(VK_ERROR_DEVICE_LOST, "drawing");
  EXPECT_EQ(lost.code, ErrorCode::DeviceLost);
  EXPECT_EQ(lost.message, "vulkan: " + device_->description().name + ": the device was lost while drawing");
}

TEST(VulkanValidation, ReportsInvalidCalls) {
  std::vector<std::string> messages;
  VulkanOptions options;
  options.on_validation_message = [&](const std::string& message) { messages.push_back(message); };
  const auto device = Device::create(options);
  if (!device) GTEST_SKIP() << device.error().message;
  EXPECT_TRUE(messages.empty());
  auto info = info_of<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = 0;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  static_cast<void>((*device)->api().vkCreateBuffer((*device)->handle(), &info, nullptr, &buffer));
  EXPECT_FALSE(messages.empty());
}

}  // namespace
}  // namespace quoin::vulkan

#endif
