// The format of docs/formats/new_format.md, which shows the code between the two marks.

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <iostream>
#include <sstream>

#include <gtest/gtest.h>

#include <quoin/io/formats.h>

// docs: begin
#include <charconv>
#include <string>
#include <string_view>

#include "core/bytes/bytes.h"
#include "io/format_driver.h"
#include "io/models/model_builder.h"
#include "io/placed_grids.h"

// Toy files: the line "toy", then one line "x y z" per voxel. The voxels have no colours: they are grey.

namespace quoin::models {

namespace {

bool is_toy(std::span<const std::byte> beginning) {
  return text_of(beginning).starts_with("toy\n");
}

/// Parses the number that begins at `at`, and moves `at` behind it.
bool parse(std::string_view text, std::size_t& at, int& number) {
  while (at < text.size() && text[at] == ' ') ++at;
  const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), number);
  at = static_cast<std::size_t>(end - text.data());
  return error == std::errc();
}

Result<LoadedScene> read_toy(const FormatInput& input) {
  constexpr int kFarthest = 1 << 20;
  const std::string_view text = text_of(input.bytes);
  ModelBuilder builder;
  builder.begin({});
  for (std::size_t line = 4; line < text.size();) {
    std::size_t at = line;
    IVec3 voxel{0};
    for (int axis = 0; axis < 3; ++axis) {
      if (!parse(text, at, voxel[axis])) return bad_at(at, "expected a coordinate");
      if (std::abs(voxel[axis]) > kFarthest) return bad_at(line, "coordinate exceeds 1,048,576");
    }
    if (Status put = builder.put(voxel, {190, 190, 190, 255}); !put) return put.error();
    line = std::min(text.find('\n', at), text.size() - 1) + 1;
  }
  return builder.take("toy");
}

Result<EncodedFile> write_toy(const FormatOutput& output) {
  auto merged = merge_grids(output.scene, {.extension = ".toy", .colours = false});
  if (!merged) return merged.error();
  std::string text = "toy\n";
  merged->voxels.for_each([&](IVec3 voxel, VoxelType) {
    for (int axis = 0; axis < 3; ++axis) text += std::to_string(voxel[axis]) + (axis < 2 ? " " : "\n");
  });
  const auto bytes = std::as_bytes(std::span(text));
  return EncodedFile{{bytes.begin(), bytes.end()}, std::move(merged->warnings)};
}

}  // namespace

}  // namespace quoin::models

namespace quoin {

extern constinit const FormatDriver kToyFormat = {
    .info = {FileFormat("toy"), ".toy", "Toy file", FormatCapability::Read | FormatCapability::Write},
    .detect = models::is_toy,
    .read = models::read_toy,
    .encode = models::write_toy,
};

}  // namespace quoin
// docs: end

namespace quoin {
namespace {

/// A row of format_drivers.cpp would register it.
void register_toy() {
  static const bool done = register_format(kToyFormat);
  ASSERT_TRUE(done);
}

TEST(NewFormat, ReadsAndWritesWithOneDriver) {
  register_toy();
  const std::string text = "toy\n0 0 0\n1 0 0\n-5 70 3";
  const auto bytes = std::as_bytes(std::span(text));
  EXPECT_EQ(detect_format(bytes), FileFormat("toy"));
  const auto loaded = load_scene(bytes);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.voxel_count(), 3);
  const auto path = std::filesystem::temp_directory_path() / "quoin_new_format.toy";
  ASSERT_TRUE(save_scene(*loaded, path));
  const auto again = load_scene(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->scene.voxel_count(), 3);
  EXPECT_EQ(again->format, "toy");
}

TEST(NewFormat, RejectsDamagedFiles) {
  register_toy();
  const std::string text = "toy\n0 0\n";
  const auto refused = load_scene(std::as_bytes(std::span(text)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().byte_offset, 7U);
}

TEST(NewFormat, AppearsInListsAndMessages) {
  register_toy();
  EXPECT_NE(extensions_with(FormatCapability::Write).find(".toy"), std::string::npos);
  EXPECT_EQ(format_with_extension("A.TOY", FormatCapability::Read)->name(), "toy");
  const Status refused = check_capability(FileFormat("toy"), FormatCapability::Lamps, "--lights");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "cannot write --lights to .toy: it has no lamps and cameras; use .glb or .gltf");
}

/// The format of a program: the line "dots", then a character per voxel along x.
CustomFormat dots_format() {
  return {.info = {FileFormat("dots"), ".dots", "Dots", FormatCapability::Read | FormatCapability::Write},
          .detect = [](std::span<const std::byte> beginning) { return text_of(beginning).starts_with("dots\n"); },
          .read = [](const FormatInput& input) -> Result<LoadedScene> {
            LoadedScene loaded;
            loaded.format = "dots";
            const auto type = loaded.scene.types.add(VoxelProperties{});
            if (!type) return type.error();
            SceneGrid row;
            row.grid.fill_box({{0, 0, 0}, {static_cast<int>(input.bytes.size()) - 5, 1, 1}}, *type);
            Instance instance;
            instance.grid = loaded.scene.add_grid(std::move(row));
            loaded.scene.add_instance(instance);
            return loaded;
          },
          .encode = [](const FormatOutput& output) -> Result<EncodedFile> {
            const std::string text = "dots\n" + std::string(static_cast<std::size_t>(output.scene.voxel_count()), '.');
            const auto bytes = std::as_bytes(std::span(text));
            return EncodedFile{{bytes.begin(), bytes.end()}, {"colours left out"}};
          }};
}

TEST(AddedFormat, IsReadWrittenAndListed) {
  static const Status added = add_format(dots_format());
  ASSERT_TRUE(added) << to_string(added.error());
  const std::string text = "dots\n...";
  const auto loaded = load_scene(std::as_bytes(std::span(text)));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.voxel_count(), 3);
  const auto path = std::filesystem::temp_directory_path() / "quoin_added_format.dots";
  const auto saved = save_scene(loaded->scene, path);
  ASSERT_TRUE(saved) << to_string(saved.error());
  EXPECT_EQ(saved->warnings, std::vector<std::string>{"colours left out"});
  EXPECT_EQ(detect_format(path).value(), FileFormat("dots"));
  EXPECT_EQ(load_scene(path).value().scene.voxel_count(), 3);
  std::filesystem::remove(path);
  EXPECT_EQ(format_with_extension("a.dots", FormatCapability::Write)->name(), "dots");
  EXPECT_EQ(std::ranges::count(file_formats(), FileFormat("dots"), &FormatInfo::format), 1);
  EXPECT_NE(extensions_with(FormatCapability::Read).find(".dots, "), std::string::npos);
  EXPECT_NE(extensions_with(FormatCapability::Write).find(".dots, "), std::string::npos);
  const auto unknown = format_for_writing("a.unknown");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find(".dots, "), std::string::npos) << unknown.error().message;
}

TEST(AddedFormat, RefusesInvalidFormats) {
  const auto refusal = [](auto change) {
    CustomFormat format = dots_format();
    format.info.format = FileFormat("refused");
    format.info.extension = ".refused";
    change(format);
    const Status added = add_format(format);
    return added ? "" : added.error().message;
  };
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.format = FileFormat::Vox; }),
            "cannot add format vox: the name exists");
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.format = FileFormat(""); }), "cannot add format : it has no name");
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.extension = ".glb"; }),
            "cannot add format refused: extension \".glb\" exists");
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.extension = ".kvx"; }),
            "cannot add format refused: extension \".kvx\" exists");
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.also = ".refused2 .glb"; }),
            "cannot add format refused: extension \".glb\" exists");
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.also = ".refused2 .kvx"; }),
            "cannot add format refused: extension \".kvx\" exists");
  for (const char* const invalid : {"", ".", "refused", "a.refused", ".Refused", ".re.fused", ".re fused", " .refused",
                                    ".refused ", "..refused", ".re/fused"}) {
    EXPECT_EQ(refusal([&](CustomFormat& f) { f.info.extension = invalid; }),
              "cannot add format refused: invalid extension \"" + std::string(invalid) + "\"");
  }
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.also = ".refused2 .Refused3"; }),
            "cannot add format refused: invalid extension \".Refused3\"");
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.also = ".refused2  .refused3"; }),
            "cannot add format refused: invalid extension \"\"");
  EXPECT_EQ(refusal([](CustomFormat& f) {
              f = {.info = f.info};
              f.info.capabilities = FormatCapability::Environment;
            }),
            "cannot add format refused: it can be neither read nor written");
  const std::string mismatch = "cannot add format refused: its capabilities do not match its functions";
  EXPECT_EQ(refusal([](CustomFormat& f) { f.read = nullptr; }), mismatch);
  EXPECT_EQ(refusal([](CustomFormat& f) { f.detect = nullptr; }), mismatch);
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.capabilities = FormatCapability::Read; }), mismatch);
  EXPECT_EQ(refusal([](CustomFormat& f) { f.info.capabilities = f.info.capabilities | FormatCapability::Meshes; }),
            mismatch);
}

/// Adds formats until one is refused, and ends the process.
[[noreturn]] void fill_table() {
  static std::deque<std::string> words;  // which the formats view
  for (int i = 0; i < 100; ++i) {
    const std::string number = std::to_string(file_formats().size());
    CustomFormat format = dots_format();
    format.info.format = FileFormat(words.emplace_back("f" + number));
    format.info.extension = words.emplace_back(".f" + number);
    if (const Status added = add_format(format); !added) {
      std::cerr << added.error().message;
      std::_Exit(added.error().code == ErrorCode::LimitExceeded && file_formats().size() == 64 ? 0 : 1);
    }
  }
  std::_Exit(2);
}

TEST(AddedFormatDeathTest, RefusesTheSixtyFifth) {
  // In another process, since formats cannot be removed.
  EXPECT_EXIT(fill_table(), testing::ExitedWithCode(0), "cannot add format f64: there are 64");
}

std::string text_of_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(std::string(QUOIN_SOURCE_DIR) + "/" + path).rdbuf();
  return text.str();
}

TEST(NewFormat, MatchesDocumentedCode) {
  const std::string source = text_of_file("src/io/models/new_format_test.cpp");
  const std::string begin = std::string("// docs: ") + "begin\n";
  const std::string end = std::string("// docs: ") + "end\n";
  const std::size_t first = source.find(begin) + begin.size();
  const std::string code = "```cpp\n" + source.substr(first, source.find(end) - first) + "```\n";
  EXPECT_NE(text_of_file("docs/formats/new_format.md").find(code), std::string::npos);
}

}  // namespace
}  // namespace quoin
