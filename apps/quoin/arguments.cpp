#include <charconv>
#include <cmath>

#include "commands.h"
#include "output.h"
#include "parse.h"

namespace quoin::tool {

namespace {

/// What is wrong with `text` as a number of at least 0; empty when nothing is.
template <class Number>
std::string fault_of_number(const std::string& text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  const bool is_negative = text.starts_with('-') && value <= 0 && text.find_first_not_of("-0.") != std::string::npos;
  if (error == std::errc::result_out_of_range && stop == end && !is_negative) return "too large: \"" + text + "\"";
  const bool is_number = error == std::errc() && stop == end && std::isfinite(static_cast<double>(value));
  return is_number && !is_negative ? "" : "must be 0 or more, not \"" + text + "\"";
}

}  // namespace

CLI::Validator not_negative() {
  return {[](std::string& text) { return fault_of_number<double>(text); }, ""};
}

CLI::Validator not_negative_whole() {
  return {[](std::string& text) { return fault_of_number<int>(text); }, ""};
}

CLI::Validator positive() {
  return {[](std::string& text) {
            const auto number = parse_number(text);
            return number && *number > 0.0 ? std::string() : "must be a number above 0, not \"" + text + "\"";
          },
          ""};
}

CLI::Validator file_name() {
  return {[](std::string& text) { return std::string(text.empty() ? "must be the name of a file, not \"\"" : ""); },
          ""};
}

void add_quiet_option(CLI::App& command) {
  command.add_flag_callback(
      "-q,--quiet", [] { be_quiet(); }, "Print errors alone, and what --json prints; no progress, no warnings");
}

void add_common_options(CLI::App& command, CommonOptions& options) {
  command.add_option("IN", options.input, "File to read")->required()->check(file_name());
  command.add_flag("--hidden", options.load.show_hidden, "Include hidden layers and nodes");
  command
      .add_option(
          "--around", options.load.radius,
          "Of a world of Minecraft's: how far around its spawn, in chunks of 64 blocks to each side (default 4; "
          "converted to .quoin it is all there)")
      ->check(CLI::Range(0, 1'000));
  command.add_option("--frame", options.load.frame, "Animation frame to take (default 0)")
      ->check(not_negative_whole())
      ->each([&options](const std::string&) { options.takes_frame = true; });
  command.add_flag("--json", options.json, "Print one JSON object instead of text");
  add_quiet_option(command);
  command.add_option("--threads", options.threads.count, "Threads to use (default: all)")->check(CLI::Range(1U, 1024U));
}

}  // namespace quoin::tool
