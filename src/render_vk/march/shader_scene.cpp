#include "render_vk/march/shader_scene.h"

#include <cstring>

#include "render/image_request.h"
#include "render_vk/march/frame.h"

namespace quoin::vulkan {
namespace {

constexpr std::size_t kVector = sizeof(Vec4);

// Appends a table at a multiple of a vector's size. Returns its offset.
template <class T>
std::uint64_t add_table(const std::vector<T>& values, std::vector<std::byte>& out) {
  const std::size_t begin = (out.size() + kVector - 1) / kVector * kVector;
  const auto bytes = std::as_bytes(std::span(values));
  out.resize(begin);
  out.insert(out.end(), bytes.begin(), bytes.end());
  return begin;
}

}  // namespace

Result<std::unique_ptr<ShaderScene>> ShaderScene::of(const Scene& scene, InstanceFilter filter,
                                                     const LightOptions& light, Threads threads) {
  std::unique_ptr<ShaderScene> made(new ShaderScene);
  if (Status done = made->scene_.update(scene, filter, threads); !done) return done.error();
  auto lamps = made->lamp_cache_.table(scene, light, threads, [&] { return made->scene_.lamp_places(scene); });
  if (Status done = made->lamps_.put(made->memory_, std::move(lamps)); !done) return done.error();
  return made;
}

Result<std::vector<std::byte>> ShaderScene::frame(const Camera& camera, const RenderOptions& options) const {
  if (Status right = check(camera, options); !right) return right.error();
  FrameData data = make_frame(placement(), camera, options);
  put_scene(scene_, placement(), data);
  std::vector<ShaderLamp> lamps;
  if (lamps_.table != nullptr) lamps = put_lamps(lamps_, camera, data);
  ShaderFrame& frame = data.frame;
  std::vector<std::byte> out(sizeof frame);
  frame.placed = add_table(data.placed, out);
  frame.tree = add_table(data.tree, out);
  frame.leaves = add_table(data.leaves, out);
  frame.directions = add_table(data.directions, out);
  frame.turns = add_table(data.turns, out);
  frame.lamps = add_table(lamps, out);
  frame.thresholds = add_table(srgb_thresholds(), out);
  std::memcpy(out.data(), &frame, sizeof frame);
  return out;
}

}  // namespace quoin::vulkan
