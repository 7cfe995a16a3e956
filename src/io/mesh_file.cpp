#include <quoin/io/mesh_file.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

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

/// Returns the files of valid meshes. Errors: Unsupported; those of the formats.
Result<std::vector<MeshFile>> plan(const SceneMeshes& meshes, FileFormat format, const std::filesystem::path& path,
                                   const MeshFileOptions& options) {
  const bool is_gltf = format == FileFormat::Glb || format == FileFormat::Gltf;
  if ((options.compress || options.quantize) && !is_gltf) {
    return make_error(ErrorCode::Unsupported,
                      std::string("only .glb and .gltf can be ") + (options.compress ? "compressed" : "quantized"));
  }
  const bool is_print = format == FileFormat::Stl || format == FileFormat::ThreeMf;
  if (!meshes.atlas.rgb.empty() && (is_print || format == FileFormat::Ply)) {
    return make_error(ErrorCode::Unsupported,
                      std::string(format_info(format).extension) + " cannot store textures; use .glb, .gltf or .obj");
  }
  if (is_print && options.occlusion_in == OcclusionIn::Attribute) {
    return make_error(ErrorCode::Unsupported, "files for printing cannot store occlusion");
  }
  if (has_light(meshes) && !is_gltf) {
    return make_error(ErrorCode::Unsupported, "only .glb and .gltf can store light per vertex");
  }
  if (auto sound = check_meshes(meshes); !sound) return sound.error();
  switch (format) {
    case FileFormat::Glb:
      return plan_glb(meshes, path, options);
    case FileFormat::Gltf:
      return plan_gltf(meshes, path, options);
    case FileFormat::Obj:
      if (options.occlusion_in == OcclusionIn::Attribute) {
        return make_error(ErrorCode::Unsupported,
                          "OBJ cannot store occlusion in addition to colours; use .glb, .gltf or .ply");
      }
      return plan_obj(meshes, path);
    case FileFormat::Ply:
      return plan_ply(meshes, path, options);
    case FileFormat::Stl:
      return plan_stl(meshes, path);
    case FileFormat::ThreeMf:
      return plan_three_mf(meshes, path);
    case FileFormat::Off:
    case FileFormat::Vox:
    case FileFormat::Scene:
    case FileFormat::World:
    case FileFormat::Minecraft:
    case FileFormat::Schematic:
    case FileFormat::Qubicle:
    case FileFormat::Goxel:
    case FileFormat::Voxlap:
    case FileFormat::Binvox:
    case FileFormat::CubeWorld:
    case FileFormat::LuantiSchematic:
    case FileFormat::LuantiMap:
    case FileFormat::Heights:
    case FileFormat::Vdb:
    case FileFormat::Nifti:
    case FileFormat::Nrrd:
      break;
  }
  return make_error(ErrorCode::Unsupported, std::string(format_info(format).extension) + " is not a mesh format");
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
  const bool has_offset = format == FileFormat::Ply || format == FileFormat::Stl;
  const auto written = as_written(meshes, options);
  if (!has_offset || !written || !check_meshes(*written)) return DVec3(0.0);
  return file_origin(*written, format == FileFormat::Ply ? kMostStepsOfPly : kMostStepsOfStl);
}

Result<std::vector<std::filesystem::path>> mesh_files(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                      const MeshFileOptions& options) {
  const auto format = format_of(path, options);
  if (!format) return format.error();
  if (!format_info(*format).is_mesh) return make_error(ErrorCode::Unsupported, "not a mesh format", path.string());
  std::vector<std::filesystem::path> files = {path};
  const auto companions = *format == FileFormat::Gltf  ? gltf_companions(meshes, path)
                          : *format == FileFormat::Obj ? obj_companions(meshes, path)
                                                       : std::vector<std::filesystem::path>();
  files.insert(files.end(), companions.begin(), companions.end());
  return files;
}

}  // namespace quoin
