#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "io/vdb/vdb.h"

/// Any bytes must give trees whose leaves have all their values, or an error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  const auto file = quoin::vdb::is_nvdb(bytes) ? quoin::vdb::read_nvdb_file(bytes) : quoin::vdb::read_vdb_file(bytes);
  if (!file) return 0;
  for (const auto& grid : file->grids) {
    const bool is_mask = grid.meaning == quoin::vdb::Meaning::Mask;
    if (is_mask || grid.values.size() == grid.leaves.size() * quoin::vdb::kLeafVoxels) continue;
    std::fprintf(stderr, "leaves without values\n");
    std::abort();
  }
  return 0;
}
