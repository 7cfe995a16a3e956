#include "vulkan_screen.h"

#include <imgui.h>

#include <cmath>
#include <vector>

#include "viewer/window/screen.h"
#include "vulkan_window.h"

// Included after Vulkan's headers, because it would otherwise declare their types itself.
#include <SDL_vulkan.h>

namespace quoin::viewer {

Result<WindowDeviceOptions> device_options(SDL_Window* window) {
  unsigned count = 0;
  if (SDL_Vulkan_GetInstanceExtensions(window, &count, nullptr) == SDL_FALSE) {
    return make_error(ErrorCode::Unsupported, "cannot draw in a window with Vulkan: " + sdl_says());
  }
  std::vector<const char*> names(count);
  SDL_Vulkan_GetInstanceExtensions(window, &count, names.data());
  WindowDeviceOptions options;
  options.instance_extensions.assign(names.begin(), names.end());
  options.get_instance_proc_addr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(SDL_Vulkan_GetVkGetInstanceProcAddr());
  options.make_surface = [window](VkInstance instance) {
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    return SDL_Vulkan_CreateSurface(window, instance, &surface) == SDL_TRUE ? surface : VK_NULL_HANDLE;
  };
  return options;
}

Result<std::shared_ptr<VulkanRenderer>> make_renderer(std::shared_ptr<WindowDevice> device) {
  struct Both {
    std::shared_ptr<WindowDevice> device;
    VulkanRenderer renderer;  // destroyed first
  };
  auto renderer = VulkanRenderer::create(device->lent());
  if (!renderer) return renderer.error();
  const auto both = std::make_shared<Both>(Both{std::move(device), std::move(*renderer)});
  return std::shared_ptr<VulkanRenderer>(both, &both->renderer);
}

namespace {

class VulkanScreen final : public Screen {
 public:
  /// Errors: Unsupported.
  Status open(int width, int height, const std::string& device);

  [[nodiscard]] SDL_Point output_size() const override;
  [[nodiscard]] bool has_vsync() const override { return true; }
  [[nodiscard]] std::shared_ptr<VulkanRenderer> renderer() const override { return renderer_; }
  Status set_font(int width, int height, std::span<const std::uint8_t> opacity) override;
  Status show_image(const ViewFrame& frame) override;
  void forget_image() override { image_.reset(); }
  Status show(const SDL_Rect& place, const ImDrawData& gui) override;

 private:
  void collect(const ImDrawData& gui);

  std::shared_ptr<VulkanRenderer> renderer_;
  std::unique_ptr<VulkanWindow> shown_in_;
  std::shared_ptr<const VulkanImage> image_;
  std::shared_ptr<VulkanImage> uploaded_;  // images rendered by the processor
  std::vector<OverlayVertex> vertices_;
  std::vector<std::uint16_t> indices_;
  std::vector<OverlayDraw> draws_;
};

Status VulkanScreen::open(int width, int height, const std::string& device) {
  if (Status opened = open_window(width, height, SDL_WINDOW_VULKAN); !opened) return opened;
  auto options = device_options(window());
  if (!options) return options.error();
  options->device = device;
  auto made = WindowDevice::create(*options);
  if (!made) return made.error();
  auto renderer = make_renderer(*made);
  if (!renderer) return renderer.error();
  renderer_ = std::move(*renderer);
  auto shown = VulkanWindow::create(std::move(*made));
  if (!shown) return shown.error();
  shown_in_ = std::make_unique<VulkanWindow>(std::move(*shown));
  return {};
}

SDL_Point VulkanScreen::output_size() const {
  SDL_Point size{0, 0};
  SDL_Vulkan_GetDrawableSize(window(), &size.x, &size.y);
  return size;
}

Status VulkanScreen::set_font(int width, int height, std::span<const std::uint8_t> opacity) {
  return shown_in_->set_font(width, height, opacity);
}

Status VulkanScreen::show_image(const ViewFrame& frame) {
  if (frame.on_device) {
    image_ = frame.on_device;
    return {};
  }
  if (!uploaded_) uploaded_ = std::make_shared<VulkanImage>(*renderer_);
  if (Status written = uploaded_->write(frame.colour); !written) return written;
  image_ = uploaded_;
  return {};
}

void VulkanScreen::collect(const ImDrawData& gui) {
  static_assert(sizeof(ImDrawIdx) == sizeof(std::uint16_t));
  vertices_.clear();
  indices_.clear();
  draws_.clear();
  const ImVec2 scale = gui.FramebufferScale;
  const ImVec2 origin = gui.DisplayPos;
  for (int i = 0; i < gui.CmdListsCount; ++i) {
    const ImDrawList& list = *gui.CmdLists[i];
    const auto first_vertex = static_cast<std::uint32_t>(vertices_.size());
    const auto first_index = static_cast<std::uint32_t>(indices_.size());
    for (const ImDrawVert& v : list.VtxBuffer) {
      vertices_.push_back({(v.pos.x - origin.x) * scale.x, (v.pos.y - origin.y) * scale.y, v.uv.x, v.uv.y, v.col});
    }
    indices_.insert(indices_.end(), list.IdxBuffer.begin(), list.IdxBuffer.end());
    for (const ImDrawCmd& command : list.CmdBuffer) {
      if (command.UserCallback != nullptr) continue;
      const auto pixel = [](float value) { return static_cast<int>(std::floor(value)); };
      const int left = pixel((command.ClipRect.x - origin.x) * scale.x);
      const int top = pixel((command.ClipRect.y - origin.y) * scale.y);
      const int right = -pixel(-(command.ClipRect.z - origin.x) * scale.x);
      const int bottom = -pixel(-(command.ClipRect.w - origin.y) * scale.y);
      draws_.push_back({{left, top, right - left, bottom - top},
                        first_index + command.IdxOffset,
                        command.ElemCount,
                        first_vertex + command.VtxOffset});
    }
  }
}

Status VulkanScreen::show(const SDL_Rect& place, const ImDrawData& gui) {
  collect(gui);
  const SDL_Point size = output_size();
  return shown_in_->present(size.x, size.y, image_.get(), {place.x, place.y, place.w, place.h},
                            {vertices_, indices_, draws_});
}

}  // namespace

Result<std::unique_ptr<Screen>> open_vulkan_screen(int width, int height, const std::string& device) {
  // Checked first, because SDL's error for a missing driver is less clear.
  if (const auto devices = vulkan_devices(); !devices) return devices.error();
  auto screen = std::make_unique<VulkanScreen>();
  if (Status opened = screen->open(width, height, device); !opened) return opened.error();
  return screen;
}

}  // namespace quoin::viewer
