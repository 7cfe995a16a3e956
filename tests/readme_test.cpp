// The commands and the code of the README and the guide are what is tested, not a copy of it.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// The contents of a page's fenced blocks of one language.
std::vector<std::string> blocks(const std::string& language, const std::string& page = "README.md") {
  const std::string readme = read_text(fs::path(QUOIN_SOURCE_DIR) / page);
  const std::string fence = "```" + language + "\n";
  std::vector<std::string> found;
  for (std::size_t at = readme.find(fence); at != std::string::npos; at = readme.find(fence, at)) {
    at += fence.size();
    const std::size_t end = readme.find("```", at);
    found.push_back(readme.substr(at, end - at));
    at = end + 3;
  }
  return found;
}

TEST(Readme, EveryToolCommandWorks) {
  const fs::path work = fs::temp_directory_path() / ("quoin_readme_" + std::to_string(::getpid()));
  fs::create_directories(work);
  const fs::path tool = QUOIN_TOOL;
  const std::string make_input =
      (tool.parent_path() / "quoin_demo_world").string() + " " + (work / "castle.vox").string();
  ASSERT_EQ(std::system(make_input.c_str()), 0);
  int commands = 0;
  for (const std::string& block : blocks("sh")) {
    std::istringstream lines(block);
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("quoin ", 0) != 0) continue;
      const std::string command = "cd " + work.string() + " && " + tool.string() + line.substr(5) + " >output.txt 2>&1";
      EXPECT_EQ(std::system(command.c_str()), 0) << line << "\n" << read_text(work / "output.txt");
      ++commands;
    }
  }
  EXPECT_GE(commands, 3);
  fs::remove_all(work);
}

TEST(Readme, ItsCodeAndTheGuidesAreExamplesThatAreBuiltAndRun) {
  std::string examples;
  for (const auto& entry : fs::directory_iterator(fs::path(QUOIN_SOURCE_DIR) / "examples")) {
    if (entry.path().extension() == ".cpp") examples += read_text(entry.path());
  }
  for (const char* const page : {"README.md", "docs/guide.md"}) {
    const std::vector<std::string> code = blocks("cpp", page);
    EXPECT_GE(code.size(), 5U) << page;
    for (const std::string& block : code) EXPECT_NE(examples.find(block), std::string::npos) << page << "\n" << block;
  }
}

// What one page says of another, of a header or of an example by a link is there.
TEST(Readme, LinksOfThePagesLeadSomewhere) {
  const fs::path root = QUOIN_SOURCE_DIR;
  std::vector<fs::path> pages{root / "README.md", root / "CONTRIBUTING.md", root / "CHANGELOG.md"};
  for (const auto& entry : fs::recursive_directory_iterator(root / "docs")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  int links = 0;
  for (const fs::path& page : pages) {
    const std::string text = read_text(page);
    for (std::size_t at = text.find("]("); at != std::string::npos; at = text.find("](", at)) {
      at += 2;
      const std::string target = text.substr(at, text.find_first_of(")#\n", at) - at);
      if (target.empty() || target.find("://") != std::string::npos ||
          target.find_first_of(" ,;{}<>") != std::string::npos)
        continue;
      EXPECT_TRUE(fs::exists(page.parent_path() / target)) << page << ": " << target;
      ++links;
    }
  }
  EXPECT_GT(links, 100);
}

TEST(Readme, EveryDevCommandExists) {
  const std::string dev = read_text(fs::path(QUOIN_SOURCE_DIR) / "dev");
  for (const std::string& block : blocks("sh")) {
    std::istringstream lines(block);
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("./dev ", 0) != 0) continue;
      const std::string command = line.substr(6, line.find_first_of(" \t", 6) - 6);
      EXPECT_NE(dev.find("  " + command + ")"), std::string::npos) << line;
    }
  }
}

}  // namespace
