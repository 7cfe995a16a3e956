#include "store/store_formats.h"

#include <bit>
#include <string_view>
#include <system_error>

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

bool is_luanti_map(std::span<const std::byte> beginning) {
  const std::string_view text = text_of(beginning);
  if (!text.starts_with(kSqliteHeader) || text.size() < kIdAt + 4) return false;
  if (text.substr(kIdAt, 4) != std::string_view("\0\0\0\0", 4)) return false;  // the application id of another program
  // The first page lists the tables, as SQL.
  const std::size_t page =
      std::to_integer<std::size_t>(beginning[16]) << 8 | std::to_integer<std::size_t>(beginning[17]);
  const std::string_view tables = text.substr(0, page == 1 ? 65536 : page);
  constexpr std::string_view kTable = "CREATE TABLE ";
  for (std::size_t at = tables.find(kTable); at != std::string_view::npos; at = tables.find(kTable, at + 1)) {
    std::string_view name = tables.substr(at + kTable.size());
    if (name.starts_with("IF NOT EXISTS ")) name.remove_prefix(14);
    if (!name.empty() && (name.front() == '`' || name.front() == '"' || name.front() == '[')) name.remove_prefix(1);
    constexpr std::string_view kBlocks = "blocks";
    if (name.starts_with(kBlocks) && name.size() > kBlocks.size() &&
        std::string_view("`\"] (").find(name[kBlocks.size()]) != std::string_view::npos) {
      return true;
    }
  }
  return false;
}

namespace {

constinit const FormatDriver kWorldFormat = {
    .info = {FileFormat::World, ".quoin", "Quoin world, can be larger than memory",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Fields |
                 FormatCapability::Environment | FormatCapability::Camera | FormatCapability::Cameras},
    .detect = is_world_format,
    .reads_path = true,
    .read = [](const FormatInput& input) -> Result<LoadedScene> {
      return input.path.empty() ? read_world_format(input.bytes, input.options, input.threads, input.progress)
                                : read_world_format(input.path, input.options, input.threads, input.progress);
    },
    .sidecar_files = [](const std::filesystem::path& path) -> std::vector<std::filesystem::path> {
      return {path.string() + "-wal"};
    },
    .write = [](const FormatOutput& output, const std::filesystem::path& path) -> Result<SavedScene> {
      return output.loaded != nullptr ? write_world(*output.loaded, path, output.threads, output.progress)
                                      : write_world(output.scene, path, output.threads, output.progress);
    },
};

constinit const FormatDriver kLuantiFormat = {
    .info = {FileFormat::LuantiMap, ".sqlite", "Luanti world: its folder or map.sqlite",
             FormatCapability::Read | FormatCapability::Chunks},
    .detect_path =
        [](const std::filesystem::path& path) {
          std::error_code error;
          return std::filesystem::is_regular_file(path / "world.mt", error);
        },
    .detect = is_luanti_map,
    .reads_path = true,
    .open_chunks = [](const std::filesystem::path& path, std::span<const std::byte> bytes, std::string_view)
        -> Result<std::unique_ptr<ChunkSource>> { return path.empty() ? open_luanti(bytes) : open_luanti(path); },
};

}  // namespace

}  // namespace quoin

// Registers the formats before main. The library's users link with `-u quoin_store_formats` (see CMakeLists.txt), since
// linkers drop objects of a static library that nothing refers to.
extern "C" [[gnu::visibility("hidden")]] const bool quoin_store_formats =
    quoin::register_format(quoin::kWorldFormat) && quoin::register_format(quoin::kLuantiFormat);
