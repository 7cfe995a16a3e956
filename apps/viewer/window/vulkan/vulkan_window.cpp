#include "vulkan_window.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "vulkan_gui.h"

namespace quoin::viewer {
namespace {

const char* const kShowing = "showing an image";
constexpr VkFormat kUnchangedBytes = VK_FORMAT_R8G8B8A8_UNORM;
constexpr VkClearColorValue kGround = {{0.07F, 0.075F, 0.09F, 1.0F}};
constexpr VkImageSubresourceRange kWholeImage = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
constexpr VkImageSubresourceLayers kLayers = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};

}  // namespace

/// A Vulkan image that Quoin's images are copied into, to be scaled from there.
class CopiedImage {
 public:
  explicit CopiedImage(const WindowDevice& device) : device_(&device) {}
  ~CopiedImage() { free(); }
  CopiedImage(const CopiedImage&) = delete;
  CopiedImage& operator=(const CopiedImage&) = delete;

  /// Recreates the image, with undefined pixels, if its size differs.
  /// Requires: no commands that read it are running. Errors: LimitExceeded.
  [[nodiscard]] Status fit(int width, int height);

  [[nodiscard]] VkImage handle() const { return image_; }
  /// Returns the target for VulkanImage::record_copy, which leaves the image in VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL.
  [[nodiscard]] VulkanImageTarget target() const;

 private:
  VkResult make(int width, int height);
  void free();

  const WindowDevice* device_;
  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  int width_ = 0;
  int height_ = 0;
};

Status CopiedImage::fit(int width, int height) {
  if (width == width_ && height == height_) return {};
  free();
  if (Status made = device_->check(make(width, height), "allocating memory for a window"); !made) {
    free();
    return made;
  }
  width_ = width;
  height_ = height;
  return {};
}

VkResult CopiedImage::make(int width, int height) {
  auto info = info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = kUnchangedBytes;
  info.extent = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
  VkResult result = vkCreateImage(device_->handle(), &info, nullptr, &image_);
  if (result != VK_SUCCESS) return result;
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(device_->handle(), image_, &needs);
  auto memory = info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = device_->memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  result = vkAllocateMemory(device_->handle(), &memory, nullptr, &memory_);
  return result == VK_SUCCESS ? vkBindImageMemory(device_->handle(), image_, memory_, 0) : result;
}

void CopiedImage::free() {
  if (image_ != VK_NULL_HANDLE) vkDestroyImage(device_->handle(), image_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->handle(), memory_, nullptr);
  image_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  width_ = height_ = 0;
}

VulkanImageTarget CopiedImage::target() const {
  VulkanImageTarget target;
  target.image = image_;
  target.format = kUnchangedBytes;
  target.width = width_;
  target.height = height_;
  target.layout_before = VK_IMAGE_LAYOUT_UNDEFINED;
  target.layout_after = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  return target;
}

namespace {

/// The visible pixels of an image and of the window, along an axis.
struct VisiblePixels {
  std::int32_t image[2];
  std::int32_t window[2];
};

// Returns the pixels of an axis of `image` pixels, stretched over `size` of `window` pixels from `start` on.
VisiblePixels visible_pixels(int image, int start, int size, std::uint32_t window) {
  const auto in_window = [window](std::int64_t at) {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(at, 0, window));
  };
  const std::int32_t low = in_window(start);
  const std::int32_t high = in_window(std::int64_t{start} + size);
  // At the edge of the window, pixels that are partly visible are copied too.
  const std::int64_t image_low = (std::int64_t{low} - start) * image / size;
  const std::int64_t image_high = ((std::int64_t{high} - start) * image + size - 1) / size;
  return {{static_cast<std::int32_t>(image_low), static_cast<std::int32_t>(image_high)}, {low, high}};
}

}  // namespace

struct VulkanWindow::Impl {
  Impl(std::shared_ptr<WindowDevice> of_device, bool with_vsync)
      : device(std::move(of_device)), vsync(with_vsync), copied(*device) {}
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  VkResult make_objects();
  Status fit(int width, int height);
  Status begin(const VulkanImage* rendered);
  Status record(std::uint32_t shown, const VulkanImage* rendered, const SDL_Rect& place, const ImDrawData& gui);
  void clear(VkImage image) const;
  void copy(const VulkanImage& rendered, const SDL_Rect& place, VkImage image) const;
  VkResult show(std::uint32_t shown);
  VkResult wait();
  void give_up_image();

  std::shared_ptr<WindowDevice> device;
  bool vsync;
  VkRenderPass pass = VK_NULL_HANDLE;
  std::unique_ptr<Swapchain> swapchain;  // null until there is a size
  bool is_stale = true;
  VkCommandPool pool = VK_NULL_HANDLE;
  VkCommandBuffer commands = VK_NULL_HANDLE;
  VkFence done = VK_NULL_HANDLE;
  VkSemaphore handed = VK_NULL_HANDLE;
  CopiedImage copied;
  std::unique_ptr<VulkanGui> gui;
};

VkResult VulkanWindow::Impl::make_objects() {
  auto pool_info = info_of<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool_info.queueFamilyIndex = device->queue_family();
  VkResult result = vkCreateCommandPool(device->handle(), &pool_info, nullptr, &pool);
  if (result != VK_SUCCESS) return result;
  auto buffer = info_of<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  buffer.commandPool = pool;
  buffer.commandBufferCount = 1;
  result = vkAllocateCommandBuffers(device->handle(), &buffer, &commands);
  if (result != VK_SUCCESS) return result;
  const auto fence = info_of<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  result = vkCreateFence(device->handle(), &fence, nullptr, &done);
  if (result != VK_SUCCESS) return result;
  const auto semaphore = info_of<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
  return vkCreateSemaphore(device->handle(), &semaphore, nullptr, &handed);
}

// Abandons an acquired image that is not drawn: its semaphore stays signalled and the swapchain lacks the image, so
// both are created again.
void VulkanWindow::Impl::give_up_image() {
  vkDeviceWaitIdle(device->handle());
  swapchain.reset();
  is_stale = true;
  vkDestroySemaphore(device->handle(), handed, nullptr);
  const auto semaphore = info_of<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
  if (vkCreateSemaphore(device->handle(), &semaphore, nullptr, &handed) != VK_SUCCESS) handed = VK_NULL_HANDLE;
}

VulkanWindow::Impl::~Impl() {
  vkDeviceWaitIdle(device->handle());
  swapchain.reset();
  if (handed != VK_NULL_HANDLE) vkDestroySemaphore(device->handle(), handed, nullptr);
  if (done != VK_NULL_HANDLE) vkDestroyFence(device->handle(), done, nullptr);
  if (pool != VK_NULL_HANDLE) vkDestroyCommandPool(device->handle(), pool, nullptr);
  if (pass != VK_NULL_HANDLE) vkDestroyRenderPass(device->handle(), pass, nullptr);
}

// Waits until the last frame is drawn.
VkResult VulkanWindow::Impl::wait() {
  const VkResult result =
      vkWaitForFences(device->handle(), 1, &done, VK_TRUE, std::numeric_limits<std::uint64_t>::max());
  return result == VK_SUCCESS ? vkResetFences(device->handle(), 1, &done) : result;
}

Status VulkanWindow::Impl::fit(int width, int height) {
  const VkExtent2D now = swapchain ? swapchain->extent() : VkExtent2D{};
  if (!is_stale && now.width == static_cast<std::uint32_t>(width) && now.height == static_cast<std::uint32_t>(height)) {
    return {};
  }
  // Images still being presented must not be destroyed; resizing is rare enough to wait for the whole device.
  vkDeviceWaitIdle(device->handle());
  const std::unique_ptr<Swapchain> old = std::move(swapchain);
  auto made = Swapchain::create(*device, pass, width, height, vsync, old.get());
  if (!made) return made.error();
  swapchain = std::move(*made);
  is_stale = false;
  return {};
}

void VulkanWindow::Impl::clear(VkImage image) const {
  auto acquired = info_of<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
  acquired.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  acquired.newLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
  acquired.srcQueueFamilyIndex = acquired.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  acquired.image = image;
  acquired.subresourceRange = kWholeImage;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 0, nullptr, 0,
                       nullptr, 1, &acquired);
  vkCmdClearColorImage(commands, image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &kGround, 1, &kWholeImage);
}

void VulkanWindow::Impl::copy(const VulkanImage& rendered, const SDL_Rect& place, VkImage image) const {
  const VkExtent2D window = swapchain->extent();
  const VisiblePixels x = visible_pixels(rendered.width(), place.x, place.w, window.width);
  const VisiblePixels y = visible_pixels(rendered.height(), place.y, place.h, window.height);
  if (x.window[0] == x.window[1] || y.window[0] == y.window[1]) return;
  auto cleared = info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
  cleared.srcAccessMask = cleared.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 1, &cleared, 0,
                       nullptr, 0, nullptr);
  const VkImageBlit blit{kLayers,
                         {{x.image[0], y.image[0], 0}, {x.image[1], y.image[1], 1}},
                         kLayers,
                         {{x.window[0], y.window[0], 0}, {x.window[1], y.window[1], 1}}};
  const bool is_stretched = rendered.width() != place.w || rendered.height() != place.h;
  vkCmdBlitImage(commands, copied.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, image,
                 VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &blit, is_stretched ? VK_FILTER_LINEAR : VK_FILTER_NEAREST);
}

// Begins the command buffer and copies the image into one that can be scaled.
Status VulkanWindow::Impl::begin(const VulkanImage* rendered) {
  if (rendered != nullptr) {
    if (Status fits = copied.fit(rendered->width(), rendered->height()); !fits) return fits;
  }
  auto info = info_of<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  VkResult result = vkResetCommandPool(device->handle(), pool, 0);
  if (result == VK_SUCCESS) result = vkBeginCommandBuffer(commands, &info);
  if (result != VK_SUCCESS) return device->check(result, kShowing);
  return rendered == nullptr ? Status{} : rendered->record_copy(commands, copied.target());
}

Status VulkanWindow::Impl::record(std::uint32_t shown, const VulkanImage* image, const SDL_Rect& place,
                                  const ImDrawData& drawn_gui) {
  const bool is_seen = image != nullptr && image->samples() > 0 && place.w > 0 && place.h > 0;
  if (Status begun = begin(is_seen ? image : nullptr); !begun) return begun;
  clear(swapchain->image(shown));
  if (is_seen) copy(*image, place, swapchain->image(shown));
  auto info = info_of<VkRenderPassBeginInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO);
  info.renderPass = pass;
  info.framebuffer = swapchain->framebuffer(shown);
  info.renderArea = {{0, 0}, swapchain->extent()};
  vkCmdBeginRenderPass(commands, &info, VK_SUBPASS_CONTENTS_INLINE);
  Status drawn = gui ? gui->draw(commands, drawn_gui, swapchain->extent()) : Status{};
  if (!drawn) return drawn;
  vkCmdEndRenderPass(commands);
  return device->check(vkEndCommandBuffer(commands), kShowing);
}

VkResult VulkanWindow::Impl::show(std::uint32_t shown) {
  const VkPipelineStageFlags stage = VK_PIPELINE_STAGE_TRANSFER_BIT;  // `clear` is the first command on the image
  const VkSemaphore drawn = swapchain->drawn(shown);
  auto submit = info_of<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  submit.waitSemaphoreCount = submit.commandBufferCount = submit.signalSemaphoreCount = 1;
  submit.pWaitSemaphores = &handed;
  submit.pWaitDstStageMask = &stage;
  submit.pCommandBuffers = &commands;
  submit.pSignalSemaphores = &drawn;
  if (const VkResult result = vkQueueSubmit(device->queue(), 1, &submit, done); result != VK_SUCCESS) {
    return result;
  }
  const VkSwapchainKHR chain = swapchain->handle();
  auto present = info_of<VkPresentInfoKHR>(VK_STRUCTURE_TYPE_PRESENT_INFO_KHR);
  present.waitSemaphoreCount = present.swapchainCount = 1;
  present.pWaitSemaphores = &drawn;
  present.pSwapchains = &chain;
  present.pImageIndices = &shown;
  const VkResult presented = vkQueuePresentKHR(device->queue(), &present);
  // Waits here, because memory that these commands read could otherwise be freed while they run.
  const VkResult waited = wait();
  return waited == VK_SUCCESS ? presented : waited;
}

VulkanWindow::VulkanWindow(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VulkanWindow::VulkanWindow(VulkanWindow&&) noexcept = default;
VulkanWindow& VulkanWindow::operator=(VulkanWindow&&) noexcept = default;
VulkanWindow::~VulkanWindow() = default;

Result<VulkanWindow> VulkanWindow::create(std::shared_ptr<WindowDevice> device, bool vsync) {
  auto impl = std::make_unique<Impl>(std::move(device), vsync);
  const auto pass = Swapchain::make_pass(*impl->device);
  if (!pass) return pass.error();
  impl->pass = *pass;
  if (Status made = impl->device->check(impl->make_objects(), "opening a window"); !made) return made.error();
  return VulkanWindow(std::move(impl));
}

Status VulkanWindow::open_gui() {
  Impl& window = *impl_;
  auto made = VulkanGui::create(*window.device, window.pass);
  if (!made) return made.error();
  if (Status begun = window.begin(nullptr); !begun) return begun;
  if (Status recorded = (*made)->upload_fonts(window.commands); !recorded) return recorded;
  auto submit = info_of<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &window.commands;
  VkResult result = vkEndCommandBuffer(window.commands);
  if (result == VK_SUCCESS) result = vkQueueSubmit(window.device->queue(), 1, &submit, window.done);
  if (result == VK_SUCCESS) result = window.wait();
  if (Status uploaded = window.device->check(result, "uploading fonts"); !uploaded) return uploaded;
  (*made)->end_upload();
  window.gui = std::move(*made);
  return {};
}

void VulkanWindow::close_gui() {
  impl_->gui.reset();
}

Status VulkanWindow::present(int width, int height, const VulkanImage* image, const SDL_Rect& place,
                             const ImDrawData& gui) {
  if (width <= 0 || height <= 0) return {};
  Impl& window = *impl_;
  constexpr int kTries = 3;  // the size may change meanwhile
  for (int attempt = 0; attempt < kTries; ++attempt) {
    if (Status fits = window.fit(width, height); !fits || !window.swapchain) return fits;
    std::uint32_t shown = 0;
    VkResult result =
        vkAcquireNextImageKHR(window.device->handle(), window.swapchain->handle(),
                              std::numeric_limits<std::uint64_t>::max(), window.handed, VK_NULL_HANDLE, &shown);
    window.is_stale = result == VK_ERROR_OUT_OF_DATE_KHR;
    if (window.is_stale) continue;
    if (result != VK_SUCCESS && result != VK_SUBOPTIMAL_KHR) return window.device->check(result, kShowing);
    if (Status recorded = window.record(shown, image, place, gui); !recorded) {
      window.give_up_image();
      return recorded;
    }
    result = window.show(shown);
    window.is_stale = result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR;
    return window.is_stale ? Status{} : window.device->check(result, kShowing);
  }
  return {};  // a later frame will succeed
}

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
