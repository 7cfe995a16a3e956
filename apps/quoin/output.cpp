#include "output.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>

#include <quoin/scene/scene_meshes.h>

#include "commands.h"

namespace quoin::tool {

namespace {

bool quiet = false;

}  // namespace

Json list_of(const DVec3& v) {
  return {v.x + 0.0, v.y + 0.0, v.z + 0.0};
}

Json list_of(const IVec3& v) {
  return {v.x, v.y, v.z};
}

std::string on_one_line(std::string_view text) {
  std::string line(text);
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7F') c = '?';
  }
  return line;
}

std::string number_for_people(double value) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), "%.4f", value);
  std::string digits = text.data();
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  return digits == "-0" ? "0" : digits;
}

std::string digits_for_people(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value + 0.0);
  return text.data();
}

std::string bytes_for_people(std::uint64_t bytes) {
  constexpr std::array units = {"kB", "MB", "GB", "TB"};
  if (bytes < 1000) return std::to_string(bytes) + " B";
  auto size = static_cast<double>(bytes) / 1000.0;
  std::size_t unit = 0;
  for (; size >= 999.5 && unit + 1 < units.size(); ++unit) size /= 1000.0;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), size < 9.95 ? "%.1f %s" : "%.0f %s", size, units[unit]);
  return text.data();
}

void print_error(std::string_view message) {
  const std::string line = "quoin: " + on_one_line(message) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
}

void print_error(const Error& error) {
  print_error(to_string(error));
}

void be_quiet() {
  quiet = true;
}

bool is_quiet() {
  return quiet;
}

void print_warnings(const std::vector<std::string>& warnings) {
  if (is_quiet()) return;
  for (const std::string& warning : warnings) print_error("warning: " + warning);
}

int print(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (written && std::fflush(stdout) == 0) return kDone;
  // The reader closed the pipe, which is not an error to report.
  if (errno == EPIPE) return kFailed;
  print_error("cannot write standard output");
  return kFailed;
}

int print_summary(std::string_view text) {
  return is_quiet() ? kDone : print(text);
}

int print_json(const Json& object) {
  return print(object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::int64_t solid_samples(const Scene& scene) {
  std::int64_t count = 0;
  scene.grids().for_each([&](GridHandle, const SceneGrid& grid) { count += grid.field.solid_count(); });
  return count;
}

std::int64_t voxels_with_data(const Scene& scene) {
  std::int64_t count = 0;
  scene.grids().for_each([&](GridHandle, const SceneGrid& grid) { count += grid.grid.data_count(); });
  return count;
}

std::string content_text(const SceneContent& content) {
  const std::string samples = with_thousands(content.solid_samples);
  if (content.solid_samples == 0) return "Voxels: " + with_thousands(content.voxels);
  if (content.voxels == 0) return "Solid samples: " + samples;
  return "Voxels: " + with_thousands(content.voxels) + ", solid samples: " + samples;
}

void warn_of_lamps(const Scene& scene, std::vector<std::string>& warnings) {
  if (scene.lamps.empty()) return;
  warnings.push_back("lamps left out: " + std::to_string(scene.lamps.size()) +
                     " (--lights writes them to .glb and .gltf)");
}

void warn_of_values(std::size_t values, std::vector<std::string>& warnings) {
  if (values == 0) return;
  warnings.push_back("application values left out: " + std::to_string(values) + " (quoin world backup copies them)");
}

void warn_of_data(std::int64_t voxels, std::vector<std::string>& warnings) {
  if (voxels == 0) return;
  warnings.push_back("data of voxels left out, not supported by meshes: " + std::to_string(voxels));
}

void warn_of_left_out(const Scene& scene, InstanceFilter filter, std::vector<std::string>& warnings) {
  std::size_t left_out = 0;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, InstanceFilter::All) && !is_drawn(scene, instance, filter)) ++left_out;
  }
  if (left_out == 1) warnings.emplace_back("1 hidden instance left out; --hidden includes it");
  if (left_out > 1) {
    warnings.push_back(std::to_string(left_out) + " hidden instances left out; --hidden includes them");
  }
}

}  // namespace quoin::tool
