#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/picture_files.h>
#include <quoin/render/cpu_renderer.h>

#include "commands.h"
#include "interrupt.h"
#include "output.h"
#include "output_files.h"
#include "progress_bar.h"
#include "render/text_options.h"
#include "standard_streams.h"
#include "stopwatch.h"

namespace quoin::tool {
namespace {

constexpr int kMaxSize = 4'096;
constexpr int kFiner = 2;  // times as fine is it drawn, along each side

struct ThumbnailArguments {
  CommonOptions common;
  std::filesystem::path output;
  int size = 256;
};

struct Thumbnail {
  std::uint64_t bytes = 0;
  double seconds = 0.0;
  bool is_empty = false;
  std::vector<std::string> warnings;
};

float light_of(std::uint8_t encoded) {
  const float value = static_cast<float>(encoded) / 255.0F;
  return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
}

std::uint8_t encoded(float light) {
  const float value = light <= 0.0031308F ? light * 12.92F : 1.055F * std::pow(light, 1.0F / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 255.0F));
}

/// Means of squares of pixels; where nothing was hit it is clear.
AlphaImage shrunk(const Picture& picture, int size) {
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
            static_cast<std::size_t>((y * kFiner + i / kFiner) * picture.colour.width + x * kFiner + i % kFiner);
        if (!std::isfinite(picture.depth.values[from])) continue;
        ++hit;
        for (std::size_t channel = 0; channel < 3; ++channel)
          sum[channel] += light[picture.colour.rgb[3 * from + channel]];
      }
      for (const float each : sum)
        image.rgba.push_back(hit > 0 ? encoded(each / static_cast<float>(hit)) : std::uint8_t{0});
      image.rgba.push_back(static_cast<std::uint8_t>((255 * hit + kFiner * kFiner / 2) / (kFiner * kFiner)));
    }
  }
  return image;
}

Result<Thumbnail> draw(const ThumbnailArguments& arguments) {
  Stopwatch watch;
  if (auto writable = check_outputs({arguments.output}); !writable) return writable.error();
  LoadOptions load = arguments.common.load;
  load.keep_source = false;
  auto loaded = load_scene(arguments.common.input, load, arguments.common.threads);
  if (!loaded) return loaded.error();
  catch_interrupts();
  RenderOptions options;
  // What is small is quick: occlusion without rays, and few lamps.
  options.light = natural_light();
  options.light.occlusion_mode = OcclusionMode::Vertex;
  options.light.max_lamps = 4;
  options.width = options.height = arguments.size * kFiner;
  options.depth = true;
  const InstanceFilter filter = arguments.common.instances();
  const CpuRenderer renderer(loaded->scene, filter, arguments.common.threads);
  auto picture = renderer.render(frame_scene(loaded->scene, View::Iso, 1.0, filter), options, arguments.common.threads,
                                 [](double) { return !was_interrupted(); });
  if (!picture) return picture.error();
  Thumbnail made;
  made.warnings = std::move(loaded->warnings);
  made.is_empty = picture->pixels_hit == 0;
  if (made.is_empty) made.warnings.emplace_back("nothing to draw: an empty picture");
  const auto written = write_png(shrunk(*picture, arguments.size), arguments.output);
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
  CLI::App* command = app.add_subcommand("thumbnail", "Draw a small picture at once, for lists and file managers");
  const auto arguments = std::make_shared<ThumbnailArguments>();
  add_common_options(*command, arguments->common);
  command->add_option("OUT", arguments->output, "Picture to write: .png, clear where nothing is")
      ->required()
      ->check(file_name());
  command->add_option("--size", arguments->size, "Pixels along each side (default 256)")
      ->check(CLI::Range(1, kMaxSize));
  command->footer("Example: quoin thumbnail castle.vox castle.png --size 128");
  command->callback([arguments, &status] {
    if (CLI::detail::to_lower(arguments->output.extension().string()) != ".png") {
      print_error("OUT: the picture's name must end in .png, not \"" + arguments->output.string() + "\" (try --help)");
      status = kWrongUsage;
      return;
    }
    if (is_same_file(arguments->output, arguments->common.input)) {
      print_error("OUT: " + arguments->output.string() + " is the input (try --help)");
      status = kWrongUsage;
      return;
    }
    status = run_thumbnail(*arguments);
  });
}

}  // namespace quoin::tool
