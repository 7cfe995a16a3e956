#include "render/path_images.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <quoin/io/image_files.h>

#include "render/image_output.h"

namespace quoin::tool {
namespace {

using Type = ExrChannel::Type;

void add_colour(std::vector<ExrChannel>& channels, const std::string& prefix, const std::vector<Vec3>& of,
                const std::array<const char*, 3>& names, Type type, float scale = 1.0F) {
  for (int i = 0; i < 3; ++i) {
    ExrChannel channel{prefix + names[static_cast<std::size_t>(i)], type, {}, {}};
    channel.values.reserve(of.size());
    for (const Vec3& each : of) channel.values.push_back(each[i] * scale);
    channels.push_back(std::move(channel));
  }
}

// Writes light times the exposure, not clamped, and layers for compositing.
Result<std::uint64_t> write_layers(const PathImage& image, bool is_transparent, float exposure,
                                   const std::filesystem::path& path) {
  std::vector<ExrChannel> channels;
  add_colour(channels, "", is_transparent ? image.scene : image.radiance, {"R", "G", "B"}, Type::Float16, exposure);
  channels.push_back({"A", Type::Float16, image.alpha, {}});
  if (!is_transparent) channels.back().values.assign(image.alpha.size(), 1.0F);
  add_colour(channels, "albedo.", image.albedo, {"R", "G", "B"}, Type::Float16);
  add_colour(channels, "normal.", image.normal, {"X", "Y", "Z"}, Type::Float16);
  channels.push_back({"Z", Type::Float32, image.depth.values, {}});
  channels.push_back({"id.type", Type::Uint32, {}, {image.types.begin(), image.types.end()}});
  channels.push_back({"id.instance", Type::Uint32, {}, image.instances});
  return write_exr(image.width, image.height, channels, path);
}

DVec3 middle_of(const Scene& scene, InstanceFilter filter) {
  const DBox bounds = scene.bounds(filter);
  return bounds.empty() ? DVec3(0.0) : (bounds.min + bounds.max) * 0.5;
}

}  // namespace

PathImages::PathImages(const Scene& scene, InstanceFilter filter, Threads threads, PathPlan plan, bool with_layers)
    : plan_(std::move(plan)), with_layers_(with_layers), middle_(middle_of(scene, filter)) {
  tracer_.emplace(scene, filter, threads);
}

PathImages::PathImages(VulkanRenderer& device, const Scene& scene, InstanceFilter filter, PathPlan plan,
                       bool with_layers)
    : device_(&device), plan_(std::move(plan)), with_layers_(with_layers), middle_(middle_of(scene, filter)) {}

Result<RenderedImage> PathImages::render(const Camera& camera, const RenderOptions& options, Threads threads,
                                         const Progress& progress) {
  PathOptions& wanted = plan_.options;
  wanted.layers = with_layers_ || options.depth;
  wanted.denoise = plan_.denoise;
  const double to_middle = glm::dot(middle_ - camera.position, camera.forward);
  wanted.lens.focus_distance = plan_.focus.value_or(std::max(to_middle, 1e-3));
  auto taken = tracer_ ? tracer_->render(camera, wanted, threads, progress)
                       : device_->render_paths(camera, wanted, threads, progress);
  if (!taken) return taken.error();
  last_ = std::move(*taken);
  if (!exposure_)
    exposure_ = plan_.is_exposure_automatic ? find_exposure(last_, plan_.develop.tone) : plan_.develop.exposure;
  plan_.develop.exposure = *exposure_;
  auto image = develop(last_, plan_.develop);
  if (!image) return image.error();
  RenderedImage rendered;
  rendered.colour = std::move(*image);
  rendered.rays = last_.rays;
  rendered.pixels_hit = last_.pixels_hit;
  if (options.depth) rendered.depth = last_.depth;
  return rendered;
}

Result<std::uint64_t> PathImages::write(const std::filesystem::path& path) const {
  if (has_ending(path, ".exr")) {
    return write_layers(last_, plan_.is_transparent, static_cast<float>(exposure()), path);
  }
  const auto image = develop_with_alpha(last_, plan_.develop);
  if (!image) return image.error();
  return write_image_file(*image, path);
}

}  // namespace quoin::tool
