#include "light/propagated/light_quads.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>

#include <quoin/core/direction.h>

namespace quoin::propagated {
namespace {

// The light in front of a quad's faces: [u + width * v].
struct QuadLight {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> words;

  [[nodiscard]] std::uint16_t& at(int u, int v) { return words[static_cast<std::size_t>(u + width * v)]; }
  [[nodiscard]] bool is_uniform() const {
    return std::all_of(words.begin(), words.end(), [&](std::uint16_t word) { return word == words.front(); });
  }
  // How far the light of a cell goes on along u, and then along v.
  [[nodiscard]] std::pair<int, int> extent(int u, int v, const std::vector<bool>& done) {
    const std::uint16_t word = at(u, v);
    const auto is_free = [&](int x, int y) {
      return !done[static_cast<std::size_t>(x + width * y)] && at(x, y) == word;
    };
    int right = u + 1;
    while (right < width && is_free(right, v)) ++right;
    int top = v + 1;
    const auto is_row = [&](int y) {
      for (int x = u; x < right; ++x) {
        if (!is_free(x, y)) return false;
      }
      return true;
    };
    while (top < height && is_row(top)) ++top;
    return {right - u, top - v};
  }
};

// Light in a chunk and one voxel around it. Rows are unpacked when one of their voxels is asked for: there are several
// faces a row.
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
  std::vector<bool> done;
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
    done.assign(of_quad.words.size(), false);
    for (int v = 0; v < quad.size_v(); ++v) {
      for (int u = 0; u < quad.size_u(); ++u) {
        if (done[static_cast<std::size_t>(u + of_quad.width * v)]) continue;
        const auto [along_u, along_v] = of_quad.extent(u, v, done);
        for (int y = v; y < v + along_v; ++y) {
          for (int x = u; x < u + along_u; ++x) done[static_cast<std::size_t>(x + of_quad.width * y)] = true;
        }
        out.push_back(quad_part(quad, u, v, along_u, along_v));
        light.push_back(of_quad.at(u, v));
      }
    }
  }
}

}  // namespace quoin::propagated
