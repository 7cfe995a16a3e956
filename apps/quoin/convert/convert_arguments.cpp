#include "convert/convert_arguments.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <tuple>
#include <utility>

#include "options.h"

namespace quoin::tool {

namespace {

void add_mesh_input_options(CLI::App& command, MeshLoadOptions& options) {
  set_heading(command, heading::kTriangles);
  command.add_option("--size", options.size, "Voxels along the longest side, 1 to 16384 (default 128)")
      ->check(CLI::Range(1, 16'384));
  command.add_option("--voxel", options.voxel_size, "Edge of a voxel in the unit of the mesh, instead of --size")
      ->check(positive());
  command.add_flag_callback(
      "--solid", [&options] { options.surface = SurfaceVoxels::None; },
      "Create only voxels with a centre inside the mesh. If the input has fields: convert them to voxels, also for "
      ".json and .quoin");
  command.add_flag_callback(
      "--surface", [&options] { options.solid = SolidVoxels::None; },
      "Create only voxels on the surface (default: surface and inside)");
  command.add_flag("--field", options.as_field, "Create a smooth, editable distance field instead of voxels");
  const auto set_separating = [&options](const int& neighbours) {
    options.surface = neighbours == 26 ? SurfaceVoxels::Separating26 : SurfaceVoxels::Separating6;
  };
  command
      .add_option_function<int>(
          "--separating", set_separating,
          "Thickness of the surface (default 6). 6: thin; no path through voxel faces crosses it. 26: every voxel "
          "that the mesh touches; no path through edges and corners crosses it either")
      ->check(CLI::IsMember({6, 26}));
  command.add_flag_callback(
      "--parity", [&options] { options.solid = SolidVoxels::Parity; },
      "Find the inside by counting triangles instead of winding numbers, for meshes with inconsistent orientation");
  command.add_option("--band", options.band, "Range of distances of --field in voxels, 1 to 64 (default 8)")
      ->check(CLI::Range(1.0, 64.0));
  command
      .add_option(
          "--max-colours", options.max_types,
          "Maximum number of colours, 1 to 65535; similar colours are merged (default: as many as OUT can hold)")
      ->check(CLI::Range(1, 65'535));
  add_choice<UpAxis>(command, "--input-up", {{"y", UpAxis::Y}, {"z", UpAxis::Z}}, options.up,
                     "Up axis of the input: y or z (default y; z for .ply, .stl and .3mf)");
}

std::vector<OptionRule> mesh_input_rules() {
  return {
      {{"--size"}, excludes({"--voxel"})},
      {{"--solid", "--parity"}, excludes({"--surface"})},
      {{"--field"}, excludes({"--surface", "--separating"})},
      {{"--separating"}, excludes({"--solid"})},
      {{"--band"}, needs("--field")},
  };
}

/// "vox, scene, nifti, nrrd".
std::string readable_names() {
  std::string names;
  for (const FormatInfo& format : file_formats()) {
    if (format.can(FormatCapability::Read)) names += (names.empty() ? "" : ", ") + std::string(format.name());
  }
  return names;
}

void add_file_options(CLI::App& command, ConvertArguments& arguments) {
  ConvertOptions& options = arguments.options;
  ManyOptions& many = arguments.many;
  command.add_option("OUT", arguments.rest, "File to write, or - for standard output; with --to, more input files")
      ->check(file_name());
  set_heading(command, heading::kOutput);
  command.add_flag("--force", options.force, kForceHelp);
  command.add_flag("--watch", options.watch, "Convert again after each change of the input, until Ctrl-C");
  set_heading(command, heading::kManyFiles);
  command
      .add_option("--to", many.to,
                  "Convert each input to this format, for example glb; also the format of OUT if OUT is -")
      ->type_name("FORMAT")
      ->check(file_name());
  command.add_option("--out-dir", many.folder, "Output folder (default: the folder of each input)")
      ->type_name("FOLDER")
      ->check(file_name());
  command.add_flag("--recursive", many.recursive, "Convert all readable files in folders and their subfolders");
  set_heading(command, heading::kInput);
  command.add_option("--from", options.from, "Reject input that is not in this format: " + readable_names())
      ->type_name("FORMAT")
      ->check(file_name());
}

void add_meshing_options(CLI::App& command, ConvertOptions& options) {
  set_heading(command, heading::kMesh);
  add_choice<Mesher>(
      command, "--mesher", {{"culled", Mesher::Culled}, {"greedy", Mesher::Greedy}, {"smooth", Mesher::Smooth}},
      options.mesher,
      "Mesher: greedy or culled for blocks, smooth for rounded surfaces (default greedy; volumes and fields "
      "always smooth)");
  command
      .add_option("--scale", options.scale,
                  "Mesh units per world unit, which is a voxel in most files (default 1; 0.1: ten voxels per unit)")
      ->check(positive());
  add_choice<UpAxis>(command, "--up", {{"y", UpAxis::Y}, {"z", UpAxis::Z}}, options.up,
                     "Up axis of the mesh: y or z (default y; z for .ply, .stl and .3mf)");
  command.add_option("--simplify", options.simplify, "Simplify with this maximum error in voxels (smooth only)")
      ->check(not_negative());
  command
      .add_option("--smoothness", options.smoothness,
                  "Roundness of smooth surfaces around voxels, 0 (blocks) to 1 (default 1)")
      ->check(not_negative())
      ->check(CLI::Range(0.0, 1.0));
  add_choice<SurfaceColours>(command, "--colours",
                             {{"sharp", SurfaceColours::Sharp}, {"blended", SurfaceColours::Blended}}, options.colours,
                             "Colours of smooth surfaces around voxels: sharp or blended (default sharp)");
  add_choice<bool>(
      command, "--texture", {{"palette", false}, {"atlas", true}}, options.is_atlas,
      "Colours of blocks (default palette). palette: a palette texture, with occlusion per vertex, and an image per "
      "texture of the types. atlas: an atlas with occlusion, about a third fewer triangles; if types have textures, "
      "one "
      "image of all textures, with their faces unmerged (.glb, .gltf, .obj)");
  command.add_flag("--no-ao", options.occlusion_off, "Write no ambient occlusion");
  command.add_flag("--watertight", options.watertight,
                   "Write no T-junctions: edges end at the corners of their neighbours. Smooth meshes never have them");
  command.add_flag("--no-unite", options.separate_models,
                   "Mesh touching models separately instead of as one body (smooth only)");
  set_heading(command, heading::kOcclusion);
  command.add_flag(
      "--ao-attribute", options.ao_as_attribute,
      "Write occlusion as a vertex attribute, 1 (open) to 0 (dark), not in the colours: _AO in glTF, ao in "
      "PLY");
  add_field_occlusion_options(command, options.field_occlusion);
}

void add_mesh_file_options(CLI::App& command, ConvertOptions& options) {
  set_heading(command, heading::kMeshFile);
  const Choices<std::optional<LightOptions>> lights = {{"none", std::nullopt}, {"propagated", natural_light()}};
  add_choice(command, "--light", lights, options.light,
             "Light in the vertex colours for viewers without lighting: none, or propagated as in quoin render "
             "(default none; .glb, .gltf)");
  command.add_flag("--lights", options.lights, "Also write lamps (KHR_lights_punctual) and cameras (.glb, .gltf)");
  command.add_flag("--animate", options.animate,
                   "Write all frames of a .vox as an animation (.glb, .gltf). Smooth models are meshed separately");
  command.add_option("--fps", options.frames_per_second, "Frames per second of --animate, 0.001 to 1000 (default 10)")
      ->check(CLI::Range(0.001, 1000.0));
  command.add_flag("--compress", options.compress,
                   "Compress glTF without loss, for viewers with EXT_meshopt_compression");
  command.add_flag("--quantize", options.quantize,
                   "Write glTF positions as integers, for viewers with KHR_mesh_quantization; exact for blocks");
  command.add_option("--voxel-mm", options.voxel_mm, "Millimetres per voxel in .stl and .3mf (default 1)")
      ->check(positive());
}

/// Appends an explanation to the messages of a reason.
Reason because(Reason reason, std::string explanation) {
  return [reason = std::move(reason), explanation = ": " + std::move(explanation)](const CLI::App& command) {
    const std::string broken = reason(command);
    return broken.empty() ? broken : broken + explanation;
  };
}

std::vector<OptionRule> file_rules(const ConvertArguments& a) {
  const auto has_stream = [&a] { return a.options.common.input == kStandardStream || a.is_to_stream(); };
  return {
      {{"--out-dir", "--recursive"}, excludes("standard output", [&a] { return a.is_to_stream(); })},
      {{"--out-dir", "--recursive"}, needs("--to FORMAT", [&a] { return a.has_many_inputs(); })},
      {{"--watch"}, excludes({"--json"})},
      {{"--watch"}, excludes("standard input or output", has_stream)},
  };
}

std::vector<OptionRule> occlusion_rules(const ConvertOptions& options) {
  const auto has_none = [&options] { return options.field_occlusion.method == SmoothOcclusion::None; };
  return {
      {{heading::kOcclusion}, excludes({"--no-ao"})},
      {{"--ao-attribute"}, excludes("--ao-form none", has_none)},
  };
}

std::vector<OptionRule> mesh_rules(const ConvertOptions& options) {
  const auto is_atlas = [&options] { return options.is_atlas; };
  const auto is_other_mesher = [&options] { return options.is_atlas && options.mesher != Mesher::Greedy; };
  const auto is_lit_atlas = [&options] { return options.light && options.is_atlas; };
  const auto is_lit_as_blocks = [&options] { return options.light && options.mesher != Mesher::Smooth; };
  const std::string occlusion = "the atlas holds the occlusion of merged faces";
  const std::string light = "light is stored at the corners of faces";
  return {
      {{"--mesher"}, because(excludes("--texture atlas", is_other_mesher), occlusion)},
      {{"--no-ao", "--ao-attribute", "--watertight"}, because(excludes("--texture atlas", is_atlas), occlusion)},
      {{"--light"}, because(excludes("--texture atlas", is_lit_atlas), light)},
      {{"--watertight"}, because(excludes("--light propagated", is_lit_as_blocks), light)},
      {{"--voxel-mm"}, excludes({"--scale"})},
      {{"--fps"}, needs("--animate")},
      {{"--frame"}, excludes({"--animate"})},
  };
}

/// Returns the rules that do not depend on the format of the output.
std::vector<OptionRule> option_rules(const ConvertArguments& arguments) {
  const ConvertOptions& options = arguments.options;
  std::vector<OptionRule> rules = raw_rules();
  for (std::vector<OptionRule>& more :
       std::array{field_occlusion_rules(options.field_occlusion), mesh_input_rules(), occlusion_rules(options),
                  mesh_rules(options), file_rules(arguments)}) {
    std::ranges::move(more, std::back_inserter(rules));
  }
  return rules;
}

/// Returns the rules between options and the format of the output.
std::vector<OptionRule> format_rules(const ConvertOptions& options, const FormatInfo& format) {
  const auto prints = [&format] { return format.can(FormatCapability::Printing); };
  const auto may_replace = [&options, &format] { return options.force || format.can(FormatCapability::Meshes); };
  return {
      {{"--voxel-mm"}, needs(".stl or .3mf; use --scale for other mesh formats", prints)},
      {{"--watch"}, needs("--force: it overwrites OUT, a model, after each change", may_replace)},
  };
}

Error usage_error(std::string message) {
  return make_error(ErrorCode::InvalidArgument, std::move(message));
}

/// Separates OUT from further inputs. Errors: InvalidArgument.
Status settle_files(ConvertArguments& arguments) {
  const std::vector<std::filesystem::path>& rest = arguments.rest;
  std::vector<std::filesystem::path>& inputs = arguments.many.inputs;
  if (arguments.has_many_inputs()) {
    inputs = {arguments.options.common.input};
    inputs.insert(inputs.end(), rest.begin(), rest.end());
    if (std::count(inputs.begin(), inputs.end(), kStandardStream) == 0) return {};
    return usage_error("standard input (-) must be the only input and needs OUT");
  }
  if (rest.empty()) return usage_error("OUT is required");
  if (rest.size() > 1) {
    return usage_error("cannot convert " + std::to_string(rest.size() + 1) + " files: several inputs need --to FORMAT");
  }
  arguments.options.output = rest.front();
  return {};
}

/// Returns the format of the output. Errors: Unsupported; InvalidArgument if standard output cannot hold it.
Result<FormatInfo> output_format(const ConvertArguments& arguments) {
  const std::string& to = arguments.many.to;
  const bool is_named = !arguments.has_many_inputs() && !arguments.is_to_stream();
  auto format = format_for_writing(is_named ? arguments.options.output : std::filesystem::path("file." + to));
  if (is_named) return format;
  if (arguments.has_many_inputs()) {
    if (format) return format;
    return make_error(format.error().code, "--to: " + format.error().message + ", not \"" + to + "\"");
  }
  if (to.empty() || !format) {
    return usage_error("writing to standard output needs --to FORMAT, one of " +
                       extensions_with(FormatCapability::Write));
  }
  if (format->format == FileFormat::Gltf || format->format == FileFormat::Obj) {
    return usage_error("cannot write " + std::string(format->extension) +
                       " to standard output: it consists of several files");
  }
  if (arguments.options.common.json) return usage_error("cannot use --json: OUT is standard output");
  return format;
}

/// Checks that the output can hold the content that the options request. Errors: InvalidArgument, Unsupported.
Status check_capabilities(const CLI::App& command, const ConvertArguments& arguments) {
  const ConvertOptions& options = arguments.options;
  const FormatInfo& format = *arguments.format;
  if (!format.can(FormatCapability::Meshes)) {
    const auto given = given_options(command, {heading::kMesh, heading::kOcclusion, heading::kMeshFile});
    if (given.empty()) return {};
    const bool is_named = !options.output.empty() && !arguments.is_to_stream();
    return usage_error(
        "--mesher, --no-ao, --ao-..., --watertight, --smoothness, --colours, --no-unite, --simplify, "
        "--scale, --up, --texture, --light, --lights, --animate, --compress and --quantize need a mesh format; " +
        (is_named ? options.output.string() : std::string(format.extension)) + " is not one");
  }
  const std::tuple<bool, FormatCapability, const char*> wanted[] = {
      {options.ao_as_attribute, FormatCapability::OcclusionAttribute, "--ao-attribute"},
      {options.is_atlas, FormatCapability::Textures, "--texture atlas"},
      {options.lights, FormatCapability::Lamps, "--lights"},
      {options.light.has_value(), FormatCapability::VertexLight, "--light"},
      {options.animate, FormatCapability::Animation, "--animate"},
      {options.compress, FormatCapability::Compression, "--compress"},
      {options.quantize, FormatCapability::Compression, "--quantize"},
  };
  for (const auto& [is_given, capability, option] : wanted) {
    if (!is_given) continue;
    if (Status able = check_capability(format.format, capability, option); !able) return able;
  }
  return {};
}

}  // namespace

void add_convert_options(CLI::App& command, ConvertArguments& arguments) {
  ConvertOptions& options = arguments.options;
  add_common_options(command, options.common, PlainBlocks::Cubes);
  add_file_options(command, arguments);
  add_meshing_options(command, options);
  add_mesh_file_options(command, options);
  add_volume_options(command, options.common.load, &options.iso);
  add_mesh_input_options(command, options.common.load.mesh);
}

Status settle(const CLI::App& command, ConvertArguments& arguments) {
  ConvertOptions& options = arguments.options;
  if (Status fits = check_rules(command, option_rules(arguments)); !fits) return fits;
  if (Status complete = settle_files(arguments); !complete) return complete;
  const auto format = output_format(arguments);
  if (!format) return format.error();
  arguments.format = *format;
  if (Status fits = check_rules(command, format_rules(options, *format)); !fits) return fits;
  if (Status able = check_capabilities(command, arguments); !able) return able;
  options.has_field_occlusion = !given_options(command, kFieldOcclusion).empty();
  const std::vector<std::string> given = given_options(command, {heading::kTriangles});
  options.mesh_input = given.empty() ? "" : given.front();
  options.as_voxels = command.count("--solid") > 0;
  return {};
}

}  // namespace quoin::tool
