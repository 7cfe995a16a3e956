#include "render_vk/device/api.h"

#include <dlfcn.h>

namespace quoin::vulkan {
namespace {

// Stays loaded until the program ends: drivers do not like to be unloaded.
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

}  // namespace

Result<Api> Api::load() {
  static const PFN_vkGetInstanceProcAddr entry = find_loader();
  Api api;
  api.vkGetInstanceProcAddr = entry;
  bool is_complete = entry != nullptr;
#define QUOIN_VULKAN_LOAD(name)                                                                        \
  if (is_complete) api.name = reinterpret_cast<PFN_##name>(api.vkGetInstanceProcAddr(nullptr, #name)); \
  is_complete = is_complete && api.name != nullptr;
  QUOIN_VULKAN_OF_LOADER(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
  if (!is_complete) {
    return fail(ErrorCode::Unsupported, "vulkan: there is no loader (libvulkan.so.1) of version 1.1 or newer here");
  }
  return api;
}

void Api::load_instance(VkInstance instance) {
#define QUOIN_VULKAN_LOAD(name) name = reinterpret_cast<PFN_##name>(vkGetInstanceProcAddr(instance, #name));
  QUOIN_VULKAN_OF_INSTANCE(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
}

void Api::load_device(VkDevice device) {
#define QUOIN_VULKAN_LOAD(name) name = reinterpret_cast<PFN_##name>(vkGetDeviceProcAddr(device, #name));
  QUOIN_VULKAN_OF_DEVICE(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
}

}  // namespace quoin::vulkan
