// Prepares scenes for the browser's ray-marching shaders, which page/march.js runs.

#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include <quoin/render/light_options.h>

#include "bindings.h"
#include "handles.h"
#include "render/vulkan/march/shader_scene.h"

struct quoin_web_march {
  std::shared_ptr<quoin::c::SceneBody> scene;  // kept alive
  std::unique_ptr<quoin::vulkan::ShaderScene> shaders;
  std::vector<std::byte> frame;
};

using namespace quoin;
using namespace quoin::c;

namespace {

// Returns the shaders' flags: bit 0, transparent voxels; 1, fields; 2, transparent fields.
std::int32_t what_it_has(const vulkan::Placement& placement) {
  return (placement.has_transparent ? 1 : 0) | (placement.has_fields ? 2 : 0) | (placement.has_field_glass ? 4 : 0);
}

void show(std::span<const std::byte> bytes, const std::uint8_t** out, std::size_t* count) {
  *out = reinterpret_cast<const std::uint8_t*>(bytes.data());
  *count = bytes.size();
}

}  // namespace

quoin_status quoin_web_march_begin(quoin_scene scene, quoin_web_march** out) {
  return guarded([&] {
    auto body = handles().find<SceneBody>(scene);
    if (body == nullptr) return fail(QUOIN_BAD_HANDLE, "no scene has this handle");
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    if (body->loaded.scene.types.has_shapes())
      return fail(QUOIN_UNSUPPORTED, "the shaders draw shapes of voxel types as cubes");
    auto shaders = vulkan::ShaderScene::of(body->loaded.scene, InstanceFilter::Visible, natural_light(), {});
    if (!shaders) return fail(shaders.error());
    *out = new quoin_web_march{std::move(body), std::move(*shaders), {}};
    return QUOIN_OK;
  });
}

quoin_status quoin_web_march_data(const quoin_web_march* march, const std::uint8_t** data, std::size_t* bytes,
                                  std::int32_t* has) {
  return guarded([&] {
    if (march == nullptr || data == nullptr || bytes == nullptr || has == nullptr)
      return fail(QUOIN_INVALID_ARGUMENT, "march, data, bytes or has is null");
    show(march->shaders->bytes(), data, bytes);
    *has = what_it_has(march->shaders->placement());
    return QUOIN_OK;
  });
}

quoin_status quoin_web_march_frame(quoin_web_march* march, const quoin_render_options* options,
                                   const std::uint8_t** out, std::size_t* bytes) {
  return guarded([&] {
    const auto given = taken_or_default(options);
    if (march == nullptr || !given || out == nullptr || bytes == nullptr)
      return fail(QUOIN_INVALID_ARGUMENT, "march, out or bytes is null, or invalid size of the options");
    const auto taking = taking_of(march->scene->loaded.scene, *given);
    if (!taking) return fail(taking.error());
    auto frame = march->shaders->frame(taking->camera, taking->options);
    if (!frame) return fail(frame.error());
    march->frame = std::move(*frame);
    show(march->frame, out, bytes);
    return QUOIN_OK;
  });
}

quoin_status quoin_web_march_sample(std::int32_t sample, std::uint8_t* out, std::size_t bytes) {
  return guarded([&] {
    vulkan::ShaderPush push;
    if (sample < 0 || out == nullptr || bytes != sizeof push)
      return fail(QUOIN_INVALID_ARGUMENT, "the sample number is negative, or out is null or has the wrong size");
    vulkan::set_sample(sample, natural_light().occlusion_rays, push);
    std::memcpy(out, &push, sizeof push);
    return QUOIN_OK;
  });
}

void quoin_web_march_free(quoin_web_march* march) {
  delete march;
}
