#include "io/source/luanti_map.h"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "io/byte_reader.h"

namespace quoin {

bool is_luanti_map(std::span<const std::byte> beginning) {
  constexpr std::string_view kHeader{"SQLite format 3\0", 16};
  constexpr std::size_t kIdAt = 68;
  const std::string_view text = text_of(beginning);
  if (!text.starts_with(kHeader) || text.size() < kIdAt + 4) return false;
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

bool is_luanti_folder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path / "world.mt", error);
}

}  // namespace quoin
