#include "io/packs/block_states.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>

namespace quoin::packs {

namespace {

using Json = nlohmann::json;
using Alternatives = std::vector<std::vector<StateTerm>>;

constexpr int kMaxConditionDepth = 8;
constexpr std::size_t kMaxModelChoices = 256;
constexpr double kMaxWeight = 1e6;
constexpr std::size_t kMaxTerms = 64;                // of an alternative
constexpr std::size_t kMaxAllAlternatives = 16'384;  // of a file
// Values that a file's products may copy. A short file could otherwise repeat a long list of values many times.
constexpr std::size_t kMaxCopiedValues = std::size_t{1} << 20;

Error wrong_states(const std::string& reason) {
  return make_error(ErrorCode::BadFormat, reason);
}

Error too_many(const char* what, std::size_t most) {
  return make_error(ErrorCode::LimitExceeded, "more than " + std::to_string(most) + " " + what);
}

/// Splits "a|b", or "!a|b" for none of them.
StateTerm term_of(std::string property, std::string_view text) {
  StateTerm term;
  term.property = std::move(property);
  if (text.starts_with('!')) {
    term.is_negated = true;
    text.remove_prefix(1);
  }
  while (true) {
    const std::size_t bar = text.find('|');
    term.values.emplace_back(text.substr(0, bar));
    if (bar == std::string_view::npos) return term;
    text.remove_prefix(bar + 1);
  }
}

Result<int> quarters_in(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return 0;
  const double degrees = found->is_number() ? found->get<double>() : -1.0;
  if (degrees != 0.0 && degrees != 90.0 && degrees != 180.0 && degrees != 270.0) {
    return wrong_states(std::string("the turn about ") + key + " is not 0, 90, 180 or 270");
  }
  return static_cast<int>(degrees) / 90;
}

Result<StateModel> state_model(const Json& json) {
  StateModel model;
  const auto name = json.is_object() ? json.find("model") : json.end();
  if (!json.is_object() || name == json.end() || !name->is_string()) return wrong_states("a case names no model");
  model.model = name->get<std::string>();
  const auto x = quarters_in(json, "x");
  if (!x) return x.error();
  const auto y = quarters_in(json, "y");
  if (!y) return y.error();
  model.x = *x;
  model.y = *y;
  const auto lock = json.find("uvlock");
  model.keeps_uv = lock != json.end() && lock->is_boolean() && lock->get<bool>();
  return model;
}

/// Reads a model or a list of models with weights.
Result<std::vector<StateModel>> state_models(const Json& json) {
  if (!json.is_array()) {
    auto one = state_model(json);
    if (!one) return one.error();
    return std::vector<StateModel>{std::move(*one)};
  }
  if (json.empty()) return wrong_states("a case names no model");
  if (json.size() > kMaxModelChoices) return too_many("models to choose from", kMaxModelChoices);
  std::vector<StateModel> models;
  for (const Json& each : json) {
    auto one = state_model(each);
    if (!one) return one.error();
    if (const auto weight = each.find("weight"); weight != each.end()) {
      const double number = weight->is_number() ? weight->get<double>() : 0.0;
      if (!(number >= 1.0 && number <= kMaxWeight) || number != std::floor(number)) {
        return wrong_states("a weight is not a whole number from 1 to 1,000,000");
      }
      one->weight = static_cast<int>(number);
    }
    models.push_back(std::move(*one));
  }
  return models;
}

/// Returns the alternatives under which all of two lists hold. `copied`: counts the values of a file's products.
Result<Alternatives> both(const Alternatives& a, const Alternatives& b, std::size_t& copied) {
  if (a.size() * b.size() > kMaxStateAlternatives) return too_many("alternatives of a case", kMaxStateAlternatives);
  Alternatives all;
  for (const auto& left : a) {
    for (const auto& right : b) {
      if (left.size() + right.size() > kMaxTerms) return too_many("properties in a condition", kMaxTerms);
      for (const auto* const terms : {&left, &right}) {
        for (const StateTerm& term : *terms) copied += term.values.size();
      }
      if (copied > kMaxCopiedValues) return too_many("values in the products of conditions", kMaxCopiedValues);
      all.push_back(left);
      all.back().insert(all.back().end(), right.begin(), right.end());
    }
  }
  return all;
}

Result<Alternatives> alternatives_of(const Json& json, int depth, std::size_t& copied);

/// Reads the list of an OR or AND.
Result<Alternatives> alternatives_in(const Json& list, bool is_or, int depth, std::size_t& copied) {
  if (!list.is_array()) return wrong_states("OR or AND is not an array");
  if (list.size() > kMaxStateAlternatives) return too_many("alternatives of a case", kMaxStateAlternatives);
  Alternatives all;
  if (!is_or) all.emplace_back();
  for (const Json& each : list) {
    auto one = alternatives_of(each, depth + 1, copied);
    if (!one) return one.error();
    if (is_or) {
      all.insert(all.end(), one->begin(), one->end());
    } else {
      auto product = both(all, *one, copied);
      if (!product) return product.error();
      all = std::move(*product);
    }
    if (all.size() > kMaxStateAlternatives) return too_many("alternatives of a case", kMaxStateAlternatives);
  }
  return all;
}

Result<Alternatives> alternatives_of(const Json& json, int depth, std::size_t& copied) {
  if (!json.is_object()) return wrong_states("\"when\" is not an object");
  if (depth > kMaxConditionDepth) return too_many("levels of OR and AND", kMaxConditionDepth);
  Alternatives all(1);
  if (json.size() > kMaxTerms) return too_many("properties in a condition", kMaxTerms);
  for (const auto& [key, value] : json.items()) {
    if (key == "OR" || key == "AND") {
      const auto list = alternatives_in(value, key == "OR", depth, copied);
      if (!list) return list.error();
      auto product = both(all, *list, copied);
      if (!product) return product.error();
      all = std::move(*product);
      continue;
    }
    if (value.is_object() || value.is_array() || value.is_null()) {
      return wrong_states("the value of a property is not text, a number or a truth value");
    }
    const StateTerm term = term_of(key, value.is_string() ? value.get<std::string>() : value.dump());
    auto product = both(all, {{term}}, copied);
    if (!product) return product.error();
    all = std::move(*product);
  }
  return all;
}

/// Reads the key of a variant: "facing=north,half=bottom".
Result<std::vector<StateTerm>> terms_of_variant(std::string_view text) {
  std::vector<StateTerm> terms;
  // Before 1.13, "normal" was the name of a block without properties, and "all" matched every state.
  if (text.empty() || text == "normal" || text == "all") return terms;
  while (true) {
    const std::size_t comma = text.find(',');
    const std::string_view one = text.substr(0, comma);
    const std::size_t equals = one.find('=');
    if (equals == std::string_view::npos) return wrong_states("a variant has a property without a value");
    terms.push_back({std::string(one.substr(0, equals)), {std::string(one.substr(equals + 1))}});
    if (comma == std::string_view::npos) return terms;
    if (terms.size() == kMaxTerms) return too_many("properties in a condition", kMaxTerms);
    text.remove_prefix(comma + 1);
  }
}

Result<BlockStates> parse_variants(const Json& json) {
  if (!json.is_object()) return wrong_states("\"variants\" is not an object");
  if (json.size() > kMaxStateCases) return too_many("cases", kMaxStateCases);
  BlockStates states;
  for (const auto& [key, value] : json.items()) {
    auto terms = terms_of_variant(key);
    if (!terms) return terms.error();
    auto models = state_models(value);
    if (!models) return models.error();
    states.cases.push_back({{std::move(*terms)}, std::move(*models)});
  }
  // JSON objects have no order: the variants with the most properties come first.
  std::ranges::stable_sort(states.cases, std::ranges::greater(),
                           [](const StateCase& each) { return each.when.front().size(); });
  return states;
}

Result<BlockStates> parse_multipart(const Json& json) {
  if (!json.is_array()) return wrong_states("\"multipart\" is not an array");
  if (json.size() > kMaxStateCases) return too_many("cases", kMaxStateCases);
  BlockStates states;
  states.is_multipart = true;
  std::size_t alternative_count = 0;
  std::size_t copied = 0;
  for (const Json& each : json) {
    const auto apply = each.is_object() ? each.find("apply") : each.end();
    if (!each.is_object() || apply == each.end()) return wrong_states("a part has no \"apply\"");
    auto models = state_models(*apply);
    if (!models) return models.error();
    Alternatives when(1);
    if (const auto condition = each.find("when"); condition != each.end()) {
      auto alternatives = alternatives_of(*condition, 0, copied);
      if (!alternatives) return alternatives.error();
      when = std::move(*alternatives);
    }
    alternative_count += when.size();
    if (alternative_count > kMaxAllAlternatives) return too_many("alternatives of all cases", kMaxAllAlternatives);
    states.cases.push_back({std::move(when), std::move(*models)});
  }
  return states;
}

}  // namespace

const StateModel& StateCase::heaviest() const {
  QUOIN_ASSERT(!models.empty(), "a case with models");
  return *std::ranges::max_element(models, {}, &StateModel::weight);
}

Result<BlockStates> parse_block_states(const Json& json) {
  if (!json.is_object()) return wrong_states("not a JSON object");
  if (const auto variants = json.find("variants"); variants != json.end()) return parse_variants(*variants);
  if (const auto parts = json.find("multipart"); parts != json.end()) return parse_multipart(*parts);
  return wrong_states("neither \"variants\" nor \"multipart\"");
}

}  // namespace quoin::packs
