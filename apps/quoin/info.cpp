#include <algorithm>
#include <bit>
#include <map>
#include <memory>
#include <set>

#include <quoin/io/formats.h>
#include <quoin/io/volume.h>
#include <quoin/io/vox.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_faces.h>

#include "command_files.h"
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

/// Runs `quoin info` on a volume. Returns the exit status, or the error of the reader.
Result<int> run_volume_info(const CommonOptions& options, const DetectedFile& file, const StandardStreams& streams) {
  const auto volume = [&] {
    ProgressBar bar;
    return read_input_volume(options, file, bar.listener("reading"));
  }();
  if (!volume) return volume.error();
  if (options.json) return print_json(volume_json(*volume));
  print_warnings(volume->warnings);
  return print(volume_text(streams.name_of(options.input), *volume));
}

struct GridReport {
  const SceneGrid* grid = nullptr;
  std::vector<const Instance*> instances;
};

std::vector<GridReport> report_grids(const Scene& scene) {
  std::map<GridHandle, GridReport> reports;
  for (const GridHandle handle : scene.grids().handles()) reports[handle].grid = &scene.grids()[handle];
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (const auto found = reports.find(instance.grid); found != reports.end()) {
      found->second.instances.push_back(&instance);
    }
  }
  std::vector<GridReport> list;
  list.reserve(reports.size());
  for (auto& [handle, report] : reports) list.push_back(std::move(report));
  return list;
}

/// Returns the types of all solid samples.
std::set<VoxelType> solid_types(const DensityGrid& field) {
  std::set<VoxelType> used;
  for (const IVec3 place : field.chunks()) {
    const DensityChunk& chunk = *field.find_chunk(place);
    const std::vector<VoxelType> types = chunk.materials().types();
    if (std::all_of(types.begin(), types.end(), [&](VoxelType type) { return used.contains(type); })) continue;
    for (int row = 0; row < kChunkEdge * kChunkEdge; ++row) {
      const int y = row % kChunkEdge;
      const int z = row / kChunkEdge;
      for (std::uint64_t solid = chunk.solid_row(y, z); solid != 0; solid &= solid - 1) {
        used.insert(chunk.materials().get(std::countr_zero(solid), y, z));
      }
    }
  }
  return used;
}

/// Returns the number of distinct types of voxels and solid samples.
std::size_t distinct_types(const Scene& scene) {
  std::set<VoxelType> used;
  for (const GridHandle handle : scene.grids().handles()) {
    const SceneGrid& grid = scene.grids()[handle];
    for (const VoxelType type : grid.grid.types()) used.insert(type);
    used.merge(solid_types(grid.field));
  }
  used.erase(kAir);
  return used.size();
}

/// Returns zeros for empty bounds, so that the types of the keys stay the same.
Json box(const DBox& bounds) {
  const DBox shown = bounds.empty() ? DBox{DVec3(0.0), DVec3(0.0)} : bounds;
  return {{"min", list_of(shown.min)}, {"max", list_of(shown.max)}};
}

DVec3 signed_scale(const Instance& instance) {
  DVec3 scale(instance.voxel_size);
  if (instance.mirrored) scale.x = -scale.x;
  return scale;
}

/// Returns the index of a handle in the list of groups or layers, or null.
template <class T>
Json place_in(const std::map<Handle<T>, std::size_t>& places, Handle<T> handle) {
  const auto found = places.find(handle);
  return found == places.end() ? Json() : Json(found->second);
}

/// The scene's groups, parents first, and its layers.
class Hierarchy {
 public:
  explicit Hierarchy(const Scene& scene) : scene_(scene) {
    for (const LayerHandle handle : scene.layers().handles()) layers_.emplace(handle, layers_.size());
    for (const GroupHandle handle : groups_from_top(scene)) {
      groups_.emplace(handle, groups_.size());
      sorted_.push_back(handle);
    }
  }

  [[nodiscard]] Json groups() const {
    Json list = Json::array();
    for (const GroupHandle handle : sorted_) {
      const SceneGroup& group = scene_.groups()[handle];
      list.push_back({{"name", group.name},
                      {"parent", place_in(groups_, parent_of(scene_, handle))},
                      {"layer", place_in(layers_, group.layer)},
                      {"position", list_of(group.position)},
                      {"visible", is_shown(scene_, group)}});
    }
    return list;
  }
  [[nodiscard]] Json layers() const {
    Json list = Json::array();
    for (const LayerHandle handle : scene_.layers().handles()) {
      const SceneLayer& layer = scene_.layers()[handle];
      list.push_back({{"name", layer.name}, {"visible", layer.visible}});
    }
    return list;
  }
  [[nodiscard]] Json of(const Instance& instance) const {
    const DQuat& q = instance.rotation;
    return {{"name", instance.name},
            {"position", list_of(instance.position)},
            {"rotation", {q.x + 0.0, q.y + 0.0, q.z + 0.0, q.w + 0.0}},
            {"scale", list_of(signed_scale(instance))},
            {"visible", is_shown(scene_, instance)},
            {"group", place_in(groups_, instance.group)},
            {"layer", place_in(layers_, instance.layer)}};
  }

 private:
  const Scene& scene_;
  std::map<GroupHandle, std::size_t> groups_;
  std::map<LayerHandle, std::size_t> layers_;
  std::vector<GroupHandle> sorted_;
};

std::vector<std::string> kept_by(const LoadedScene& loaded) {
  return loaded.source == nullptr ? std::vector<std::string>{} : source_only_features(*loaded.source);
}

Json grid_json(const GridReport& report, const Hierarchy& hierarchy) {
  const IBox bounds = report.grid->grid.bounds();
  Json entry = {{"name", report.grid->name},
                {"voxels", report.grid->grid.voxel_count()},
                {"voxels_with_data", report.grid->grid.data_count()},
                {"size", list_of(report.grid->declared_box().size())},
                {"bounds", {{"min", list_of(bounds.min)}, {"max", list_of(bounds.max)}}},
                {"instances", Json::array()}};
  for (const Instance* instance : report.instances) entry["instances"].push_back(hierarchy.of(*instance));
  if (report.grid->whole) entry["whole"] = true;
  if (report.grid->field.chunk_count() != 0) entry["solid_samples"] = report.grid->field.solid_count();
  return entry;
}

/// Lists the cameras that --camera file:N of `quoin render` can select.
Json cameras_json(const LoadedScene& loaded) {
  Json list = Json::array();
  for (const FileCamera& each : loaded.cameras) {
    list.push_back({{"number", each.number},
                    {"position", list_of(each.camera.position)},
                    {"forward", list_of(each.camera.forward)}});
  }
  return list;
}

Json info_json(const LoadedScene& loaded, InstanceFilter filter, const FaceCounts& faces) {
  const Hierarchy hierarchy(loaded.scene);
  const std::optional<Environment>& environment = loaded.scene.environment;
  Json object = {{"format", loaded.format},
                 {"voxels", loaded.scene.voxel_count()},
                 {"voxels_with_data", voxels_with_data(loaded.scene)},
                 {"solid_samples", solid_samples(loaded.scene)},
                 {"types", distinct_types(loaded.scene)},
                 {"faces_visible", faces.visible},
                 {"faces_total", faces.total},
                 {"bounds", box(loaded.scene.bounds(filter))},
                 {"lamps", loaded.scene.lamps.size()},
                 {"sun", environment ? list_of(environment->sun.direction) : Json()},
                 {"camera", loaded.camera ? list_of(loaded.camera->position) : Json()},
                 {"cameras", cameras_json(loaded)},
                 {"frames", loaded.last_frame + 1},
                 {"grids", Json::array()},
                 {"groups", hierarchy.groups()},
                 {"layers", hierarchy.layers()},
                 {"kept", kept_by(loaded)},
                 {"dimension", loaded.dimension.empty() ? Json() : Json(loaded.dimension)},
                 {"dimensions", loaded.dimensions},
                 {"warnings", loaded.warnings}};
  for (const GridReport& report : report_grids(loaded.scene)) object["grids"].push_back(grid_json(report, hierarchy));
  return object;
}

std::string three(const DVec3& v, const char* between) {
  return number_for_people(v.x) + between + number_for_people(v.y) + between + number_for_people(v.z);
}

std::string quoted(const std::string& name) {
  return name.empty() ? "(no name)" : "\"" + on_one_line(name) + "\"";
}

std::string count_of(std::int64_t count, const std::string& singular) {
  return with_thousands(count) + " " + singular + (count == 1 ? "" : "s");
}

std::string instance_text(const Scene& scene, const Instance& instance) {
  std::string line = "    at " + three(instance.position, ", ");
  const DQuat& q = instance.rotation;
  if (q != DQuat(1, 0, 0, 0))
    line += "  rotated (" + three({q.x, q.y, q.z}, ", ") + "; " + number_for_people(q.w) + ")";
  if (instance.voxel_size != 1.0) line += "  scale " + number_for_people(instance.voxel_size);
  if (instance.mirrored) line += "  mirrored";
  if (!is_shown(scene, instance)) line += "  hidden";
  if (!instance.name.empty()) line += "  " + quoted(instance.name);
  return line + "\n";
}

std::string grid_text(const Scene& scene, const GridReport& report) {
  std::string text = "  " + quoted(report.grid->name) + "  " + three(DVec3(report.grid->declared_box().size()), " x ") +
                     ", " + count_of(report.grid->grid.voxel_count(), "voxel");
  if (report.grid->field.chunk_count() != 0) {
    text += ", a field of " + count_of(report.grid->field.solid_count(), "solid sample");
  }
  if (report.grid->whole) text += ", whole in streamed worlds";
  text += "\n";
  if (report.instances.empty()) text += "    not placed\n";
  for (const Instance* instance : report.instances) text += instance_text(scene, *instance);
  return text;
}

/// Returns a line with the number of entries, their names, and the number of hidden entries without a name.
template <class T>
std::string names_text(const char* what, const SlotMap<T>& all) {
  if (all.empty()) return {};
  std::string names;
  std::size_t hidden = 0;
  for (const Handle<T> handle : all.handles()) {
    const T& each = all[handle];
    if (!each.name.empty()) {
      names += (names.empty() ? ": " : ", ") + quoted(each.name) + (each.visible ? "" : " (hidden)");
    } else if (!each.visible) {
      ++hidden;
    }
  }
  if (hidden > 0) names += (names.empty() ? ": " : ", ") + std::to_string(hidden) + " unnamed and hidden";
  return std::string(what) + ": " + std::to_string(all.size()) + names + "\n";
}

std::string hierarchy_text(const LoadedScene& loaded) {
  std::string text = names_text("Groups", loaded.scene.groups()) + names_text("Layers", loaded.scene.layers());
  std::string kept;
  for (const std::string& line : kept_by(loaded)) kept += (kept.empty() ? "" : "; ") + line;
  return kept.empty() ? text : text + "Kept when saved as .vox: " + kept + "\n";
}

std::string dimension_text(const LoadedScene& loaded) {
  if (loaded.dimension.empty()) return {};
  std::string others;
  for (const std::string& name : loaded.dimensions) {
    if (name != loaded.dimension) others += (others.empty() ? "" : ", ") + on_one_line(name);
  }
  return "Dimension: " + on_one_line(loaded.dimension) +
         (others.empty() ? "" : " (select another with --dimension: " + others + ")") + "\n";
}

std::string info_text(const CommonOptions& options, const std::string& name, const LoadedScene& loaded,
                      const FaceCounts& faces) {
  const Scene& scene = loaded.scene;
  std::string text = name + ": " + loaded.format + ", " +
                     count_of(static_cast<std::int64_t>(scene.grids().size()), "grid") + ", " +
                     count_of(static_cast<std::int64_t>(scene.instances().size()), "instance") + "\n";
  text += dimension_text(loaded);
  text += content_text({scene.voxel_count(), solid_samples(scene)}) + " of " +
          count_of(static_cast<std::int64_t>(distinct_types(scene)), "type") + "\n";
  if (scene.voxel_count() > 0 || solid_samples(scene) == 0) text += to_string(faces) + "\n";
  const DBox bounds = scene.bounds(options.instances());
  if (!bounds.empty()) text += "Bounds: " + three(bounds.min, ", ") + "  to  " + three(bounds.max, ", ") + "\n";
  if (const std::int64_t voxels = voxels_with_data(scene); voxels != 0) {
    text += "Data: at " + count_of(voxels, "voxel") + "\n";
  }
  if (!scene.lamps.empty()) text += "Lamps: " + std::to_string(scene.lamps.size()) + "\n";
  if (scene.environment) text += "Sun: towards " + three(scene.environment->sun.direction, ", ") + "\n";
  for (const FileCamera& each : loaded.cameras) {
    text += "Camera " + std::to_string(each.number) + ": at " + three(each.camera.position, ", ") + "\n";
  }
  text += hierarchy_text(loaded);
  for (const GridReport& report : report_grids(scene)) text += grid_text(scene, report);
  return text;
}

Result<int> info(const CommonOptions& options, const StandardStreams& streams) {
  const auto input = open_input(options.input, options.load);
  if (!input) return input.error();
  if (input->is_volume) return run_volume_info(options, input->file, streams);
  const auto loaded = [&] {
    ProgressBar bar;
    return load_scene(input->file, options.load, options.threads, bar.listener("reading"));
  }();
  if (!loaded) return loaded.error();
  const FaceCounts faces = count_faces(loaded->scene, options.instances(), options.threads);
  if (options.json) return print_json(info_json(*loaded, options.instances(), faces));
  print_warnings(loaded->warnings);
  return print(info_text(options, streams.name_of(options.input), *loaded, faces));
}

int run_info(CommonOptions& options) {
  StandardStreams streams;
  const Status read = streams.take_input(options.input);
  const auto status = read ? info(options, streams) : Result<int>(read.error());
  if (status) return *status;
  const Error error = streams.named(status.error());
  streams.remove();
  die_if_interrupted();
  print_error(error);
  return kFailed;
}

}  // namespace

void add_info_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand(
      "info", "Print the contents of a file: grids, sizes, voxels, faces, types, transforms, values of volumes");
  const auto options = std::make_shared<CommonOptions>();
  add_common_options(*command, *options, PlainBlocks::Cubes);
  add_raw_options(*command, options->load.raw);
  command->footer(readable_files() +
                  "Faces are counted once per model; only models that are placed and visible count.\n"
                  "Example: quoin info castle.vox\n"
                  "Example: quoin info scan.raw --raw-size 256x256x128 --raw-type uint16");
  command->callback([command, options, &status] {
    const Status fits = check_rules(*command, raw_rules());
    status = fits ? run_info(*options) : wrong_usage(fits.error());
  });
}

}  // namespace quoin::tool
