// Pours sand and water into a jar. The rules follow edits and check only voxels next to changed ones, so a jar at rest
// costs nothing. A voxel's state is its water level, in eighths.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <quoin/quoin.h>

namespace {

using quoin::IVec3;
using quoin::kAir;
using quoin::VoxelType;

constexpr int kWide = 32;
constexpr int kHigh = 40;
constexpr std::uint32_t kFull = 8;
constexpr IVec3 kDown{0, -1, 0};
constexpr std::array<IVec3, 4> kBeside = {IVec3{1, 0, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 0, -1}};

struct Jar {
  VoxelType sand = kAir;
  VoxelType water = kAir;
  quoin::Grid grid{};
  quoin::Grid before = grid.snapshot();  // the grid at the last step
  quoin::ChangeCursor types{};           // position in the grid's type changes
  quoin::ChangeCursor levels{};          // position in its data changes
  std::vector<IVec3> moved{};            // by the rules: a stream looks the same before and after, but keeps moving

  // Returns the voxels that changed since the last step or move, and their side and upper neighbours; lowest first.
  std::vector<IVec3> restless() {
    std::vector<IVec3> found;
    const auto add = [&](IVec3 at) {
      found.push_back(at);
      for (const IVec3 adjacent : kBeside) found.insert(found.end(), {at + adjacent, at + adjacent - kDown});
      found.push_back(at - kDown);
    };
    visit_changes(before, grid, grid.changes_since(types),
                  [&](const quoin::RowChange& row) { row.for_each([&](IVec3 at, VoxelType, VoxelType) { add(at); }); });
    visit_data_changes(before, grid, grid.data_changes_since(levels),
                       [&](IVec3 at, const quoin::VoxelData&, const quoin::VoxelData&) { add(at); });
    for (const IVec3 at : moved) add(at);
    moved.clear();
    before = grid.snapshot();
    std::ranges::sort(found, {}, [](IVec3 at) { return std::array{at.y, at.z, at.x}; });
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  bool is_open(IVec3 at) const { return grid.get(at) == kAir || grid.get(at) == water; }
  std::uint32_t level(IVec3 at) const { return grid.get(at) == kAir ? 0 : grid.data(at).state; }
  void set_level(IVec3 at, std::uint32_t level) { grid.set(at, level == 0 ? kAir : water, {.state = level}); }

  // Falls straight down or down a slope, and displaces water.
  void fall(IVec3 at) {
    IVec3 to = at + kDown;
    for (std::size_t i = 0; i < kBeside.size() && !is_open(to); ++i) {
      if (is_open(at + kBeside[i])) to = at + kBeside[i] + kDown;
    }
    if (!is_open(to)) return;
    grid.set(at, grid.get(to), grid.data(to));
    grid.set(to, sand);
    moved.insert(moved.end(), {at, to});
  }
  void flow(IVec3 at) {
    pour(at, at + kDown, level(at));
    for (const IVec3 adjacent : kBeside) {
      if (level(at) > level(at + adjacent)) pour(at, at + adjacent, (level(at) - level(at + adjacent)) / 2);
    }
  }
  void pour(IVec3 from, IVec3 to, std::uint32_t wanted) {
    const std::uint32_t poured = is_open(to) ? std::min(wanted, kFull - level(to)) : 0;
    if (poured == 0) return;
    set_level(to, level(to) + poured);
    set_level(from, level(from) - poured);
    moved.insert(moved.end(), {from, to});
  }
};

}  // namespace

int main(int argc, char** argv) {
  using enum quoin::Visibility;
  quoin::Scene scene;
  const auto glass = scene.types.add({"glass", {200, 220, 230, 40}, Transparent});
  const auto sand = scene.types.add({"sand", {214, 186, 120, 255}});
  const auto water =
      scene.types.add({.name = "water", .colour = {60, 120, 200, 120}, .visibility = Transparent, .state_bits = 4});
  if (!glass || !sand || !water) return 1;
  Jar jar{.sand = *sand, .water = *water};
  jar.grid.fill_box({{-1, -1, -1}, {kWide + 1, kHigh, kWide + 1}}, *glass);
  jar.grid.fill_box({IVec3{0}, {kWide, kHigh, kWide}}, kAir);
  constexpr int kPours = 400;
  constexpr IVec3 kTap{20, kHigh - 1, 20};
  std::uint32_t poured = 0;
  int steps = 0;
  for (std::vector<IVec3> restless; steps < kPours || !restless.empty(); ++steps) {
    if (steps < kPours) {
      jar.grid.set({8 + steps % 3, kHigh - 1, 10 + steps % 2}, *sand);
      poured += kFull - jar.level(kTap);
      jar.set_level(kTap, kFull);
    }
    restless = jar.restless();
    for (const IVec3 at : restless) {
      if (jar.grid.get(at) == *sand) jar.fall(at);
      if (jar.grid.get(at) == *water) jar.flow(at);
    }
  }
  std::uint32_t eighths = 0;
  jar.grid.for_each_data([&](IVec3, VoxelType, const quoin::VoxelData& data) { eighths += data.state; });
  std::printf("at rest after %d steps, %u eighths of water\n", steps, eighths);
  scene.add_instance({.name = "jar", .grid = scene.add_grid({.name = "jar", .grid = std::move(jar.grid)})});
  const quoin::CpuRenderer renderer(scene);
  const auto image = renderer.render(quoin::frame_scene(scene, quoin::View::Iso, 4.0 / 3.0), {});
  const bool is_written = image && quoin::write_png(image->colour, argc > 1 ? argv[1] : "falling_sand.png");
  return is_written && eighths == poured ? 0 : 1;
}
