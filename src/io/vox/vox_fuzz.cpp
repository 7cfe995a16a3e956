#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "io/vox/vox_for_tests.h"

/// Any bytes must give a scene or an error, and a scene must survive writing and reading again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  // The length chooses the options, so that every input has one meaning.
  const bool second = size % 2 == 1;
  const std::string wrong = quoin::vox_test::wrong_with(bytes, {.show_hidden = second, .frame = second ? 1 : 0});
  if (!wrong.empty()) {
    std::fprintf(stderr, "%s\n", wrong.c_str());
    std::abort();
  }
  return 0;
}
