#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/thousands.h>
#include <quoin/core/vec.h>
#include <quoin/scene/scene.h>

namespace quoin::tool {

using Json = nlohmann::ordered_json;

/// Returns a JSON array of three numbers, with 0 for -0.
[[nodiscard]] Json list_of(const DVec3& v);
[[nodiscard]] Json list_of(const IVec3& v);

/// Replaces control characters by question marks.
[[nodiscard]] std::string on_one_line(std::string_view text);

/// Formats a size in decimal units with up to three digits, as in "1.5 MB".
[[nodiscard]] std::string bytes_for_people(std::uint64_t bytes);

/// Formats a number with up to four decimals, without trailing zeros.
[[nodiscard]] std::string number_for_people(double value);

/// Formats a number with six significant digits.
[[nodiscard]] std::string digits_for_people(double value);

/// Prints "quoin: MESSAGE" on standard error as one line.
void print_error(std::string_view message);
void print_error(const Error& error);
void print_warnings(const std::vector<std::string>& warnings);

/// Suppresses summaries, warnings and progress from now on.
void be_quiet();
[[nodiscard]] bool is_quiet();

/// Prints the result of a command unless --quiet was given. Returns the exit status, as `print` does.
[[nodiscard]] int print_summary(std::string_view text);

/// Prints text, or a JSON object and a line end, on standard output. Returns the exit status: kFailed if writing fails.
[[nodiscard]] int print(std::string_view text);
[[nodiscard]] int print_json(const Json& object);

/// The amount of content in a scene. Each model counts once.
struct SceneContent {
  std::int64_t voxels = 0;
  std::int64_t solid_samples = 0;  ///< in fields
};

[[nodiscard]] std::int64_t solid_samples(const Scene& scene);
[[nodiscard]] std::int64_t voxels_with_data(const Scene& scene);

/// Returns "Voxels: 1,234", "Solid samples: 5,678" or both, without a line end.
[[nodiscard]] std::string content_text(const SceneContent& content);

/// Adds a warning if the scene has lamps, which meshes leave out.
void warn_of_lamps(const Scene& scene, std::vector<std::string>& warnings);
/// Adds a warning if voxels have data, which meshes leave out.
void warn_of_data(std::int64_t voxels, std::vector<std::string>& warnings);
/// Adds a warning if a game stores values in the world, which other files leave out.
void warn_of_values(std::size_t values, std::vector<std::string>& warnings);
/// Adds a warning if `filter` leaves out hidden instances.
void warn_of_left_out(const Scene& scene, InstanceFilter filter, std::vector<std::string>& warnings);

}  // namespace quoin::tool
