#pragma once

// Blocks and their states in npm's minecraft-data (MIT), which tests compare with the own pack if it is installed.

#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

namespace quoin::minecraft_data {

using Json = nlohmann::json;
using Values = std::map<std::string, std::string>;

/// The version of the goal, and a later one whose blocks the rules were not written for.
inline constexpr std::array<const char*, 2> kVersions = {"1.21.4", "26.1"};

inline constexpr const char* kInstall =
    "needs 500 MB: npm install --prefix build/oracle minecraft-data@3.119.0 deepslate@0.27.2";

inline std::filesystem::path oracle_modules() {
  return std::filesystem::path(QUOIN_SOURCE_DIR) / "build/oracle/node_modules";
}

inline std::filesystem::path data_folder(const std::string& version = kVersions[0]) {
  return oracle_modules() / "minecraft-data/minecraft-data/data/pc" / version;
}

inline Json parsed(const std::filesystem::path& file) {
  std::ifstream in(file);
  return Json::parse(in);
}

/// Returns a value of a property by its number. Booleans begin with true.
inline std::string value_of(const Json& property, int number) {
  if (property.contains("values")) return property["values"][static_cast<std::size_t>(number)].get<std::string>();
  return number == 0 ? "true" : "false";
}

/// Returns the number of states of a block.
inline int state_count(const Json& block) {
  return block["maxStateId"].get<int>() - block["minStateId"].get<int>() + 1;
}

/// Returns the properties of a state of a block, counted from 0.
inline Values values_of(const Json& block, int state) {
  Values values;
  const Json& properties = block["states"];
  for (auto at = properties.rbegin(); at != properties.rend(); ++at) {
    const int count = (*at)["num_values"].get<int>();
    values[(*at)["name"].get<std::string>()] = value_of(*at, state % count);
    state /= count;
  }
  return values;
}

}  // namespace quoin::minecraft_data
