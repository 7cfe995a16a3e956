#include <quoin/io/mesh_file.h>

#include <utility>

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

/// The files, of sound meshes. Errors: Unsupported, and those of the formats.
Result<std::vector<MeshFile>> plan(const SceneMeshes& meshes, FileFormat format, const std::filesystem::path& path,
                                   OcclusionIn occlusion) {
  if (auto sound = check_meshes(meshes); !sound) return sound.error();
  switch (format) {
    case FileFormat::Glb:
      return plan_glb(meshes, path, occlusion);
    case FileFormat::Gltf:
      return plan_gltf(meshes, path, occlusion);
    case FileFormat::Obj:
      if (occlusion == OcclusionIn::Attribute) {
        return make_error(ErrorCode::Unsupported,
                          "OBJ has no place for occlusion beside colours; .glb, .gltf and .ply have");
      }
      return plan_obj(meshes, path);
    case FileFormat::Ply:
      return plan_ply(meshes, path, occlusion);
    case FileFormat::Vox:
    case FileFormat::Scene:
    case FileFormat::Nifti:
    case FileFormat::Nrrd:
      break;
  }
  return make_error(ErrorCode::Unsupported, std::string(format_info(format).extension) + " is no format of meshes");
}

/// The same meshes without occlusion.
SceneMeshes without_occlusion(SceneMeshes meshes) {
  for (MeshPart& part : meshes.parts) {
    for (MeshView& view : part.surfaces) view = without_occlusion(view);
  }
  return meshes;
}

const Progress kNobody;

/// Calls `file.write` with a writer that ends in `sink`; returns the bytes.
Result<std::uint64_t> write_to(BlockWriter::Sink sink, const MeshFile& file, const Progress& progress) {
  BlockWriter out(std::move(sink), file.expected_bytes > 0 ? progress : kNobody, file.expected_bytes);
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
  const auto files = plan(meshes, *format, path, options.occlusion_in);
  if (!files) return files.error();
  return write_files(*files, progress);
}

}  // namespace

Result<std::uint64_t> write_mesh(const SceneMeshes& meshes, const std::filesystem::path& path,
                                 const MeshFileOptions& options, const Progress& progress) {
  if (options.occlusion) return with_path(write_checked(meshes, path, options, progress), path);
  return with_path(write_checked(without_occlusion(meshes), path, options, progress), path);
}

Result<std::vector<std::byte>> write_mesh(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& options,
                                          const Progress& progress) {
  if (!options.occlusion) {
    MeshFileOptions plain = options;
    plain.occlusion = true;
    return write_mesh(without_occlusion(meshes), format, plain, progress);
  }
  const auto files = plan(meshes, format, "", options.occlusion_in);
  if (!files) return files.error();
  if (files->size() > 1) return make_error(ErrorCode::Unsupported, "the meshes take several files in this format");
  std::vector<std::byte> bytes;
  const auto sink = [&](std::span<const std::byte> block) {
    bytes.insert(bytes.end(), block.begin(), block.end());
    return Status();
  };
  if (auto written = write_to(sink, files->front(), progress); !written) {
    return written.error();
  }
  return bytes;
}

Result<std::vector<std::filesystem::path>> mesh_files(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                      const MeshFileOptions& options) {
  const auto format = format_of(path, options);
  if (!format) return format.error();
  if (!format_info(*format).is_mesh) return make_error(ErrorCode::Unsupported, "not a mesh format", path.string());
  std::vector<std::filesystem::path> files = {path};
  const auto beside = *format == FileFormat::Gltf  ? gltf_companions(meshes, path)
                      : *format == FileFormat::Obj ? obj_companions(meshes, path)
                                                   : std::vector<std::filesystem::path>();
  files.insert(files.end(), beside.begin(), beside.end());
  return files;
}

}  // namespace quoin
