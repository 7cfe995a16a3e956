#include "render_vk/device/api.h"

#include <dlfcn.h>

namespace quoin::vulkan {
namespace {

// The loader stays loaded until the program ends: some drivers fail when they are unloaded.
PFN_vkGetInstanceProcAddr find_loader() {
  for (const char* name : {"libvulkan.so.1", "libvulkan.so"}) {
    void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) continue;
    if (void* entry = dlsym(library, "vkGetInstanceProcAddr")) {
      return reinterpret_cast<PFN_vkGetInstanceProcAddr>(entry);
    }
  }
  return nullptr;
}

PFN_vkGetInstanceProcAddr loader() {
  static const PFN_vkGetInstanceProcAddr entry = find_loader();
  return entry;
}

Error no_loader() {
  return make_error(ErrorCode::Unsupported, "vulkan: no Vulkan loader found (libvulkan.so.1, version 1.1 or newer)");
}

}  // namespace

Result<Api> Api::load() {
  Api api;
  api.vkGetInstanceProcAddr = loader();
  bool is_complete = api.vkGetInstanceProcAddr != nullptr;
#define QUOIN_VULKAN_LOAD(name)                                                                        \
  if (is_complete) api.name = reinterpret_cast<PFN_##name>(api.vkGetInstanceProcAddr(nullptr, #name)); \
  is_complete = is_complete && api.name != nullptr;
  QUOIN_VULKAN_OF_LOADER(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
  if (!is_complete) return no_loader();
  return api;
}

Result<Api> Api::find(PFN_vkGetInstanceProcAddr entry) {
  Api api;
  api.vkGetInstanceProcAddr = entry == nullptr ? loader() : entry;
  if (api.vkGetInstanceProcAddr == nullptr) return no_loader();
  return api;
}

const char* Api::load_instance(VkInstance instance) {
  const char* missing = nullptr;
#define QUOIN_VULKAN_LOAD(name)                                                \
  name = reinterpret_cast<PFN_##name>(vkGetInstanceProcAddr(instance, #name)); \
  if ((name) == nullptr && missing == nullptr) missing = #name;
  QUOIN_VULKAN_OF_INSTANCE(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
  return missing;
}

const char* Api::load_device(VkDevice device) {
  const char* missing = nullptr;
#define QUOIN_VULKAN_LOAD(name)                                            \
  name = reinterpret_cast<PFN_##name>(vkGetDeviceProcAddr(device, #name)); \
  if ((name) == nullptr && missing == nullptr) missing = #name;
  QUOIN_VULKAN_OF_DEVICE(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
  return missing;
}

}  // namespace quoin::vulkan
