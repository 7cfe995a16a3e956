#include <cstdio>
#include <cstdlib>
#include <memory>

#include <quoin/io/formats.h>

#include "command_files.h"
#include "commands.h"
#include "options.h"
#include "output.h"
#include "run_control.h"
#ifdef QUOIN_HAVE_VIEWER
#include "viewer/window/viewer.h"
#endif

namespace quoin::tool {

namespace {

struct ViewArguments {
  std::filesystem::path input;
  LoadOptions load;
  bool has_packs = false;
  Threads threads;
  ImageSize size;
  std::filesystem::path screenshot;
  bool is_bare = false;
  std::string backend = "auto";
  std::string drawn;
  std::string light;
  std::string device;
  std::size_t memory_mebibytes = 0;
  double distance = 0.0;
};

#ifdef QUOIN_HAVE_VIEWER

/// Fails before a window opens if the file format is unknown.
Status check_input(const ViewArguments& arguments) {
  if (arguments.input.empty()) return {};
  const auto input = open_input(arguments.input, arguments.load);
  if (!input) return input.error();
  if (input->file.format || input->is_volume) return {};
  return make_error(ErrorCode::Unsupported,
                    "unknown format; supported formats are " + extensions_with(FormatCapability::Read),
                    arguments.input.string());
}

int run_view(const ViewArguments& arguments) {
  viewer::ViewerOptions options;
  options.file = arguments.input;
  options.load = arguments.load;
  options.uses_own_packs = arguments.has_packs;
  options.threads = arguments.threads;
  options.width = arguments.size.width;
  options.height = arguments.size.height;
  options.is_bare = arguments.is_bare;
  options.screenshot = arguments.screenshot;
  options.device = arguments.device;
  options.world.memory_bytes = arguments.memory_mebibytes << 20;
  options.world.distance = arguments.distance;
  options.leave_at_once = [] {
    die_if_interrupted();
    std::fflush(nullptr);
    std::_Exit(kDone);
  };
  if (arguments.drawn == "rays") options.mode = viewer::DrawMode::Rays;
  if (arguments.drawn == "blocks") options.mode = viewer::DrawMode::Blocks;
  if (arguments.drawn == "smooth") options.mode = viewer::DrawMode::Smooth;
  if (arguments.drawn == "density") options.mode = viewer::DrawMode::Density;
  if (arguments.drawn == "paths") options.mode = viewer::DrawMode::Paths;
  if (arguments.light == "rays") options.light = LightModel::Rays;
  if (arguments.light == "propagated") options.light = LightModel::Propagated;
  if (arguments.backend == "cpu") options.backend = viewer::ViewerBackend::Processor;
  if (arguments.backend == "vulkan") options.backend = viewer::ViewerBackend::Vulkan;
  Status status = check_input(arguments);
  if (status) status = check_outputs({arguments.screenshot});
  if (status) {
    catch_interrupts();
    status = viewer::run_viewer(options, was_interrupted);
  }
  die_if_interrupted();
  if (status) return kDone;
  print_error(status.error());
  return kFailed;
}

#else

int run_view(const ViewArguments&) {
  print_error("cannot open a window: this build has no viewer; it needs the packages " QUOIN_VIEWER_MISSING
              " (`quoin render` works without them)");
  return kFailed;
}

#endif

std::optional<ImageSize> read_size(const std::string& text) {
  constexpr ImageSize kSmallest{320, 240};
  constexpr int kLongestSide = 16'384;
  const auto size = parse_size(text);
  const bool fits = size && size->width >= kSmallest.width && size->height >= kSmallest.height &&
                    size->width <= kLongestSide && size->height <= kLongestSide;
  return fits ? size : std::nullopt;
}

std::vector<OptionRule> view_rules(const ViewArguments& arguments) {
  const auto has_file = [&arguments] { return !arguments.input.empty(); };
  std::vector<OptionRule> rules = raw_rules();
  rules.push_back({{"--raw-size", "--screenshot"}, needs("a file to show", has_file)});
  rules.push_back({{"--screenshot"}, [&arguments](const CLI::App&) {
                     const std::filesystem::path& image = arguments.screenshot;
                     return image.extension() == ".png"
                                ? ""
                                : ": the image name must end in .png, not \"" + image.string() + "\"";
                   }});
  return rules;
}

}  // namespace

void add_view_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("view", "Open a file in a window to fly through it and edit it");
  const auto arguments = std::make_shared<ViewArguments>();
  command->add_option("IN", arguments->input, "File to open (default: an empty window; drop files on it)")
      ->check(file_name());
  set_heading(*command, heading::kInput);
  command->add_flag("--hidden", arguments->load.show_hidden, "Include hidden layers and nodes");
  add_dimension_option(*command, arguments->load);
  add_pack_option(*command, arguments->load, PlainBlocks::OwnPack);
  add_outside_files_option(*command, arguments->load);
  command->add_option("--frame", arguments->load.frame, "Animation frame (default 0)")->check(not_negative_whole());
  add_volume_options(*command, arguments->load);
  set_heading(*command, heading::kOutput);
  add_parsed<ImageSize>(*command, "--size", "WxH",
                        {read_size, "WIDTHxHEIGHT of at least 320x240 and at most 16384 per side, as in 1280x720"},
                        arguments->size, "Window size in pixels, 320x240 to 16384 per side (default: the last size)");
  command->add_flag("--bare", arguments->is_bare, "Show no panels and save no settings");
  command->add_option("--screenshot", arguments->screenshot, "Write the finished image (.png) and exit")
      ->type_name("FILE")
      ->check(file_name());
  command
      ->add_option("--draw", arguments->drawn,
                   "First view mode: rays, blocks, smooth, density or paths (default: the last mode)")
      ->check(CLI::IsMember({"rays", "blocks", "smooth", "density", "paths"}));
  command->add_option("--light", arguments->light, "First light model: rays or propagated (default: the last model)")
      ->check(CLI::IsMember({"rays", "propagated"}));
  command
      ->add_option("--backend", arguments->backend,
                   "Renderer of rays: auto (a graphics card if there is one), cpu, or vulkan (any device)")
      ->check(CLI::IsMember({"auto", "cpu", "vulkan"}))
      ->capture_default_str();
  command->add_option("--device", arguments->device, "Vulkan device: its number or a part of its name")
      ->type_name("NAME|N");
  command
      ->add_option(
          "--memory", arguments->memory_mebibytes,
          "Memory for the loaded part of a world (.quoin) and its meshes and light in MiB, at least 64 (default: a "
          "quarter of the machine's)")
      ->check(CLI::Range(std::size_t{64}, std::size_t{1} << 24));
  command
      ->add_option("--distance", arguments->distance,
                   "Radius of the loaded part of a world around the camera in world units (default: 640 voxels)")
      ->check(CLI::Range(1.0, 1e6));
  set_heading(*command, heading::kGeneral);
  command->add_option("--threads", arguments->threads.count, "Number of threads, 1 to 1024 (default: all)")
      ->check(CLI::Range(1U, 1024U));
  command->footer(
      "F1 in the window shows the keys and mouse buttons.\n"
      "Example: quoin view castle.vox\n"
      "Example: quoin view scan.raw --raw-size 256x256x128 --raw-type uint16");
  command->callback([command, arguments, &status] {
    arguments->has_packs = command->count("--pack") > 0;
    const Status fits = check_rules(*command, view_rules(*arguments));
    status = fits ? run_view(*arguments) : wrong_usage(fits.error());
  });
}

}  // namespace quoin::tool
