#include <string>

#include <gtest/gtest.h>

#include <quoin/version.h>

#include "tests/tool_for_tests.h"

namespace quoin {
namespace {

using ToolVersion = ToolTest;

TEST(Version, JoinsThreeNumbers) {
  EXPECT_EQ(version(), std::to_string(QUOIN_VERSION_MAJOR) + "." + std::to_string(QUOIN_VERSION_MINOR) + "." +
                           std::to_string(QUOIN_VERSION_PATCH));
}

// The build takes the version from the header, for the tool, the generator field of written files, and packages.
TEST_F(ToolVersion, MatchesHeader) {
  EXPECT_EQ(run("--version").out, "quoin " + std::string(version()) + "\n");
}

}  // namespace
}  // namespace quoin
