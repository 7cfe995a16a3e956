#include "convert/convert.h"

#include <memory>

#include "options.h"

namespace quoin::tool {

namespace {

/// Fails if the output must not or cannot be written, before the input is read. Creates folders of many outputs.
Status prepare_output(const ConvertOptions& options) {
  if (Status kept = check_replaced(options.output, options.inputs, options.force); !kept) return kept;
  if (options.is_one_of_many) {
    if (Status made = make_folder_of(options.output); !made) return made;
  }
  return check_outputs({options.output});
}

}  // namespace

Conversion convert_file(const ConvertOptions& options, const FormatInfo& format) {
  const auto input = open_input(options.common.input, options.common.load);
  if (!input) return input.error();
  if (Status matches = check_input_format(options, *input); !matches) return matches.error();
  if (Status fits = check_input_rules(options, format, *input); !fits) return Conversion::wrong_usage(fits.error());
  if (Status prepared = prepare_output(options); !prepared) return prepared.error();
  const std::optional<FileFormat>& from = input->file.format;
  const bool is_mesh = format.can(FormatCapability::Meshes);
  if (format.format == FileFormat::World && can(from, FormatCapability::Chunks))
    return convert_by_chunks(options, input->file);
  // Packs change the types of the whole scene.
  const bool is_kept = from == FileFormat::World && options.common.load.packs.empty();
  if (is_kept && format.format == FileFormat::World) return copy_world_file(options);
  if (is_kept && is_mesh && meshes_by_chunks(options)) {
    auto meshed = mesh_world_file(options);
    if (!meshed) return meshed.error();
    if (*meshed) return std::move(**meshed);
  }
  if (input->is_volume && is_mesh) return convert_volume(options, format, input->file);
  return convert_scene(options, format, *input);
}

namespace {

std::string mesh_text(const Outcome& outcome) {
  const std::string size = with_thousands(outcome.meshes.triangles) + " triangles, " +
                           with_thousands(outcome.meshes.vertices) + " vertices\n";
  if (outcome.mesher == Mesher::Smooth) return "Mesh: " + size;
  return "Mesh: " + with_thousands(outcome.meshes.quads) + " quads, " + size;
}

std::string outcome_text(const Outcome& outcome) {
  std::string text = (outcome.is_volume ? "Solid samples: " + with_thousands(outcome.content.solid_samples)
                                        : content_text(outcome.content)) +
                     "\n";
  if (outcome.faces.total > 0) text += to_string(outcome.faces) + "\n";
  const bool is_field = outcome.content.voxels == 0 && outcome.content.solid_samples > 0;
  if (is_field && outcome.mesher) text += "Faces: " + with_thousands(outcome.meshes.triangles) + " triangles\n";
  if (outcome.iso) {
    text += "Iso: " + digits_for_people(*outcome.iso) +
            (outcome.is_iso_found ? " (between the two groups of values; set another with --iso)\n" : "\n");
  }
  if (outcome.mesher) text += mesh_text(outcome);
  if (outcome.meshes.simplify_error > 0)
    text += "Simplified: error up to " + digits_for_people(outcome.meshes.simplify_error) + " voxels\n";
  const double seconds = outcome.seconds.read + outcome.seconds.mesh + outcome.seconds.write;
  text += "Wrote ";
  for (const auto& file : outcome.files) text += file.string() + ", ";
  return text + bytes_for_people(outcome.bytes) + " in " + number_for_people(seconds) + " s\n";
}

/// Returns the number of block faces. For fields returns the number of triangles, or null without a mesh.
Json faces_json(const Outcome& outcome, std::int64_t of_blocks) {
  const bool is_field = outcome.content.voxels == 0 && outcome.content.solid_samples > 0;
  if (!is_field) return of_blocks;
  return outcome.mesher ? Json(outcome.meshes.triangles) : Json();
}

}  // namespace

Json outcome_json(const Outcome& outcome) {
  Json files = Json::array();
  for (const auto& file : outcome.files) files.push_back(file.string());
  return {
      {"voxels", outcome.is_volume ? outcome.content.solid_samples : outcome.content.voxels},
      {"solid_samples", outcome.content.solid_samples},
      {"mesher", outcome.mesher ? Json(name_of(*outcome.mesher)) : Json()},
      {"iso", outcome.iso ? Json(*outcome.iso) : Json()},
      {"faces_visible", faces_json(outcome, outcome.faces.visible)},
      {"faces_total", faces_json(outcome, outcome.faces.total)},
      {"quads", outcome.meshes.quads},
      {"triangles", outcome.meshes.triangles},
      {"vertices", outcome.meshes.vertices},
      {"simplify_error", outcome.meshes.simplify_error},
      {"bytes", outcome.bytes},
      {"files", files},
      {"seconds", {{"read", outcome.seconds.read}, {"mesh", outcome.seconds.mesh}, {"write", outcome.seconds.write}}},
      {"warnings", outcome.warnings}};
}

namespace {

/// Replaces standard streams ("-") by temporary files. Errors: those of StandardStreams.
Status open_streams(ConvertArguments& arguments, StandardStreams& streams) {
  ConvertOptions& options = arguments.options;
  if (arguments.is_to_stream()) {
    auto file = streams.output(std::string(arguments.format->extension));
    if (!file) return file.error();
    options.output = *file;
  }
  options.is_from_stream = options.common.input == kStandardStream;
  return streams.take_input(options.common.input);
}

/// Converts one file, and prints the outcome or the error.
WatchedWork run_one(ConvertArguments& arguments) {
  ConvertOptions& options = arguments.options;
  StandardStreams streams;
  WatchedWork work;
  if (options.watch) work.read = files_read(options.common.input, options.common.load.sidecar_files);
  const auto ended = [&](int status) {
    work.status = status;
    return work;
  };
  const auto failed = [&](const Error& error, int status = kFailed) {
    const Error named = streams.named(error);
    streams.remove();
    die_if_interrupted();
    print_error(named);
    return ended(status);
  };
  if (arguments.is_to_stream()) catch_interrupts();
  if (Status opened = open_streams(arguments, streams); !opened) return failed(opened.error());
  options.inputs = FileSet({&options.common.input, 1});
  const Conversion outcome = convert_file(options, *arguments.format);
  if (!outcome) return failed(outcome.error(), outcome.exit_status());
  work.written = outcome->files;
  if (options.common.json) return ended(print_json(outcome_json(*outcome)));
  print_warnings(outcome->warnings);
  if (!arguments.is_to_stream()) return ended(print_summary(outcome_text(*outcome)));
  if (Status written = streams.write_output(); !written) return failed(written.error());
  return ended(kDone);
}

/// Converts all inputs. Returns the exit status.
int run_convert(ConvertArguments& arguments) {
  Converted done;
  const bool is_many = arguments.has_many_inputs();
  const auto work = [&] { return is_many ? run_many(arguments, done) : run_one(arguments); };
  const ConvertOptions& options = arguments.options;
  if (!options.watch) return work().status;
  const SidecarFiles allowed = options.common.load.sidecar_files;
  return watch(is_many ? arguments.many.inputs : files_read(options.common.input, allowed), work);
}

std::string footer() {
  return readable_files() + "Writes " + extensions_with(FormatCapability::Write) +
         ".\n"
         "Voxel files (.vox, .qb, .json, .quoin, ...) are overwritten only with --force, meshes (.glb, .obj, ...) "
         "without asking, inputs never.\n"
         "NAME.gltf comes with NAME.bin; NAME.obj with NAME.mtl, NAME_palette.png, and if needed NAME_emissive.png, "
         "NAME_atlas.png, NAME_texture_1.png and NAME_alpha_1.png and so on. These replace files with the same names. "
         "Smooth meshes keep their colours in the "
         "vertices and need none of them.\n"
         ".json and .quoin keep all grids, types, rotations and scales. Only .vox keeps animation and notes; from .vox "
         "to .vox nothing is lost, and --frame writes one frame.\n"
         "Triangle meshes are always voxelized first: converting a.obj to a.glb writes a voxel mesh of the same size.\n"
         ".stl and .3mf are closed manifold meshes in millimetres, for 3D printing. Volumes in millimetres are "
         "written in metres to glTF, in millimetres to other mesh formats.\n"
         "Example: quoin convert castle.vox castle.glb\n"
         "Example: quoin convert models/*.vox --to glb --out-dir meshes\n"
         "Example: quoin convert castle.vox castle.ply --mesher smooth --simplify 0.1\n"
         "Example: quoin convert statue.glb statue.vox --size 200\n"
         "Example: quoin convert scan.nii.gz scan.glb --iso 300\n"
         "Example: quoin convert fleet.json whole_fleet.json\n"
         "Example: quoin convert statue.obj statue.json --voxel 0.05 --field\n"
         "Example: quoin convert castle.vox castle.3mf --voxel-mm 0.8\n"
         "Example: quoin convert scan.nii.gz scan.ply --ao-form weighted --ao-spread 4 --ao-attribute";
}

}  // namespace

void add_convert_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("convert", "Convert a file; the extension of OUT selects the format");
  const auto arguments = std::make_shared<ConvertArguments>();
  add_convert_options(*command, *arguments);
  command->footer(footer());
  command->callback([command, arguments, &status] {
    const Status fits = settle(*command, *arguments);
    status = fits ? run_convert(*arguments) : wrong_usage(fits.error());
  });
}

}  // namespace quoin::tool
