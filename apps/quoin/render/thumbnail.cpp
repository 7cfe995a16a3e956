#include "render/thumbnail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>

#include "command_files.h"
#include "commands.h"
#include "options.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {
namespace {

constexpr int kFiner = 2;  // samples per pixel along each side

float light_of(std::uint8_t encoded) {
  const float value = static_cast<float>(encoded) / 255.0F;
  return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
}

std::uint8_t encoded(float light) {
  const float value = light <= 0.0031308F ? light * 12.92F : 1.055F * std::pow(light, 1.0F / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 255.0F));
}

/// Shrinks an image by averaging blocks of pixels in linear light. Pixels without a hit are transparent.
AlphaImage shrunk(const RenderedImage& rendered, int size) {
  std::array<float, 256> light{};
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = light_of(static_cast<std::uint8_t>(i));
  AlphaImage image{size, size, {}};
  image.rgba.reserve(static_cast<std::size_t>(4) * static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      std::array<float, 3> sum{};
      int hit = 0;
      for (int i = 0; i < kFiner * kFiner; ++i) {
        const auto from =
            static_cast<std::size_t>((y * kFiner + i / kFiner) * rendered.colour.width + x * kFiner + i % kFiner);
        if (!std::isfinite(rendered.depth.values[from])) continue;
        ++hit;
        for (std::size_t channel = 0; channel < 3; ++channel)
          sum[channel] += light[rendered.colour.rgb[3 * from + channel]];
      }
      for (const float each : sum)
        image.rgba.push_back(hit > 0 ? encoded(each / static_cast<float>(hit)) : std::uint8_t{0});
      image.rgba.push_back(static_cast<std::uint8_t>((255 * hit + kFiner * kFiner / 2) / (kFiner * kFiner)));
    }
  }
  return image;
}

}  // namespace

Result<SmallImage> draw_small(const Scene& scene, int size, InstanceFilter filter, Threads threads,
                              const Progress& progress) {
  RenderOptions options;
  options.light = natural_light();
  options.environment = scene.environment.value_or(Environment::natural());
  options.light.occlusion_mode = OcclusionMode::Vertex;
  options.light.max_lamps = 4;
  options.width = options.height = size * kFiner;
  options.depth = true;
  const CpuRenderer renderer(scene, filter, threads);
  auto image = renderer.render(frame_scene(scene, View::Iso, 1.0, filter), options, threads, progress);
  if (!image) return image.error();
  return SmallImage{shrunk(*image, size), image->pixels_hit == 0};
}

Status put_thumbnail(const Scene& scene, Threads threads, WorldChanges& changes) {
  const auto drawn =
      draw_small(scene, kThumbnailSize, InstanceFilter::Visible, threads, [](double) { return !was_interrupted(); });
  if (!drawn) return drawn.error();
  if (drawn->is_empty) return {};
  auto png = write_png(drawn->image);
  if (!png) return png.error();
  changes.put_thumbnail(std::move(*png));
  return {};
}

namespace {

constexpr int kMaxSize = 4'096;

struct ThumbnailArguments {
  CommonOptions common;
  std::filesystem::path output;
  int size = kThumbnailSize;
};

struct Thumbnail {
  std::uint64_t bytes = 0;
  double seconds = 0.0;
  bool is_empty = false;
  std::vector<std::string> warnings;
};

/// Checks the name of the output. Errors: InvalidArgument.
Status check_image_name(const ThumbnailArguments& arguments) {
  const std::string name = arguments.output.string();
  if (CLI::detail::to_lower(arguments.output.extension().string()) != ".png") {
    return make_error(ErrorCode::InvalidArgument, "OUT: the image name must end in .png, not \"" + name + "\"");
  }
  if (!is_same_file(arguments.output, arguments.common.input)) return {};
  return make_error(ErrorCode::InvalidArgument, "OUT: " + name + " is the input");
}

Result<Thumbnail> draw(const ThumbnailArguments& arguments) {
  Stopwatch watch;
  if (auto writable = check_outputs({arguments.output}); !writable) return writable.error();
  LoadOptions load = arguments.common.load;
  load.keep_source = false;
  const auto input = open_input(arguments.common.input, load);
  if (!input) return input.error();
  auto loaded = load_scene(input->file, load, arguments.common.threads);
  if (!loaded) return loaded.error();
  catch_interrupts();
  auto drawn = draw_small(loaded->scene, arguments.size, arguments.common.instances(), arguments.common.threads,
                          [](double) { return !was_interrupted(); });
  if (!drawn) return drawn.error();
  Thumbnail made;
  made.warnings = std::move(loaded->warnings);
  made.is_empty = drawn->is_empty;
  if (made.is_empty) made.warnings.emplace_back("nothing visible; the image is empty");
  const auto written = write_png(drawn->image, arguments.output);
  if (!written) return written.error();
  made.bytes = *written;
  made.seconds = watch.lap();
  return made;
}

int run_thumbnail(ThumbnailArguments& arguments) {
  StandardStreams streams;
  Status read = streams.take_input(arguments.common.input);
  const auto made = read ? draw(arguments) : Result<Thumbnail>(read.error());
  if (!made) {
    const Error error = streams.named(made.error());
    streams.remove();
    die_if_interrupted();
    print_error(error);
    return kFailed;
  }
  if (arguments.common.json) {
    return print_json({{"file", arguments.output.string()},
                       {"size", {arguments.size, arguments.size}},
                       {"bytes", made->bytes},
                       {"seconds", made->seconds},
                       {"warnings", made->warnings}});
  }
  print_warnings(made->warnings);
  return print_summary("Wrote " + arguments.output.string() + ", " + bytes_for_people(made->bytes) + " in " +
                       number_for_people(made->seconds) + " s\n");
}

}  // namespace

void add_thumbnail_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("thumbnail", "Write a small image quickly, for lists and file managers");
  const auto arguments = std::make_shared<ThumbnailArguments>();
  add_common_options(*command, arguments->common, PlainBlocks::OwnPack);
  command->add_option("OUT", arguments->output, "Image to write: .png with a transparent background")
      ->required()
      ->check(file_name());
  set_heading(*command, heading::kOutput);
  command->add_option("--size", arguments->size, "Pixels along each side (default 256)")
      ->check(CLI::Range(1, kMaxSize));
  command->footer("Example: quoin thumbnail castle.vox castle.png --size 128");
  command->callback([arguments, &status] {
    const Status fits = check_image_name(*arguments);
    status = fits ? run_thumbnail(*arguments) : wrong_usage(fits.error());
  });
}

}  // namespace quoin::tool
