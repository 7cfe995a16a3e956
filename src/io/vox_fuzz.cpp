#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "io/vox_test_support.h"

/// Any bytes must give a scene or an error, and a scene must survive writing and reading again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  for (const int frame : {0, 1}) {
    const std::string wrong = quoin::vox_test::wrong_with(bytes, {.hidden = frame == 1, .frame = frame});
    if (wrong.empty()) continue;
    std::fprintf(stderr, "%s\n", wrong.c_str());
    std::abort();
  }
  return 0;
}
