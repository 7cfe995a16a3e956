#include "io/packs/pack_files.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/hash.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/file.h>

#include "core/bytes/bytes.h"
#include "io/packs/node_pack.h"
#include "io/packs/packs_for_tests.h"
#include "io/zip.h"

namespace quoin::packs {
namespace {

namespace fs = std::filesystem;

std::vector<std::byte> zip_of(const std::vector<std::pair<std::string, std::string>>& files) {
  ZipFile zip;
  for (const auto& [name, text] : files) {
    zip.begin(name);
    zip.put(text);
  }
  return *zip.take();
}

std::string text_in(const PackFiles& pack, std::string_view path) {
  const auto bytes = pack.read(path, kMaxJsonBytes);
  if (!bytes) return "error: " + bytes.error().message;
  return *bytes ? std::string(text_of(**bytes)) : "absent";
}

std::string error_of_zip(std::vector<std::byte> zip) {
  const auto pack = open_pack(std::move(zip));
  return pack ? "" : pack.error().message;
}

fs::path fresh_folder(const std::string& name) {
  fs::path folder = fs::path(::testing::TempDir()) / ("quoin_packs_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

TEST(PackFiles, ReadsZipFolderAndMemoryAlike) {
  const std::string path = "assets/minecraft/models/block/a.json";
  const auto zip = open_pack(zip_of({{path, "{}"}, {"pack.mcmeta", "{}"}}));
  ASSERT_TRUE(zip);
  const fs::path folder = fresh_folder("alike");
  write_text(folder / path, "{}");
  const auto in_folder = open_pack(folder);
  ASSERT_TRUE(in_folder);
  const MemoryPack memory({{path, "{}"}});
  for (const PackFiles* pack : {zip->get(), in_folder->get(), static_cast<const PackFiles*>(&memory)}) {
    EXPECT_EQ(text_in(*pack, path), "{}");
    EXPECT_EQ(text_in(*pack, "assets/minecraft/models/block/b.json"), "absent");
    EXPECT_EQ(text_in(*pack, "assets/minecraft/models"), "absent") << "a folder";
    const auto small = pack->read(path, 1);
    ASSERT_FALSE(small);
    EXPECT_EQ(small.error().code, ErrorCode::LimitExceeded);
  }
}

TEST(PackFiles, OpensZipWhoseFilesLieInOneFolder) {
  const auto pack = open_pack(zip_of({{"My Pack/pack.mcmeta", "{}"}, {"My Pack/assets/a/b.json", "inside"}}));
  ASSERT_TRUE(pack);
  EXPECT_EQ(text_in(**pack, "assets/a/b.json"), "inside");
}

TEST(PackFiles, LaterPacksOverrideFileByFile) {
  auto below = std::make_shared<MemoryPack>();
  below->put("assets/a", "below");
  below->put("assets/b", "below");
  auto above = std::make_shared<MemoryPack>();
  above->put("assets/b", "above");
  const PackStack stack({below, above});
  EXPECT_EQ(text_in(stack, "assets/a"), "below");
  EXPECT_EQ(text_in(stack, "assets/b"), "above");
  EXPECT_EQ(text_in(PackStack({above, below}), "assets/b"), "below");
  EXPECT_EQ(text_in(stack, "assets/c"), "absent");
}

TEST(PackFiles, RefusesNamesThatLeaveThePack) {
  const fs::path folder = fresh_folder("inside");
  fs::create_directories(folder / "pack/assets");
  write_text(folder / "secret.json", "secret");
  const auto pack = open_pack(folder / "pack");
  ASSERT_TRUE(pack);
  for (const std::string path : {"../secret.json", "assets/../../secret.json", "/etc/hostname", "assets//a", "./a",
                                 "assets\\..\\a", "", "a b", "assets/a/"}) {
    EXPECT_FALSE(is_pack_path(path)) << path;
    EXPECT_EQ(text_in(**pack, path), "absent") << path;
  }
  EXPECT_FALSE(is_pack_path(std::string(513, 'a')));
  EXPECT_TRUE(is_pack_path("assets/minecraft/textures/block/a-b_c.png"));
  // A zip may store such a name; the pack does not have it.
  const auto zip = open_pack(zip_of({{"assets/../../a", "outside"}, {"assets/a", "inside"}}));
  ASSERT_TRUE(zip);
  EXPECT_EQ(text_in(**zip, "assets/../../a"), "absent");
  EXPECT_EQ(text_in(**zip, "assets/a"), "inside");
}

TEST(PackFiles, RefusesLinksOutOfTheFolder) {
  const fs::path folder = fresh_folder("links");
  fs::create_directories(folder / "pack/assets/real");
  fs::create_directories(folder / "outside");
  write_text(folder / "secret.json", "secret");
  write_text(folder / "outside/a.json", "secret");
  write_text(folder / "pack/assets/real/a.json", "inside");
  std::error_code error;
  fs::create_symlink(folder / "secret.json", folder / "pack/assets/file.json", error);
  if (error) GTEST_SKIP() << "the file system has no links";
  fs::create_directory_symlink(folder / "outside", folder / "pack/assets/folder");
  fs::create_directory_symlink("real", folder / "pack/assets/alias");
  fs::create_directory_symlink(folder / "pack", folder / "link");
  for (const char* name : {"pack", "link"}) {
    const auto pack = open_pack(folder / name);
    ASSERT_TRUE(pack);
    for (const std::string path : {"assets/file.json", "assets/folder/a.json"}) {
      EXPECT_TRUE(text_in(**pack, path).find("a link to a file outside the folder") != std::string::npos)
          << text_in(**pack, path);
    }
    EXPECT_EQ(text_in(**pack, "assets/alias/a.json"), "inside") << "a link within the folder";
  }
}

TEST(PackFiles, RefusesLinksOutOfLuantiFolders) {
  const fs::path folder = fresh_folder("node_links");
  write_text(folder / "secret.png", packs_test::plain_png({1, 2, 3}));
  write_text(folder / "game/game.conf", "");
  write_text(folder / "game/textures/real.png", "inside");
  std::error_code error;
  fs::create_symlink(folder / "secret.png", folder / "game/textures/private.png", error);
  if (error) GTEST_SKIP() << "the file system has no links";
  fs::create_symlink("real.png", folder / "game/textures/alias.png");
  fs::create_directory_symlink(folder / "game", folder / "link");
  for (const char* name : {"game", "link"}) {
    const auto pack = open_pack(folder / name);
    ASSERT_TRUE(pack);
    for (const char* end : {"", ".mcmeta"}) {
      const std::string text = text_in(**pack, tile_path("private") + end);
      EXPECT_NE(text.find("a link to a file outside the folder"), std::string::npos) << text;
    }
    EXPECT_EQ(text_in(**pack, tile_path("real")), "inside");
    EXPECT_EQ(text_in(**pack, tile_path("alias")), "inside") << "a link within the folder";
  }
}

TEST(PackFiles, HashCountsTheFilesThatAreUsed) {
  const fs::path folder = fresh_folder("hash");
  const auto hash_of = [&](const char* name) {
    const auto hash = hash_of_files(folder / name);
    EXPECT_TRUE(hash) << name;
    return hash ? *hash : 0;
  };
  // Returns true if a change of a file changes the hash of a pack.
  const auto counts = [&](const char* name, const fs::path& file) {
    write_text(folder / file, "before");
    const std::uint64_t before = hash_of(name);
    write_text(folder / file, "after");
    const std::uint64_t after = hash_of(name);
    fs::remove(folder / file);
    return after != before;
  };
  write_text(folder / "pack/assets/a.json", "{}");
  write_text(folder / "game/game.conf", "");
  write_text(folder / "game/mods/textures/stone.png", "tile");
  EXPECT_TRUE(counts("game", "game/mods/my mod/textures/x.png")) << "names with blanks are tiles";
  EXPECT_FALSE(counts("game", "game/mods/textures/x.txt"));
  EXPECT_FALSE(counts("game", "game/mods/drawings/x.png")) << "no tile";
  fs::create_directories(folder / "outside");
  fs::create_directories(folder / "pack/real");
  std::error_code error;
  fs::create_directory_symlink(folder / "pack/real", folder / "pack/assets/alias", error);
  if (error) GTEST_SKIP() << "the file system has no links";
  EXPECT_TRUE(counts("pack", "pack/real/b.json")) << "a linked folder inside";
  fs::create_directory_symlink(folder / "outside", folder / "pack/assets/far");
  EXPECT_FALSE(counts("pack", "outside/b.json")) << "a linked folder outside";
  fs::create_symlink(folder / "outside/c", folder / "pack/assets/c.json");
  EXPECT_FALSE(counts("pack", "outside/c")) << "a linked file outside";
  fs::create_symlink(folder / "outside/c.png", folder / "game/mods/textures/c.png");
  EXPECT_FALSE(counts("game", "outside/c.png")) << "a linked tile outside";
  fs::create_directory_symlink(folder / "pack/assets", folder / "pack/real/again");
  const auto circular = hash_of_files(folder / "pack");
  ASSERT_FALSE(circular);
  EXPECT_EQ(circular.error().code, ErrorCode::CannotRead);
}

TEST(PackFiles, IdentitiesDifferByContent) {
  const auto identity_of = [](const std::string& content) {
    return (*open_pack(zip_of({{"assets/a", content}})))->identity();
  };
  EXPECT_EQ(identity_of("a"), identity_of("a"));
  EXPECT_NE(identity_of("a"), identity_of("b"));
  const auto a = *open_pack(zip_of({{"assets/a", "a"}}));
  const auto b = *open_pack(zip_of({{"assets/a", "b"}}));
  EXPECT_NE(PackStack({a, b}).identity(), PackStack({b, a}).identity());
  MemoryPack memory;
  memory.put("assets/a", "1");
  const std::string before = memory.identity();
  memory.put("assets/a", "2");
  EXPECT_NE(memory.identity(), before);
}

TEST(PackFiles, RejectsOtherFilesAndFolders) {
  EXPECT_NE(error_of_zip({}).find("nor a zip file"), std::string::npos);
  EXPECT_NE(error_of_zip({std::byte{'P'}, std::byte{'K'}, std::byte{3}}).find("cut off"), std::string::npos);
  EXPECT_NE(error_of_zip(zip_of({{"readme.txt", ""}})).find("no folder assets"), std::string::npos);
  const fs::path folder = fresh_folder("empty");
  const auto empty = open_pack(folder);
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().path, folder.string());
  const auto missing = open_pack(folder / "missing.zip");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::CannotRead);
}

TEST(PackFiles, ReportsDamagedZip) {
  std::vector<std::byte> zip = zip_of({{"assets/a", std::string(1'000, 'a') + "b"}});
  const std::vector<std::byte> whole = zip;
  zip[14] ^= std::byte{1};  // the local header's checksum is not used
  EXPECT_EQ(text_in(**open_pack(zip), "assets/a").size(), 1'001U);
  zip[40] ^= std::byte{0x40};
  EXPECT_TRUE(text_in(**open_pack(zip), "assets/a").starts_with("error: assets/a is damaged"));
  // Any byte may be wrong: an error, or the right content.
  for (std::size_t i = 0; i < whole.size(); ++i) {
    zip = whole;
    zip[i] ^= std::byte{0xFF};
    const auto pack = open_pack(zip);
    if (!pack) continue;
    const std::string text = text_in(**pack, "assets/a");
    EXPECT_TRUE(text == "absent" || text.starts_with("error: ") || text.size() == 1'001) << i;
  }
}

TEST(PackFiles, RefusesZipBombBeforeExpansion) {
  const auto pack = open_pack(zip_of({{"assets/bomb.json", std::string(std::size_t{16} << 20, ' ')}}));
  ASSERT_TRUE(pack);
  const auto bytes = (*pack)->read("assets/bomb.json", kMaxJsonBytes);
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::LimitExceeded);
  EXPECT_NE(bytes.error().message.find("16777216"), std::string::npos) << bytes.error().message;
}

// Converts the records at the end of a small zip with one file to zip64.
std::vector<std::byte> as_zip64(const std::vector<std::byte>& zip) {
  const std::size_t end = zip.size() - 22;
  const auto size = load<std::uint32_t>(&zip[end + 12], std::endian::little);
  const auto begin = load<std::uint32_t>(&zip[end + 16], std::endian::little);
  std::vector<std::byte> out(zip.begin(), zip.begin() + static_cast<std::ptrdiff_t>(end));
  const auto put = [&](std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
  };
  const std::uint64_t at = out.size();
  put(0x06064B50, 4);
  put(44, 8);
  put(0, 12);
  for (const std::uint64_t value : {std::uint64_t{1}, std::uint64_t{1}, std::uint64_t{size}, std::uint64_t{begin}}) {
    put(value, 8);
  }
  put(0x07064B50, 4);
  put(0, 4);
  put(at, 8);
  put(1, 4);
  put(0x06054B50, 4);
  put(0, 4);
  put(0xFFFF'FFFF, 4);
  put(0xFFFF'FFFF'FFFF'FFFF, 8);
  put(0, 2);
  return out;
}

TEST(PackFiles, ReadsZip64) {
  const std::vector<std::byte> zip = zip_of({{"assets/a", "inside"}});
  std::vector<std::byte> large = as_zip64(zip);
  const auto pack = open_pack(large);
  ASSERT_TRUE(pack) << pack.error().message;
  EXPECT_EQ(text_in(**pack, "assets/a"), "inside");
  large[large.size() - 22 - 20] ^= std::byte{1};  // no locator: the directory's fields are out of range
  EXPECT_FALSE(open_pack(large));
}

// A pack like the one of the benchmark packs/stack.
class BlockPackStack : public testing::Test {
 protected:
  static constexpr int kTypes = 24;

  static std::shared_ptr<BlockPacks> opened() {
    static const std::vector<std::byte> zip =
        packs_test::pack_stack({.textures = 40, .texture_size = 128, .models = 30});
    return *BlockPacks::open(std::vector<std::vector<std::byte>>{zip});
  }
};

TEST_F(BlockPackStack, LooksAreTheSameForAnyNumberOfThreads) {
  const VoxelRegistry plain = packs_test::stack_types(kTypes);
  const auto one_by_one = opened();
  for (const unsigned threads : {1U, 3U, 8U}) {
    VoxelRegistry types = plain;
    const auto packs = opened();
    packs->apply(types, {threads});
    EXPECT_EQ(to_string(packs->report()), "");
    EXPECT_EQ(packs->report().types, static_cast<std::size_t>(kTypes));
    for (std::size_t i = 1; i < types.size(); ++i) {
      const VoxelProperties& type = types[static_cast<VoxelType>(i)];
      EXPECT_EQ(type.shapes.empty(), (i - 1) % 3 == 0) << type.name;
      VoxelProperties wanted = one_by_one->applied(plain[static_cast<VoxelType>(i)]);
      wanted.colour = type.colour;  // of a registry
      EXPECT_EQ(type, wanted) << type.name;
    }
  }
}

TEST_F(BlockPackStack, TexelsStayCompressedUntilTheyAreRead) {
  VoxelRegistry types = packs_test::stack_types(kTypes);
  opened()->apply(types);
  TextureSet textures;
  textures.add(types);
  ASSERT_EQ(textures.arrays().size(), 1U);
  const std::vector<Texture>& all = textures.arrays()[0].layers;
  EXPECT_EQ(all.size(), 32U) << "24, and a top for each pair of 16 models";
  for (const Texture& texture : all) EXPECT_FALSE(texture.has_texels()) << texture.name();
  decode_textures(types, {2});
  for (const Texture& texture : all) {
    ASSERT_TRUE(texture.has_texels());
    const int number = std::stoi(texture.name().substr(std::string("pack:block/t").size()));
    const auto wanted =
        Texture::from_image(texture.name(), packs_test::noise_image(128, static_cast<std::uint32_t>(number) % 16));
    EXPECT_EQ(texture, *wanted);
  }
}

TEST(PackTextures, KeepNoPngThatIsLargerThanItsTexels) {
  const auto texture = [](int frames) {
    const std::string png = packs_test::png(
        64,
        [](int x, int y) {
          const std::uint32_t bits = mix_bits(static_cast<std::uint32_t>(x + 64 * y));
          const auto byte = [&](int shift) { return static_cast<std::uint8_t>((bits >> shift) % 16 * 17); };
          return Rgba8{byte(0), byte(8), byte(16)};
        },
        frames);
    const auto bytes = std::as_bytes(std::span(png));
    auto made = texture_of_png("noise", {bytes.begin(), bytes.end()}, R"({"animation": {}})");
    EXPECT_TRUE(made);
    return std::pair(made->texture, png.size());
  };
  const auto [one, size] = texture(1);
  EXPECT_LT(size, 64U * 64U * 4U);
  EXPECT_FALSE(one.has_texels());
  const auto [first_of_many, large] = texture(16);
  EXPECT_GT(large, 64U * 64U * 4U);
  EXPECT_TRUE(first_of_many.has_texels());
  EXPECT_EQ(first_of_many, one);
}

TEST(PackTextures, ThrowIfTheirPngCannotBeDecodedAgain) {
  const std::string png = packs_test::plain_png({1, 2, 3}, 64);
  const auto bytes = std::as_bytes(std::span(png));
  EXPECT_EQ(texels_of_png(bytes, {0, 0, 64, 64}).width, 64);
  EXPECT_THROW(static_cast<void>(texels_of_png(bytes.first(bytes.size() / 2), {0, 0, 64, 64})), std::bad_alloc);
}

TEST(BlockPackInputs, CorpusMakesValidTypes) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(QUOIN_SOURCE_DIR "/tests/corpus/packs")) {
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes);
    EXPECT_TRUE(packs_test::reads_any_pack(*bytes)) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 4U);
}

}  // namespace
}  // namespace quoin::packs
