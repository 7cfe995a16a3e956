#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/scene_file.h>

#include "io/packs/packs_for_tests.h"
#include "io/zip.h"

// Resource packs that a scene file names for its files.

namespace quoin {
namespace {

namespace fs = std::filesystem;

constexpr Rgba8 kRed{200, 40, 40, 255};
constexpr Rgba8 kBlue{40, 40, 200, 255};

using PackTexts = std::map<std::string, std::string>;

/// A pack whose stone is a cube of one colour.
PackTexts stone_pack(Rgba8 colour) {
  return {{"assets/minecraft/blockstates/stone.json", R"({"variants": {"": {"model": "block/stone"}}})"},
          {"assets/minecraft/models/block/stone.json",
           R"({"textures": {"all": "block/stone"}, "elements": [{"from": [0, 0, 0], "to": [16, 16, 16], "faces": {
             "down": {"texture": "#all"}, "up": {"texture": "#all"}, "north": {"texture": "#all"},
             "south": {"texture": "#all"}, "west": {"texture": "#all"}, "east": {"texture": "#all"}}}]})"},
          {"assets/minecraft/textures/block/stone.png", packs_test::plain_png(colour)}};
}

/// A folder with the schematic house.schem, a block of stone.
class ScenePacksTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("quoin_scene_packs_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "scene");
    Scene scene;
    const auto type = scene.types.add(packs_test::block("minecraft:stone").type);
    ASSERT_TRUE(type);
    SceneGrid grid;
    grid.grid.set({0, 0, 0}, *type);
    scene.add_instance({.grid = scene.add_grid(std::move(grid))});
    ASSERT_TRUE(save_scene(scene, in_scene("house.schem")));
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path in_scene(const std::string& name) const { return folder_ / "scene" / name; }

  void write_folder(const fs::path& path, const PackTexts& texts) const {
    for (const auto& [name, text] : texts) {
      fs::create_directories((path / name).parent_path());
      std::ofstream(path / name, std::ios::binary) << text;
    }
  }
  void write_zip(const fs::path& path, const PackTexts& texts) const {
    ZipFile zip;
    for (const auto& [name, text] : texts) {
      zip.begin(name);
      zip.put(text);
    }
    const auto bytes = zip.take();
    ASSERT_TRUE(bytes);
    ASSERT_TRUE(write_file(*bytes, path));
  }

  /// Loads a scene that places house.schem with the packs.
  [[nodiscard]] Result<LoadedScene> load(std::vector<SceneFile::Pack> packs, const LoadOptions& options = {}) const {
    SceneFile file;
    file.sources.push_back({"house", "house.schem", std::move(packs)});
    file.placements.push_back({.instance = {}, .source = "house"});
    const auto written = write_scene_file(file, in_scene("scene.json"));
    if (!written) return written.error();
    return load_scene(in_scene("scene.json"), options);
  }

  [[nodiscard]] static VoxelProperties stone_of(const LoadedScene& loaded) {
    const Scene& scene = loaded.scene;
    for (std::size_t i = 1; i < scene.types.size(); ++i) {
      const VoxelProperties& type = scene.types[static_cast<VoxelType>(i)];
      if (type.name == "minecraft:stone") return type;
    }
    ADD_FAILURE() << "no stone";
    return {};
  }

  fs::path folder_;
};

bool is_textured(const VoxelProperties& type, Rgba8 colour) {
  return !type.faces.empty() && type.colour == colour;
}

TEST_F(ScenePacksTest, GiveFilesTheirLooks) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  write_folder(in_scene("blue"), stone_pack(kBlue));
  const auto red = load({{"red.zip"}});
  ASSERT_TRUE(red) << to_string(red.error());
  EXPECT_TRUE(red->warnings.empty());
  EXPECT_TRUE(is_textured(stone_of(*red), kRed));
  const auto both = load({{"red.zip"}, {"blue"}});
  ASSERT_TRUE(both);
  EXPECT_TRUE(is_textured(stone_of(*both), kBlue)) << "the last pack is above the others";
  const auto plain = load({});
  ASSERT_TRUE(plain);
  EXPECT_TRUE(stone_of(*plain).faces.empty());
  const auto own = load({{kBuiltinPack}});
  ASSERT_TRUE(own);
  EXPECT_FALSE(stone_of(*own).faces.empty());
}

TEST_F(ScenePacksTest, AreBelowThoseOfTheOptions) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  write_zip(folder_ / "blue.zip", stone_pack(kBlue));
  LoadOptions options;
  options.packs = {folder_ / "blue.zip", kBuiltinPack};
  const auto above = load({{"red.zip"}}, options);
  ASSERT_TRUE(above) << to_string(above.error());
  EXPECT_TRUE(is_textured(stone_of(*above), kBlue));
  options.packs = {kBuiltinPack};
  const auto below = load({{"red.zip"}}, options);
  ASSERT_TRUE(below);
  EXPECT_TRUE(is_textured(stone_of(*below), kRed));
  options.packs.clear();
  options.scene_packs = false;
  const auto ignored = load({{"absent.zip"}}, options);
  ASSERT_TRUE(ignored);
  EXPECT_TRUE(ignored->warnings.empty());
  EXPECT_TRUE(stone_of(*ignored).faces.empty());
  options.packs = {folder_ / "absent.zip"};
  const auto missing = load({}, options);
  ASSERT_FALSE(missing) << "a pack that the caller names must exist";
  EXPECT_EQ(missing.error().code, ErrorCode::CannotRead);
}

TEST_F(ScenePacksTest, DifferPerFile) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  SceneFile file;
  file.sources = {{"plain", "house.schem"}, {"red", "house.schem", {{"red.zip"}}}};
  for (const char* const id : {"plain", "red"}) file.placements.push_back({.instance = {}, .source = id});
  ASSERT_TRUE(write_scene_file(file, in_scene("scene.json")));
  const auto loaded = load_scene(in_scene("scene.json"));
  ASSERT_TRUE(loaded);
  std::size_t textured = 0;
  loaded->scene.grids().for_each([&](GridHandle /*handle*/, const SceneGrid& grid) {
    textured += loaded->scene.types[grid.grid.types().at(0)].faces.empty() ? 0U : 1U;
  });
  EXPECT_EQ(textured, 1U);
}

TEST_F(ScenePacksTest, WarnOfMissingLooks) {
  PackTexts texts = stone_pack(kRed);
  texts.erase("assets/minecraft/textures/block/stone.png");
  write_zip(in_scene("red.zip"), texts);
  const auto loaded = load({{"red.zip"}});
  ASSERT_TRUE(loaded);
  ASSERT_EQ(loaded->warnings.size(), 1U);
  EXPECT_TRUE(loaded->warnings[0].starts_with("red.zip: resource packs: 1 texture missing")) << loaded->warnings[0];
}

TEST_F(ScenePacksTest, WarnOfMissingAndChangedPacks) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  const auto entry = scene_pack_of(in_scene("red.zip"), in_scene("scene.json"));
  ASSERT_TRUE(entry) << to_string(entry.error());
  EXPECT_EQ(entry->file, "red.zip");
  EXPECT_EQ(entry->hash.size(), 16U);
  const auto same = load({*entry});
  ASSERT_TRUE(same);
  EXPECT_TRUE(same->warnings.empty());
  EXPECT_TRUE(is_textured(stone_of(*same), kRed));

  write_zip(in_scene("red.zip"), stone_pack(kBlue));
  const auto changed = load({*entry});
  ASSERT_TRUE(changed) << to_string(changed.error());
  ASSERT_EQ(changed->warnings.size(), 1U);
  EXPECT_TRUE(changed->warnings[0].starts_with(
      "cannot use the resource pack \"red.zip\" of the scene file: it has changed: its hash is "))
      << changed->warnings[0];
  EXPECT_EQ(changed->unused_packs, std::vector<std::string>{"red.zip"});
  EXPECT_TRUE(stone_of(*changed).faces.empty());
  // The fallback of images.
  LoadOptions options;
  options.packs = {kBuiltinPack};
  const auto fallback = load({*entry}, options);
  ASSERT_TRUE(fallback);
  EXPECT_EQ(fallback->warnings.size(), 1U);
  EXPECT_FALSE(stone_of(*fallback).faces.empty());
  EXPECT_FALSE(is_textured(stone_of(*fallback), kBlue));
  const auto any = load({{"red.zip"}});
  ASSERT_TRUE(any);
  EXPECT_TRUE(is_textured(stone_of(*any), kBlue)) << "without a hash any content fits";

  fs::remove(in_scene("red.zip"));
  const auto missing = load({*entry, {"red.zip"}});
  ASSERT_TRUE(missing);
  ASSERT_EQ(missing->warnings.size(), 2U) << "one with a hash and one without";
  for (const std::string& warning : missing->warnings) {
    EXPECT_NE(warning.find("red.zip"), std::string::npos) << warning;
    EXPECT_NE(warning.find("No such file"), std::string::npos) << warning;
  }
  // Saving reports packs that it loses.
  const auto lost = unsupported_features(*missing, in_scene("saved.json"));
  ASSERT_TRUE(lost);
  EXPECT_EQ(*lost, (std::vector<std::string>{"resource pack left out: red.zip", "resource pack left out: red.zip"}));
}

TEST_F(ScenePacksTest, FollowTheRulesOfOtherFiles) {
  write_zip(folder_ / "red.zip", stone_pack(kRed));
  const std::string absolute = (folder_ / "red.zip").string();
  for (const std::string& outside : {std::string("../red.zip"), absolute, std::string("a/../../red.zip")}) {
    const auto refused = load({{outside}});
    ASSERT_TRUE(refused);
    ASSERT_EQ(refused->warnings.size(), 1U) << outside;
    EXPECT_NE(refused->warnings[0].find("outside the folder"), std::string::npos) << refused->warnings[0];
    EXPECT_TRUE(stone_of(*refused).faces.empty());
  }
  LoadOptions options;
  options.sidecar_files = SidecarFiles::Anywhere;
  for (const std::string& outside : {std::string("../red.zip"), absolute}) {
    const auto allowed = load({{outside}}, options);
    ASSERT_TRUE(allowed);
    EXPECT_TRUE(allowed->warnings.empty());
    EXPECT_TRUE(is_textured(stone_of(*allowed), kRed));
  }
  const auto entry = scene_pack_of(folder_ / "red.zip", in_scene("scene.json"));
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->file, "../red.zip");
  // A file of the folder that is a link to the outside.
  fs::create_symlink(folder_ / "red.zip", in_scene("link.zip"));
  const auto link = load({{"link.zip"}});
  ASSERT_TRUE(link);
  EXPECT_EQ(link->warnings.size(), 1U);
}

TEST_F(ScenePacksTest, WarnOfFilesThatAreNoPacks) {
  fs::create_directories(in_scene("empty"));
  std::ofstream(in_scene("text.zip")) << "text";
  write_zip(in_scene("other.zip"), {{"readme.txt", "text"}});
  for (const char* const name : {"empty", "text.zip", "other.zip"}) {
    for (const char* const hash : {"", "0123456789abcdef"}) {
      const auto loaded = load({{name, hash}});
      ASSERT_TRUE(loaded) << name;
      ASSERT_EQ(loaded->warnings.size(), 1U) << name;
      EXPECT_NE(loaded->warnings[0].find(name), std::string::npos) << loaded->warnings[0];
    }
  }
}

TEST_F(ScenePacksTest, CountRepeatedPacksAtTheirLastPlace) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  PackTexts texts = stone_pack(kBlue);
  texts.erase("assets/minecraft/blockstates/stone.json");
  texts["assets/minecraft/textures/block/stone.png"] = "no image";
  write_zip(in_scene("bad.zip"), texts);
  fs::create_symlink("bad.zip", in_scene("link.zip"));
  const auto loaded = load({{"red.zip"}, {"bad.zip"}, {"red.zip"}, {"bad.zip"}, {"link.zip"}});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->warnings.size(), 1U);
  EXPECT_TRUE(loaded->warnings[0].starts_with("red.zip: link.zip: resource packs: ")) << loaded->warnings[0];
  const auto turned = load({{"red.zip"}, {"bad.zip"}, {"red.zip"}});
  ASSERT_TRUE(turned);
  EXPECT_TRUE(turned->warnings.empty());
  EXPECT_TRUE(is_textured(stone_of(*turned), kRed)) << "red.zip is the highest";
}

TEST_F(ScenePacksTest, TogetherHaveAtMostTwoGibibytes) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  // A file without blocks on the disk: one alone would be read.
  std::ofstream(in_scene("large.zip")) << "PK";
  fs::resize_file(in_scene("large.zip"), std::uint64_t{2} << 30);
  const auto loaded = load({{"red.zip"}, {"large.zip"}, {"large.zip", "0123456789abcdef"}});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->warnings.size(), 2U) << "one with a hash and one without";
  for (const std::string& warning : loaded->warnings) {
    EXPECT_NE(warning.find("the packs of the scene file together have more than 2147483648 bytes"), std::string::npos)
        << warning;
  }
  EXPECT_TRUE(is_textured(stone_of(*loaded), kRed));
}

TEST_F(ScenePacksTest, HaveAtMost256Lists) {
  // 17 packs have 272 lists of two.
  std::vector<std::string> names;
  for (int i = 0; i < 17; ++i) {
    names.push_back("red" + std::to_string(i) + ".zip");
    write_zip(in_scene(names.back()), stone_pack(kRed));
  }
  SceneFile file;
  const auto load_with = [&](std::size_t count) {
    for (const std::string& low : names) {
      for (const std::string& high : names) {
        const std::string id = low + high;
        if (low == high || file.sources.size() == count) continue;
        file.sources.push_back({id, "house.schem", {{low}, {high}}});
        file.placements.push_back({.instance = {}, .source = id});
      }
    }
    EXPECT_EQ(file.sources.size(), count);
    EXPECT_TRUE(write_scene_file(file, in_scene("scene.json")));
    file.sources.clear();
    file.placements.clear();
    return load_scene(in_scene("scene.json"));
  };
  const auto most = load_with(256);
  ASSERT_TRUE(most) << to_string(most.error());
  const auto more = load_with(257);
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().code, ErrorCode::LimitExceeded);
  EXPECT_NE(more.error().message.find("more than 256 different lists of resource packs"), std::string::npos);
}

TEST_F(ScenePacksTest, WarnOfPacksThatCannotBeOpened) {
  fs::create_directories(in_scene("mod/textures"));
  std::ofstream(in_scene("mod/mod.conf")) << "name = mod";
  for (int folder = 0; folder < 10; ++folder) {
    const fs::path inner = in_scene("mod/" + std::to_string(folder));
    fs::create_directories(inner);
    std::ofstream(inner / "0") << "";
    for (int i = 1; i < 10'000; ++i) fs::create_hard_link(inner / "0", inner / std::to_string(i));
  }
  EXPECT_FALSE(hash_of_pack(in_scene("mod")));
  for (const char* const wanted : {"00ff00ff00ff00ff", ""}) {
    const auto loaded = load({{"mod", wanted}});
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    ASSERT_EQ(loaded->warnings.size(), 1U);
    EXPECT_NE(loaded->warnings[0].find("more than 100,000 files"), std::string::npos) << loaded->warnings[0];
  }
}

TEST_F(ScenePacksTest, AreWrittenAndListed) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  SceneFile file;
  const std::string hash = "00ff00ff00ff00ff";
  file.sources = {{"a", "house.schem", {{kBuiltinPack}, {"red.zip", hash}}}, {"b", "house.schem"}};
  const auto bytes = write_scene_file(file);
  ASSERT_TRUE(bytes);
  const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  EXPECT_NE(text.find("\"quoin_scene\": 10"), std::string::npos);
  const auto read = parse_scene_file(*bytes);
  ASSERT_TRUE(read);
  ASSERT_EQ(read->sources.at(0).packs.size(), 2U);
  EXPECT_EQ(read->sources[0].packs[0].file, kBuiltinPack);
  EXPECT_EQ(read->sources[0].packs[0].hash, "");
  EXPECT_EQ(read->sources[0].packs[1].file, "red.zip");
  EXPECT_EQ(read->sources[0].packs[1].hash, hash);
  EXPECT_TRUE(read->sources[1].packs.empty());
  EXPECT_EQ(*write_scene_file(*read), *bytes);
  ASSERT_TRUE(write_file(*bytes, in_scene("scene.json")));
  EXPECT_EQ(sidecar_files_of(in_scene("scene.json")),
            (std::vector<fs::path>{in_scene("house.schem"), in_scene("red.zip"), in_scene("house.schem")}));
  // Scenes without packs keep their version.
  file.sources[0].packs.clear();
  const auto older = write_scene_file(file);
  ASSERT_TRUE(older);
  EXPECT_NE(std::string(reinterpret_cast<const char*>(older->data()), older->size()).find("\"quoin_scene\": 1,"),
            std::string::npos);
}

TEST_F(ScenePacksTest, AreSavedInTypes) {
  write_zip(in_scene("red.zip"), stone_pack(kRed));
  const auto loaded = load({{"red.zip"}});
  ASSERT_TRUE(loaded);
  const auto saved = save_scene(*loaded, in_scene("whole.json"));
  ASSERT_TRUE(saved) << to_string(saved.error());
  EXPECT_TRUE(saved->warnings.empty());
  fs::remove(in_scene("red.zip"));
  const auto whole = load_scene(in_scene("whole.json"));
  ASSERT_TRUE(whole);
  EXPECT_TRUE(is_textured(stone_of(*whole), kRed));
}

TEST(ScenePacks, RejectsBadEntries) {
  const auto error_of = [](const std::string& packs) {
    const std::string text =
        R"({"quoin_scene": 10, "files": [{"id": "a", "path": "a.schem", "packs": )" + packs + R"(}], "instances": []})";
    const auto parsed = parse_scene_file(std::as_bytes(std::span(text)));
    return parsed ? "none" : to_string(parsed.error());
  };
  EXPECT_EQ(error_of(R"([{"path": "a.zip", "hash": "0123456789abcdef"}])"), "none");
  EXPECT_EQ(error_of("3"), "files[0].packs: must be a list");
  EXPECT_EQ(error_of(R"(["a.zip"])"), "files[0].packs[0]: must be an object");
  EXPECT_EQ(error_of(R"([{"hash": "0123456789abcdef"}])"), "files[0].packs[0]: \"path\" is missing");
  EXPECT_EQ(error_of(R"([{"path": ""}])"), "files[0].packs[0].path: must name a file");
  EXPECT_EQ(error_of(R"([{"path": "a", "size": 3}])"), "files[0].packs[0]: \"size\" is unknown here");
  for (const char* const hash : {"", "0123456789ABCDEF", "0123456789abcde", "0123456789abcdef0"}) {
    EXPECT_EQ(error_of(std::string(R"([{"path": "a.zip", "hash": ")") + hash + "\"}]"),
              "files[0].packs[0].hash: must be 16 hexadecimal digits in lower case");
  }
  std::string many = "[";
  for (int i = 0; i < 65; ++i) many += std::string(i == 0 ? "" : ", ") + R"({"path": "a.zip"})";
  EXPECT_NE(error_of(many + "]").find("files[0].packs"), std::string::npos) << error_of(many + "]");
}

TEST_F(ScenePacksTest, HashFollowsContent) {
  PackTexts texts = stone_pack(kRed);
  texts["pack.mcmeta"] = "{}";
  write_folder(in_scene("pack"), texts);
  write_zip(in_scene("pack.zip"), texts);
  const auto hash_of = [&](const char* name) {
    auto hash = hash_of_pack(in_scene(name));
    return hash ? *hash : to_string(hash.error());
  };
  const std::string hash = hash_of("pack");
  EXPECT_EQ(hash.size(), 16U) << hash;
  EXPECT_EQ(hash_of("pack.zip"), hash);
  PackTexts inside;
  for (const auto& [name, text] : texts) inside["folder/" + name] = text;
  write_zip(in_scene("inside.zip"), inside);
  EXPECT_EQ(hash_of("inside.zip"), hash) << "the folder in a zip does not count";
  texts["readme.txt"] = "not used";
  write_zip(in_scene("pack.zip"), texts);
  EXPECT_EQ(hash_of("pack.zip"), hash) << "nor do files outside of assets";

  // Each change of the content changes the hash.
  const std::string model = "assets/minecraft/models/block/stone.json";
  const std::vector<std::function<void(PackTexts&)>> changes = {
      [&](PackTexts& changed) { changed[model] += ' '; }, [&](PackTexts& changed) { changed[model][0] = '['; },
      [&](PackTexts& changed) { changed.erase(model); },
      [&](PackTexts& changed) { changed["assets/minecraft/models/block/more.json"] = "{}"; },
      [&](PackTexts& changed) {
        changed["assets/minecraft/models/block/stone2.json"] = changed[model];
        changed.erase(model);
      }};
  for (const auto& change : changes) {
    PackTexts changed = texts;
    change(changed);
    write_zip(in_scene("changed.zip"), changed);
    fs::remove_all(in_scene("changed"));
    write_folder(in_scene("changed"), changed);
    EXPECT_NE(hash_of("changed.zip"), hash);
    EXPECT_EQ(hash_of("changed"), hash_of("changed.zip"));
  }
  EXPECT_NE(hash_of("absent.zip").find("No such file"), std::string::npos) << hash_of("absent.zip");
}

TEST_F(ScenePacksTest, HashRefusesCircularFolders) {
  write_folder(in_scene("pack"), stone_pack(kRed));
  fs::create_directory_symlink(in_scene("pack/assets"), in_scene("pack/assets/again"));
  const auto hash = hash_of_pack(in_scene("pack"));
  ASSERT_FALSE(hash);
  EXPECT_EQ(hash.error().code, ErrorCode::CannotRead);
  EXPECT_NE(hash.error().message.find("a link to a folder that contains it"), std::string::npos);
}

TEST(BlockPacks, PacksForImagesAddTheOwnPack) {
  using Paths = std::vector<fs::path>;
  EXPECT_EQ(packs_for_images({}), Paths{kBuiltinPack});
  EXPECT_EQ(packs_for_images({"a.zip"}), (Paths{"a.zip", kBuiltinPack}));
  EXPECT_EQ(packs_for_images({kBuiltinPack, "a.zip"}), (Paths{kBuiltinPack, "a.zip"}));
  EXPECT_EQ(packs_for_images({kNoPack}), Paths{});
}

TEST(BlockPacks, ZipsInMemoryAreAboveFiles) {
  const auto zip_of = [](Rgba8 colour) {
    ZipFile zip;
    for (const auto& [name, text] : stone_pack(colour)) {
      zip.begin(name);
      zip.put(text);
    }
    return *zip.take();
  };
  const fs::path file = fs::path(testing::TempDir()) / "quoin_zips_above.zip";
  ASSERT_TRUE(write_file(zip_of(kRed), file));
  const std::vector<fs::path> paths = {file, kBuiltinPack};
  const auto packs = BlockPacks::open(paths, {zip_of(kBlue)});
  ASSERT_TRUE(packs);
  VoxelRegistry types;
  ASSERT_TRUE(types.add(packs_test::block("minecraft:stone").type));
  (*packs)->apply(types);
  EXPECT_EQ(types[1].colour, kBlue);
  EXPECT_FALSE((*packs)->applied(packs_test::block("minecraft:chest").type).shapes.empty()) << "builtin has chests";
  EXPECT_FALSE(BlockPacks::open(paths, {std::vector<std::byte>(30)}));
  fs::remove(file);
}

}  // namespace
}  // namespace quoin
