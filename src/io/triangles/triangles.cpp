#include "io/triangles/triangles.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/io/file.h>
#include <quoin/io/image_files.h>

#include "io/format_driver.h"
#include "io/whole_file.h"

namespace quoin {

namespace triangles {

namespace {

struct Point {
  double x = 0.0;
  double y = 0.0;
  bool operator==(const Point&) const = default;
};

/// Returns twice the area of a triangle; positive if it turns left.
double area(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Projects the corners to the plane in which the polygon is largest, where it turns left.
std::vector<Point> flattened(std::span<const DVec3> corners) {
  QUOIN_ASSERT(corners.size() >= 3, "at least three corners");
  DVec3 normal(0.0);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    normal += glm::cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  }
  int axis = std::abs(normal.x) > std::abs(normal.y) ? 0 : 1;
  if (std::abs(normal.z) > std::abs(normal[axis])) axis = 2;
  int u = (axis + 1) % 3;
  int v = (axis + 2) % 3;
  if (normal[axis] < 0.0) std::swap(u, v);
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const DVec3& corner : corners) points.push_back({corner[u] - corners[0][u], corner[v] - corners[0][v]});
  return points;
}

/// Returns true if it never turns right and goes round once: from left to right and back.
bool is_convex(const std::vector<Point>& points) {
  const std::size_t count = points.size();
  int turns = 0;
  double last = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Point& a = points[i];
    const Point& b = points[(i + 1) % count];
    if (area(a, b, points[(i + 2) % count]) < 0.0) return false;
    const double step = b.x - a.x;
    if (step == 0.0) continue;
    turns += last != 0.0 && (step < 0.0) != (last < 0.0) ? 1 : 0;
    last = step;
  }
  return turns <= 2;
}

/// The ring of corners that remains while ears are cut off.
class Ring {
 public:
  explicit Ring(const std::vector<Point>& points) : points_(points), next_(points.size()), last_(points.size()) {
    const auto count = static_cast<std::uint32_t>(points.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      next_[i] = (i + 1) % count;
      last_[i] = (i + count - 1) % count;
    }
  }
  [[nodiscard]] std::uint32_t next(std::uint32_t i) const { return next_[i]; }
  [[nodiscard]] std::array<std::uint32_t, 3> corner(std::uint32_t i) const { return {last_[i], i, next_[i]}; }
  [[nodiscard]] double turn(std::uint32_t i) const { return area(points_[last_[i]], points_[i], points_[next_[i]]); }
  void remove(std::uint32_t i) {
    QUOIN_ASSERT(i < next_.size() && next_[last_[i]] == i, "a corner that is left");
    next_[last_[i]] = next_[i];
    last_[next_[i]] = last_[i];
  }
  /// Returns true if a corner turns to the left and its triangle contains no other corner. Left-turning corners need no
  /// test: if one lies inside, so does a corner that does not turn left.
  [[nodiscard]] bool is_ear(std::uint32_t i) const {
    if (!(turn(i) > 0.0)) return false;
    const Point& a = points_[last_[i]];
    const Point& b = points_[i];
    const Point& c = points_[next_[i]];
    for (std::uint32_t at = next_[next_[i]]; at != last_[i]; at = next_[at]) {
      const Point& p = points_[at];
      if (p == a || p == b || p == c || turn(at) > 0.0) continue;
      if (area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 && area(c, a, p) >= 0.0) return false;
    }
    return true;
  }

 private:
  const std::vector<Point>& points_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> last_;
};

/// Returns the corner to cut off if there is no ear: the ring crosses itself there, or is on a line.
std::uint32_t flattest(const Ring& ring, std::uint32_t first, std::size_t left) {
  std::uint32_t best = first;
  std::uint32_t at = first;
  for (std::size_t i = 0; i < left; ++i, at = ring.next(at)) {
    if (std::abs(ring.turn(at)) < std::abs(ring.turn(best))) best = at;
  }
  return best;
}

void cut_ears(const std::vector<Point>& points, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  Ring ring(points);
  std::uint32_t at = 0;
  for (std::size_t left = points.size(); left > 2; --left) {
    std::size_t tried = 0;
    while (tried < left && !ring.is_ear(at)) {
      at = ring.next(at);
      ++tried;
    }
    if (tried == left) at = flattest(ring, at, left);
    triangles.push_back(ring.corner(at));
    const std::uint32_t after = ring.next(at);
    ring.remove(at);
    at = ring.next(after);  // cutting adjacent ears in sequence would make slivers
  }
}

}  // namespace

bool cut_polygon(std::span<const DVec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (corners.size() < 3) return true;
  const auto fan = [&] {
    for (std::uint32_t i = 2; i < corners.size(); ++i) triangles.push_back({0, i - 1, i});
  };
  if (corners.size() == 3) {
    fan();
    return true;
  }
  const std::vector<Point> points = flattened(corners);
  const bool convex = is_convex(points);
  if (convex || corners.size() > kMostCornersOfConcave) {
    fan();
    return convex;
  }
  cut_ears(points, triangles);
  return true;
}

namespace {

/// Converts points of a file whose z axis points up to Quoin's axes.
void turn_up(TriangleMesh& mesh) {
  for (DVec3& p : mesh.positions) p = {p.x, p.z, -p.y};
}

Result<LoadedMesh> read_as(std::optional<FileFormat> format, std::span<const std::byte> bytes, SidecarReader& sidecars,
                           std::optional<UpAxis> up) {
  if (!format) return make_error(ErrorCode::Unsupported, "unknown mesh format");
  const FormatDriver& driver = driver_of(*format);
  if (driver.read_mesh != nullptr) return read_with(driver, bytes, sidecars, up);
  if (!driver.left_out.empty()) return left_out_error(driver);
  return make_error(ErrorCode::Unsupported, std::string(format->name()) + " holds no triangles");
}

}  // namespace

Result<LoadedMesh> read_with(const FormatDriver& driver, std::span<const std::byte> bytes, SidecarReader& sidecars,
                             std::optional<UpAxis> up) {
  QUOIN_ASSERT(driver.read_mesh != nullptr, "a format of triangles");
  auto loaded = driver.read_mesh(bytes, sidecars);
  if (!loaded) return loaded;
  loaded->format = driver.info.name();
  if (up.value_or(driver.info.up) == UpAxis::Z) turn_up(loaded->mesh);
  loaded->sidecars = std::move(sidecars.files());
  return loaded;
}

Result<std::vector<std::byte>> SidecarReader::read_path(const std::filesystem::path& path) {
  auto bytes = read_file(path);
  if (!bytes) return make_error(bytes.error().code, bytes.error().message);
  if (std::find(files_.begin(), files_.end(), path) == files_.end()) files_.push_back(path);
  return bytes;
}

Result<std::vector<std::byte>> SidecarReader::read(const std::string& name) {
  if (file_.empty()) return make_error(ErrorCode::CannotRead, "a mesh read from bytes has no folder for other files");
  const auto path = sidecar_path(file_, name, allowed_);
  if (path) return read_path(*path);
  if (!refused_) refused_ = path.error();
  return path.error();
}

Result<std::vector<std::byte>> SidecarReader::read_or_same_name(const std::string& name) {
  if (file_.empty()) return make_error(ErrorCode::CannotRead, "a mesh read from bytes has no folder for other files");
  const auto path = sidecar_path(file_, name, allowed_);
  if (path) return read_path(*path);
  const auto same_name = sidecar_path(file_, name.substr(name.find_last_of("/\\") + 1), allowed_);
  auto bytes = same_name ? read_path(*same_name) : Result<std::vector<std::byte>>(path.error());
  return bytes ? std::move(bytes) : path.error();
}

Result<bool> MeshBuilder::add(std::size_t a, std::size_t b, std::size_t c) {
  TriangleMesh& mesh = loaded_.mesh;
  const std::size_t count = mesh.positions.size();
  if (a >= count || b >= count || c >= count) {
    ++not_there_;
    return false;
  }
  if (!is_finite(mesh.positions[a]) || !is_finite(mesh.positions[b]) || !is_finite(mesh.positions[c])) {
    ++not_finite_;
    return false;
  }
  if (mesh.triangles.size() == kMostTriangles) {
    return make_error(ErrorCode::LimitExceeded, "more than 2^27 triangles");
  }
  mesh.triangles.push_back(
      {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)});
  return true;
}

Status MeshBuilder::add_polygon(std::span<const std::size_t> corners,
                                FunctionRef<void(const std::array<std::uint32_t, 3>&)> added) {
  const std::vector<DVec3>& positions = loaded_.mesh.positions;
  polygon_.clear();
  cut_.clear();
  for (const std::size_t corner : corners) {
    const bool is_sound = corner < positions.size() && is_finite(positions[corner]);
    // `add` counts the triangles of missing corners.
    polygon_.push_back(is_sound ? positions[corner] : DVec3(0.0));
  }
  too_large_ += cut_polygon(polygon_, cut_) ? 0 : 1;
  for (const auto& triangle : cut_) {
    QUOIN_ASSERT(std::max({triangle[0], triangle[1], triangle[2]}) < corners.size(), "corners of the polygon");
    const auto is_added = add(corners[triangle[0]], corners[triangle[1]], corners[triangle[2]]);
    if (!is_added) return is_added.error();
    if (*is_added) added(triangle);
  }
  return {};
}

void MeshBuilder::finish() {
  const auto warn = [&](std::size_t count, const char* what) {
    if (count == 0) return;
    loaded_.warnings.push_back("left out: " + with_thousands(static_cast<std::int64_t>(count)) + " triangles with " +
                               what);
  };
  warn(not_there_, "a missing corner");
  warn(not_finite_, "a corner that is not finite");
  if (too_large_ > 0) {
    loaded_.warnings.push_back(
        "polygons of more than " + with_thousands(std::int64_t{kMostCornersOfConcave}) +
        " corners, triangulated as convex: " + with_thousands(static_cast<std::int64_t>(too_large_)));
  }
}

bool is_occlusion_grey(double linear) {
  constexpr double kHalfByte = 0.5 / 255.0 + 1e-6;
  const double quarters = std::round(linear * 4.0);
  return quarters >= 1.0 && quarters <= 4.0 && std::abs(linear - quarters / 4.0) <= kHalfByte;
}

std::optional<std::size_t> add_texture(std::span<const std::byte> file_bytes, const std::string& name,
                                       LoadedMesh& loaded) {
  auto image = read_alpha_image(file_bytes);
  if (!image) {
    loaded.warnings.push_back("left out: the texture " + name + ": " + image.error().message);
    return std::nullopt;
  }
  MeshTexture texture;
  texture.image = std::move(*image);
  loaded.mesh.textures.push_back(std::move(texture));
  return loaded.mesh.textures.size() - 1;
}

namespace {

Result<VoxelLattice> lattice_of(const TriangleMesh& mesh, const MeshLoadOptions& options) {
  if (options.voxel_size) return lattice_of_voxel(mesh, *options.voxel_size);
  return lattice_of_size(mesh, options.size.value_or(kDefaultMeshSize));
}

std::string number_of(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

}  // namespace

Result<LoadedScene> scene_from_mesh(LoadedMesh loaded, const MeshLoadOptions& options, const std::string& name,
                                    Threads threads, const Progress& progress) {
  if (loaded.mesh.triangles.empty()) return make_error(ErrorCode::Unsupported, "the file has no triangles");
  const auto lattice = lattice_of(loaded.mesh, options);
  if (!lattice) return lattice.error();
  LoadedScene scene;
  scene.format = loaded.format;
  scene.warnings = std::move(loaded.warnings);
  if (!options.size && !options.voxel_size) {
    scene.warnings.push_back("voxelised at " + std::to_string(kDefaultMeshSize) +
                             " voxels along the longest side, with voxels of " + number_of(lattice->voxel_size) +
                             " units, since no size was given");
  }
  SceneGrid grid;
  grid.name = name;
  Instance instance;
  instance.name = name;
  instance.voxel_size = lattice->voxel_size;
  instance.position = lattice->origin;
  const std::size_t most = options.max_types.value_or(kMaxVoxelTypes);
  if (options.as_field) {
    const DistanceFieldOptions wanted{*lattice, options.solid, options.band, most};
    auto made = distance_field(loaded.mesh, wanted, scene.scene.types, threads, progress);
    if (!made) return made.error();
    if (made->field.chunk_count() == 0) scene.warnings.emplace_back("the mesh encloses no volume");
    grid.field = std::move(made->field);
    instance.position += DVec3(0.5 * lattice->voxel_size);
    scene.warnings.insert(scene.warnings.end(), made->warnings.begin(), made->warnings.end());
  } else {
    auto made =
        voxelize(loaded.mesh, {*lattice, options.surface, options.solid, most}, scene.scene.types, threads, progress);
    if (!made) return made.error();
    if (made->grid.voxel_count() == 0) scene.warnings.emplace_back("the mesh produced no voxels");
    grid.grid = std::move(made->grid);
    scene.warnings.insert(scene.warnings.end(), made->warnings.begin(), made->warnings.end());
  }
  instance.grid = scene.scene.add_grid(std::move(grid));
  scene.scene.add_instance(std::move(instance));
  return scene;
}

}  // namespace triangles

Result<LoadedMesh> read_mesh(std::span<const std::byte> bytes, std::optional<UpAxis> up) {
  triangles::SidecarReader nothing;
  return triangles::read_as(detect_format(bytes), bytes, nothing, up);
}

Result<LoadedMesh> read_mesh(const std::filesystem::path& path, std::optional<UpAxis> up, SidecarFiles sidecar_files) {
  return read_whole(path, [&](std::span<const std::byte> bytes) {
    triangles::SidecarReader sidecars(path, sidecar_files);
    const auto format = detect_format(bytes);
    return triangles::read_as(format ? format : detect_by_name(path, bytes), bytes, sidecars, up);
  });
}

}  // namespace quoin
