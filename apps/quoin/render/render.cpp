#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/io/volume.h>
#include <quoin/render/vulkan_renderer.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/volume_scene.h>

#include "command_files.h"
#include "output.h"
#include "render/image_output.h"
#include "render/render_arguments.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

struct Outcome {
  RenderedImage image;          ///< the last image
  Camera camera;                ///< the camera of the last image
  std::optional<double> slice;  ///< position on the axis of a slice; nullopt: an image of `camera`
  FaceCounts faces;
  bool is_volume = false;
  std::uint64_t bytes = 0;
  std::vector<std::filesystem::path> files;  ///< all written files, OUT first
  double read = 0, build = 0, trace = 0, write = 0;
  std::string device;  ///< the Vulkan device; empty: rendered on the CPU
  std::vector<std::string> warnings;
  std::int64_t rays = 0;                      ///< of all images
  std::optional<double> exposure;             ///< of path-traced images
  std::int64_t kept = 0;                      ///< existing images that were kept
  std::vector<std::filesystem::path> images;  ///< all images in order

  void add(const WrittenFiles& written) {
    files.insert(files.end(), written.paths.begin(), written.paths.end());
    bytes += written.bytes;
  }
};

/// An image to render.
struct Shot {
  Camera camera;
  std::filesystem::path output;
};

/// Inserts a number into a file name, OUT.png to OUT-007.png, with as many digits as `last`, at least two.
std::filesystem::path numbered(const std::filesystem::path& output, int number, int last) {
  std::string digits = std::to_string(number);
  const std::size_t width = std::max<std::size_t>(std::to_string(last).size(), 2);
  digits.insert(0, width - std::min(width, digits.size()), '0');
  return output.parent_path() / (output.stem().string() + "-" + digits + output.extension().string());
}

/// Returns the names of the images to write. `cameras`: number of cameras of --path.
std::vector<std::filesystem::path> images_of(const RenderArguments& arguments, std::size_t cameras) {
  std::vector<std::filesystem::path> images;
  const int last = static_cast<int>(cameras) - 1;
  for (int i = 0; i <= last; ++i) images.push_back(numbered(arguments.output, i, last));
  if (cameras > 0) return images;
  if (arguments.frames) {
    const FrameRange& frames = *arguments.frames;
    for (int frame = frames.first; frame <= frames.last; ++frame)
      images.push_back(numbered(arguments.output, frame, frames.last));
  } else if (arguments.turns > 1) {
    for (int turn = 0; turn < arguments.turns; ++turn)
      images.push_back(numbered(arguments.output, turn, arguments.turns - 1));
  } else {
    images.push_back(arguments.output);
  }
  return images;
}

/// Returns true if --resume keeps this existing image. Existing images are complete. An automatic exposure needs the
/// first image, which is then rendered again.
bool is_kept(const RenderArguments& arguments, const std::filesystem::path& image, const Outcome& outcome) {
  if (!arguments.resume || (arguments.is_exposure_automatic && !outcome.exposure)) return false;
  std::error_code none;
  return std::filesystem::is_regular_file(image, none);
}

double aspect_of(const RenderArguments& arguments) {
  return static_cast<double>(arguments.render.width) / arguments.render.height;
}

Result<Camera> camera_of_file(const LoadedScene& loaded, int number) {
  std::string all;
  for (const FileCamera& each : loaded.cameras) {
    if (each.number == number) return each.camera;
    all += (all.empty() ? "" : ", ") + std::to_string(each.number);
  }
  return make_error(ErrorCode::InvalidArgument, "cannot use --camera file:" + std::to_string(number) +
                                                    ": the file has " +
                                                    (all.empty() ? "no saved cameras" : "cameras " + all));
}

Result<Camera> camera_for(const LoadedScene& loaded, const RenderArguments& arguments) {
  if (arguments.file_camera) return camera_of_file(loaded, *arguments.file_camera);
  if (loaded.camera && !arguments.has_view() && !arguments.position) return *loaded.camera;
  if (arguments.position) {
    return look_at(*arguments.position, *arguments.target, arguments.fov_degrees * std::numbers::pi / 180.0);
  }
  if (!arguments.azimuth && !arguments.elevation) {
    return frame_scene(loaded.scene, arguments.view.value_or(View::Iso), aspect_of(arguments),
                       arguments.common.instances());
  }
  SceneFraming framing(arguments.forward(), aspect_of(arguments));
  framing.add(loaded.scene, arguments.common.instances());
  return framing.camera();
}

void warn_of_empty_images(const Scene& scene, InstanceFilter filter, const RenderedImage& image,
                          std::vector<std::string>& warnings) {
  if (scene.bounds(filter).empty()) {
    warnings.emplace_back("nothing visible; the image shows only sky");
  } else if (image.pixels_hit == 0) {
    warnings.emplace_back("no voxel is in view of this camera; the image shows only sky");
  }
}

// Multiplies the emission of all types.
void scale_emission(Scene& scene, double scale) {
  for (std::size_t type = 1; scale != 1.0 && type < scene.types.size(); ++type) {
    VoxelProperties properties = scene.types[static_cast<VoxelType>(type)];
    if (!(properties.emission > 0.0F)) continue;
    properties.emission *= static_cast<float>(scale);
    scene.types.replace(static_cast<VoxelType>(type), std::move(properties));
  }
}

Result<LoadedScene> load(const RenderArguments& arguments, const OpenedInput& input, int frame) {
  LoadOptions options = arguments.common.load;
  options.frame = frame;
  options.keep_source = false;
  options.sky_image =
      arguments.light == LightChoice::Path && arguments.path.uses_file_look && !arguments.path.sky.has_value();
  ProgressBar bar;
  auto loaded = load_scene(input.file, options, arguments.common.threads, bar.listener("reading"));
  if (loaded && options.iso && !input.heeds_iso()) {
    return make_error(ErrorCode::InvalidArgument, "cannot use --iso: the input holds voxels, not a volume");
  }
  if (loaded) scale_emission(loaded->scene, arguments.emission_scale);
  return loaded;
}

// Returns the renderer if it is the path tracer, else null.
const PathImages* paths_of(const PathImages& renderer) {
  return &renderer;
}
template <class Renderer>
const PathImages* paths_of(const Renderer&) {
  return nullptr;
}

// Renders the images, writes them and adds the times to the outcome.
template <class Renderer>
Status take_images(Renderer& renderer, const RenderArguments& arguments, const RenderOptions& options,
                   const std::vector<Shot>& shots, Stopwatch& watch, Outcome& outcome) {
  outcome.build += watch.lap();
  ProgressBar bar;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (is_kept(arguments, shots[i].output, outcome)) {
      ++outcome.kept;
      continue;
    }
    const auto share = [&](double fraction) {
      return (static_cast<double>(i) + fraction) / static_cast<double>(shots.size());
    };
    const Progress listener = bar.listener("tracing");
    auto image = renderer.render(shots[i].camera, options, arguments.common.threads,
                                 [&](double fraction) { return listener(share(fraction)); });
    if (!image) return image.error();
    if constexpr (requires { renderer.exposure(); }) outcome.exposure = renderer.exposure();
    outcome.camera = shots[i].camera;
    outcome.image = std::move(*image);
    outcome.rays += outcome.image.rays;
    outcome.trace += watch.lap();
    const auto written = write_outputs(arguments, outcome.image, paths_of(renderer), shots[i].output);
    if (!written) return written.error();
    outcome.add(*written);
    outcome.write += watch.lap();
  }
  return {};
}

Status draw_by_cpu(const Scene& scene, const RenderArguments& arguments, const RenderOptions& options,
                   const std::vector<Shot>& shots, Stopwatch& watch, Outcome& outcome) {
  const CpuRenderer renderer(scene, arguments.common.instances(), arguments.common.threads);
  return take_images(renderer, arguments, options, shots, watch, outcome);
}

// Creates a Vulkan renderer and uploads the scene.
Result<VulkanRenderer> device_for(const Scene& scene, const RenderArguments& arguments, Outcome& outcome) {
  VulkanOptions vulkan;
  vulkan.device = arguments.device;
  auto renderer = VulkanRenderer::create(vulkan);
  if (!renderer) return renderer.error();
  outcome.device = renderer->device().name;
  if (auto updated = renderer->update(scene, arguments.common.instances(), arguments.common.threads); !updated) {
    return updated.error();
  }
  return renderer;
}

Status draw_by_paths(const LoadedScene& loaded, const RenderArguments& arguments, const RenderOptions& options,
                     const std::vector<Shot>& shots, Stopwatch& watch, Outcome& outcome) {
  const InstanceFilter filter = arguments.common.instances();
  auto plan = plan_paths(arguments, loaded);
  if (!plan) return plan.error();
  if (has_ending(arguments.output, ".jpg")) plan->is_transparent = false;  // it has no alpha
  for (std::string& warning : plan->warnings) {
    if (std::ranges::find(outcome.warnings, warning) == outcome.warnings.end()) {
      outcome.warnings.push_back(std::move(warning));
    }
  }
  const bool with_layers = has_ending(arguments.output, ".exr");
  const auto take = [&](PathImages images) {
    images.set_exposure(outcome.exposure);
    return take_images(images, arguments, options, shots, watch, outcome);
  };
  if (arguments.backend == Backend::Cpu) {
    return take(PathImages(loaded.scene, filter, arguments.common.threads, std::move(*plan), with_layers));
  }
  auto renderer = device_for(loaded.scene, arguments, outcome);
  if (!renderer) return renderer.error();
  return take(PathImages(*renderer, loaded.scene, filter, std::move(*plan), with_layers));
}

Status draw_by_vulkan(const Scene& scene, const RenderArguments& arguments, const RenderOptions& options,
                      const std::vector<Shot>& shots, Stopwatch& watch, Outcome& outcome) {
  auto renderer = device_for(scene, arguments, outcome);
  if (!renderer) return renderer.error();
  return take_images(*renderer, arguments, options, shots, watch, outcome);
}

Status draw_shots(const LoadedScene& loaded, const RenderArguments& arguments, const std::vector<Shot>& shots,
                  Stopwatch& watch, Outcome& outcome) {
  RenderOptions options = arguments.render;
  options.environment = loaded.scene.environment.value_or(Environment::natural());
  arguments.environment.apply_to(*options.environment);
  const bool is_vulkan = arguments.backend == Backend::Vulkan;
  if (arguments.light == LightChoice::Path) return draw_by_paths(loaded, arguments, options, shots, watch, outcome);
  return (is_vulkan ? draw_by_vulkan : draw_by_cpu)(loaded.scene, arguments, options, shots, watch, outcome);
}

/// Renders one image, or a turntable around the scene.
Status draw_view(const LoadedScene& loaded, const RenderArguments& arguments, Stopwatch& watch, Outcome& outcome) {
  std::vector<Shot> shots;
  if (arguments.turns > 1) {
    SceneFraming framing(arguments.forward(), aspect_of(arguments), arguments.turns);
    framing.add(loaded.scene, arguments.common.instances());
    const std::vector<std::filesystem::path> images = images_of(arguments, 0);
    for (int turn = 0; turn < arguments.turns; ++turn) {
      shots.push_back({framing.camera(turn), images[static_cast<std::size_t>(turn)]});
    }
  } else {
    const auto camera = camera_for(loaded, arguments);
    if (!camera) return camera.error();
    shots.push_back({*camera, arguments.output});
  }
  return draw_shots(loaded, arguments, shots, watch, outcome);
}

/// Renders an image for each camera.
Status draw_path(const LoadedScene& loaded, const std::vector<Camera>& cameras, const RenderArguments& arguments,
                 Stopwatch& watch, Outcome& outcome) {
  const std::vector<std::filesystem::path> images = images_of(arguments, cameras.size());
  std::vector<Shot> shots;
  for (std::size_t i = 0; i < cameras.size(); ++i) shots.push_back({cameras[i], images[i]});
  return draw_shots(loaded, arguments, shots, watch, outcome);
}

/// Renders all frames with one framing that fits the whole animation. `first` holds the first frame.
Status draw_frames(const LoadedScene& first, const OpenedInput& input, const RenderArguments& arguments,
                   Stopwatch& watch, Outcome& outcome) {
  const FrameRange& frames = *arguments.frames;
  const InstanceFilter filter = arguments.common.instances();
  const bool has_camera = arguments.position || arguments.file_camera || (first.camera && !arguments.has_view());
  SceneFraming framing(arguments.forward(), aspect_of(arguments));
  framing.add(first.scene, filter);
  // Start with the last frame: if it does not exist, fail before rendering.
  for (int frame = frames.last; frame > frames.first && (!has_camera || frame == frames.last); --frame) {
    const auto loaded = load(arguments, input, frame);
    if (!loaded) return loaded.error();
    framing.add(loaded->scene, filter);
  }
  Result<Camera> camera = has_camera ? camera_for(first, arguments) : framing.camera();
  if (!camera) return camera.error();
  const std::vector<std::filesystem::path> images = images_of(arguments, 0);
  for (int frame = frames.first; frame <= frames.last; ++frame) {
    const bool is_first = frame == frames.first;
    if (is_kept(arguments, images[static_cast<std::size_t>(frame - frames.first)], outcome)) {
      ++outcome.kept;
      continue;
    }
    const auto later = is_first ? Result<LoadedScene>(LoadedScene{}) : load(arguments, input, frame);
    if (!later) return later.error();
    outcome.read += watch.lap();
    const std::vector<Shot> shots = {{*camera, images[static_cast<std::size_t>(frame - frames.first)]}};
    if (auto drawn = draw_shots(is_first ? first : *later, arguments, shots, watch, outcome); !drawn) return drawn;
  }
  return {};
}

Status draw_slice(const Scene& scene, const RenderArguments& arguments, Stopwatch& watch, Outcome& outcome) {
  auto slice = draw_density_slice(scene, arguments.slice, arguments.common.threads);
  if (!slice) return slice.error();
  outcome.slice = slice->position;
  outcome.image.colour = std::move(slice->colour);
  outcome.image.pixels_hit = slice->pixels_solid;
  outcome.trace = watch.lap();
  const auto written = write_outputs(arguments, outcome.image, nullptr, arguments.output);
  if (!written) return written.error();
  outcome.add(*written);
  outcome.write = watch.lap();
  return {};
}

/// Returns the cameras of --path; empty without it.
Result<std::vector<Camera>> cameras_of_path(const RenderArguments& arguments) {
  return arguments.camera_path.empty() ? std::vector<Camera>() : read_camera_path(arguments.camera_path);
}

/// Checks that all images can be written, before the work starts, and lists them in `outcome`.
Status check_images(const RenderArguments& arguments, std::size_t cameras, Outcome& outcome) {
  outcome.images = images_of(arguments, cameras);
  std::vector<std::filesystem::path> outputs = outcome.images;
  outputs.push_back(arguments.depth);
  return check_outputs(outputs);
}

void warn_of_content(const Scene& scene, const RenderArguments& arguments, Outcome& outcome) {
  const InstanceFilter filter = arguments.common.instances();
  if (arguments.frames) std::erase_if(outcome.warnings, [](const auto& each) { return each.starts_with("animated"); });
  warn_of_left_out(scene, filter, outcome.warnings);
  if (arguments.render.light.model == LightModel::Propagated && !scene.lamps.empty()) {
    outcome.warnings.push_back("--light propagated supports no lamps; lamps left out: " +
                               std::to_string(scene.lamps.size()));
  }
  if (!outcome.slice && !outcome.files.empty()) warn_of_empty_images(scene, filter, outcome.image, outcome.warnings);
}

Result<Outcome> render(const RenderArguments& arguments) {
  Stopwatch watch;
  Outcome outcome;
  const auto cameras = cameras_of_path(arguments);
  if (!cameras) return cameras.error();
  if (Status writable = check_images(arguments, cameras->size(), outcome); !writable) return writable.error();
  const auto input = open_input(arguments.common.input, arguments.common.load);
  if (!input) return input.error();
  outcome.is_volume = input->is_volume;
  if (input->is_volume && arguments.frames) {
    return make_error(ErrorCode::InvalidArgument, "cannot use --frames: the input is a volume, not voxels");
  }
  auto loaded = load(arguments, *input, arguments.frames ? arguments.frames->first : arguments.common.load.frame);
  if (!loaded) return loaded.error();
  outcome.warnings = std::move(loaded->warnings);
  outcome.read = watch.lap();
  catch_interrupts();
  outcome.faces = count_faces(loaded->scene, arguments.common.instances(), arguments.common.threads);
  const Status drawn = arguments.preset == Preset::Density ? draw_slice(loaded->scene, arguments, watch, outcome)
                       : !cameras->empty()                 ? draw_path(*loaded, *cameras, arguments, watch, outcome)
                       : arguments.frames                  ? draw_frames(*loaded, *input, arguments, watch, outcome)
                                                           : draw_view(*loaded, arguments, watch, outcome);
  if (!drawn) return drawn.error();
  warn_of_content(loaded->scene, arguments, outcome);
  return outcome;
}

Json camera_json(const Camera& camera) {
  Json json = {{"position", list_of(camera.position)},
               {"forward", list_of(camera.forward)},
               {"up", list_of(camera.up)},
               {"fov", std::round(camera.vertical_fov_radians * 180e9 / std::numbers::pi) / 1e9}};
  if (camera.projection == Camera::Projection::Orthographic) json["view_height"] = camera.view_height;
  return json;
}

Json outcome_json(const RenderArguments& arguments, const Outcome& outcome) {
  Json files = Json::array();
  for (const auto& file : outcome.files) files.push_back(file.string());
  Json json = {{"size", {arguments.render.width, arguments.render.height}},
               {"rays", outcome.rays},
               {"pixels_hit", outcome.image.pixels_hit},
               {"faces_visible", outcome.is_volume ? Json() : Json(outcome.faces.visible)},
               {"faces_total", outcome.is_volume ? Json() : Json(outcome.faces.total)},
               {"backend", arguments.backend == Backend::Vulkan ? "vulkan" : "cpu"},
               {"threads", thread_count(arguments.common.threads)},
               {"camera", outcome.slice || outcome.files.empty() ? Json() : camera_json(outcome.camera)},
               {"bytes", outcome.bytes},
               {"files", files},
               {"seconds",
                {{"read", outcome.read}, {"build", outcome.build}, {"trace", outcome.trace}, {"write", outcome.write}}},
               {"warnings", outcome.warnings}};
  if (!outcome.device.empty()) json["device"] = outcome.device;
  if (arguments.resume) json["kept"] = outcome.kept;
  if (outcome.exposure) json["exposure"] = *outcome.exposure;
  if (outcome.slice) json["slice"] = {{"axis", std::string(1, "xyz"[arguments.slice.axis])}, {"at", *outcome.slice}};
  return json;
}

std::string outcome_text(const Outcome& outcome) {
  std::string kept = outcome.kept == 0 ? "" : "Existing images kept: " + std::to_string(outcome.kept) + "\n";
  if (outcome.files.empty()) return kept;
  const RenderedImage& image = outcome.image;
  const double per_second = static_cast<double>(outcome.rays) / std::max(outcome.trace, 1e-9);
  std::string text = "Image: " + std::to_string(image.colour.width) + " x " + std::to_string(image.colour.height) +
                     ", " + with_thousands(image.pixels_hit) +
                     (outcome.slice       ? " pixels are solid\n"
                      : outcome.is_volume ? " pixels show the surface\n"
                                          : " pixels show voxels\n");
  if (!outcome.is_volume && !outcome.slice) text += to_string(outcome.faces) + "\n";
  if (!outcome.slice)
    text += "Rays: " + with_thousands(outcome.rays) + " in " + number_for_people(outcome.trace) + " s, " +
            with_thousands(std::llround(per_second)) + " per second\n";
  if (!outcome.device.empty()) text += "Rendered by " + outcome.device + "\n";
  text += "Wrote ";
  constexpr std::size_t kNamed = 3;
  if (outcome.files.size() > kNamed) {
    text += std::to_string(outcome.files.size()) + " images, " + outcome.files.front().string() + " to " +
            outcome.files.back().string() + ", ";
  } else {
    for (const auto& file : outcome.files) text += file.string() + ", ";
  }
  const double seconds = outcome.read + outcome.build + outcome.trace + outcome.write;
  return kept + text + bytes_for_people(outcome.bytes) + " in " + number_for_people(seconds) + " s\n";
}

/// Renders the images of a video and encodes them with ffmpeg.
Result<Outcome> render_video(const RenderArguments& arguments) {
  if (auto writable = check_outputs({arguments.output}); !writable) return writable.error();
  const Video video(arguments.output);
  if (Status begun = video.begin(arguments.resume); !begun) return begun.error();
  RenderArguments of_images = arguments;
  of_images.output = video.image();
  auto outcome = render(of_images);
  if (!outcome) return outcome.error();
  Stopwatch watch;
  const auto bytes = video.write(outcome->images, arguments.frames_per_second);
  if (!bytes) return bytes.error();
  outcome->write += watch.lap();
  outcome->bytes = *bytes;
  outcome->files = {arguments.output};
  return outcome;
}

/// Renders an image or a video. Reads standard input if IN is "-".
Result<Outcome> render_from(RenderArguments& arguments, StandardStreams& streams) {
  if (Status read = streams.take_input(arguments.common.input); !read) return read.error();
  return is_video(arguments.output) ? render_video(arguments) : render(arguments);
}

WatchedWork run_render(RenderArguments& arguments) {
  StandardStreams streams;
  WatchedWork work;
  const SidecarFiles allowed = arguments.common.load.sidecar_files;
  if (arguments.watch) work.read = files_read(arguments.common.input, allowed);
  const auto outcome = render_from(arguments, streams);
  if (!outcome) {
    const Error error = streams.named(outcome.error());
    streams.remove();
    die_if_interrupted();
    print_error(error);
    work.status = kFailed;
    return work;
  }
  work.written = outcome->files;
  if (arguments.common.json) {
    work.status = print_json(outcome_json(arguments, *outcome));
  } else {
    print_warnings(outcome->warnings);
    work.status = print_summary(outcome_text(*outcome));
  }
  return work;
}

}  // namespace

void add_render_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("render", "Render an image with sun, shadows and ambient occlusion");
  const auto arguments = std::make_shared<RenderArguments>();
  add_render_options(*command, *arguments);
  command->footer(readable_files() +
                  "Positions are in world units, +Y up, as printed by quoin info.\n"
                  "Example: quoin render castle.vox -o castle.png --view iso --samples 16\n"
                  "Example: quoin render castle.vox -o gate.png --camera 30,60,160 --look-at 0,30,0 --fov 40\n"
                  "Example: quoin render castle.vox -o round.png --turntable 36 --elevation 20\n"
                  "Example: quoin render walk.vox -o walk.png --frames 0:24 --view left\n"
                  "Example: quoin render castle.vox -o round.mp4 --turntable 240 --fps 24\n"
                  "Example: quoin render castle.vox -o film.png --path cameras.json --light path --resume\n"
                  "Example: quoin render castle.vox -o night.png --light path --sun off --tone aces --exposure auto\n"
                  "Example: quoin render scan.nii.gz -o hollows.png --preset ao --ao smooth --ao-form weighted\n"
                  "Example: quoin render scan.nii.gz -o cut.png --preset density --slice z:0.5\n"
                  "Example: quoin render scan.raw -o scan.png --raw-size 256x256x128 --raw-type uint16 --iso 1200");
  command->callback([command, arguments, &status] {
    if (const Status fits = settle(*command, *arguments); !fits) {
      status = wrong_usage(fits.error());
      return;
    }
    const auto work = [&] { return run_render(*arguments); };
    const CommonOptions& common = arguments->common;
    status = arguments->watch ? watch(files_read(common.input, common.load.sidecar_files), work) : work().status;
  });
}

}  // namespace quoin::tool
