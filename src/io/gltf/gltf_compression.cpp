#include <quoin/core/assert.h>

#include "io/gltf/gltf_layout.h"

#ifdef QUOIN_HAVE_MESHOPTIMIZER

#include <meshoptimizer.h>

#include <algorithm>
#include <cstring>
#include <mutex>

namespace quoin {

namespace {

/// Sets the codec versions that EXT_meshopt_compression requires. meshoptimizer keeps them in global variables.
void choose_versions() {
  static std::once_flag chosen;
  std::call_once(chosen, [] {
    meshopt_encodeVertexVersion(0);
    meshopt_encodeIndexVersion(1);
  });
}

template <class Index>
std::vector<std::uint32_t> indices_from(std::span<const std::byte> bytes) {
  std::vector<Index> narrow(bytes.size() / sizeof(Index));
  std::memcpy(narrow.data(), bytes.data(), narrow.size() * sizeof(Index));
  return {narrow.begin(), narrow.end()};
}

}  // namespace

bool can_compress_gltf() {
  return true;
}

std::vector<std::byte> compress_gltf_array(const GltfArray& array, std::span<const std::byte> bytes) {
  QUOIN_ASSERT(array.stride > 0 && bytes.size() % array.stride == 0, "whole elements");
  choose_versions();
  std::vector<std::byte> packed;
  const auto data = [&] { return reinterpret_cast<unsigned char*>(packed.data()); };
  if (array.kind == GltfArrayKind::Index) {
    const auto indices = array.component == GltfComponent::UnsignedInt ? indices_from<std::uint32_t>(bytes)
                                                                       : indices_from<std::uint16_t>(bytes);
    std::uint32_t vertices = 0;
    for (const std::uint32_t index : indices) vertices = std::max(vertices, index + 1);
    packed.resize(meshopt_encodeIndexBufferBound(indices.size(), vertices));
    packed.resize(meshopt_encodeIndexBuffer(data(), packed.size(), indices.data(), indices.size()));
  } else {
    const std::size_t count = bytes.size() / array.stride;
    packed.resize(meshopt_encodeVertexBufferBound(count, array.stride));
    packed.resize(meshopt_encodeVertexBuffer(data(), packed.size(), bytes.data(), count, array.stride));
  }
  QUOIN_ASSERT(!packed.empty(), "the codec takes it");
  packed.shrink_to_fit();
  return packed;
}

}  // namespace quoin

#else

namespace quoin {

bool can_compress_gltf() {
  return false;
}

std::vector<std::byte> compress_gltf_array(const GltfArray&, std::span<const std::byte>) {
  QUOIN_ASSERT(can_compress_gltf(), "the build has meshoptimizer");
  return {};
}

}  // namespace quoin

#endif
