// A folder includes only folders above it, and never a sibling on its own level. The private headers of a layer stay
// private except for the headers listed here. The folders of a layer do not include each other in a cycle.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

const std::map<std::string, int> kLevels = {{"core", 0},     {"grid", 1},   {"mesh", 2},   {"trace", 2}, {"terrain", 2},
                                            {"voxelize", 2}, {"scene", 3},  {"render", 4}, {"io", 4},    {"live", 5},
                                            {"store", 5},    {"stream", 6}, {"map", 6}};
constexpr int kAppsLevel = 7;

// Lists the private headers that higher layers use, and the users. A new line is a decision: the alternative is a
// public header, or a function next to the data. All layers may use the headers of core.
const std::map<std::string, std::set<std::string>> kLentHeaders = {
    {"grid/change_records.h", {"render"}},
    {"grid/chunk/chunk_storage.h", {"mesh", "render", "store", "trace"}},
    {"grid/colour_table.h", {"io", "voxelize"}},
    {"grid/density/density_storage.h", {"mesh", "store", "trace"}},
    {"grid/shapes/shape_index.h", {"map", "render", "scene"}},
    {"io/format_driver.h", {"store"}},
    {"io/placed_grids.h", {"map"}},
    {"io/scene_file/scene_parts.h", {"store"}},
    {"scene/surfaces.h", {"io", "render"}},
    {"scene/frustum.h", {"render"}},
    {"scene/scene_follower.h", {"live"}},
    {"scene/tracer/placed_grid.h", {"render"}},
    {"scene/tracer/scene_view.h", {"render"}},
    {"scene/tracer/shape_rays.h", {"render"}},
    {"scene/tracer/instance_tree.h", {"render"}},
    {"scene/tracer/tree_cache.h", {"render"}},
    {"mesh/surface/voxel_surface.h", {"render", "scene"}},
    {"mesh/surface/smooth_surface.h", {"scene"}},
    {"mesh/surface/face_materials.h", {"render"}},
    {"render/chunks/surface_job.h", {"live"}},
    {"render/chunks/surface_source.h", {"live"}},
    {"trace/chunk_rows.h", {"render", "scene"}},
    {"trace/density/density_glass.h", {"render", "scene"}},
    {"trace/tree_view.h", {"render"}},
    {"trace/walk.h", {"render", "scene"}},
};

// Pairs of a lent header and its user. Lower it when a pair goes; a higher number needs a reason in docs/decisions.
constexpr std::size_t kMaxLoans = 38;

// A file with fewer lines needs a reason, because compile time and a reader's way are paid per file.
constexpr int kSmallFile = 60;
constexpr int kMaxLines = 900;
// Numbers of C++ files without tests in src, include and apps. They only rise for a new subject, such as a format: a
// change that merges files lowers them.
constexpr int kMaxSources = 752;
constexpr int kMaxSmallSources = 83;

// A folder with more files should be split.
constexpr int kMaxFiles = 32;
const std::map<std::string, int> kLargerFolders = {};

// Returns the reason if a file of `folder` must not include `path`. Paths are as written: <quoin/grid/grid.h> or
// "grid/x.h".
std::optional<std::string> forbidden_include(const std::string& folder, int level, const std::string& path) {
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

// Tests and their shared headers may include headers of any layer.
bool is_for_tests(const fs::path& file) {
  return is_test(file) || std::regex_search(file.stem().string(), std::regex("_(fixture|for_tests|support)$"));
}

struct Include {
  std::string path;
  bool quoted = false;
};

struct Source {
  fs::path file;
  fs::path path;  // relative to the top: grid/chunk/chunk.cpp
  std::vector<Include> includes;
  [[nodiscard]] std::string layer() const { return path.begin()->string(); }
};

std::vector<Include> includes_of(const fs::path& file) {
  static const std::regex pattern(R"re(^\s*#\s*include\s*([<"])([^>"]+)[>"])re");
  std::vector<Include> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::smatch match;
    // Regular expressions are slow, and few lines have this character.
    if (line.find('#') == std::string::npos) continue;
    if (std::regex_search(line, match, pattern)) found.push_back({match[2], match[1] == "\""});
  }
  return found;
}

// Returns all sources below a folder of the repository, including tests.
std::vector<Source> sources_of(const std::string& top) {
  std::vector<Source> found;
  const fs::path root = fs::path(QUOIN_SOURCE_DIR) / top;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    const std::string kind = entry.path().extension().string();
    if (kind != ".h" && kind != ".cpp" && kind != ".inl") continue;
    found.push_back({entry.path(), entry.path().lexically_relative(root), includes_of(entry.path())});
  }
  return found;
}

// Returns the reason if a file of a layer must not include another layer's private header.
std::optional<std::string> forbidden_private_include(const std::string& layer, const Include& include) {
  if (!include.quoted) return std::nullopt;
  const std::string owner = fs::path(include.path).begin()->string();
  if (owner == layer || owner == "core" || !kLevels.contains(owner)) return std::nullopt;
  const auto lent = kLentHeaders.find(include.path);
  if (lent != kLentHeaders.end() && lent->second.contains(layer)) return std::nullopt;
  return include.path + " is private to " + owner + ", and not lent to " + layer;
}

// Returns the folder of a file or an include within its layer: "chunk" for grid/chunk/chunk.h, "" for files directly in
// the layer.
std::string folder_of(const fs::path& path) {
  const std::string folder = path.parent_path().lexically_relative(*path.begin()).generic_string();
  return folder == "." ? "" : folder;
}

// Returns the first part of a folder: "light" for "light/propagated".
std::string top_folder(const std::string& folder) {
  return folder.substr(0, folder.find('/'));
}

// Returns the number of lines, as `wc -l` counts them.
int lines_of(const fs::path& file) {
  std::ifstream in(file);
  return static_cast<int>(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
}

// Returns the names that occur more than once.
std::set<std::string> repeated_names(const std::vector<fs::path>& files) {
  std::set<std::string> names;
  std::set<std::string> repeated;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    if (!names.insert(name).second) repeated.insert(name);
  }
  return repeated;
}

using Graph = std::map<std::string, std::set<std::string>>;

// Returns a path from a node back to itself, if there is one.
std::vector<std::string> cycle_in(const Graph& graph) {
  std::set<std::string> done;
  std::vector<std::string> path;
  const std::function<bool(const std::string&)> visit = [&](const std::string& node) {
    const bool again = std::find(path.begin(), path.end(), node) != path.end();
    path.push_back(node);
    if (again) return true;
    if (!done.contains(node) && graph.contains(node)) {
      for (const std::string& next : graph.at(node)) {
        if (visit(next)) return true;
      }
    }
    done.insert(node);
    path.pop_back();
    return false;
  };
  for (const auto& [node, next] : graph) {
    if (visit(node)) return path;
  }
  return {};
}

TEST(Layers, FindsForbiddenIncludes) {
  EXPECT_TRUE(forbidden_include("grid", 1, "quoin/mesh/quad.h").has_value());
  EXPECT_TRUE(forbidden_include("mesh", 2, "trace/ray.h").has_value()) << "siblings";
  EXPECT_TRUE(forbidden_include("io", 4, "quoin/render/cpu_renderer.h").has_value()) << "siblings";
  EXPECT_TRUE(forbidden_include("grid", 1, "../mesh/watertight.h").has_value());
  EXPECT_FALSE(forbidden_include("io", 4, "quoin/mesh/quad.h").has_value());
  EXPECT_FALSE(forbidden_include("mesh", 2, "mesh/surface/simplify.h").has_value());
  EXPECT_FALSE(forbidden_include("mesh", 2, "vector").has_value());
}

TEST(Layers, SourcesIncludeOnlyLowerLayers) {
  int files = 0;
  for (const char* top : {"src", "include/quoin", "apps"}) {
    for (const Source& source : sources_of(top)) {
      if (is_for_tests(source.file)) continue;
      const bool is_app = std::string(top) == "apps";
      const auto level = kLevels.find(source.layer());
      const bool is_root_header = !source.path.has_parent_path();
      if (!is_app && !is_root_header) {
        ASSERT_NE(level, kLevels.end()) << source.file << " lies in no layer";
      }
      for (const Include& include : source.includes) {
        const auto problem =
            forbidden_include(source.layer(), is_app || is_root_header ? kAppsLevel : level->second, include.path);
        EXPECT_FALSE(problem.has_value()) << source.file << ": " << problem.value_or("");
      }
      ++files;
    }
  }
  EXPECT_GT(files, 40);
}

TEST(Layers, FindsForbiddenPrivateIncludes) {
  EXPECT_TRUE(forbidden_private_include("terrain", {"grid/chunk/chunk_storage.h", true}).has_value());
  EXPECT_TRUE(forbidden_private_include("mesh", {"grid/chunk_table.h", true}).has_value());
  EXPECT_FALSE(forbidden_private_include("mesh", {"grid/chunk/chunk_storage.h", true}).has_value());
  EXPECT_FALSE(forbidden_private_include("grid", {"grid/chunk_table.h", true}).has_value());
  EXPECT_FALSE(forbidden_private_include("mesh", {"core/srgb.h", true}).has_value());
  EXPECT_FALSE(forbidden_private_include("mesh", {"quoin/grid/grid.h", false}).has_value());
}

TEST(Layers, PrivateHeadersStayInLayerUnlessLent) {
  std::map<std::string, std::set<std::string>> users;
  for (const Source& source : sources_of("src")) {
    if (is_for_tests(source.file)) continue;
    for (const Include& include : source.includes) {
      users[include.path].insert(source.layer());
      const auto problem = forbidden_private_include(source.layer(), include);
      EXPECT_FALSE(problem.has_value()) << source.file << ": " << problem.value_or("");
    }
  }
  std::size_t loans = 0;
  for (const auto& [header, layers] : kLentHeaders) {
    loans += layers.size();
    EXPECT_TRUE(fs::exists(fs::path(QUOIN_SOURCE_DIR) / "src" / header)) << header << " is lent, and not there";
    for (const std::string& layer : layers) {
      EXPECT_TRUE(users[header].contains(layer)) << header << " is lent to " << layer << ", which does not use it";
    }
  }
  EXPECT_LE(loans, kMaxLoans) << "headers are lent too often";
}

// The other tests rely on this.
TEST(Layers, FindsIncludes) {
  std::set<std::string> found;
  for (const Include& include : includes_of(__FILE__)) {
    EXPECT_FALSE(include.quoted) << include.path;
    found.insert(include.path);
  }
  EXPECT_TRUE(found.contains("gtest/gtest.h"));
  EXPECT_TRUE(found.contains("filesystem"));
}

TEST(Layers, QuoinHeaderIncludesEveryPublicHeader) {
  const fs::path root = fs::path(QUOIN_SOURCE_DIR) / "include";
  std::set<std::string> included;
  for (const Include& include : includes_of(root / "quoin/quoin.h")) included.insert(include.path);
  for (const Source& source : sources_of("include")) {
    const std::string name = source.path.generic_string();
    EXPECT_EQ(included.contains(name), name != "quoin/quoin.h") << name;
  }
}

// Test sources are found by their names and compiled together; none may get lost.
TEST(Layers, ProgramContainsEveryTestSource) {
  std::set<fs::path> run;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int j = 0; j < suite.total_test_count(); ++j) {
      run.insert(fs::path(suite.GetTestInfo(j)->file()).lexically_normal());
    }
  }
  for (const char* top : {"src", "tests"}) {
    for (const Source& source : sources_of(top)) {
      const std::string name = source.file.filename().string();
      if (!name.ends_with("_test.cpp")) continue;
#if !defined(QUOIN_HAVE_VULKAN)
      if (source.path.generic_string().starts_with("render/vulkan/")) continue;
#endif
      EXPECT_TRUE(run.contains(source.file.lexically_normal())) << source.file;
    }
  }
}

TEST(Layers, PublicHeadersIncludeNoPrivateOnes) {
  for (const Source& source : sources_of("include/quoin")) {
    for (const Include& include : source.includes) {
      EXPECT_FALSE(include.quoted) << source.file << " includes \"" << include.path << "\"";
    }
  }
}

// Shared libraries export what public headers declare in a namespace with this attribute. Types without a definition in
// public headers are private, and hidden.
TEST(Layers, PublicHeadersExportTheirNames) {
  static const std::regex type(R"re(^ *(class|struct) (\w+)(;| final| :| \{|<))re");
  std::set<std::string> declared;
  std::set<std::string> defined;
  for (const Source& source : sources_of("include/quoin")) {
    std::ifstream in(source.file);
    int exporting = 0;
    for (std::string line; std::getline(in, line);) {
      exporting += static_cast<int>(line == "namespace [[gnu::visibility(\"default\")]] quoin {");
      EXPECT_FALSE(line.starts_with("namespace quoin")) << source.file;
      std::smatch match;
      // As above: regular expressions are slow.
      if (line.find("class ") == std::string::npos && line.find("struct ") == std::string::npos) continue;
      if (std::regex_search(line, match, type)) (match[3] == ";" ? declared : defined).insert(match[2]);
    }
    EXPECT_EQ(exporting, source.path == "quoin.h" ? 0 : 1) << source.file;
  }
  EXPECT_GT(defined.size(), 100);
  for (const std::string& name : declared) {
    if (name.starts_with("Vk")) continue;  // Vulkan's
    EXPECT_TRUE(defined.contains(name)) << name << " needs [[gnu::visibility(\"hidden\")]]";
  }
}

// A header that serves a single source belongs in that source, unless it is long enough to be read by itself.
TEST(Layers, SmallHeadersWithoutASourceAreShared) {
  const std::set<std::string> choices = {"lanes.h"};  // one of several, chosen by the flags of the including source
  std::map<std::string, std::set<fs::path>> users;
  std::vector<fs::path> small;
  for (const char* top : {"src", "apps"}) {
    for (const Source& source : sources_of(top)) {
      for (const Include& include : source.includes) {
        if (include.quoted) users[fs::path(include.path).filename().string()].insert(source.file);
      }
      fs::path own = source.file;
      if (source.file.extension() != ".h" || fs::exists(own.replace_extension(".cpp"))) continue;
      if (!is_for_tests(source.file) && lines_of(source.file) < kSmallFile) small.push_back(source.file);
    }
  }
  EXPECT_FALSE(small.empty());
  for (const fs::path& header : small) {
    const std::string name = header.filename().string();
    EXPECT_TRUE(users[name].size() > 1 || choices.contains(name)) << header << " has one user";
  }
}

// The path shows the folder of each header in use. Generated headers have no folder.
TEST(Layers, PrivateIncludesUseFullPaths) {
  const fs::path root = QUOIN_SOURCE_DIR;
  for (const Source& source : sources_of("src")) {
    for (const Include& include : source.includes) {
      if (!include.quoted || fs::path(include.path).extension() == ".inc") continue;
      EXPECT_TRUE(fs::exists(root / "src" / include.path) ||
                  (is_for_tests(source.file) && fs::exists(root / include.path)))
          << source.file << " includes \"" << include.path << "\"";
    }
  }
}

TEST(Layers, FindsCycles) {
  EXPECT_EQ(cycle_in({{"a", {"b"}}, {"b", {"c"}}, {"c", {"a"}}}).size(), 4);
  EXPECT_TRUE(cycle_in({{"a", {"b", "c"}}, {"b", {"d"}}, {"c", {"d"}}}).empty());
  EXPECT_EQ(folder_of("grid/chunk/chunk.cpp"), "chunk");
  EXPECT_EQ(folder_of("grid/grid.cpp"), "");
  EXPECT_EQ(top_folder("light/propagated"), "light");
  EXPECT_EQ(top_folder("light"), "light");
}

// Files directly in a layer may include its folders, and its folders may include them.
TEST(Layers, HasNoCyclesBetweenFolders) {
  std::map<std::string, Graph> layers;
  std::map<std::string, Graph> parts;  // each folder directly in a layer with all its subfolders
  for (const Source& source : sources_of("src")) {
    const std::string folder = folder_of(source.path);
    if (is_for_tests(source.file) || folder.empty()) continue;
    for (const Include& include : source.includes) {
      if (!include.quoted || *fs::path(include.path).begin() != source.layer()) continue;
      const std::string other = folder_of(include.path);
      if (other.empty()) continue;
      if (other != folder) layers[source.layer()][folder].insert(other);
      const std::string part = top_folder(folder);
      const std::string other_part = top_folder(other);
      if (part != other_part) parts[source.layer()][part].insert(other_part);
    }
  }
  for (const auto* graphs : {&layers, &parts}) {
    EXPECT_FALSE(graphs->empty());
    for (const auto& [layer, folders] : *graphs) {
      std::string cycle;
      for (const std::string& folder : cycle_in(folders)) cycle += (cycle.empty() ? "" : " -> ") + folder;
      EXPECT_EQ(cycle, "") << "in " << layer;
    }
  }
}

// The name of a header says whether only tests include it; other sources include no such header.
TEST(Layers, TestHeadersHaveTestNames) {
  std::set<std::string> used;
  for (const char* top : {"src", "apps"}) {
    for (const Source& source : sources_of(top)) {
      for (const Include& include : source.includes) {
        if (!include.quoted) continue;
        const std::string name = fs::path(include.path).filename().string();
        if (!is_for_tests(source.file)) {
          used.insert(name);
          EXPECT_FALSE(is_for_tests(name)) << source.file << " includes " << include.path;
        }
      }
    }
  }
  for (const char* top : {"src", "apps"}) {
    for (const Source& source : sources_of(top)) {
      if (source.file.extension() != ".h" || is_for_tests(source.file)) continue;
      EXPECT_TRUE(used.contains(source.file.filename().string())) << source.file << " is included by tests alone";
    }
  }
}

TEST(Layers, KeepsNumberAndSizesOfFiles) {
  int sources = 0;
  int small = 0;
  for (const char* top : {"src", "include", "apps"}) {
    for (const Source& source : sources_of(top)) {
      if (is_for_tests(source.file)) continue;
      const int lines = lines_of(source.file);
      EXPECT_LE(lines, kMaxLines) << source.file;
      ++sources;
      if (lines < kSmallFile) ++small;
    }
  }
  EXPECT_GT(sources, 500);
  EXPECT_LE(sources, kMaxSources) << "merge files of one subject";
  EXPECT_LE(small, kMaxSmallSources) << "merge small files into those of their subject";
}

TEST(Layers, FindsRepeatedNames) {
  EXPECT_TRUE(repeated_names({"a/x.h", "a/x.cpp", "b/y.h"}).empty());
  EXPECT_EQ(repeated_names({"a/x.h", "b/x.h", "y.h"}), std::set<std::string>{"x.h"});
}

TEST(Layers, FileNamesInSrcDiffer) {
  std::vector<fs::path> files;
  for (const Source& source : sources_of("src")) files.push_back(source.path);
  EXPECT_EQ(repeated_names(files), std::set<std::string>{});
}

TEST(Layers, KeepsFoldersBelowMaxFiles) {
  std::map<std::string, int> files;
  const fs::path root = QUOIN_SOURCE_DIR;
  for (const char* top : {"src", "include/quoin", "apps", "examples"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      if (entry.is_regular_file()) ++files[entry.path().parent_path().lexically_relative(root).generic_string()];
    }
  }
  for (const auto& [folder, count] : files) {
    const auto larger = kLargerFolders.find(folder);
    EXPECT_LE(count, larger == kLargerFolders.end() ? kMaxFiles : larger->second) << folder;
  }
}

}  // namespace
