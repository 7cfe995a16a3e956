// The rules of `quoin convert` that need the opened input. settle() checks all others.

#include <optional>
#include <string>
#include <tuple>

#include <quoin/mesh/smooth_mesh.h>

#include "convert/convert.h"

namespace quoin::tool {

namespace {

/// Returns true if the input is certainly meshed as blocks. Does not read its content, which may take long.
bool is_surely_blocks(const ConvertOptions& options, const OpenedInput& input) {
  if (options.mesher) return options.mesher != Mesher::Smooth;
  const LoadOptions& load = options.common.load;
  if (input.is_volume || load.mesh.as_field || (load.heights && load.heights->as_field)) return false;
  const std::optional<FileFormat>& format = input.file.format;
  return format && format != FileFormat::Scene && format != FileFormat::World && format != FileFormat::Vdb;
}

Error unusable(const std::string& option, const std::string& reason) {
  return make_error(ErrorCode::InvalidArgument, "cannot use " + option + ": " + reason);
}

/// Checks the options for an input that is a volume.
Status check_volume_rules(const ConvertOptions& options) {
  if (options.mesher && options.mesher != Mesher::Smooth) {
    return unusable("--mesher " + name_of(*options.mesher), "the input is a volume; use --mesher smooth");
  }
  const LoadOptions& load = options.common.load;
  const bool is_of_smooth_voxels = options.smoothness || options.colours || options.separate_models;
  const std::tuple<bool, const char*, const char*> refused[] = {
      {options.light.has_value(), "--light", "voxels or a field"},
      {options.is_atlas, "--texture atlas", "voxels"},
      {options.animate, "--animate", "a .vox file"},
      {is_of_smooth_voxels, "--smoothness, --colours or --no-unite", "voxels"},
      {load.show_hidden || load.frame != 0, "--hidden or --frame", "voxels"},
  };
  for (const auto& [is_given, option, needed] : refused) {
    if (is_given) return unusable(option, "the input is a volume, not " + std::string(needed));
  }
  return {};
}

/// Checks that the input has triangles if an option needs them.
Status check_triangle_rules(const ConvertOptions& options, const FormatInfo& to, const OpenedInput& input) {
  if (options.mesh_input.empty()) return {};
  const std::optional<FileFormat>& format = input.file.format;
  // An unrecognized file may be a triangle mesh. The reader reports why it is not recognized.
  if (!format || can(format, FormatCapability::Meshes)) return {};
  const bool may_have_field = input.heeds_iso() || format == FileFormat::Scene || format == FileFormat::World;
  if (options.mesh_input != "--solid" || !may_have_field) {
    return unusable(options.mesh_input, "it needs a triangle mesh, and the input is " + std::string(format->name()));
  }
  if (!to.can(FormatCapability::Meshes)) return {};
  return unusable("--solid", "it converts fields to voxels, but " + std::string(to.extension) + " is a mesh format");
}

}  // namespace

Status check_input_format(const ConvertOptions& options, const OpenedInput& input) {
  if (options.from.empty()) return {};
  const std::string name = input.file.format ? std::string(input.file.format->name()) : "unknown";
  if (name == options.from) return {};
  return make_error(ErrorCode::BadFormat, "the format is " + name + ", not " + options.from,
                    options.common.input.string());
}

Status check_input_rules(const ConvertOptions& options, const FormatInfo& to, const OpenedInput& input) {
  if (options.simplify && !can_simplify()) {
    return unusable("--simplify", "this build has no meshoptimizer (libmeshoptimizer-dev in Debian)");
  }
  if (is_surely_blocks(options, input)) {
    if (Status fits = check_mesher_rules(options, options.mesher.value_or(Mesher::Greedy)); !fits) return fits;
  }
  if (input.is_volume) {
    if (Status fits = check_volume_rules(options); !fits) return fits;
  }
  if (options.iso && !input.heeds_iso()) return unusable("--iso", "the input holds voxels, not a volume");
  // One of many inputs may have triangles although this one has none.
  return options.is_one_of_many ? Status() : check_triangle_rules(options, to, input);
}

Status check_mesher_rules(const ConvertOptions& options, Mesher mesher) {
  if (mesher == Mesher::Smooth) return {};
  const std::tuple<bool, const char*> refused[] = {
      {options.has_field_occlusion, "--ao-form, --ao-spread, --ao-offset and --ao-power need"},
      {options.simplify.has_value(), "--simplify needs"},
      {options.smoothness || options.colours || options.separate_models, "--smoothness, --colours and --no-unite need"},
  };
  for (const auto& [is_given, message] : refused) {
    if (is_given) return make_error(ErrorCode::InvalidArgument, std::string(message) + " --mesher smooth");
  }
  return {};
}

}  // namespace quoin::tool
