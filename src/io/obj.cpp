#include <quoin/io/obj.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/mesh/occlusion.h>

#include "io/block_writer.h"
#include "io/material_palette.h"
#include "io/mtl.h"
#include "io/obj_lines.h"
#include "io/placement.h"
#include "io/surface_parts.h"
#include "scene/instance_axes.h"

namespace quoin {

namespace {

/// Writes the lines of one OBJ file, counting from 1 as OBJ does across all objects.
class ObjText {
 public:
  ObjText(const Scene& scene, const SceneMeshes& meshes, BlockWriter& out)
      : scene_(scene), meshes_(meshes), lines_(out), out_(out), palette_(scene.types, meshes) {
    for (std::uint8_t level = 0; level < greys_.size(); ++level) {
      std::string grey = " ";
      grey += ObjLines::text_of(occlusion_brightness(level));
      greys_[level] = grey + grey + grey;
    }
  }

  void write(const std::string& material_file) {
    out_.put_text("# Quoin " QUOIN_VERSION "\nmtllib " + material_file + "\n");
    write_texture_coordinates();
    for (const InstanceHandle handle : scene_.instances().handles()) {
      const Instance& instance = scene_.instances()[handle];
      if (is_drawn(scene_, instance, meshes_.hidden)) write_object(instance);
    }
  }

 private:
  /// One texture coordinate a type, so that type t is number t.
  void write_texture_coordinates() {
    for (std::size_t type = 1; type < scene_.types.size(); ++type) {
      const auto centre = palette_.texel_centre(static_cast<VoxelType>(type));
      std::array<char, 64> text{};
      // OBJ counts v from the bottom; the centres have few binary digits, so both forms are exact.
      auto end = std::to_chars(text.data(), text.data() + 32, centre[0]).ptr;
      *end++ = ' ';
      end = std::to_chars(end, text.data() + text.size(), 1.0F - centre[1]).ptr;
      out_.put_text("vt ");
      out_.put_text({text.data(), end});
      out_.put('\n');
    }
  }

  void write_object(const Instance& instance) {
    const BlockyMesh* mesh = meshes_.find(instance.grid);
    if (mesh == nullptr) return;
    const SceneGrid& grid = scene_.grids()[instance.grid];
    const SurfaceParts parts(*mesh, palette_);
    if (parts.parts().empty()) return;
    lines_.object(instance.name.empty() ? grid.name : instance.name);
    write_normals(instance);
    for (const SurfacePart& part : parts.parts()) {
      write_vertices(instance, grid, *part.triangles);
      out_.put_text("usemtl " + mtl_name(palette_.materials()[part.material]) + "\n");
      write_faces(*part.triangles, instance.mirrored);
      vertices_ += part.triangles->positions.size();
    }
    normals_ += kDirections.size();
  }

  void write_normals(const Instance& instance) {
    for (const Direction direction : kDirections) {
      DVec3 normal(normal_of(direction));
      if (instance.mirrored) normal.x = -normal.x;
      lines_.triple("vn", glm::normalize(instance.rotation) * normal);
      out_.put('\n');
    }
  }

  void write_vertices(const Instance& instance, const SceneGrid& grid, const BlockyTriangles& triangles) {
    const glm::dmat3 axes = world_axes(instance);
    for (std::size_t i = 0; i < triangles.positions.size() && !out_.failed(); ++i) {
      const DVec3 from_pivot = (DVec3(triangles.positions[i]) - grid.pivot) * instance.voxel_size;
      lines_.triple("v", instance.position + axes * from_pivot);
      if (meshes_.occlusion) out_.put_text(greys_[triangles.levels[i]]);
      out_.put('\n');
    }
  }

  void write_faces(const BlockyTriangles& triangles, bool mirrored) {
    const std::size_t second = mirrored ? 2 : 1;
    for (std::size_t i = 0; i + 2 < triangles.indices.size() && !out_.failed(); i += 3) {
      out_.put('f');
      write_corner(triangles, triangles.indices[i]);
      write_corner(triangles, triangles.indices[i + second]);
      write_corner(triangles, triangles.indices[i + 3 - second]);
      out_.put('\n');
    }
  }

  void write_corner(const BlockyTriangles& triangles, std::uint32_t vertex) {
    constexpr std::size_t kMost = 64;
    char* text = out_.room(kMost);
    char* const end = text + kMost;
    *text++ = ' ';
    text = std::to_chars(text, end, vertices_ + vertex + 1).ptr;
    *text++ = '/';
    text = std::to_chars(text, end, triangles.types[vertex]).ptr;
    *text++ = '/';
    text = std::to_chars(text, end, normals_ + static_cast<std::uint64_t>(triangles.directions[vertex]) + 1).ptr;
    out_.advance(text);
  }

  const Scene& scene_;
  const SceneMeshes& meshes_;
  ObjLines lines_;
  BlockWriter& out_;
  MaterialPalette palette_;
  std::array<std::string, 4> greys_;  ///< " r g b" by level of occlusion
  std::uint64_t vertices_ = 0;
  std::uint64_t normals_ = 0;
};

/// A guess, for progress only.
std::uint64_t expected_bytes(const Scene& scene, const SceneMeshes& meshes) {
  constexpr std::int64_t kVertexLine = 24;
  constexpr std::int64_t kFaceLine = 42;
  std::int64_t bytes = 1;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const BlockyMesh* mesh = is_drawn(scene, instance, meshes.hidden) ? meshes.find(instance.grid) : nullptr;
    if (mesh != nullptr) bytes += mesh->vertex_count() * kVertexLine + mesh->triangle_count() * kFaceLine;
  }
  return static_cast<std::uint64_t>(bytes);
}

/// The names of the files that belong to one OBJ.
struct ObjNames {
  std::filesystem::path library;
  std::filesystem::path palette;
  std::filesystem::path emissive;
};

ObjNames names_beside(const std::filesystem::path& path) {
  const std::string stem = (path.parent_path() / path.stem()).string();
  return {stem + ".mtl", stem + "_palette.png", stem + "_emissive.png"};
}

struct Companion {
  std::filesystem::path path;
  std::vector<std::byte> bytes;
};

/// The files beside the OBJ, in the order in which they are put in place.
Result<std::vector<Companion>> companions(const Scene& scene, const SceneMeshes& meshes,
                                          const std::filesystem::path& path) {
  const MaterialPalette palette(scene.types, meshes);
  const ObjNames names = names_beside(path);
  std::vector<Companion> files;
  auto base = encode_png(palette.base_colour());
  if (!base) return tl::unexpected<Error>(base.error());
  files.push_back({names.palette, std::move(*base)});
  if (palette.has_emission()) {
    auto emissive = encode_png(palette.emissive());
    if (!emissive) return tl::unexpected<Error>(emissive.error());
    files.push_back({names.emissive, std::move(*emissive)});
  }
  const std::string text = mtl_text(palette, names.palette.filename().string(), names.emissive.filename().string());
  const auto bytes = std::as_bytes(std::span(text));
  files.push_back({names.library, {bytes.begin(), bytes.end()}});
  return files;
}

/// All files are written before any is put in place, so that a full disk changes nothing.
Result<std::uint64_t> write_files(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                  const std::vector<Companion>& beside, const Progress& progress) {
  std::uint64_t bytes = 0;
  std::vector<AtomicFile> files;
  for (const Companion& companion : beside) {
    auto file = AtomicFile::create(companion.path);
    if (!file) return tl::unexpected<Error>(file.error());
    if (auto written = file->write(companion.bytes); !written) return tl::unexpected<Error>(written.error());
    bytes += companion.bytes.size();
    files.push_back(std::move(*file));
  }
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  BlockWriter out(*file, progress, expected_bytes(scene, meshes));
  ObjText(scene, meshes, out).write(beside.back().path.filename().string());
  if (auto written = out.finish(); !written) return tl::unexpected<Error>(written.error());
  files.push_back(std::move(*file));
  for (AtomicFile& each : files) {
    if (auto done = each.commit(); !done) return tl::unexpected<Error>(done.error());
  }
  return bytes + out.bytes();
}

}  // namespace

Result<std::uint64_t> write_obj(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                const Progress& progress) {
  if (auto sound = check_placements(scene, meshes.hidden); !sound) {
    sound.error().path = path.string();
    return tl::unexpected<Error>(sound.error());
  }
  const auto beside = companions(scene, meshes, path);
  auto bytes = beside ? write_files(scene, meshes, path, *beside, progress)
                      : Result<std::uint64_t>(tl::unexpected<Error>(beside.error()));
  if (!bytes && bytes.error().path.empty()) bytes.error().path = path.string();
  return bytes;
}

std::vector<std::filesystem::path> obj_files(const SceneMeshes& meshes, const std::filesystem::path& path) {
  const ObjNames names = names_beside(path);
  std::vector<std::filesystem::path> files = {path, names.library, names.palette};
  const bool emits = std::any_of(meshes.grids.begin(), meshes.grids.end(), [](const GridMesh& grid) {
    return !grid.mesh.surfaces[static_cast<std::size_t>(SurfaceClass::Emissive)].types.empty() ||
           !grid.mesh.surfaces[static_cast<std::size_t>(SurfaceClass::EmissiveTransparent)].types.empty();
  });
  if (emits) files.push_back(names.emissive);
  return files;
}

}  // namespace quoin
