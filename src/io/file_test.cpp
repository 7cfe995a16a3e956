#include <quoin/io/file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "core/bytes/files.h"

namespace quoin {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_in(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

class FileTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "quoin-file-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string content(const fs::path& path) const {
    const auto bytes = read_file(path);
    EXPECT_TRUE(bytes);
    return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "";
  }
  [[nodiscard]] std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }

  fs::path folder_;
};

TEST_F(FileTest, InputOutlivesItsDatabase) {
  const fs::path path = folder_ / "a";
  ASSERT_TRUE(write_file(bytes_in("database"), path));
  ASSERT_TRUE(write_file(bytes_in("other"), folder_ / "b"));
  HeldFile held(path);
  const auto first = InputFile::open(path);
  ASSERT_TRUE(first);
  { const auto second = InputFile::open(path); }
  held = HeldFile();
  const auto other = InputFile::open(folder_ / "b");  // would get a descriptor that was closed
  ASSERT_TRUE(other);
  ASSERT_TRUE(first->read());
  EXPECT_EQ(first->read()->size(), 8U);
  EXPECT_EQ(other->read()->size(), 5U);
}

TEST_F(FileTest, InputKeepsItsContentIfReplaced) {
  const fs::path path = folder_ / "a";
  ASSERT_TRUE(write_file(bytes_in("first"), path));
  auto opened = InputFile::open(path);
  ASSERT_TRUE(opened);
  const InputFile copy = *opened;
  opened = InputFile::open(folder_);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().message, "it is a folder");
  ASSERT_TRUE(write_file(bytes_in("second"), path));
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{2}, std::size_t{5}, std::size_t{100}}) {
    const auto read = copy.read_beginning(bytes);
    ASSERT_TRUE(read);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(read->data()), read->size()),
              std::string("first", std::min<std::size_t>(bytes, 5)));
  }
  EXPECT_EQ(copy.read()->size(), 5U);
  EXPECT_EQ(read_file(path)->size(), 6U);
  EXPECT_EQ(copy.path(), path);
}

TEST_F(FileTest, RoundTrips) {
  const fs::path path = folder_ / "a";
  ASSERT_TRUE(write_file(bytes_in("hello"), path));
  EXPECT_EQ(content(path), "hello");
  ASSERT_TRUE(write_file(bytes_in(""), path));
  EXPECT_EQ(content(path), "");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(FileTest, KeepsOldFileWithoutCommit) {
  const fs::path path = folder_ / "a";
  ASSERT_TRUE(write_file(bytes_in("old"), path));
  {
    auto file = AtomicFile::create(path);
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write(bytes_in("new")));
    EXPECT_EQ(content(path), "old");
  }
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(FileTest, KeepsPermissionsAndSymbolicLinks) {
  const fs::path target = folder_ / "target";
  const fs::path link = folder_ / "link";
  ASSERT_TRUE(write_file(bytes_in("old"), target));
  fs::permissions(target, fs::perms::owner_all | fs::perms::others_read);
  fs::create_symlink("target", link);
  ASSERT_TRUE(write_file(bytes_in("new"), link));
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(content(target), "new");
  EXPECT_EQ(fs::status(target).permissions(), fs::perms::owner_all | fs::perms::others_read);
}

TEST_F(FileTest, RefusesFoldersDevicesAndMissingPaths) {
  for (const fs::path& path : {folder_, fs::path("/dev/null"), folder_ / "no" / "such", fs::path("")}) {
    const Status written = write_file(bytes_in("x"), path);
    ASSERT_FALSE(written) << path;
    EXPECT_EQ(written.error().code, ErrorCode::CannotWrite);
    EXPECT_EQ(written.error().path, path.string());
    const auto read = read_file(path);
    ASSERT_FALSE(read) << path;
    EXPECT_EQ(read.error().code, ErrorCode::CannotRead);
  }
  EXPECT_EQ(entries(), 0U);
}

TEST_F(FileTest, DoesNotWaitForAFifo) {
  const fs::path fifo = folder_ / "fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_FALSE(read_file(fifo));
  EXPECT_FALSE(write_file(bytes_in("x"), fifo));
}

TEST_F(FileTest, BackupKeepsReplacedFile) {
  const fs::path path = folder_ / "world.vox";
  const fs::path backup_path = folder_ / "world.vox~";
  {
    auto nothing = FileBackup::of(path);
    ASSERT_TRUE(nothing);
    EXPECT_TRUE(nothing->keep());
  }
  EXPECT_EQ(entries(), 0U) << "there was no file";
  ASSERT_TRUE(write_file(bytes_in("first"), path));
  for (const std::string next : {"second", "third"}) {
    const std::string before = content(path);
    auto backup = FileBackup::of(path);
    ASSERT_TRUE(backup);
    ASSERT_TRUE(write_file(bytes_in(next), path));
    EXPECT_TRUE(backup->keep());
    EXPECT_EQ(content(path), next);
    EXPECT_EQ(content(backup_path), before);
    EXPECT_EQ(entries(), 2U);
  }
  {
    const auto unused = FileBackup::of(path);
    ASSERT_TRUE(unused);
  }
  EXPECT_EQ(content(backup_path), "second") << "a file that was not written replaces no backup";
  EXPECT_EQ(entries(), 2U);
}

TEST_F(FileTest, BackupSparesFoldersAndFollowsLinks) {
  const fs::path path = folder_ / "a";
  ASSERT_TRUE(write_file(bytes_in("kept"), path));
  fs::create_directory(folder_ / "a~");
  EXPECT_EQ(FileBackup::name_for(path), folder_ / "a.~1~");
  auto first = FileBackup::of(path);
  ASSERT_TRUE(first && first->keep());
  EXPECT_EQ(content(folder_ / "a.~1~"), "kept");
  EXPECT_TRUE(fs::is_directory(folder_ / "a~"));
  fs::remove(folder_ / "a~");
  fs::create_symlink("a", folder_ / "link");
  auto backup = FileBackup::of(folder_ / "link");
  ASSERT_TRUE(backup);
  EXPECT_TRUE(backup->keep());
  EXPECT_EQ(content(folder_ / "a~"), "kept");
}

TEST_F(FileTest, NumbersKeptBackups) {
  const fs::path path = folder_ / "a";
  for (const char* version : {"first", "second", "third"}) {
    ASSERT_TRUE(write_file(bytes_in(version), path));
    auto backup = FileBackup::of(path, FileBackup::Older::Kept);
    ASSERT_TRUE(backup && backup->keep());
  }
  EXPECT_EQ(content(folder_ / "a~"), "first");
  EXPECT_EQ(content(folder_ / "a.~1~"), "second");
  EXPECT_EQ(content(folder_ / "a.~2~"), "third");
  EXPECT_EQ(FileBackup::name_for(folder_ / "nothing"), fs::path());
}

// Returns the number that the next file to be opened gets.
int next_descriptor() {
  const int descriptor = ::open("/", O_RDONLY | O_CLOEXEC);
  ::close(descriptor);
  return descriptor;
}

TEST_F(FileTest, FinishedFileWaitsClosedForItsCommit) {
  const fs::path path = folder_ / "a";
  ASSERT_TRUE(write_file(bytes_in("old"), path));
  const int free = next_descriptor();
  {
    auto left = AtomicFile::create(path);
    ASSERT_TRUE(left && left->write(bytes_in("left")) && left->finish());
    EXPECT_EQ(next_descriptor(), free);
    AtomicFile moved = std::move(*left);
    EXPECT_EQ(entries(), 2U);
  }
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(entries(), 1U);
  auto file = AtomicFile::create(path);
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write(bytes_in("new")));
  ASSERT_TRUE(file->finish());
  EXPECT_TRUE(file->finish());
  EXPECT_FALSE(file->write(bytes_in("later")));
  EXPECT_EQ(next_descriptor(), free);
  EXPECT_EQ(content(path), "old");
  AtomicFile moved = std::move(*file);
  EXPECT_FALSE(file->commit());
  ASSERT_TRUE(moved.commit());
  EXPECT_FALSE(moved.finish());
  EXPECT_EQ(content(path), "new");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(FileTest, CommitsMovedFile) {
  const fs::path path = folder_ / "a";
  auto first = AtomicFile::create(path);
  ASSERT_TRUE(first);
  AtomicFile second = std::move(*first);
  ASSERT_TRUE(second.write(bytes_in("moved")));
  ASSERT_TRUE(second.commit());
  EXPECT_FALSE(second.commit());
  EXPECT_EQ(content(path), "moved");
  EXPECT_EQ(entries(), 1U);
}

}  // namespace
}  // namespace quoin
