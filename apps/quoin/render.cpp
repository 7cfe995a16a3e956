#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <quoin/io/formats.h>
#include <quoin/io/picture_files.h>
#include <quoin/io/volume.h>
#include <quoin/render_vk/vulkan_renderer.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/volume_scene.h>

#include "interrupt.h"
#include "output.h"
#include "output_files.h"
#include "progress_bar.h"
#include "render_arguments.h"
#include "scene_warnings.h"
#include "stopwatch.h"
#include "volume_info.h"

namespace quoin::tool {

namespace {

struct Outcome {
  Picture picture;
  Camera camera;
  std::optional<double> slice;  ///< where it lies on its axis, instead of a camera
  FaceCounts faces;
  bool is_volume = false;
  std::uint64_t bytes = 0;
  std::vector<std::filesystem::path> files;  ///< all that were written, OUT first
  double read = 0, build = 0, trace = 0, write = 0;
  std::string device;  ///< that drew; empty: the processor
  std::vector<std::string> warnings;
};

Result<Camera> camera_for(const LoadedScene& loaded, const RenderArguments& arguments) {
  if (loaded.camera && !arguments.has_view && !arguments.position) return *loaded.camera;
  if (arguments.position) {
    return look_at(*arguments.position, *arguments.target, arguments.fov_degrees * std::numbers::pi / 180.0);
  }
  const double aspect = static_cast<double>(arguments.render.width) / arguments.render.height;
  return frame_scene(loaded.scene, arguments.view, aspect, arguments.common.instances());
}

void warn_of_empty_pictures(const Scene& scene, InstanceFilter filter, const Picture& picture,
                            std::vector<std::string>& warnings) {
  if (scene.bounds(filter).empty()) {
    warnings.emplace_back("nothing to draw: a picture of the sky");
  } else if (picture.pixels_hit == 0) {
    warnings.emplace_back("no voxel in sight of this camera: a picture of the sky");
  }
}

Status write_outputs(const RenderArguments& arguments, Outcome& outcome) {
  if (was_interrupted()) return make_error(ErrorCode::Cancelled, "cancelled", arguments.output.string());
  const auto png = write_png(outcome.picture.colour, arguments.output);
  if (!png) return png.error();
  outcome.files.push_back(arguments.output);
  outcome.bytes = *png;
  if (arguments.depth.empty()) return {};
  if (was_interrupted()) return make_error(ErrorCode::Cancelled, "cancelled", arguments.depth.string());
  const auto pfm = write_pfm(outcome.picture.depth, arguments.depth);
  if (!pfm) return pfm.error();
  outcome.files.push_back(arguments.depth);
  outcome.bytes += *pfm;
  return {};
}

Result<LoadedScene> load(const RenderArguments& arguments, bool is_volume) {
  LoadOptions options = arguments.common.load;
  options.keep_source = false;
  options.threads = arguments.common.threads;
  if (arguments.iso) options.iso = static_cast<float>(*arguments.iso);
  ProgressBar bar;
  auto loaded = load_scene(arguments.common.input, options, bar.listener("reading"));
  if (loaded && arguments.iso && !is_volume) {
    return make_error(ErrorCode::InvalidArgument, "--iso is for volumes, and the input holds voxels");
  }
  return loaded;
}

// Takes the picture and puts it, with its times, into the outcome.
template <class Renderer>
Status take_picture(Renderer& renderer, const RenderOptions& options, Stopwatch& watch, Outcome& outcome) {
  outcome.build = watch.lap();
  ProgressBar bar;
  auto picture = renderer.render(outcome.camera, options, bar.listener("tracing"));
  if (!picture) return picture.error();
  outcome.picture = std::move(*picture);
  outcome.trace = watch.lap();
  return {};
}

Status draw_by_cpu(const Scene& scene, const RenderArguments& arguments, const RenderOptions& options, Stopwatch& watch,
                   Outcome& outcome) {
  const CpuRenderer renderer(scene, arguments.common.instances(), arguments.common.threads);
  return take_picture(renderer, options, watch, outcome);
}

Status draw_by_vulkan(const Scene& scene, const RenderArguments& arguments, const RenderOptions& options,
                      Stopwatch& watch, Outcome& outcome) {
  VulkanOptions vulkan;
  vulkan.device = arguments.device;
  auto renderer = VulkanRenderer::create(vulkan);
  if (!renderer) return renderer.error();
  outcome.device = renderer->device().name;
  if (auto updated = renderer->update(scene, arguments.common.instances(), arguments.common.threads); !updated) {
    return updated;
  }
  return take_picture(*renderer, options, watch, outcome);
}

/// Draws what the camera sees.
Status draw_view(const LoadedScene& loaded, const RenderArguments& arguments, Stopwatch& watch, Outcome& outcome) {
  const auto camera = camera_for(loaded, arguments);
  if (!camera) return camera.error();
  outcome.camera = *camera;
  RenderOptions options = arguments.render;
  if (loaded.sun && !arguments.has_sun) options.light.sun = *loaded.sun;
  const bool is_vulkan = arguments.backend == "vulkan";
  return (is_vulkan ? draw_by_vulkan : draw_by_cpu)(loaded.scene, arguments, options, watch, outcome);
}

Status draw_slice(const Scene& scene, const RenderArguments& arguments, Stopwatch& watch, Outcome& outcome) {
  auto slice = draw_density_slice(scene, arguments.slice);
  if (!slice) return slice.error();
  outcome.slice = slice->place;
  outcome.picture.colour = std::move(slice->colour);
  outcome.picture.pixels_hit = slice->pixels_solid;
  outcome.trace = watch.lap();
  return {};
}

Result<Outcome> render(const RenderArguments& arguments) {
  const InstanceFilter filter = arguments.common.instances();
  Stopwatch watch;
  if (auto writable = check_outputs({arguments.output, arguments.depth}); !writable) return writable.error();
  const bool is_volume = holds_volume(arguments.common.input);
  auto loaded = load(arguments, is_volume);
  if (!loaded) return loaded.error();
  const Scene& scene = loaded->scene;
  Outcome outcome;
  outcome.warnings = std::move(loaded->warnings);
  outcome.read = watch.lap();
  outcome.is_volume = is_volume;
  catch_interrupts();
  outcome.faces = count_faces(scene, filter, arguments.common.threads);
  const bool is_slice = arguments.preset == "density";
  Status drawn =
      is_slice ? draw_slice(scene, arguments, watch, outcome) : draw_view(*loaded, arguments, watch, outcome);
  if (!drawn) return drawn.error();
  warn_of_left_out(scene, filter, outcome.warnings);
  if (!is_slice) warn_of_empty_pictures(scene, filter, outcome.picture, outcome.warnings);
  if (auto written = write_outputs(arguments, outcome); !written) return written.error();
  outcome.write = watch.lap();
  return outcome;
}

Json triple(DVec3 v) {
  return {v.x + 0.0, v.y + 0.0, v.z + 0.0};
}

Json camera_json(const Camera& camera) {
  return {{"position", triple(camera.position)},
          {"forward", triple(camera.forward)},
          {"up", triple(camera.up)},
          {"fov", std::round(camera.vertical_fov * 180e9 / std::numbers::pi) / 1e9}};
}

Json outcome_json(const RenderArguments& arguments, const Outcome& outcome) {
  Json files = Json::array();
  for (const auto& file : outcome.files) files.push_back(file.string());
  Json json = {{"size", {outcome.picture.colour.width, outcome.picture.colour.height}},
               {"rays", outcome.picture.rays},
               {"pixels_hit", outcome.picture.pixels_hit},
               {"faces_visible", outcome.is_volume ? Json() : Json(outcome.faces.visible)},
               {"faces_total", outcome.is_volume ? Json() : Json(outcome.faces.total)},
               {"backend", arguments.backend},
               {"threads", thread_count(arguments.common.threads)},
               {"camera", outcome.slice ? Json() : camera_json(outcome.camera)},
               {"bytes", outcome.bytes},
               {"files", files},
               {"seconds",
                {{"read", outcome.read}, {"build", outcome.build}, {"trace", outcome.trace}, {"write", outcome.write}}},
               {"warnings", outcome.warnings}};
  if (!outcome.device.empty()) json["device"] = outcome.device;
  if (outcome.slice) json["slice"] = {{"axis", std::string(1, "xyz"[arguments.slice.axis])}, {"at", *outcome.slice}};
  return json;
}

std::string outcome_text(const Outcome& outcome) {
  const Picture& picture = outcome.picture;
  const double per_second = static_cast<double>(picture.rays) / std::max(outcome.trace, 1e-9);
  std::string text = "Picture: " + std::to_string(picture.colour.width) + " x " +
                     std::to_string(picture.colour.height) + ", " + with_thousands(picture.pixels_hit) +
                     (outcome.slice       ? " pixels lie in the solid\n"
                      : outcome.is_volume ? " pixels show its surface\n"
                                          : " pixels show voxels\n");
  if (!outcome.is_volume && !outcome.slice) text += to_string(outcome.faces) + "\n";
  if (!outcome.slice)
    text += "Rays: " + with_thousands(picture.rays) + " in " + number_for_people(outcome.trace) + " s, " +
            with_thousands(std::llround(per_second)) + " a second\n";
  if (!outcome.device.empty()) text += "Drawn by " + outcome.device + "\n";
  text += "Wrote ";
  for (const auto& file : outcome.files) text += file.string() + ", ";
  const double seconds = outcome.read + outcome.build + outcome.trace + outcome.write;
  return text + bytes_for_people(outcome.bytes) + " in " + number_for_people(seconds) + " s\n";
}

int run_render(const RenderArguments& arguments) {
  const auto outcome = render(arguments);
  if (!outcome) {
    die_if_interrupted();
    print_error(outcome.error());
    return kFailed;
  }
  if (arguments.common.json) return print_json(outcome_json(arguments, *outcome));
  print_warnings(outcome->warnings);
  return print_summary(outcome_text(*outcome));
}

}  // namespace

void add_render_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("render", "Draw a picture, with sun, shadows and ambient occlusion");
  const auto arguments = std::make_shared<RenderArguments>();
  add_render_options(*command, *arguments);
  command->footer("Reads " + readable_extensions() +
                  ". Positions are in world units, +Y up, as `quoin info` gives them.\n"
                  "Example: quoin render castle.vox -o castle.png --view iso --samples 16\n"
                  "Example: quoin render castle.vox -o gate.png --camera 30,60,160 --look-at 0,30,0 --fov 40\n"
                  "Example: quoin render scan.nii.gz -o hollows.png --preset ao --ao smooth --ao-form weighted\n"
                  "Example: quoin render scan.nii.gz -o cut.png --preset density --slice z:0.5");
  command->callback([command, arguments, &status] {
    if (const std::string fault = settle(*command, *arguments); !fault.empty()) {
      print_error(fault + " (try --help)");
      status = kWrongUsage;
      return;
    }
    status = run_render(*arguments);
  });
}

}  // namespace quoin::tool
