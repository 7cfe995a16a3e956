// Messages of `quoin view` without a window. The tests in apps/viewer and tests/viewer cover the window.

#include <gtest/gtest.h>

#include "tool_for_tests.h"

namespace quoin {
namespace {

class ToolView : public ToolTest {
 protected:
  /// Returns true if the viewer was built.
  [[nodiscard]] bool is_built() { return without_display("view tiny.vox").err.find("no viewer") == std::string::npos; }
  ToolRun without_display(const std::string& arguments) {
    std::string command = kNoDisplay;
    command += arguments;  // GCC 12 warns of a sum without reason
    return shell(command);
  }
  static constexpr const char* kNoDisplay = "unset DISPLAY WAYLAND_DISPLAY SDL_VIDEODRIVER; '" QUOIN_TOOL "' ";
};

TEST_F(ToolView, ReportsMissingDisplay) {
  const ToolRun result = without_display("view tiny.vox");
  EXPECT_EQ(result.status, 1);
  expect_one_error_line(result);
  const bool says_why = result.err.find("no display") != std::string::npos ||
                        result.err.find("it needs the packages") != std::string::npos;
  EXPECT_TRUE(says_why) << result.err;
}

TEST_F(ToolView, RefusesUnreadableFilesBeforeOpeningWindow) {
  if (!is_built()) GTEST_SKIP() << "the viewer is not built";
  std::ofstream(folder_.file("text.txt")) << "no voxels here";
  for (const char* file : {"absent.vox", "text.txt", "."}) {
    const ToolRun result = without_display(std::string("view ") + file);
    EXPECT_EQ(result.status, 1) << file;
    expect_one_error_line(result);
    EXPECT_EQ(result.err.find("display"), std::string::npos) << result.err;
  }
}

TEST_F(ToolView, RefusesWrongUsage) {
  for (const char* arguments :
       {"view tiny.vox --size 3", "view tiny.vox --size 10x10", "view tiny.vox --size 99999x500",
        "view tiny.vox --frame -1", "view tiny.vox --screenshot a.jpg", "view --screenshot a.png", "view ''",
        "view tiny.vox other.vox"}) {
    const ToolRun result = run(arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
  }
}

TEST_F(ToolView, HiddenWindowMatchesRenderedImage) {
  if (!is_built()) GTEST_SKIP() << "the viewer is not built";
  const ToolRun shown = shell("SDL_VIDEODRIVER=dummy SDL_RENDER_DRIVER=software '" QUOIN_TOOL
                              "' view tiny.vox --bare --size 320x240 --screenshot a.png");
  ASSERT_EQ(shown.status, 0) << shown.err;
  ASSERT_EQ(run("render tiny.vox --size 320x240 --samples 16 -o b.png").status, 0);
  EXPECT_EQ(text_of(folder_.file("a.png")), text_of(folder_.file("b.png")));
}

}  // namespace
}  // namespace quoin
