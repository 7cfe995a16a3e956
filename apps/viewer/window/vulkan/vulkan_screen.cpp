#include "viewer/window/screen.h"
#include "vulkan_window.h"
#include "window_device.h"

// Included after Vulkan's headers, because it would otherwise declare their types itself.
#include <SDL_vulkan.h>

namespace quoin::viewer {

namespace {

class VulkanScreen final : public Screen {
 public:
  /// Errors: Unsupported.
  Status open(int width, int height, const std::string& device);

  [[nodiscard]] SDL_Point output_size() const override;
  [[nodiscard]] bool has_vsync() const override { return true; }
  [[nodiscard]] std::shared_ptr<VulkanRenderer> renderer() const override { return renderer_; }
  Status open_gui() override { return shown_in_->open_gui(); }
  void close_gui() override { shown_in_->close_gui(); }
  Status show_image(const ViewFrame& frame) override;
  void forget_image() override { image_.reset(); }
  Status show(const SDL_Rect& place, const ImDrawData& gui) override;

 private:
  std::shared_ptr<VulkanRenderer> renderer_;
  std::unique_ptr<VulkanWindow> shown_in_;
  std::shared_ptr<const VulkanImage> image_;
  std::shared_ptr<VulkanImage> uploaded_;  // images rendered by the processor
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

Status VulkanScreen::show(const SDL_Rect& place, const ImDrawData& gui) {
  const SDL_Point size = output_size();
  return shown_in_->present(size.x, size.y, image_.get(), place, gui);
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
