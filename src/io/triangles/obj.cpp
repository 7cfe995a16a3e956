// Wavefront OBJ and MTL, by tinyobjloader.

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <map>
#include <memory>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/version.h>

#include "core/bytes/bytes.h"
#include "core/srgb.h"
#include "io/format_driver.h"
#include "io/material_palette.h"
#include "io/mesh_parts.h"
#include "io/triangles/triangles.h"

#ifdef QUOIN_HAVE_TINYOBJLOADER
#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>
#endif

namespace quoin::triangles {

namespace {

// The UTF-8 byte order mark, which Windows programs write before a text.
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool is_other_keyword(std::string_view word) {
  constexpr std::string_view kKnown[] = {"vp", "vw",    "l",   "p",      "o",      "g",        "s",       "t",
                                         "mg", "bevel", "lod", "usemap", "maplib", "c_interp", "d_interp"};
  return std::find(std::begin(kKnown), std::end(kKnown), word) != std::end(kKnown);
}

bool is_obj(std::span<const std::byte> beginning) {
  constexpr std::size_t kBeginning = 1 << 16;
  std::string_view text = text_of(beginning);
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::size_t known = 0;
  std::size_t unknown = 0;
  std::size_t geometry = 0;
  for (std::size_t at = 0; at < text.size() && at < kBeginning;) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    // The last line of a truncated text may be incomplete.
    if (end == text.size() && text.size() >= kBeginning) break;
    Words words(text.substr(at, end - at));
    at = end + 1;
    const auto key = words.next();
    if (!key || key->starts_with('#')) continue;
    const auto first = words.next();
    const bool is_number =
        first && !first->empty() && std::string_view("+-.0123456789nN").find((*first)[0]) != std::string_view::npos;
    const bool is_geometry = is_number && (*key == "v" || *key == "f" || *key == "vt" || *key == "vn");
    const bool is_material = first && (*key == "mtllib" || *key == "usemtl");
    geometry += is_geometry || is_material ? 1 : 0;
    ++(is_geometry || is_material || is_other_keyword(*key) ? known : unknown);
  }
  // Programs add keywords of their own.
  return geometry > 0 && unknown * 4 <= known;
}

#ifdef QUOIN_HAVE_TINYOBJLOADER

constexpr FormatCapability kReading = FormatCapability::Read;

/// Reads bytes as a stream.
class Bytes : public std::streambuf {
 public:
  explicit Bytes(std::span<const std::byte> bytes) {
    // The stream is only read, but its API takes no const pointers.
    char* const first = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));  // NOLINT
    setg(first, first, first + bytes.size());
  }

 protected:
  // The progress of tinyobjloader.
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type base = from == std::ios_base::beg   ? 0
                          : from == std::ios_base::cur ? gptr() - eback()
                                                       : egptr() - eback();
    const off_type to = base + offset;
    if (to < 0 || to > egptr() - eback()) return pos_type(off_type(-1));
    setg(eback(), eback() + to, egptr());
    return pos_type(to);
  }
};

class MaterialFiles : public tinyobj::MaterialReader {
 public:
  MaterialFiles(SidecarReader& sidecars, LoadedMesh& loaded) : sidecars_(sidecars), loaded_(loaded) {}

  bool operator()(const std::string& name, std::vector<tinyobj::material_t>* materials,
                  std::map<std::string, int>* numbers, std::string* warnings, std::string* errors) override {
    const auto bytes = sidecars_.read_or_same_name(name);
    if (!bytes) {
      loaded_.warnings.push_back("left out: the materials " + name + ": " + bytes.error().message);
      return false;
    }
    Bytes buffer(*bytes);
    std::istream stream(&buffer);
    tinyobj::LoadMtl(numbers, materials, &stream, warnings, errors);
    return true;
  }

 private:
  SidecarReader& sidecars_;
  LoadedMesh& loaded_;
};

/// The text as tinyobjloader reads it, of the same length: without a byte order mark, with lines that a backslash
/// continues as one, and with indices that end in slashes ("1//") without these.
std::string prepared(std::string_view text) {
  std::string out(text);
  if (text.starts_with(kByteOrderMark)) out.replace(0, kByteOrderMark.size(), kByteOrderMark.size(), ' ');
  for (std::size_t at = out.find('\\'); at != std::string::npos; at = out.find('\\', at + 1)) {
    const bool is_long = out.compare(at + 1, 2, "\r\n") == 0;
    const bool continues = is_long || out.compare(at + 1, 1, "\n") == 0 || out.compare(at + 1, 1, "\r") == 0;
    if (continues) out.replace(at, is_long ? 3 : 2, is_long ? 3 : 2, ' ');
  }
  for (std::size_t at = out.find('/'); at != std::string::npos; at = out.find('/', at + 1)) {
    const std::size_t end = out.find_first_not_of('/', at);
    const bool is_last =
        end == std::string::npos || std::string_view(" \t\r\n").find(out[end]) != std::string_view::npos;
    const bool follows_number = at > 0 && std::isdigit(static_cast<unsigned char>(out[at - 1])) != 0;
    if (is_last && follows_number)
      std::fill(out.begin() + static_cast<std::ptrdiff_t>(at),
                end == std::string::npos ? out.end() : out.begin() + static_cast<std::ptrdiff_t>(end), ' ');
  }
  return out;
}

/// Returns the corners of a face line as words; empty for other lines.
std::vector<std::string_view> face_words(std::string_view line) {
  Words words(line);
  std::vector<std::string_view> corners;
  if (words.next() != "f") return corners;
  while (const auto word = words.next()) corners.push_back(*word);
  return corners;
}

/// Returns the vertex number of a corner, from 0; far out of range if it is invalid.
std::size_t vertex_of(std::string_view corner, std::size_t vertices) {
  const auto number = number_in(corner.substr(0, corner.find('/')));
  if (!number || *number == 0.0 || std::abs(*number) > 1e15) return std::string_view::npos;
  const auto index = static_cast<std::int64_t>(*number);
  return static_cast<std::size_t>(index > 0 ? index - 1 : static_cast<std::int64_t>(vertices) + index);
}

/// Cuts faces with more corners than tinyobjloader supports (255) into triangles, in the text.
std::string without_large_faces(const std::string& text) {
  constexpr std::size_t kMost = 255;
  std::string out;
  std::vector<DVec3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    Words words(line);
    const auto key = words.next();
    if (key == "v") {
      const double x = words.next_number().value_or(0.0);
      const double y = words.next_number().value_or(0.0);
      positions.emplace_back(x, y, words.next_number().value_or(0.0));
    }
    const auto corners = key == "f" && line.size() > 2 * kMost ? face_words(line) : std::vector<std::string_view>();
    if (corners.size() <= kMost) {
      out.append(line).append(1, '\n');
      continue;
    }
    std::vector<DVec3> polygon;
    for (const std::string_view corner : corners) {
      const std::size_t vertex = vertex_of(corner, positions.size());
      polygon.push_back(vertex < positions.size() && is_finite(positions[vertex]) ? positions[vertex] : DVec3(0.0));
    }
    triangles.clear();
    (void)cut_polygon(polygon, triangles);
    for (const std::array<std::uint32_t, 3>& triangle : triangles) {
      out += 'f';
      for (const std::uint32_t corner : triangle) out.append(1, ' ').append(corners[corner]);
      out += '\n';
    }
  }
  return out;
}

bool has_large_face(std::string_view text) {
  constexpr std::size_t kLeastBytes = 2 * 256;
  for (std::size_t at = text.find("\nf"); at != std::string_view::npos; at = text.find("\nf", at + 1)) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at + 1), text.size());
    if (end - at > kLeastBytes && face_words(text.substr(at + 1, end - at - 1)).size() > 255) return true;
  }
  return false;
}

/// Counts invalid coordinates, which tinyobjloader reads as 0.
std::size_t count_bad_numbers(std::string_view text) {
  std::size_t bad = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    Words words(text.substr(at, end - at));
    at = end + 1;
    if (words.next() != "v") continue;
    for (int i = 0; i < 3; ++i) {
      const auto number = words.next_number();
      bad += number && std::isfinite(*number) ? 0 : 1;
    }
  }
  return bad;
}

float channel_of(double srgb) {
  return linear_from_srgb(static_cast<float>(std::clamp(srgb, 0.0, 1.0)));
}

class ObjReader {
 public:
  explicit ObjReader(SidecarReader& sidecars) : sidecars_(sidecars) {}

  Result<LoadedMesh> read(std::span<const std::byte> file) {
    std::string text = prepared(text_of(file));
    if (has_large_face(text)) text = without_large_faces(text);
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    if (const std::size_t bad = count_bad_numbers(text); bad > 0) {
      loaded_.warnings.push_back(with_thousands(static_cast<std::int64_t>(bad)) +
                                 " coordinates are not finite numbers and are read as 0");
    }
    Bytes buffer(bytes);
    std::istream stream(&buffer);
    MaterialFiles files(sidecars_, loaded_);
    std::string warnings;
    std::string errors;
    if (!tinyobj::LoadObj(&attributes_, &shapes_, &materials_, &warnings, &errors, &stream, &files, false, false)) {
      return make_error(ErrorCode::BadFormat, first_line(errors.empty() ? "the file cannot be parsed" : errors));
    }
    warn_of(warnings);
    drop_baked_occlusion(text_of(bytes));
    take_positions();
    take_materials();
    for (const tinyobj::shape_t& shape : shapes_) {
      if (Status done = take(shape.mesh); !done) return done.error();
      has_others_ |= !shape.lines.indices.empty() || !shape.points.indices.empty();
    }
    if (has_others_) loaded_.warnings.emplace_back("left out: points and lines");
    show_what_is_all_invisible();
    if (has_glows_) loaded_.mesh.emissive_uvs = loaded_.mesh.uvs;
    if (!has_textures_) loaded_.mesh.uvs.clear();
    builder_.finish();
    return std::move(loaded_);
  }

 private:
  static std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

  void warn_of(const std::string& text) {
    constexpr std::size_t kMost = 10;
    std::size_t count = 0;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      std::string line = text.substr(at, end - at);
      at = end + 1;
      // The code that looked for the file has already reported why it is missing.
      if (line.empty() || line.find("Failed to load material file") != std::string::npos) continue;
      if (++count <= kMost) loaded_.warnings.push_back(std::move(line));
    }
    if (count > kMost) loaded_.warnings.push_back("and " + std::to_string(count - kMost) + " more warnings like these");
  }
  /// Drops the vertex colours that Quoin writes for blocks: ambient occlusion, not a surface colour. Keeps colours of
  /// its smooth meshes, which have no materials.
  void drop_baked_occlusion(std::string_view text) {
    const auto& c = attributes_.colors;
    if (!text.starts_with("# Quoin ") || materials_.empty()) return;
    for (std::size_t i = 0; i + 2 < c.size(); i += 3) {
      if (!is_occlusion_grey(c[i]) || c[i + 1] != c[i] || c[i + 2] != c[i]) return;
    }
    attributes_.colors.clear();
  }
  void take_positions() {
    const auto& v = attributes_.vertices;
    TriangleMesh& mesh = loaded_.mesh;
    for (std::size_t i = 0; i + 2 < v.size(); i += 3) mesh.positions.emplace_back(v[i], v[i + 1], v[i + 2]);
    const auto& c = attributes_.colors;
    if (c.size() != v.size()) return;
    for (std::size_t i = 0; i + 2 < c.size(); i += 3) {
      mesh.colours.emplace_back(channel_of(c[i]), channel_of(c[i + 1]), channel_of(c[i + 2]), 1.0F);
    }
  }
  void take_materials() {
    for (const tinyobj::material_t& from : materials_) {
      MeshMaterial material;
      material.name = from.name;
      material.colour = {channel_of(from.diffuse[0]), channel_of(from.diffuse[1]), channel_of(from.diffuse[2]),
                         static_cast<float>(std::clamp(from.dissolve, 0.0, 1.0))};
      if (material.colour.a < 1.0F) material.alpha_mode = AlphaMode::Blend;
      if (from.roughness > 0.0) material.roughness = static_cast<float>(std::min(from.roughness, 1.0));
      material.metalness = static_cast<float>(std::clamp(from.metallic, 0.0, 1.0));
      material.emission = static_cast<float>(std::max({from.emission[0], from.emission[1], from.emission[2], 0.0}));
      if (!from.diffuse_texname.empty()) take_texture(from, material);
      if (!from.emissive_texname.empty() && material.emission > 0.0F) take_emission(from, material);
      loaded_.mesh.materials.push_back(std::move(material));
    }
    // The material of faces with a missing or unknown material name.
    no_material_ = loaded_.mesh.materials.size();
    MeshMaterial plain;
    const float grey = loaded_.mesh.colours.empty() ? channel_of(200.0 / 255.0) : 1.0F;
    plain.colour = {grey, grey, grey, 1.0F};
    loaded_.mesh.materials.push_back(std::move(plain));
  }
  std::optional<std::size_t> texture_of(const std::string& name) {
    const auto [known, is_new] = textures_.try_emplace(name);
    if (is_new) {
      const auto bytes = sidecars_.read_or_same_name(name);
      if (!bytes) loaded_.warnings.push_back("left out: the texture " + name + ": " + bytes.error().message);
      if (bytes) known->second = add_texture(*bytes, name, loaded_);
    }
    return known->second;
  }
  /// Takes Ke times map_Ke. If the image cannot be read (which left a warning), nothing glows.
  void take_emission(const tinyobj::material_t& from, MeshMaterial& material) {
    material.emissive_texture = texture_of(from.emissive_texname);
    if (!material.emissive_texture) {
      material.emission = 0.0F;
      return;
    }
    has_glows_ = true;
    for (int i = 0; i < 3; ++i) {
      material.emissive_tint[i] = static_cast<float>(std::max(from.emission[i], 0.0)) / material.emission;
    }
  }
  void take_texture(const tinyobj::material_t& from, MeshMaterial& material) {
    material.texture = texture_of(from.diffuse_texname);
    if (!material.texture) return;
    has_textures_ = true;
    MeshTexture& texture = loaded_.mesh.textures[*material.texture];
    if (from.diffuse_texopt.clamp) texture.wrap_u = texture.wrap_v = TextureWrap::Clamp;
    // The image replaces Kd, as in most programs; d stays.
    material.colour = {1.0F, 1.0F, 1.0F, material.colour.a};
    const auto& pixels = texture.image.rgba;
    bool has_holes = false;
    for (std::size_t i = 3; i < pixels.size(); i += 4) has_holes |= pixels[i] < 128;
    if (has_holes && material.alpha_mode == AlphaMode::Opaque) material.alpha_mode = AlphaMode::Mask;
  }
  Status take(const tinyobj::mesh_t& from) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < from.num_face_vertices.size(); ++i) {
      const std::size_t count = from.num_face_vertices[i];
      if (count > from.indices.size() - first) return {};
      const std::span<const tinyobj::index_t> face = std::span(from.indices).subspan(first, count);
      first += count;
      polygon_.clear();
      for (const tinyobj::index_t& corner : face) {
        polygon_.push_back(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(corner.vertex_index)));
      }
      const int material = i < from.material_ids.size() ? from.material_ids[i] : -1;
      const bool is_there = material >= 0 && static_cast<std::size_t>(material) < no_material_;
      Status added = builder_.add_polygon(polygon_, [&](const std::array<std::uint32_t, 3>& corners) {
        for (const std::uint32_t k : corners) {
          loaded_.mesh.uvs.push_back(place_of(face[k].texcoord_index));
        }
        loaded_.mesh.material_of.push_back(static_cast<std::uint32_t>(is_there ? material : no_material_));
      });
      if (!added) return added;
    }
    return {};
  }
  /// Some programs swap opacity and transparency. A fully invisible model is such a mistake.
  void show_what_is_all_invisible() {
    TriangleMesh& mesh = loaded_.mesh;
    const auto is_invisible = [&](std::uint32_t material) { return mesh.materials[material].colour.a == 0.0F; };
    if (mesh.material_of.empty() || !std::ranges::all_of(mesh.material_of, is_invisible)) return;
    for (MeshMaterial& material : mesh.materials) {
      if (material.colour.a != 0.0F) continue;
      material.colour.a = 1.0F;
      if (material.alpha_mode == AlphaMode::Blend) material.alpha_mode = AlphaMode::Opaque;
    }
    loaded_.warnings.emplace_back("all materials are fully transparent (Tr 1 or d 0) and are read as opaque");
  }
  /// The OBJ origin (0, 0) is the image's bottom left corner.
  [[nodiscard]] glm::vec2 place_of(int index) const {
    const auto at = 2 * static_cast<std::size_t>(std::max(index, 0));
    const auto& t = attributes_.texcoords;
    if (index < 0 || at + 1 >= t.size()) return {0.0F, 1.0F};
    return {static_cast<float>(t[at]), static_cast<float>(1.0 - t[at + 1])};
  }

  SidecarReader& sidecars_;
  LoadedMesh loaded_;
  MeshBuilder builder_{loaded_};
  tinyobj::attrib_t attributes_;
  std::vector<tinyobj::shape_t> shapes_;
  std::vector<tinyobj::material_t> materials_;
  std::map<std::string, std::optional<std::size_t>> textures_;
  std::vector<std::size_t> polygon_;
  std::size_t no_material_ = 0;
  bool has_textures_ = false;
  bool has_glows_ = false;
  bool has_others_ = false;
};

Result<LoadedMesh> read_obj(std::span<const std::byte> bytes, SidecarReader& sidecars) {
  return ObjReader(sidecars).read(bytes);
}

#else

constexpr FormatCapability kReading{};

Result<LoadedMesh> read_obj(std::span<const std::byte>, SidecarReader&) {
  return make_error(ErrorCode::Unsupported, "cannot read OBJ: Quoin was built without tinyobjloader");
}

#endif

}  // namespace

}  // namespace quoin::triangles

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
  UniqueNames names_;
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
  out_.put_text("o " + names_.add(word, "_") + "\n");
}

std::string shortest(float value) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

/// Returns the name of a material of blocks for OBJ and MTL, in one word. Those of textured faces end in their number,
/// so that names are unique that differ in blanks only.
std::string mtl_name(const MaterialPalette& palette, std::size_t material) {
  const auto& plain = palette.materials();
  if (!palette.is_textured(material)) {
    QUOIN_ASSERT(material < plain.size(), "a material of the palette");
    return one_word(plain[material].name);
  }
  const std::size_t number = material - plain.size() - palette.smooth_materials().size();
  return one_word(palette.textured_materials()[number].name) + "_texture_" + std::to_string(number + 1);
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

/// Returns emission as MTL lines. MTL has no emission strength, so Ke holds it.
std::string mtl_emission(float strength, const std::string& image) {
  const std::string text = shortest(strength);
  return "Ke " + text + " " + text + " " + text + "\nmap_Ke " + image + "\n";
}

/// The names of an OBJ's sidecar files.
struct ObjNames {
  std::filesystem::path library;
  std::filesystem::path palette;
  std::filesystem::path emissive;
  std::filesystem::path atlas;
  std::string texture_stem;
  std::string alpha_stem;
};

ObjNames names_beside(const std::filesystem::path& path) {
  const std::string stem = (path.parent_path() / path.stem()).string();
  return {stem + ".mtl",       stem + "_palette.png", stem + "_emissive.png",
          stem + "_atlas.png", stem + "_texture_",    stem + "_alpha_"};
}

/// The images of textured faces: one of each texture and tint, and a grey one of each alpha. Many programs show an
/// image instead of Kd, and read one channel of map_d.
class FaceImages {
 public:
  FaceImages(std::shared_ptr<const MaterialPalette> palette, const ObjNames& names) : palette_(std::move(palette)) {
    for (const SurfaceMaterial& material : palette_->textured_materials()) {
      if (!material.texture) continue;  // a tint only
      add(colour_of(material), names.texture_stem);
      if (material.alpha != FaceAlpha::Opaque) add(alpha_of(material), names.alpha_stem);
    }
  }

  /// Returns the names of a material's images in its folder.
  [[nodiscard]] std::string colour_file(const SurfaceMaterial& of) const { return file_of(colour_of(of)); }
  [[nodiscard]] std::string alpha_file(const SurfaceMaterial& of) const { return file_of(alpha_of(of)); }

  /// Adds all images to the files to write. They are encoded when they are written, one at a time.
  void add_to(std::vector<MeshFile>& files) const {
    for (const auto& [image, path] : paths_) {
      files.push_back({path, 0, [image = image, palette = palette_](BlockWriter& out) {
                         const Vec3 tint(image.red, image.green, image.blue);
                         const auto png = encode_png(image.is_alpha ? palette->face_alpha_image(image.texture)
                                                                    : palette->face_image(image.texture, tint));
                         if (!png) return out.fail(png.error());
                         out.put(std::span(*png));
                       }});
    }
  }

 private:
  struct Image {
    bool is_alpha = false;
    std::size_t texture = 0;  // of the palette
    float red = 1.0F;         // the tint, linear
    float green = 1.0F;
    float blue = 1.0F;
    auto operator<=>(const Image&) const = default;
  };

  static Image colour_of(const SurfaceMaterial& material) {
    QUOIN_ASSERT(material.texture.has_value(), "a textured material");
    return {false, *material.texture, material.tint.x, material.tint.y, material.tint.z};
  }
  static Image alpha_of(const SurfaceMaterial& material) { return {true, colour_of(material).texture}; }

  // Textures' own names may not be file names.
  void add(const Image& image, const std::string& stem) {
    const auto [added, is_new] = paths_.try_emplace(image);
    if (is_new) added->second = stem + std::to_string(++(image.is_alpha ? alphas_ : colours_)) + ".png";
  }
  [[nodiscard]] std::string file_of(const Image& image) const { return paths_.at(image).filename().string(); }

  std::shared_ptr<const MaterialPalette> palette_;
  std::map<Image, std::filesystem::path> paths_;
  std::size_t colours_ = 0;
  std::size_t alphas_ = 0;
};

/// Returns a material of textured faces, or of faces with a tint only. An image has the tint.
std::string mtl_textured(const SurfaceMaterial& material, const std::string& name, const FaceImages& images) {
  if (!material.texture) {
    const auto& [r, g, b] = std::array{material.tint.x, material.tint.y, material.tint.z};
    return "\nnewmtl " + name + "\nKd " + shortest(r) + " " + shortest(g) + " " + shortest(b) + "\nillum 1\n";
  }
  const std::string image = images.colour_file(material);
  std::string text = "\nnewmtl " + name + "\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd " + image + "\n";
  if (material.alpha != FaceAlpha::Opaque) text.append("map_d " + images.alpha_file(material) + "\n");
  if (material.is_emissive()) text.append(mtl_emission(material.emission, image));
  return text;
}

/// Writes one material for each of the palette's, by name.
std::string mtl_text(const SceneMeshes& meshes, const MaterialPalette& palette, const ObjNames& names,
                     const FaceImages& images) {
  std::string text = first_line();
  for (std::size_t i = 0; i < palette.materials().size(); ++i) {
    const SurfaceMaterial& material = palette.materials()[i];
    text.append("\nnewmtl ").append(mtl_name(palette, i)).append("\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\n");
    const bool is_in_atlas = material.surface == SurfaceClass::Opaque && !meshes.atlas.rgb.empty();
    text.append("map_Kd ").append((is_in_atlas ? names.atlas : names.palette).filename().string()).append("\n");
    if (material.is_transparent()) text.append(mtl_glass(material, meshes.types[material.type]));
    if (material.is_emissive()) text.append(mtl_emission(material.emission, names.emissive.filename().string()));
  }
  const std::size_t first = palette.materials().size() + palette.smooth_materials().size();
  for (std::size_t i = 0; i < palette.textured_materials().size(); ++i) {
    text.append(mtl_textured(palette.textured_materials()[i], mtl_name(palette, first + i), images));
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
    for (const Direction direction : kDirections) write_normal(transform.normal(Vec3(normal_of(direction))));
    std::uint64_t first_own = kDirections.size();  // the next normal of the object
    for (const auto& [view, material] : split.surfaces()) {
      write_vertices(view, transform);
      out_.put_text("usemtl " + mtl_name(palette_, material) + "\n");
      std::vector<std::array<float, 2>> of_faces;
      if (palette_.is_textured(material)) of_faces = palette_.face_coordinates(view);
      const std::span<const std::array<float, 2>> own = of_faces.empty() ? view.atlas : of_faces;
      for (const std::array<float, 2>& uv : own) write_texture_coordinate(uv);
      const bool has_inclined = write_inclined_normals(view, transform);
      write_faces(view, transform.mirrors(), [&view = view, own, has_inclined, first_own, this](std::uint32_t corner) {
        QUOIN_ASSERT(corner < view.types.size() && corner < view.directions.size(), "a vertex of the surface");
        const std::uint64_t texture = own.empty() ? view.types[corner] : textures_ + corner + 1;
        return std::pair(has_inclined ? first_own + corner : std::uint64_t(view.directions[corner]), texture);
      });
      vertices_ += view.positions.size();
      textures_ += own.size();
      if (has_inclined) first_own += view.positions.size();
    }
    normals_ += first_own;
  }

  /// Writes a normal per vertex and returns true if any face is inclined.
  bool write_inclined_normals(const MeshView& view, const VertexTransform& transform) {
    if (std::ranges::all_of(view.looks, [](const VertexLook& l) { return l.normal == Vec3(0.0F); })) return false;
    for (std::size_t i = 0; i < view.positions.size(); ++i) write_normal(transform.normal(normal_at(view, i)));
    return true;
  }

  void write_normal(const DVec3& normal) {
    lines_.triple("vn", normal);
    out_.put('\n');
  }

  void write_vertices(const MeshView& view, const VertexTransform& transform) {
    for (std::size_t i = 0; i < view.positions.size() && !out_.failed(); ++i) {
      lines_.triple("v", transform.position(view.positions[i]));
      QUOIN_ASSERT(view.block_occlusion.empty() || view.block_occlusion[i] < greys_.size(), "occlusion < 4");
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
    for (const Vec3& normal : view.normals) write_normal(transform.normal(normal));
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

Result<std::vector<MeshFile>> plan_obj(const SceneMeshes& meshes, const std::filesystem::path& path,
                                       const MeshFileOptions& options) {
  const auto palette = std::make_shared<const MaterialPalette>(meshes, face_colours_in(options));
  if (Status sound = palette->validate(); !sound) return sound.error();
  const ObjNames names = names_beside(path);
  std::vector<MeshFile> files;
  if (has_materials(meshes)) {
    if (auto added = add_image(names.palette, palette->opaque_colour(), files); !added) return added.error();
    if (palette->has_emission()) {
      if (auto added = add_image(names.emissive, palette->emissive(), files); !added) return added.error();
    }
    if (!meshes.atlas.rgb.empty()) {
      if (auto added = add_image(names.atlas, png_of(meshes.atlas), files); !added) return added.error();
    }
    const FaceImages images(palette, names);
    images.add_to(files);
    std::string text = mtl_text(meshes, *palette, names, images);
    files.push_back({names.library, 0, [text = std::move(text)](BlockWriter& out) { out.put_text(text); }});
  }
  const auto write = [&meshes, palette, library = names.library.filename().string()](BlockWriter& out) {
    ObjText(meshes, *palette, out).write(library);
  };
  files.push_back({path, expected_bytes(meshes), write});
  return files;
}

std::vector<std::filesystem::path> obj_companions(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                  const MeshFileOptions& options) {
  if (!has_materials(meshes)) return {};
  const ObjNames names = names_beside(path);
  std::vector<std::filesystem::path> files = {names.library, names.palette};
  if (!meshes.atlas.rgb.empty()) files.push_back(names.atlas);
  if ((meshes.types.has_textures() || meshes.types.has_shapes()) && check_meshes(meshes)) {
    const auto palette = std::make_shared<const MaterialPalette>(meshes, face_colours_in(options));
    if (palette->has_emission()) files.push_back(names.emissive);
    std::vector<MeshFile> images;
    FaceImages(palette, names).add_to(images);
    for (const MeshFile& image : images) files.push_back(image.path);
    return files;
  }
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      const bool emits = view.surface == SurfaceClass::Emissive || view.surface == SurfaceClass::EmissiveTransparent;
      if (emits && files.back() != names.emissive) files.push_back(names.emissive);
    }
  }
  return files;
}

}  // namespace

extern constinit const FormatDriver kObjFormat = {
    .info = {FileFormat::Obj, ".obj", "Wavefront OBJ with .mtl and palette images",
             triangles::kReading | FormatCapability::Write | FormatCapability::Meshes | FormatCapability::Textures |
                 FormatCapability::Faces},
    .detect = triangles::is_obj,
    .read_mesh = triangles::read_obj,
    .plan_mesh = plan_obj,
    .mesh_companions = obj_companions,
};

}  // namespace quoin
