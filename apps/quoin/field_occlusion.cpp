#include "field_occlusion.h"

#include <array>
#include <optional>
#include <utility>

#include "parse.h"

namespace quoin::tool {

namespace {

constexpr std::array<std::pair<const char*, SmoothOcclusion>, 5> kForms = {
    {{"none", SmoothOcclusion::None},
     {"soft-share", SmoothOcclusion::SoftShare},
     {"share", SmoothOcclusion::SolidShare},
     {"weighted", SmoothOcclusion::Weighted},
     {"weighted-published", SmoothOcclusion::WeightedPublished}}};

/// An option with a number in a range; `range` is the text for messages.
struct NumberOption {
  const char* name;
  const char* range;
  double least;
  double most;
  float SmoothOcclusionOptions::*value;
};

constexpr std::array<NumberOption, 3> kNumbers = {
    {{"--ao-spread", "0.0625 to 4", 0.0625, 4.0, &SmoothOcclusionOptions::spread},
     {"--ao-offset", "0 to 0.99", 0.0, 0.99, &SmoothOcclusionOptions::offset},
     {"--ao-power", "0.0625 to 64", 0.0625, 64.0, &SmoothOcclusionOptions::power}}};

std::string text_of(const CLI::App& command, const char* name) {
  return command.get_option(name)->results().back();
}

std::string read_form(const CLI::App& command, SmoothOcclusion& form) {
  if (command.count("--ao-form") == 0) return "";
  const std::string text = text_of(command, "--ao-form");
  for (const auto& [name, value] : kForms) {
    if (text != name) continue;
    form = value;
    return "";
  }
  return "--ao-form: must be none, soft-share, share, weighted or weighted-published, not \"" + text + "\"";
}

std::string read_number(const CLI::App& command, const NumberOption& option, SmoothOcclusionOptions& options) {
  if (command.count(option.name) == 0) return "";
  const std::string text = text_of(command, option.name);
  const auto number = parse_number(text);
  if (!number || *number < option.least || *number > option.most) {
    return std::string(option.name) + ": must be " + option.range + ", not \"" + text + "\"";
  }
  options.*option.value = static_cast<float>(*number);
  return "";
}

}  // namespace

void add_field_occlusion_options(CLI::App& command) {
  const auto add = [&](const std::string& name, const std::string& type, const std::string& description) {
    command.add_option(name, description)->type_name(type);
  };
  add("--ao-form", "FORM",
      "Ambient occlusion of smooth surfaces from 27 density samples around each vertex (default soft-share). "
      "soft-share: share of solid samples, without steps. share: count of solid samples. weighted: by their depth in "
      "the solid. weighted-published: by the published curve, which darkens open surfaces slightly. none: no "
      "occlusion");
  add("--ao-spread", "SAMPLES", "Spacing of the density samples of --ao-form, 0.0625 to 4 (default 2)");
  add("--ao-offset", "X", "Offset of the weights of the weighted forms, 0 to 0.99; greater is darker (default 0.4)");
  add("--ao-power", "X", "Exponent of the weighted forms, 0.0625 to 64 (default 2)");
}

const char* given_field_occlusion(const CLI::App& command) {
  for (const char* name : {"--ao-form", "--ao-spread", "--ao-offset", "--ao-power"}) {
    if (command.count(name) > 0) return name;
  }
  return nullptr;
}

std::string read_field_occlusion(const CLI::App& command, SmoothOcclusionOptions& options) {
  if (std::string fault = read_form(command, options.method); !fault.empty()) return fault;
  for (const NumberOption& option : kNumbers) {
    if (std::string fault = read_number(command, option, options); !fault.empty()) return fault;
  }
  if (options.method == SmoothOcclusion::None && command.count("--ao-spread") > 0) {
    return "--ao-spread and --ao-form none cannot be used together";
  }
  const bool is_weighted =
      options.method == SmoothOcclusion::Weighted || options.method == SmoothOcclusion::WeightedPublished;
  for (const char* name : {"--ao-offset", "--ao-power"}) {
    if (command.count(name) > 0 && !is_weighted) return std::string(name) + " needs --ao-form weighted";
  }
  return "";
}

}  // namespace quoin::tool
