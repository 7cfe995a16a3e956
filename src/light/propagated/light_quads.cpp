#include "light/propagated/light_quads.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>

#include "light/quad_cutter.h"

namespace quoin::propagated {
namespace {

// The light in front of a quad's faces: [u + width * v].
struct QuadLight {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> words;

  [[nodiscard]] std::uint16_t at(int u, int v) const {
    QUOIN_ASSERT(u >= 0 && u < width && v >= 0 && v < height, "a face of the quad");
    return words[static_cast<std::size_t>(u + width * v)];
  }
  [[nodiscard]] bool is_uniform() const {
    return std::all_of(words.begin(), words.end(), [&](std::uint16_t word) { return word == words.front(); });
  }
};

// A rectangle of constant light.
struct LightPiece {
  const QuadLight& light;
  std::uint16_t word;
  static constexpr bool goes_along_u = true;
  static constexpr bool goes_along_v = true;

  [[nodiscard]] bool joins(int u, int v) const { return light.at(u, v) == word; }
};

// The light in a chunk and one voxel around it. Rows are unpacked on demand: there are several faces per row.
class ChunkWords {
 public:
  void begin(const LightReader& reader, IVec3 chunk) {
    reader_.emplace(reader);
    low_ = chunk * kChunkEdge;
    words_.resize(kRows * kChunkEdge);
    is_read_.assign(kRows, false);
  }
  /// In the chunk's coordinates, -1 to 64.
  [[nodiscard]] std::uint16_t at(IVec3 voxel) {
    if (voxel.x < 0 || voxel.x >= kChunkEdge) return reader_->at(low_ + voxel);
    const auto row = static_cast<std::size_t>((voxel.y + 1) + kStride * (voxel.z + 1));
    QUOIN_ASSERT(row < kRows, "a row of the chunk or next to it");
    std::uint16_t* words = words_.data() + row * kChunkEdge;
    if (!is_read_[row]) {
      is_read_[row] = true;
      reader_->read_row(low_ + IVec3(0, voxel.y, voxel.z), std::span<std::uint16_t, kChunkEdge>(words, kChunkEdge));
    }
    return words[voxel.x];
  }

 private:
  static constexpr int kStride = kChunkEdge + 2;
  static constexpr std::size_t kRows = std::size_t{kStride} * kStride;
  std::optional<LightReader> reader_;
  IVec3 low_{0};
  std::vector<std::uint16_t> words_;   // [z + 1][y + 1][x]
  std::vector<std::uint8_t> is_read_;  // [z + 1][y + 1]
};

}  // namespace

void split_quads(const LightReader& reader, const QuadBuffer& quads, IVec3 chunk, QuadBuffer& out,
                 std::vector<std::uint16_t>& light) {
  out.clear();
  light.clear();
  thread_local ChunkWords words;
  words.begin(reader, chunk);
  QuadLight of_quad;
  QuadCutter cutter;
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    const IVec3 first = quad.voxel() + normal_of(quad.direction());
    if (quad.size_u() == 1 && quad.size_v() == 1) {
      out.push_back(quad);
      light.push_back(words.at(first));
      continue;
    }
    of_quad.width = quad.size_u();
    of_quad.height = quad.size_v();
    of_quad.words.clear();
    for (int v = 0; v < quad.size_v(); ++v) {
      for (int u = 0; u < quad.size_u(); ++u) {
        IVec3 at = first;
        at[frame.u] += u;
        at[frame.v] += v;
        of_quad.words.push_back(words.at(at));
      }
    }
    if (of_quad.is_uniform()) {
      out.push_back(quad);
      light.push_back(of_quad.words.front());
      continue;
    }
    const auto start = [&](int u, int v) { return LightPiece{of_quad, of_quad.at(u, v)}; };
    cutter.cut(of_quad.width, of_quad.height, start, [&](int u, int v, int along_u, int along_v) {
      out.push_back(quad_part(quad, u, v, along_u, along_v));
      light.push_back(of_quad.at(u, v));
    });
  }
  QUOIN_ASSERT(light.size() == out.size(), "one light per quad");
}

}  // namespace quoin::propagated
