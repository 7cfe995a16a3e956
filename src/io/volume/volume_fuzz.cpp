#include <cstdio>
#include <cstdlib>

#include "io/volume/volume_for_tests.h"

/// Any bytes must give a consistent volume within the limit, or an error of one line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string wrong = quoin::volume_test::wrong_with({reinterpret_cast<const std::byte*>(data), size});
  if (!wrong.empty()) {
    std::fprintf(stderr, "%s\n", wrong.c_str());
    std::abort();
  }
  return 0;
}
