#include "swapchain.h"

#include <algorithm>
#include <utility>

namespace quoin::viewer {
namespace {

const char* const kDoing = "creating the window's images";

VkExtent2D extent_within(const VkSurfaceCapabilitiesKHR& can, VkExtent2D wanted) {
  // Most windows report their size; otherwise the swapchain chooses it.
  if (can.currentExtent.width != 0xFFFF'FFFFU) return can.currentExtent;
  return {std::clamp(wanted.width, can.minImageExtent.width, can.maxImageExtent.width),
          std::clamp(wanted.height, can.minImageExtent.height, can.maxImageExtent.height)};
}

VkCompositeAlphaFlagBitsKHR opaque(VkCompositeAlphaFlagsKHR supported) {
  for (const VkCompositeAlphaFlagBitsKHR one : {VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR, VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR,
                                                VK_COMPOSITE_ALPHA_POST_MULTIPLIED_BIT_KHR}) {
    if ((supported & one) != 0) return one;
  }
  return VK_COMPOSITE_ALPHA_PRE_MULTIPLIED_BIT_KHR;
}

}  // namespace

Result<VkSurfaceFormatKHR> Swapchain::format_of(const WindowDevice& device) {
  const VkPhysicalDevice physical = device.physical();
  VkSurfaceCapabilitiesKHR can{};
  const VkResult asked = vkGetPhysicalDeviceSurfaceCapabilitiesKHR(physical, device.surface(), &can);
  if (Status known = device.check(asked, kDoing); !known) return known.error();
  if ((can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT) == 0) {
    return make_error(ErrorCode::Unsupported, "vulkan: " + device.name() + ": images cannot be copied to the window");
  }
  std::uint32_t count = 0;
  vkGetPhysicalDeviceSurfaceFormatsKHR(physical, device.surface(), &count, nullptr);
  std::vector<VkSurfaceFormatKHR> formats(count);
  vkGetPhysicalDeviceSurfaceFormatsKHR(physical, device.surface(), &count, formats.data());
  for (const VkSurfaceFormatKHR& format : formats) {
    const bool has_bytes = format.format == VK_FORMAT_B8G8R8A8_UNORM || format.format == VK_FORMAT_R8G8B8A8_UNORM;
    if (has_bytes && format.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR) return format;
  }
  return make_error(ErrorCode::Unsupported, "vulkan: " + device.name() + ": the window has no 8-bit sRGB format");
}

Result<VkRenderPass> Swapchain::make_pass(const WindowDevice& device) {
  const auto format = format_of(device);
  if (!format) return format.error();
  VkAttachmentDescription image{};
  image.format = format->format;
  image.samples = VK_SAMPLE_COUNT_1_BIT;
  image.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
  image.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  image.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  image.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  image.initialLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
  image.finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
  const VkAttachmentReference colour{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &colour;
  VkSubpassDependency after_copy{};
  after_copy.srcSubpass = VK_SUBPASS_EXTERNAL;
  after_copy.srcStageMask = VK_PIPELINE_STAGE_TRANSFER_BIT;
  after_copy.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  after_copy.dstStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  after_copy.dstAccessMask = VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
  auto info = info_of<VkRenderPassCreateInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO);
  info.attachmentCount = info.subpassCount = info.dependencyCount = 1;
  info.pAttachments = &image;
  info.pSubpasses = &subpass;
  info.pDependencies = &after_copy;
  VkRenderPass pass = VK_NULL_HANDLE;
  const VkResult result = vkCreateRenderPass(device.handle(), &info, nullptr, &pass);
  if (Status made = device.check(result, "opening a window"); !made) return made.error();
  return pass;
}

Result<std::unique_ptr<Swapchain>> Swapchain::create(const WindowDevice& device, VkRenderPass pass, int width,
                                                     int height, bool vsync, const Swapchain* old) {
  std::unique_ptr<Swapchain> made(new Swapchain(device));
  const VkExtent2D wanted{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
  const VkResult result = made->open(pass, wanted, vsync, old == nullptr ? VK_NULL_HANDLE : old->handle());
  if (Status status = device.check(result, kDoing); !status) return status.error();
  if (made->handle() == VK_NULL_HANDLE) made.reset();
  return made;
}

Swapchain::~Swapchain() {
  for (const OneImage& image : images_) {
    if (image.drawn != VK_NULL_HANDLE) vkDestroySemaphore(device_->handle(), image.drawn, nullptr);
    if (image.framebuffer != VK_NULL_HANDLE) vkDestroyFramebuffer(device_->handle(), image.framebuffer, nullptr);
    if (image.view != VK_NULL_HANDLE) vkDestroyImageView(device_->handle(), image.view, nullptr);
  }
  if (handle_ != VK_NULL_HANDLE) vkDestroySwapchainKHR(device_->handle(), handle_, nullptr);
}

VkPresentModeKHR Swapchain::mode(bool vsync) const {
  std::uint32_t count = 0;
  const VkPhysicalDevice physical = device_->physical();
  vkGetPhysicalDeviceSurfacePresentModesKHR(physical, device_->surface(), &count, nullptr);
  std::vector<VkPresentModeKHR> modes(count);
  vkGetPhysicalDeviceSurfacePresentModesKHR(physical, device_->surface(), &count, modes.data());
  for (const VkPresentModeKHR one : {VK_PRESENT_MODE_MAILBOX_KHR, VK_PRESENT_MODE_IMMEDIATE_KHR}) {
    if (!vsync && std::find(modes.begin(), modes.end(), one) != modes.end()) return one;
  }
  return VK_PRESENT_MODE_FIFO_KHR;  // always supported
}

VkResult Swapchain::open(VkRenderPass pass, VkExtent2D wanted, bool vsync, VkSwapchainKHR old) {
  VkSurfaceCapabilitiesKHR can{};
  VkResult result = vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_->physical(), device_->surface(), &can);
  if (result != VK_SUCCESS) return result;
  const auto format = format_of(*device_);
  if (!format) return VK_ERROR_FORMAT_NOT_SUPPORTED;
  extent_ = extent_within(can, wanted);
  if (extent_.width == 0 || extent_.height == 0) return VK_SUCCESS;
  auto info = info_of<VkSwapchainCreateInfoKHR>(VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR);
  info.surface = device_->surface();
  info.minImageCount = can.minImageCount + 1;
  if (can.maxImageCount != 0) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
  info.imageFormat = format->format;
  info.imageColorSpace = format->colorSpace;
  info.imageExtent = extent_;
  info.imageArrayLayers = 1;
  info.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  info.preTransform = can.currentTransform;
  info.compositeAlpha = opaque(can.supportedCompositeAlpha);
  info.presentMode = mode(vsync);
  info.clipped = VK_TRUE;
  info.oldSwapchain = old;
  result = vkCreateSwapchainKHR(device_->handle(), &info, nullptr, &handle_);
  if (result != VK_SUCCESS) return result;
  std::uint32_t count = 0;
  vkGetSwapchainImagesKHR(device_->handle(), handle_, &count, nullptr);
  std::vector<VkImage> images(count);
  result = vkGetSwapchainImagesKHR(device_->handle(), handle_, &count, images.data());
  for (std::size_t i = 0; i < images.size() && result == VK_SUCCESS; ++i) {
    result = add_image(images[i], format->format, pass);
  }
  return result;
}

VkResult Swapchain::add_image(VkImage image, VkFormat format, VkRenderPass pass) {
  OneImage& one = images_.emplace_back();
  one.handle = image;
  auto view = info_of<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  view.image = image;
  view.viewType = VK_IMAGE_VIEW_TYPE_2D;
  view.format = format;
  view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  VkResult result = vkCreateImageView(device_->handle(), &view, nullptr, &one.view);
  if (result != VK_SUCCESS) return result;
  auto frame = info_of<VkFramebufferCreateInfo>(VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO);
  frame.renderPass = pass;
  frame.attachmentCount = 1;
  frame.pAttachments = &one.view;
  frame.width = extent_.width;
  frame.height = extent_.height;
  frame.layers = 1;
  result = vkCreateFramebuffer(device_->handle(), &frame, nullptr, &one.framebuffer);
  if (result != VK_SUCCESS) return result;
  const auto semaphore = info_of<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
  return vkCreateSemaphore(device_->handle(), &semaphore, nullptr, &one.drawn);
}

}  // namespace quoin::viewer
