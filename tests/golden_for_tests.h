#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <quoin/core/image.h>
#include <quoin/io/image_files.h>

/// Compares images with golden images.
namespace quoin {

struct ImageDifference {
  std::int64_t pixels = 0;  /// pixels that differ in any channel
  int greatest = 0;         /// the greatest difference of any channel
  /// Black where the images agree; elsewhere the difference of each channel, from a quarter of full brightness upwards
  /// to make a difference of 1 visible.
  Image image;
};

/// Requires: both images have the same size.
inline ImageDifference difference_of(const Image& a, const Image& b) {
  ImageDifference difference{0, 0, {a.width, a.height, std::vector<std::uint8_t>(a.rgb.size())}};
  for (std::size_t pixel = 0; pixel < a.rgb.size(); pixel += 3) {
    int most = 0;
    for (std::size_t i = pixel; i < pixel + 3; ++i) {
      const int step = std::abs(int{a.rgb[i]} - int{b.rgb[i]});
      most = std::max(most, step);
      difference.image.rgb[i] = static_cast<std::uint8_t>(step == 0 ? 0 : 64 + step * 191 / 255);
    }
    difference.pixels += most > 0 ? 1 : 0;
    difference.greatest = std::max(difference.greatest, most);
  }
  return difference;
}

/// The folders of golden images and of the images of failed comparisons.
struct GoldenFolders {
  std::filesystem::path golden;
  std::filesystem::path failures;
};

inline GoldenFolders golden_folders() {
  return {QUOIN_SOURCE_DIR "/tests/golden", QUOIN_BINARY_DIR "/golden"};
}

/// Returns success if an image equals the golden image of its name in every pixel. Otherwise writes NAME.actual.png and
/// (if the sizes agree) NAME.difference.png into the failures folder. Removes such files of earlier failures.
inline ::testing::AssertionResult is_golden(const Image& actual, const std::string& name,
                                            const GoldenFolders& folders) {
  const auto path = folders.golden / (name + ".png");
  const auto actual_path = folders.failures / (name + ".actual.png");
  const auto difference_path = folders.failures / (name + ".difference.png");
  std::filesystem::create_directories(folders.failures);
  for (const auto& old : {actual_path, difference_path}) std::filesystem::remove(old);
  const auto golden = read_png(path);
  if (golden && golden->rgb == actual.rgb && golden->width == actual.width) return ::testing::AssertionSuccess();
  const std::string hint = "\nIf the new one is right: ./dev golden --accept";
  if (!write_png(actual, actual_path)) return ::testing::AssertionFailure() << "cannot write " << actual_path;
  if (!golden) return ::testing::AssertionFailure() << to_string(golden.error()) << "\nactual: " << actual_path << hint;
  if (golden->width != actual.width || golden->height != actual.height) {
    return ::testing::AssertionFailure() << name << " has another size\nactual: " << actual_path << hint;
  }
  const ImageDifference difference = difference_of(actual, *golden);
  const bool written = write_png(difference.image, difference_path).has_value();
  return ::testing::AssertionFailure() << name << ": " << difference.pixels << " of " << actual.rgb.size() / 3
                                       << " pixels differ, by up to " << difference.greatest << "\ngolden:     " << path
                                       << "\nactual:     " << actual_path
                                       << "\ndifference: " << (written ? difference_path : "not written") << hint;
}

}  // namespace quoin
