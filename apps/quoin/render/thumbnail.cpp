#include <memory>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>

#include "command_files.h"
#include "commands.h"
#include "help.h"
#include "output.h"
#include "render/small_image.h"
#include "run_control.h"

namespace quoin::tool {
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
  add_common_options(*command, arguments->common);
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
