#pragma once

#include <CLI/CLI.hpp>
#include <memory>

namespace quoin::tool {

/// Headings of options in `--help`. `--help-all` also prints the options under the others.
namespace heading {
inline constexpr const char* kInput = "Input";
inline constexpr const char* kOutput = "Output";
inline constexpr const char* kGeneral = "General";
inline constexpr const char* kCamera = "Camera";
inline constexpr const char* kLight = "Light";
inline constexpr const char* kMesh = "Meshes";
// Only in --help-all.
inline constexpr const char* kSeries = "Image series and videos";
inline constexpr const char* kOcclusion = "Ambient occlusion";
inline constexpr const char* kPathTracing = "Path tracing (--light path)";
inline constexpr const char* kDetail = "Levels of detail";
inline constexpr const char* kDevice = "Graphics device";
inline constexpr const char* kMeshFile = "Mesh files";
inline constexpr const char* kManyFiles = "Many files (--to)";
inline constexpr const char* kWorlds = "Minecraft and Luanti worlds";
inline constexpr const char* kVolumes = "Volumes";
inline constexpr const char* kTriangles = "Triangle meshes as input (.obj, .glb, .gltf, .ply, .stl, .3mf, .off)";
inline constexpr const char* kHeights = "Heights";
}  // namespace heading

/// Sets the heading of all options added to the command from now on.
inline void set_heading(CLI::App& command, const char* name) {
  command.option_defaults()->group(name);
}

/// Returns the type of an option's value in help texts, such as "N", "X", "NAME" or "FILE". Empty for a flag.
[[nodiscard]] std::string value_type(const CLI::Option& option);

/// Prints help with an example first, options under headings, and lines of at most 100 columns.
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> help_formatter();

}  // namespace quoin::tool
