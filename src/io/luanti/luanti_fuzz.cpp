#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "io/luanti/luanti.h"

/// Any bytes must give a block whose nodes have names, or an error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static quoin::luanti::MapBlockReader reader;
  static quoin::luanti::MapBlock block;
  if (!reader.read({reinterpret_cast<const std::byte*>(data), size}, block)) return 0;
  for (const std::uint16_t node : block.nodes) {
    if (node < block.names.size()) continue;
    std::fprintf(stderr, "a node without a name\n");
    std::abort();
  }
  return 0;
}
