#include <algorithm>
#include <memory>

#include <quoin/render/light_options.h>

#include "command_files.h"
#include "commands.h"
#include "convert/convert.h"
#include "help.h"
#include "options.h"
#include "output.h"

namespace quoin::tool {

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

namespace {

/// "vox, scene, nifti, nrrd".
std::string readable_names() {
  std::string names;
  for (const FormatInfo& format : file_formats()) {
    if (format.can(FormatCapability::Read)) names += (names.empty() ? "" : ", ") + std::string(format.name());
  }
  return names;
}

void add_file_options(CLI::App& command, ConvertOptions& options, ManyOptions& many,
                      std::vector<std::filesystem::path>& rest) {
  command.add_option("OUT", rest, "File to write, or - for standard output; with --to, more input files")
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
      "Colours of blocks (default palette). palette: a palette texture, with occlusion per vertex. atlas: an "
      "atlas with occlusion, about a third fewer triangles (.glb, .gltf, .obj)");
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

std::vector<OptionRule> convert_rules(const ConvertOptions& options) {
  const auto has_none = [&options] { return options.field_occlusion.method == SmoothOcclusion::None; };
  std::vector<OptionRule> rules = raw_rules();
  std::ranges::move(field_occlusion_rules(options.field_occlusion), std::back_inserter(rules));
  std::ranges::move(mesh_input_rules(), std::back_inserter(rules));
  rules.push_back({{heading::kOcclusion}, excludes({"--no-ao"})});
  rules.push_back({{"--ao-attribute"}, excludes("--ao-form none", has_none)});
  rules.push_back({{"--fps"}, needs("--animate")});
  rules.push_back({{"--frame"}, excludes({"--animate"})});
  return rules;
}

/// Returns an error message if another option contradicts --texture atlas, else "".
std::string find_atlas_error(const ConvertOptions& options) {
  if (!options.is_atlas) return "";
  const std::string reason = ": the atlas holds the occlusion of merged faces";
  const std::string refused = "cannot use --texture atlas with ";
  if (options.mesher && options.mesher != Mesher::Greedy) {
    return refused + "--mesher " + name_of(*options.mesher) + reason;
  }
  if (options.occlusion_off) return refused + "--no-ao" + reason;
  if (options.ao_as_attribute) return refused + "--ao-attribute" + reason;
  return options.watertight ? refused + "--watertight" + reason : "";
}

/// Returns an error message if another option contradicts light at vertices, else "".
std::string find_light_error(const ConvertOptions& options) {
  if (!options.light) return "";
  const std::string reason = ": light is stored at the corners of faces";
  const std::string refused = "cannot use --light propagated with ";
  if (options.is_atlas) return refused + "--texture atlas" + reason;
  return options.watertight && options.mesher != Mesher::Smooth ? refused + "--watertight" + reason : "";
}

/// Returns an error message if another option contradicts --watch, else "".
std::string find_watching_error(const ConvertOptions& options, const ManyOptions& many) {
  if (!options.watch) return "";
  if (options.common.json) return "--watch and --json cannot be used together";
  if (options.common.input == kStandardStream || options.output == kStandardStream) {
    return "cannot use --watch with standard input or output";
  }
  const auto format = format_for_writing(many.inputs.empty() ? options.output : std::filesystem::path("f." + many.to));
  const bool is_kept = format && !format->can(FormatCapability::Meshes) && !options.force;
  return is_kept ? "--watch needs --force: it overwrites OUT, a model, after each change" : "";
}

/// Separates OUT from further inputs. Returns a usage error, or "".
std::string read_files(const std::vector<std::filesystem::path>& rest, ConvertOptions& options, ManyOptions& many) {
  const bool is_to_stream = rest.size() == 1 && rest.front() == kStandardStream;
  if (!many.to.empty() && !is_to_stream) {
    many.inputs = {options.common.input};
    many.inputs.insert(many.inputs.end(), rest.begin(), rest.end());
    const bool has_stream = std::find(many.inputs.begin(), many.inputs.end(), kStandardStream) != many.inputs.end();
    return has_stream ? "standard input (-) must be the only input and needs OUT" : "";
  }
  if (many.folder) return is_to_stream ? "cannot use --out-dir: OUT is standard output" : "--out-dir needs --to FORMAT";
  if (many.recursive) {
    return is_to_stream ? "cannot use --recursive: OUT is standard output" : "--recursive needs --to FORMAT";
  }
  if (rest.empty()) return "OUT is required";
  if (rest.size() > 1) {
    return "cannot convert " + std::to_string(rest.size() + 1) + " files: several inputs need --to FORMAT";
  }
  options.output = rest.front();
  return "";
}

/// Reads options that CLI11 leaves as text and checks combinations of options. Returns a usage error, or "".
std::string read_options(const CLI::App& command, const std::vector<std::filesystem::path>& rest,
                         ConvertOptions& options, ManyOptions& many) {
  options.has_field_occlusion = !given_options(command, kFieldOcclusion).empty();
  std::vector<std::string> given = given_options(command, {heading::kMesh, heading::kOcclusion, heading::kMeshFile});
  std::erase(given, "--voxel-mm");  // find_format_error() knows better formats for it
  options.mesh_only = !given.empty();
  given = given_options(command, {heading::kTriangles});
  options.mesh_input = given.empty() ? "" : given.front();
  options.as_voxels = command.count("--solid") > 0;
  const Status fits = check_rules(command, convert_rules(options));
  std::string fault = fits ? "" : to_string(fits.error());
  if (fault.empty()) fault = find_atlas_error(options);
  if (fault.empty()) fault = find_light_error(options);
  if (fault.empty()) fault = read_files(rest, options, many);
  if (fault.empty()) fault = find_watching_error(options, many);
  return fault;
}

std::string footer() {
  return readable_files() + "Writes " + extensions_with(FormatCapability::Write) +
         ".\n"
         "Voxel files (.vox, .qb, .json, .quoin, ...) are overwritten only with --force, meshes (.glb, .obj, ...) "
         "without asking, inputs never.\n"
         "NAME.gltf comes with NAME.bin; NAME.obj with NAME.mtl, NAME_palette.png, and NAME_emissive.png and "
         "NAME_atlas.png if needed. These replace files with the same names. Smooth meshes keep their colours in the "
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
  const auto options = std::make_shared<ConvertOptions>();
  const auto many = std::make_shared<ManyOptions>();
  const auto rest = std::make_shared<std::vector<std::filesystem::path>>();
  add_common_options(*command, options->common);
  add_file_options(*command, *options, *many, *rest);
  add_meshing_options(*command, *options);
  add_mesh_file_options(*command, *options);
  add_volume_options(*command, options->common.load, &options->iso);
  add_mesh_input_options(*command, options->common.load.mesh);
  command->footer(footer());
  command->callback([command, options, many, rest, &status] {
    if (const std::string fault = read_options(*command, *rest, *options, *many); !fault.empty()) {
      print_error(fault + " (try --help)");
      status = kWrongUsage;
      return;
    }
    status = run_convert(*options, *many);
  });
}

}  // namespace quoin::tool
