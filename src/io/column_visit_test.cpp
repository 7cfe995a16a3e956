// ChunkSource::visit_columns and part_stamp, of all kinds of sources.

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/io/block_packs.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>

#include "io/minecraft/minecraft.h"
#include "io/minecraft/minecraft_for_tests.h"
#include "io/minecraft/nbt.h"
#include "io/minecraft/signs.h"

namespace quoin {
namespace {

namespace fs = std::filesystem;
using minecraft_test::chunk_of_stairs;
using minecraft_test::NbtWriter;
using minecraft_test::region_with;

using Place = std::tuple<int, int, int>;  // x, z, -y: the order within a column
Place place_of(IVec3 voxel) {
  return {voxel.x, voxel.z, -voxel.y};
}
constexpr int kTop = std::numeric_limits<int>::max() / 2;

// All voxels of a source, as read_part returns them.
std::map<Place, VoxelType> voxels_of(const ChunkSource& source) {
  std::map<Place, VoxelType> voxels;
  for (std::size_t i = 0; i < source.parts().size(); ++i) {
    const auto part = source.read_part(i);
    EXPECT_TRUE(part);
    for (const SourceChunk& each : part->chunks) {
      for (int k = 0; k < static_cast<int>(kChunkVoxels); ++k) {
        const IVec3 local{k & 63, k >> 6 & 63, k >> 12};
        const VoxelType type = each.voxels.get(local);
        if (type != kAir) voxels[place_of(each.chunk * kChunkEdge + local)] = type;
      }
    }
  }
  return voxels;
}

// Visits all columns of a source, `most` voxels of each, and expects them from the top down.
std::map<Place, VoxelType> visited(const ChunkSource& source, int top = kTop,
                                   std::size_t most = std::numeric_limits<std::size_t>::max()) {
  std::map<Place, VoxelType> voxels;
  std::map<std::pair<int, int>, std::pair<int, std::size_t>> columns;  // the last height, and the number of voxels
  for (std::size_t i = 0; i < source.parts().size(); ++i) {
    columns.clear();
    const auto done = source.visit_columns(i, top, [&](IVec3 voxel, VoxelType type) {
      auto& [last, count] = columns.try_emplace({voxel.x, voxel.z}, kTop, 0).first->second;
      EXPECT_LT(voxel.y, last);
      EXPECT_LT(count, most) << "a voxel after the end of its column";
      last = voxel.y;
      EXPECT_TRUE(voxels.emplace(place_of(voxel), type).second);
      return ++count < most;
    });
    EXPECT_TRUE(done);
  }
  return voxels;
}

void expect_same_voxels(const ChunkSource& source) {
  const auto all = voxels_of(source);
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(visited(source), all);
  // One voxel per column: the highest, which comes first in the order of places.
  std::map<Place, VoxelType> highest;
  for (const auto& [place, type] : all) {
    const auto [x, z, y] = place;
    const auto before = highest.lower_bound({x, z, std::numeric_limits<int>::min()});
    if (before == highest.end() || std::get<0>(before->first) != x || std::get<1>(before->first) != z) {
      highest[place] = type;
    }
  }
  EXPECT_EQ(visited(source, kTop, 1), highest);
  // Cut at the height of some voxel.
  const int cut = -std::get<2>(std::next(all.begin(), static_cast<std::ptrdiff_t>(all.size() / 2))->first);
  std::map<Place, VoxelType> below;
  for (const auto& [place, type] : all) {
    if (-std::get<2>(place) <= cut) below.emplace(place, type);
  }
  EXPECT_EQ(visited(source, cut), below);
}

// A source of random chunks on top of each other, in two parts.
class RandomSource final : public ChunkSource {
 public:
  RandomSource() : ChunkSource({}, {{{0, -2, 0}, {1, 2, 1}}, {{1, 0, 0}, {2, 1, 1}}}) {}
  VoxelRegistry types() const override { return {}; }
  Result<SourcePart> read_part(std::size_t part) const override {
    SourcePart result;
    for (IVec3 place = parts()[part].min; place.y < parts()[part].max.y; ++place.y) {
      std::mt19937 random(static_cast<unsigned>(place.y + 10));
      std::vector<VoxelType> voxels(kChunkVoxels);
      for (VoxelType& voxel : voxels) voxel = random() % 50 == 0 ? static_cast<VoxelType>(1 + random() % 5) : kAir;
      result.chunks.push_back({place, Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(voxels))});
    }
    return result;
  }
};

TEST(ColumnVisit, FindsVoxelsOfPartsFromTop) {
  expect_same_voxels(RandomSource());
}

TEST(ColumnVisit, FindsBlocksOfMinecraft) {
  const auto source = minecraft::open_minecraft(region_with(chunk_of_stairs(-4), 5, 2));
  ASSERT_TRUE(source);
  expect_same_voxels(**source);
  const auto stamp = (*source)->part_stamp(0);
  ASSERT_TRUE(stamp);
  EXPECT_NE(*stamp, 0U);
}

TEST(ColumnVisit, KeepsTypesOfPackedSources) {
  auto source = minecraft::open_minecraft(region_with(chunk_of_stairs(3)));
  auto packs = BlockPacks::open(std::vector<fs::path>{kBuiltinPack});
  ASSERT_TRUE(source && packs);
  const auto packed = with_packs(std::move(*source), *packs);
  expect_same_voxels(*packed);
  const auto stamp = packed->part_stamp(0);
  ASSERT_TRUE(stamp);
  EXPECT_NE(*stamp, 0U);
}

TEST(ColumnVisit, FindsBlocksOfRealWorlds) {
  const fs::path data = fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data";
  int compared = 0;
  for (const char* const name : {"mc/PrismarineJS+prismarine-provider-anvil/test__fixtures__1.12.2__r.0.-1.mca",
                                 "mc/PrismarineJS+prismarine-provider-anvil/test__fixtures__1.18.2__r.0.0.mca",
                                 "mc/dougbinks+enkiMI/example__r.1.0.mca"}) {
    if (!fs::exists(data / name)) continue;
    const auto source = open_chunk_source(data / name);
    ASSERT_TRUE(source) << to_string(source.error());
    // The whole world takes long: every 16th part.
    for (std::size_t i = 0; i < (*source)->parts().size(); i += 16) {
      std::uint64_t wanted = 0;
      std::uint64_t found = 0;
      const auto part = (*source)->read_part(i);
      ASSERT_TRUE(part);
      for (const SourceChunk& each : part->chunks) wanted += static_cast<std::uint64_t>(each.voxels.non_air_count());
      const auto done = (*source)->visit_columns(i, kTop, [&](IVec3 voxel, VoxelType type) {
        const auto chunk = std::ranges::find(part->chunks, chunk_of(voxel), &SourceChunk::chunk);
        found += chunk != part->chunks.end() && chunk->voxels.get(local_of(voxel)) == type ? 1U : 0U;
        return true;
      });
      ASSERT_TRUE(done);
      EXPECT_EQ(found, wanted) << name << ", part " << i;
      EXPECT_EQ(done->broken.size(), part->broken.size());
      ++compared;
    }
  }
  if (compared == 0) GTEST_SKIP() << "needs ../shared/data";
}

// ---- stamps ----

std::uint64_t stamp_of(const fs::path& region) {
  const auto source = open_chunk_source(region);
  EXPECT_TRUE(source);
  const auto stamp = (*source)->part_stamp(0);
  EXPECT_TRUE(stamp);
  return stamp ? *stamp : 0;
}

TEST(PartStamp, ChangesWithTimeOrPlaceOfAnyChunk) {
  const fs::path folder = fs::path(testing::TempDir()) / "quoin_part_stamp";
  fs::create_directories(folder);
  const fs::path file = folder / "r.0.0.mca";
  std::vector<std::byte> region = region_with(chunk_of_stairs(0), 1, 2);
  const auto write = [&] { ASSERT_TRUE(write_file(region, file)); };
  write();
  const std::uint64_t first = stamp_of(file);
  EXPECT_EQ(stamp_of(file), first);
  EXPECT_NE(first, 0U);
  const std::size_t time = 4096 + 4 * (2 * 32 + 1);
  region[time + 3] = std::byte{1};  // saved a second later, in 1970
  write();
  const std::uint64_t second = stamp_of(file);
  EXPECT_NE(second, first);
  // Another chunk of the part: it need not be readable.
  region[4 * 32 + 2] = std::byte{2};
  region[4 * 32 + 3] = std::byte{1};
  write();
  EXPECT_NE(stamp_of(file), second);
  // A chunk that is saved now may be saved again in the same second.
  const auto now = static_cast<std::uint32_t>(std::time(nullptr));
  for (std::size_t i = 0; i < 4; ++i) region[time + i] = static_cast<std::byte>(now >> (8 * (3 - i)));
  write();
  EXPECT_EQ(stamp_of(file), 0U);
  fs::remove_all(folder);
}

// The game moves a chunk that has grown to other sectors, also while a source has the region open.
TEST(PartStamp, MovedChunksAreReadFromTheirNewPlace) {
  const fs::path folder = fs::path(testing::TempDir()) / "quoin_moved_chunk";
  fs::create_directories(folder);
  const fs::path file = folder / "r.0.0.mca";
  const std::vector<std::byte> region = region_with(chunk_of_stairs(0));
  ASSERT_TRUE(write_file(region, file));
  const auto source = open_chunk_source(file);
  ASSERT_TRUE(source);
  ASSERT_TRUE((*source)->part_stamp(0));  // reads the table
  const auto write_in_place = [&](const std::vector<std::byte>& bytes) {
    std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  };
  const auto count = [&](std::size_t& broken) {
    std::size_t voxels = 0;
    const auto done = (*source)->visit_columns(0, kTop, [&](IVec3, VoxelType) { return ++voxels > 0; });
    EXPECT_TRUE(done);
    broken = done ? done->broken.size() : 0;
    return voxels;
  };
  std::size_t broken = 0;
  const std::size_t before = count(broken);
  EXPECT_GT(before, 0U);
  std::vector<std::byte> moved(region.size() + 4096);
  std::copy(region.begin() + 8192, region.end(), moved.begin() + 12288);
  moved[2] = std::byte{3};
  moved[3] = region[3];
  write_in_place(moved);
  EXPECT_EQ(count(broken), before);
  EXPECT_EQ(broken, 0U);
  // Damage of a chunk that has not moved is reported.
  std::vector<std::byte> damaged = moved;
  damaged[2] = std::byte{2};
  write_in_place(damaged);
  EXPECT_EQ(count(broken), 0U);
  EXPECT_EQ(broken, 1U);
  fs::remove_all(folder);
}

// ---- signs ----

std::vector<SourceSign> signs_of(const NbtWriter& nbt) {
  const auto document = nbt::Document::parse(nbt.bytes);
  EXPECT_TRUE(document);
  std::vector<SourceSign> signs;
  minecraft::add_signs(document->root(), signs);
  return signs;
}

NbtWriter& sign_at(NbtWriter& nbt, std::string_view id, int x, int y, int z) {
  return nbt.string("id", id).integer("x", x).integer("y", y).integer("z", z);
}

TEST(Signs, HaveTextOfEveryVersion) {
  NbtWriter old;  // 1.8 to 1.19
  old.compound("").compound("Level").list("TileEntities", 10, 3);
  sign_at(old, "minecraft:sign", -3, 70, 9);
  old.string("Text1", R"({"text":"Welcome","extra":[{"text":" to "},"Quoin"]})").string("Text2", R"("the second")");
  old.string("Text3", "null").string("Text4", R"({"text":""})").end();
  sign_at(old, "minecraft:sign", 1, 2, 3).string("Text1", R"({"text":""})").end();
  sign_at(old, "Chest", 1, 2, 4).string("Text1", "no sign").end();
  old.end().end();
  const auto from_old = signs_of(old);
  ASSERT_EQ(from_old.size(), 1U) << "signs without text and chests are no markers";
  EXPECT_EQ(from_old[0].voxel, IVec3(-3, 70, 9));
  EXPECT_EQ(from_old[0].text, "Welcome to Quoin\nthe second");

  NbtWriter two_sides;  // from 1.20 on
  two_sides.compound("").list("block_entities", 10, 1);
  sign_at(two_sides, "minecraft:hanging_sign", 0, 0, 0).compound("front_text").list("messages", 8, 2);
  two_sides.text(R"("front")").text(R"({"translate":"some.key"})").end();
  two_sides.compound("back_text").list("messages", 8, 1).text("back").end().end().end();
  const auto from_new = signs_of(two_sides);
  ASSERT_EQ(from_new.size(), 1U);
  EXPECT_EQ(from_new[0].text, "front\nback");

  NbtWriter components;  // from 1.21.5 on: components in NBT
  components.compound("").list("block_entities", 10, 1);
  sign_at(components, "minecraft:sign", 5, 6, 7).compound("front_text").list("messages", 10, 1);
  components.string("text", "gold").list("extra", 10, 1).string("text", " and red").string("color", "red").end().end();
  components.end().end().end();
  const auto from_newest = signs_of(components);
  ASSERT_EQ(from_newest.size(), 1U);
  EXPECT_EQ(from_newest[0].text, "gold and red");
}

TEST(Signs, ShowTextOfBadComponentsAsStored) {
  NbtWriter nbt;
  nbt.compound("").list("block_entities", 10, 2);
  sign_at(nbt, "Sign", 0, 0, 0)
      .string("Text1", R"({"text":)")
      .string("Text2",
              "\xC2\xA7"
              "4red\xFF")
      .end();
  sign_at(nbt, "Sign", 0, 1, 0).string("Text1", std::string(3'000, '[') + "1").end();
  nbt.end();
  const auto signs = signs_of(nbt);
  ASSERT_EQ(signs.size(), 2U);
  EXPECT_EQ(signs[0].text, "{\"text\":\nred\xEF\xBF\xBD");
  EXPECT_EQ(signs[1].text.size(), 1'024U);
}

// A sign of a hostile world: many long parts of formatting codes, and lines without end.
TEST(Signs, AreShortHoweverLargeTheyAre) {
  NbtWriter nbt;
  nbt.compound("").list("block_entities", 10, 3);
  std::string codes;
  for (int i = 0; i < 20'000; ++i)
    codes +=
        "\xC2\xA7"
        "4";
  sign_at(nbt, "sign:sign", 1, 2, 3).compound("front_text").list("messages", 9, 1).number(8, 1).number(2'000, 4);
  for (int i = 0; i < 2'000; ++i) nbt.text(codes);
  nbt.end().end();
  sign_at(nbt, "sign:sign", 4, 5, 6).compound("front_text").list("messages", 8, 50'000);
  for (int i = 0; i < 50'000; ++i) nbt.text(i == 0 ? "first" : i < 4 ? "" : "beyond");
  nbt.end().end();
  sign_at(nbt, "sign:sign", 7, 8, 9).string("Text1", std::string(60'000, 'a')).end();
  nbt.end();
  const auto signs = signs_of(nbt);
  ASSERT_EQ(signs.size(), 2U);
  EXPECT_EQ(signs[0].text, "first");
  EXPECT_EQ(signs[1].text.size(), 1'024U);
}

}  // namespace
}  // namespace quoin
