#pragma once

#include <cstdint>

namespace quoin {

/// A stretch of a glTF buffer; `offset` and `bytes` are multiples of four but for images and short indices.
struct GltfView {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
};

/// A view at the end of the buffer, which moves on to the next multiple of four.
[[nodiscard]] inline GltfView reserve_view(std::uint64_t bytes, std::uint64_t& end) {
  constexpr std::uint64_t kAlignment = 4;
  const GltfView view{end, bytes};
  end += (bytes + kAlignment - 1) / kAlignment * kAlignment;
  return view;
}

/// Whether indices into that many vertices take 32 bits instead of 16. 65,535 restarts a strip, so the largest 16-bit
/// index is 65,534; one less for clients that count it among the vertices.
[[nodiscard]] inline bool needs_wide_indices(std::uint64_t vertices) {
  constexpr std::uint64_t kShortIndexVertices = 65'535;
  return vertices >= kShortIndexVertices;
}

}  // namespace quoin
