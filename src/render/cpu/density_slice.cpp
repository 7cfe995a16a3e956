#include <quoin/core/assert.h>
#include <quoin/render/cpu_renderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace quoin {

namespace {

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
// The margin on each side, as a share of the image's smaller side.
constexpr double kMargin = 0.02;
// Sample lines are drawn if a pixel spans less of a sample than this.
constexpr double kWidestStep = 0.25;

struct PlacedField {
  const Instance* instance;
  const SceneGrid* grid;
};

std::vector<PlacedField> fields_of(const Scene& scene, InstanceFilter filter) {
  std::vector<PlacedField> fields;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (!is_drawn(scene, instance, filter)) continue;
    const SceneGrid& grid = scene.grids()[instance.grid];
    if (!grid.field.bounds().empty()) fields.push_back({&instance, &grid});
  }
  return fields;
}

// Returns the box around all fields, in the world. Ignores corners that are not finite.
DBox bounds_of(const std::vector<PlacedField>& fields) {
  DBox box;
  for (const PlacedField& field : fields) {
    const IBox bounds = field.grid->field.bounds();
    for (int i = 0; i < 8; ++i) {
      const DVec3 point = world_from_grid(*field.instance, *field.grid, box_corner(bounds, i));
      if (is_finite(point)) box.extend(point);
    }
  }
  return box;
}

// The positions of the pixels in the world.
struct Plane {
  DVec3 middle{0.0};
  DVec3 right{0.0};  // one pixel wide
  DVec3 down{0.0};
  double pixel = 1.0;  // world units
  int width = 0;
  int height = 0;

  [[nodiscard]] DVec3 at(int x, int y) const {
    return middle + right * (x + 0.5 - 0.5 * width) + down * (y + 0.5 - 0.5 * height);
  }
};

Plane plane_of(const DBox& box, const DensitySliceOptions& options) {
  QUOIN_ASSERT(!box.empty() && options.axis >= 0 && options.axis < 3, "a box, and one of three axes");
  constexpr DVec3 kRight[3] = {{0, 0, -1}, {1, 0, 0}, {1, 0, 0}};
  constexpr DVec3 kDown[3] = {{0, -1, 0}, {0, 0, 1}, {0, -1, 0}};
  Plane plane;
  plane.width = options.width;
  plane.height = options.height;
  plane.middle = 0.5 * (box.min + box.max);
  plane.middle[options.axis] = box.min[options.axis] + options.at * (box.max - box.min)[options.axis];
  const DVec3 size = box.max - box.min;
  const double margin = 1.0 - 2.0 * kMargin;
  const double along = std::abs(glm::dot(size, kRight[options.axis])) / (options.width * margin);
  const double across = std::abs(glm::dot(size, kDown[options.axis])) / (options.height * margin);
  plane.pixel = std::max({along, across, 1e-300});
  plane.right = kRight[options.axis] * plane.pixel;
  plane.down = kDown[options.axis] * plane.pixel;
  return plane;
}

// The density of a pixel, its share of the range, and the part of a sample that the pixel spans.
struct Value {
  float density;
  float band;
  double step;
};

Value value_at(const std::vector<PlacedField>& fields, const Plane& plane, DVec3 point) {
  Value least{0.0F, 0.0F, 0.0};
  for (const PlacedField& placed : fields) {
    const DensityGrid& field = placed.grid->field;
    const float density = field.density_at(grid_from_world(*placed.instance, *placed.grid, point));
    if (least.band > 0.0F && density >= least.density) continue;
    least = {density, field.band(), plane.pixel / placed.instance->voxel_size};
  }
  return least;
}

using Rgb = std::array<float, 3>;

Rgb mixed(const Rgb& from, const Rgb& to, float share) {
  Rgb colour{};
  for (std::size_t i = 0; i < 3; ++i) colour[i] = from[i] + share * (to[i] - from[i]);
  return colour;
}

Rgb colour_of(const Value& value) {
  constexpr Rgb kSolidNear = {247, 190, 122};
  constexpr Rgb kSolidFar = {92, 38, 14};
  constexpr Rgb kAirNear = {222, 236, 250};
  constexpr Rgb kAirFar = {38, 74, 122};
  const float share = std::min(std::abs(value.density) / value.band, 1.0F);
  return value.density < 0.0F ? mixed(kSolidNear, kSolidFar, share) : mixed(kAirNear, kAirFar, share);
}

// Returns the brightness factor of the first pixel for a contour line between two pixels.
float line_between(const Value& a, const Value& b) {
  if ((a.density < 0.0F) != (b.density < 0.0F)) return 0.15F;
  const bool crosses = a.step < kWidestStep && std::floor(a.density) != std::floor(b.density);
  return crosses ? 0.86F : 1.0F;
}

Status check(const DensitySliceOptions& options) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (options.width <= 0 || options.height <= 0) return refuse("size: width and height must be positive");
  if (std::int64_t{options.width} * options.height > kMaxPixels) return refuse("size: more than 268,435,456 pixels");
  if (options.axis < 0 || options.axis > 2) return refuse("slice: the axis must be 0, 1 or 2");
  if (!(options.at >= 0.0 && options.at <= 1.0)) return refuse("slice: the position must be 0 to 1");
  return {};
}

}  // namespace

Result<DensitySlice> draw_density_slice(const Scene& scene, const DensitySliceOptions& options, Threads threads) {
  if (Status right = check(options); !right) return right.error();
  const std::vector<PlacedField> fields = fields_of(scene, options.instances);
  const DBox box = bounds_of(fields);
  if (box.empty()) {
    return make_error(ErrorCode::InvalidArgument, "slice: the scene has no density field with a solid");
  }
  const Plane plane = plane_of(box, options);
  const auto width = static_cast<std::size_t>(options.width);
  DensitySlice slice;
  slice.position = plane.middle[options.axis];
  slice.colour = {options.width, options.height, {}};
  slice.colour.rgb.resize(3 * width * static_cast<std::size_t>(options.height));
  std::vector<std::int64_t> solid(static_cast<std::size_t>(options.height));
  parallel_for(solid.size(), threads, [&](std::size_t y) {
    // Includes one more row and column, for the lines.
    const auto value = [&](std::size_t x, std::size_t row) {
      return value_at(fields, plane, plane.at(static_cast<int>(x), static_cast<int>(row)));
    };
    Value here = value(0, y);
    for (std::size_t x = 0; x < width; ++x) {
      const Value next = value(x + 1, y);
      const float dim = std::min(line_between(here, next), line_between(here, value(x, y + 1)));
      const Rgb colour = colour_of(here);
      for (std::size_t i = 0; i < 3; ++i) {
        slice.colour.rgb[3 * (y * width + x) + i] = static_cast<std::uint8_t>(std::lround(colour[i] * dim));
      }
      solid[y] += here.density < 0.0F ? 1 : 0;
      here = next;
    }
  });
  for (const std::int64_t row : solid) slice.pixels_solid += row;
  return slice;
}

}  // namespace quoin
