#include <algorithm>
#include <filesystem>
#include <optional>
#include <random>

#include <gtest/gtest.h>
#include <quoin/io/file.h>

#include "core/work/nightly_for_tests.h"
#include "io/vox/vox_for_tests.h"

namespace quoin {
namespace {

using vox_test::Entries;
using vox_test::FileBuilder;
using vox_test::wrong_with;

Error error_of(const std::vector<std::byte>& bytes) {
  const Result<LoadedScene> loaded = read_vox(bytes);
  EXPECT_FALSE(loaded);
  return loaded ? Error{} : loaded.error();
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return to_string(error_of(bytes));
}

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

FileBuilder file_of_one_voxel() {
  FileBuilder builder;
  builder.model(1, 1, 1, {{0, 0, 0, 1}});
  return builder;
}

/// Returns a small file with every kind of chunk.
std::vector<std::byte> full_file() {
  FileBuilder builder;
  builder.with("PACK", [](auto& out) { out.u32(2); });
  builder.with("META", [](auto& out) { out.dict({{"_anim_range", "0 4"}}); });
  builder.model(3, 2, 4, {{0, 0, 0, 1}, {2, 1, 3, 255}}).model(1, 1, 1, {{0, 0, 0, 7}});
  builder.transform(0, 1, {{}}).group(1, {2, 4, 6});
  builder.transform(2, 3, {{{"_t", "1 -2 3"}, {"_r", "17"}}, {{"_f", "4"}, {"_t", "5 5 5"}}}, {{"_name", "a"}});
  builder.shape(3, {{0, {{"_f", "0"}}}, {1, {{"_f", "3"}}}});
  builder.transform(4, 5, {{{"_r", "105"}}}, {{"_hidden", "1"}}).shape(5, 1);
  builder.transform(6, 5, {{}}, {}, 3);
  builder.layer(0, {{"_name", "top"}}).layer(3, {{"_hidden", "1"}});
  builder.with("RGBA", [](auto& out) {
    for (std::uint32_t i = 0; i < 256; ++i) out.u32(i * 0x010305U);
  });
  builder.with("IMAP", [](auto& out) {
    for (std::uint32_t i = 0; i < 64; ++i) out.u32(0x00FFFEFDU - 0x04040404U * i);
  });
  builder.material(7, {{"_type", "_glass"}, {"_trans", "0.3"}});
  builder.with("MATT", [](auto& out) {
    for (const std::uint32_t word : {9U, 1U, 0x3F000000U, 2U, 0x3E800000U}) out.u32(word);
  });
  return builder.file();
}

TEST(VoxHostile, AcceptsFullFile) {
  const auto loaded = read_vox(full_file());
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.instances().size(), 3U);
  EXPECT_EQ(wrong_with(full_file()), "");
  EXPECT_EQ(wrong_with(full_file(), {.frame = 4}), "");
}

TEST(VoxHostile, RefusesEveryTruncation) {
  const std::vector<std::byte> whole = full_file();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto loaded = read_vox(std::span(whole).first(size));
    ASSERT_FALSE(loaded) << size;
    EXPECT_EQ(to_string(loaded.error()).find('\n'), std::string::npos);
  }
}

/// MAIN grows and shrinks with the cut, so that the chunks inside are cut instead of MAIN itself.
TEST(VoxHostile, SurvivesEveryTruncationInsideMain) {
  const std::vector<std::byte> whole = full_file();
  for (std::size_t size = 20; size < whole.size(); ++size) {
    std::vector<std::byte> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    for (std::size_t i = 0; i < 4; ++i) cut[16 + i] = static_cast<std::byte>((size - 20) >> (8 * i) & 0xFFU);
    EXPECT_EQ(wrong_with(cut), "") << size;
  }
}

TEST(VoxHostile, SurvivesFlippedBits) {
  const std::vector<std::byte> whole = full_file();
  constexpr std::uint32_t kSeed = 20'261;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 4'000; ++round) {
    std::vector<std::byte> flipped = whole;
    for (std::uint32_t flips = 1 + random() % 4; flips > 0; --flips) {
      flipped[random() % flipped.size()] ^= std::byte{static_cast<unsigned char>(1U << random() % 8)};
    }
    ASSERT_EQ(wrong_with(flipped), "") << "seed " << kSeed << ", round " << round;
  }
}

TEST(VoxHostile, SurvivesAnyChangedByte) {
  const std::vector<std::byte> whole = full_file();
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int value : {0, 0x7F, 0x80, 0xFF}) {
      // By day every byte takes two of the values.
      if (!is_nightly() && (at + static_cast<std::size_t>(value)) % 2 != 0) continue;
      std::vector<std::byte> changed = whole;
      changed[at] = static_cast<std::byte>(value);
      ASSERT_EQ(wrong_with(changed), "") << "byte " << at << " is " << value;
    }
  }
}

TEST(VoxHostile, NamesOtherFormats) {
  EXPECT_EQ(text_of({}), "the file is empty");
  EXPECT_EQ(text_of(bytes_of("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")),
            "a Git LFS pointer, not the file itself (git lfs pull fetches it)");
  EXPECT_EQ(text_of(bytes_of("GIF\n")), "byte 0: a MagicaVoxel file starts with \"VOX \", this file with \"GIF \"");
  std::vector<std::byte> slab6(12 + 2 * 3 * 4 + 768);
  for (const std::size_t axis : {0U, 1U, 2U}) slab6[4 * axis] = static_cast<std::byte>(2 + axis);
  EXPECT_EQ(text_of(slab6), "a SLAB6 .vox file, not a MagicaVoxel .vox file");
}

TEST(VoxHostile, RefusesSizesBeyondFormat) {
  EXPECT_EQ(text_of(FileBuilder().size(0xFFFF'FFFF, 40, 40).voxels({}).file()),
            "byte 20: chunk SIZE claims 4294967295 x 40 x 40 voxels");
  EXPECT_EQ(text_of(FileBuilder().size(1, 257, 1).voxels({}).file()), "byte 20: chunk SIZE claims 1 x 257 x 1 voxels");
}

TEST(VoxHostile, RefusesCountsBeyondBytes) {
  const auto with_words = [](std::string_view id, const std::vector<std::uint32_t>& words) {
    return file_of_one_voxel()
        .with(id,
              [&](auto& out) {
                for (const std::uint32_t word : words) out.u32(word);
              })
        .file();
  };
  constexpr std::uint32_t kMost = 0xFFFF'FFFFU;
  EXPECT_EQ(text_of(FileBuilder().size(1, 1, 1).with("XYZI", [](auto& out) { out.u32(kMost); }).file()),
            "byte 44: chunk XYZI claims 4294967295 voxels in 0 bytes");
  EXPECT_EQ(text_of(with_words("nGRP", {0, 0, kMost})), "byte 64: chunk nGRP ends before its content");
  EXPECT_EQ(text_of(with_words("nGRP", {0, kMost})), "byte 64: chunk nGRP ends before its content");
  EXPECT_EQ(text_of(with_words("nGRP", {0, 1, kMost, 0, 0})), "byte 64: chunk nGRP ends before its content");
  EXPECT_EQ(text_of(with_words("nTRN", {0, 0, 1, kMost, 0, kMost})), "byte 64: chunk nTRN ends before its content");
  EXPECT_EQ(text_of(with_words("nSHP", {0, 0, kMost})), "byte 64: chunk nSHP ends before its content");
  EXPECT_EQ(text_of(with_words("MATL", {0, kMost})), "byte 64: chunk MATL ends before its content");
  EXPECT_EQ(text_of(with_words("MATT", {0, 0, 0, kMost})), "byte 64: chunk MATT ends before its content");
  EXPECT_EQ(text_of(with_words("RGBA", {})), "byte 64: chunk RGBA ends before its content");
  EXPECT_EQ(text_of(with_words("IMAP", {0})), "byte 64: chunk IMAP ends before its content");
}

TEST(VoxHostile, RefusesChunksBeyondFile) {
  std::vector<std::byte> bytes = file_of_one_voxel().file();
  bytes[16] = std::byte{44 + 21};
  EXPECT_EQ(text_of(bytes), "byte 8: chunk MAIN claims 65 bytes, but 44 are left");
  bytes = file_of_one_voxel().file();
  bytes[27] = std::byte{0xFF};
  EXPECT_EQ(text_of(bytes), "byte 20: chunk SIZE claims 4278190092 bytes, but 32 are left");
  bytes = file_of_one_voxel().file();
  bytes[8] = std::byte{'N'};
  EXPECT_EQ(text_of(bytes), "byte 8: the first chunk must be MAIN, not \"NAIN\"");
}

TEST(VoxHostile, SkipsBytesAfterMainWithWarning) {
  std::vector<std::byte> bytes = file_of_one_voxel().file();
  bytes.resize(bytes.size() + 9);
  const auto loaded = read_vox(bytes);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->warnings, std::vector<std::string>{"the last 9 bytes are outside MAIN; skipped"});
}

TEST(VoxHostile, RequiresPairsOfSizesAndVoxels) {
  EXPECT_EQ(text_of(FileBuilder().voxels({}).file()), "byte 20: chunk XYZI has no SIZE before it");
  EXPECT_EQ(text_of(FileBuilder().size(1, 1, 1).file()), "byte 20: chunk SIZE has no XYZI after it");
  EXPECT_EQ(text_of(FileBuilder().size(1, 1, 1).size(1, 1, 1).voxels({}).file()),
            "byte 44: chunk SIZE follows another SIZE, whose XYZI is missing");
}

TEST(VoxHostile, RefusesInvalidGraphs) {
  EXPECT_EQ(text_of(file_of_one_voxel().transform(0, 0, {{}}).file()), "byte 64: node 0 is its own descendant");
  EXPECT_EQ(text_of(file_of_one_voxel().transform(0, 1, {{}}).group(1, {2}).transform(2, 1, {{}}).file()),
            "byte 104: node 1 is its own descendant");
  EXPECT_EQ(text_of(file_of_one_voxel().group(1, {2}).group(2, {1}).file()), "byte 64: node 1 is its own descendant");
  EXPECT_EQ(text_of(file_of_one_voxel().transform(0, 9, {{}}).file()),
            "byte 64: node 0 refers to node 9, which does not exist");
  EXPECT_EQ(text_of(file_of_one_voxel().transform(0, 1, {{}}).shape(1, 4).file()),
            "byte 104: node 1 shows model 4, but there are 1");
  EXPECT_EQ(text_of(file_of_one_voxel().transform(0, 1, {{}}).shape(1, 0).shape(1, 0).file()),
            "byte 136: node 1 is a duplicate");
  EXPECT_EQ(
      text_of(
          file_of_one_voxel().transform(0, 1, {{}}).shape(1, std::vector<std::pair<std::uint32_t, Entries>>{}).file()),
      "byte 104: chunk nSHP has no model");
}

TEST(VoxHostile, RefusesInvalidTransforms) {
  const auto with_frame = [](const Entries& frame) {
    return file_of_one_voxel().transform(0, 1, {frame}).shape(1, 0).file();
  };
  for (const char* r : {"0", "3", "5", "10", "-1", "256", "4.0", "x", "99999999999999999999"}) {
    EXPECT_EQ(text_of(with_frame({{"_r", r}})),
              "byte 64: chunk nTRN has the invalid rotation \"" + std::string(r) + "\"");
  }
  for (const char* t : {"1 2", "1 2 3 4", "1 2 x", "1e3 0 0", "2147483648 0 0", "1,2,3", " "}) {
    EXPECT_EQ(text_of(with_frame({{"_t", t}})),
              "byte 64: chunk nTRN has the invalid translation \"" + std::string(t) + "\"");
  }
  EXPECT_EQ(text_of(with_frame({{"_f", "-1"}})), "byte 64: chunk nTRN has the invalid frame \"-1\"");
}

TEST(VoxHostile, AddsHugeTranslationsWithoutOverflow) {
  FileBuilder builder = file_of_one_voxel();
  constexpr int kDepth = 100;
  for (int i = 0; i < kDepth; ++i) builder.transform(i, i + 1, {{{"_t", "2147483647 -2147483648 0"}}});
  builder.shape(kDepth, 0);
  const auto loaded = read_vox(builder.file());
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Instance& instance = loaded->scene.instances()[loaded->scene.instances().handles()[0]];
  EXPECT_EQ(instance.position, DVec3(2147483647.0 * kDepth, 0, 2147483648.0 * kDepth));
  const auto written = write_vox(loaded->scene);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::LimitExceeded);
}

TEST(VoxHostile, WalksMillionNestedGroups) {
  FileBuilder builder = file_of_one_voxel();
  constexpr int kDepth = 1'000'000;
  builder.transform(0, 1, {{}});
  for (int i = 1; i < kDepth; ++i) builder.group(i, {i + 1});
  builder.shape(kDepth, 0);
  const auto loaded = read_vox(builder.file());
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.instances().size(), 1U);
}

/// 64 groups, each containing the next one twice: 2^64 paths.
FileBuilder doubling_graph() {
  FileBuilder builder = file_of_one_voxel();
  builder.transform(0, 1, {{}});
  for (int i = 1; i <= 64; ++i) builder.group(i, {i + 1, i + 1});
  return builder;
}

TEST(VoxHostile, BoundsCopiesOfSharedNodes) {
  EXPECT_EQ(error_of(doubling_graph().shape(65, 0).file()).code, ErrorCode::LimitExceeded);
  EXPECT_EQ(error_of(doubling_graph().group(65, {}).file()).code, ErrorCode::LimitExceeded);
}

TEST(VoxHostile, BoundsCopiesOfLongNames) {
  FileBuilder builder = file_of_one_voxel();
  std::vector<std::int32_t> children(60'000, 2);
  builder.transform(0, 1, {{}}).group(1, children);
  builder.transform(2, 3, {{}}, {{"_name", std::string(100'000, 'n')}}).shape(3, 0);
  EXPECT_EQ(error_of(builder.file()).code, ErrorCode::LimitExceeded);
}

TEST(VoxHostile, BoundsMemoryOfScatteredVoxels) {
  std::vector<vox_test::FileVoxel> voxels;
  for (int i = 0; i < 16'384; ++i) {
    // One voxel in every slab of 64x4x4, with every colour.
    voxels.push_back({static_cast<std::uint8_t>(i % 4 * 64), static_cast<std::uint8_t>(i / 4 % 64 * 4),
                      static_cast<std::uint8_t>(i / 256 * 4), static_cast<std::uint8_t>(1 + i % 255)});
  }
  FileBuilder builder;
  for (int i = 0; i < 60; ++i) builder.model(256, 256, 256, voxels);
  const auto loaded = read_vox(builder.file());
  if (!loaded) {
    EXPECT_EQ(loaded.error().code, ErrorCode::LimitExceeded);
  }
  EXPECT_LE(loaded ? vox_test::grid_bytes(loaded->scene) : 0, std::size_t{1} << 29);
}

// Real writers have counted headers as part of MAIN's children.
TEST(VoxHostile, ReadsMainThatClaimsTooManyBytes) {
  for (const int more : {1, 8, 12, 20}) {
    std::vector<std::byte> bytes = file_of_one_voxel().file();
    bytes[16] = static_cast<std::byte>(44 + more);
    const auto loaded = read_vox(bytes);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->scene.voxel_count(), 1);
    EXPECT_EQ(loaded->warnings, std::vector<std::string>{"MAIN claims " + std::to_string(more) +
                                                         " bytes past the end of the file; the rest was read"});
    // The same file, truncated.
    bytes.pop_back();
    if (more < 20) {
      EXPECT_EQ(text_of(bytes), "byte 44: chunk XYZI claims 8 bytes, but 7 are left");
    }
    bytes.resize(44);
    EXPECT_FALSE(read_vox(bytes)) << "a SIZE whose XYZI is missing";
  }
}

TEST(VoxHostile, SurvivesCorpus) {
  const std::filesystem::path folder = std::filesystem::path(QUOIN_SOURCE_DIR) / "tests/corpus/vox";
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes) << entry.path();
    for (const int frame : {0, 1}) {
      EXPECT_EQ(wrong_with(*bytes, {.show_hidden = frame == 1, .frame = frame}), "") << entry.path();
    }
    ++count;
  }
  EXPECT_GT(count, 0);
}

}  // namespace
}  // namespace quoin
