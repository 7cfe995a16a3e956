// The choice of a device.

#include <array>

#include <gtest/gtest.h>

#include <quoin/render/vulkan_device.h>

namespace quoin {
namespace {

const std::array<VulkanDeviceInfo, 4> kDevices = {
    VulkanDeviceInfo{"llvmpipe (LLVM 15)", "cpu", ""}, VulkanDeviceInfo{"Old Card", "discrete", "bufferDeviceAddress"},
    VulkanDeviceInfo{"Card 1", "integrated", ""}, VulkanDeviceInfo{"Card 2", "integrated", ""}};

TEST(ChooseVulkanDevice, ChoosesFirstSuitableDeviceOfBestKind) {
  EXPECT_EQ(choose_vulkan_device(kDevices, "").value(), 2U);
  EXPECT_EQ(choose_vulkan_device(std::span(kDevices).first(1), "").value(), 0U);
}

TEST(ChooseVulkanDevice, AcceptsNumbersAndPartsOfNames) {
  EXPECT_EQ(choose_vulkan_device(kDevices, "3").value(), 3U);
  EXPECT_EQ(choose_vulkan_device(kDevices, "CARD 2").value(), 3U);
  EXPECT_EQ(choose_vulkan_device(kDevices, "card").value(), 2U);
  EXPECT_EQ(choose_vulkan_device(kDevices, "LlvmPipe").value(), 0U);
}

TEST(ChooseVulkanDevice, ReportsAvailableDevicesAndMissingFeatures) {
  const auto expect_refusal = [](std::span<const VulkanDeviceInfo> devices, const char* wanted, const char* message) {
    const auto chosen = choose_vulkan_device(devices, wanted);
    ASSERT_FALSE(chosen);
    EXPECT_EQ(chosen.error().code, ErrorCode::Unsupported);
    EXPECT_EQ(chosen.error().message, message);
  };
  expect_refusal(kDevices, "old", "vulkan: Old Card lacks bufferDeviceAddress");
  expect_refusal(kDevices, "1", "vulkan: Old Card lacks bufferDeviceAddress");
  expect_refusal(std::span(kDevices).first(2), "7",
                 "vulkan: no device \"7\"; available: 0 llvmpipe (LLVM 15), 1 Old Card");
  expect_refusal({}, "", "vulkan: no device \"\": no devices found");
}

}  // namespace
}  // namespace quoin
