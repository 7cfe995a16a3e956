#include "volume_info.h"

#include <quoin/io/volume.h>

#include "commands.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

/// Returns the bounds of all samples in Quoin's axes.
DBox bounds_of(const Volume& volume) {
  DBox bounds;
  const DVec3 last = DVec3(volume.size - 1);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec4 sample((corner & 1) != 0 ? last.x : 0.0, (corner & 2) != 0 ? last.y : 0.0,
                            (corner & 4) != 0 ? last.z : 0.0, 1.0);
    bounds.extend(DVec3(volume.world_from_voxel * sample));
  }
  return bounds;
}

Json matrix_json(const glm::dmat4& matrix) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    Json& entries = rows.emplace_back(Json::array());
    for (int column = 0; column < 4; ++column) entries.push_back(matrix[column][row] + 0.0);
  }
  return rows;
}

Json volume_json(const Volume& volume) {
  const DBox bounds = bounds_of(volume);
  return {{"format", volume.format},
          {"name", volume.name},
          {"type", name_of(volume.type)},
          {"size", list_of(volume.size)},
          {"spacing", list_of(volume.spacing)},
          {"units", volume.units},
          {"range", {volume.min, volume.max}},
          {"nan", volume.nan_count},
          {"infinite", volume.infinite_count},
          {"bounds", {{"min", list_of(bounds.min)}, {"max", list_of(bounds.max)}}},
          {"world_from_voxel", matrix_json(volume.world_from_voxel)},
          {"warnings", volume.warnings}};
}

std::string three_digits(const DVec3& v, const char* between) {
  return digits_for_people(v.x) + between + digits_for_people(v.y) + between + digits_for_people(v.z);
}

std::string range_text(const Volume& volume) {
  const bool has_finite = volume.nan_count + volume.infinite_count < static_cast<std::int64_t>(volume.values.size());
  return has_finite ? digits_for_people(volume.min) + " to " + digits_for_people(volume.max) : "none";
}

std::string volume_text(const std::string& name, const Volume& volume) {
  const std::int64_t count = static_cast<std::int64_t>(volume.size.x) * volume.size.y * volume.size.z;
  const DBox bounds = bounds_of(volume);
  const std::string units = volume.units.empty() ? "" : " " + volume.units;
  return name + ": " + volume.format + " volume\n" + "Values: " + std::to_string(volume.size.x) + " x " +
         std::to_string(volume.size.y) + " x " + std::to_string(volume.size.z) + " = " + with_thousands(count) +
         " of type " + std::string(name_of(volume.type)) + "\n" + "Range: " + range_text(volume) + "\n" +
         "Spacing: " + three_digits(volume.spacing, " x ") + units + "\n" +
         "Bounds: " + three_digits(bounds.min, ", ") + "  to  " + three_digits(bounds.max, ", ") + units + "\n";
}

}  // namespace

Result<int> run_volume_info(const CommonOptions& options, const StandardStreams& streams) {
  const auto volume = [&] {
    ProgressBar bar;
    return read_input_volume(options, bar.listener("reading"));
  }();
  if (!volume) return volume.error();
  if (options.json) return print_json(volume_json(*volume));
  print_warnings(volume->warnings);
  return print(volume_text(streams.name_of(options.input), *volume));
}

}  // namespace quoin::tool
