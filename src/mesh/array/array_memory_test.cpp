// Measures the memory that array surfaces take in addition to their input and output, through the C library at every
// progress step.

#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/label_surfaces.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "mesh/array/array_for_tests.h"

#if defined(__GLIBC__)
#if __GLIBC_PREREQ(2, 33)
#define QUOIN_HAS_MALLINFO2
#include <malloc.h>
#endif
#endif

namespace quoin {
namespace {

using namespace array_tests;

std::size_t bytes_in_use() {
#ifdef QUOIN_HAS_MALLINFO2
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
#else
  return 0;
#endif
}

bool can_count() {
  const std::size_t before = bytes_in_use();
  const auto some = std::make_unique<std::byte[]>(1 << 20);
  return some != nullptr && bytes_in_use() >= before + (1 << 20);
}

// Returns the maximum of additional memory over all progress steps.
template <class Make>
std::size_t most_bytes(Make make) {
  const std::size_t before = bytes_in_use();
  std::size_t most = before;
  make([&](double) {
    most = std::max(most, bytes_in_use());
    return true;
  });
  return most - before;
}

TEST(ArrayMemory, SurfaceNeedsAtMostOneBytePerSample) {
  if (!can_count()) GTEST_SKIP() << "the C library does not tell how much memory is in use";
  // Noise needs the most memory.
  for (const Size size : {Size{64, 64, 64}, Size{100, 64, 256}, Size{64, 256, 40}}) {
    const auto samples = static_cast<std::size_t>(size[0] * size[1] * size[2]);
    const TestArray<float> field = noise(size, 41);
    const std::size_t taken = most_bytes([&](const Progress& progress) {
      const auto surface = surface_from_array(field.view(), {.split_sheets = false}, {1}, progress);
      ASSERT_TRUE(surface.has_value());
      progress(1.0);
    });
    const auto surface = surface_from_array(field.view(), {.split_sheets = false}, {1});
    ASSERT_TRUE(surface.has_value());
    const std::size_t output = surface->positions.size() * 24 + surface->indices.size() * 4;
    EXPECT_GT(taken, output);
    EXPECT_LE(taken, output + samples) << static_cast<double>(taken - output) / static_cast<double>(samples);
  }
}

TEST(ArrayMemory, LabelsNeedAtMostOneBytePerSample) {
  if (!can_count()) GTEST_SKIP() << "the C library does not tell how much memory is in use";
  const Size size = {128, 64, 256};
  const auto samples = static_cast<std::size_t>(size[0] * size[1] * size[2]);
  // Slabs of several labels, similar to tissues; one vertex per few samples.
  const TestArray<std::uint8_t> labels(size, [](DVec3 p) {
    return static_cast<std::uint8_t>(static_cast<int>(p.y / 9 + p.x / 11) % 7 + 2 * (static_cast<int>(p.z) / 16 % 3));
  });
  for (const int steps : {0, 4}) {
    const LabelSurfaceOptions options{0, steps};
    const std::size_t taken = most_bytes([&](const Progress& progress) {
      const auto surfaces = surfaces_from_labels(labels.view(), options, {1}, progress);
      ASSERT_TRUE(surfaces.has_value());
      progress(1.0);
    });
    const auto surfaces = surfaces_from_labels(labels.view(), options, {1});
    ASSERT_TRUE(surfaces.has_value());
    const std::size_t output = surfaces->positions.size() * 12 + surfaces->indices.size() * 4;
    EXPECT_LE(taken, output + samples) << static_cast<double>(taken - output) / static_cast<double>(samples);
  }
}

}  // namespace
}  // namespace quoin
