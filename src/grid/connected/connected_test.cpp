#include <quoin/grid/connected.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "core/work/nightly_for_tests.h"

namespace quoin {
namespace {

// Finds pieces by flood fill, one voxel at a time.
class FloodFill {
 public:
  FloodFill(const Grid& grid, const ConnectedOptions& options) : box_(grid.bounds()), size_(box_.size()) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 step{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
      const int length = std::abs(step.x) + std::abs(step.y) + std::abs(step.z);
      if (length == 1 || (length > 1 && options.connectivity != Connectivity::Faces6)) steps_.push_back(step);
    }
    labels_.assign(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y * size_.z), kNone);
    grid.for_each([&](IVec3 voxel, VoxelType type) {
      if (!options.belongs || options.belongs(type)) labels_[index(voxel)] = kUnseen;
    });
    // Visits voxels in the order z, y, x, so that pieces are ordered by their first voxels.
    for (int z = box_.min.z; z < box_.max.z; ++z) {
      for (int y = box_.min.y; y < box_.max.y; ++y) {
        for (int x = box_.min.x; x < box_.max.x; ++x) {
          if (labels_[index({x, y, z})] == kUnseen) flood({x, y, z});
        }
      }
    }
  }
  std::vector<ConnectedPiece> pieces;

  [[nodiscard]] std::optional<std::size_t> piece_at(IVec3 voxel) const {
    if (!box_.contains(voxel) || labels_[index(voxel)] == kNone) return std::nullopt;
    return static_cast<std::size_t>(labels_[index(voxel)]);
  }

 private:
  static constexpr int kNone = -1;
  static constexpr int kUnseen = -2;

  [[nodiscard]] std::size_t index(IVec3 voxel) const {
    const IVec3 local = voxel - box_.min;
    return static_cast<std::size_t>((local.z * size_.y + local.y) * size_.x + local.x);
  }
  void flood(IVec3 start) {
    const int label = static_cast<int>(pieces.size());
    pieces.emplace_back();
    pieces.back().first = start;
    std::vector<IVec3> open = {start};
    labels_[index(start)] = label;
    while (!open.empty()) {
      const IVec3 at = open.back();
      open.pop_back();
      ++pieces.back().voxels;
      pieces.back().box = unite(pieces.back().box, {at, at + 1});
      for (const IVec3 step : steps_) {
        const IVec3 next = at + step;
        if (!box_.contains(next)) continue;
        int& next_label = labels_[index(next)];
        if (next_label != kUnseen) continue;
        next_label = label;
        open.push_back(next);
      }
    }
  }

  IBox box_;
  IVec3 size_;
  std::vector<IVec3> steps_;  // to the neighbours of a voxel
  std::vector<int> labels_;
};

struct Random {
  std::mt19937 engine;
  explicit Random(unsigned seed) : engine(seed) {}
  int below(int limit) { return static_cast<int>(engine() % static_cast<unsigned>(limit)); }
  IVec3 place() { return {below(150) - 70, below(140) - 70, below(130) - 65}; }
  void add_box(Grid& grid, int types) {
    const IVec3 first = place();
    const IVec3 size{below(60), below(40), below(50)};
    const IVec3 last = glm::min(first + size, IVec3(79));
    grid.fill_box({first, last + 1}, static_cast<VoxelType>(below(types)));
  }
};

// Returns a grid of boxes, dust of many types, and a uniform chunk.
Grid random_grid(Random& random) {
  Grid grid;
  const int types = 2 + random.below(12);
  if (random.below(2) == 0) grid.fill_box({{0, -64, 0}, {64, 0, 64}}, 1);
  for (int i = 0; i < 10; ++i) random.add_box(grid, types);
  const IVec3 dust = random.place();
  grid.edit({dust, glm::min(dust + 40, IVec3(79))},
            [&](IVec3, VoxelType) { return static_cast<VoxelType>(random.below(3) == 0 ? random.below(types) : 0); });
  return grid;
}

ConnectedOptions random_options(Random& random) {
  ConnectedOptions options;
  if (random.below(2) == 0) options.connectivity = Connectivity::Corners26;
  switch (random.below(4)) {
    case 0:
      options.belongs = [](VoxelType type) { return type % 2 == 1; };
      break;
    case 1:
      options.belongs = [](VoxelType type) { return type != 3; };
      break;
    default:
      break;
  }
  return options;
}

void expect_pieces(const ConnectedPieces& found, const Grid& grid, const ConnectedOptions& options) {
  const FloodFill expected(grid, options);
  ASSERT_EQ(found.size(), expected.pieces.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(found.pieces()[i].box, expected.pieces[i].box);
    ASSERT_EQ(found.pieces()[i].voxels, expected.pieces[i].voxels);
    ASSERT_EQ(found.pieces()[i].first, expected.pieces[i].first);
  }
  std::int64_t wrong = 0;
  grid.for_each([&](IVec3 voxel, VoxelType) {
    if (found.piece_at(voxel) != expected.piece_at(voxel)) ++wrong;
  });
  EXPECT_EQ(wrong, 0);
}

TEST(ConnectedPieces, MatchFloodFill) {
  for (unsigned seed = 1; seed <= static_cast<unsigned>(cases(8, 24)); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Grid grid = random_grid(random);
    const ConnectedOptions options = random_options(random);
    ConnectedPieces pieces(options);
    pieces.update(grid, {seed % 2 + 1});
    expect_pieces(pieces, grid, options);
  }
}

TEST(ConnectedPieces, FollowEdits) {
  for (unsigned seed = 1; seed <= static_cast<unsigned>(cases(2, 8)); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Grid grid = random_grid(random);
    const ConnectedOptions options = random_options(random);
    ConnectedPieces pieces(options);
    for (int edit = 0; edit < 6; ++edit) {
      pieces.update(grid, {1});
      expect_pieces(pieces, grid, options);
      if (edit == 3) grid.fill_box({{-64, -64, -64}, {0, 0, 80}}, kAir);
      grid.fill_sphere(DVec3(random.place()), random.below(20), kAir);
      if (random.below(2) == 0) random.add_box(grid, 4);
      grid.set(random.place(), 1);
    }
  }
}

TEST(ConnectedPieces, StartOverForAnotherGrid) {
  Random random(5);
  ConnectedPieces pieces;
  pieces.update(random_grid(random));
  const Grid other = random_grid(random);
  pieces.update(other);
  expect_pieces(pieces, other, {});
  pieces.update(Grid());
  EXPECT_EQ(pieces.size(), 0U);
  EXPECT_FALSE(pieces.piece_at({0, 0, 0}).has_value());
}

// Uses hundreds of types; only some belong.
TEST(ConnectedPieces, MatchFloodFillWithManyTypes) {
  Random random(3);
  Grid grid;
  grid.edit({IVec3(-40), IVec3(40)}, [&](IVec3, VoxelType) { return static_cast<VoxelType>(random.below(1'000)); });
  ConnectedOptions options;
  options.belongs = [](VoxelType type) { return type % 3 == 0; };
  ConnectedPieces pieces(options);
  pieces.update(grid);
  expect_pieces(pieces, grid, options);
}

TEST(ConnectedPieces, ExtractAndRemovePieces) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Grid grid = random_grid(random);
    const ConnectedOptions options = random_options(random);
    ConnectedPieces pieces(options);
    pieces.update(grid);
    std::int64_t wrong = 0;
    // Checks the largest piece and some of the others.
    for (std::size_t i = 0; i < pieces.size(); i += 1 + pieces.size() / 40) {
      const Grid piece = pieces.extract(i);
      ASSERT_EQ(piece.voxel_count(), pieces.pieces()[i].voxels);
      ASSERT_EQ(piece.bounds(), pieces.pieces()[i].box);
      piece.for_each([&](IVec3 voxel, VoxelType type) {
        if (grid.get(voxel) != type || pieces.piece_at(voxel) != i) ++wrong;
      });
    }
    EXPECT_EQ(wrong, 0);
    std::int64_t left = grid.voxel_count();
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      EXPECT_EQ(pieces.remove_from(grid, i), pieces.pieces()[i].voxels);
      left -= pieces.pieces()[i].voxels;
    }
    EXPECT_EQ(grid.voxel_count(), left);
    grid.for_each([&](IVec3, VoxelType type) {
      if (!options.belongs || options.belongs(type)) ++wrong;
    });
    EXPECT_EQ(wrong, 0);
  }
}

TEST(ConnectedPieces, ShareWholeChunks) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {201, 91, 71}}, 1);
  grid.set({5, 5, 5}, 2);
  grid.set({300, 0, 0}, 3);
  ConnectedPieces pieces;
  pieces.update(grid);
  ASSERT_EQ(pieces.size(), 2U);
  const Grid body = pieces.extract(0);
  for (const IVec3 chunk : body.chunks()) {
    EXPECT_TRUE(body.find_chunk(chunk)->shares_storage_with(*grid.find_chunk(chunk)));
  }
}

TEST(ConnectedPieces, TouchBoxIfVoxelIsInside) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Grid grid = random_grid(random);
    const ConnectedOptions options = random_options(random);
    ConnectedPieces pieces(options);
    pieces.update(grid);
    for (int i = 0; i < 20; ++i) {
      const IVec3 first = random.place();
      const IBox box{first, first + 1 + IVec3(random.below(60), random.below(5), random.below(60))};
      std::vector<std::size_t> touching;
      grid.for_each([&](IVec3 voxel, VoxelType) {
        const auto piece = box.contains(voxel) ? pieces.piece_at(voxel) : std::nullopt;
        if (piece) touching.push_back(*piece);
      });
      std::sort(touching.begin(), touching.end());
      touching.erase(std::unique(touching.begin(), touching.end()), touching.end());
      EXPECT_EQ(pieces.touching(box), touching);
      const std::vector<std::size_t> separate = pieces.not_touching(box);
      EXPECT_EQ(separate.size() + touching.size(), pieces.size());
      for (const std::size_t piece : separate) {
        EXPECT_FALSE(std::binary_search(touching.begin(), touching.end(), piece));
      }
    }
    EXPECT_TRUE(pieces.touching({}).empty());
  }
}

TEST(ConnectedPieces, FindPiecesCutFromGround) {
  constexpr int kMin = std::numeric_limits<int>::min();
  constexpr int kMax = std::numeric_limits<int>::max();
  const IBox ground{{kMin, 0, kMin}, {kMax, 1, kMax}};
  Grid world;
  world.fill_box({{-100, 0, -100}, {101, 4, 101}}, 1);
  world.fill_box({{10, 4, 10}, {13, 151, 13}}, 2);  // a tower of three chunks
  ConnectedPieces pieces;
  pieces.update(world);
  EXPECT_TRUE(pieces.not_touching(ground).empty());
  world.fill_box({{0, 40, 0}, {21, 41, 21}}, kAir);
  pieces.update(world);
  const std::vector<std::size_t> loose = pieces.not_touching(ground);
  ASSERT_EQ(loose.size(), 1U);
  EXPECT_EQ(pieces.pieces()[loose[0]].voxels, 9 * 110);
  EXPECT_EQ(pieces.pieces()[loose[0]].box, (IBox{{10, 41, 10}, {13, 151, 13}}));
  EXPECT_EQ(pieces.remove_from(world, loose[0]), 9 * 110);
  pieces.update(world);
  EXPECT_EQ(pieces.size(), 1U);
}

TEST(ConnectedPieces, ConnectAcrossChunkCorners) {
  for (int i = 0; i < 27; ++i) {
    const IVec3 step{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    if (step == IVec3(0)) continue;
    // Places voxels on either side of the corner of eight chunks.
    const IVec3 first = glm::max(-step, IVec3(0)) - 1;
    Grid grid;
    grid.set(first, 1);
    grid.set(first + step, 2);
    const int steps = std::abs(step.x) + std::abs(step.y) + std::abs(step.z);
    ConnectedPieces faces;
    faces.update(grid);
    EXPECT_EQ(faces.size(), steps == 1 ? 1U : 2U);
    ConnectedPieces corners({Connectivity::Corners26, {}});
    corners.update(grid);
    EXPECT_EQ(corners.size(), 1U);
  }
}

TEST(ConnectedPieces, AreTheSameAtAnyThreadCount) {
  Random random(9);
  const Grid grid = random_grid(random);
  ConnectedPieces one;
  one.update(grid, {1});
  ConnectedPieces four;
  four.update(grid, {4});
  ASSERT_EQ(one.size(), four.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one.pieces()[i].first, four.pieces()[i].first);
    EXPECT_EQ(one.pieces()[i].voxels, four.pieces()[i].voxels);
  }
}

TEST(ConnectedPiecesDeathTest, AssertsOnUnknownPiece) {
  Grid grid;
  grid.set({0, 0, 0}, 1);
  ConnectedPieces pieces;
  pieces.update(grid, {1});
  QUOIN_EXPECT_MISTAKE((void)pieces.extract(1), "piece < size");
  QUOIN_EXPECT_MISTAKE(pieces.remove_from(grid, 1), "piece < size");
  QUOIN_EXPECT_MISTAKE(pieces.for_each_row(1, [](IVec3, std::uint64_t) {}), "piece < size");
}

// Returns true if a voxel of a piece is next to an unloaded one; checks voxel by voxel.
bool touches_unloaded(const Grid& grid, const ConnectedPieces& pieces, std::size_t piece, Connectivity connectivity) {
  bool found = false;
  pieces.for_each_row(piece, [&](IVec3 row, std::uint64_t voxels) {
    for (int x = 0; x < kChunkEdge; ++x) {
      if ((voxels >> x & 1U) == 0) continue;
      for (int i = 0; i < 27; ++i) {
        const IVec3 step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
        const int axes = std::abs(step.x) + std::abs(step.y) + std::abs(step.z);
        if (axes == 0 || (connectivity == Connectivity::Faces6 && axes > 1)) continue;
        found |= !grid.is_loaded(chunk_of(row + IVec3(x, 0, 0) + step));
      }
    }
  });
  return found;
}

TEST(ConnectedPieces, HoldPiecesThatTouchUnloadedChunks) {
  Grid grid;
  grid.make_partial();
  grid.load_chunk({0, 0, 0}, Chunk(kAir));
  grid.set(63, 10, 10, 1);  // may continue in the next chunk
  grid.set(30, 30, 30, 1);
  ConnectedPieces pieces;
  pieces.update(grid);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_TRUE(pieces.pieces()[0].touches_unloaded);
  EXPECT_FALSE(pieces.pieces()[1].touches_unloaded);
  const IBox ground{{0, 0, 0}, {64, 1, 64}};
  EXPECT_EQ(pieces.not_touching(ground), (std::vector<std::size_t>{1}));

  grid.load_chunk({1, 0, 0}, Chunk(kAir));  // it does not
  pieces.update(grid);
  EXPECT_FALSE(pieces.pieces()[0].touches_unloaded);
  EXPECT_EQ(pieces.not_touching(ground), (std::vector<std::size_t>{0, 1}));
  grid.unload_chunk({1, 0, 0});
  pieces.update(grid);
  EXPECT_TRUE(pieces.pieces()[0].touches_unloaded);
  // For comparison: in a whole grid with the same voxels all separate pieces fall.
  Grid whole;
  whole.set(63, 10, 10, 1);
  whole.set(30, 30, 30, 1);
  ConnectedPieces of_whole;
  of_whole.update(whole);
  EXPECT_EQ(of_whole.not_touching(ground), (std::vector<std::size_t>{0, 1}));
}

TEST(ConnectedPieces, TouchUnloadedDiagonallyOnlyWithCorners) {
  for (const Connectivity connectivity : {Connectivity::Faces6, Connectivity::Corners26}) {
    Grid grid;
    grid.make_partial();
    for (int i = 0; i < 27; ++i) {
      const IVec3 chunk(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      if (chunk != IVec3(1, 1, 0) && chunk != IVec3(-1, -1, -1)) grid.load_chunk(chunk, Chunk(kAir));
    }
    grid.set(63, 63, 20, 1);  // at the border of an unloaded chunk
    grid.set(0, 0, 0, 1);     // at the corner of another one
    // Its bounding box reaches both sides of the edge, but the piece does not.
    for (int x = 40; x < 64; ++x) grid.set(x, 40, 40, 1);
    for (int y = 40; y < 64; ++y) grid.set(40, y, 40, 1);
    ConnectedPieces pieces({.connectivity = connectivity, .belongs = {}});
    pieces.update(grid);
    ASSERT_EQ(pieces.size(), 3U);
    const bool has_corners = connectivity == Connectivity::Corners26;
    EXPECT_EQ(pieces.pieces()[0].touches_unloaded, has_corners);
    EXPECT_EQ(pieces.pieces()[1].touches_unloaded, has_corners);
    EXPECT_FALSE(pieces.pieces()[2].touches_unloaded);
  }
}

TEST(ConnectedPieces, TouchUnloadedChunksAsOracleSays) {
  std::mt19937 random(11);
  std::uniform_int_distribution<int> place(-2, 1);
  std::uniform_int_distribution<int> voxel(-128, 127);
  for (const Connectivity connectivity : {Connectivity::Faces6, Connectivity::Corners26}) {
    Grid grid;
    grid.make_partial();
    ConnectedPieces pieces({.connectivity = connectivity, .belongs = {}});
    int held = 0;
    for (int step = 0; step < 30; ++step) {
      const IVec3 chunk(place(random), place(random), place(random));
      if (step % 4 == 3) {
        grid.unload_chunk(chunk);
      } else {
        grid.load_chunk(chunk, Chunk(kAir));
      }
      for (int i = 0; i < 60; ++i) {
        const IVec3 at(voxel(random), voxel(random), voxel(random));
        grid.fill_box({at, at + IVec3(i % 9 + 1, 2, 1)}, 1);
      }
      pieces.update(grid);
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const bool expected = touches_unloaded(grid, pieces, i, connectivity);
        ASSERT_EQ(pieces.pieces()[i].touches_unloaded, expected) << step << " " << i;
        held += expected ? 1 : 0;
      }
    }
    EXPECT_GT(held, 50);
  }
}

}  // namespace
}  // namespace quoin
