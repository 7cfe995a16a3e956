#include <algorithm>
#include <array>
#include <iterator>

#include "io/packs/patterns/pack_patterns.h"

// Patterns of plants, corals and fungi: cutouts that stand on the lower edge.

namespace quoin::packs {

namespace {

using PlantCanvas = PatternCanvas;

/// Draws a blade of grass from the lower edge: its foot, height, and lean of the tip in texels.
void draw_blade(PlantCanvas& c, float x, float height, float lean, float grey) {
  for (int k = 0; k <= static_cast<int>(height); ++k) {
    const float t = static_cast<float>(k) / std::max(height, 1.0F);
    const int at = static_cast<int>(std::floor(x + lean * t * t));
    c.set(at, 15 - k, grey * (0.72F + 0.38F * t));
    if (t < 0.4F) c.set(at + 1, 15 - k, grey * 0.62F);
  }
}

/// Draws blades at random feet. `low` and `high`: their heights.
void draw_tuft(PlantCanvas& c, int count, float low, float high, int seed) {
  for (int i = 0; i < count; ++i) {
    const float x =
        1.0F + 13.0F * (static_cast<float>(i) + 0.5F * PlantCanvas::random(i, 1, seed)) / static_cast<float>(count);
    const float height = low + (high - low) * PlantCanvas::random(i, 2, seed);
    const float lean = (x - 7.5F) * 0.35F + 3.0F * (PlantCanvas::random(i, 3, seed) - 0.5F);
    draw_blade(c, x, height, lean, 0.65F + 0.3F * PlantCanvas::random(i, 4, seed));
  }
}

void draw_grass(PlantCanvas& c, int number) {
  if (number == 1) return draw_tuft(c, 11, 13.0F, 18.0F, 402);  // the lower half of tall grass
  if (number == 2) return draw_tuft(c, 9, 4.0F, 13.0F, 403);    // its upper half
  draw_tuft(c, 10, 5.0F, 12.5F, 401 + number);
}

/// Draws a frond: a stalk with leaflets at both sides.
void draw_frond(PlantCanvas& c, float x0, float y0, float x1, float y1, float width) {
  const int steps = static_cast<int>(std::max(std::abs(x1 - x0), std::abs(y1 - y0)));
  for (int k = 0; k <= steps; ++k) {
    const float t = static_cast<float>(k) / static_cast<float>(std::max(steps, 1));
    const int x = static_cast<int>(x0 + (x1 - x0) * t);
    const int y = static_cast<int>(y0 + (y1 - y0) * t);
    const int reach = static_cast<int>(std::lround(width * std::sin(3.14F * std::min(1.0F, 0.15F + t))));
    if (k % 2 == 0) {
      for (int r = 1; r <= reach; ++r) {
        c.set(x - r, y + r / 2, 0.90F - 0.08F * static_cast<float>(r));
        c.set(x + r, y + r / 2, 0.75F - 0.08F * static_cast<float>(r));
      }
    }
    c.set(x, y, 0.58F);
  }
}

void draw_fern(PlantCanvas& c, int number) {
  const float top = number == 0 ? 3.0F : number == 1 ? 0.0F : 6.0F;
  draw_frond(c, 8.0F, 15.0F, 8.0F, top, 3.6F);
  draw_frond(c, 7.0F, 15.0F, 2.0F, top + 4.0F, 2.6F);
  draw_frond(c, 8.0F, 15.0F, 13.0F, top + 4.0F, 2.6F);
}

/// A stalk of this height with two leaves.
void draw_stalk(PlantCanvas& c, int height) {
  for (int k = 0; k < height; ++k) {
    c.set(7, 15 - k, k % 3 == 0 ? 0.62F : 0.78F);
  }
  const int leaf = std::min(height / 2, 5);
  for (int k = 0; k < 4; ++k) {
    c.set(6 - k, 14 - leaf + std::max(0, 1 - k), 0.9F - 0.06F * static_cast<float>(k));
    c.set(6 - k, 15 - leaf, 0.66F);
    if (k < 3) c.set(8 + k, 13 - leaf - k / 2, 0.82F - 0.06F * static_cast<float>(k));
    if (k < 3) c.set(8 + k, 14 - leaf, 0.58F);
  }
}

void draw_head_round(PlantCanvas& c, int) {
  c.disc(7.5F, 4.5F, 2.7F, 0.82F, 0.3F);
  c.set(7, 2, 0.95F);
  c.set(6, 4, 0.62F);
  c.set(8, 5, 0.58F);
}

void draw_head_cup(PlantCanvas& c, int) {
  c.disc(7.5F, 4.5F, 3.2F, 0.80F, 0.35F);
  c.clear(7, 1);
  c.clear(4, 2);
  for (int x = 6; x < 9; ++x) c.set(x, 6, 0.5F);
  c.set(5, 3, 0.95F);
}

void draw_head_daisy(PlantCanvas& c, int) {
  for (int k = 0; k < 8; ++k) {
    const float angle = 0.785F * static_cast<float>(k);
    c.line(7.5F, 4.5F, 7.5F + 3.6F * std::cos(angle), 4.5F + 3.6F * std::sin(angle), 0.7F, k % 2 == 0 ? 0.98F : 0.82F);
  }
  c.disc(7.5F, 4.5F, 2.2F, 0.85F, 0.2F);
}

void draw_heart(PlantCanvas& c, int) {
  c.set(7, 4, 0.95F);
  c.set(8, 4, 0.75F);
  c.set(7, 5, 0.7F);
  c.set(8, 5, 0.55F);
}

void draw_head_tulip(PlantCanvas& c, int) {
  for (int y = 2; y < 8; ++y) {
    const int half = y < 4 ? 2 : y < 7 ? 3 : 2;
    for (int x = 8 - half; x < 8 + half; ++x)
      c.set(x, y, 0.88F - 0.07F * static_cast<float>(x - 5) - 0.03F * static_cast<float>(y));
  }
  c.clear(6, 2);
  c.clear(9, 2);
  c.set(7, 1, 0.9F);
  for (int y = 3; y < 7; ++y) c.set(7, y, 0.58F);
}

void draw_head_ball(PlantCanvas& c, int) {
  c.disc(7.5F, 4.5F, 3.8F, 0.78F, 0.25F);
  c.each([&](int x, int y) {
    if ((x + y) % 2 == 0) c.shade(x, y, 1.2F);
    if ((x * 3 + y * 5) % 7 == 0) c.shade(x, y, 0.75F);
  });
}

void draw_head_bells(PlantCanvas& c, int) {
  constexpr int kSites[][2] = {{4, 3}, {9, 2}, {4, 7}, {10, 6}, {5, 10}};
  for (const auto& [x, y] : kSites) {
    c.box(x, y, x + 2, y + 2, 0.92F);
    c.set(x + 1, y + 1, 0.7F);
    c.set(x, y + 2, 0.8F);
  }
}

void draw_head_star(PlantCanvas& c, int) {
  constexpr int kSites[][2] = {{7, 2}, {4, 4}, {10, 4}, {5, 8}, {10, 9}};
  for (const auto& [x, y] : kSites) {
    c.set(x, y, 0.95F);
    c.set(x - 1, y, 0.8F);
    c.set(x + 1, y, 0.7F);
    c.set(x, y - 1, 0.85F);
    c.set(x, y + 1, 0.6F);
  }
}

void draw_heads_small(PlantCanvas& c, int) {
  constexpr int kSites[][2] = {{3, 6}, {7, 3}, {11, 5}, {5, 10}, {10, 10}, {13, 9}};
  for (const auto& [x, y] : kSites) {
    c.set(x, y - 1, 0.95F);
    c.set(x - 1, y, 0.85F);
    c.set(x + 1, y, 0.8F);
    c.set(x, y + 1, 0.75F);
  }
}

void draw_hearts_small(PlantCanvas& c, int) {
  constexpr int kSites[][2] = {{3, 6}, {7, 3}, {11, 5}, {5, 10}, {10, 10}, {13, 9}};
  for (const auto& [x, y] : kSites) c.set(x, y, 0.9F);
}

void draw_head_plume(PlantCanvas& c, int) {
  for (int y = 0; y < 10; ++y) {
    const int half = y < 2 ? 1 : y < 7 ? 2 : 1;
    for (int x = 8 - half; x <= 7 + half; ++x) c.set(x, y, 0.6F + 0.38F * PlantCanvas::random(x, y, 411));
  }
}

void draw_stalks_small(PlantCanvas& c, int) {
  constexpr float kTops[][2] = {{3, 7}, {7, 4}, {11, 6}, {5, 11}, {10, 11}, {13, 10}};
  for (const auto& [x, y] : kTops) c.line(8.0F, 15.5F, x + 0.5F, y, 0.6F, 0.85F);
  draw_tuft(c, 6, 2.0F, 4.0F, 412);
}

void draw_sapling_trunk(PlantCanvas& c, int) {
  for (int y = 9; y < 16; ++y) {
    c.set(7, y, 0.8F);
    c.set(8, y, 0.6F);
  }
  c.set(6, 12, 0.7F);
  c.set(9, 10, 0.65F);
}

/// The crown of a young tree: 0 round, 1 pointed, 2 drooping, 3 flat.
void draw_sapling_crown(PlantCanvas& c, int kind) {
  c.each([&](int x, int y) {
    const float dx = std::abs(static_cast<float>(x) - 7.5F);
    const float fy = static_cast<float>(y);
    const bool is_inside = kind == 1   ? fy < 13.0F && dx < 0.8F + 0.42F * fy - (y % 3 == 0 ? 1.2F : 0.0F)
                           : kind == 2 ? fy < 12.0F && dx < 5.5F - 0.02F * fy * fy && (y < 7 || (x * 5 + y) % 3 != 0)
                           : kind == 3
                               ? (fy > 1.0F && fy < 5.0F && dx < 6.6F) || (fy > 6.0F && fy < 9.0F && dx < 4.5F && x > 3)
                               : std::hypot(dx, fy - 5.5F) < 5.6F;
    const float hole = PlantCanvas::random(x, y, 421 + kind);
    if (is_inside && hole > 0.14F)
      c.set(x, y, 0.45F + 0.5F * PlantCanvas::random(x / 2, y / 2, 422 + kind) + 0.05F * hole);
  });
}

void draw_shrub(PlantCanvas& c, int number) {
  const float top = number == 1 ? -2.0F : 3.0F;
  c.each([&](int x, int y) {
    const float dx = std::abs(static_cast<float>(x) - 7.5F) / 7.5F;
    const float edge = top + 9.0F * dx * dx + 3.0F * PlantCanvas::random(x, 1, 431 + number);
    if (static_cast<float>(y) < edge) return;
    const auto cell = PlantCanvas::cells(x, y, 6, 432 + number);
    if (cell.second - cell.nearest > 0.5F || PlantCanvas::random(x, y, 433) > 0.6F) {
      c.set(x, y, 0.42F + 0.5F * PlantCanvas::random(cell.number, 1, 434 + number));
    }
  });
}

/// Clusters of blossoms or berries over a shrub.
void draw_clusters(PlantCanvas& c, int number) {
  const int count = number == 0 ? 5 : number;
  for (int i = 0; i < count; ++i) {
    const float x = 2.5F + 11.0F * PlantCanvas::random(i, 1, 441 + number);
    const float y = 3.0F + 9.0F * PlantCanvas::random(i, 2, 441 + number);
    c.disc(x, y, 1.9F, 0.80F, 0.4F);
  }
}

void draw_berries(PlantCanvas& c, int number) {
  for (int i = 0; i < 4 + number; ++i) {
    const int x = 2 + static_cast<int>(12.0F * PlantCanvas::random(i, 1, 445));
    const int y = 5 + static_cast<int>(9.0F * PlantCanvas::random(i, 2, 445));
    c.set(x, y, 0.95F);
    c.set(x + 1, y, 0.75F);
    c.set(x, y + 1, 0.65F);
  }
}

void draw_cap(PlantCanvas& c, int) {
  for (int y = 6; y < 11; ++y) {
    const int half = y == 6 ? 3 : y < 9 ? 5 : 4;
    for (int x = 8 - half; x < 8 + half; ++x)
      c.set(x, y, 0.92F - 0.05F * static_cast<float>(x - 3) - 0.03F * static_cast<float>(y - 6));
  }
}

void draw_cap_dots(PlantCanvas& c, int) {
  for (const auto& [x, y] : std::array<std::array<int, 2>, 5>{{{5, 7}, {8, 8}, {10, 7}, {4, 9}, {7, 6}}})
    c.set(x, y, 0.95F);
}

void draw_cap_foot(PlantCanvas& c, int) {
  for (int y = 10; y < 16; ++y) {
    c.set(6, y, 0.9F);
    c.set(7, y, 0.85F);
    c.set(8, y, 0.7F);
    c.set(9, y, 0.6F);
  }
}

/// Branches that fork upwards from the lower edge, or downwards if `number` is 1.
void draw_branches(PlantCanvas& c, int number) {
  const auto put = [&](float x0, float y0, float x1, float y1, float g) {
    if (number == 1) c.line(x0, 15.0F - y0, x1, 15.0F - y1, g, g * 1.2F);
    if (number != 1) c.line(x0, y0, x1, y1, g, g * 1.2F);
  };
  put(8.0F, 15.0F, 7.5F, 9.0F, 0.6F);
  put(7.5F, 11.0F, 3.0F, 5.0F, 0.65F);
  put(7.5F, 9.0F, 11.0F, 2.0F, 0.7F);
  put(9.0F, 7.0F, 13.5F, 5.0F, 0.7F);
  put(5.0F, 8.0F, 1.5F, 8.0F, 0.72F);
  put(4.5F, 7.0F, 5.5F, 2.5F, 0.75F);
  put(8.0F, 13.0F, 12.5F, 10.0F, 0.65F);
}

void draw_roots(PlantCanvas& c, int number) {
  for (int i = 0; i < 7; ++i) {
    float x = 1.5F + 2.1F * static_cast<float>(i);
    const int length = 7 + static_cast<int>(8.0F * PlantCanvas::random(i, 1, 451 + number));
    for (int k = 0; k < length; ++k) {
      x += 1.2F * (PlantCanvas::random(i, k + 5, 452 + number) - 0.5F);
      c.set(static_cast<int>(x), number == 1 ? k : 15 - k, 0.55F + 0.4F * static_cast<float>(k) / 15.0F);
    }
  }
}

/// Hanging or climbing leaves on a whole face.
void draw_creeper(PlantCanvas& c, int seed) {
  c.each([&](int x, int y) {
    const float lane = std::abs(PlantCanvas::smooth(x, y, 4, 461 + seed) - 0.5F);
    const float leaf = PlantCanvas::random(x / 2, y / 2, 462 + seed);
    if (lane < 0.10F || leaf > 0.62F) c.set(x, y, 0.45F + 0.5F * PlantCanvas::random(x, y, 463 + seed));
  });
}

void draw_blots(PlantCanvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = PlantCanvas::cells(x, y, 4, 471 + seed);
    const float size = 1.0F + 1.4F * PlantCanvas::random(cell.number, 1, 472 + seed);
    if (cell.nearest < size) c.set(x, y, 0.9F - 0.3F * cell.nearest / size);
  });
}

/// A stalk that winds up through the whole height, with leaves: 0 goes on, 1 ends.
void draw_winding(PlantCanvas& c, int number) {
  const int top = number % 2 == 1 ? 3 : 0;
  for (int y = top; y < 16; ++y) {
    const int x = 7 + static_cast<int>(std::lround(1.6F * std::sin(0.8F * static_cast<float>(y))));
    c.set(x, y, 0.7F);
    c.set(x + 1, y, 0.55F);
    if (y % 4 == 1) {
      for (int k = 1; k < 5; ++k) c.set(x - k, y - k / 2, 0.95F - 0.08F * static_cast<float>(k));
      for (int k = 1; k < 4; ++k) c.set(x - k, y + 1 - k / 2, 0.6F);
    }
    if (y % 4 == 3) {
      for (int k = 2; k < 6; ++k) c.set(x + k, y - k / 2, 0.9F - 0.08F * static_cast<float>(k));
      for (int k = 2; k < 5; ++k) c.set(x + k, y + 1 - k / 2, 0.55F);
    }
  }
}

/// Wide ribbons, as seagrass has: 0 short, 1 and 2 the halves of tall ones.
void draw_ribbons(PlantCanvas& c, int number) {
  constexpr int kFeet[] = {2, 6, 9, 12};
  for (int i = 0; i < 4; ++i) {
    const int height = number == 0 ? 7 + i * 3 % 7 : number == 1 ? 16 : 5 + i * 5 % 9;
    for (int k = 0; k < height; ++k) {
      const int x = kFeet[i] + static_cast<int>(std::lround(1.2F * std::sin(0.7F * static_cast<float>(k + 3 * i))));
      c.set(x, 15 - k, 0.85F - 0.12F * static_cast<float>(i % 2));
      c.set(x + 1, 15 - k, 0.6F);
    }
  }
}

void draw_cane(PlantCanvas& c, int) {
  constexpr int kFeet[] = {2, 7, 12};
  for (int i = 0; i < 3; ++i) {
    for (int y = 0; y < 16; ++y) {
      const bool is_joint = (y + i * 3) % 6 == 0;
      c.set(kFeet[i], y, is_joint ? 0.55F : 0.9F);
      c.set(kFeet[i] + 1, y, is_joint ? 0.5F : 0.68F);
      if (is_joint) c.set(kFeet[i] + 2, y - 1, 0.8F);
    }
  }
}

void draw_wheat(PlantCanvas& c, int stage) {
  draw_tuft(c, 8, 1.0F + 1.4F * static_cast<float>(stage), 3.0F + 1.6F * static_cast<float>(stage), 481);
}

void draw_ears(PlantCanvas& c, int) {
  for (int i = 0; i < 5; ++i) {
    const int x = 1 + i * 3;
    const int top = 1 + static_cast<int>(4.0F * PlantCanvas::random(i, 1, 483));
    for (int k = 0; k < 6; ++k) {
      c.set(x, top + k, k % 2 == 0 ? 0.95F : 0.75F);
      if (k % 2 == 0 && k < 5) c.set(x + 1, top + k, 0.65F);
    }
  }
}

void draw_tops(PlantCanvas& c, int stage) {
  for (int i = 0; i < 3; ++i) {
    const float x = 3.0F + 4.5F * static_cast<float>(i);
    const float height = 3.0F + 2.4F * static_cast<float>(stage);
    draw_blade(c, x, height, -2.0F, 0.9F);
    draw_blade(c, x, height * 0.8F, 2.2F, 0.75F);
    draw_blade(c, x, height * 1.1F, 0.3F, 0.82F);
  }
}

void draw_tubers(PlantCanvas& c, int) {
  for (int i = 0; i < 3; ++i) {
    const int x = 3 + 9 * i / 2;
    c.set(x, 13, 0.95F);
    c.set(x + 1, 13, 0.8F);
    c.set(x, 14, 0.85F);
    c.set(x + 1, 14, 0.65F);
    c.set(x, 15, 0.6F);
  }
}

void draw_warts(PlantCanvas& c, int stage) {
  for (int i = 0; i < 3 + stage; ++i) {
    const float x = 2.0F + 12.0F * PlantCanvas::random(i, 1, 491);
    c.disc(x, 14.5F - 2.4F * static_cast<float>(stage) * PlantCanvas::random(i, 2, 491),
           1.4F + 0.4F * static_cast<float>(stage), 0.8F, 0.45F);
    c.line(x, 15.0F, x, 13.0F, 0.5F, 0.6F);
  }
}

/// The stalk of melons and pumpkins: 0 upright, 1 bends to the fruit at the right edge of the texture.
void draw_runner(PlantCanvas& c, int number) {
  if (number == 0) {
    for (int y = 0; y < 16; ++y) {
      c.set(7 + (y / 3) % 2, y, 0.85F);
      c.set(8 + (y / 3) % 2, y, 0.6F);
      if (y % 5 == 2) c.line(9.0F, static_cast<float>(y), 12.0F, static_cast<float>(y) - 2.0F, 0.8F, 0.9F);
      if (y % 5 == 4) c.line(6.0F, static_cast<float>(y), 3.0F, static_cast<float>(y) - 2.0F, 0.8F, 0.9F);
    }
    return;
  }
  for (int k = 0; k < 16; ++k) {
    const float t = static_cast<float>(k) / 15.0F;
    const int x = static_cast<int>(8.0F - 8.0F * t);
    const int y = static_cast<int>(15.0F - 9.0F * std::sin(1.6F * t));
    c.set(x, y, 0.85F);
    c.set(x, y + 1, 0.6F);
  }
  c.disc(4.0F, 5.0F, 2.0F, 0.8F);
}

/// Five corals: tubes, a brain, bubbles, fire, horns.
void draw_coral(PlantCanvas& c, int kind) {
  if (kind == 0) {
    for (int i = 0; i < 4; ++i) {
      const int top = 2 + i * 3 % 7;
      for (int y = top; y < 16; ++y) {
        c.set(2 + i * 3, y, 0.92F);
        c.set(3 + i * 3, y, 0.7F);
      }
      c.box(2 + i * 3, top, 4 + i * 3, top + 1, 0.45F);
    }
  } else if (kind == 1) {
    c.disc(7.5F, 8.0F, 6.2F, 0.8F, 0.2F);
    c.each([&](int x, int y) {
      if (std::sin(1.3F * static_cast<float>(x) + 2.5F * std::sin(0.8F * static_cast<float>(y))) < -0.3F)
        c.shade(x, y, 0.65F);
    });
    c.box(6, 13, 10, 16, 0.6F);
  } else if (kind == 2) {
    for (int i = 0; i < 9; ++i) {
      c.disc(3.0F + 10.0F * PlantCanvas::random(i, 1, 501), 4.0F + 9.0F * PlantCanvas::random(i, 2, 501), 2.2F, 0.82F,
             0.5F);
    }
    c.box(6, 12, 9, 16, 0.6F);
  } else {
    draw_branches(c, 0);
    c.each([&](int x, int y) {
      if (kind == 3 && c.at(x, y).alpha == 0.0F && x > 0 && y < 15 && c.at(x - 1, y).alpha > 0.5F &&
          c.at(x - 1, y).grey < 0.95F) {
        c.set(x, y, 0.97F);
      }
    });
    if (kind == 4) {
      for (const auto& [x, y] : std::array<std::array<int, 2>, 4>{{{2, 3}, {11, 1}, {13, 4}, {5, 1}}})
        c.box(x, y, x + 2, y + 2, 0.95F);
    }
  }
}

void draw_fan(PlantCanvas& c, int kind) {
  for (int k = 0; k < 9; ++k) {
    const float angle = 0.35F + 0.31F * static_cast<float>(k);
    const float length = 11.0F + 4.0F * PlantCanvas::random(k, kind, 511);
    c.line(8.0F, 15.5F, 8.0F - length * std::cos(angle), 15.5F - length * std::sin(angle), 0.62F, 0.95F);
  }
  c.each([&](int x, int y) {
    const float r = std::hypot(static_cast<float>(x) - 7.5F, static_cast<float>(y) - 15.5F);
    if (r < 14.0F && static_cast<int>(r + 0.7F * static_cast<float>(kind)) % 4 == 0) c.set(x, y, 0.78F);
  });
}

void draw_pad(PlantCanvas& c, int) {
  c.disc(8.0F, 8.0F, 7.6F, 0.8F, 0.15F);
  for (int k = 0; k < 8; ++k) {
    for (int j = 0; j <= k / 2; ++j) c.clear(8 + k, 7 - j);
    if (k > 1) c.shade(8 - k, 8 + k / 2, 0.75F);
    if (k > 1) c.shade(7 - k / 2, 8 - k, 0.75F);
    if (k > 1) c.shade(8 + k / 3, 8 + k, 0.75F);
  }
}

void draw_spawn(PlantCanvas& c, int number) {
  for (int i = 0; i < 9; ++i) {
    const float x = 3.0F + 5.0F * static_cast<float>(i % 3) + PlantCanvas::random(i, 1, 521);
    const float y = 3.0F + 5.0F * static_cast<float>(i - i % 3) / 3.0F + PlantCanvas::random(i, 2, 521);
    c.disc(x, y, number == 0 ? 2.4F : 1.0F, 0.8F, 0.3F);
  }
}

/// Four flowers seen from above, one in each quarter.
void draw_quarter_flowers(PlantCanvas& c, int number) {
  for (int i = 0; i < 4; ++i) {
    const float x = 4.0F + 8.0F * static_cast<float>(i % 2);
    const float y = 4.0F + 8.0F * static_cast<float>(i - i % 2) / 2.0F;
    if (number == 1) {
      c.disc(x, y, 0.9F, 0.9F, 0.0F);
      continue;
    }
    for (int k = 0; k < 5; ++k) {
      const float angle = 1.257F * static_cast<float>(k) + static_cast<float>(i);
      c.disc(x + 1.9F * std::cos(angle), y + 1.9F * std::sin(angle), 1.3F, 0.85F, 0.3F);
    }
  }
}

/// Dripstone: 0 tip, 1 touching tips, 2 frustum, 3 middle, 4 base.
void draw_spike(PlantCanvas& c, int part) {
  constexpr float kLow[] = {3.0F, 3.0F, 5.0F, 6.0F, 7.6F};
  constexpr float kHigh[] = {0.4F, 2.0F, 3.0F, 5.0F, 6.0F};
  c.each([&](int x, int y) {
    if (part == 0 && y < 5) return;
    const float t = part == 0 ? static_cast<float>(y - 5) / 10.0F : static_cast<float>(y) / 15.0F;
    const float half = kHigh[part] + (kLow[part] - kHigh[part]) * t;
    const float dx = static_cast<float>(x) + 0.5F - 8.0F;
    if (std::abs(dx) > half) return;
    c.set(x, y, 0.75F - 0.25F * dx / std::max(half, 1.0F) + 0.15F * (PlantCanvas::random(x, y / 2, 531) - 0.5F));
  });
}

/// Crystals of growing size.
void draw_shards(PlantCanvas& c, int size) {
  constexpr float kHeights[] = {3.5F, 5.0F, 7.0F, 10.0F};
  for (int i = 0; i < 5; ++i) {
    const float lean = static_cast<float>(i - 2);
    const float height = kHeights[std::min(size, 3)] * (1.15F - 0.18F * std::abs(lean));
    for (int k = 0; k < static_cast<int>(height); ++k) {
      const float t = static_cast<float>(k) / height;
      const int x = static_cast<int>(7.0F + 2.0F * lean * (0.6F + 0.5F * t));
      c.set(x, 15 - k, 0.7F + 0.3F * t);
      if (t < 0.75F) c.set(x + 1, 15 - k, 0.5F + 0.25F * t);
    }
  }
}

void draw_web(PlantCanvas& c, int) {
  for (const auto& [x, y] :
       std::array<std::array<float, 2>, 8>{{{0, 0}, {15, 0}, {0, 15}, {15, 15}, {7, 0}, {8, 15}, {0, 8}, {15, 7}}}) {
    c.line(7.5F, 7.5F, x, y, 0.95F, 0.7F);
  }
  for (const float r : {3.0F, 5.5F}) {
    for (int k = 0; k < 8; ++k) {
      const float a = 0.785F * static_cast<float>(k);
      c.line(7.5F + r * std::cos(a), 7.5F + r * std::sin(a), 7.5F + r * std::cos(a + 0.785F),
             7.5F + r * std::sin(a + 0.785F), 0.85F, 0.85F);
    }
  }
}

void draw_flames(PlantCanvas& c, int inner) {
  c.each([&](int x, int y) {
    const float reach = 4.0F + 9.0F * std::abs(std::sin(0.95F * static_cast<float>(x) + 0.6F)) *
                                   (0.6F + 0.4F * PlantCanvas::random(x, 1, 541));
    const float from_low = static_cast<float>(15 - y);
    const float height = inner == 1 ? reach * 0.55F : reach + 2.0F;
    if (from_low < height) c.set(x, y, 0.95F - 0.45F * from_low / height);
  });
}

void draw_bamboo_leaf(PlantCanvas& c, int size) {
  const int count = size == 0 ? 4 : 7;
  for (int i = 0; i < count; ++i) {
    const float x = 4.0F + 8.0F * PlantCanvas::random(i, 1, 551);
    const float y = 2.0F + 12.0F * PlantCanvas::random(i, 2, 551);
    const float lean = i % 2 == 0 ? 4.0F : -4.0F;
    c.line(x, y, x + lean, y + 3.0F, 0.95F, 0.7F);
    c.line(x, y + 1.0F, x + lean * 0.8F, y + 3.5F, 0.6F, 0.5F);
  }
}

void draw_moss_strands(PlantCanvas& c, int is_tip) {
  for (int x = 2; x < 14; ++x) {
    const int length = is_tip == 1 ? 4 + static_cast<int>(11.0F * PlantCanvas::random(x, 1, 561)) : 16;
    for (int y = 0; y < length; ++y) {
      if (PlantCanvas::random(x, y / 2, 562) > 0.3F) c.set(x, y, 0.55F + 0.4F * PlantCanvas::random(x, y, 563));
    }
  }
}

void draw_leaf_top(PlantCanvas& c, int) {
  c.each([&](int x, int y) {
    if ((x < 2 || x > 13) && (y < 2 || y > 13) && (x + y) % 2 == 0) return;
    const bool is_vein = x == 7 || x == 8 || (std::abs(x - 7) + y) % 5 == 0;
    c.set(x, y, is_vein ? 0.9F : 0.7F + 0.06F * (PlantCanvas::random(x, y, 571) - 0.5F));
  });
}

constexpr NamedPattern kPlants[] = {
    {"grass", draw_grass},
    {"fern", draw_fern},
    {"stalk", draw_stalk},
    {"head_round", draw_head_round},
    {"head_cup", draw_head_cup},
    {"head_daisy", draw_head_daisy},
    {"heart", draw_heart},
    {"head_tulip", draw_head_tulip},
    {"head_ball", draw_head_ball},
    {"head_bells", draw_head_bells},
    {"head_star", draw_head_star},
    {"heads_small", draw_heads_small},
    {"hearts_small", draw_hearts_small},
    {"head_plume", draw_head_plume},
    {"stalks_small", draw_stalks_small},
    {"sapling_trunk", draw_sapling_trunk},
    {"sapling_crown", draw_sapling_crown},
    {"shrub", draw_shrub},
    {"clusters", draw_clusters},
    {"berries", draw_berries},
    {"cap", draw_cap},
    {"cap_dots", draw_cap_dots},
    {"cap_foot", draw_cap_foot},
    {"branches", draw_branches},
    {"roots", draw_roots},
    {"creeper", draw_creeper},
    {"blots", draw_blots},
    {"winding", draw_winding},
    {"ribbons", draw_ribbons},
    {"cane", draw_cane},
    {"wheat", draw_wheat},
    {"ears", draw_ears},
    {"tops", draw_tops},
    {"tubers", draw_tubers},
    {"warts", draw_warts},
    {"runner", draw_runner},
    {"coral", draw_coral},
    {"fan", draw_fan},
    {"pad", draw_pad},
    {"spawn", draw_spawn},
    {"quarter_flowers", draw_quarter_flowers},
    {"spike", draw_spike},
    {"shards", draw_shards},
    {"web", draw_web},
    {"flames", draw_flames},
    {"bamboo_leaf", draw_bamboo_leaf},
    {"moss_strands", draw_moss_strands},
    {"leaf_top", draw_leaf_top},
};

}  // namespace

const NamedPattern* find_plant_pattern(std::string_view name) {
  const auto found = std::ranges::find(kPlants, name, &NamedPattern::name);
  return found == std::end(kPlants) ? nullptr : found;
}

}  // namespace quoin::packs
