#include "io/triangles/triangles.h"

#include <algorithm>
#include <cmath>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/io/file.h>

#include "io/format_driver.h"
#include "io/image/image_codecs.h"
#include "io/triangles/polygon.h"
#include "io/whole_file.h"

namespace quoin {

namespace triangles {

namespace {

/// Converts points of a file whose z axis points up to Quoin's axes.
void turn_up(TriangleMesh& mesh) {
  for (DVec3& p : mesh.positions) p = {p.x, p.z, -p.y};
}

Result<LoadedMesh> read_as(std::optional<FileFormat> format, std::span<const std::byte> bytes, SidecarReader& sidecars,
                           std::optional<UpAxis> up) {
  if (!format) return make_error(ErrorCode::Unsupported, "unknown mesh format");
  const FormatDriver& driver = driver_of(*format);
  if (driver.read_mesh == nullptr) {
    return make_error(ErrorCode::Unsupported, std::string(format->name()) + " holds no triangles");
  }
  auto loaded = driver.read_mesh(bytes, sidecars);
  if (!loaded) return loaded;
  loaded->format = format->name();
  if (up.value_or(driver.info.up) == UpAxis::Z) turn_up(loaded->mesh);
  loaded->sidecars = std::move(sidecars.files());
  return loaded;
}

}  // namespace

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
  auto image = decode_image(file_bytes);
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
