#include "convert/mesh_input.h"

namespace quoin::tool {

namespace {

constexpr const char* kNames[] = {"--size",       "--voxel",  "--solid", "--surface",     "--field",
                                  "--separating", "--parity", "--band",  "--max-colours", "--input-up"};

}  // namespace

void add_mesh_input_options(CLI::App& command, MeshInputTexts& texts, MeshLoadOptions& options) {
  constexpr const char* kGroup = "From triangles (.obj, .glb, .gltf, .ply, .stl)";
  command.add_option("--size", options.size, "Voxels along the longest side (default 128)")
      ->check(CLI::Range(1, 16'384))
      ->group(kGroup);
  command.add_option("--voxel", options.voxel_size, "Size of a voxel in the mesh's unit, instead of --size")
      ->check(positive())
      ->group(kGroup);
  command
      .add_flag("--solid", texts.is_solid,
                "Only voxels whose centre the mesh encloses; of fields: voxels, also in formats that hold "
                "fields (.json, .quoin)")
      ->group(kGroup);
  command.add_flag("--surface", texts.is_surface, "Only its surface (default: surface and what it encloses)")
      ->group(kGroup);
  command.add_flag("--field", texts.is_field, "A field of distances to it, smooth and editable, instead of voxels")
      ->group(kGroup);
  command
      .add_option("--separating", texts.separating,
                  "The surface: 6 is thin, closed against paths through faces (default); 26 is every voxel that it "
                  "meets, closed against paths through edges and corners too")
      ->check(CLI::IsMember({6, 26}))
      ->group(kGroup);
  command
      .add_flag("--parity", texts.by_parity,
                "Solid by counting triangles, whichever way they face, instead of by winding numbers")
      ->group(kGroup);
  command.add_option("--band", options.band, "Of --field: how far distances are kept, in voxels (default 8)")
      ->check(CLI::Range(1.0, 64.0))
      ->group(kGroup);
  command
      .add_option("--max-colours", options.max_types,
                  "Colours to tell apart; near ones become one (default: as many as OUT holds)")
      ->check(CLI::Range(1, 65'535))
      ->group(kGroup);
  command
      .add_option("--input-up", texts.up, "Which axis of the file points up: y or z (default y; z of .stl and .ply)")
      ->check(CLI::IsMember({"y", "z"}))
      ->group(kGroup);
}

std::string read_mesh_input_options(const CLI::App& command, const MeshInputTexts& texts, MeshLoadOptions& options) {
  if (options.size && options.voxel_size) return "--size and --voxel exclude each other";
  if (texts.is_solid && texts.is_surface) return "--solid and --surface together are what is made without them";
  if (texts.is_field && (texts.is_surface || command.count("--separating") > 0)) {
    return "--field has no voxels of a surface: not with --surface and --separating";
  }
  if (command.count("--band") > 0 && !texts.is_field) return "--band needs --field";
  if (texts.is_surface && texts.by_parity) return "--parity is of what is solid, and --surface leaves that out";
  if (texts.is_solid && command.count("--separating") > 0) {
    return "--separating is of the surface, and --solid leaves that out";
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
