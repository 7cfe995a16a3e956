#include "vulkan_gui.h"

#include <imgui_impl_vulkan.h>

#include <exception>

namespace quoin::viewer {

namespace {

class BackendError : public std::exception {
 public:
  explicit BackendError(VkResult result) : result_(result) {}
  [[nodiscard]] VkResult result() const { return result_; }

 private:
  VkResult result_;
};

// Throws, because the backend would continue with an invalid handle.
void throw_failure(VkResult result) {
  if (result != VK_SUCCESS) throw BackendError(result);
}

PFN_vkVoidFunction find_function(const char* name, void* instance) {
  return vkGetInstanceProcAddr(static_cast<VkInstance>(instance), name);
}

std::uint32_t pixels(float units, float pixels_per_unit) {
  return static_cast<std::uint32_t>(units * pixels_per_unit);
}

}  // namespace

template <class Work>
Status VulkanGui::attempt(const Work& work) {
  try {
    work();
  } catch (const BackendError& error) {
    failure_ = device_->check(error.result(), "drawing the user interface").error();
    return *failure_;
  }
  return {};
}

Result<std::unique_ptr<VulkanGui>> VulkanGui::create(const WindowDevice& device, VkRenderPass pass) {
  const BorrowedVulkanDevice lent = device.lent();
  if (!ImGui_ImplVulkan_LoadFunctions(find_function, lent.instance)) {
    return make_error(ErrorCode::Unsupported, "vulkan: " + device.name() + ": the instance lacks functions");
  }
  std::unique_ptr<VulkanGui> made(new VulkanGui(device));
  const VkResult result = made->make_pool();
  if (Status there = device.check(result, "opening the user interface"); !there) return there.error();
  ImGui_ImplVulkan_InitInfo info{};
  info.Instance = lent.instance;
  info.PhysicalDevice = device.physical();
  info.Device = device.handle();
  info.QueueFamily = device.queue_family();
  info.Queue = device.queue();
  info.DescriptorPool = made->pool_;
  info.MinImageCount = info.ImageCount = 2;  // the least that the backend accepts
  info.CheckVkResultFn = throw_failure;
  made->is_open_ = true;
  if (Status opened = made->attempt([&] { ImGui_ImplVulkan_Init(&info, pass); }); !opened) return opened.error();
  return made;
}

VulkanGui::~VulkanGui() {
  if (is_open_ && !failure_) ImGui_ImplVulkan_Shutdown();
  if (failure_) ImGui::GetIO().BackendRendererUserData = nullptr;
  if (pool_ != VK_NULL_HANDLE) vkDestroyDescriptorPool(device_->handle(), pool_, nullptr);
}

// The backend needs one descriptor, of the font image.
VkResult VulkanGui::make_pool() {
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1};
  auto info = info_of<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  info.maxSets = info.poolSizeCount = 1;
  info.pPoolSizes = &size;
  return vkCreateDescriptorPool(device_->handle(), &info, nullptr, &pool_);
}

Status VulkanGui::upload_fonts(VkCommandBuffer commands) {
  return attempt([&] { ImGui_ImplVulkan_CreateFontsTexture(commands); });
}

void VulkanGui::end_upload() const {
  ImGui_ImplVulkan_DestroyFontUploadObjects();
  ImGui::GetIO().Fonts->ClearTexData();
}

Status VulkanGui::draw(VkCommandBuffer commands, const ImDrawData& data, VkExtent2D size) {
  if (failure_) return *failure_;
  ImDrawData drawn = data;
  const ImVec2 scale = data.FramebufferScale;
  // The window may have changed its size since the GUI's layout. The fraction keeps the backend from rounding down to
  // a smaller size.
  if (pixels(drawn.DisplaySize.x, scale.x) != size.width || pixels(drawn.DisplaySize.y, scale.y) != size.height) {
    constexpr float kFraction = 1.0F / 64.0F;
    drawn.DisplaySize.x = (static_cast<float>(size.width) + kFraction) / scale.x;
    drawn.DisplaySize.y = (static_cast<float>(size.height) + kFraction) / scale.y;
  }
  return attempt([&] { ImGui_ImplVulkan_RenderDrawData(&drawn, commands); });
}

}  // namespace quoin::viewer
