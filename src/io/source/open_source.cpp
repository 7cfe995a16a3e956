#include <system_error>

#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>

#include "io/minecraft/minecraft_source.h"
#include "io/source/luanti_map.h"

namespace quoin {

namespace fs = std::filesystem;

bool is_world_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error) && (minecraft::is_minecraft_folder(path) || is_luanti_folder(path));
}

bool is_read_by_chunks(std::optional<FileFormat> format) {
  return format == FileFormat::Minecraft || format == FileFormat::LuantiMap;
}

Result<std::unique_ptr<ChunkSource>> open_chunk_source(const fs::path& path) {
  const auto format = detect_format(path);
  if (!format && !is_world_folder(path)) return format.error();
  if (format && *format == FileFormat::LuantiMap) return open_luanti(path);
  return minecraft::open_minecraft(path);
}

}  // namespace quoin
