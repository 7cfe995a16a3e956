#include "render_vk/trees/shader_memory.h"

#include <algorithm>

#include <quoin/core/assert.h>

namespace quoin::vulkan {

Result<Place> ShaderBytes::allocate(std::uint64_t size, const std::string& doing) {
  const std::uint64_t begin = bytes_.size();
  QUOIN_ASSERT(begin % kAlignment == 0 && begin <= kMost, "an aligned address below 1 GiB");
  const std::uint64_t left = kMost - begin;
  const std::uint64_t room = size > left ? size : (size + kAlignment - 1) / kAlignment * kAlignment;
  if (room > left) return make_error(ErrorCode::LimitExceeded, doing + ": more than 1 GiB for shaders");
  bytes_.resize(static_cast<std::size_t>(begin + room));
  return Place{0, begin, room, begin};
}

Status ShaderBytes::write(const Place& place, std::span<const std::byte> bytes, std::uint64_t offset) {
  QUOIN_ASSERT(offset + bytes.size() <= place.size || bytes.empty(), "bytes within the place");
  QUOIN_ASSERT(place.offset + place.size <= bytes_.size(), "an allocated place");
  std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(place.offset + offset));
  return {};
}

}  // namespace quoin::vulkan
