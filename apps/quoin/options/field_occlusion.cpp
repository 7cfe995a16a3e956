#include "options/field_occlusion.h"

#include "options/parse.h"

namespace quoin::tool {

namespace {

std::optional<SmoothOcclusion> parse_form(const std::string& text) {
  const Choices<SmoothOcclusion> forms = {{"none", SmoothOcclusion::None},
                                          {"soft-share", SmoothOcclusion::SoftShare},
                                          {"share", SmoothOcclusion::SolidShare},
                                          {"weighted", SmoothOcclusion::Weighted},
                                          {"weighted-published", SmoothOcclusion::WeightedPublished}};
  const auto found = std::ranges::find(forms, text, &std::pair<std::string, SmoothOcclusion>::first);
  return found == forms.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

void add_field_occlusion_options(CLI::App& command, SmoothOcclusionOptions& options) {
  add_parsed<SmoothOcclusion>(
      command, "--ao-form", "FORM", {parse_form, "none, soft-share, share, weighted or weighted-published"},
      options.method,
      "Ambient occlusion of smooth surfaces from 27 density samples around each vertex (default soft-share). "
      "soft-share: share of solid samples, without steps. share: count of solid samples. weighted: by their depth in "
      "the solid. weighted-published: by the published curve, which darkens open surfaces slightly. none: no "
      "occlusion");
  const auto add = [&](const char* name, const char* type, double least, double most, const char* range, float& value,
                       const char* help) {
    const auto set = [&value](const double& number) { value = static_cast<float>(number); };
    add_parsed<double>(command, name, type, number_between(least, most, range), set, help);
  };
  add("--ao-spread", "SAMPLES", 0.0625, 4.0, "0.0625 to 4", options.spread,
      "Spacing of the density samples of --ao-form, 0.0625 to 4 (default 2)");
  add("--ao-offset", "X", 0.0, 0.99, "0 to 0.99", options.offset,
      "Offset of the weights of the weighted forms, 0 to 0.99; greater is darker (default 0.4)");
  add("--ao-power", "X", 0.0625, 64.0, "0.0625 to 64", options.power,
      "Exponent of the weighted forms, 0.0625 to 64 (default 2)");
}

std::vector<OptionRule> field_occlusion_rules(const SmoothOcclusionOptions& options) {
  const auto has_form = [&options](SmoothOcclusion form) { return options.method == form; };
  const auto is_weighted = [has_form] {
    return has_form(SmoothOcclusion::Weighted) || has_form(SmoothOcclusion::WeightedPublished);
  };
  return {{{"--ao-spread"}, excludes("--ao-form none", [has_form] { return has_form(SmoothOcclusion::None); })},
          {{"--ao-offset", "--ao-power"}, needs("--ao-form weighted", is_weighted)}};
}

}  // namespace quoin::tool
