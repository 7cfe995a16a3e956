#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/volume.h>
#include <quoin/light/light_options.h>
#include <quoin/scene/scene_animation.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_meshes.h>

#include "commands.h"
#include "output.h"
#include "output_files.h"
#include "progress_bar.h"
#include "scene_content.h"
#include "watch.h"

namespace quoin::tool {

/// What `quoin convert` was asked for.
struct ConvertOptions {
  CommonOptions common;
  std::filesystem::path output;
  FileSet inputs;    ///< what is never replaced: all that are read
  std::string from;  ///< the only format that is read; empty: any
  bool force = false;
  bool is_from_stream = false;  ///< IN is standard input, which has no name
  bool is_one_of_many = false;  ///< shows no progress of its own
  std::string mesher;           ///< empty: greedy for voxels, smooth for volumes
  bool occlusion_off = false;
  bool occlusion_apart = false;  ///< as an attribute, not in the colours
  SmoothOcclusionOptions field_occlusion;
  bool has_field_occlusion = false;  ///< one of its options was given
  bool watertight = false;
  std::optional<double> iso;
  std::optional<double> simplify;
  std::optional<double> smoothness;  ///< of smooth surfaces around voxels
  std::optional<std::string> colours;
  std::string texture = "palette";    ///< or "atlas"
  std::optional<LightOptions> light;  ///< propagated, at vertices
  bool animate = false;               ///< all frames, as an animation of glTF
  double frames_per_second = 10.0;    ///< of `animate`
  bool apart = false;                 ///< instances are not united
  std::optional<double> scale;
  std::optional<double> voxel_mm;     ///< millimetres a voxel, of files for printing
  std::string up;                     ///< "y", "z"; empty: z for .ply, .stl and .3mf, else y
  bool compress = false;              ///< of glTF, as MeshFileOptions has it
  bool quantize = false;              ///< of glTF, as MeshFileOptions has it
  bool mesh_only = false;             ///< any option that only meshes heed was given
  std::string mesh_input;             ///< an option that is of triangles alone, if one was given
  bool lights = false;                ///< of glTF: lamps and cameras too
  std::vector<FileCamera> cameras{};  ///< of the file, where `lights` wants them
  bool as_voxels = false;             ///< --solid: fields become voxels in formats that hold fields too
  bool watch = false;                 ///< goes on whenever the input changes
};

struct Seconds {
  double read = 0;
  double mesh = 0;
  double write = 0;
};

/// What came of it.
struct Outcome {
  bool is_volume = false;
  SceneContent content;  ///< of a volume its solid samples alone
  std::string mesher;    ///< empty: nothing was meshed
  MeshStats meshes;
  FaceCounts faces;           ///< of blocks
  std::optional<double> iso;  ///< of volumes
  bool is_iso_found = false;  ///< between two groups of values rather than given, or all there is
  std::uint64_t bytes = 0;
  std::vector<std::filesystem::path> files;  ///< all that were written, OUT first
  Seconds seconds;
  std::vector<std::string> warnings;
};

/// Converts one file. Where the options contradict what the file holds, `fault` says how, as the error does.
[[nodiscard]] Result<Outcome> convert_file(const ConvertOptions& options, const FormatInfo& format, std::string& fault);

/// Returns true for formats that hold voxels and no fields.
[[nodiscard]] inline bool holds_only_voxels(const FormatInfo& format) {
  return !format.is_mesh && !format.is_volume && format.format != FileFormat::Scene &&
         format.format != FileFormat::World && format.format != FileFormat::Vdb;
}

/// Puts voxels in place of all fields of a scene: one for each solid sample.
void make_voxels_of_fields(Scene& scene, Threads threads, std::vector<std::string>& warnings);

/// Turns instances that no quarter turns place to the nearest ones.
void turn_by_quarters(Scene& scene, std::vector<std::string>& warnings);

/// Makes voxels one unit long, for formats whose voxels have no size. The first instance moves to the origin, the
/// others stay where they are relative to it.
void stand_at_unit_size(Scene& scene, const FormatInfo& format, std::vector<std::string>& warnings);

/// Adds lamps and cameras where they are wanted; else warns of lamps.
void add_lights(const Scene& scene, const ConvertOptions& options, SceneMeshes& meshes,
                std::vector<std::string>& warnings);

/// Whether a format is for printers: meshes are to be closed.
[[nodiscard]] inline bool is_for_printing(FileFormat format) {
  return format == FileFormat::Stl || format == FileFormat::ThreeMf;
}

/// What is wrong with the options for files of a format; empty when nothing is.
[[nodiscard]] std::string fault_of_format(const ConvertOptions& options, const FormatInfo& format);

[[nodiscard]] Json outcome_json(const Outcome& outcome);

/// What makes many files of many.
struct ManyOptions {
  std::vector<std::filesystem::path> inputs;  ///< files and folders
  std::optional<std::filesystem::path> folder;
  std::string to;  ///< an ending, with its dot or without
  bool recursive = false;
};

/// By input, what it and all that is read beside it were when it was converted.
using Converted = std::map<std::filesystem::path, Stamps>;

/// Converts each of the inputs, several at once; those that fail are named last. `done`: for `options.watch`, those
/// that are in it are left out until they change; gets what is converted now.
[[nodiscard]] WatchedWork run_many(const ConvertOptions& options, const ManyOptions& many, Converted& done);

/// Writes what has been meshed, filling in `outcome`.
[[nodiscard]] Status write_meshes(SceneMeshes& meshes, const ConvertOptions& options, ProgressBar& bar,
                                  Outcome& outcome);

/// Meshes a scene smoothly and writes it, filling in `outcome`. With `options.animate` it is that of the animation.
[[nodiscard]] Status convert_smoothly(const Scene& scene, const SceneAnimation& animation,
                                      const ConvertOptions& options, Outcome& outcome);

/// Copies a world (.quoin) to another, row by row.
[[nodiscard]] Result<Outcome> copy_world_file(const ConvertOptions& options);

/// Counts the faces of the world OUT, for --json: it takes a second reading of the world.
[[nodiscard]] Status count_faces_of_output(const ConvertOptions& options, Outcome& outcome);

/// Whether what is asked for is made of a world chunk by chunk.
[[nodiscard]] bool meshes_by_chunks(const ConvertOptions& options);
/// Meshes a world (.quoin) chunk by chunk and writes it; nothing, and nothing is written, where it holds densities.
[[nodiscard]] Result<std::optional<Outcome>> mesh_world_file(const ConvertOptions& options);

/// Reads a volume, meshes it and writes it.
[[nodiscard]] Result<Outcome> convert_volume(const ConvertOptions& options, const FormatInfo& format);

}  // namespace quoin::tool
