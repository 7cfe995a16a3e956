#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/volume.h>
#include <quoin/render/light_options.h>
#include <quoin/scene/scene_animation.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_meshes.h>

#include "command_files.h"
#include "commands.h"
#include "output.h"
#include "run_control.h"
#include "watch.h"

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
  bool is_atlas = false;              ///< an atlas texture instead of a palette
  std::optional<LightOptions> light;  ///< propagated light, stored at vertices
  bool animate = false;               ///< writes all frames as a glTF animation
  double frames_per_second = 10.0;    ///< for `animate`
  bool separate_models = false;       ///< meshes touching instances separately
  std::optional<double> scale;
  std::optional<double> voxel_mm;     ///< millimetres per voxel in .stl and .3mf
  std::optional<UpAxis> up;           ///< default: z for .ply, .stl and .3mf, else y
  bool compress = false;              ///< see MeshFileOptions, glTF only
  bool quantize = false;              ///< see MeshFileOptions, glTF only
  bool mesh_only = false;             ///< an option that only applies to meshes was given
  std::string mesh_input;             ///< a given option that only applies to triangle meshes, or ""
  bool lights = false;                ///< writes lamps and cameras, glTF only
  std::vector<FileCamera> cameras{};  ///< the cameras of the input, for `lights`
  bool as_voxels = false;             ///< --solid: converts fields to voxels even if OUT can hold fields
  bool watch = false;                 ///< converts again when the input changes
};

struct Seconds {
  double read = 0;
  double mesh = 0;
  double write = 0;
};

/// The result of a conversion.
struct Outcome {
  bool is_volume = false;
  SceneContent content;          ///< for a volume only the solid samples
  std::optional<Mesher> mesher;  ///< nullopt: nothing was meshed
  MeshStats meshes;
  FaceCounts faces;           ///< block faces
  std::optional<double> iso;  ///< for volumes
  bool is_iso_found = false;  ///< chosen between two groups of values, not given
  std::uint64_t bytes = 0;
  std::vector<std::filesystem::path> files;  ///< all written files, OUT first
  Seconds seconds;
  std::vector<std::string> warnings;
};

/// Converts one file. If the options do not fit the content of the file, `fault` gets the message of the error.
[[nodiscard]] Result<Outcome> convert_file(const ConvertOptions& options, const FormatInfo& format, std::string& fault);

/// Returns true for formats that hold voxels and no fields.
[[nodiscard]] inline bool holds_only_voxels(const FormatInfo& format) {
  return !format.can(FormatCapability::Meshes) && !format.can(FormatCapability::Volume) &&
         !format.can(FormatCapability::Fields);
}

/// Replaces all fields of a scene by voxels, one per solid sample.
void make_voxels_of_fields(Scene& scene, Threads threads, std::vector<std::string>& warnings);

/// Rotates each instance to the nearest rotation by quarter turns.
void turn_by_quarters(Scene& scene, std::vector<std::string>& warnings);

/// Makes voxels one unit long, for formats whose voxels have no size. The first instance moves to the origin, the
/// others stay where they are relative to it.
void normalise_scale(Scene& scene, const FormatInfo& format, std::vector<std::string>& warnings);

/// Adds lamps and cameras if `options.lights` is set, else warns of lamps that are left out.
void add_lights(const Scene& scene, const ConvertOptions& options, SceneMeshes& meshes,
                std::vector<std::string>& warnings);

/// Returns an error message if the options do not fit the output format, else "".
[[nodiscard]] std::string find_format_error(const ConvertOptions& options, const FormatInfo& format);

[[nodiscard]] Json outcome_json(const Outcome& outcome);

/// Options for converting several files.
struct ManyOptions {
  std::vector<std::filesystem::path> inputs;  ///< files and folders
  std::optional<std::filesystem::path> folder;
  std::string to;  ///< an extension, with or without its dot
  bool recursive = false;
};

/// For each converted input, the stamps of its files at that time.
using Converted = std::map<std::filesystem::path, Stamps>;

/// Converts all inputs in parallel and prints the failures last. With `options.watch`, skips the inputs in `done` that
/// have not changed, and adds those converted now.
[[nodiscard]] WatchedWork run_many(const ConvertOptions& options, const ManyOptions& many, Converted& done);

/// Runs `quoin convert`. Returns the exit status.
[[nodiscard]] int run_convert(ConvertOptions& options, const ManyOptions& many);

/// Adds --size, --voxel, --solid, --surface, --field, --separating, --parity, --band, --max-colours and --input-up.
void add_mesh_input_options(CLI::App& command, MeshLoadOptions& options);

/// Returns the rules between these options.
[[nodiscard]] std::vector<OptionRule> mesh_input_rules();

/// Writes meshes and fills in `outcome`.
[[nodiscard]] Status write_meshes(SceneMeshes& meshes, const ConvertOptions& options, ProgressBar& bar,
                                  Outcome& outcome);

/// Meshes a scene smoothly, writes it and fills in `outcome`. With `options.animate`, the scene is that of `animation`.
[[nodiscard]] Status convert_smoothly(const Scene& scene, const SceneAnimation& animation,
                                      const ConvertOptions& options, Outcome& outcome);

/// Copies a world (.quoin) to another file, row by row.
[[nodiscard]] Result<Outcome> copy_world_file(const ConvertOptions& options);

/// Counts the faces of the world OUT for --json. Reads the world again.
[[nodiscard]] Status count_faces_of_output(const ConvertOptions& options, Outcome& outcome);

/// Returns true if the options allow meshing a world chunk by chunk.
[[nodiscard]] bool meshes_by_chunks(const ConvertOptions& options);
/// Meshes a world (.quoin) chunk by chunk and writes it. Returns nullopt and writes no file if it holds densities.
[[nodiscard]] Result<std::optional<Outcome>> mesh_world_file(const ConvertOptions& options);

/// Reads a volume, meshes it and writes the mesh.
[[nodiscard]] Result<Outcome> convert_volume(const ConvertOptions& options, const FormatInfo& format);

}  // namespace quoin::tool
