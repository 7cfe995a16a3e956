#include "convert/mesh_input.h"

#include "help.h"

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

}  // namespace quoin::tool
