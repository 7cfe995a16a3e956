#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

namespace quoin {

/// Cuts the faces of quads into rectangles of matching faces: as far along u as possible, then along v.
class QuadCutter {
 public:
  /// `start(u, v)` returns an object that decides how a rectangle from that face may grow: `goes_along_u`,
  /// `goes_along_v` and `joins(u, v)`. `emit(u, v, along_u, along_v)` is called for each rectangle, by rows of first
  /// faces.
  template <class Start, class Emit>
  void cut(int width, int height, const Start& start, const Emit& emit) {
    QUOIN_ASSERT(width > 0 && height > 0, "a quad with faces");
    width_ = width;
    done_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), false);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        if (is_done(u, v)) continue;
        const auto [along_u, along_v] = extent(u, v, height, start(u, v));
        QUOIN_ASSERT(u + along_u <= width && v + along_v <= height, "a rectangle within the quad");
        for (int y = v; y < v + along_v; ++y) {
          const auto first = done_.begin() + (u + width * y);
          std::fill(first, first + along_u, true);
        }
        emit(u, v, along_u, along_v);
      }
    }
  }

 private:
  [[nodiscard]] bool is_done(int u, int v) const { return done_[static_cast<std::size_t>(u + width_ * v)]; }
  template <class Piece>
  [[nodiscard]] std::pair<int, int> extent(int u, int v, int height, const Piece& piece) const {
    const auto is_free = [&](int x, int y) { return !is_done(x, y) && piece.joins(x, y); };
    int right = u + 1;
    while (piece.goes_along_u && right < width_ && is_free(right, v)) ++right;
    const auto is_row_free = [&](int y) {
      for (int x = u; x < right; ++x) {
        if (!is_free(x, y)) return false;
      }
      return true;
    };
    int top = v + 1;
    while (piece.goes_along_v && top < height && is_row_free(top)) ++top;
    return {right - u, top - v};
  }

  int width_ = 0;
  std::vector<bool> done_;
};

}  // namespace quoin
