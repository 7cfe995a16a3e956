#include <cstdint>
#include <cstdlib>

#include <glm/geometric.hpp>
#include <quoin/io/scene_file.h>

/// Any bytes must give an error or a scene whose numbers can be used.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto scene = quoin::parse_scene_file({reinterpret_cast<const std::byte*>(data), size});
  if (!scene) return 0;
  for (const auto& placement : scene->placements) {
    const double length = glm::length(placement.rotation);
    if (!(length > 0.999 && length < 1.001) || !quoin::is_finite(placement.position) || !(placement.scale > 0.0))
      abort();
  }
  if (scene->sun && !(glm::length(*scene->sun) > 0.999)) abort();
  return 0;
}
