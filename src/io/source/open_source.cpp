#include <system_error>

#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>

#include "io/minecraft/minecraft_source.h"
#include "io/source/detect_world.h"
#include "io/source/luanti_map.h"

namespace quoin {

namespace fs = std::filesystem;

std::optional<FileFormat> detect_world(const fs::path& path) {
  std::error_code error;
  if (is_world_folder(path)) {
    return minecraft::is_minecraft_folder(path) ? FileFormat::Minecraft : FileFormat::LuantiMap;
  }
  // Also accepts worlds without regions: their reader reports the missing files.
  const bool is_level = path.filename() == "level.dat" && fs::is_regular_file(path, error);
  const bool has_level = fs::is_directory(path, error) && fs::is_regular_file(path / "level.dat", error);
  return is_level || has_level ? std::optional(FileFormat::Minecraft) : std::nullopt;
}

bool is_world_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error) && (minecraft::is_minecraft_folder(path) || is_luanti_folder(path));
}

bool is_read_by_chunks(std::optional<FileFormat> format) {
  return format == FileFormat::Minecraft || format == FileFormat::LuantiMap;
}

Result<std::unique_ptr<ChunkSource>> open_chunk_source(const fs::path& path, std::string_view dimension) {
  const auto format = detect_format(path);
  if (!format && !is_world_folder(path)) return format.error();
  if (format && *format == FileFormat::LuantiMap) return open_luanti(path);
  return minecraft::open_minecraft(path, dimension);
}

}  // namespace quoin
