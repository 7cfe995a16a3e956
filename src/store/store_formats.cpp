#include "store/store_formats.h"

#include <bit>
#include <string_view>

#include <quoin/store/world_saver.h>

#include "core/bytes/bytes.h"
#include "io/format_driver.h"

namespace quoin {

namespace {

constexpr std::string_view kSqliteHeader{"SQLite format 3\0", 16};
constexpr std::size_t kIdAt = 68;  // the application id

}  // namespace

bool is_world_format(std::span<const std::byte> beginning) {
  return beginning.size() >= kWorldHeaderBytes && text_of(beginning).starts_with(kSqliteHeader) &&
         load<std::uint32_t>(beginning.data() + kIdAt, std::endian::big) == kWorldApplicationId;
}

namespace {

constinit const FormatDriver kWorldFormat = {
    .info = {FileFormat::World, ".quoin", "Quoin world, can be larger than memory",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Fields |
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

// Registers the format before main. The library's users link with `-u quoin_store_formats` (see CMakeLists.txt), since
// linkers drop objects of a static library that nothing refers to.
extern "C" [[gnu::visibility("hidden")]] const bool quoin_store_formats = quoin::register_format(quoin::kWorldFormat);
