// A program with its own Vulkan device: Quoin renders into the program's image on this device, between the program's
// own commands. Writes the image to OUT.png (default own_device.png). Exits with 77 if there is no device.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <vulkan/vulkan.h>

#include <quoin/io/image_files.h>
#include <quoin/render/vulkan_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr int kNoDevice = 77;

/// The Vulkan objects that such a program already has. Freed when the program ends.
struct Program {
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  std::uint32_t family = 0;
  VkImage image = VK_NULL_HANDLE;
  VkBuffer buffer = VK_NULL_HANDLE;
  const unsigned char* pixels = nullptr;  // of the buffer
};

void require(VkResult result, const char* what) {
  if (result == VK_SUCCESS) return;
  std::fprintf(stderr, "own_device: %s: VkResult %d\n", what, static_cast<int>(result));
  std::exit(1);
}

bool make_instance(Program& program) {
  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO, nullptr, "example", 1, nullptr, 0, 0};
  application.apiVersion = quoin::vulkan_requirements().api_version;
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  return vkCreateInstance(&info, nullptr, &program.instance) == VK_SUCCESS;
}

bool choose_device(Program& program) {
  std::uint32_t count = 0;
  vkEnumeratePhysicalDevices(program.instance, &count, nullptr);
  std::vector<VkPhysicalDevice> all(count);
  vkEnumeratePhysicalDevices(program.instance, &count, all.data());
  std::vector<quoin::VulkanDeviceInfo> descriptions;
  for (const VkPhysicalDevice one : all) {
    auto description = quoin::describe_vulkan_device(program.instance, one, vkGetInstanceProcAddr);
    if (!description) return false;
    descriptions.push_back(std::move(*description));
  }
  const auto chosen = quoin::choose_vulkan_device(descriptions, "");
  if (!chosen) return false;
  program.physical = all[*chosen];
  vkGetPhysicalDeviceQueueFamilyProperties(program.physical, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(program.physical, &count, families.data());
  while ((families[program.family].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) ++program.family;
  return true;
}

void make_device(Program& program) {
  const float priority = 1.0F;
  VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, nullptr, 0, program.family, 1, &priority};
  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  quoin::VulkanFeatureStorage storage;
  if (!quoin::enable_vulkan_features(info, storage)) std::exit(kNoDevice);
  require(vkCreateDevice(program.physical, &info, nullptr, &program.device), "a device");
  vkGetDeviceQueue(program.device, program.family, 0, &program.queue);
}

VkDeviceMemory allocate(const Program& program, const VkMemoryRequirements& needs, VkMemoryPropertyFlags wanted) {
  VkPhysicalDeviceMemoryProperties kinds{};
  vkGetPhysicalDeviceMemoryProperties(program.physical, &kinds);
  VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, 0};
  const auto fits = [&](std::uint32_t type) {
    return (needs.memoryTypeBits >> type & 1U) != 0 && (kinds.memoryTypes[type].propertyFlags & wanted) == wanted;
  };
  while (!fits(info.memoryTypeIndex)) ++info.memoryTypeIndex;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  require(vkAllocateMemory(program.device, &info, nullptr, &memory), "memory");
  return memory;
}

void make_image(Program& program) {
  VkImageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = VK_FORMAT_R8G8B8A8_SRGB;
  info.extent = {kWidth, kHeight, 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
  require(vkCreateImage(program.device, &info, nullptr, &program.image), "an image");
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(program.device, program.image, &needs);
  require(vkBindImageMemory(program.device, program.image, allocate(program, needs, 0), 0), "an image's memory");
}

void make_buffer(Program& program) {
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = VkDeviceSize{4} * kWidth * kHeight;
  info.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  require(vkCreateBuffer(program.device, &info, nullptr, &program.buffer), "a buffer");
  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(program.device, program.buffer, &needs);
  const VkDeviceMemory memory =
      allocate(program, needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
  require(vkBindBufferMemory(program.device, program.buffer, memory, 0), "a buffer's memory");
  void* mapped = nullptr;
  require(vkMapMemory(program.device, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "a buffer's bytes");
  program.pixels = static_cast<const unsigned char*>(mapped);
}

// Records the program's own commands: renders the image, then reads it.
quoin::Status record(const Program& program, const quoin::VulkanImage& rendered, VkCommandBuffer commands) {
  quoin::VulkanImageTarget target;
  target.image = program.image;
  target.format = VK_FORMAT_R8G8B8A8_SRGB;
  target.width = kWidth;
  target.height = kHeight;
  target.layout_before = VK_IMAGE_LAYOUT_UNDEFINED;
  target.layout_after = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  if (quoin::Status recorded = rendered.record_copy(commands, target); !recorded) return recorded;
  VkBufferImageCopy all{};
  all.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  all.imageExtent = {kWidth, kHeight, 1};
  vkCmdCopyImageToBuffer(commands, program.image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, program.buffer, 1, &all);
  VkMemoryBarrier to_host{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_TRANSFER_WRITE_BIT,
                          VK_ACCESS_HOST_READ_BIT};
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &to_host, 0, nullptr,
                       0, nullptr);
  return {};
}

quoin::Status draw_frame(const Program& program, const quoin::VulkanImage& image) {
  VkCommandPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr, 0, program.family};
  VkCommandPool pool = VK_NULL_HANDLE;
  require(vkCreateCommandPool(program.device, &pool_info, nullptr, &pool), "a command pool");
  VkCommandBufferAllocateInfo allocate_info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, pool,
                                            VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
  VkCommandBuffer commands = VK_NULL_HANDLE;
  require(vkAllocateCommandBuffers(program.device, &allocate_info, &commands), "a command buffer");
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  require(vkBeginCommandBuffer(commands, &begin), "commands");
  if (quoin::Status recorded = record(program, image, commands); !recorded) return recorded;
  require(vkEndCommandBuffer(commands), "commands");
  VkSubmitInfo submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands;
  require(vkQueueSubmit(program.queue, 1, &submit, VK_NULL_HANDLE), "submitting");
  require(vkQueueWaitIdle(program.queue), "waiting");
  return {};
}

quoin::Result<quoin::Scene> make_tower() {
  quoin::Scene scene;
  quoin::VoxelProperties properties;
  properties.name = "brick";
  properties.colour = {170, 90, 70, 255};
  const auto brick = scene.types.add(properties);
  if (!brick) return brick.error();
  quoin::SceneGrid tower;
  tower.grid.fill_sphere({0.0, 0.0, 0.0}, 9.0, *brick);
  tower.grid.fill_box({{-3, 0, -3}, {3, 21, 3}}, *brick);
  quoin::Instance placed;
  placed.grid = scene.add_grid(std::move(tower));
  scene.add_instance(placed);
  return scene;
}

quoin::Status run(const Program& program, const std::string& path) {
  quoin::BorrowedVulkanDevice lent;
  lent.instance = program.instance;
  lent.physical_device = program.physical;
  lent.device = program.device;
  lent.queue = program.queue;
  lent.queue_family = program.family;
  lent.get_instance_proc_addr = vkGetInstanceProcAddr;
  auto renderer = quoin::VulkanRenderer::create(lent);
  if (!renderer) return renderer.error();
  const auto scene = make_tower();
  if (!scene) return scene.error();
  if (quoin::Status updated = renderer->update(*scene); !updated) return updated;
  quoin::VulkanImage rendered(*renderer);
  quoin::RenderOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.samples = 4;
  const quoin::Camera camera = quoin::frame_scene(*scene, quoin::View::Iso, double{kWidth} / kHeight);
  quoin::Status done = renderer->draw(rendered, camera, options, quoin::Accumulation::Restart);
  if (done) done = draw_frame(program, rendered);
  if (!done) return done;
  quoin::Image image{kWidth, kHeight, {}};
  for (int i = 0; i < kWidth * kHeight; ++i) {
    image.rgb.insert(image.rgb.end(), program.pixels + 4 * i, program.pixels + 4 * i + 3);
  }
  const auto size = quoin::write_png(image, path);
  return size ? quoin::Status{} : size.error();
}

}  // namespace

int main(int argc, char** argv) {
  Program program;
  if (!make_instance(program) || !choose_device(program)) {
    std::fprintf(stderr, "own_device: no Vulkan device\n");
    return kNoDevice;
  }
  make_device(program);
  make_image(program);
  make_buffer(program);
  const char* const path = argc > 1 ? argv[1] : "own_device.png";
  const quoin::Status status = run(program, path);
  if (!status) {
    std::fprintf(stderr, "own_device: %s\n", quoin::to_string(status.error()).c_str());
    return 1;
  }
  std::printf("drew %s\n", path);
  return 0;
}
