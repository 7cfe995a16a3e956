// Instances, groups, layers, cameras, lamps, sun and environment of a scene; file formats.

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/io/formats.h>

#include "handles.h"

namespace quoin::c {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kRoughly = 1e-4;  // tolerance of rotations, axes and sizes that were stored as floats

void copy(const DVec3& from, double (&to)[3]) {
  for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
}

std::string layer_of(const Scene& scene, LayerHandle handle) {
  const SceneLayer* layer = scene.layers().find(handle);
  return layer == nullptr ? std::string() : layer->name;
}

// Returns the group's number, counted from 1; 0: none.
std::size_t number_of(const SceneBody& body, GroupHandle group) {
  if (body.loaded.scene.groups().find(group) == nullptr) return 0;
  return body.numbers.group_of_slot.at(group.index);
}

void describe(const SceneBody& body, const Instance& instance, quoin_instance& out) {
  const Scene& scene = body.loaded.scene;
  copy_text(instance.name, out.name);
  const bool has_grid = scene.grids().find(instance.grid) != nullptr;
  out.grid = has_grid ? body.numbers.grid_of_slot.at(instance.grid.index) : body.numbers.grids.size();
  out.visible = instance.visible ? 1 : 0;
  out.unsaved = instance.saved ? 0 : 1;
  // Without a grid it shows nothing.
  out.shown = is_drawn(scene, instance, InstanceFilter::Visible) && has_valid_transform(instance) ? 1 : 0;
  out.group = number_of(body, instance.group);
  copy_text(layer_of(scene, instance.layer), out.layer);
  if (!has_grid || !has_valid_transform(instance)) return;
  const glm::dmat4 matrix = world_from_grid(instance, scene.grids()[instance.grid]);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) out.world_from_grid[4 * row + column] = matrix[column][row];
  }
}

// The rotation of three unit columns; entries within float error of an integer are rounded.
DQuat turn_of(glm::dmat3 columns) {
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      double& entry = columns[column][row];
      if (std::abs(entry - std::round(entry)) < 1e-6) entry = std::round(entry);
    }
  }
  return glm::normalize(glm::quat_cast(columns));
}

// Returns true if three columns are perpendicular and equally long; sets `length`.
bool is_similar(const glm::dmat3& columns, double& length) {
  length = std::cbrt(std::abs(glm::determinant(columns)));
  if (!(length > 0.0) || !std::isfinite(length)) return false;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double wanted = i == k ? 1.0 : 0.0;
      if (std::abs(glm::dot(columns[i] / length, columns[k] / length) - wanted) > kRoughly) return false;
    }
  }
  return true;
}

/// Applies a caller's struct to an instance. Returns an error text; null: success.
const char* put(const SceneBody& body, const quoin_instance& given, Instance& instance) {
  if (given.grid >= body.numbers.grids.size()) return "no grid has this number";
  if (given.group > body.numbers.groups.size()) return "no group has this number";
  glm::dmat3 columns(1.0);
  DVec3 moved(0.0);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      const double entry = given.world_from_grid[4 * row + column];
      if (!std::isfinite(entry)) return "world_from_grid is not finite";
      (column == 3 ? moved[row] : columns[column][row]) = entry;
    }
  }
  double length = 0.0;
  if (!is_similar(columns, length)) return "world_from_grid shears or scales non-uniformly";
  // A caller that writes back the truncated name does not truncate the stored one.
  char reported[sizeof given.name];
  copy_text(instance.name, reported);
  if (std::string name = text_in(given.name); name != reported) instance.name = std::move(name);
  instance.grid = body.numbers.grids[given.grid];
  instance.visible = given.visible != 0;
  // Programs compiled with an older header keep the flag.
  if (given.size >= offsetof(quoin_instance, unsaved) + sizeof given.unsaved) instance.saved = given.unsaved == 0;
  instance.group = given.group == 0 ? GroupHandle{} : body.numbers.groups[given.group - 1];
  instance.position = columns * body.loaded.scene.grids()[instance.grid].pivot + moved;
  instance.voxel_size = std::abs(length - 1.0) < 1e-6 ? 1.0 : length;
  instance.mirrored = glm::determinant(columns) < 0.0;
  columns /= length;
  if (instance.mirrored) columns[0] = -columns[0];
  instance.rotation = turn_of(columns);
  return nullptr;
}

void describe(const Camera& camera, quoin_camera& out) {
  out.is_orthographic = camera.projection == Camera::Projection::Orthographic ? 1 : 0;
  copy(camera.position, out.position);
  copy(camera.right, out.right);
  copy(camera.up, out.up);
  copy(camera.forward, out.forward);
  out.vertical_fov_degrees = camera.vertical_fov_radians * kDegrees;
  out.view_height = camera.view_height;
}

// Returns the file's cameras. If the initial camera is not one of them, it comes first.
std::vector<quoin_camera> cameras_of(const LoadedScene& loaded) {
  std::vector<quoin_camera> all;
  bool is_there = !loaded.camera;
  for (const FileCamera& one : loaded.cameras) {
    quoin_camera& out = all.emplace_back();
    describe(one.camera, out);
    out.number = one.number;
    out.focus_distance = one.focus_distance;
    if (is_there || one.camera != *loaded.camera) continue;
    out.is_first = 1;
    is_there = true;
  }
  if (is_there) return all;
  quoin_camera& first = *all.emplace(all.begin());
  describe(*loaded.camera, first);
  first.is_first = 1;
  return all;
}

constexpr double kFurthestPosition = 1e9;  // of cameras and lamps, so that they fit a file's floats

DVec3 point_of(const double (&given)[3]) {
  return {given[0], given[1], given[2]};
}

bool is_within(DVec3 point, double most) {
  return std::abs(point.x) <= most && std::abs(point.y) <= most && std::abs(point.z) <= most;
}

bool is_amount(double value) {
  return value >= 0.0 && value <= kMaxBrightness;
}

bool is_colour(const float (&colour)[3]) {
  return is_amount(static_cast<double>(colour[0])) && is_amount(static_cast<double>(colour[1])) &&
         is_amount(static_cast<double>(colour[2]));
}

// Finds a layer by name; an empty name is no layer. Returns nothing if the scene lacks it.
std::optional<LayerHandle> layer_named(const Scene& scene, std::string_view name) {
  if (name.empty()) return LayerHandle{};
  for (const LayerHandle handle : scene.layers().handles()) {
    // Callers may have received truncated names: match these too.
    char reported[sizeof quoin_layer::name];
    copy_text(scene.layers()[handle].name, reported);
    if (name == reported || name == scene.layers()[handle].name) return handle;
  }
  return std::nullopt;
}

constexpr const char* kNoLayer = "the scene has no layer of this name";

/// Converts a camera. Returns an error text; null: success.
const char* take(const quoin_camera& given, const LoadedScene& loaded, FileCamera& out) {
  if (given.number < 0) return "the camera's number is negative";
  for (const FileCamera& one : loaded.cameras) {
    if (one.number == given.number) return "another camera has this number";
  }
  Camera& camera = out.camera;
  camera.position = point_of(given.position);
  camera.right = point_of(given.right);
  camera.up = point_of(given.up);
  camera.forward = point_of(given.forward);
  if (!is_within(camera.position, kFurthestPosition)) return "the camera's position is out of range";
  const auto is = [](double value, double wanted) { return std::abs(value - wanted) <= kRoughly; };
  for (const DVec3& axis : {camera.right, camera.up, camera.forward}) {
    if (!is(glm::dot(axis, axis), 1.0)) return "right, up and forward must be unit vectors";
  }
  const DVec3 right = glm::cross(camera.forward, camera.up);
  if (!is(right.x, camera.right.x) || !is(right.y, camera.right.y) || !is(right.z, camera.right.z))
    return "right must be forward x up";
  if (given.is_orthographic != 0) {
    if (!(given.view_height > 0.0 && given.view_height <= kFurthestPosition)) return "view_height is out of range";
    camera.projection = Camera::Projection::Orthographic;
    camera.view_height = given.view_height;
  } else {
    if (!(given.vertical_fov_degrees > 0.0 && given.vertical_fov_degrees < 180.0))
      return "the field of view must be between 0 and 180 degrees";
    camera.vertical_fov_radians = given.vertical_fov_degrees / kDegrees;
  }
  if (!(given.focus_distance >= 0.0 && given.focus_distance <= kFurthestPosition))
    return "focus_distance is out of range";
  out.number = given.number;
  out.focus_distance = given.focus_distance;
  return nullptr;
}

const char* take(const quoin_lamp& given, Lamp& lamp) {
  if (!is_within(point_of(given.position), kFurthestPosition)) return "the lamp's position is out of range";
  if (!is_colour(given.colour) || !is_amount(given.intensity)) return "the lamp's colour or intensity is out of range";
  if (!(given.range >= 0.0)) return "the lamp's range is negative";
  lamp.name = text_in(given.name);
  lamp.position = point_of(given.position);
  lamp.colour = {given.colour[0], given.colour[1], given.colour[2]};
  lamp.intensity = given.intensity;
  if (given.range > 0.0) lamp.range = given.range;
  if (given.is_spot == 0) return nullptr;
  lamp.kind = Lamp::Kind::Spot;
  lamp.direction = point_of(given.direction);
  const double length = glm::length(lamp.direction);
  if (!(length > 0.0) || !std::isfinite(length)) return "a spot needs a finite, non-zero direction";
  lamp.direction /= length;
  const double outer = given.outer_angle_degrees == 0.0 ? 45.0 : given.outer_angle_degrees;
  if (!(outer > 0.0 && outer <= 180.0) || !(given.inner_angle_degrees >= 0.0 && given.inner_angle_degrees <= outer))
    return "the spot's angles are out of range";
  lamp.outer_angle_radians = outer / kDegrees;
  lamp.inner_angle_radians = given.inner_angle_degrees / kDegrees;
  return nullptr;
}

/// Sets the sun. Returns an error text; null: success.
const char* take(const quoin_sun& given, Sun& sun) {
  const DVec3 direction = point_of(given.direction);
  const double length = glm::length(direction);
  if (!(length > 0.0) || !std::isfinite(length)) return "the sun needs a finite, non-zero direction";
  if (!is_amount(given.brightness) || !is_colour(given.colour)) return "the sun's brightness or colour is out of range";
  if (!(given.angle_degrees >= 0.0 && given.angle_degrees / kDegrees <= kMaxSunAngleRadians))
    return "the sun's angle is out of range";
  sun.direction = direction / length;
  sun.brightness = given.brightness;
  sun.colour = {given.colour[0], given.colour[1], given.colour[2]};
  sun.angle_radians = given.angle_degrees / kDegrees;
  return nullptr;
}

constexpr std::array kSkies = {SkyModel::Gradient, SkyModel::Fixed, SkyModel::Physical, SkyModel::Uniform,
                               SkyModel::Image};                                                        // QUOIN_SKY_...
constexpr std::array kTones = {ToneCurve::Clamp, ToneCurve::Neutral, ToneCurve::Agx, ToneCurve::Aces};  // from 1 on

void put_colour(Vec3 from, float (&to)[3]) {
  for (int channel = 0; channel < 3; ++channel) to[channel] = from[channel];
}
Vec3 colour_of(const float (&from)[3]) {
  return {from[0], from[1], from[2]};
}

template <class T, std::size_t kCount>
std::int32_t index_of(const std::array<T, kCount>& all, T value) {
  std::int32_t index = 0;
  while (all.at(static_cast<std::size_t>(index)) != value) ++index;
  return index;
}

void describe(const Environment& environment, quoin_environment& out) {
  out.sky = index_of(kSkies, environment.sky.model);
  out.sky_brightness = environment.sky.brightness;
  put_colour(environment.sky.colour, out.sky_colour);
  out.has_background = environment.sky.background ? 1 : 0;
  put_colour(environment.sky.background.value_or(Vec3(0.0F)), out.background);
  out.lamp_brightness = environment.lamp_brightness;
  out.has_exposure = environment.exposure ? 1 : 0;
  out.exposure = environment.exposure.value_or(1.0);
  if (environment.tone) out.tone = 1 + index_of(kTones, *environment.tone);
  const GroundPlane ground = environment.ground.value_or(GroundPlane{});
  out.has_ground = environment.ground ? 1 : 0;
  out.ground_height = ground.height;
  put_colour(ground.colour, out.ground_colour);
  const Fog fog = environment.fog.value_or(Fog{});
  out.has_fog = environment.fog ? 1 : 0;
  out.fog_density = fog.density;
  out.fog_top = fog.top;
  put_colour(fog.colour, out.fog_colour);
  out.fog_anisotropy = fog.anisotropy;
}

/// Sets the environment. Errors: InvalidArgument.
Status take(const quoin_environment& given, Environment& environment) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (given.sky < 0 || given.sky >= std::ssize(kSkies)) return refuse("the sky is none of QUOIN_SKY_...");
  if (given.tone < 0 || given.tone > std::ssize(kTones)) return refuse("the tone is none of QUOIN_TONE_...");
  environment.sky.model = kSkies[static_cast<std::size_t>(given.sky)];
  environment.sky.brightness = given.sky_brightness;
  environment.sky.colour = colour_of(given.sky_colour);
  environment.sky.background.reset();
  if (given.has_background != 0) environment.sky.background = colour_of(given.background);
  environment.lamp_brightness = given.lamp_brightness;
  environment.exposure.reset();
  if (given.has_exposure != 0) environment.exposure = given.exposure;
  environment.tone.reset();
  if (given.tone != 0) environment.tone = kTones[static_cast<std::size_t>(given.tone - 1)];
  if (given.has_ground == 0) {
    environment.ground.reset();
  } else {
    if (!environment.ground) environment.ground.emplace();
    environment.ground->height = given.ground_height;
    environment.ground->colour = colour_of(given.ground_colour);
  }
  if (given.has_fog == 0) {
    environment.fog.reset();
  } else {
    if (!environment.fog) environment.fog.emplace();
    environment.fog->density = given.fog_density;
    environment.fog->top = given.fog_top;
    environment.fog->colour = colour_of(given.fog_colour);
    environment.fog->anisotropy = given.fog_anisotropy;
  }
  return check(environment);
}

/// Returns the sun of the scene, or of its file's render settings; null if there is none.
const Sun* sun_of(const LoadedScene& loaded) {
  if (loaded.scene.environment) return &loaded.scene.environment->sun;
  return loaded.render_settings ? &loaded.render_settings->environment.sun : nullptr;
}

}  // namespace
}  // namespace quoin::c

using namespace quoin;
using namespace quoin::c;

quoin_status quoin_instance_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out, [](SceneBody& body) { return body.numbers.instances.size(); });
}

quoin_status quoin_instance_get(quoin_scene scene, std::size_t index, quoin_instance* out) {
  const auto count = [](SceneBody& body) { return body.numbers.instances.size(); };
  return report_item(scene, index, out, count, [&](SceneBody& body, quoin_instance& instance) {
    describe(body, body.loaded.scene.instances()[body.numbers.instances[index]], instance);
  });
}

quoin_status quoin_instance_add(quoin_scene scene, const quoin_instance* instance, std::size_t* out) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(instance);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "instance is null, or its size");
    Instance placed;
    if (const char* wrong = put(body, *given, placed)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    body.numbers.instances.push_back(body.loaded.scene.add_instance(std::move(placed)));
    if (out != nullptr) *out = body.numbers.instances.size() - 1;
    return QUOIN_OK;
  });
}

quoin_status quoin_instance_set(quoin_scene scene, std::size_t index, const quoin_instance* instance) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(instance);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "instance is null, or its size");
    if (index >= body.numbers.instances.size()) return fail(QUOIN_INVALID_ARGUMENT, "no instance has this number");
    const InstanceHandle handle = body.numbers.instances[index];
    Instance placed = body.loaded.scene.instances()[handle];
    if (const char* wrong = put(body, *given, placed)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    body.loaded.scene.edit(handle) = std::move(placed);
    return QUOIN_OK;
  });
}

quoin_status quoin_group_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out, [](SceneBody& body) { return body.numbers.groups.size(); });
}

quoin_status quoin_group_get(quoin_scene scene, std::size_t number, quoin_group* out) {
  const auto count = [](SceneBody& body) { return body.numbers.groups.size(); };
  return report_item(scene, number - 1, out, count, [&](SceneBody& body, quoin_group& group) {
    const Scene& all = body.loaded.scene;
    const GroupHandle handle = body.numbers.groups[number - 1];
    const SceneGroup& found = all.groups()[handle];
    copy_text(found.name, group.name);
    group.parent = number_of(body, parent_of(all, handle));
    group.shown = is_shown(all, found) ? 1 : 0;
    copy_text(layer_of(all, found.layer), group.layer);
    group.unsaved = found.saved ? 0 : 1;
  });
}

quoin_status quoin_camera_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out, [](SceneBody& body) { return cameras_of(body.loaded).size(); });
}

quoin_status quoin_camera_get(quoin_scene scene, std::size_t index, quoin_camera* out) {
  const auto count = [](SceneBody& body) { return cameras_of(body.loaded).size(); };
  return report_item(scene, index, out, count,
                     [&](SceneBody& body, quoin_camera& camera) { camera = cameras_of(body.loaded)[index]; });
}

quoin_status quoin_lamp_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out, [](SceneBody& body) { return body.loaded.scene.lamps.size(); });
}

quoin_status quoin_lamp_get(quoin_scene scene, std::size_t index, quoin_lamp* out) {
  const auto count = [](SceneBody& body) { return body.loaded.scene.lamps.size(); };
  return report_item(scene, index, out, count, [&](SceneBody& body, quoin_lamp& lamp) {
    const Lamp& found = body.loaded.scene.lamps[index];
    copy_text(found.name, lamp.name);
    lamp.is_spot = found.kind == Lamp::Kind::Spot ? 1 : 0;
    copy(found.position, lamp.position);
    copy(found.direction, lamp.direction);
    for (int channel = 0; channel < 3; ++channel) lamp.colour[channel] = found.colour[channel];
    lamp.intensity = found.intensity;
    lamp.range = found.range;
    lamp.inner_angle_degrees = found.inner_angle_radians * kDegrees;
    lamp.outer_angle_degrees = found.outer_angle_radians * kDegrees;
  });
}

quoin_status quoin_scene_get_info(quoin_scene scene, quoin_scene_info* out) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    quoin_scene_info info{};
    copy_text(body.loaded.format, info.format);
    const DBox box = body.loaded.scene.bounds();
    if (!box.empty()) {
      copy(box.min, info.min);
      copy(box.max, info.max);
    }
    const std::optional<Environment>& environment = body.loaded.scene.environment;
    info.has_sun = environment && environment->sun.brightness > 0.0 ? 1 : 0;
    if (info.has_sun != 0) copy(environment->sun.direction, info.sun);
    info.last_frame = body.loaded.last_frame;
    return report(info, out);
  });
}

quoin_status quoin_format_count(std::size_t* out) {
  return guarded([&] {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    *out = file_formats().size();
    return QUOIN_OK;
  });
}

quoin_status quoin_format_get(std::size_t index, quoin_format* out) {
  return guarded([&] {
    if (index >= file_formats().size()) return fail(QUOIN_INVALID_ARGUMENT, "no format has this number");
    const FormatInfo& found = file_formats()[index];
    quoin_format format{};
    copy_text(found.name(), format.name);
    std::string extensions(found.extension);
    if (!found.also.empty()) extensions.append(1, ' ').append(found.also);
    copy_text(extensions, format.extensions);
    copy_text(found.description, format.description);
    format.readable = found.can(FormatCapability::Read) ? 1 : 0;
    format.writable = found.can(FormatCapability::Write) ? 1 : 0;
    format.is_mesh = found.can(FormatCapability::Meshes) ? 1 : 0;
    return report(format, out);
  });
}

quoin_status quoin_layer_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out, [](SceneBody& body) { return body.loaded.scene.layers().size(); });
}

quoin_status quoin_layer_get(quoin_scene scene, std::size_t index, quoin_layer* out) {
  const auto count = [](SceneBody& body) { return body.loaded.scene.layers().size(); };
  return report_item(scene, index, out, count, [&](SceneBody& body, quoin_layer& layer) {
    const auto& layers = body.loaded.scene.layers();
    const SceneLayer& found = layers[layers.handles()[index]];
    copy_text(found.name, layer.name);
    layer.visible = found.visible ? 1 : 0;
  });
}

quoin_status quoin_layer_set(quoin_scene scene, const quoin_layer* layer) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(layer);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "layer is null, or its size");
    const std::string name = text_in(given->name);
    if (name.empty()) return fail(QUOIN_INVALID_ARGUMENT, "a layer needs a name");
    Scene& all = body.loaded.scene;
    if (const auto known = layer_named(all, name))
      all.edit(*known).visible = given->visible != 0;
    else
      all.add_layer({name, given->visible != 0});
    return QUOIN_OK;
  });
}

quoin_status quoin_instance_set_layer(quoin_scene scene, std::size_t index, const char* layer) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    if (index >= body.numbers.instances.size()) return fail(QUOIN_INVALID_ARGUMENT, "no instance has this number");
    const auto found = layer_named(body.loaded.scene, layer == nullptr ? "" : layer);
    if (!found) return fail(QUOIN_INVALID_ARGUMENT, kNoLayer);
    body.loaded.scene.edit(body.numbers.instances[index]).layer = *found;
    return QUOIN_OK;
  });
}

quoin_status quoin_group_add(quoin_scene scene, const quoin_group* group, std::size_t* out) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(group);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "group is null, or its size");
    auto& groups = body.numbers.groups;
    if (given->parent > groups.size()) return fail(QUOIN_INVALID_ARGUMENT, "no group has the parent's number");
    const auto layer = layer_named(body.loaded.scene, text_in(given->layer));
    if (!layer) return fail(QUOIN_INVALID_ARGUMENT, kNoLayer);
    SceneGroup made;
    made.name = text_in(given->name);
    made.visible = given->shown != 0;
    made.saved = given->unsaved == 0;
    made.layer = *layer;
    if (given->parent != 0) made.parent = groups[given->parent - 1];
    groups.push_back(body.loaded.scene.add_group(std::move(made)));
    body.numbers.group_of_slot[groups.back().index] = groups.size();
    if (out != nullptr) *out = groups.size();
    return QUOIN_OK;
  });
}

quoin_status quoin_camera_add(quoin_scene scene, const quoin_camera* camera) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(camera);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "camera is null, or its size");
    FileCamera made;
    if (const char* wrong = take(*given, body.loaded, made)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    body.loaded.cameras.push_back(made);
    if (given->is_first != 0) body.loaded.camera = made.camera;
    return QUOIN_OK;
  });
}

quoin_status quoin_lamp_add(quoin_scene scene, const quoin_lamp* lamp) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(lamp);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "lamp is null, or its size");
    Lamp made;
    if (const char* wrong = take(*given, made)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    body.loaded.scene.lamps.push_back(std::move(made));
    return QUOIN_OK;
  });
}

quoin_status quoin_sun_get(quoin_scene scene, quoin_sun* out) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    quoin_sun sun{};
    if (const Sun* const found = sun_of(body.loaded)) {
      for (int axis = 0; axis < 3; ++axis) {
        sun.direction[axis] = found->direction[axis];
        sun.colour[axis] = found->colour[axis];
      }
      sun.brightness = found->brightness;
      sun.angle_degrees = found->angle_radians * kDegrees;
    }
    return report(sun, out);
  });
}

quoin_status quoin_sun_set(quoin_scene scene, const quoin_sun* sun) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(sun);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "sun is null, or its size");
    LoadedScene& loaded = body.loaded;
    Sun wanted;
    if (const Sun* const before = sun_of(loaded)) wanted = *before;
    if (const char* wrong = take(*given, wanted)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    if (!loaded.scene.environment) loaded.scene.environment = Environment::natural();
    loaded.scene.environment->sun = wanted;
    if (loaded.render_settings) loaded.render_settings->environment.sun = wanted;
    return QUOIN_OK;
  });
}

quoin_status quoin_environment_get(quoin_scene scene, quoin_environment* out) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    quoin_environment environment{};
    describe(body.loaded.scene.environment.value_or(Environment::natural()), environment);
    return report(environment, out);
  });
}

quoin_status quoin_environment_set(quoin_scene scene, const quoin_environment* environment) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    std::optional<Environment>& of_scene = body.loaded.scene.environment;
    if (environment == nullptr) {
      of_scene.reset();
      return QUOIN_OK;
    }
    const auto given = taken(environment);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "the size of the environment");
    Environment wanted = of_scene.value_or(Environment::natural());
    if (Status right = take(*given, wanted); !right) return fail(right.error());
    of_scene = std::move(wanted);
    return QUOIN_OK;
  });
}
