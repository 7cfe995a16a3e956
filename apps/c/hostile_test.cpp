// Invalid calls in any order: replays the fuzz target's programs, then runs random ones.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include <gtest/gtest.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

TEST(CHostile, ReplaysCorpus) {
  std::size_t programs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(QUOIN_SOURCE_DIR "/tests/corpus/c_api")) {
    SCOPED_TRACE(entry.path().filename());
    std::ifstream in(entry.path(), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    ++programs;
  }
  EXPECT_GT(programs, 5U);
}

TEST(CHostile, SurvivesRandomPrograms) {
  std::mt19937 random(20261126);
  for (int turn = 0; turn < 200; ++turn) {
    // A scene first, so that calls find one; then anything.
    std::vector<std::uint8_t> program = {0};
    const std::size_t length = 40 + random() % 600;
    while (program.size() < length) program.push_back(static_cast<std::uint8_t>(random()));
    LLVMFuzzerTestOneInput(program.data(), program.size());
  }
}

}  // namespace
