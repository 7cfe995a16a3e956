#include "convert/mesh_input.h"

#include "shell/help.h"

namespace quoin::tool {

namespace {

constexpr const char* kNames[] = {"--size",       "--voxel",  "--solid", "--surface",     "--field",
                                  "--separating", "--parity", "--band",  "--max-colours", "--input-up"};

}  // namespace

void add_mesh_input_options(CLI::App& command, MeshInputTexts& texts, MeshLoadOptions& options) {
  set_heading(command, heading::kTriangles);
  command.add_option("--size", options.size, "Voxels along the longest side, 1 to 16384 (default 128)")
      ->check(CLI::Range(1, 16'384));
  command.add_option("--voxel", options.voxel_size, "Edge of a voxel in the unit of the mesh, instead of --size")
      ->check(positive());
  command.add_flag(
      "--solid", texts.is_solid,
      "Create only voxels with a centre inside the mesh. If the input has fields: convert them to voxels, also for "
      ".json and .quoin");
  command.add_flag("--surface", texts.is_surface, "Create only voxels on the surface (default: surface and inside)");
  command.add_flag("--field", texts.is_field, "Create a smooth, editable distance field instead of voxels");
  command
      .add_option(
          "--separating", texts.separating,
          "Thickness of the surface (default 6). 6: thin; no path through voxel faces crosses it. 26: every voxel "
          "that the mesh touches; no path through edges and corners crosses it either")
      ->check(CLI::IsMember({6, 26}));
  command.add_flag(
      "--parity", texts.by_parity,
      "Find the inside by counting triangles instead of winding numbers, for meshes with inconsistent orientation");
  command.add_option("--band", options.band, "Range of distances of --field in voxels, 1 to 64 (default 8)")
      ->check(CLI::Range(1.0, 64.0));
  command
      .add_option(
          "--max-colours", options.max_types,
          "Maximum number of colours, 1 to 65535; similar colours are merged (default: as many as OUT can hold)")
      ->check(CLI::Range(1, 65'535));
  command.add_option("--input-up", texts.up, "Up axis of the input: y or z (default y; z for .stl and .ply)")
      ->check(CLI::IsMember({"y", "z"}));
}

std::string read_mesh_input_options(const CLI::App& command, const MeshInputTexts& texts, MeshLoadOptions& options) {
  if (options.size && options.voxel_size) return "--size and --voxel cannot be used together";
  if (texts.is_solid && texts.is_surface) return "--solid and --surface cannot be used together; the default is both";
  if (texts.is_field && (texts.is_surface || command.count("--separating") > 0)) {
    return "--field cannot be used with --surface or --separating";
  }
  if (command.count("--band") > 0 && !texts.is_field) return "--band needs --field";
  if (texts.is_surface && texts.by_parity) return "--parity and --surface cannot be used together";
  if (texts.is_solid && command.count("--separating") > 0) {
    return "--separating and --solid cannot be used together";
  }
  options.surface = texts.separating == 26 ? SurfaceVoxels::Separating26 : SurfaceVoxels::Separating6;
  options.solid = texts.by_parity ? SolidVoxels::Parity : SolidVoxels::Winding;
  if (texts.is_solid) options.surface = SurfaceVoxels::None;
  if (texts.is_surface) options.solid = SolidVoxels::None;
  options.as_field = texts.is_field;
  if (!texts.up.empty()) options.up = texts.up == "z" ? UpAxis::Z : UpAxis::Y;
  return "";
}

const char* given_mesh_input(const CLI::App& command) {
  for (const char* name : kNames) {
    if (command.count(name) > 0) return name;
  }
  return nullptr;
}

}  // namespace quoin::tool
