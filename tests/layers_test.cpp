// A folder includes only folders above it, and never a sibling on its own level.

#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

const std::map<std::string, int> kLevels = {{"core", 0},  {"grid", 1},      {"mesh", 2},  {"trace", 2},  {"terrain", 2},
                                            {"scene", 3}, {"light", 4},     {"live", 4},  {"render", 5}, {"io", 5},
                                            {"store", 5}, {"render_vk", 6}, {"stream", 6}};
constexpr int kAppsLevel = 7;

// Why a file of `folder` may not include `path`, if so. Paths are as written: <quoin/grid/grid.h> or "grid/x.h".
std::optional<std::string> breach(const std::string& folder, int level, const std::string& path) {
  const std::string inner = path.rfind("quoin/", 0) == 0 ? path.substr(6) : path;
  const auto slash = inner.find('/');
  if (slash == std::string::npos) return std::nullopt;
  const std::string target = inner.substr(0, slash);
  if (target == "." || target == "..") return folder + " includes " + path + ", which hides its layer";
  const auto found = kLevels.find(target);
  if (found == kLevels.end() || target == folder) return std::nullopt;
  if (found->second < level) return std::nullopt;
  return folder + " (level " + std::to_string(level) + ") includes " + path + " (level " +
         std::to_string(found->second) + ")";
}

bool is_test(const fs::path& file) {
  return std::regex_search(file.stem().string(), std::regex("_(test|bench|fuzz|oracle)$"));
}

std::vector<std::string> includes_of(const fs::path& file) {
  static const std::regex pattern(R"re(^\s*#\s*include\s*[<"]([^>"]+)[>"])re");
  std::vector<std::string> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::smatch match;
    if (std::regex_search(line, match, pattern)) found.push_back(match[1]);
  }
  return found;
}

TEST(Layers, AWrongIncludeIsABreach) {
  EXPECT_TRUE(breach("grid", 1, "quoin/mesh/quad.h").has_value());
  EXPECT_TRUE(breach("mesh", 2, "trace/ray.h").has_value()) << "siblings";
  EXPECT_TRUE(breach("io", 5, "quoin/render/camera.h").has_value()) << "siblings";
  EXPECT_TRUE(breach("grid", 1, "../mesh/watertight.h").has_value());
  EXPECT_FALSE(breach("io", 5, "quoin/mesh/quad.h").has_value());
  EXPECT_FALSE(breach("mesh", 2, "mesh/blocky/watertight.h").has_value());
  EXPECT_FALSE(breach("mesh", 2, "vector").has_value());
}

TEST(Layers, NoSourceIncludesUpwardsOrSideways) {
  int files = 0;
  for (const char* top : {"src", "include/quoin", "apps"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(QUOIN_SOURCE_DIR) / top)) {
      if (!entry.is_regular_file() || is_test(entry.path())) continue;
      const fs::path root = fs::path(QUOIN_SOURCE_DIR) / top;
      const std::string folder = entry.path().lexically_relative(root).begin()->string();
      const bool is_app = std::string(top) == "apps";
      const auto level = kLevels.find(folder);
      const bool is_root_header = entry.path().parent_path() == root;
      if (!is_app && !is_root_header) {
        ASSERT_NE(level, kLevels.end()) << entry.path() << " lies in no layer";
      }
      for (const std::string& path : includes_of(entry.path())) {
        const auto problem = breach(folder, is_app || is_root_header ? kAppsLevel : level->second, path);
        EXPECT_FALSE(problem.has_value()) << entry.path() << ": " << problem.value_or("");
      }
      ++files;
    }
  }
  EXPECT_GT(files, 40);
}

}  // namespace
