#include <memory>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/gltf.h>
#include <quoin/io/obj.h>
#include <quoin/io/scene_meshes.h>

#include "commands.h"
#include "interrupt.h"
#include "output.h"
#include "progress_bar.h"
#include "scene_warnings.h"
#include "stopwatch.h"

namespace quoin::tool {

namespace {

struct ConvertOptions {
  CommonOptions common;
  std::filesystem::path output;
  std::string mesher = "greedy";
  bool occlusion_off = false;
  bool watertight = false;
  double iso = 0.5;
  double simplify = 0.0;
  bool smooth_only = false;  ///< --iso or --simplify was given
  bool mesh_only = false;    ///< any option that only meshes heed was given
};

struct Seconds {
  double read = 0;
  double mesh = 0;
  double write = 0;
};

struct Outcome {
  std::int64_t voxels = 0;
  SceneMeshes meshes;
  std::uint64_t bytes = 0;
  std::vector<std::filesystem::path> files;  ///< all that were written, OUT first
  Seconds seconds;
  std::vector<std::string> warnings;
};

Result<std::uint64_t> write_meshes(const Scene& scene, const SceneMeshes& meshes, const FormatInfo& format,
                                   const std::filesystem::path& path, const Progress& progress) {
  switch (format.format) {
    case FileFormat::Glb:
      return write_glb(scene, meshes, path, progress);
    case FileFormat::Gltf:
      return write_gltf(scene, meshes, path, progress);
    case FileFormat::Obj:
      return write_obj(scene, meshes, path, progress);
    case FileFormat::Ply:
    case FileFormat::Vox:
    case FileFormat::Nifti:
    case FileFormat::Nrrd:
      break;
  }
  return fail(ErrorCode::Unsupported, "not a mesh format", path.string());
}

std::vector<std::filesystem::path> files_of(const SceneMeshes& meshes, const FormatInfo& format,
                                            const std::filesystem::path& path) {
  if (format.format == FileFormat::Gltf) return gltf_files(meshes, path);
  if (format.format == FileFormat::Obj) return obj_files(meshes, path);
  return {path};
}

/// Refuses to replace the input by a file that the user did not name. OUT itself may be the input.
Status check_companions(const std::vector<std::filesystem::path>& files, const ConvertOptions& options) {
  for (const auto& file : files) {
    std::error_code missing;
    if (file == files.front() || !std::filesystem::equivalent(file, options.common.input, missing)) continue;
    return fail(ErrorCode::InvalidArgument,
                "the input, which " + options.output.string() + " would replace with its companion of this name",
                file.string());
  }
  return {};
}

Result<std::uint64_t> write_voxels(const Scene& scene, const std::filesystem::path& path,
                                   std::vector<std::string>& warnings) {
  auto bytes = write_vox(scene, warnings);
  if (!bytes) {
    if (bytes.error().path.empty()) bytes.error().path = path.string();
    return tl::unexpected<Error>(bytes.error());
  }
  if (auto written = write_file(path, *bytes); !written) return tl::unexpected<Error>(written.error());
  return bytes->size();
}

/// Meshes the scene and writes it, filling in `outcome`.
Status mesh_and_write(const Scene& scene, const ConvertOptions& options, const FormatInfo& format, Outcome& outcome) {
  Stopwatch watch;
  ProgressBar bar;
  const BlockyMeshOptions mesh_options{options.mesher == "greedy", !options.occlusion_off, options.watertight};
  auto meshes =
      mesh_scene(scene, mesh_options, options.common.load.hidden, options.common.threads, bar.listener("meshing"));
  if (!meshes) return tl::unexpected<Error>(meshes.error());
  outcome.meshes = std::move(*meshes);
  outcome.seconds.mesh = watch.lap();
  warn_of_left_out(scene, outcome.meshes.hidden, outcome.warnings);
  if (outcome.meshes.triangles == 0) outcome.warnings.emplace_back("nothing to draw");
  outcome.files = files_of(outcome.meshes, format, options.output);
  if (auto sound = check_companions(outcome.files, options); !sound) return sound;
  const auto bytes = write_meshes(scene, outcome.meshes, format, options.output, bar.listener("writing"));
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  outcome.bytes = *bytes;
  outcome.seconds.write = watch.lap();
  return {};
}

Result<Outcome> convert(const ConvertOptions& options, const FormatInfo& format) {
  Stopwatch watch;
  auto loaded = load_scene(options.common.input, options.common.load);
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  Outcome outcome;
  outcome.voxels = loaded->scene.voxel_count();
  outcome.warnings = std::move(loaded->warnings);
  outcome.seconds.read = watch.lap();
  catch_interrupts();
  if (format.is_mesh) {
    if (auto done = mesh_and_write(loaded->scene, options, format, outcome); !done) {
      return tl::unexpected<Error>(done.error());
    }
    return outcome;
  }
  outcome.files = {options.output};
  const auto bytes = write_voxels(loaded->scene, options.output, outcome.warnings);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  outcome.bytes = *bytes;
  outcome.seconds.write = watch.lap();
  return outcome;
}

Json outcome_json(const Outcome& outcome) {
  Json files = Json::array();
  for (const auto& file : outcome.files) files.push_back(file.string());
  return {
      {"voxels", outcome.voxels},
      {"faces_visible", outcome.meshes.faces_visible},
      {"faces_total", outcome.meshes.faces_total},
      {"quads", outcome.meshes.quads},
      {"triangles", outcome.meshes.triangles},
      {"vertices", outcome.meshes.vertices},
      {"bytes", outcome.bytes},
      {"files", files},
      {"seconds", {{"read", outcome.seconds.read}, {"mesh", outcome.seconds.mesh}, {"write", outcome.seconds.write}}},
      {"warnings", outcome.warnings}};
}

std::string outcome_text(const FormatInfo& format, const Outcome& outcome) {
  std::string text = "Voxels: " + with_thousands(outcome.voxels) + "\n";
  if (format.is_mesh) {
    const SceneMeshes& meshes = outcome.meshes;
    text += "Faces: " + with_thousands(meshes.faces_visible) + " visible of " + with_thousands(meshes.faces_total) +
            " total\n";
    text += "Mesh: " + with_thousands(meshes.quads) + " quads, " + with_thousands(meshes.triangles) + " triangles, " +
            with_thousands(meshes.vertices) + " vertices\n";
  }
  const double seconds = outcome.seconds.read + outcome.seconds.mesh + outcome.seconds.write;
  text += "Wrote ";
  for (const auto& file : outcome.files) text += file.string() + ", ";
  return text + bytes_for_people(outcome.bytes) + " in " + number_for_people(seconds) + " s\n";
}

/// The exit status of options that contradict each other or the output's format; kDone when they do not.
int check_usage(const ConvertOptions& options, const Result<FormatInfo>& format) {
  if (!format) {
    print_error(format.error());
    return kWrongUsage;
  }
  if (!format->is_mesh && options.mesh_only) {
    print_error("--mesher, --no-ao, --watertight, --iso and --simplify are for mesh formats; " +
                options.output.string() + " is none");
    return kWrongUsage;
  }
  if (options.mesher != "smooth" && options.smooth_only) {
    print_error("--iso and --simplify need --mesher smooth");
    return kWrongUsage;
  }
  if (format->is_mesh && options.mesher == "smooth") {
    print_error("--mesher smooth is not supported by this version; culled and greedy are");
    return kFailed;
  }
  return kDone;
}

int run_convert(const ConvertOptions& options) {
  const auto format = format_for_writing(options.output);
  if (const int status = check_usage(options, format); status != kDone) return status;
  const auto outcome = convert(options, *format);
  if (!outcome) {
    die_if_interrupted();
    print_error(outcome.error());
    return kFailed;
  }
  if (options.common.json) return print_json(outcome_json(*outcome));
  print_warnings(outcome->warnings);
  return print(outcome_text(*format, *outcome));
}

void add_mesh_options(CLI::App& command, ConvertOptions& options) {
  command
      .add_option("--mesher", options.mesher,
                  "How to mesh: culled or greedy (default greedy); smooth is not in this version")
      ->check(CLI::IsMember({"culled", "greedy", "smooth"}));
  command.add_flag("--no-ao", options.occlusion_off, "Leave ambient occlusion out");
  command.add_flag("--watertight", options.watertight, "No T-junctions: every edge meets its neighbours' corners");
  command.add_option("--iso", options.iso, "Surface value of volumes (smooth only: not in this version)");
  command
      .add_option("--simplify", options.simplify, "Error allowed when simplifying (smooth only: not in this version)")
      ->check(not_negative());
}

}  // namespace

void add_convert_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("convert", "Turn a file into another format, by OUT's ending");
  const auto options = std::make_shared<ConvertOptions>();
  add_common_options(*command, options->common);
  command->add_option("OUT", options->output, "File to write: " + writable_endings())->required()->check(file_name());
  add_mesh_options(*command, *options);
  command->footer(
      "Reads " + readable_endings() + "; writes " + writable_endings() +
      ".\nBeside NAME.gltf goes NAME.bin; beside NAME.obj go NAME.mtl, NAME_palette.png and, for what emits light,\n"
      "NAME_emissive.png. They replace files of these names.\nExample: quoin convert castle.vox castle.glb");
  command->callback([command, options, &status] {
    options->smooth_only = command->count("--iso") + command->count("--simplify") > 0;
    options->mesh_only = options->smooth_only ||
                         command->count("--mesher") + command->count("--no-ao") + command->count("--watertight") > 0;
    status = run_convert(*options);
  });
}

}  // namespace quoin::tool
