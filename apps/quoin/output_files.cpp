#include "output_files.h"

#include <quoin/io/file.h>

namespace quoin::tool {

Status check_outputs(std::initializer_list<std::filesystem::path> files) {
  for (const auto& path : files) {
    if (path.empty()) continue;
    if (auto file = AtomicFile::create(path); !file) return file.error();
  }
  return {};
}

}  // namespace quoin::tool
