#include "store/store_formats.h"

#include <quoin/io/image_files.h>
#include <quoin/store/world_saver.h>

#include "io/format_driver.h"
#include "io/scene_file/scene_parts.h"

namespace quoin {

namespace {

constinit const FormatDriver kWorldFormat = {
    .info = {FileFormat::World, ".quoin", "Quoin world, can be larger than memory",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Fields | FormatCapability::Faces |
                 FormatCapability::Environment | FormatCapability::Camera | FormatCapability::Cameras},
    .detect = is_world_format,
    .source = FormatDriver::Source::Path,
    .read = [](const FormatInput& input) -> Result<LoadedScene> {
      return input.path.empty() ? read_world_format(input.bytes, input.options, input.threads, input.progress)
                                : read_world_format(input.path, input.options, input.threads, input.progress);
    },
    // Without the sky image: its name is in the database.
    .sidecar_files = [](const DetectedFile& file, SidecarFiles) -> std::vector<std::filesystem::path> {
      return {file.path.string() + "-wal"};
    },
    .write = [](const FormatOutput& output, const std::filesystem::path& path) -> Result<SavedScene> {
      return output.loaded != nullptr ? write_world(*output.loaded, path, output.threads, output.progress)
                                      : write_world(output.scene, path, output.threads, output.progress);
    },
};

}  // namespace

}  // namespace quoin

// Part of the library of formats: registers the format of worlds with it, and its reader of sky images with the core
// library, before main. Users link with `-u quoin_store_formats` (see CMakeLists.txt), since linkers drop objects of a
// static library that nothing refers to.
extern "C" [[gnu::visibility("hidden")]] const bool quoin_store_formats =
    quoin::register_format(quoin::kWorldFormat) && quoin::scene_json::register_sky_reader(quoin::read_radiance);
