// Renderers on a device that the caller created.

#ifdef QUOIN_HAVE_VULKAN

#include <thread>

#include "core/death_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/device/own_device_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using vulkan::info_of;
using vulkan_test::OwnDevice;
using vulkan_test::OwnImage;

/// Skips without a device; fails on every message of the validation layer.
class VulkanBorrowed : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    own_ = OwnDevice::create(why);
    if (!own_) GTEST_SKIP() << why;
    options_.width = 80;
    options_.height = 60;
  }
  [[nodiscard]] VulkanRenderer renderer() {
    auto made = VulkanRenderer::create(own_->lent());
    EXPECT_TRUE(made) << to_string(made.error());
    return std::move(made.value());
  }
  [[nodiscard]] Image drawn(VulkanRenderer& renderer, const Scene& scene) const {
    EXPECT_TRUE(renderer.update(scene));
    VulkanImage image(renderer);
    EXPECT_TRUE(renderer.draw(image, camera_, options_, Accumulation::Restart));
    return image.read().value();
  }
  void expect_error(const BorrowedVulkanDevice& lent, ErrorCode code, const std::string& message) {
    const auto made = VulkanRenderer::create(lent);
    ASSERT_FALSE(made) << message;
    EXPECT_EQ(made.error().code, code);
    EXPECT_NE(made.error().message.find(message), std::string::npos) << made.error().message;
  }

  std::unique_ptr<OwnDevice> own_;
  Camera camera_ = golden::camera_for(golden::kViews[0]);
  RenderOptions options_;
};

TEST_F(VulkanBorrowed, MatchesImagesOfOwnDevice) {
  const Scene scene = golden::terrain_scene();
  VulkanRenderer borrowing = renderer();
  EXPECT_EQ(borrowing.device().name, describe_vulkan_device(own_->instance, own_->physical)->name);
  VulkanOptions same;
  same.device = borrowing.device().name;
  auto owning = VulkanRenderer::create(same);
  ASSERT_TRUE(owning) << to_string(owning.error());
  EXPECT_EQ(drawn(borrowing, scene).rgb, drawn(*owning, scene).rgb);
}

TEST_F(VulkanBorrowed, DeviceAndImageOutliveRenderer) {
  const Scene scene = golden::terrain_scene();
  OwnImage image(*own_, VK_FORMAT_B8G8R8A8_UNORM, 80, 60);
  Image right;
  for (int round = 0; round < cases(2, 3); ++round) {
    VulkanRenderer shortlived = renderer();
    right = drawn(shortlived, scene);
    VulkanImage rendered(shortlived);
    ASSERT_TRUE(rendered.write(right));
    ASSERT_TRUE(rendered.copy_to(image.target()));
  }
  const std::vector<std::uint8_t> bytes = image.read(image.target());
  for (std::size_t i = 0; i < right.rgb.size(); ++i) ASSERT_EQ(bytes[i / 3 * 4 + i % 3], right.rgb[i]);
  image.write(image.target(), bytes);
}

TEST_F(VulkanBorrowed, TwoRenderersShareOneDevice) {
  const Scene scene = golden::terrain_scene();
  VulkanRenderer first = renderer();
  VulkanRenderer second = renderer();
  const Image right = drawn(first, scene);
  VulkanImage image(first);
  const Status refused = second.draw(image, camera_, options_, Accumulation::Restart);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "vulkan: the image belongs to another renderer");
  // Each renderer runs on its own thread, with the queue guarded.
  std::vector<std::thread> threads;
  for (VulkanRenderer* one : {&first, &second}) {
    threads.emplace_back([&, one] {
      for (int i = 0; i < cases(2, 4); ++i) EXPECT_EQ(drawn(*one, scene).rgb, right.rgb);
    });
  }
  for (std::thread& thread : threads) thread.join();
  { const VulkanRenderer gone = std::move(first); }
  EXPECT_EQ(drawn(second, scene).rgb, right.rgb);
}

TEST_F(VulkanBorrowed, RejectsNullHandles) {
  const BorrowedVulkanDevice right = own_->lent();
  BorrowedVulkanDevice wrong = right;
  wrong.instance = nullptr;
  expect_error(wrong, ErrorCode::InvalidArgument, "the instance is null");
  wrong = right;
  wrong.physical_device = nullptr;
  expect_error(wrong, ErrorCode::InvalidArgument, "the physical device is null");
  wrong = right;
  wrong.device = nullptr;
  expect_error(wrong, ErrorCode::InvalidArgument, "the device is null");
  wrong = right;
  wrong.queue = nullptr;
  expect_error(wrong, ErrorCode::InvalidArgument, "the queue is null");
  wrong = right;
  wrong.queue_family = 1000;
  expect_error(wrong, ErrorCode::InvalidArgument, "has no queue family 1000");
  EXPECT_EQ(describe_vulkan_device(nullptr, own_->physical).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(describe_vulkan_device(own_->instance, nullptr).error().code, ErrorCode::InvalidArgument);
}

// These functions stand between a program and Vulkan, to simulate devices that are not available.
PFN_vkGetInstanceProcAddr real() {
  return vulkan::Api::load()->vkGetInstanceProcAddr;
}
VkInstance found_in = VK_NULL_HANDLE;

VKAPI_ATTR void VKAPI_CALL features_without_addresses(VkPhysicalDevice device, VkPhysicalDeviceFeatures2* features) {
  reinterpret_cast<PFN_vkGetPhysicalDeviceFeatures2>(real()(found_in, "vkGetPhysicalDeviceFeatures2"))(device,
                                                                                                       features);
  static_cast<VkPhysicalDeviceBufferDeviceAddressFeatures*>(features->pNext)->bufferDeviceAddress = VK_FALSE;
}
VKAPI_ATTR void VKAPI_CALL properties_of_old(VkPhysicalDevice device, VkPhysicalDeviceProperties* properties) {
  reinterpret_cast<PFN_vkGetPhysicalDeviceProperties>(real()(found_in, "vkGetPhysicalDeviceProperties"))(device,
                                                                                                         properties);
  properties->apiVersion = VK_API_VERSION_1_1;
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL without_addresses(VkInstance instance, const char* name) {
  found_in = instance;
  if (std::string(name) != "vkGetPhysicalDeviceFeatures2") return real()(instance, name);
  return reinterpret_cast<PFN_vkVoidFunction>(features_without_addresses);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL of_old(VkInstance instance, const char* name) {
  found_in = instance;
  if (std::string(name) != "vkGetPhysicalDeviceProperties") return real()(instance, name);
  return reinterpret_cast<PFN_vkVoidFunction>(properties_of_old);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL without_a_function(VkInstance instance, const char* name) {
  if (std::string(name) == "vkGetPhysicalDeviceFeatures2") return nullptr;
  return real()(instance, name);
}

TEST_F(VulkanBorrowed, RejectsDevicesLackingRequirements) {
  BorrowedVulkanDevice lent = own_->lent();
  const auto as_found = [&](VulkanGetInstanceProcAddr find) {
    lent.get_instance_proc_addr = find;
    return describe_vulkan_device(own_->instance, own_->physical, find);
  };
  EXPECT_EQ(as_found(real())->missing, "");
  EXPECT_TRUE(VulkanRenderer::create(lent));
  EXPECT_EQ(as_found(without_addresses)->missing, "bufferDeviceAddress");
  expect_error(lent, ErrorCode::Unsupported, " lacks bufferDeviceAddress");
  EXPECT_EQ(as_found(of_old)->missing, "Vulkan 1.2");
  expect_error(lent, ErrorCode::Unsupported, " lacks Vulkan 1.2");
  EXPECT_EQ(as_found(without_a_function).error().code, ErrorCode::Unsupported);
  expect_error(lent, ErrorCode::Unsupported, "the instance lacks vkGetPhysicalDeviceFeatures2");
}

TEST_F(VulkanBorrowed, ChecksPreconditions) {
  const Scene scene = golden::terrain_scene();
  VulkanRenderer one = renderer();
  ASSERT_TRUE(one.update(scene));
  VulkanImage image(one);
  ASSERT_TRUE(one.draw(image, camera_, options_, Accumulation::Restart));
  Camera other = camera_;
  other.position.x += 1.0;
  QUOIN_EXPECT_MISTAKE((void)one.draw(image, other, options_, Accumulation::Continue), "have the same camera");
  RenderOptions darker = options_;
  environment_in(darker).exposure = 0.5;
  QUOIN_EXPECT_MISTAKE((void)one.draw(image, camera_, darker, Accumulation::Continue), "have the same light");
  EXPECT_TRUE(one.draw(image, other, darker, Accumulation::Restart));
  BorrowedVulkanDevice lent = own_->lent();
  QUOIN_EXPECT_MISTAKE((void)VulkanRenderer::create(lent, 1000), "at least 64 KiB");
  lent.with_queue = [](const std::function<void()>&) {};
  auto unguarded = VulkanRenderer::create(lent);
  ASSERT_TRUE(unguarded);
  VulkanImage never(*unguarded);
  QUOIN_EXPECT_MISTAKE((void)never.write({1, 1, {1, 2, 3}}), "must call its argument");
}

TEST(VulkanFeatures, AreEnabledInExistingOrNewStructures) {
  auto info = info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  VulkanFeatureStorage storage;
  ASSERT_TRUE(enable_vulkan_features(info, storage));
  const auto* added = static_cast<const VkPhysicalDeviceBufferDeviceAddressFeatures*>(info.pNext);
  EXPECT_EQ(static_cast<const void*>(added), storage.bytes.data());
  EXPECT_EQ(added->sType, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES);
  EXPECT_EQ(added->pNext, nullptr);
  EXPECT_EQ(added->bufferDeviceAddress, VK_TRUE);

  auto all = info_of<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
  all.timelineSemaphore = VK_TRUE;
  VkPhysicalDeviceFeatures2 first{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &all, {}};
  info.pNext = &first;
  ASSERT_TRUE(enable_vulkan_features(info, storage));
  EXPECT_EQ(info.pNext, &first);
  EXPECT_EQ(first.pNext, &all);
  EXPECT_EQ(all.bufferDeviceAddress, VK_TRUE);
  EXPECT_EQ(all.timelineSemaphore, VK_TRUE);

  auto one = info_of<VkPhysicalDeviceBufferDeviceAddressFeatures>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES);
  first.pNext = &one;
  ASSERT_TRUE(enable_vulkan_features(info, storage));
  EXPECT_EQ(one.bufferDeviceAddress, VK_TRUE);
  EXPECT_EQ(one.pNext, nullptr);

  first.pNext = nullptr;
  ASSERT_TRUE(enable_vulkan_features(info, storage));
  EXPECT_EQ(static_cast<const VkBaseInStructure*>(info.pNext)->pNext, reinterpret_cast<VkBaseInStructure*>(&first));
}

TEST(VulkanFeatures, AssertsOnStructureWithoutType) {
  VkDeviceCreateInfo info{};
  VulkanFeatureStorage storage;
  QUOIN_EXPECT_MISTAKE((void)enable_vulkan_features(info, storage), "with its sType set");
}

TEST(VulkanRequirements, MatchHeaders) {
  const VulkanRequirements needs = vulkan_requirements();
  EXPECT_EQ(needs.api_version, VK_API_VERSION_1_2);
  EXPECT_EQ(std::string(needs.features.front()), "bufferDeviceAddress");
  VulkanOptions small;
  small.block_bytes = (64 << 10) - 1;
  QUOIN_EXPECT_MISTAKE((void)VulkanRenderer::create(small), "at least 64 KiB");
}

}  // namespace
}  // namespace quoin

#endif
