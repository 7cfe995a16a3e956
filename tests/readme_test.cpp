// Runs the commands of the README and of the pages for users, and compares their code with the examples.

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include "core/work/nightly_for_tests.h"

namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

constexpr std::array kPages = {"README.md", "docs/cookbook.md", "docs/games.md", "docs/guide.md"};

// Returns the contents of a page's fenced blocks of one language.
std::vector<std::string> blocks(const std::string& language, const std::string& page) {
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

// Returns the lines of a page's shell blocks. A line that ends with a backslash continues on the next one.
std::vector<std::string> shell_lines(const std::string& page) {
  std::vector<std::string> found;
  for (const std::string& block : blocks("sh", page)) {
    std::istringstream lines(block);
    for (std::string line; std::getline(lines, line);) {
      for (std::string next; line.ends_with('\\') && std::getline(lines, next);) {
        line.pop_back();
        line += next;
      }
      found.push_back(line);
    }
  }
  return found;
}

// By day, commands that render images do so in fewer pixels than the page says: most of their time goes into pixels.
std::string with_small_images(const std::string& line) {
  constexpr std::string_view kRender = "quoin render ";
  constexpr const char* kSmall = "--size 64x36";
  if (quoin::is_nightly() || !line.starts_with(kRender)) return line;
  static const std::regex size("--size [0-9]+x[0-9]+");
  if (std::regex_search(line, size)) return std::regex_replace(line, size, kSmall);
  return std::string(kRender) + kSmall + " " + line.substr(kRender.size());
}

// Runs a page's commands in a folder of its own, which holds only the demo's castle. Returns how many there are.
int run_tool_commands(const std::string& page) {
  const fs::path work = fs::temp_directory_path() / ("quoin_readme_" + std::to_string(::getpid()));
  fs::create_directories(work);
  const fs::path tool = QUOIN_TOOL;
  const std::string make_input =
      (tool.parent_path() / "quoin_demo_world").string() + " " + (work / "castle.vox").string();
  EXPECT_EQ(std::system(make_input.c_str()), 0);
  int commands = 0;
  for (const std::string& line : shell_lines(page)) {
    if (!line.starts_with("quoin ")) continue;
    const std::string command =
        "cd " + work.string() + " && " + tool.string() + with_small_images(line).substr(5) + " >output.txt 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << page << ": " << line << "\n" << read_text(work / "output.txt");
    ++commands;
  }
  fs::remove_all(work);
  return commands;
}

TEST(Readme, RunsToolCommands) {
  EXPECT_GE(run_tool_commands("README.md"), 3);
}

TEST(Readme, RunsToolCommandsOfCookbook) {
  EXPECT_GE(run_tool_commands("docs/cookbook.md"), 30);
}

TEST(Readme, CodeComesFromExamples) {
  std::string examples;
  for (const auto& entry : fs::directory_iterator(fs::path(QUOIN_SOURCE_DIR) / "examples")) {
    if (entry.path().extension() == ".cpp") examples += read_text(entry.path());
  }
  std::size_t count = 0;
  for (const char* const page : kPages) {
    for (const std::string& block : blocks("cpp", page)) {
      EXPECT_NE(examples.find(block), std::string::npos) << page << "\n" << block;
      ++count;
    }
  }
  EXPECT_GE(count, 20U);
}

TEST(Readme, LinkTargetsExist) {
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

TEST(Readme, DevCommandsExist) {
  const std::string dev = read_text(fs::path(QUOIN_SOURCE_DIR) / "dev");
  for (const char* const page : kPages) {
    for (const std::string& line : shell_lines(page)) {
      if (!line.starts_with("./dev ")) continue;
      const std::string command = line.substr(6, line.find_first_of(" \t", 6) - 6);
      EXPECT_NE(dev.find("  " + command + ")"), std::string::npos) << page << ": " << line;
    }
  }
}

}  // namespace
