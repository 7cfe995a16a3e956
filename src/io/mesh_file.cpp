#include <quoin/io/mesh_file.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <numbers>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <glm/common.hpp>
#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "io/format_driver.h"
#include "io/material_palette.h"
#include "io/mesh_parts.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

Result<FileFormat> format_of(const std::filesystem::path& path, const MeshFileOptions& options) {
  if (options.format) return *options.format;
  const auto format = format_for_writing(path);
  if (!format) return format.error();
  return format->format;
}

/// Returns the driver of a format that a caller passed. Errors: InvalidArgument for a name of no format.
Result<const FormatDriver*> find_driver(FileFormat format) {
  const auto info = [](const FormatDriver* driver) { return driver->info.format; };
  const auto drivers = format_drivers();
  const auto found = std::ranges::find(drivers, format, info);
  if (found != drivers.end()) return *found;
  return make_error(ErrorCode::InvalidArgument,
                    "cannot write meshes: no format is named \"" + std::string(format.name()) + "\"");
}

/// Returns the driver of a mesh format. Errors: InvalidArgument, Unsupported.
Result<const FormatDriver*> driver_for_meshes(FileFormat format) {
  auto driver = find_driver(format);
  if (!driver || (*driver)->plan_mesh != nullptr) return driver;
  if (!(*driver)->left_out.empty()) return left_out_error(**driver);
  return make_error(ErrorCode::Unsupported, std::string((*driver)->info.extension) + " is not a mesh format");
}

/// Returns an error if a format cannot store something in the meshes or options. Errors: Unsupported.
Status check_format(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& options) {
  struct Need {
    bool is_needed;
    FormatCapability capability;
    std::string_view content;
  };
  const Need needs[] = {
      {options.compress, FormatCapability::Compression, "compressed meshes"},
      {options.quantize, FormatCapability::Compression, "quantized meshes"},
      {!meshes.atlas.rgb.empty(), FormatCapability::Textures, "an occlusion atlas"},
      {options.textures_in == TexturesIn::Atlas && meshes.types.has_textures(), FormatCapability::Textures,
       "an atlas of textures"},
      {options.occlusion_in == OcclusionIn::Attribute, FormatCapability::OcclusionAttribute,
       "occlusion as an attribute"},
      {has_light(meshes), FormatCapability::VertexLight, "light per vertex"},
  };
  for (const Need& need : needs) {
    if (!need.is_needed) continue;
    if (Status able = check_capability(format, need.capability, need.content); !able) return able;
  }
  return {};
}

/// Returns true if a triangle of blocks lies in the face of one voxel.
bool is_in_voxel(const MeshView& view, std::size_t first_index) {
  const std::uint32_t* const corner = view.indices.data() + first_index;
  const Vec3& a = view.positions[corner[0]];
  const Vec3& b = view.positions[corner[1]];
  const Vec3& c = view.positions[corner[2]];
  const Vec3 extent = glm::max(glm::max(a, b), c) - glm::floor(glm::min(glm::min(a, b), c));
  return extent.x <= 1.0F && extent.y <= 1.0F && extent.z <= 1.0F;
}

/// An atlas cannot repeat a texture on a merged face. Shapes have coordinates of their own. Errors: InvalidArgument.
Status check_face_sizes(const SceneMeshes& meshes) {
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      for (std::size_t i = 0; !view.has_albedo() && i < view.indices.size(); i += 3) {
        const std::uint32_t corner = view.indices[i];
        const bool is_shape = !view.looks.empty() && view.looks[corner].is_shape;
        if (is_shape || meshes.types[view.types[corner]].faces.empty() || is_in_voxel(view, i)) continue;
        return make_error(ErrorCode::InvalidArgument,
                          "cannot put textures into an atlas: part \"" + part.name +
                              "\" has faces of several voxels (mesh with BlockySceneOptions::atlas)");
      }
    }
  }
  return {};
}

/// Returns the files of meshes. Errors: Unsupported; InvalidArgument; those of the formats.
Result<std::vector<MeshFile>> plan(const SceneMeshes& meshes, FileFormat format, const std::filesystem::path& path,
                                   const MeshFileOptions& options) {
  const auto driver = driver_for_meshes(format);
  if (!driver) return driver.error();
  if (Status able = check_format(meshes, format, options); !able) return able.error();
  if (auto sound = check_meshes(meshes); !sound) return sound.error();
  if (face_colours_in(options) == FaceColours::Atlas && meshes.types.has_textures()) {
    if (auto sound = check_face_sizes(meshes); !sound) return sound.error();
  }
  return (*driver)->plan_mesh(meshes, path, options);
}

/// Returns the meshes without occlusion.
SceneMeshes without_occlusion(SceneMeshes meshes) {
  for (MeshPart& part : meshes.parts) {
    for (MeshView& view : part.surfaces) view = without_occlusion(view);
  }
  meshes.atlas = {};
  return meshes;
}

/// Maps (x, y, z) to (x, -z, y): +Y becomes +Z.
DVec3 turned(const DVec3& v) {
  return {v.x, -v.z, v.y};
}

Similarity placed_in(const MeshFileOptions& options, Similarity place) {
  if (options.up == UpAxis::Z) {
    const double half = std::numbers::sqrt2 / 2.0;
    place.position = turned(place.position);
    place.rotation = DQuat(half, half, 0.0, 0.0) * place.rotation;
  }
  place.position *= options.scale;
  return place;
}

/// Scales lamps so that surfaces at the scaled distance are lit equally.
void place_lights(const MeshFileOptions& options, SceneMeshes& meshes) {
  const auto direction = [&](const DVec3& v) { return options.up == UpAxis::Z ? turned(v) : v; };
  for (Lamp& lamp : meshes.lamps) {
    lamp.position = direction(lamp.position) * options.scale;
    lamp.direction = direction(lamp.direction);
    lamp.intensity *= options.scale * options.scale;
    lamp.range *= options.scale;
  }
  for (MeshCamera& each : meshes.cameras) {
    Camera& camera = each.camera;
    camera.position = direction(camera.position) * options.scale;
    for (DVec3* const axis : {&camera.right, &camera.up, &camera.forward}) *axis = direction(*axis);
    camera.view_height *= options.scale;
  }
}

/// Returns the meshes in the units and axes of the file.
Result<SceneMeshes> in_axes_of_file(SceneMeshes meshes, const MeshFileOptions& options) {
  if (!(options.scale > 0.0) || !std::isfinite(options.scale)) {
    return make_error(ErrorCode::InvalidArgument, "the scale must be more than 0");
  }
  if (options.scale == 1.0 && options.up == UpAxis::Y) return meshes;
  place_lights(options, meshes);
  for (MeshGroup& group : meshes.groups) group.world_from_group = placed_in(options, group.world_from_group);
  for (MeshPlacement& placement : meshes.placements) {
    for (MeshKey& key : placement.keys) {
      key.world_from_part = placed_in(options, key.world_from_part);
      key.world_from_part.scale *= options.scale;
    }
    if (auto* place = std::get_if<Similarity>(&placement.world_from_part)) {
      *place = placed_in(options, *place);
      place->scale *= options.scale;
      continue;
    }
    auto& matrix = std::get<glm::dmat4>(placement.world_from_part);
    for (int column = 0; column < 4; ++column) {
      const DVec3 axis(matrix[column]);
      const DVec3 written = (options.up == UpAxis::Z ? turned(axis) : axis) * options.scale;
      matrix[column] = glm::dvec4(written, matrix[column].w);
    }
  }
  return meshes;
}

/// Returns the meshes as the options require.
Result<SceneMeshes> as_written(const SceneMeshes& meshes, const MeshFileOptions& options) {
  return in_axes_of_file(options.write_occlusion ? meshes : without_occlusion(meshes), options);
}

const Progress kNoProgress;

/// Calls `file.write` with a writer to `sink`. Returns the number of bytes.
Result<std::uint64_t> write_to(BlockWriter::Sink sink, const MeshFile& file, const Progress& progress) {
  BlockWriter out(std::move(sink), file.expected_bytes > 0 ? progress : kNoProgress, file.expected_bytes);
  file.write(out);
  if (auto written = out.finish(); !written) return written.error();
  return out.bytes();
}

Result<std::uint64_t> write_files(const std::vector<MeshFile>& files, const Progress& progress) {
  std::uint64_t bytes = 0;
  std::vector<AtomicFile> written;
  for (const MeshFile& file : files) {
    auto target = AtomicFile::create(file.path);
    if (!target) return target.error();
    const auto sink = [&](std::span<const std::byte> block) { return target->write(block); };
    auto more = write_to(sink, file, progress);
    if (!more) return more;
    bytes += *more;
    // Closed: there may be more files than a process may open.
    if (auto finished = target->finish(); !finished) return finished.error();
    written.push_back(std::move(*target));
  }
  for (AtomicFile& file : written) {
    if (auto done = file.commit(); !done) return done.error();
  }
  return bytes;
}

Result<std::uint64_t> write_checked(const SceneMeshes& meshes, const std::filesystem::path& path,
                                    const MeshFileOptions& options, const Progress& progress) {
  const auto format = format_of(path, options);
  if (!format) return format.error();
  const auto files = plan(meshes, *format, path, options);
  if (!files) return files.error();
  return write_files(*files, progress);
}

}  // namespace

Result<std::uint64_t> write_mesh(const SceneMeshes& meshes, const std::filesystem::path& path,
                                 const MeshFileOptions& options, const Progress& progress) {
  const auto written = as_written(meshes, options);
  if (!written) return with_path(Result<std::uint64_t>(written.error()), path);
  return with_path(write_checked(*written, path, options, progress), path);
}

Result<std::vector<std::byte>> write_mesh(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& options,
                                          const Progress& progress) {
  const auto wanted = as_written(meshes, options);
  if (!wanted) return wanted.error();
  const auto files = plan(*wanted, format, "", options);
  if (!files) return files.error();
  if (files->size() > 1) return make_error(ErrorCode::Unsupported, "this format stores the meshes in several files");
  std::vector<std::byte> bytes;
  bytes.reserve(static_cast<std::size_t>(files->front().expected_bytes));
  const auto sink = [&](std::span<const std::byte> block) {
    bytes.insert(bytes.end(), block.begin(), block.end());
    return Status();
  };
  if (auto written = write_to(sink, files->front(), progress); !written) {
    return written.error();
  }
  return bytes;
}

DVec3 mesh_file_offset(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& options) {
  const auto driver = find_driver(format);
  const double most_steps = driver ? (*driver)->most_steps : 0.0;
  const auto written = as_written(meshes, options);
  if (most_steps == 0.0 || !written || !check_meshes(*written)) return DVec3(0.0);
  return file_origin(*written, most_steps);
}

Result<std::vector<std::filesystem::path>> mesh_files(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                      const MeshFileOptions& options) {
  const auto format = format_of(path, options);
  if (!format) return format.error();
  const auto driver = driver_for_meshes(*format);
  if (!driver) return with_path(Result<std::vector<std::filesystem::path>>(driver.error()), path);
  std::vector<std::filesystem::path> files = {path};
  if ((*driver)->mesh_companions != nullptr) {
    std::ranges::move((*driver)->mesh_companions(meshes, path, options), std::back_inserter(files));
  }
  return files;
}

namespace {

struct Bits {
  std::array<std::uint32_t, 3> of;
  bool operator==(const Bits&) const = default;
};

struct BitsHash {
  std::size_t operator()(const Bits& bits) const { return mixed_with(mixed_with(bits.of[0], bits.of[1]), bits.of[2]); }
};

struct KeyHash {
  std::size_t operator()(std::uint64_t key) const { return mixed_with(key, key >> 32); }
};

/// The uses of an edge, by direction.
struct Uses {
  std::uint32_t there = 0;
  std::uint32_t back = 0;
};

std::uint64_t open_edges_of(const MeshPart& part) {
  std::unordered_map<Bits, std::uint32_t, BitsHash> numbers;
  std::unordered_map<std::uint64_t, Uses, KeyHash> edges;
  const auto number_of = [&](const Vec3& at) {
    // 0 and -0 are the same position.
    const Bits bits{{std::bit_cast<std::uint32_t>(at.x + 0.0F), std::bit_cast<std::uint32_t>(at.y + 0.0F),
                     std::bit_cast<std::uint32_t>(at.z + 0.0F)}};
    return numbers.try_emplace(bits, static_cast<std::uint32_t>(numbers.size())).first->second;
  };
  for (const MeshView& view : part.surfaces) {
    for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
      std::array<std::uint32_t, 3> corner{};
      for (std::size_t k = 0; k < 3; ++k) {
        QUOIN_ASSERT(view.indices[i + k] < view.positions.size(), "an index of a vertex");
        corner[k] = number_of(view.positions[view.indices[i + k]]);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = corner[k];
        const std::uint32_t to = corner[(k + 1) % 3];
        Uses& uses = edges[std::uint64_t{std::min(from, to)} << 32 | std::max(from, to)];
        ++(from < to ? uses.there : uses.back);
      }
    }
  }
  std::uint64_t open = 0;
  for (const auto& [edge, uses] : edges) open += uses.there == 1 && uses.back == 1 ? 0 : 1;
  return open;
}

}  // namespace

std::uint64_t count_open_edges(const SceneMeshes& meshes) {
  std::vector<std::uint64_t> of_part(meshes.parts.size());
  std::vector<bool> is_known(meshes.parts.size());
  std::uint64_t open = 0;
  for (const MeshPlacement& placement : meshes.placements) {
    QUOIN_ASSERT(placement.part < meshes.parts.size(), "a part of the meshes");
    if (!is_known[placement.part]) of_part[placement.part] = open_edges_of(meshes.parts[placement.part]);
    is_known[placement.part] = true;
    open += of_part[placement.part];
  }
  return open;
}

}  // namespace quoin
