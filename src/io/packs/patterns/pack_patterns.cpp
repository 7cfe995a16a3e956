#include "io/packs/patterns/pack_patterns.h"

#include <algorithm>
#include <iterator>
#include <utility>

// Patterns that fill a whole face: stone, wood, metal, glass, cloth.

namespace quoin::packs {

namespace {

using Canvas = PatternCanvas;

void draw_flat(Canvas& c, int seed) {
  c.fill(0.75F);
  c.grain(0.03F, 11 + seed);
}

void draw_sand(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    c.set(x, y,
          0.78F + 0.10F * (Canvas::random(x, y, 5 + seed) - 0.5F) + 0.10F * (Canvas::smooth(x, y, 4, 6 + seed) - 0.5F));
  });
}

void draw_stone(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float wide =
        Canvas::smooth(x, (y * 2) % 16, 4, 21 + seed) + 0.6F * Canvas::smooth((x + 5) % 16, y, 8, 22 + seed);
    c.set(x, y, 0.62F + 0.16F * wide + 0.06F * (Canvas::random(x, y, 23 + seed) - 0.5F));
  });
}

void draw_speckle(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float spot = Canvas::random(x / 2, y, 31 + seed);
    const float small = Canvas::random(x, y, 32 + seed);
    c.set(x, y, spot > 0.78F ? 0.95F : spot < 0.20F ? 0.55F : 0.74F + 0.12F * (small - 0.5F));
  });
}

void draw_dirt(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float lump = Canvas::smooth(x, y, 8, 41 + seed);
    const float dot = Canvas::random(x, y, 42 + seed);
    c.set(x, y, 0.60F + 0.22F * lump + (dot > 0.90F ? 0.14F : dot < 0.12F ? -0.16F : 0.0F));
  });
}

void draw_cobble(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = Canvas::cells(x, y, 4, 51 + seed);
    const float edge = cell.second - cell.nearest;
    const float tone = 0.66F + 0.24F * Canvas::random(cell.number, 3, 52 + seed);
    const float grain = 0.05F * (Canvas::random(x, y, 53 + seed) - 0.5F);
    c.set(x, y, edge < 0.9F ? 0.40F : tone + grain + (edge < 1.9F ? -0.08F : 0.06F));
  });
}

void draw_gravel(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = Canvas::cells(x, y, 8, 61 + seed);
    const float tone = 0.52F + 0.40F * Canvas::random(cell.number, 5, 62 + seed);
    c.set(x, y, cell.second - cell.nearest < 0.35F ? tone * 0.72F : tone);
  });
}

/// Draws courses of bricks; every second is shifted by half a brick.
void draw_courses(Canvas& c, int height, int width, float joint, float relief, int seed) {
  c.each([&](int x, int y) {
    const int course = y / height;
    const int along = (x + (course % 2) * (width / 2)) % 16;
    const int in_x = along % width;
    const int in_y = y % height;
    if (in_y == height - 1 || in_x == width - 1) {
      c.set(x, y, joint + 0.04F * (Canvas::random(x, y, 71 + seed) - 0.5F));
      return;
    }
    float grey = 0.76F + 0.12F * (Canvas::random(along / width, course, 72 + seed) - 0.5F);
    if (in_y == 0 || in_x == 0) grey += relief;
    if (in_y == height - 2 || in_x == width - 2) grey -= relief;
    c.set(x, y, grey + 0.05F * (Canvas::random(x, y, 73 + seed) - 0.5F));
  });
}

void draw_bricks(Canvas& c, int seed) {
  draw_courses(c, 4, 8, 0.52F, 0.04F, seed);
}
void draw_pale_joints(Canvas& c, int seed) {
  draw_courses(c, 4, 8, 0.92F, 0.03F, seed);
}
void draw_big_bricks(Canvas& c, int seed) {
  draw_courses(c, 8, 16, 0.50F, 0.09F, seed);
}
void draw_small_bricks(Canvas& c, int seed) {
  draw_courses(c, 4, 4, 0.55F, 0.05F, seed);
}

void draw_tiles(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const bool is_joint = x % 8 == 7 || y % 8 == 7;
    const bool is_light = x % 8 == 0 || y % 8 == 0;
    const float tone = 0.72F + 0.10F * (Canvas::random(x / 8, y / 8, 81 + seed) - 0.5F);
    c.set(x, y, is_joint ? 0.48F : tone + (is_light ? 0.08F : 0.0F) + 0.04F * (Canvas::random(x, y, 82 + seed) - 0.5F));
  });
}

void draw_cracks(Canvas& c, int seed) {
  float x = 3.0F + 2.0F * Canvas::random(1, 1, 91 + seed);
  for (int y = 0; y < 16; ++y) {
    x += 2.2F * (Canvas::random(y, 2, 92 + seed) - 0.45F);
    c.set(static_cast<int>(x) & 15, y, 0.3F, 0.75F);
    if (Canvas::random(y, 3, 93 + seed) > 0.7F) c.set((static_cast<int>(x) + 1) & 15, y, 0.3F, 0.75F);
  }
  c.line(5.0F, 9.0F, 13.0F, 4.0F, 0.3F, 0.35F);
}

void draw_planks(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const int board = y / 4;
    const int seam = (board * 7 + 3) % 16;
    float grey = 0.74F + 0.10F * (Canvas::random(board, 1, 101 + seed) - 0.5F);
    grey += 0.09F * (Canvas::smooth(x, (y * 4) % 16, 4, 102 + board + seed) - 0.5F);
    grey += 0.05F * (Canvas::random(x / 3, y, 103 + seed) - 0.5F);
    if (y % 4 == 3) grey = 0.52F;
    if (y % 4 == 0) grey += 0.05F;
    if (x == seam && y % 4 != 3) grey = 0.56F;
    c.set(x, y, grey);
  });
}

void draw_mosaic(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const bool is_across = ((x / 8) + (y / 8)) % 2 == 0;
    const int along = is_across ? y % 4 : x % 4;
    c.set(x, y,
          (along == 3 ? 0.52F : 0.74F + 0.05F * static_cast<float>(2 - along)) +
              0.04F * (Canvas::random(x, y, 111 + seed) - 0.5F));
  });
}

void draw_bark(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const int lane = (x + (Canvas::random(x / 4, y / 5, 121 + seed) > 0.6F ? 1 : 0)) % 16;
    const float ridge = Canvas::random(lane, (y + lane * 3) / 6 % 3, 122 + seed);
    c.set(x, y, 0.50F + 0.34F * ridge + 0.08F * (Canvas::random(x, y, 123 + seed) - 0.5F));
  });
}

void draw_birch(Canvas& c, int seed) {
  c.each([&](int x, int y) { c.set(x, y, 0.86F + 0.08F * (Canvas::random(x, y / 2, 125 + seed) - 0.5F)); });
  for (int i = 0; i < 9; ++i) {
    const int x = static_cast<int>(16.0F * Canvas::random(i, 0, 126 + seed));
    const int y = static_cast<int>(16.0F * Canvas::random(i, 1, 126 + seed));
    const int length = 2 + static_cast<int>(3.0F * Canvas::random(i, 2, 126 + seed));
    for (int k = 0; k < length; ++k) c.set((x + k) & 15, y, 0.32F);
  }
}

void draw_stripped(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float lane = Canvas::random(x, 0, 131 + seed);
    c.set(x, y,
          0.72F + 0.10F * (lane - 0.5F) + 0.06F * (Canvas::smooth(x, y, 4, 132 + seed) - 0.5F) +
              (Canvas::random(x, y / 4, 133 + seed) > 0.9F ? -0.08F : 0.0F));
  });
}

int ring_of(int x, int y) {
  return std::min({x, y, 15 - x, 15 - y});
}

void draw_rings(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const int ring = ring_of(x, y);
    c.set(x, y,
          (ring % 2 == 0 ? 0.78F : 0.66F) + 0.05F * (Canvas::random(x, y, 141 + seed) - 0.5F) +
              (ring == 7 ? -0.1F : 0.0F));
  });
}

/// The bark around a trunk's end.
void draw_rim(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const int ring = ring_of(x, y);
    if (ring == 0) c.set(x, y, 0.66F + 0.25F * (Canvas::random(x, y, 145 + seed) - 0.5F));
    if (ring == 1 && Canvas::random(x, y, 146 + seed) > 0.6F) c.set(x, y, 0.5F);
  });
}

void draw_leaves(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = Canvas::cells(x, y, 6, 151 + seed);
    const float tone = 0.45F + 0.45F * Canvas::random(cell.number, 1, 152 + seed);
    const bool is_hole = cell.second - cell.nearest < 0.45F && Canvas::random(x, y, 153 + seed) > 0.35F;
    if (!is_hole) c.set(x, y, tone * (1.12F - 0.12F * cell.nearest));
  });
}

void draw_blossoms(Canvas& c, int seed) {
  for (int i = 0; i < 7; ++i) {
    const int x = static_cast<int>(15.0F * Canvas::random(i, 0, 156 + seed));
    const int y = static_cast<int>(15.0F * Canvas::random(i, 1, 156 + seed));
    c.set(x, y, 0.9F);
    c.set(x + 1, y, 0.8F);
    c.set(x, y + 1, 0.75F);
  }
}

void draw_wool(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const int weave = (x + 2 * (y % 4 / 2)) % 4;
    c.set(x, y,
          0.74F + (weave < 2 ? 0.05F : -0.03F) + 0.09F * (Canvas::random(x / 2, y / 2, 161 + seed) - 0.5F) +
              (y % 4 == 3 ? -0.05F : 0.0F));
  });
}

void draw_powder(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    c.set(x, y,
          0.74F + 0.14F * (Canvas::random(x, y, 165 + seed) - 0.5F) +
              0.06F * (Canvas::smooth(x, y, 8, 166 + seed) - 0.5F));
  });
}

/// A pane with a frame and a gleam; the inside is clear.
void draw_glass(Canvas& c, int number) {
  if (number > 0) c.fill(0.80F, 0.42F);
  c.bevel(0, 0, 16, 16, 0.95F, 0.80F);
  for (int k = 0; k < 4; ++k) {
    c.set(3 + k, 6 - k, 0.98F, number > 0 ? 0.75F : 1.0F);
    if (k < 3) c.set(10 + k, 12 - k, 0.9F, number > 0 ? 0.7F : 1.0F);
  }
  c.set(3, 7, 0.9F, number > 0 ? 0.6F : 1.0F);
}

void draw_pane_edge(Canvas& c, int) {
  c.fill(0.8F);
  for (int y = 0; y < 16; ++y) {
    c.set(7, y, 0.95F);
    c.set(8, y, 0.85F);
  }
}

void draw_ice(Canvas& c, int number) {
  c.each([&](int x, int y) {
    c.set(x, y, 0.80F + 0.14F * (Canvas::smooth(x, y, 4, 171 + number) - 0.5F), number == 0 ? 0.72F : 1.0F);
  });
  const float alpha = number == 0 ? 0.9F : 1.0F;
  for (int k = 0; k < 9; ++k) {
    c.set(2 + k, 10 - k, 0.95F, alpha);
    if (k < 6) c.set(8 + k, 14 - k, 0.92F, alpha);
    if (k < 4 + number % 3) c.set(3 + k, 3 + k / 2, 0.70F, alpha);
  }
}

void draw_metal(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    c.set(x, y,
          0.80F + 0.05F * (Canvas::smooth((x + y) % 16, y, 4, 181 + seed) - 0.5F) + (y % 4 == 3 ? -0.06F : 0.02F));
  });
  c.bevel(0, 0, 16, 16, 0.95F, 0.58F);
  c.bevel(1, 1, 15, 15, 0.88F, 0.70F);
}

void draw_gem(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = Canvas::cells(x, y, 4, 191 + seed);
    c.set(x, y,
          0.55F + 0.40F * Canvas::random(cell.number, 1, 192 + seed) +
              (cell.second - cell.nearest < 0.6F ? 0.15F : 0.0F));
  });
  c.bevel(0, 0, 16, 16, 0.95F, 0.5F);
}

void draw_cut(Canvas& c, int seed) {
  c.fill(0.76F);
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) c.bevel(i * 8, j * 8, i * 8 + 8, j * 8 + 8, 0.88F, 0.55F);
  }
  c.grain(0.03F, 201 + seed);
}

void draw_panel(Canvas& c, int seed) {
  c.fill(0.76F);
  c.bevel(0, 0, 16, 16, 0.86F, 0.58F);
  c.grain(0.035F, 205 + seed);
}

void draw_chiseled(Canvas& c, int seed) {
  c.fill(0.76F);
  c.bevel(0, 0, 16, 16, 0.88F, 0.55F);
  c.bevel(2, 2, 14, 14, 0.55F, 0.88F);
  c.bevel(4, 4, 12, 12, 0.86F, 0.56F);
  c.box(6, 6, 10, 10, 0.62F);
  c.bevel(6, 6, 10, 10, 0.5F, 0.84F);
  c.grain(0.03F, 211 + seed);
}

void draw_pillar(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const int lane = x % 4;
    c.set(x, y, (lane == 3 ? 0.56F : lane == 0 ? 0.86F : 0.76F) + 0.03F * (Canvas::random(x, y, 215 + seed) - 0.5F));
  });
  for (int x = 0; x < 16; ++x) {
    c.set(x, 0, 0.86F);
    c.set(x, 15, 0.56F);
  }
}

void draw_pillar_top(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    constexpr float kRings[] = {0.84F, 0.58F, 0.78F, 0.80F, 0.62F, 0.78F, 0.72F, 0.70F};
    c.set(x, y, kRings[ring_of(x, y)] + 0.03F * (Canvas::random(x, y, 221 + seed) - 0.5F));
  });
}

/// Layers of sediment.
void draw_layers(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float wave = Canvas::smooth(x, 0, 4, 225 + seed);
    const int row = (y + static_cast<int>(2.0F * wave)) % 16;
    c.set(x, y,
          0.74F + 0.14F * (Canvas::random(row / 2, 1, 226 + seed) - 0.5F) +
              0.06F * (Canvas::random(x, y, 227 + seed) - 0.5F));
  });
  for (int x = 0; x < 16; ++x) {
    c.shade(x, 0, 1.12F);
    c.shade(x, 15, 0.85F);
  }
}

/// Grains of ore, to be laid over stone.
void draw_ore(Canvas& c, int seed) {
  constexpr int kSites[][2] = {{3, 3}, {10, 2}, {6, 8}, {12, 9}, {3, 12}, {9, 13}};
  for (int i = 0; i < 6; ++i) {
    const int x = kSites[i][0] + static_cast<int>(2.0F * Canvas::random(i, 1, 231 + seed));
    const int y = kSites[i][1] + static_cast<int>(2.0F * Canvas::random(i, 2, 231 + seed)) - 1;
    c.set(x, y, 0.95F);
    c.set(x + 1, y, 0.80F);
    c.set(x, y + 1, 0.70F);
    c.set(x + 1, y + 1, 0.55F);
    if (i % 2 == 0) c.set(x - 1, y + 1, 0.62F);
    if (i % 3 == 0) c.set(x + 2, y + 1, 0.50F);
    if (i % 2 == 1) c.set(x + 1, y - 1, 0.85F);
  }
}

void draw_pits(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float wide = Canvas::smooth(x, y, 8, 241 + seed);
    c.set(x, y,
          wide > 0.60F   ? 0.86F
          : wide < 0.36F ? 0.46F
                         : 0.66F + 0.10F * (Canvas::random(x, y, 242 + seed) - 0.5F));
  });
}

void draw_marble(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float vein = std::abs(Canvas::smooth(x, y, 4, 251 + seed) - 0.5F);
    c.set(x, y, (vein < 0.05F ? 0.66F : 0.84F) + 0.05F * (Canvas::random(x, y, 252 + seed) - 0.5F));
  });
}

void draw_crystals(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = Canvas::cells(x, y, 5, 261 + seed);
    const float tone = 0.55F + 0.40F * Canvas::random(cell.number, 4, 262 + seed);
    c.set(x, y, cell.second - cell.nearest < 0.7F ? 0.42F : tone + 0.1F * (1.0F - cell.nearest / 3.0F));
  });
}

void draw_lamp(Canvas& c, int) {
  c.fill(0.80F);
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      c.bevel(i * 4, j * 4, i * 4 + 4, j * 4 + 4, 0.62F, 0.55F);
      c.set(i * 4 + 1, j * 4 + 1, 1.0F);
    }
  }
  c.bevel(0, 0, 16, 16, 0.5F, 0.42F);
}

void draw_sea_lantern(Canvas& c, int) {
  c.each([&](int x, int y) {
    const int ring = ring_of(x, y);
    const bool is_cross = x == y || x == 15 - y;
    c.set(x, y,
          ring == 0  ? 0.62F
          : is_cross ? 0.98F
                     : 0.80F + 0.04F * static_cast<float>(ring % 3) + 0.06F * Canvas::random(x, y, 271));
  });
}

void draw_sponge(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = Canvas::cells(x, y, 5, 281 + seed);
    c.set(x, y,
          cell.nearest < 1.1F   ? 0.45F
          : cell.nearest < 1.7F ? 0.62F
                                : 0.80F + 0.06F * (Canvas::random(x, y, 282 + seed) - 0.5F));
  });
}

void draw_honeycomb(Canvas& c, int) {
  c.each([&](int x, int y) {
    const int row = y / 4;
    const int along = (x + (row % 2) * 4) % 8;
    const bool is_wall =
        y % 4 == 0 ? along > 1 && along < 7 : along == 0 || (y % 4 == 1 && along == 1) || (y % 4 == 1 && along == 7);
    c.set(x, y, is_wall ? 0.92F : 0.66F - 0.05F * static_cast<float>(y % 4 == 3));
  });
}

void draw_hay(Canvas& c, int number) {
  c.each([&](int x, int y) {
    const float straw = number == 0 ? Canvas::random(x, y / 5, 291) : Canvas::random(x / 2, y / 2, 292);
    c.set(x, y, 0.62F + 0.30F * straw);
  });
}

void draw_bands(Canvas& c, int) {
  for (int x = 0; x < 16; ++x) {
    for (const int y : {3, 4, 11, 12}) c.set(x, y, y % 8 == 3 ? 0.8F : 0.6F);
  }
}

/// The backs of books on two shelves, in one of three colours.
void draw_books(Canvas& c, int number) {
  for (int shelf = 0; shelf < 2; ++shelf) {
    const int bottom = shelf * 8 + 8;
    for (int x = 1; x < 15; ++x) {
      const int book = x / 2 + shelf * 9;
      if (book * 7 % 3 != number) continue;
      const int height = 5 + (Canvas::random(book, 1, 301) > 0.5F ? 1 : 0);
      for (int k = 1; k <= height; ++k)
        c.set(x, bottom - k - 1, (x % 2 == 0 ? 0.85F : 0.62F) - (k == height - 1 ? 0.2F : 0.0F));
    }
  }
}

void draw_shelf_gaps(Canvas& c, int) {
  c.box(1, 1, 15, 7, 0.4F);
  c.box(1, 9, 15, 15, 0.4F);
}

void draw_coral_block(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float wave = std::sin(1.1F * static_cast<float>(x) + 3.0F * Canvas::smooth(x, y, 4, 311 + seed)) +
                       std::sin(1.1F * static_cast<float>(y) + 3.0F * Canvas::smooth(y, x, 4, 312 + seed));
    c.set(x, y, 0.70F + 0.12F * wave);
  });
}

/// A square ornament of a dyed tile, in one of three tones.
void draw_ornament(Canvas& c, int number) {
  const int kind = number / 3;
  const int tone = number % 3;
  c.each([&](int x, int y) {
    const int u = std::min(x, 15 - x);
    const int v = std::min(y, 15 - y);
    const int a = std::max(u, v);
    const int b = std::min(u, v);
    const int d = (a * (3 + kind % 4) + b * (5 + kind % 3) + a * b * (kind % 5)) / 4 % 7;
    const int part = d < 3 ? 0 : d < 5 ? 1 : 2;
    if (part == tone) c.set(x, y, tone == 0 ? 0.72F : 0.82F);
  });
}

void draw_mushroom_skin(Canvas& c, int) {
  c.each([&](int x, int y) { c.set(x, y, 0.74F + 0.06F * (Canvas::smooth(x, y, 8, 321) - 0.5F)); });
}

void draw_spots(Canvas& c, int) {
  c.disc(4.0F, 4.0F, 2.3F, 0.85F, 0.1F);
  c.disc(11.5F, 6.0F, 1.8F, 0.85F, 0.1F);
  c.disc(6.5F, 11.5F, 2.6F, 0.85F, 0.1F);
  c.disc(13.5F, 13.0F, 1.5F, 0.85F, 0.1F);
}

void draw_moss(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    c.set(x, y, 0.55F + 0.25F * Canvas::smooth(x, y, 8, 331 + seed) + 0.22F * Canvas::random(x, y, 332 + seed));
  });
}

/// Patches of moss, to be laid over stone.
void draw_moss_patches(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const float wide = Canvas::smooth(x, y, 4, 335 + seed) + 0.4F * (Canvas::random(x, y, 336 + seed) - 0.5F);
    if (wide > 0.58F) c.set(x, y, 0.6F + 0.3F * Canvas::random(x, y, 337 + seed), 0.9F);
  });
}

void draw_stars(Canvas& c, int seed) {
  for (int i = 0; i < 14; ++i) {
    c.set(static_cast<int>(16.0F * Canvas::random(i, 1, 341 + seed)),
          static_cast<int>(16.0F * Canvas::random(i, 2, 341 + seed)), 0.5F + 0.5F * Canvas::random(i, 3, 341 + seed));
  }
}

void draw_melon(Canvas& c, int) {
  c.each([&](int x, int y) {
    const int lane = (x + (Canvas::random(x / 4, y / 2, 351) > 0.5F ? 1 : 0)) % 4;
    c.set(x, y, (lane < 2 ? 0.62F : 0.88F) + 0.06F * (Canvas::random(x, y, 352) - 0.5F));
  });
}

void draw_pumpkin(Canvas& c, int) {
  c.each([&](int x, int y) {
    const int lane = x % 4;
    float grey = lane == 0 ? 0.56F : lane == 2 ? 0.84F : 0.76F;
    if (y < 1 || y > 14) grey *= 0.88F;
    c.set(x, y, grey + 0.04F * (Canvas::random(x, y, 355) - 0.5F));
  });
}

void draw_pumpkin_top(Canvas& c, int) {
  c.each([&](int x, int y) {
    const float dx = static_cast<float>(x) - 7.5F;
    const float dy = static_cast<float>(y) - 7.5F;
    const float rib = std::cos(8.0F * std::atan2(dy, dx));
    c.set(x, y, 0.74F + 0.10F * rib - (std::hypot(dx, dy) < 2.0F ? 0.3F : 0.0F));
  });
}

void draw_cactus_side(Canvas& c, int) {
  c.each([&](int x, int y) {
    const int lane = x % 4;
    c.set(x, y, lane == 1 ? 0.52F : lane == 3 ? 0.86F : 0.70F);
    if (lane == 3 && (y + x) % 5 == 0) c.set(x, y, 0.98F);
  });
}

void draw_ripples(Canvas& c, int number) {
  c.each([&](int x, int y) {
    const float a = Canvas::smooth(x, (y * 2) % 16, 4, 361 + number);
    const float b = Canvas::smooth((x + 7) % 16, (y * 2 + 5) % 16, 8, 362 + number);
    const float wave = std::abs(a + 0.5F * b - 0.75F);
    c.set(x, y, number == 0 ? 0.74F + 0.25F * std::max(0.0F, 0.2F - wave) : 0.45F + 1.6F * std::max(0.0F, 0.32F - wave),
          number == 0 ? 0.70F : 1.0F);
  });
}

void draw_prismarine(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    const auto cell = Canvas::cells(x, y, 4, 371 + seed);
    const float tone = 0.62F + 0.28F * Canvas::random(cell.number, 2, 372 + seed);
    c.set(x, y, cell.second - cell.nearest < 0.7F ? 0.50F : tone + 0.04F * (Canvas::random(x, y, 373 + seed) - 0.5F));
  });
}

void draw_grate(Canvas& c, int) {
  c.bevel(0, 0, 16, 16, 0.9F, 0.6F);
  c.each([&](int x, int y) {
    const int u = (x + y) % 4;
    const int v = (x + 16 - y) % 4;
    if (u == 0 || v == 0) c.set(x, y, u == 0 ? 0.85F : 0.68F);
  });
}

void draw_bulb(Canvas& c, int) {
  draw_panel(c, 7);
  c.bevel(2, 2, 14, 14, 0.55F, 0.86F);
  c.box(3, 3, 13, 13, 0.5F);
}

void draw_bulb_light(Canvas& c, int) {
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      c.box(4 + i * 3, 4 + j * 3, 6 + i * 3, 6 + j * 3, 0.85F);
      c.set(4 + i * 3, 4 + j * 3, 1.0F);
    }
  }
}

void draw_slime(Canvas& c, int) {
  c.fill(0.78F, 0.62F);
  c.bevel(0, 0, 16, 16, 0.72F, 0.60F);
  c.disc(5.0F, 5.0F, 1.5F, 0.95F, 0.0F);
  c.disc(11.0F, 10.0F, 1.0F, 0.9F, 0.0F);
}

void draw_frame(Canvas& c, int width) {
  for (int k = 0; k < std::max(width, 1); ++k)
    c.bevel(k, k, 16 - k, 16 - k, k == 0 ? 0.85F : 0.7F, k == 0 ? 0.55F : 0.62F);
}

void draw_cage(Canvas& c, int) {
  c.each([&](int x, int y) {
    if (x % 5 == 0 || y % 5 == 0) c.set(x, y, (x % 5 == 0 && y % 5 == 0) ? 0.9F : 0.66F);
  });
}

void draw_snow_edge(Canvas& c, int) {
  for (int x = 0; x < 16; ++x) {
    const int depth = 3 + static_cast<int>(2.9F * Canvas::random(x, 1, 381));
    for (int y = 0; y < depth; ++y) c.set(x, y, 0.9F - 0.08F * static_cast<float>(y == depth - 1));
  }
}

void draw_turf_edge(Canvas& c, int seed) {
  for (int x = 0; x < 16; ++x) {
    const int depth = 2 + static_cast<int>(3.2F * Canvas::random(x, 1, 385 + seed));
    for (int y = 0; y < depth; ++y) c.set(x, y, 0.60F + 0.30F * Canvas::random(x, y, 386 + seed));
  }
}

void draw_turf(Canvas& c, int seed) {
  c.each([&](int x, int y) {
    c.set(x, y, 0.60F + 0.22F * Canvas::random(x, y, 391 + seed) + 0.18F * Canvas::smooth(x, y, 8, 392 + seed));
  });
}

void draw_furrows(Canvas& c, int) {
  c.each([&](int x, int y) {
    const int lane = x % 4;
    c.set(x, y, (lane == 0 ? 0.5F : lane == 2 ? 0.84F : 0.68F) + 0.10F * (Canvas::random(x, y, 395) - 0.5F));
  });
}

constexpr NamedPattern kFaces[] = {
    {"flat", draw_flat},
    {"sand", draw_sand},
    {"stone", draw_stone},
    {"speckle", draw_speckle},
    {"dirt", draw_dirt},
    {"cobble", draw_cobble},
    {"gravel", draw_gravel},
    {"bricks", draw_bricks},
    {"pale_joints", draw_pale_joints},
    {"big_bricks", draw_big_bricks},
    {"small_bricks", draw_small_bricks},
    {"tiles", draw_tiles},
    {"cracks", draw_cracks},
    {"planks", draw_planks},
    {"mosaic", draw_mosaic},
    {"bark", draw_bark},
    {"birch", draw_birch},
    {"stripped", draw_stripped},
    {"rings", draw_rings},
    {"rim", draw_rim},
    {"leaves", draw_leaves},
    {"blossoms", draw_blossoms},
    {"wool", draw_wool},
    {"powder", draw_powder},
    {"glass", draw_glass},
    {"pane_edge", draw_pane_edge},
    {"ice", draw_ice},
    {"metal", draw_metal},
    {"gem", draw_gem},
    {"cut", draw_cut},
    {"panel", draw_panel},
    {"chiseled", draw_chiseled},
    {"pillar", draw_pillar},
    {"pillar_top", draw_pillar_top},
    {"layers", draw_layers},
    {"ore", draw_ore},
    {"pits", draw_pits},
    {"marble", draw_marble},
    {"crystals", draw_crystals},
    {"lamp", draw_lamp},
    {"sea_lantern", draw_sea_lantern},
    {"sponge", draw_sponge},
    {"honeycomb", draw_honeycomb},
    {"hay", draw_hay},
    {"bands", draw_bands},
    {"books", draw_books},
    {"shelf_gaps", draw_shelf_gaps},
    {"coral_block", draw_coral_block},
    {"ornament", draw_ornament},
    {"mushroom_skin", draw_mushroom_skin},
    {"spots", draw_spots},
    {"moss", draw_moss},
    {"moss_patches", draw_moss_patches},
    {"stars", draw_stars},
    {"melon", draw_melon},
    {"pumpkin", draw_pumpkin},
    {"pumpkin_top", draw_pumpkin_top},
    {"cactus_side", draw_cactus_side},
    {"ripples", draw_ripples},
    {"prismarine", draw_prismarine},
    {"grate", draw_grate},
    {"bulb", draw_bulb},
    {"bulb_light", draw_bulb_light},
    {"slime", draw_slime},
    {"frame", draw_frame},
    {"cage", draw_cage},
    {"snow_edge", draw_snow_edge},
    {"turf_edge", draw_turf_edge},
    {"turf", draw_turf},
    {"furrows", draw_furrows},
};

}  // namespace

const NamedPattern* find_face_pattern(std::string_view name) {
  const auto found = std::ranges::find(kFaces, name, &NamedPattern::name);
  return found == std::end(kFaces) ? nullptr : found;
}

namespace {

/// Splits a name into that of a table and the number at its end; null if there is no such pattern.
std::pair<const NamedPattern*, int> find_pattern(std::string_view name) {
  std::size_t end = name.size();
  while (end > 0 && name[end - 1] >= '0' && name[end - 1] <= '9') --end;
  if (name.size() - end > 3) return {};
  int number = 0;
  for (const char digit : name.substr(end)) number = number * 10 + (digit - '0');
  for (const auto find : {find_face_pattern, find_plant_pattern, find_thing_pattern}) {
    if (const NamedPattern* const found = find(name.substr(0, end))) return {found, number};
  }
  return {};
}

}  // namespace

bool has_pattern(std::string_view name) {
  return find_pattern(name).first != nullptr;
}

std::optional<Pattern> draw_pattern(std::string_view name) {
  const auto [found, number] = find_pattern(name);
  if (found == nullptr) return std::nullopt;
  PatternCanvas canvas;
  found->draw(canvas, number);
  return canvas.texels();
}

}  // namespace quoin::packs
