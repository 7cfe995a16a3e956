#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/thousands.h>
#include <quoin/core/vec.h>

namespace quoin::tool {

using Json = nlohmann::ordered_json;

/// A list of three numbers, without -0.
[[nodiscard]] Json list_of(const DVec3& v);
[[nodiscard]] Json list_of(const IVec3& v);

/// Text for a terminal: control characters become question marks.
[[nodiscard]] std::string on_one_line(std::string_view text);

/// "1.5 MB"; decimal units, up to three digits.
[[nodiscard]] std::string bytes_for_people(std::uint64_t bytes);

/// At most four digits after the point, none when they are zeros.
[[nodiscard]] std::string number_for_people(double value);

/// Six digits, however large or small.
[[nodiscard]] std::string digits_for_people(double value);

/// Prints "quoin: MESSAGE" on standard error, as one line whatever the message holds.
void print_error(std::string_view message);
void print_error(const Error& error);
void print_warnings(const std::vector<std::string>& warnings);

/// From now on summaries, warnings and progress are not shown.
void be_quiet();
[[nodiscard]] bool is_quiet();

/// Prints what a command did, unless it is to be quiet; returns the exit status as `print` does.
[[nodiscard]] int print_summary(std::string_view text);

/// Prints text, or one JSON object and a line end, on standard output; returns the exit status: kFailed when that
/// cannot be written.
[[nodiscard]] int print(std::string_view text);
[[nodiscard]] int print_json(const Json& object);

}  // namespace quoin::tool
