// Scenes and their grids.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <quoin/grid/connected.h>
#include <quoin/grid/mass.h>
#include <quoin/io/formats.h>
#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/version.h>

#include "handles.h"

namespace quoin::c {
namespace {

thread_local std::string last_error;
constexpr std::int64_t kFurthestVoxel = 1 << 30;  // of a voxel from its grid's origin

thread_local Progress listener;

quoin_status give(Result<LoadedScene> loaded, quoin_scene* out) {
  if (!loaded) return fail(loaded.error());
  auto body = std::make_shared<SceneBody>();
  body->loaded = std::move(*loaded);
  number(*body);
  *out = handles().put(std::move(body));
  return QUOIN_OK;
}

bool is_in_range(const std::int32_t min[3], const std::int32_t shape[3]) {
  for (int axis = 0; axis < 3; ++axis) {
    if (shape[axis] < 0 || std::abs(std::int64_t{min[axis]}) + shape[axis] > kFurthestVoxel) return false;
  }
  return true;
}

VoxelType type_at(const quoin_array& array, std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto* at =
      static_cast<const std::byte*>(array.data) + x * array.strides[0] + y * array.strides[1] + z * array.strides[2];
  if (array.scalar == QUOIN_UINT8) return static_cast<VoxelType>(*at);
  VoxelType type = kAir;
  std::memcpy(&type, at, sizeof type);
  return type;
}

std::uint32_t state_at(const quoin_array& array, std::int64_t x, std::int64_t y, std::int64_t z) {
  if (array.scalar != QUOIN_UINT32) return type_at(array, x, y, z);
  std::uint32_t state = 0;
  std::memcpy(
      &state,
      static_cast<const std::byte*>(array.data) + x * array.strides[0] + y * array.strides[1] + z * array.strides[2],
      sizeof state);
  return state;
}

enum class Holds : std::uint8_t { Types, States };

const char* validate_array(const quoin_array& array, Holds holds = Holds::Types) {
  if (array.data == nullptr) return "the array's data is null";
  const bool is_small = array.scalar == QUOIN_UINT8 || array.scalar == QUOIN_UINT16;
  if (holds == Holds::Types && !is_small) return "an array of types must be QUOIN_UINT8 or QUOIN_UINT16";
  if (holds == Holds::States && !is_small && array.scalar != QUOIN_UINT32)
    return "an array of states must be QUOIN_UINT8, QUOIN_UINT16 or QUOIN_UINT32";
  for (int axis = 0; axis < 3; ++axis) {
    if (array.shape[axis] <= 0 || array.shape[axis] > kFurthestVoxel) return "the array's shape is out of range";
    if (!(std::abs(array.origin[axis]) < static_cast<double>(kFurthestVoxel) / 2.0))
      return "the array's origin is out of range";
    if (std::abs(array.origin[axis]) + static_cast<double>(array.shape[axis]) > static_cast<double>(kFurthestVoxel))
      return "the array extends out of range";
  }
  return nullptr;
}

// Reports an array that contains a type which the scene lacks.
quoin_status fail_of_type(VoxelType type, std::size_t types) {
  return fail(QUOIN_INVALID_ARGUMENT, ("the array has the type " + std::to_string(type) +
                                       "; those of the scene are 0 to " + std::to_string(types - 1))
                                          .c_str());
}

quoin_status add_grid(SceneBody& scene, const quoin_array& array, const char* name, size_t* out) {
  const IVec3 size(array.shape[0], array.shape[1], array.shape[2]);
  const std::size_t types = scene.loaded.scene.types.size();
  VoxelType greatest = kAir;
  bool is_wanted = true;
  SceneGrid placed;
  placed.name = name == nullptr ? "" : name;
  const Progress on_progress = progress();
  placed.grid.edit_rows(
      {IVec3(0), size},
      [&](IVec3 first, std::span<VoxelType> row) {
        if (greatest >= types) return;
        for (VoxelType& type : row) {
          type = type_at(array, first.x++, first.y, first.z);
          greatest = std::max(greatest, type);
        }
      },
      [&](double fraction) {
        is_wanted = is_wanted && (!on_progress || on_progress(fraction));
        return is_wanted && greatest < types;
      });
  if (!is_wanted) return fail(QUOIN_CANCELLED, "cancelled");
  if (greatest >= types) return fail_of_type(greatest, types);
  place(scene, std::move(placed), floor(DVec3(array.origin[0], array.origin[1], array.origin[2])), out);
  return QUOIN_OK;
}

// Check all types first: if the scene lacks one, nothing changes.
quoin_status write_grid(SceneBody& scene, GridHandle grid, const quoin_array& array) {
  const DVec3 origin = floor(DVec3(array.origin[0], array.origin[1], array.origin[2]));
  const IVec3 min(origin);
  const IVec3 size(array.shape[0], array.shape[1], array.shape[2]);
  const std::size_t types = scene.loaded.scene.types.size();
  for (std::int64_t x = 0; x < size.x; ++x) {
    for (std::int64_t y = 0; y < size.y; ++y) {
      for (std::int64_t z = 0; z < size.z; ++z) {
        if (const VoxelType type = type_at(array, x, y, z); type >= types) return fail_of_type(type, types);
      }
    }
  }
  scene.loaded.scene.edit(grid).grid.edit_rows({min, min + size}, [&](IVec3 first, std::span<VoxelType> row) {
    IVec3 at = first - min;
    for (VoxelType& type : row) type = type_at(array, at.x++, at.y, at.z);
  });
  return QUOIN_OK;
}

// Check all states first: if a type lacks the bits of one, nothing changes. If memory runs out, nothing changes either.
quoin_status write_states(SceneBody& scene, GridHandle handle, const quoin_array& array) {
  const VoxelRegistry& types = scene.loaded.scene.types;
  const Grid& before = scene.loaded.scene.grids()[handle].grid;
  const IVec3 min(floor(DVec3(array.origin[0], array.origin[1], array.origin[2])));
  std::vector<std::pair<IVec3, std::uint32_t>> changes;
  GridReader reader(before);
  for (std::int64_t z = 0; z < array.shape[2]; ++z) {
    for (std::int64_t y = 0; y < array.shape[1]; ++y) {
      for (std::int64_t x = 0; x < array.shape[0]; ++x) {
        const IVec3 voxel = min + IVec3(x, y, z);
        const VoxelType type = reader.get(voxel.x, voxel.y, voxel.z);
        if (type == kAir) continue;
        const std::uint32_t state = state_at(array, x, y, z);
        const int bits = type < types.size() ? types[type].state_bits : 0;
        if (bits < kMaxStateBits && state >> bits != 0) {
          return fail(QUOIN_INVALID_ARGUMENT, ("the array has the state " + std::to_string(state) + ", but type " +
                                               std::to_string(type) + " has " + std::to_string(bits) + " state bits")
                                                  .c_str());
        }
        if (before.data(voxel).state != state) changes.emplace_back(voxel, state);
      }
    }
  }
  if (changes.empty()) return QUOIN_OK;
  Grid& grid = scene.loaded.scene.edit(handle).grid;
  Grid unchanged = grid.snapshot();
  try {
    for (const auto& [voxel, state] : changes)
      grid.set(voxel, grid.get(voxel), {.state = state, .bytes = grid.data(voxel).bytes});
  } catch (...) {
    grid = std::move(unchanged);
    throw;
  }
  return QUOIN_OK;
}

// Calls `write(index, x, y, z)` for each voxel of a box, in the order x, y, z of the grid: `index` is that of an array
// whose slowest axis is x. Fails if the array is too small.
template <class Write>
quoin_status read_box(const std::int32_t min[3], const std::int32_t shape[3], std::size_t capacity, Write&& write) {
  if (!is_in_range(min, shape)) return fail(QUOIN_INVALID_ARGUMENT, "the box is out of range");
  std::size_t left = capacity;
  for (int axis = 0; axis < 3; ++axis) {
    if (shape[axis] == 0) return QUOIN_OK;
    left /= static_cast<std::size_t>(shape[axis]);
  }
  if (left == 0) return fail(QUOIN_INVALID_ARGUMENT, "the array is too small for the box");
  // x is the array's slowest axis but the grid's fastest: read whole runs along x.
  const auto plane = static_cast<std::size_t>(shape[1]) * static_cast<std::size_t>(shape[2]);
  for (std::int32_t z = 0; z < shape[2]; ++z) {
    for (std::int32_t y = 0; y < shape[1]; ++y) {
      std::size_t to = static_cast<std::size_t>(y) * static_cast<std::size_t>(shape[2]) + static_cast<std::size_t>(z);
      for (std::int32_t x = 0; x < shape[0]; ++x, to += plane) write(to, min[0] + x, min[1] + y, min[2] + z);
    }
  }
  return QUOIN_OK;
}

quoin_status save(SceneBody& scene, const char* path) {
  scene.save_warnings.clear();
  const auto format = format_for_writing(path);
  if (!format) return fail(format.error());
  if (!format->can(FormatCapability::Meshes)) {
    auto saved = save_scene(scene.loaded, path, {}, progress());
    if (!saved) return fail(saved.error());
    scene.save_warnings = std::move(saved->warnings);
    return QUOIN_OK;
  }
  constexpr double kMeshed = 0.5;
  const Progress whole = progress();
  const auto meshes = mesh_scene(near_grids(scene.loaded.scene), {}, {}, part_of(whole, 0.0, kMeshed));
  if (!meshes) return fail(meshes.error());
  const auto written = write_mesh(*meshes, path, {}, part_of(whole, kMeshed, 1.0));
  return written ? QUOIN_OK : fail(written.error());
}

bool is_raw(const quoin_load_options& options) {
  return options.raw_shape[0] != 0 || options.raw_shape[1] != 0 || options.raw_shape[2] != 0;
}

HeightOptions heights_of(const quoin_load_options& given) {
  HeightOptions heights;
  heights.encoding = static_cast<HeightEncoding>(given.heights - QUOIN_HEIGHTS_GREY);
  if (given.metres_per_level != 0.0) heights.metres_per_level = given.metres_per_level;
  if (given.metres_per_pixel != 0.0) heights.metres_per_pixel = given.metres_per_pixel;
  if (given.metres_per_voxel != 0.0) heights.metres_per_voxel = given.metres_per_voxel;
  if (given.exaggeration != 0.0) heights.vertical_exaggeration = given.exaggeration;
  if (given.ground_depth != 0) heights.depth = given.ground_depth;
  heights.as_field = given.smooth_ground != 0;
  return heights;
}

LoadOptions options_of(const quoin_load_options& given) {
  LoadOptions options;
  options.show_hidden = given.show_hidden != 0;
  options.frame = given.frame;
  if (given.radius != 0) options.radius = given.radius;
  if (given.has_iso != 0) options.iso = given.iso;
  if (given.mesh_voxels != 0) options.mesh.size = given.mesh_voxels;
  if (given.voxel_size != 0.0) options.mesh.voxel_size = given.voxel_size;
  if (is_raw(given)) {
    options.raw = RawVolume{{given.raw_shape[0], given.raw_shape[1], given.raw_shape[2]},
                            static_cast<ScalarType>(given.raw_scalar),
                            given.raw_big_endian != 0 ? std::endian::big : std::endian::little};
  }
  if (given.heights != QUOIN_HEIGHTS_NONE) options.heights = heights_of(given);
  if (given.allow_outside_files != 0) options.sidecar_files = SidecarFiles::Anywhere;
  if (given.dimension != nullptr) options.dimension = given.dimension;
  for (std::size_t i = 0; i < given.pack_count; ++i) options.packs.emplace_back(given.packs[i]);
  for (std::size_t i = 0; i < given.pack_zip_count; ++i) {
    const auto* const first = static_cast<const std::byte*>(given.pack_zips[i]);
    options.pack_zips.emplace_back(first, first + given.pack_zip_bytes[i]);
  }
  options.scene_packs = given.ignore_scene_packs == 0;
  return options;
}

const char* validate_heights(const quoin_load_options& options) {
  if (options.heights < QUOIN_HEIGHTS_NONE || options.heights > QUOIN_HEIGHTS_TERRARIUM)
    return "heights is not a quoin_heights value";
  // The reader checks their combination and the ground's depth.
  for (const double amount :
       {options.metres_per_level, options.metres_per_pixel, options.metres_per_voxel, options.exaggeration}) {
    if (!std::isfinite(amount)) return "a height map value is not finite";
    if (amount != 0.0 && options.heights == QUOIN_HEIGHTS_NONE)
      return "a height map value is set, but heights is QUOIN_HEIGHTS_NONE";
  }
  const bool has_ground = options.ground_depth != 0 || options.smooth_ground != 0;
  return has_ground && options.heights == QUOIN_HEIGHTS_NONE
             ? "ground_depth or smooth_ground is set, but heights is QUOIN_HEIGHTS_NONE"
             : nullptr;
}

const char* validate_packs(const quoin_load_options& options) {
  constexpr std::size_t kMost = 1'024;
  if (options.pack_count > kMost || options.pack_zip_count > kMost) return "more than 1,024 packs";
  if (options.pack_count > 0 && options.packs == nullptr) return "packs is null";
  for (std::size_t i = 0; i < options.pack_count; ++i) {
    if (options.packs[i] == nullptr || *options.packs[i] == '\0') return "the path of a pack is null or empty";
  }
  if (options.pack_zip_count > 0 && (options.pack_zips == nullptr || options.pack_zip_bytes == nullptr))
    return "pack_zips or pack_zip_bytes is null";
  for (std::size_t i = 0; i < options.pack_zip_count; ++i) {
    if (options.pack_zips[i] == nullptr && options.pack_zip_bytes[i] > 0) return "the bytes of a pack are null";
  }
  return nullptr;
}

const char* validate_load_options(const quoin_load_options& options) {
  if (options.frame < 0 || options.radius < 0 || options.radius > 1'024) return "frame or radius is out of range";
  if (options.has_iso != 0 && !std::isfinite(options.iso)) return "iso is not finite";
  if (options.mesh_voxels < 0 || !(options.voxel_size >= 0.0) || !std::isfinite(options.voxel_size))
    return "mesh_voxels or voxel_size is out of range";
  if (options.mesh_voxels != 0 && options.voxel_size != 0.0) return "both mesh_voxels and voxel_size are set";
  if (options.raw_scalar < QUOIN_UINT8 || options.raw_scalar > QUOIN_FLOAT64) return "no scalar has this number";
  if (is_raw(options) && options.heights != QUOIN_HEIGHTS_NONE) return "both raw_shape and heights are set";
  if (const char* const fault = validate_packs(options)) return fault;
  return validate_heights(options);
}

// The densities of voxel types that a caller gives; null: 1 for all.
struct Densities {
  const double* of_type;
  std::size_t count;

  [[nodiscard]] bool are_valid() const {
    return of_type == nullptr ||
           std::all_of(of_type, of_type + count, [](double x) { return std::isfinite(x) && x >= 0.0; });
  }
  double operator()(VoxelType type) const { return of_type == nullptr ? 1.0 : type < count ? of_type[type] : 0.0; }
};
constexpr const char* kInvalidDensities = "a density is negative or not finite";

quoin_body body_of(const MassProperties& mass, const IBox& box, std::int64_t voxels) {
  quoin_body body{};
  body.mass = mass.mass;
  body.voxels = voxels;
  for (int row = 0; row < 3; ++row) {
    body.centre[row] = mass.centre[row];
    for (int column = 0; column < 3; ++column) body.inertia[3 * row + column] = mass.inertia[column][row];
    body.extent[row] = std::max(box.max[row] - box.min[row], 0);
    body.min[row] = body.extent[row] > 0 ? box.min[row] : 0;
  }
  return body;
}

}  // namespace

Handles& handles() {
  static auto* const all = new Handles();  // never destroyed: other threads may still call while the process ends
  return *all;
}

quoin_status fail(quoin_status status, const char* why) noexcept {
  try {
    last_error = why;
  } catch (...) {
    last_error.clear();
  }
  return status;
}

quoin_status fail(const Error& error) {
  return fail(static_cast<quoin_status>(static_cast<int>(error.code) + 1), to_string(error).c_str());
}

std::optional<quoin_array> taken_array(const quoin_array* given) {
  auto array = taken(given);
  if (!array || array->strides[0] != 0 || array->strides[1] != 0 || array->strides[2] != 0) return array;
  if (array->scalar < QUOIN_UINT8 || array->scalar > QUOIN_FLOAT64) return array;
  auto stride = static_cast<std::int64_t>(size_of(static_cast<ScalarType>(array->scalar)));
  for (int axis = 2; axis >= 0; --axis) {
    array->strides[axis] = stride;
    // The reader checks the shape.
    if (array->shape[axis] <= 0 || stride > std::numeric_limits<std::int64_t>::max() / array->shape[axis]) break;
    stride *= array->shape[axis];
  }
  return array;
}

Progress progress() {
  return listener;
}

Threads threads_of(std::int32_t count) {
  return {static_cast<unsigned>(std::clamp(count, 0, 1024))};
}

void number(SceneBody& scene) {
  scene.numbers.grids = scene.loaded.scene.grids().handles();
  scene.numbers.instances = scene.loaded.scene.instances().handles();
  scene.numbers.groups = groups_from_top(scene.loaded.scene);
  for (std::size_t i = 0; i < scene.numbers.grids.size(); ++i)
    scene.numbers.grid_of_slot.emplace(scene.numbers.grids[i].index, i);
  for (std::size_t i = 0; i < scene.numbers.groups.size(); ++i)
    scene.numbers.group_of_slot.emplace(scene.numbers.groups[i].index, i + 1);
}

void place(SceneBody& scene, SceneGrid grid, DVec3 position, std::size_t* out) {
  Instance instance;
  instance.name = grid.name;
  instance.position = position;
  instance.grid = scene.loaded.scene.add_grid(std::move(grid));
  scene.numbers.grid_of_slot.emplace(instance.grid.index, scene.numbers.grids.size());
  scene.numbers.grids.push_back(instance.grid);
  scene.numbers.instances.push_back(scene.loaded.scene.add_instance(std::move(instance)));
  if (out != nullptr) *out = scene.numbers.grids.size() - 1;
}

Result<LoadOptions> load_options_of(const quoin_load_options* given) {
  const auto whole = taken_or_default(given);
  if (!whole) return make_error(ErrorCode::InvalidArgument, "the size of the options");
  if (const char* wrong = validate_load_options(*whole)) return make_error(ErrorCode::InvalidArgument, wrong);
  return options_of(*whole);
}

void copy_text(std::string_view text, char* to, std::size_t capacity) {
  std::size_t length = std::min(text.size(), capacity - 1);
  while (length < text.size() && length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U) --length;
  std::memcpy(to, text.data(), length);
  to[length] = '\0';
}

}  // namespace quoin::c

using namespace quoin;
using namespace quoin::c;

const char* quoin_version(void) {
  return version().data();
}

const char* quoin_last_error(void) {
  return last_error.c_str();
}

quoin_status quoin_free(std::uint64_t handle) {
  return guarded([&] {
    return handle == 0 || handles().remove(handle)
               ? QUOIN_OK
               : fail(QUOIN_BAD_HANDLE, "no scene, mesh or textures have this handle");
  });
}

quoin_status quoin_scene_create(quoin_scene* out) {
  return guarded(
      [&] { return out == nullptr ? fail(QUOIN_INVALID_ARGUMENT, "out is null") : give(LoadedScene{}, out); });
}

quoin_status quoin_scene_load(const char* path, quoin_scene* out) {
  return quoin_scene_load_with(path, nullptr, out);
}

quoin_status quoin_scene_load_bytes(const void* data, std::size_t bytes, quoin_scene* out) {
  return quoin_scene_load_bytes_with(data, bytes, nullptr, out);
}

quoin_status quoin_scene_load_with(const char* path, const quoin_load_options* options, quoin_scene* out) {
  return guarded([&] {
    if (path == nullptr || out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "path or out is null");
    const auto wanted = load_options_of(options);
    if (!wanted) return fail(wanted.error());
    const Threads threads = threads_of(options == nullptr ? 0 : options->threads);
    return give(load_scene(std::filesystem::path(path), *wanted, threads, progress()), out);
  });
}

quoin_status quoin_scene_load_bytes_with(const void* data, std::size_t bytes, const quoin_load_options* options,
                                         quoin_scene* out) {
  return guarded([&] {
    if ((data == nullptr && bytes > 0) || out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "data or out is null");
    const auto wanted = load_options_of(options);
    if (!wanted) return fail(wanted.error());
    const Threads threads = threads_of(options == nullptr ? 0 : options->threads);
    return give(load_scene(std::span(static_cast<const std::byte*>(data), bytes), *wanted, threads, progress()), out);
  });
}

quoin_status quoin_set_progress(quoin_progress progress, void* user) {
  return guarded([&] {
    listener = nullptr;
    if (progress != nullptr) listener = [progress, user](double fraction) { return progress(fraction, user) != 0; };
    return QUOIN_OK;
  });
}

quoin_status quoin_scene_save(quoin_scene scene, const char* path) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    return path == nullptr ? fail(QUOIN_INVALID_ARGUMENT, "path is null") : save(body, path);
  });
}

quoin_status quoin_scene_warning_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out,
                      [](SceneBody& body) { return body.loaded.warnings.size() + body.save_warnings.size(); });
}

quoin_status quoin_scene_warning(quoin_scene scene, std::size_t index, char* text, std::size_t capacity) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (text == nullptr || capacity == 0) return fail(QUOIN_INVALID_ARGUMENT, "text is null, or capacity is 0");
    const std::size_t made = body.loaded.warnings.size();
    if (index >= made + body.save_warnings.size()) return fail(QUOIN_INVALID_ARGUMENT, "no warning has this number");
    copy_text(index < made ? body.loaded.warnings[index] : body.save_warnings[index - made], text, capacity);
    return QUOIN_OK;
  });
}

quoin_status quoin_grid_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out, [](SceneBody& body) { return body.numbers.grids.size(); });
}

quoin_status quoin_grid_get_info(quoin_scene scene, std::size_t grid, quoin_grid_info* out) {
  const auto count = [](SceneBody& body) { return body.numbers.grids.size(); };
  return report_item(scene, grid, out, count, [&](SceneBody& body, quoin_grid_info& info) {
    const SceneGrid& found = body.loaded.scene.grids()[body.numbers.grids[grid]];
    const IBox box = found.bounds();
    copy_text(found.name, info.name);
    info.voxels = found.grid.voxel_count();
    for (int axis = 0; axis < 3; ++axis) {
      info.extent[axis] = std::max(box.max[axis] - box.min[axis], 0);
      info.min[axis] = info.extent[axis] > 0 ? box.min[axis] : 0;
      info.pivot[axis] = found.pivot[axis];
    }
    info.has_field = found.field.bounds().empty() ? 0 : 1;
    info.unsaved = found.saved ? 0 : 1;
    info.whole = found.whole ? 1 : 0;
  });
}

quoin_status quoin_grid_set_storage(quoin_scene scene, std::size_t grid, std::int32_t unsaved, std::int32_t whole) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    SceneGrid& edited = body.loaded.scene.edit(body.numbers.grids[grid]);
    edited.saved = unsaved == 0;
    edited.whole = whole != 0;
    return QUOIN_OK;
  });
}

quoin_status quoin_grid_read(quoin_scene scene, std::size_t grid, const std::int32_t min[3],
                             const std::int32_t shape[3], std::uint16_t* out, std::size_t capacity) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (min == nullptr || shape == nullptr || out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "an array is null");
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    GridReader reader(body.loaded.scene.grids()[body.numbers.grids[grid]].grid);
    return read_box(min, shape, capacity, [&](std::size_t to, int x, int y, int z) { out[to] = reader.get(x, y, z); });
  });
}

quoin_status quoin_grid_read_states(quoin_scene scene, std::size_t grid, const std::int32_t min[3],
                                    const std::int32_t shape[3], std::uint32_t* out, std::size_t capacity) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (min == nullptr || shape == nullptr || out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "an array is null");
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    const Grid& from = body.loaded.scene.grids()[body.numbers.grids[grid]].grid;
    const bool has_data = from.data_count() > 0;
    return read_box(min, shape, capacity, [&](std::size_t to, int x, int y, int z) {
      out[to] = has_data ? from.data({x, y, z}).state : 0;
    });
  });
}

quoin_status quoin_grid_body(quoin_scene scene, std::size_t grid, const double* densities, std::size_t count,
                             quoin_body* out) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    const Densities density{densities, count};
    if (!density.are_valid()) return fail(QUOIN_INVALID_ARGUMENT, kInvalidDensities);
    const SceneGrid& found = body.loaded.scene.grids()[body.numbers.grids[grid]];
    const IBox solid = found.field.bounds();
    return report(solid.empty()
                      ? body_of(mass_properties(found.grid, density), found.grid.bounds(), found.grid.voxel_count())
                      : body_of(mass_properties(found.field, density), solid, 0),
                  out);
  });
}

quoin_status quoin_grid_pieces(quoin_scene scene, std::size_t grid, const double* densities, std::size_t count,
                               quoin_body* out, std::size_t capacity, std::size_t* pieces) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (pieces == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "pieces is null");
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    const Densities density{densities, count};
    if (!density.are_valid()) return fail(QUOIN_INVALID_ARGUMENT, kInvalidDensities);
    if (capacity != 0 && !has_fit_size(out)) return fail(QUOIN_INVALID_ARGUMENT, "out is null, or its size");
    ConnectedPieces found;
    found.update(body.loaded.scene.grids()[body.numbers.grids[grid]].grid);
    const std::size_t size = capacity == 0 ? 0 : out->size;
    for (std::size_t i = 0; i < std::min(capacity, found.size()); ++i) {
      const ConnectedPiece& piece = found.pieces()[i];
      quoin_body whole = body_of(mass_properties(found, i, density), piece.box, piece.voxels);
      whole.size = size;
      for (int axis = 0; axis < 3; ++axis) whole.first[axis] = piece.first[axis];
      std::memcpy(reinterpret_cast<std::byte*>(out) + i * size, &whole, size);
    }
    *pieces = found.size();
    return QUOIN_OK;
  });
}

quoin_status quoin_grid_add(quoin_scene scene, const quoin_array* array, const char* name, std::size_t* out) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken_array(array);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "array is null, or its size");
    if (const char* wrong = validate_array(*given)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    return add_grid(body, *given, name, out);
  });
}

quoin_status quoin_grid_write(quoin_scene scene, std::size_t grid, const quoin_array* array) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken_array(array);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "array is null, or its size");
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    if (const char* wrong = validate_array(*given)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    return write_grid(body, body.numbers.grids[grid], *given);
  });
}

quoin_status quoin_grid_write_states(quoin_scene scene, std::size_t grid, const quoin_array* array) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken_array(array);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "array is null, or its size");
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    if (const char* wrong = validate_array(*given, Holds::States)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    return write_states(body, body.numbers.grids[grid], *given);
  });
}
