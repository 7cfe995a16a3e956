// Turns any bytes into a program of calls. Every call must return a status and leave the library usable.
//
// The calls keep the header's contract: memory is as large as shapes and strides require. Paths name no file.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "quoin.h"
#include "structs_for_tests.h"

namespace {

constexpr std::size_t kRoom = 1 << 14;  // bytes of memory for arrays
constexpr int kMostCalls = 48;
constexpr std::uint8_t kTextures = 250;  // the byte of calls for textures
constexpr std::uint8_t kShapes = 249;    // the byte of calls for shapes, orientations and states
constexpr std::uint8_t kLater = 251;     // the first byte of calls that were added later
constexpr int kMostLongCalls = 1;        // the slowest calls: smooth voxels, path-traced images, maps of 2^24 voxels

class Program {
 public:
  Program(const std::uint8_t* data, std::size_t size) : next_(data), end_(data + size) {
    for (std::size_t i = 0; i < room_.size(); ++i) room_[i] = static_cast<std::uint8_t>((i * 37 >> 5) % 3);
    begin();
  }
  ~Program() {
    for (const std::uint64_t handle : handles_) quoin_free(handle);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void run() {
    for (int call = 0; call < kMostCalls && next_ != end_; ++call) step();
    quoin_set_progress(nullptr, nullptr);
  }

 private:
  // Creates a scene of two types and a grid for later calls.
  void begin() {
    quoin_scene scene = 0;
    took(quoin_scene_create(&scene), &scene);
    auto type = sized<quoin_type>();
    type.rgba[3] = 255;
    std::uint16_t number = 0;
    took(quoin_type_add(scene, &type, &number));
    type.rgba[3] = 99;
    took(quoin_type_add(scene, &type, &number));
    auto box = sized<quoin_array>();
    box.data = room_.data();
    for (int axis = 0; axis < 3; ++axis) {
      box.shape[axis] = 4;
      box.strides[axis] = 1 + 15 * axis;
    }
    took(quoin_grid_add(scene, &box, "box", nullptr));
  }

  std::uint8_t byte() { return next_ == end_ ? std::uint8_t{0} : *next_++; }
  bool bit() { return (byte() & 1U) != 0; }
  std::int32_t small() { return static_cast<std::int8_t>(byte()); }
  // Mostly a small index, sometimes any number.
  std::size_t index() {
    const std::uint8_t b = byte();
    return b < 240 ? b % 16 / 8 * (b % 8) : std::numeric_limits<std::size_t>::max() - (b - 240);
  }
  double number() {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr std::array<double, 12> kOdd = {kNan, kInfinity, -kInfinity, 1e308, -1e308, 1e-308,
                                             0.0,  -0.0,      0.5,        1.0,   1e9,    -1e18};
    const std::uint8_t b = byte();
    return b < 200 ? (b - 100) / 4.0 : kOdd.at(b % kOdd.size());
  }
  std::int64_t whole() {
    constexpr std::array<std::int64_t, 4> kFar = {std::numeric_limits<std::int64_t>::max(),
                                                  std::numeric_limits<std::int64_t>::min(), std::int64_t{1} << 31, -1};
    const std::uint8_t b = byte();
    return b < 200 ? b - 20 : kFar.at(b % kFar.size());
  }
  float single() {
    const double one = number();
    return std::isfinite(one) ? static_cast<float>(std::clamp(one, -3e38, 3e38)) : std::nanf("");
  }
  // Few, since starting many threads is slow.
  std::int32_t threads() { return small() % 4; }
  bool may_take_long() { return long_calls_++ < kMostLongCalls; }
  std::uint64_t handle() {
    const std::uint8_t b = byte();
    if (handles_.empty() || b > 250) return b;
    return handles_[b % handles_.size()];
  }
  template <class T>
  T made() {
    T one = sized<T>();
    if (byte() > 250) one.size = byte();
    return one;
  }
  template <class T>
  T* perhaps(T* one) {
    return byte() > 250 ? nullptr : one;
  }

  void took(quoin_status status) {
    if (status == QUOIN_OK) return;
    if (status > QUOIN_OK && status <= QUOIN_OUT_OF_MEMORY && quoin_last_error()[0] != '\0') return;
    std::fprintf(stderr, "status %d: %s\n", static_cast<int>(status), quoin_last_error());
    std::abort();  // also for QUOIN_INTERNAL
  }
  // Takes a pointer, since argument evaluation has no order: the call writes the handle.
  void took(quoin_status status, const std::uint64_t* made) {
    took(status);
    if (status == QUOIN_OK) handles_.push_back(*made);
  }

  // An array inside room_, or one of any shape without memory.
  quoin_array array() {
    auto one = made<quoin_array>();
    one.scalar = bit() ? QUOIN_UINT8 : byte() % 11;
    const bool is_there = byte() < 240;
    std::int64_t first = 0;
    std::int64_t last = 8;
    for (int axis = 0; axis < 3; ++axis) {
      one.shape[axis] = is_there ? byte() % 24 : whole();
      one.strides[axis] = small();
      const std::int64_t reach = one.strides[axis] * (is_there ? one.shape[axis] : 0);
      (reach < 0 ? first : last) += reach;
      one.spacing[axis] = bit() ? 0.0 : number();
      one.origin[axis] = bit() ? 0.0 : number();
    }
    // Strides of 0: the array is contiguous.
    if (one.strides[0] == 0 && one.strides[1] == 0 && one.strides[2] == 0 && is_there)
      last = std::int64_t{8} * one.shape[0] * one.shape[1] * one.shape[2];
    if (is_there && last - first < static_cast<std::int64_t>(kRoom)) one.data = room_.data() - first;
    return one;
  }

  void look_at_mesh(quoin_mesh mesh) {
    auto data = sized<quoin_mesh_data>();
    if (quoin_mesh_view(mesh, &data) != QUOIN_OK) return;
    double sum = 0.0;
    for (std::size_t i = 0; i < data.index_count; ++i) {
      if (data.indices[i] >= data.vertex_count) std::abort();
      sum += static_cast<double>(data.positions[3 * data.indices[i] + 2]);
    }
    for (std::size_t i = 0; i < data.vertex_count; ++i) {
      if (data.types != nullptr) sum += data.types[i];
      if (data.occlusion != nullptr) sum += static_cast<double>(data.occlusion[i]);
      if (data.colours != nullptr) sum += data.colours[4 * i + 3];
      if (data.textures != nullptr) sum += data.textures[i] % 7 + data.tints[4 * i + 3];
      if (data.texture_uvs != nullptr) sum += static_cast<double>(data.texture_uvs[2 * i + 1]);
    }
    for (std::size_t i = 0; i < 4 * data.interface_count; ++i) sum += static_cast<double>(data.interfaces[i] & 1);
    sink_ = sum;
  }

  void type() {
    auto one = made<quoin_type>();
    for (std::uint8_t& channel : one.rgba) channel = byte();
    one.emission = std::abs(single());
    one.metalness = static_cast<float>(byte()) / 250.0F;
    one.roughness = static_cast<float>(byte()) / 250.0F;
    std::memset(one.name, 'x', byte() % 2 == 0 ? 3 : sizeof one.name);
    one.transparent = byte() % 2;
    one.ior = bit() ? 0.0F : single();
    // Reads no further bytes, so that programs of the corpus stay the same.
    one.state_bits = one.rgba[0] % 34;
    one.passable = one.rgba[1] % 2;
    std::uint16_t number = 0;
    took(quoin_type_add(handle(), perhaps(&one), perhaps(&number)));
  }

  void textures() {
    constexpr std::array<std::int32_t, 7> kTexels = {16, 32, 64, 17, 0, -16, 2048};
    static const std::vector<std::uint8_t> kOpaque(kRoom, 255);
    auto first = made<quoin_face>();
    first.name[0] = static_cast<char>('a' + byte() % 2);
    first.rgba = perhaps(bit() ? room_.data() : kOpaque.data());
    const std::size_t sizes = bit() ? 2 : kTexels.size();
    first.texels = kTexels.at(byte() % sizes);
    first.turn = byte() % 5;
    first.mirrored = bit() ? 1 : 0;
    first.alpha = byte() % 4;
    first.has_tint = bit() ? 1 : 0;
    first.tint[1] = byte();
    std::array<quoin_face, 6> faces{};
    faces.fill(first);
    if (bit()) faces[4].texels = 16;
    took(quoin_type_set_faces(handle(), index(), perhaps(faces.data())));
    took(quoin_scene_textures(handle(), index(), &textures_), &textures_);
    const quoin_textures from = bit() ? textures_ : handle();
    std::size_t count = 0;
    took(quoin_textures_array_count(from, perhaps(&count)));
    auto array = made<quoin_texture_array>();
    took(quoin_textures_array_get(from, index(), &array));
    std::array<std::uint8_t, 5'000> rgba{};
    took(quoin_textures_read(from, index(), small(), perhaps(rgba.data()), rgba.size()));
    took(quoin_textures_faces(from, index(), perhaps(faces.data()), perhaps(&count)));
  }

  void shapes() {
    std::array<quoin_shape_part, 2> parts{made<quoin_shape_part>(), sized<quoin_shape_part>()};
    std::array<quoin_shape_element, 3> elements{made<quoin_shape_element>(), sized<quoin_shape_element>(),
                                                sized<quoin_shape_element>()};
    std::array<quoin_shape_condition, 2> conditions{made<quoin_shape_condition>(), sized<quoin_shape_condition>()};
    auto look = made<quoin_face>();
    look.alpha = byte() % 4;
    look.has_tint = byte() % 2;
    for (quoin_shape_part& part : parts) {
      part.element_count = 1 + byte() % 3;
      part.condition_count = byte() % 2;
      part.orientation = bit() ? 0 : small();
    }
    for (quoin_shape_element& element : elements) {
      for (int axis = 0; axis < 3; ++axis) {
        element.min[axis] = bit() ? 0.0F : single();
        element.max[axis] = bit() ? 16.0F : single();
        element.turn_origin[axis] = bit() ? 8.0F : single();
      }
      element.has_turn = bit() ? 1 : 0;
      element.turn_axis = byte() % 4;
      element.turn_degrees = single();
      element.turn_rescales = byte() % 2;
      for (std::int32_t& side : element.looks) side = byte() % 8 == 0 ? small() : 0;
      element.has_parts = byte();
      for (auto& part : element.parts) part[byte() % 4] = single();
    }
    for (quoin_shape_condition& condition : conditions) {
      condition.state_mask = byte() % 4;
      condition.connected = byte() % 65;
      condition.corner = byte() % 7;
    }
    auto given = made<quoin_shapes>();
    given.parts = perhaps(parts.data());
    given.part_count = byte() % 3;
    given.elements = perhaps(elements.data());
    given.element_count = byte() % 4;
    given.conditions = perhaps(conditions.data());
    given.condition_count = byte() % 3;
    given.looks = perhaps(&look);
    given.look_count = byte() % 2;
    given.neighbours = byte() % 5;
    given.groups = byte();
    given.fluid_groups = byte() % 3;
    given.fluid_condition_count = byte() % 3;
    const quoin_scene scene = handle();
    const std::size_t type = index();
    took(quoin_type_set_shapes(scene, type, perhaps(&given)));
    auto properties = made<quoin_type>();
    properties.rgba[3] = byte();
    properties.blocks_light = byte() % 4 - 1;
    properties.state_bits = byte() % 34;
    took(quoin_type_set(scene, type, perhaps(&properties)));
    orientations(scene, type);
    read_shapes(type, parts[0], elements[0], conditions[0], look);
    states(scene);
  }

  void orientations(quoin_scene scene, std::size_t type) {
    auto given = made<quoin_orientations>();
    given.kind = byte() % 6;
    given.first_bit = small();
    given.front = byte() % 7;
    given.count = byte() % 50;
    for (std::uint8_t& each : given.by_value) each = byte() % 49;
    took(quoin_type_set_orientations(scene, type, perhaps(&given)));
    took(quoin_type_get_orientations(scene, type, perhaps(&given)));
    std::int32_t turned = 0;
    took(quoin_orientation_turn(small(), byte() % 4, static_cast<std::int32_t>(whole()), perhaps(&turned)));
    std::uint32_t state = 0;
    took(quoin_type_turned_state(scene, type, byte(), small(), perhaps(&state)));
    auto placing = made<quoin_placing>();
    placing.face = byte() % 7;
    placing.front = byte() % 5;
    placing.point[1] = single();
    numbers(placing.look);
    took(quoin_type_placed_state(scene, type, perhaps(&placing), byte(), perhaps(&state)));
  }

  void read_shapes(std::size_t type, const quoin_shape_part& part, const quoin_shape_element& element,
                   const quoin_shape_condition& condition, const quoin_face& look) {
    auto whole = made<quoin_shapes>();
    const quoin_textures from = bit() ? textures_ : handle();
    took(quoin_textures_shapes(from, type, perhaps(&whole)));
    auto counts = sized<quoin_shapes>();
    if (quoin_textures_shapes(from, type, &counts) != QUOIN_OK) counts = sized<quoin_shapes>();
    std::vector<quoin_shape_part> parts(counts.part_count + 1, part);
    std::vector<quoin_shape_element> elements(counts.element_count + 1, element);
    std::vector<quoin_shape_condition> conditions(counts.condition_count + 1, condition);
    std::vector<quoin_face> looks(counts.look_count + 1, look);
    took(quoin_textures_read_shapes(from, type, perhaps(parts.data()), perhaps(elements.data()),
                                    perhaps(conditions.data()), perhaps(looks.data())));
  }

  void states(quoin_scene scene) {
    const std::array<std::int32_t, 3> min{small(), small(), small()};
    const std::array<std::int32_t, 3> shape{8, byte() % 9, 8};
    std::array<std::uint32_t, 512> states{};
    took(quoin_grid_read_states(scene, index(), perhaps(min.data()), shape.data(), perhaps(states.data()),
                                states.size()));
    const quoin_array given = array();
    took(quoin_grid_write_states(scene, index(), perhaps(&given)));
  }

  void instance() {
    auto one = made<quoin_instance>();
    one.grid = index();
    const std::uint8_t flags = byte();
    one.visible = flags % 2;
    one.unsaved = flags / 64 % 2;
    one.group = index();
    const bool is_plain = bit();
    for (int i = 0; i < 12; ++i) one.world_from_grid[i] = is_plain && i % 4 != 3 ? (i % 5 == 0 ? 1.0 : 0.0) : number();
    if (bit())
      took(quoin_instance_add(handle(), perhaps(&one), nullptr));
    else
      took(quoin_instance_set(handle(), index(), perhaps(&one)));
  }

  template <std::size_t Count>
  void numbers(double (&out)[Count]) {
    for (double& each : out) each = number();
  }

  void layers_and_groups() {
    constexpr std::array<const char*, 4> kNames = {"", "a", "b", "c"};
    auto layer = made<quoin_layer>();
    layer.name[0] = kNames.at(byte() % 4)[0];
    layer.visible = byte() % 2;
    took(quoin_layer_set(handle(), perhaps(&layer)));
    took(quoin_layer_get(handle(), index(), perhaps(&layer)));
    std::size_t count = 0;
    took(quoin_layer_count(handle(), perhaps(&count)));
    took(quoin_instance_set_layer(handle(), index(), perhaps(kNames.at(byte() % 4))));
    auto group = made<quoin_group>();
    group.parent = index();
    const std::uint8_t flags = byte();
    group.shown = flags % 2;
    group.unsaved = flags / 64 % 2;
    group.layer[0] = kNames.at(byte() % 4)[0];
    took(quoin_group_add(handle(), perhaps(&group), perhaps(&count)));
  }

  void views() {
    auto camera = made<quoin_camera>();
    camera.number = small();
    camera.is_first = byte() % 2;
    camera.is_orthographic = byte() % 2;
    camera.right[0] = camera.up[1] = 1.0;
    camera.forward[2] = -1.0;
    numbers(camera.position);
    if (bit()) numbers(camera.up);
    camera.vertical_fov_degrees = number();
    camera.view_height = number();
    camera.focus_distance = number();
    took(quoin_camera_add(handle(), perhaps(&camera)));
    auto lamp = made<quoin_lamp>();
    lamp.is_spot = byte() % 2;
    numbers(lamp.position);
    numbers(lamp.direction);
    for (float& each : lamp.colour) each = single();
    lamp.intensity = number();
    lamp.range = number();
    lamp.inner_angle_degrees = number();
    lamp.outer_angle_degrees = number();
    took(quoin_lamp_add(handle(), perhaps(&lamp)));
    auto sun = made<quoin_sun>();
    numbers(sun.direction);
    sun.brightness = number();
    for (float& each : sun.colour) each = single();
    sun.angle_degrees = number();
    took(quoin_sun_set(handle(), perhaps(&sun)));
    took(quoin_sun_get(handle(), perhaps(&sun)));
    auto environment = made<quoin_environment>();
    took(quoin_environment_get(handle(), perhaps(&environment)));
    environment.sky = whole();
    environment.tone = whole();
    environment.exposure = environment.fog_density = number();
    environment.has_exposure = environment.has_fog = environment.has_ground = whole();
    took(quoin_environment_set(handle(), perhaps(&environment)));
  }

  // Encodes a scene in any format. The folder does not exist, so that nothing is written.
  void save() {
    const quoin_scene scene = handle();
    std::size_t count = 0;
    took(quoin_type_count(scene, perhaps(&count)));
    took(quoin_group_count(scene, &count));
    took(quoin_camera_count(scene, &count));
    took(quoin_lamp_count(scene, &count));
    took(quoin_scene_warning_count(scene, &count));
    took(quoin_format_count(&count));
    if (quoin_version()[0] == '\0') std::abort();
    auto format = sized<quoin_format>();
    took(quoin_format_get(byte() % count, &format));
    if (std::strcmp(format.name, "voxlap") == 0 && !may_take_long()) return;
    const std::string extensions(format.extensions);
    const std::string path = "/no folder/scene" + extensions.substr(0, extensions.find(' '));
    took(quoin_scene_save(scene, perhaps(path.c_str())));
    quoin_scene loaded = 0;
    took(quoin_scene_load(path.c_str(), &loaded), &loaded);
  }

  // Calls added later. They use byte values that meant little before, so that programs of the corpus hardly change.
  void step_of_later(std::uint8_t which) {
    if (which == kLater) return save();
    if (which % 4 == 0) return layers_and_groups();
    if (which % 4 == 1) return views();
    if (which % 8 == 6) {
      const std::uint8_t flags = byte();
      took(quoin_grid_set_storage(handle(), index(), flags % 2, flags / 2));
    }
    const quoin_array given = array();
    took(quoin_grid_write(handle(), index(), perhaps(&given)));
  }

  void voxelize() {
    std::array<float, 24> positions{};
    std::array<std::uint32_t, 12> indices{};
    std::array<std::uint32_t, 4> materials{};
    for (float& each : positions) each = byte() > 250 ? std::nanf("") : static_cast<float>(small());
    for (std::uint32_t& each : indices) each = byte() % 9;
    for (std::uint32_t& each : materials) each = byte() % 3;
    std::array<quoin_type, 2> types = {sized<quoin_type>(), sized<quoin_type>()};
    auto one = made<quoin_triangles>();
    one.vertex_count = positions.size() / 3;
    one.triangle_count = byte() % 5;
    one.positions = perhaps(positions.data());
    one.indices = perhaps(indices.data());
    one.materials = bit() ? materials.data() : nullptr;
    one.types = bit() ? types.data() : nullptr;
    one.type_count = byte() % 3;
    auto options = made<quoin_voxelize_options>();
    options.voxel_size = bit() ? 2.0 : std::max(number(), -1.0);
    // Small voxels would be slow.
    if (options.voxel_size > 0.0 && options.voxel_size < 1.0) options.voxel_size = 1e-30;
    options.fill = small() % 4;
    options.max_types = small();
    took(quoin_grid_voxelize(handle(), perhaps(&one), perhaps(&options), nullptr, nullptr));
  }

  void look() {
    std::size_t count = 0;
    took(quoin_grid_count(handle(), &count));
    took(quoin_instance_count(handle(), perhaps(&count)));
    auto type = made<quoin_type>();
    took(quoin_type_get(handle(), index(), &type));
    auto grid = made<quoin_grid_info>();
    took(quoin_grid_get_info(handle(), index(), &grid));
    auto place = made<quoin_instance>();
    took(quoin_instance_get(handle(), index(), &place));
    auto group = made<quoin_group>();
    took(quoin_group_get(handle(), index(), &group));
    auto camera = made<quoin_camera>();
    took(quoin_camera_get(handle(), index(), &camera));
    auto lamp = made<quoin_lamp>();
    took(quoin_lamp_get(handle(), index(), &lamp));
    auto info = made<quoin_scene_info>();
    took(quoin_scene_get_info(handle(), &info));
    auto format = made<quoin_format>();
    took(quoin_format_get(index(), &format));
    std::array<char, 8> text{};
    took(quoin_scene_warning(handle(), index(), text.data(), byte() % text.size()));
  }

  void read() {
    std::array<std::int32_t, 3> min{};
    std::array<std::int32_t, 3> shape{};
    for (std::int32_t& each : min) each = byte() < 200 ? small() : static_cast<std::int32_t>(whole());
    for (std::int32_t& each : shape) each = byte() < 200 ? byte() % 16 : std::numeric_limits<std::int32_t>::max();
    std::array<std::uint16_t, 1024> types{};
    took(quoin_grid_read(handle(), index(), perhaps(min.data()), shape.data(), perhaps(types.data()), types.size()));
    // Reads no further bytes, so that programs of the corpus stay the same.
    std::array<quoin_body, 2> bodies{made<quoin_body>(), {}};
    const std::array<double, 3> densities{1.0, static_cast<double>(min[0]), 0.5};
    const quoin_scene last = handles_.empty() ? 0 : handles_.back();
    std::size_t pieces = 0;
    took(quoin_grid_body(last, 0, densities.data(), densities.size(), bodies.data()));
    took(quoin_grid_pieces(last, 0, nullptr, 0, bodies.data(), bodies.size(), &pieces));
  }

  void use_uniform_sky(quoin_scene scene) {
    auto environment = sized<quoin_environment>();
    took(quoin_environment_get(scene, &environment));
    environment.sky = QUOIN_SKY_UNIFORM;
    took(quoin_environment_set(scene, &environment));
  }

  void see() {
    auto options = made<quoin_render_options>();
    options.width = small() % 9;
    options.height = small() % 9;
    const std::uint8_t chance = byte();
    options.samples = chance < 250 ? 1 : -5;
    options.paths = byte() % 2 != 0 && may_take_long() ? 1 : 0;
    options.threads = 1;
    options.has_camera = byte() % 8 == 0 ? 1 : 0;
    for (double& each : options.camera) each = number();
    for (double& each : options.look_at) each = number();
    options.fov_degrees = number();
    // Reads no further bytes, so that programs of the corpus stay the same.
    options.has_sun = options.has_camera;
    std::copy(std::begin(options.look_at), std::end(options.look_at), options.sun);
    if (options.width == 0) options.width = 4;
    if (options.height == 0) options.height = 4;
    std::array<std::uint8_t, 256> image{};
    const quoin_scene scene = handle();
    // Computing a physical sky, the default, takes a hundred times as long as the image.
    if (options.paths != 0 && chance % 16 != 0) use_uniform_sky(scene);
    took(quoin_scene_render(scene, &options, perhaps(image.data()), image.size()));
  }

  void cast() {
    std::array<double, 9> origins{};
    std::array<double, 9> directions{};
    for (double& each : origins) each = number();
    for (double& each : directions) each = number();
    std::array<double, 3> t{};
    std::array<std::int32_t, 9> voxel{};
    std::array<std::uint16_t, 3> type{};
    auto hits = made<quoin_hits>();
    hits.t = perhaps(t.data());
    hits.voxel = voxel.data();
    hits.type = type.data();
    took(quoin_scene_rays(handle(), byte() % 4, perhaps(origins.data()), directions.data(), number(), &hits));
  }

  void load() {
    const std::size_t wanted = std::size_t{4} * byte();
    const bool is_null = byte() > 250;
    const std::size_t size = std::min(wanted, static_cast<std::size_t>(end_ - next_));
    quoin_scene scene = 0;
    took(quoin_scene_load_bytes(is_null ? nullptr : next_, size, &scene), &scene);
    next_ += size;
    auto options = made<quoin_load_options>();
    options.frame = small();
    options.radius = small();
    options.iso = single();
    options.voxel_size = number();
    took(quoin_scene_load_with("", perhaps(&options), &scene), &scene);
    // Reuses bytes, so that inputs of the corpus stay the same.
    for (std::int32_t& length : options.raw_shape) length = options.frame % 8;
    options.raw_scalar = options.radius % 10;
    options.heights = options.radius % 4;
    options.metres_per_pixel = options.voxel_size;
    const char* const pack = "builtin";
    const void* const zip = next_ - size;
    if (options.size == sizeof options) {
      if (options.frame % 2 != 0) options.dimension = "nether";
      options.packs = &pack;
      options.pack_count = options.frame % 3 == 1 ? 1 : 0;
      options.pack_zips = &zip;
      options.pack_zip_bytes = &size;
      options.pack_zip_count = options.radius % 3 == 1 ? 1 : 0;
    }
    took(quoin_scene_load_bytes_with(is_null ? nullptr : next_ - size, size, &options, &scene), &scene);
  }

  void mesh() {
    quoin_mesh out = 0;
    auto options = made<quoin_mesh_options>();
    options.smooth = byte() % 2 != 0 && may_take_long() ? 1 : 0;
    options.threads = threads();
    options.watertight = options.threads % 2;
    if (options.size == sizeof options) options.textures = textures_;
    const std::uint8_t which = byte() % 3;
    if (which == 0) {
      took(quoin_grid_mesh(handle(), index(), perhaps(&options), &out), &out);
    } else {
      const quoin_array given = array();
      if (which == 1)
        took(quoin_surface_nets(perhaps(&given), number(), byte() % 2, threads(), &out), &out);
      else
        took(quoin_mesh_labels(perhaps(&given), small(), small() % 8, threads(), &out), &out);
    }
    if (!handles_.empty()) look_at_mesh(handles_.back());
  }

  static std::int32_t report(double, void* user) { return --*static_cast<int*>(user) > 0 ? 1 : 0; }

  void step() {
    quoin_scene scene = 0;
    const std::uint8_t which = byte();
    if (which == kShapes) return shapes();
    if (which == kTextures) return textures();
    if (which >= kLater) return step_of_later(which);
    switch (which % 14) {
      case 0:
        took(quoin_scene_create(&scene), &scene);
        break;
      case 1:
        type();
        break;
      case 2:
      case 3: {
        const quoin_array given = array();
        took(quoin_grid_add(handle(), perhaps(&given), bit() ? "grid" : nullptr, nullptr));
        break;
      }
      case 4:
        mesh();
        break;
      case 5:
        instance();
        break;
      case 6:
        voxelize();
        break;
      case 7:
        look();
        break;
      case 8:
        read();
        break;
      case 9:
        see();
        break;
      case 10:
        cast();
        break;
      case 11:
        load();
        break;
      case 12:
        left_ = byte();
        took(quoin_set_progress(bit() ? report : nullptr, &left_));
        break;
      default: {
        const std::uint64_t one = handle();
        took(quoin_free(one));
        if (one != 0 && quoin_free(one) != QUOIN_BAD_HANDLE) std::abort();
      }
    }
  }

  const std::uint8_t* next_;
  const std::uint8_t* end_;
  std::array<std::uint8_t, kRoom> room_{};
  std::vector<std::uint64_t> handles_;
  quoin_textures textures_ = 0;  // the last ones
  int left_ = 0;
  int long_calls_ = 0;
  double sink_ = 0.0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Program(data, size).run();
  return 0;
}
