// --watch of convert and render: outputs follow changes of the inputs until a signal ends the program.

#include "tests/tool_for_tests.h"

namespace quoin {
namespace {

/// Shell functions: `start ARGUMENTS` runs the tool, `until_true CONDITION` waits for at most 20 s, `finish SIGNAL`
/// ends the tool and prints its status.
constexpr const char* kFunctions =
    "start() { env --default-signal=INT '" QUOIN_TOOL
    "' \"$@\" 2>log & pid=$!; }\n"
    "until_true() { i=0; until eval \"$1\"; do i=$((i + 1)); [ $i -lt 400 ] || { echo \"never: $1\"; break; }; "
    "sleep 0.05; done; }\n"
    "finish() { kill -$1 $pid; wait $pid; echo status $?; cat log >&2; }\n";

class ToolWatch : public ToolTest {
 protected:
  void SetUp() override {
    ToolTest::SetUp();
    std::ofstream(folder_.file("other.vox"), std::ios::binary) << checkerboard_vox(6);
    std::ofstream(folder_.file("broken.vox"), std::ios::binary) << tiny_vox().substr(0, 60);
  }
  ToolRun script(const std::string& lines) { return shell(kFunctions + lines); }
  std::string bytes(const std::string& name) { return text_of(folder_.file(name)); }
};

TEST_F(ToolWatch, ReconvertsChangedInput) {
  ASSERT_EQ(run("convert tiny.vox first.ply").status, 0);
  ASSERT_EQ(run("convert other.vox second.ply").status, 0);
  const ToolRun result = script(
      "start convert tiny.vox out.ply --watch\n"
      "until_true 'grep -q watching log'\n"
      "cp out.ply seen.ply; cp other.vox tiny.vox\n"
      "until_true 'cmp -s out.ply second.ply'\n"
      "finish INT");
  EXPECT_EQ(bytes("seen.ply"), bytes("first.ply"));
  EXPECT_EQ(bytes("out.ply"), bytes("second.ply"));
  EXPECT_NE(result.out.find("status 130"), std::string::npos) << result.out;
  EXPECT_NE(result.err.find("quoin: watching tiny.vox; press Ctrl-C to stop"), std::string::npos) << result.err;
}

TEST_F(ToolWatch, ReportsBrokenFileAndConvertsNextVersion) {
  ASSERT_EQ(run("convert other.vox second.ply").status, 0);
  const ToolRun result = script(
      "start convert tiny.vox out.ply --watch\n"
      "until_true 'grep -q watching log'\n"
      "cp out.ply seen.ply; cp broken.vox tiny.vox\n"
      "until_true 'grep -q byte log'\n"
      "cmp out.ply seen.ply && echo kept\n"
      "cp other.vox tiny.vox\n"
      "until_true 'cmp -s out.ply second.ply'\n"
      "finish TERM");
  EXPECT_NE(result.out.find("kept\n"), std::string::npos) << "a file that is broken loses nothing";
  EXPECT_EQ(bytes("out.ply"), bytes("second.ply"));
  EXPECT_NE(result.out.find("status 143"), std::string::npos) << result.out;
}

// The image of a scene file depends on the files that the scene names.
TEST_F(ToolWatch, RendersAgainAfterModelChanges) {
  std::ofstream(folder_.file("fleet.json")) << R"({"quoin_scene": 1, "files": [{"id": "a", "path": "tiny.vox"}],)"
                                            << R"( "instances": [{"file": "a", "position": [0, 0, 0]}]})";
  const std::string flags = " --size 64x48 --samples 1";
  ASSERT_EQ(run("render fleet.json -o first.png" + flags).status, 0);
  const ToolRun result = script("start render fleet.json -o out.png --watch" + flags +
                                "\nuntil_true 'grep -q watching log'\n"
                                "cp other.vox tiny.vox\n"
                                "until_true '! cmp -s out.png first.png'\n"
                                "finish INT");
  EXPECT_NE(result.err.find("watching fleet.json and 1 more"), std::string::npos) << result.err;
  ASSERT_EQ(run("render fleet.json -o second.png" + flags).status, 0);
  EXPECT_EQ(bytes("out.png"), bytes("second.png"));
}

// First a model is broken when it is first read and later fixed; then a model of a scene changes, with other inputs
// given.
TEST_F(ToolWatch, ReconvertsScenesAfterModelChanges) {
  std::ofstream(folder_.file("fleet.json")) << R"({"quoin_scene": 1, "files": [{"id": "a", "path": "ship.vox"}],)"
                                            << R"( "instances": [{"file": "a"}]})";
  const ToolRun result = script(
      "cp broken.vox ship.vox\n"
      "start convert fleet.json fleet.glb --watch\n"
      "until_true 'grep -q watching log'\n"
      "cp tiny.vox ship.vox\n"
      "until_true 'test -e fleet.glb'\n"
      "finish INT; rm -f log\n"
      "start convert fleet.json other.vox --to ply --watch\n"
      "until_true 'grep -q watching log'\n"
      "cp fleet.ply before.ply; cp other.vox ship.vox\n"
      "until_true '! cmp -s fleet.ply before.ply'\n"
      "finish INT");
  EXPECT_EQ(result.out.find("never"), std::string::npos) << result.out;
}

// Only changed and new files of a folder are converted again; outputs in the folder trigger nothing.
TEST_F(ToolWatch, ReconvertsOnlyChangedFilesOfFolder) {
  const ToolRun result = script(
      "mkdir models; cp tiny.vox models/a.vox; cp other.vox models/b.vox\n"
      "start convert models --recursive --to glb --watch >summary\n"
      "until_true 'grep -q watching log'\n"
      "rm models/b.glb; cp other.vox models/a.vox; cp tiny.vox models/c.vox\n"
      "until_true 'test -e models/c.glb'\n"
      "sleep 1.5\n"
      "finish INT; ls models; grep -c Converted summary; grep Converted summary");
  EXPECT_NE(result.out.find("a.glb\na.vox\nb.vox\nc.glb\nc.vox\n2\nConverted 2 of 2"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("Converted 2 of 2", result.out.find("Converted 2 of 2") + 1), std::string::npos)
      << result.out;
}

TEST_F(ToolWatch, RefusesWatchingStreamsAndJson) {
  for (const std::string arguments : {"convert tiny.vox out.glb --watch --json", "convert - out.glb --watch",
                                      "convert tiny.vox - --to glb --watch", "convert tiny.vox out.json --watch",
                                      "render tiny.vox -o out.png --watch --json", "render - -o out.png --watch"}) {
    const ToolRun result = run(arguments + " </dev/null");
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
  }
}

}  // namespace
}  // namespace quoin
