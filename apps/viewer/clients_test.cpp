#include "clients.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "viewer/viewer_fixture.h"

namespace quoin::viewer {
namespace {

namespace fs = std::filesystem;

/// Sets environment variables and restores them.
class Environ {
 public:
  Environ(const char* name, const std::string& value) : name_(name) {
    const char* const before = std::getenv(name);
    if (before != nullptr) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  Environ(const Environ&) = delete;
  Environ& operator=(const Environ&) = delete;
  ~Environ() {
    if (before_) {
      ::setenv(name_, before_->c_str(), 1);
    } else {
      ::unsetenv(name_);
    }
  }

 private:
  const char* name_;
  std::optional<std::string> before_;
};

void write(const fs::path& file, const std::string& text = "PK") {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

std::vector<std::string> versions_of(const std::vector<InstalledClient>& clients) {
  std::vector<std::string> versions;
  for (const InstalledClient& client : clients) versions.push_back(client.version);
  return versions;
}

TEST(Clients, VersionsAreOrdered) {
  const std::vector<std::string> sorted = {"26.1",      "1.21.10",
                                           "1.21.4",    "1.21",
                                           "1.21-pre1", "1.20.6",
                                           "1.8.9",     "1.8",
                                           "25w02a",    "24w14potato",
                                           "24w14a",    "24w03b",
                                           "rd-132211", "fabric-loader-0.16.9-1.21.4",
                                           "b1.7.3",    "-1.2",
                                           ""};
  std::vector<std::string> shuffled(sorted.rbegin(), sorted.rend());
  std::ranges::stable_sort(shuffled, is_newer_version);
  EXPECT_EQ(shuffled, sorted);
  for (const std::string& a : sorted) {
    EXPECT_FALSE(is_newer_version(a, a)) << a;
    for (const std::string& b : sorted) EXPECT_FALSE(is_newer_version(a, b) && is_newer_version(b, a)) << a << " " << b;
  }
}

TEST(Clients, AreFoundInTheUsualFolders) {
  const ScratchFolder folder("clients");
  const fs::path home = folder.file("home");
  const Environ home_is("HOME", home.string());
  const Environ data_is("XDG_DATA_HOME", folder.file("data").string());
  const Environ appdata_is("APPDATA", "relative");
  EXPECT_TRUE(find_clients(usual_client_folders()).empty());
  write(home / ".minecraft/versions/1.20.4/1.20.4.jar");
  write(home / ".minecraft/versions/1.21/1.21.jar");
  write(home / ".minecraft/versions/1.21/1.21.json");
  write(home / ".minecraft/versions/24w14a/24w14a.jar");
  write(home / ".minecraft/versions/fabric-loader/fabric-loader.jar", "");  // empty
  write(home / ".minecraft/versions/other/name.jar");
  fs::create_directories(home / ".minecraft/versions/folder/folder.jar");
  write(home / ".minecraft/versions/version_manifest_v2.json");
  write(folder.file("data/PrismLauncher/libraries/com/mojang/minecraft/1.21.4/minecraft-1.21.4-client.jar"));
  write(folder.file("data/PrismLauncher/libraries/com/mojang/minecraft/1.21/minecraft-1.21-client.jar"));
  write(home / ".local/share/multimc/libraries/com/mojang/minecraft/1.7.10/minecraft-1.7.10-client.jar");
  write(home / ".local/share/multimc/libraries/com/mojang/minecraft/1.7.10/minecraft-1.7.10-server.jar");
  write(home / "Library/Application Support/minecraft/versions/1.19/1.19.jar");
  const auto clients = find_clients(usual_client_folders());
  EXPECT_EQ(versions_of(clients), (std::vector<std::string>{"1.21.4", "1.21", "1.20.4", "1.19", "1.7.10", "24w14a"}));
  EXPECT_EQ(clients.at(1).jar, home / ".minecraft/versions/1.21/1.21.jar") << "the official launcher comes first";
}

TEST(Clients, NeedAbsoluteFolders) {
  const Environ home_is("HOME", "relative");
  const Environ data_is("XDG_DATA_HOME", "");
  const Environ appdata_is("APPDATA", "");
  const ClientFolders folders = usual_client_folders();
  EXPECT_TRUE(folders.games.empty());
  EXPECT_TRUE(folders.launchers.empty());
  const ClientFolders all{{"/dev/null", "/nowhere"}, {"/dev/null"}};
  EXPECT_TRUE(find_clients(all).empty());
}

}  // namespace
}  // namespace quoin::viewer
