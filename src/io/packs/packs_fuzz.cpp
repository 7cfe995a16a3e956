#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "io/packs/packs_for_tests.h"

/// Any bytes must give looks or errors.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  if (!quoin::packs_test::reads_any_pack(bytes)) {
    std::fprintf(stderr, "an invalid type\n");
    std::abort();
  }
  return 0;
}
