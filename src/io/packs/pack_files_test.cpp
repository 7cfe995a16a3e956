#include "io/packs/pack_files.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/bytes/bytes.h"
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

}  // namespace
}  // namespace quoin::packs
