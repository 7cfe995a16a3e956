#include <system_error>

#include <quoin/io/chunk_source.h>

#include "io/minecraft/minecraft_source.h"

namespace quoin {

bool is_world_folder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) && minecraft::is_minecraft_folder(path);
}

Result<std::unique_ptr<ChunkSource>> open_chunk_source(const std::filesystem::path& path) {
  return minecraft::open_minecraft(path);
}

}  // namespace quoin
