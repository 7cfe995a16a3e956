#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>

#include "io/packs/patterns/pack_patterns.h"

// Patterns of made things: doors, rails, machines, faces. Most are layers over a plain pattern.

namespace quoin::packs {

namespace {

using ThingCanvas = PatternCanvas;

/// A drawing as text: rows of 16 texels, or of the left 8 texels, which are mirrored; fewer than 16 rows stand on the
/// lower edge. '1' (dark) to '9' (light) are texels of the layer 0, 'a' to 'i' of the layer 1; others are clear.
void draw_text(ThingCanvas& c, std::string_view rows, int layer) {
  int count = 1;
  for (const char each : rows) count += each == '/' ? 1 : 0;
  int y = kPatternSize - count;
  while (!rows.empty()) {
    const std::size_t end = std::min(rows.find('/'), rows.size());
    const std::string_view row = rows.substr(0, end);
    for (int x = 0; x < kPatternSize; ++x) {
      const auto at = static_cast<std::size_t>(row.size() <= 8 && x > 7 ? 15 - x : x);
      if (at >= row.size()) continue;
      const int level = row[at] - (layer == 0 ? '0' : 'a' - 1);
      if (level >= 1 && level <= 9) c.set(x, y, 0.28F + 0.08F * static_cast<float>(level));
    }
    rows.remove_prefix(std::min(end + 1, rows.size()));
    ++y;
  }
}

void draw_boards_up(ThingCanvas& c, int seed) {
  c.each([&](int x, int y) {
    float grey = 0.74F + 0.08F * (ThingCanvas::random(x / 4, 1, 601 + seed) - 0.5F) +
                 0.06F * (ThingCanvas::random(x, y / 4, 602 + seed) - 0.5F);
    if (x % 4 == 3) grey = 0.56F;
    c.set(x, y, grey);
  });
}

void draw_door(ThingCanvas& c, int is_upper) {
  draw_boards_up(c, 3);
  c.bevel(0, is_upper == 1 ? 0 : -1, 16, is_upper == 1 ? 17 : 16, 0.86F, 0.55F);
  for (const int y : {2, 9}) {
    const int x0 = 2;
    c.bevel(x0, y, 7, y + 5, 0.55F, 0.86F);
    c.bevel(9, y, 14, y + 5, 0.55F, 0.86F);
  }
  if (is_upper == 1) {
    for (int y = 3; y < 6; ++y) {
      for (int x = 3; x < 6; ++x) {
        c.clear(x, y);
        c.clear(x + 7, y);
      }
    }
  }
}

void draw_knob(ThingCanvas& c, int) {
  c.box(12, 0, 14, 2, 0.9F);
  c.set(13, 1, 0.55F);
}

void draw_trapdoor(ThingCanvas& c, int) {
  draw_boards_up(c, 5);
  c.bevel(0, 0, 16, 16, 0.88F, 0.52F);
  c.bevel(1, 1, 15, 15, 0.78F, 0.62F);
  c.box(0, 7, 16, 9, 0.7F);
  for (int x = 0; x < 16; ++x) c.set(x, 9, 0.5F);
  for (const int y : {3, 11}) {
    for (const int x : {3, 9}) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 4; ++i) c.clear(x + i, y + j);
      }
    }
  }
}

void draw_sleepers(ThingCanvas& c, int) {
  for (int y = 1; y < 16; y += 4) {
    for (int x = 1; x < 15; ++x) {
      c.set(x, y, 0.85F - 0.04F * static_cast<float>(x % 3));
      c.set(x, y + 1, 0.6F);
    }
  }
}

void draw_rails(ThingCanvas& c, int) {
  for (int y = 0; y < 16; ++y) {
    for (const int x : {2, 12}) {
      c.set(x, y, 0.95F);
      c.set(x + 1, y, 0.6F);
    }
  }
}

void draw_rail_middle(ThingCanvas& c, int kind) {
  for (int y = 0; y < 16; ++y) {
    if (kind == 1 && (y / 2) % 2 == 0) continue;
    c.set(7, y, 0.95F);
    c.set(8, y, 0.7F);
  }
  if (kind == 2) c.box(5, 5, 11, 11, 0.8F);
}

void draw_curve_sleepers(ThingCanvas& c, int) {
  for (int k = 0; k < 5; ++k) {
    const float a = 0.10F + 0.34F * static_cast<float>(k);
    c.line(16.0F - 2.0F * std::cos(a), 16.0F - 2.0F * std::sin(a), 16.0F - 15.0F * std::cos(a),
           16.0F - 15.0F * std::sin(a), 0.85F, 0.65F);
  }
}

void draw_curve_rails(ThingCanvas& c, int) {
  c.each([&](int x, int y) {
    const float r = std::hypot(15.5F - static_cast<float>(x), 15.5F - static_cast<float>(y));
    if ((r > 2.2F && r < 4.0F) || (r > 12.2F && r < 14.0F)) c.set(x, y, 0.9F - 0.2F * (r - std::floor(r)));
  });
}

void draw_ladder(ThingCanvas& c, int) {
  for (int y = 0; y < 16; ++y) {
    for (const int x : {2, 12}) {
      c.set(x, y, 0.88F);
      c.set(x + 1, y, 0.6F);
    }
  }
  for (int y = 1; y < 16; y += 4) {
    for (int x = 1; x < 15; ++x) {
      c.set(x, y, 0.95F);
      c.set(x, y + 1, 0.62F);
    }
  }
}

void draw_stick(ThingCanvas& c, int) {
  for (int y = 6; y < 16; ++y) {
    c.set(7, y, y % 3 == 0 ? 0.8F : 0.95F);
    c.set(8, y, y % 4 == 1 ? 0.55F : 0.65F);
  }
}

void draw_stick_end(ThingCanvas& c, int) {
  c.box(7, 6, 9, 8, 0.9F);
  c.set(7, 6, 1.0F);
}

void draw_lantern_case(ThingCanvas& c, int) {
  c.box(0, 0, 10, 16, 0.6F);
  c.bevel(0, 2, 6, 9, 0.85F, 0.5F);
  c.bevel(1, 0, 5, 2, 0.8F, 0.6F);
  c.bevel(0, 9, 6, 15, 0.75F, 0.5F);
  for (int y = 0; y < 16; ++y) {
    c.set(11, y, y % 4 == 3 ? 0.0F : 0.8F, y % 4 == 3 ? 0.0F : 1.0F);
    c.set(13, y, y % 4 == 3 ? 0.0F : 0.6F, y % 4 == 3 ? 0.0F : 1.0F);
    if (y % 4 == 0 || y % 4 == 2) c.set(12, y, 0.7F);
    if (y % 4 == 3) c.set(12, y, 0.55F);
  }
}

void draw_lantern_light(ThingCanvas& c, int) {
  c.box(1, 3, 5, 8, 0.8F);
  c.box(2, 4, 4, 7, 1.0F);
  c.box(2, 11, 4, 13, 0.9F);
}

void draw_links(ThingCanvas& c, int) {
  for (int y = 0; y < 16; ++y) {
    const int k = y % 5;
    for (const int x : {0, 3}) {
      if (k == 0 || k == 3) {
        c.set(x + 1, y, 0.9F);
      } else if (k != 4) {
        c.set(x, y, 0.8F);
        c.set(x + 2, y, 0.6F);
      } else {
        c.set(x + 1, y, 0.55F);
      }
      if (k == 0 || k == 3) {
        c.set(x, y, 0.7F);
        c.set(x + 2, y, 0.5F);
      }
    }
  }
}

void draw_sign_chain(ThingCanvas& c, int) {
  for (const int x : {1, 4, 10, 13}) {
    for (int y = 0; y < 16; ++y) c.set(x, y, y % 2 == 0 ? 0.9F : 0.6F);
  }
  for (int k = 0; k < 6; ++k) {
    c.set(3 + k, 13 - k, 0.8F);
    c.set(13 - k, 13 - k, 0.7F);
  }
}

/// A band with a lid's gap at two thirds of the height, as chests have.
void draw_lid(ThingCanvas& c, int y) {
  c.bevel(1, 2, 15, 16, 0.8F, 0.42F);
  const int at = y == 0 ? 6 : y;
  for (int x = 0; x < 16; ++x) {
    c.set(x, at, 0.40F);
    c.set(x, at + 1, 0.75F);
  }
}

void draw_pillow(ThingCanvas& c, int) {
  c.box(1, 1, 15, 8, 0.88F);
  c.bevel(1, 1, 15, 8, 0.95F, 0.75F);
}

void draw_blanket_edge(ThingCanvas& c, int) {
  for (int x = 0; x < 16; ++x) c.set(x, 6, 0.9F), c.set(x, 7, 0.7F);
}

void draw_candle(ThingCanvas& c, int) {
  c.box(0, 6, 16, 16, 0.82F);
  for (int y = 6; y < 16; ++y) c.set(1, y, 0.7F);
  c.set(0, 7, 0.95F);
}

void draw_wick(ThingCanvas& c, int) {
  c.set(0, 5, 0.7F);
}

void draw_icing(ThingCanvas& c, int) {
  c.each([&](int x, int y) {
    if (y < 10 + (x * 5 % 3)) c.set(x, y, 0.88F + 0.08F * ThingCanvas::random(x, y, 611));
  });
}

void draw_cherries(ThingCanvas& c, int) {
  for (const auto& [x, y] : std::array<std::array<float, 2>, 5>{{{4, 4}, {11, 4}, {7.5F, 8}, {4, 12}, {12, 11.5F}}})
    c.disc(x, y, 1.5F, 0.8F);
}

/// An opening: 0 of furnaces, 1 round, 2 of hives.
void draw_mouth(ThingCanvas& c, int kind) {
  if (kind == 1) return c.disc(8.0F, 8.0F, 3.2F, 0.5F, -0.3F);
  if (kind == 2) return c.box(5, 9, 11, 13, 0.4F);
  c.box(3, 8, 13, 15, 0.45F);
  c.box(4, 7, 12, 8, 0.5F);
  c.box(4, 3, 12, 5, 0.5F);
}

void draw_mouth_frame(ThingCanvas& c, int kind) {
  if (kind == 1) {
    c.disc(8.0F, 8.0F, 5.2F, 0.8F, 0.3F);
    return;
  }
  c.bevel(2, 6, 14, 16, 0.95F, 0.55F);
  c.bevel(3, 2, 13, 6, 0.9F, 0.55F);
}

void draw_glow(ThingCanvas& c, int) {
  c.each([&](int x, int y) {
    if (x > 3 && x < 12 && y > 14 - static_cast<int>(5.0F * ThingCanvas::random(x, 1, 621)) - 1 && y < 15) {
      c.set(x, y, 1.0F - 0.08F * static_cast<float>(14 - y));
    }
  });
}

/// Small drawings on machines and tables.
constexpr std::array<std::array<std::string_view, 2>, 22> kTexts = {{
    {"grid_text",
     "......../.7777777/.7......../.7..666./.7..6.../.7..6.../.7..666./.7......../.7..666./.7..6.../.7..6.../.7..666./"
     ".7......../.7777777/......../........"},
    {"tools_text",
     "................/................/..999...........8/..8.9....66.66../....8....6...6../...8.....66.66../"
     "...7......767.../..7........7..../"
     "..6........7..../...........6..../................/................/................/................/"
     "................/................"},
    {"map_text",
     "......../.9999999/.9bb..99/.9.bb.99/.99.b9.9/.9999bb9/.99b99bb/.9bb9999/.9b99999/.9999a99/.999aa99/.9999999/"
     ".9999999/......../......../........"},
    {"target_text",
     "......../.1111111/.1....../.1.11111/.1.1..../.1.1.111/.1.1.1../.1.1.1.1/.1.1.1.1/.1.1.1../.1.1.111/.1.1..../"
     ".1.11111/.1....../.1111111/........"},
    {"thread_text",
     "......../..999999/..8.8.8./..7.7.7./..9.9.9./..8.8.8./..7.7.7./..9.9.9./..8.8.8./..999999/......../......../"
     "......../......../......../........"},
    {"eyes_text", "......../......../......../......../.33...../.33....."},
    {"creeper_text",
     "................/................/.22..22........./.22..22........./...22.........../..2222........../"
     "..2222........../..2..2........../................/................/................/................/"
     "................/................/................/................"},
    {"skull_text",
     "................/................/................/................/.22..22........./.22..22........./"
     "...22.........../.2.2.2.2......../................/................/................/................/"
     "................/................/................/................"},
    {"person_text",
     "................/................/................/................/.92..29........./................/"
     "...33.........../..2222........../................/................/................/................/"
     "................/................/................/................"},
    {"person_hair",
     "99999999......../98888889......../9......9......../................/................/................/"
     "................/................/................/................/................/................/"
     "................/................/................/................"},
    {"zombie_text",
     "................/................/................/................/.11..11........./................/"
     "...33.........../..3..3........../................/................/................/................/"
     "................/................/................/................"},
    {"dragon_text",
     "................/................/.9....9........./9.9..9.9......../................/..1..1........../"
     "................/.5.55.5........./................/................/................/................/"
     "................/................/................/................"},
    {"piglin_text",
     "................/................/................/.1....1........./..9999........../..9119........../"
     "8.9999.8......../.8....8........./................/................/................/................/"
     "................/................/................/................"},
    {"pumpkin_text",
     "......../......../......../......../..22..../.2222.../.22222../......../.......2/......22/......../.2.222.2/"
     ".2222222/..222222/......../........"},
    {"tnt_text",
     "......../......../......../......../......../................/.222.2..2.222.../..2..22.2..2..../..2..2.22..2..../"
     "..2..2..2..2..../................/......../......../......../......../........"},
    {"note_text",
     "................/................/................/................/......2222....../......2..2....../"
     "......2..2....../......2..2....../....222222....../....222222....../....22..22....../................/"
     "................/................/................/................/................"},
    {"plus_text",
     "......../......../......../......../......../......../......../.......9/.......9/......../......../......../"
     "......../......../......../........"},
    {"eye_text",
     "......../......../......../......../......77/.....766/....7633/....7631/....7631/....7633/.....766/......77/"
     "......../......../......../........"},
    {"arrow_text",
     "......../.......9/......99/.....999/....9999/.......8/.......8/.......8/.......8/.......8/.......8/.......8/"
     "......../......../......../........"},
    {"observer_text",
     "......../......../......../..11..../..11..../......../......../......../......../......../...11111/...1...1/"
     "......../......../......../........"},
    {"sun_text",
     "......../.6666666/.6777777/.6788888/.6789999/.6789999/.6789999/.6789999/.6789999/.6789999/.6789999/.6788888/"
     ".6777777/.6666666/.6666666/........"},
    {"lock_text",
     "......../......../......../......../.....888/....8..../....8..../...99999/...99999/...99911/...99911/...99999/"
     "...99999/......../......../........"},
}};

template <std::size_t kNumber>
void draw_numbered_text(ThingCanvas& c, int layer) {
  draw_text(c, kTexts[kNumber][1], layer);
}

void draw_dust(ThingCanvas& c, int is_line) {
  c.each([&](int x, int y) {
    const float dx = std::abs(static_cast<float>(x) - 7.5F);
    const float dy = std::abs(static_cast<float>(y) - 7.5F);
    const float noise = ThingCanvas::random(x, y, 631);
    const bool is_inside = is_line == 1 ? dx < 1.2F + 1.2F * noise : std::hypot(dx, dy) < 2.4F + 1.6F * noise;
    if (is_inside && (noise > 0.12F || dx < 1.0F)) c.set(x, y, 0.65F + 0.35F * ThingCanvas::random(x, y, 632));
  });
}

void draw_track(ThingCanvas& c, int number) {
  if (number == 0) {
    for (int y = 3; y < 15; ++y) {
      c.set(7, y, 0.8F);
      c.set(8, y, 0.7F);
    }
    return;
  }
  for (int k = 0; k < 6; ++k) {
    c.set(7 - k, 4 + k, 0.8F);
    c.set(8 + k, 4 + k, 0.7F);
  }
  for (int x = 3; x < 13; ++x) c.set(x, 11, 0.75F);
}

void draw_thread(ThingCanvas& c, int) {
  for (int x = 0; x < 16; ++x) c.set(x, 0, x % 4 == 3 ? 0.6F : 0.9F);
}

void draw_platform(ThingCanvas& c, int) {
  c.bevel(0, 0, 16, 16, 0.95F, 0.5F);
  for (const auto& [x, y] : std::array<std::array<int, 2>, 4>{{{1, 1}, {13, 1}, {1, 13}, {13, 13}}}) {
    c.box(x, y, x + 2, y + 2, 0.6F);
    c.set(x, y, 0.95F);
  }
}

void draw_piston_rim(ThingCanvas& c, int) {
  c.box(0, 0, 16, 4, 0.8F);
  for (int x = 0; x < 16; ++x) {
    c.set(x, 0, 0.92F);
    c.set(x, 3, 0.5F);
  }
}

void draw_hoops(ThingCanvas& c, int) {
  for (const int y : {2, 13}) {
    for (int x = 0; x < 16; ++x) {
      c.set(x, y, x % 5 == 2 ? 0.6F : 0.9F);
      c.set(x, y + 1, 0.6F);
    }
  }
}

void draw_disc_hole(ThingCanvas& c, int) {
  c.disc(8.0F, 8.0F, 5.4F, 0.5F, 0.0F);
  c.disc(8.0F, 8.0F, 1.6F, 0.9F, 0.0F);
}

void draw_saw(ThingCanvas& c, int) {
  c.each([&](int x, int y) {
    const float dx = static_cast<float>(x) - 7.5F;
    const float dy = static_cast<float>(y) - 8.0F;
    const float r = std::hypot(dx, dy);
    const float tooth = 6.2F + 1.2F * std::abs(std::sin(6.0F * std::atan2(dy, dx)));
    if (r < tooth) c.set(x, y, r < 1.6F ? 0.5F : 0.8F + 0.02F * static_cast<float>((x + y) % 3));
  });
}

void draw_swirl(ThingCanvas& c, int) {
  c.each([&](int x, int y) {
    const float dx = static_cast<float>(x) - 7.5F;
    const float dy = static_cast<float>(y) - 7.5F;
    const float turn = std::sin(2.0F * std::atan2(dy, dx) + 0.9F * std::hypot(dx, dy));
    c.set(x, y, 0.60F + 0.25F * turn + 0.1F * ThingCanvas::random(x, y, 641), 0.72F);
  });
}

void draw_tendrils(ThingCanvas& c, int) {
  for (int i = 0; i < 4; ++i) {
    const float x = 5.0F + 2.0F * static_cast<float>(i);
    c.line(x, 15.5F, x + 1.5F * static_cast<float>(i % 2 == 0 ? -1 : 1), 8.0F, 0.6F, 0.95F);
  }
}

void draw_holes(ThingCanvas& c, int) {
  for (const auto& [x, y] : std::array<std::array<int, 2>, 4>{{{3, 3}, {10, 3}, {3, 10}, {10, 10}}}) {
    c.box(x, y, x + 3, y + 3, 0.45F);
    c.set(x, y, 0.7F);
  }
}

void draw_inner(ThingCanvas& c, int) {
  c.box(2, 2, 14, 14, 0.5F);
  c.bevel(2, 2, 14, 14, 0.4F, 0.62F);
}

void draw_rod(ThingCanvas& c, int) {
  c.box(0, 0, 6, 16, 0.85F);
  for (int y = 0; y < 16; ++y) c.set(1, y, 0.68F);
  c.bevel(2, 2, 6, 6, 0.95F, 0.7F);
}

void draw_scaffold_top(ThingCanvas& c, int) {
  draw_boards_up(c, 9);
  c.bevel(0, 0, 16, 16, 0.9F, 0.5F);
  c.each([&](int x, int y) {
    if (x > 1 && x < 14 && y > 1 && y < 14 && (x % 4 == 3 || y % 4 == 3)) c.clear(x, y);
  });
}

void draw_poles(ThingCanvas& c, int) {
  c.each([&](int x, int y) {
    c.set(x, y, (y % 5 == 4 ? 0.55F : 0.78F) + (x % 2 == 0 ? 0.08F : -0.06F) + 0.05F * ThingCanvas::random(x, y, 651));
  });
}

void draw_pages(ThingCanvas& c, int) {
  c.fill(0.88F);
  for (int y = 2; y < 14; y += 2) {
    for (int x = 2; x < 14 - y % 3; ++x) c.set(x, y, 0.62F);
  }
}

void draw_vase(ThingCanvas& c, int) {
  for (const int y : {2, 12}) {
    for (int x = 0; x < 16; ++x) {
      c.set(x, y, 0.6F);
      if (x % 4 < 2) c.set(x, y + 1, 0.55F);
    }
  }
  c.disc(8.0F, 7.5F, 2.6F, 0.6F, 0.2F);
}

void draw_bottle(ThingCanvas& c, int) {
  for (const int x : {2, 11}) {
    c.box(x, 8, x + 4, 14, 0.85F);
    c.box(x + 1, 5, x + 3, 8, 0.7F);
    c.set(x + 1, 9, 1.0F);
  }
}

void draw_stand_arms(ThingCanvas& c, int) {
  for (int y = 0; y < 16; ++y) {
    c.set(7, y, 0.95F);
    c.set(8, y, 0.7F);
  }
  c.line(7.0F, 3.0F, 2.0F, 7.0F, 0.85F, 0.7F);
  c.line(9.0F, 3.0F, 14.0F, 7.0F, 0.85F, 0.7F);
}

void draw_bars(ThingCanvas& c, int) {
  for (int x = 3; x < 17; x += 4) {
    for (int y = 0; y < 16; ++y) {
      c.set(x & 15, y, 0.92F);
      c.set((x + 1) & 15, y, 0.6F);
    }
  }
  for (const int y : {1, 13}) {
    for (int x = 0; x < 16; ++x) {
      c.set(x, y, 0.85F);
      c.set(x, y + 1, 0.58F);
    }
  }
}

void draw_facade(ThingCanvas& c, int) {
  c.bevel(0, 0, 16, 16, 0.9F, 0.5F);
  c.bevel(3, 3, 13, 13, 0.5F, 0.85F);
  c.box(6, 6, 10, 10, 0.55F);
  c.bevel(6, 6, 10, 10, 0.9F, 0.5F);
}

void draw_scuffs(ThingCanvas& c, int number) {
  for (int i = 0; i < 4 + 4 * number; ++i) {
    const int x = 3 + static_cast<int>(10.0F * ThingCanvas::random(i, 1, 661));
    const int y = static_cast<int>(16.0F * ThingCanvas::random(i, 2, 661));
    c.set(x, y, 0.5F);
    c.set(x + 1, y, 0.7F);
  }
}

constexpr NamedPattern kThings[] = {
    {"boards_up", draw_boards_up},
    {"door", draw_door},
    {"knob", draw_knob},
    {"trapdoor", draw_trapdoor},
    {"sleepers", draw_sleepers},
    {"rails", draw_rails},
    {"rail_middle", draw_rail_middle},
    {"curve_sleepers", draw_curve_sleepers},
    {"curve_rails", draw_curve_rails},
    {"ladder", draw_ladder},
    {"stick", draw_stick},
    {"stick_end", draw_stick_end},
    {"lantern_case", draw_lantern_case},
    {"lantern_light", draw_lantern_light},
    {"links", draw_links},
    {"sign_chain", draw_sign_chain},
    {"lid", draw_lid},
    {"pillow", draw_pillow},
    {"blanket_edge", draw_blanket_edge},
    {"candle", draw_candle},
    {"wick", draw_wick},
    {"icing", draw_icing},
    {"cherries", draw_cherries},
    {"mouth", draw_mouth},
    {"mouth_frame", draw_mouth_frame},
    {"glow", draw_glow},
    {"dust", draw_dust},
    {"track", draw_track},
    {"thread", draw_thread},
    {"platform", draw_platform},
    {"piston_rim", draw_piston_rim},
    {"hoops", draw_hoops},
    {"disc_hole", draw_disc_hole},
    {"saw", draw_saw},
    {"swirl", draw_swirl},
    {"tendrils", draw_tendrils},
    {"holes", draw_holes},
    {"inner", draw_inner},
    {"rod", draw_rod},
    {"scaffold_top", draw_scaffold_top},
    {"poles", draw_poles},
    {"pages", draw_pages},
    {"vase", draw_vase},
    {"bottle", draw_bottle},
    {"stand_arms", draw_stand_arms},
    {"bars", draw_bars},
    {"facade", draw_facade},
    {"scuffs", draw_scuffs},
    {"grid_text", draw_numbered_text<0>},
    {"tools_text", draw_numbered_text<1>},
    {"map_text", draw_numbered_text<2>},
    {"target_text", draw_numbered_text<3>},
    {"thread_text", draw_numbered_text<4>},
    {"eyes_text", draw_numbered_text<5>},
    {"creeper_text", draw_numbered_text<6>},
    {"skull_text", draw_numbered_text<7>},
    {"person_text", draw_numbered_text<8>},
    {"person_hair", draw_numbered_text<9>},
    {"zombie_text", draw_numbered_text<10>},
    {"dragon_text", draw_numbered_text<11>},
    {"piglin_text", draw_numbered_text<12>},
    {"pumpkin_text", draw_numbered_text<13>},
    {"tnt_text", draw_numbered_text<14>},
    {"note_text", draw_numbered_text<15>},
    {"plus_text", draw_numbered_text<16>},
    {"eye_text", draw_numbered_text<17>},
    {"arrow_text", draw_numbered_text<18>},
    {"observer_text", draw_numbered_text<19>},
    {"sun_text", draw_numbered_text<20>},
    {"lock_text", draw_numbered_text<21>},
};

}  // namespace

const NamedPattern* find_thing_pattern(std::string_view name) {
  const auto found = std::ranges::find(kThings, name, &NamedPattern::name);
  return found == std::end(kThings) ? nullptr : found;
}

}  // namespace quoin::packs
