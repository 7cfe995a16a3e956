#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

// Patterns of the own pack's textures, drawn by code. They have no colour: a texture gives each layer its own.

namespace quoin::packs {

inline constexpr int kPatternSize = 16;

/// A texel of a pattern: brightness relative to the other texels, in sRGB, and alpha. Both are 0 to 1.
struct PatternTexel {
  float grey = 0.0F;
  float alpha = 0.0F;
};

/// Rows from the top, texels from the left.
using Pattern = std::array<PatternTexel, kPatternSize * kPatternSize>;

/// Draws a pattern by name: "planks", or "wheat5" for a pattern with a number. Patterns of whole faces repeat without
/// seams. Returns nullopt for unknown names. Cost: some 10 us.
[[nodiscard]] std::optional<Pattern> draw_pattern(std::string_view name);
[[nodiscard]] bool has_pattern(std::string_view name);

/// A drawing of 16x16 texels. Columns count from the left, rows from the top; positions outside have no effect.
class PatternCanvas {
 public:
  /// A repeatable random number in [0, 1).
  [[nodiscard]] static float random(int x, int y, int seed) {
    auto h = static_cast<std::uint32_t>(x) * 0x8DA6B343U ^ static_cast<std::uint32_t>(y) * 0xD8163841U ^
             static_cast<std::uint32_t>(seed) * 0xCB1AB31FU;
    h = (h ^ h >> 15) * 0x2C1B3C6DU;
    h = (h ^ h >> 12) * 0x297A2D39U;
    return static_cast<float>((h ^ h >> 15) & 0xFFFFU) / 65'536.0F;
  }

  void set(int x, int y, float grey, float alpha = 1.0F) {
    if (x < 0 || y < 0 || x >= kPatternSize || y >= kPatternSize) return;
    texels_[static_cast<std::size_t>(x + kPatternSize * y)] = {std::clamp(grey, 0.02F, 1.0F), alpha};
  }
  [[nodiscard]] PatternTexel at(int x, int y) const {
    return texels_[static_cast<std::size_t>((x & 15) + kPatternSize * (y & 15))];
  }
  void clear(int x, int y) {
    if (x >= 0 && y >= 0 && x < kPatternSize && y < kPatternSize) texels_[static_cast<std::size_t>(x + 16 * y)] = {};
  }
  /// Multiplies the brightness of a visible texel.
  void shade(int x, int y, float factor) {
    if (x < 0 || y < 0 || x >= kPatternSize || y >= kPatternSize) return;
    PatternTexel& texel = texels_[static_cast<std::size_t>(x + kPatternSize * y)];
    texel.grey = std::clamp(texel.grey * factor, 0.02F, 1.0F);
  }

  template <class Draw>
  void each(Draw draw) {
    for (int y = 0; y < kPatternSize; ++y) {
      for (int x = 0; x < kPatternSize; ++x) draw(x, y);
    }
  }
  void fill(float grey, float alpha = 1.0F) {
    each([&](int x, int y) { set(x, y, grey, alpha); });
  }
  void box(int x0, int y0, int x1, int y1, float grey, float alpha = 1.0F) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) set(x, y, grey, alpha);
    }
  }
  /// Draws the outline of a rectangle, light at the upper left and dark at the lower right.
  void bevel(int x0, int y0, int x1, int y1, float light, float dark) {
    for (int x = x0; x < x1; ++x) {
      set(x, y0, light);
      set(x, y1 - 1, dark);
    }
    for (int y = y0; y < y1; ++y) {
      set(x0, y, light);
      set(x1 - 1, y, dark);
    }
  }
  /// Multiplies all visible texels by random factors in [1 - amount, 1 + amount].
  void grain(float amount, int seed) {
    each([&](int x, int y) { shade(x, y, 1.0F + amount * (2.0F * random(x, y, seed) - 1.0F)); });
  }
  /// Draws a disc, lighter at the upper left.
  void disc(float cx, float cy, float radius, float grey, float relief = 0.25F) {
    each([&](int x, int y) {
      const float dx = static_cast<float>(x) + 0.5F - cx;
      const float dy = static_cast<float>(y) + 0.5F - cy;
      if (dx * dx + dy * dy > radius * radius) return;
      set(x, y, grey * (1.0F - relief * (dx + dy) / (2.0F * std::max(radius, 0.5F))));
    });
  }
  /// Draws a line of one texel.
  void line(float x0, float y0, float x1, float y1, float grey0, float grey1) {
    const int steps = std::max(1, static_cast<int>(std::ceil(2.0F * std::max(std::abs(x1 - x0), std::abs(y1 - y0)))));
    for (int i = 0; i <= steps; ++i) {
      const float t = static_cast<float>(i) / static_cast<float>(steps);
      set(static_cast<int>(std::floor(x0 + (x1 - x0) * t)), static_cast<int>(std::floor(y0 + (y1 - y0) * t)),
          grey0 + (grey1 - grey0) * t);
    }
  }
  /// Returns smooth noise in [0, 1] that repeats every 16 texels. `cells`: per side, a divisor of 16.
  [[nodiscard]] static float smooth(int x, int y, int cells, int seed) {
    const float scale = static_cast<float>(cells) / kPatternSize;
    const float fx = (static_cast<float>(x) + 0.5F) * scale;
    const float fy = (static_cast<float>(y) + 0.5F) * scale;
    const int ix = static_cast<int>(fx);
    const int iy = static_cast<int>(fy);
    const auto ease = [](float t) { return t * t * (3.0F - 2.0F * t); };
    const float tx = ease(fx - static_cast<float>(ix));
    const float ty = ease(fy - static_cast<float>(iy));
    const auto lattice = [&](int i, int j) { return random((ix + i) % cells, (iy + j) % cells, seed); };
    const float top = lattice(0, 0) + (lattice(1, 0) - lattice(0, 0)) * tx;
    const float low = lattice(0, 1) + (lattice(1, 1) - lattice(0, 1)) * tx;
    return top + (low - top) * ty;
  }
  /// Distances to the nearest and the second nearest of random points, which repeat every 16 texels.
  struct Cells {
    float nearest = 0.0F;
    float second = 0.0F;
    int number = 0;
  };
  [[nodiscard]] static Cells cells(int x, int y, int count, int seed) {
    Cells found{100.0F, 100.0F, 0};
    const float size = static_cast<float>(kPatternSize) / static_cast<float>(count);
    for (int j = -1; j <= count; ++j) {
      for (int i = -1; i <= count; ++i) {
        const int wi = (i + count) % count;
        const int wj = (j + count) % count;
        const float px = (static_cast<float>(i) + 0.15F + 0.7F * random(wi, wj, seed)) * size;
        const float py = (static_cast<float>(j) + 0.15F + 0.7F * random(wi, wj, seed + 77)) * size;
        const float d = std::hypot(static_cast<float>(x) + 0.5F - px, static_cast<float>(y) + 0.5F - py);
        if (d < found.nearest) {
          found = {d, found.nearest, wi + count * wj};
        } else {
          found.second = std::min(found.second, d);
        }
      }
    }
    return found;
  }

  [[nodiscard]] const Pattern& texels() const { return texels_; }

 private:
  Pattern texels_{};
};

/// A pattern of a table: `number` is the number at the end of its name, or 0.
struct NamedPattern {
  std::string_view name;
  void (*draw)(PatternCanvas& canvas, int number);
};

/// Return the pattern of that name in one of the tables, or null.
[[nodiscard]] const NamedPattern* find_face_pattern(std::string_view name);
[[nodiscard]] const NamedPattern* find_plant_pattern(std::string_view name);
[[nodiscard]] const NamedPattern* find_thing_pattern(std::string_view name);

}  // namespace quoin::packs
