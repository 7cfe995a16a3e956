#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/volume.h>
#include <quoin/scene/scene_animation.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_meshes.h>

#include "command_files.h"
#include "commands.h"
#include "convert/convert_arguments.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {

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

/// The result of convert_file: an outcome, or an error with the exit status of the tool.
class Conversion : public Result<Outcome> {
 public:
  Conversion(Result<Outcome> result) : Result<Outcome>(std::move(result)) {}
  Conversion(Outcome outcome) : Result<Outcome>(std::move(outcome)) {}
  Conversion(Error error) : Result<Outcome>(std::move(error)) {}

  /// Returns the result for options that do not fit the input.
  [[nodiscard]] static Conversion wrong_usage(Error error) {
    Conversion refused(std::move(error));
    refused.exit_status_ = kWrongUsage;
    return refused;
  }

  /// Returns the exit status for the error.
  [[nodiscard]] int exit_status() const { return exit_status_; }

 private:
  int exit_status_ = kFailed;
};

/// Converts one file to `format`.
[[nodiscard]] Conversion convert_file(const ConvertOptions& options, const FormatInfo& format);

/// Checks --from. Errors: BadFormat.
[[nodiscard]] Status check_input_format(const ConvertOptions& options, const OpenedInput& input);

/// Checks the rules that need the opened input, before its content is read. `to`: the format of the output.
/// Errors: InvalidArgument, without a path.
[[nodiscard]] Status check_input_rules(const ConvertOptions& options, const FormatInfo& to, const OpenedInput& input);

/// Checks the rules that need the mesher, which may depend on the content of the input.
/// Errors: InvalidArgument, without a path.
[[nodiscard]] Status check_mesher_rules(const ConvertOptions& options, Mesher mesher);

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

[[nodiscard]] Json outcome_json(const Outcome& outcome);

/// For each converted input, the stamps of its files at that time.
using Converted = std::map<std::filesystem::path, Stamps>;

/// Converts all inputs in parallel and prints the failures last. With --watch, skips the inputs in `done` that
/// have not changed, and adds those converted now.
[[nodiscard]] WatchedWork run_many(const ConvertArguments& arguments, Converted& done);

/// Writes meshes and fills in `outcome`.
[[nodiscard]] Status write_meshes(SceneMeshes& meshes, const ConvertOptions& options, ProgressBar& bar,
                                  Outcome& outcome);

/// Meshes a scene smoothly, writes it and fills in `outcome`. With `options.animate`, the scene is that of `animation`.
[[nodiscard]] Status convert_smoothly(const Scene& scene, const SceneAnimation& animation,
                                      const ConvertOptions& options, Outcome& outcome);

/// Reads a scene and converts it to `format`.
[[nodiscard]] Conversion convert_scene(const ConvertOptions& options, const FormatInfo& format,
                                       const OpenedInput& input);

/// Meshes a scene, writes it and returns the completed `outcome`. `watch` has measured the time of reading.
[[nodiscard]] Conversion convert_to_meshes(const ConvertOptions& options, LoadedScene& loaded, Outcome outcome,
                                           Stopwatch& watch);

/// Converts a world of any size chunk by chunk to a .quoin file.
[[nodiscard]] Result<Outcome> convert_by_chunks(const ConvertOptions& options, const DetectedFile& file);

/// Copies a world (.quoin) to another file, row by row.
[[nodiscard]] Result<Outcome> copy_world_file(const ConvertOptions& options);

/// Counts the faces of the world OUT for --json. Reads the world again.
[[nodiscard]] Status count_faces_of_output(const ConvertOptions& options, Outcome& outcome);

/// Returns true if the options allow meshing a world chunk by chunk.
[[nodiscard]] bool meshes_by_chunks(const ConvertOptions& options);
/// Meshes a world (.quoin) chunk by chunk and writes it. Returns nullopt and writes no file if it holds densities.
[[nodiscard]] Result<std::optional<Outcome>> mesh_world_file(const ConvertOptions& options);

/// Reads a volume, meshes it and writes the mesh.
[[nodiscard]] Result<Outcome> convert_volume(const ConvertOptions& options, const FormatInfo& format,
                                             const DetectedFile& file);

}  // namespace quoin::tool
