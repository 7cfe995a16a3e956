#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/mesh/occlusion.h>
#include <quoin/version.h>

#include "io/material_palette.h"
#include "io/mesh_parts.h"

namespace quoin {

namespace {

std::string first_line() {
  return "# Quoin " + std::string(version()) + "\n";
}

/// Names in a line-based format: control characters and spaces become '_'.
std::string one_word(const std::string& name) {
  std::string word = name;
  for (char& c : word) {
    if (static_cast<unsigned char>(c) <= ' ' || c == '\x7F') c = '_';
  }
  return word;
}

constexpr std::size_t kMaxDigits = 40;

/// Writes whole and half numbers, the usual corners of voxels, as std::to_chars does; returns null for others. From
/// 100,000 on std::to_chars may choose an exponent.
char* write_halves(double value, char* out) {
  constexpr double kMost = 99'999.0;
  if (!(value >= -kMost && value <= kMost)) return nullptr;
  const auto halves = static_cast<std::int32_t>(value * 2.0);
  if (static_cast<double>(halves) != value * 2.0) return nullptr;
  if (halves < 0) *out++ = '-';
  const auto size = static_cast<std::uint32_t>(halves < 0 ? -halves : halves);
  out = std::to_chars(out, out + kMaxDigits, size / 2).ptr;
  if (size % 2 != 0) {
    *out++ = '.';
    *out++ = '5';
  }
  return out;
}

char* write_number(double value, char* out) {
  if (char* end = write_halves(value, out)) return end;
  const double rounded = std::round(value * 1e6) / 1e6 + 0.0;
  return std::to_chars(out, out + kMaxDigits, rounded).ptr;
}

/// Writes the elements of OBJ lines.
class ObjLines {
 public:
  explicit ObjLines(BlockWriter& out) : out_(out) {}

  /// Writes `value` rounded to a millionth.
  [[nodiscard]] static std::string text_of(double value);
  /// Writes "KEYWORD x y z" without a line end. `digits` 0: to a millionth, as far from the origin.
  void triple(std::string_view keyword, const DVec3& v, int digits = 0);
  /// Writes "o NAME" and a line end: the name as one word, with a number if it is not unique; "object" for an empty
  /// name.
  void object(const std::string& name);

 private:
  BlockWriter& out_;
  std::set<std::string> names_;
};

std::string ObjLines::text_of(double value) {
  std::array<char, kMaxDigits> room{};
  return {room.data(), write_number(value, room.data())};
}

void ObjLines::triple(std::string_view keyword, const DVec3& v, int digits) {
  char* at = out_.room(keyword.size() + 3 * (1 + kMaxDigits));
  at = std::copy(keyword.begin(), keyword.end(), at);
  for (int axis = 0; axis < 3; ++axis) {
    *at++ = ' ';
    // Nine digits have fractions only near the origin.
    constexpr double kMostOfDigits = 1 << 16;
    const bool is_to_a_millionth = digits == 0 || std::abs(v[axis]) > kMostOfDigits;
    at = is_to_a_millionth ? write_number(v[axis], at)
                           : std::to_chars(at, at + kMaxDigits, v[axis] + 0.0, std::chars_format::general, digits).ptr;
  }
  out_.advance(at);
}

void ObjLines::object(const std::string& name) {
  std::string word = one_word(name);
  if (word.empty()) word = "object";
  std::string unique = word;
  for (int n = 2; !names_.insert(unique).second; ++n) unique = word + "_" + std::to_string(n);
  out_.put_text("o " + unique + "\n");
}

std::string shortest(float value) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

/// Returns a material's name for OBJ and MTL, without spaces.
std::string mtl_name(const SurfaceMaterial& material) {
  std::string name = material.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

/// Returns the coverage, tint and refraction of glass as MTL lines. Most clients read `d`; they disagree about texture
/// alpha.
std::string mtl_glass(const SurfaceMaterial& material, const VoxelProperties& properties) {
  constexpr float kThousand = 1000.0F;
  const auto rounded = [](float value) { return shortest(std::round(value * kThousand) / kThousand); };
  std::string text("d ");
  text.append(rounded(material.glass.alpha)).append("\nTf");
  for (int channel = 0; channel < 3; ++channel) text.append(" ").append(rounded(material.glass.tint[channel]));
  if (std::isfinite(properties.ior) && properties.ior > 0.0F) text.append("\nNi ").append(rounded(properties.ior));
  text.append("\n");
  return text;
}

/// The names of an OBJ's sidecar files.
struct ObjNames {
  std::filesystem::path library;
  std::filesystem::path palette;
  std::filesystem::path emissive;
  std::filesystem::path atlas;
};

ObjNames names_beside(const std::filesystem::path& path) {
  const std::string stem = (path.parent_path() / path.stem()).string();
  return {stem + ".mtl", stem + "_palette.png", stem + "_emissive.png", stem + "_atlas.png"};
}

/// Writes one material for each of the palette's, by name. MTL has no emission strength, so Ke holds it.
std::string mtl_text(const SceneMeshes& meshes, const MaterialPalette& palette, const ObjNames& names) {
  std::string text = first_line();
  for (const SurfaceMaterial& material : palette.materials()) {
    text.append("\nnewmtl ").append(mtl_name(material)).append("\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\n");
    const bool is_in_atlas = material.surface == SurfaceClass::Opaque && !meshes.atlas.rgb.empty();
    text.append("map_Kd ").append((is_in_atlas ? names.atlas : names.palette).filename().string()).append("\n");
    if (material.is_transparent()) text.append(mtl_glass(material, meshes.types[material.type]));
    if (material.is_emissive()) {
      const std::string strength = shortest(material.emission);
      text.append("Ke ").append(strength).append(" ").append(strength).append(" ").append(strength);
      text.append("\nmap_Ke ").append(names.emissive.filename().string()).append("\n");
    }
  }
  return text;
}

bool has_triangle(const MeshView& view) {
  return !view.indices.empty();
}

bool has_blocks(const MeshPart& part) {
  return std::ranges::any_of(part.surfaces,
                             [](const MeshView& view) { return has_triangle(view) && !view.has_albedo(); });
}

/// Returns true if there are blocks: smooth meshes have no materials.
bool has_materials(const SceneMeshes& meshes) {
  return std::ranges::any_of(meshes.parts, has_blocks);
}

/// Writes the lines of one OBJ file, counting from 1 as OBJ does across all objects.
class ObjText {
 public:
  ObjText(const SceneMeshes& meshes, const MaterialPalette& palette, BlockWriter& out)
      : meshes_(meshes), palette_(palette), lines_(out), out_(out) {
    for (std::size_t occlusion = 0; occlusion < greys_.size(); ++occlusion) {
      const std::string grey = ObjLines::text_of(occlusion_brightness(static_cast<std::uint8_t>(occlusion)));
      for (int channel = 0; channel < 3; ++channel) greys_[occlusion].append(" ").append(grey);
    }
  }

  void write(const std::string& material_file) {
    out_.put_text(first_line());
    if (has_materials(meshes_)) {
      out_.put_text("mtllib " + material_file + "\n");
      write_texture_coordinates();
    }
    for (const MeshPlacement& placement : meshes_.placements) write_object(placement);
  }

 private:
  /// Writes one texture coordinate per type, so that type t has number t.
  void write_texture_coordinates() {
    for (std::size_t type = 1; type < meshes_.types.size(); ++type) {
      const auto centre = palette_.texel_centre(static_cast<VoxelType>(type));
      write_texture_coordinate(centre);
    }
    textures_ = meshes_.types.size() - 1;
  }

  /// OBJ counts v from the bottom. Textures have power-of-two sides, so their coordinates have few binary digits and
  /// both forms are exact.
  void write_texture_coordinate(const std::array<float, 2>& uv) {
    out_.put_text("vt " + shortest(uv[0]) + " " + shortest(1.0F - uv[1]) + "\n");
  }

  void write_object(const MeshPlacement& placement) {
    const MeshPart& part = meshes_.parts[placement.part];
    if (std::ranges::none_of(part.surfaces, has_triangle)) return;
    const VertexTransform transform(placement.matrix(), part.pivot);
    lines_.object(name_of(meshes_, placement));
    if (has_blocks(part)) return write_blocks(part, transform);
    for (const MeshView& view : part.surfaces) {
      if (has_triangle(view)) write_smooth(view, transform);
    }
  }

  void write_blocks(const MeshPart& part, const VertexTransform& transform) {
    const MaterialSurfaces split(part, palette_);
    write_face_normals(transform);
    for (const auto& [view, material] : split.surfaces()) {
      write_vertices(view, transform);
      out_.put_text("usemtl " + mtl_name(palette_.materials()[material]) + "\n");
      for (const std::array<float, 2>& uv : view.atlas) write_texture_coordinate(uv);
      write_faces(view, transform.mirrors(), [&view = view, this](std::uint32_t corner) {
        const std::uint64_t texture = view.atlas.empty() ? view.types[corner] : textures_ + corner + 1;
        return std::pair(static_cast<std::uint64_t>(view.directions[corner]), texture);
      });
      vertices_ += view.positions.size();
      textures_ += view.atlas.size();
    }
    normals_ += kDirections.size();
  }

  void write_face_normals(const VertexTransform& transform) {
    for (const Direction direction : kDirections) {
      lines_.triple("vn", transform.normal(Vec3(normal_of(direction))));
      out_.put('\n');
    }
  }

  void write_vertices(const MeshView& view, const VertexTransform& transform) {
    for (std::size_t i = 0; i < view.positions.size() && !out_.failed(); ++i) {
      lines_.triple("v", transform.position(view.positions[i]));
      if (!view.block_occlusion.empty()) out_.put_text(greys_[view.block_occlusion[i]]);
      out_.put('\n');
    }
  }

  /// `normal_and_texture(corner)`: the number of its normal within the object, and its texture coordinate or 0.
  template <class Numbers>
  void write_faces(const MeshView& view, bool turned, Numbers normal_and_texture) {
    constexpr std::size_t kMaxOfCorner = 64;
    for (std::size_t i = 0; i < view.indices.size() && !out_.failed(); i += 3) {
      char* at = out_.room(2 + 3 * kMaxOfCorner);
      *at++ = 'f';
      for (const std::uint32_t corner : corners_of(view, i, turned)) {
        const auto [normal, texture] = normal_and_texture(corner);
        char* const end = at + kMaxOfCorner;
        *at++ = ' ';
        at = std::to_chars(at, end, vertices_ + corner + 1).ptr;
        *at++ = '/';
        if (texture != 0) at = std::to_chars(at, end, texture).ptr;
        *at++ = '/';
        at = std::to_chars(at, end, normals_ + normal + 1).ptr;
      }
      *at++ = '\n';
      out_.advance(at);
    }
  }

  /// Writes coloured vertices, normals and triangles of a smooth surface.
  void write_smooth(const MeshView& view, const VertexTransform& transform) {
    constexpr int kFloatDigits = 9;
    constexpr int kColourDigits = 4;
    for (std::size_t i = 0; i < view.positions.size() && !out_.failed(); ++i) {
      lines_.triple("v", transform.position(view.positions[i]), kFloatDigits);
      const auto colour = srgb_colour(view, i);
      lines_.triple("", DVec3(colour[0], colour[1], colour[2]) / 255.0, kColourDigits);
      out_.put('\n');
    }
    for (std::size_t i = 0; i < view.normals.size() && !out_.failed(); ++i) {
      lines_.triple("vn", transform.normal(view.normals[i]));
      out_.put('\n');
    }
    write_faces(view, transform.mirrors(),
                [](std::uint32_t corner) { return std::pair(std::uint64_t{corner}, std::uint64_t{0}); });
    vertices_ += view.positions.size();
    normals_ += view.positions.size();
  }

  const SceneMeshes& meshes_;
  const MaterialPalette& palette_;
  ObjLines lines_;
  BlockWriter& out_;
  std::array<std::string, 4> greys_;  ///< " r g b" by occlusion
  std::uint64_t vertices_ = 0;
  std::uint64_t normals_ = 0;
  std::uint64_t textures_ = 0;
};

/// An estimate, for progress only.
std::uint64_t expected_bytes(const SceneMeshes& meshes) {
  constexpr std::uint64_t kVertexLine = 24;
  constexpr std::uint64_t kSmoothVertexLines = 80;
  constexpr std::uint64_t kFaceLine = 42;
  std::uint64_t bytes = 1;
  for (const MeshPlacement& placement : meshes.placements) {
    for (const MeshView& view : meshes.parts[placement.part].surfaces) {
      const std::uint64_t vertex = view.has_albedo() ? kSmoothVertexLines : kVertexLine;
      bytes += view.positions.size() * vertex + view.indices.size() / 3 * kFaceLine;
    }
  }
  return bytes;
}

/// Adds an image file next to the OBJ.
Status add_image(const std::filesystem::path& path, const PngImage& image, std::vector<MeshFile>& files) {
  auto png = encode_png(image);
  if (!png) return png.error();
  files.push_back({path, 0, [bytes = std::move(*png)](BlockWriter& out) { out.put(std::span(bytes)); }});
  return {};
}

}  // namespace

Result<std::vector<MeshFile>> plan_obj(const SceneMeshes& meshes, const std::filesystem::path& path) {
  const auto palette = std::make_shared<const MaterialPalette>(meshes);
  const ObjNames names = names_beside(path);
  std::vector<MeshFile> files;
  if (has_materials(meshes)) {
    if (auto added = add_image(names.palette, palette->opaque_colour(), files); !added) {
      return added.error();
    }
    if (palette->has_emission()) {
      if (auto added = add_image(names.emissive, palette->emissive(), files); !added) {
        return added.error();
      }
    }
    if (!meshes.atlas.rgb.empty()) {
      if (auto added = add_image(names.atlas, png_of(meshes.atlas), files); !added) return added.error();
    }
    std::string text = mtl_text(meshes, *palette, names);
    files.push_back({names.library, 0, [text = std::move(text)](BlockWriter& out) { out.put_text(text); }});
  }
  const auto write = [&meshes, palette, library = names.library.filename().string()](BlockWriter& out) {
    ObjText(meshes, *palette, out).write(library);
  };
  files.push_back({path, expected_bytes(meshes), write});
  return files;
}

std::vector<std::filesystem::path> obj_companions(const SceneMeshes& meshes, const std::filesystem::path& path) {
  if (!has_materials(meshes)) return {};
  const ObjNames names = names_beside(path);
  std::vector<std::filesystem::path> files = {names.library, names.palette};
  if (!meshes.atlas.rgb.empty()) files.push_back(names.atlas);
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      const bool emits = view.surface == SurfaceClass::Emissive || view.surface == SurfaceClass::EmissiveTransparent;
      if (emits && files.back() != names.emissive) files.push_back(names.emissive);
    }
  }
  return files;
}

}  // namespace quoin
