#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <quoin/io/formats.h>
#include <quoin/render/light_options.h>
#include <quoin/scene/scene_meshes.h>

#include "command_files.h"
#include "commands.h"
#include "options.h"

namespace quoin::tool {

enum class Mesher : std::uint8_t { Greedy, Culled, Smooth };

/// Returns the name of a mesher, as in --mesher.
[[nodiscard]] inline std::string name_of(Mesher mesher) {
  if (mesher == Mesher::Smooth) return "smooth";
  return mesher == Mesher::Culled ? "culled" : "greedy";
}

/// The options of `quoin convert`.
struct ConvertOptions {
  CommonOptions common;
  std::filesystem::path output;
  FileSet inputs;    ///< all input files, which are never overwritten
  std::string from;  ///< the required input format; empty: any
  bool force = false;
  bool is_from_stream = false;   ///< IN is standard input and has no name
  bool is_one_of_many = false;   ///< shows no progress bar
  std::optional<Mesher> mesher;  ///< default: greedy for voxels, smooth for volumes and fields
  bool occlusion_off = false;
  bool ao_as_attribute = false;  ///< writes occlusion as an attribute, not in the colours
  SmoothOcclusionOptions field_occlusion;
  bool has_field_occlusion = false;  ///< an option of `field_occlusion` was given
  bool watertight = false;
  std::optional<double> iso;
  std::optional<double> simplify;
  std::optional<double> smoothness;  ///< for smooth surfaces around voxels
  std::optional<SurfaceColours> colours;
  bool is_atlas = false;              ///< an atlas instead of a palette, or of images per texture
  std::optional<LightOptions> light;  ///< propagated light, stored at vertices
  bool animate = false;               ///< writes all frames as a glTF animation
  double frames_per_second = 10.0;    ///< for `animate`
  bool separate_models = false;       ///< meshes touching instances separately
  std::optional<double> scale;
  std::optional<double> voxel_mm;     ///< millimetres per voxel in .stl and .3mf
  std::optional<UpAxis> up;           ///< default: z for .ply, .stl and .3mf, else y
  bool compress = false;              ///< see MeshFileOptions, glTF only
  bool quantize = false;              ///< see MeshFileOptions, glTF only
  std::string mesh_input;             ///< a given option that only applies to triangle meshes, or ""
  bool lights = false;                ///< writes lamps and cameras, glTF only
  std::vector<FileCamera> cameras{};  ///< the cameras of the input, for `lights`
  bool as_voxels = false;             ///< --solid: converts fields to voxels even if OUT can hold fields
  bool watch = false;                 ///< converts again when the input changes
};

/// Options for converting several files.
struct ManyOptions {
  std::vector<std::filesystem::path> inputs;  ///< files and folders
  std::optional<std::filesystem::path> folder;
  std::string to;  ///< an extension, with or without its dot
  bool recursive = false;
};

/// The arguments of `quoin convert`.
struct ConvertArguments {
  ConvertOptions options;
  ManyOptions many;
  std::vector<std::filesystem::path> rest;  ///< the file names after IN: OUT or, with --to, more input files
  std::optional<FormatInfo> format;         ///< of the output; set by settle

  /// Returns true if OUT is standard output.
  [[nodiscard]] bool is_to_stream() const { return rest.size() == 1 && rest.front() == kStandardStream; }
  /// Returns true if all files are inputs. --to names the format of the outputs.
  [[nodiscard]] bool has_many_inputs() const { return !many.to.empty() && !is_to_stream(); }
};

/// Adds the options of the command, which CLI11 reads into `arguments`.
void add_convert_options(CLI::App& command, ConvertArguments& arguments);

/// After parsing: checks the rules between options and sets what follows from several options.
/// Errors: InvalidArgument, for a command line that breaks a rule; Unsupported, for an output format that does not
/// fit the options.
[[nodiscard]] Status settle(const CLI::App& command, ConvertArguments& arguments);

}  // namespace quoin::tool
