// Wavefront OBJ and MTL, by tinyobjloader.

#include "io/triangles/triangles.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <istream>
#include <map>
#include <streambuf>
#include <string>
#include <string_view>

#include <quoin/core/thousands.h>

#include "core/srgb.h"
#include "io/byte_reader.h"
#include "io/triangles/words.h"

#ifdef QUOIN_HAVE_TINYOBJLOADER
#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>
#endif

namespace quoin::triangles {

namespace {

bool is_other_keyword(std::string_view word) {
  constexpr std::string_view kKnown[] = {"vp", "vw",    "l",   "p",      "o",      "g",        "s",       "t",
                                         "mg", "bevel", "lod", "usemap", "maplib", "c_interp", "d_interp"};
  return std::find(std::begin(kKnown), std::end(kKnown), word) != std::end(kKnown);
}

}  // namespace

bool is_obj(std::span<const std::byte> beginning) {
  constexpr std::size_t kBeginning = 1 << 16;
  const std::string_view text = text_of(beginning);
  std::size_t known = 0;
  std::size_t unknown = 0;
  std::size_t geometry = 0;
  for (std::size_t at = 0; at < text.size() && at < kBeginning;) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    // The last line of a beginning may be cut off.
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
  // Programs add words of their own.
  return geometry > 0 && unknown * 4 <= known;
}

#ifdef QUOIN_HAVE_TINYOBJLOADER

bool has_obj() {
  return true;
}

namespace {

/// Bytes as a stream.
class Bytes : public std::streambuf {
 public:
  explicit Bytes(std::span<const std::byte> bytes) {
    // Streams are read here only, and take no pointers to what is constant.
    char* const first = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));  // NOLINT
    setg(first, first, first + bytes.size());
  }

 protected:
  // How far tinyobjloader has come.
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
  MaterialFiles(Beside& beside, LoadedMesh& loaded) : beside_(beside), loaded_(loaded) {}

  bool operator()(const std::string& name, std::vector<tinyobj::material_t>* materials,
                  std::map<std::string, int>* numbers, std::string* warnings, std::string* errors) override {
    const auto bytes = beside_.read(name);
    if (!bytes) {
      loaded_.warnings.push_back("left out the materials " + name + ": " + bytes.error().message);
      return false;
    }
    Bytes buffer(*bytes);
    std::istream stream(&buffer);
    tinyobj::LoadMtl(numbers, materials, &stream, warnings, errors);
    return true;
  }

 private:
  Beside& beside_;
  LoadedMesh& loaded_;
};

/// Coordinates that are no numbers, which tinyobjloader takes for 0.
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
  explicit ObjReader(Beside& beside) : beside_(beside) {}

  Result<LoadedMesh> read(std::span<const std::byte> bytes) {
    if (const std::size_t bad = count_bad_numbers(text_of(bytes)); bad > 0) {
      loaded_.warnings.push_back(with_thousands(static_cast<std::int64_t>(bad)) +
                                 " coordinates are no finite numbers, and count as 0");
    }
    Bytes buffer(bytes);
    std::istream stream(&buffer);
    MaterialFiles files(beside_, loaded_);
    std::string warnings;
    std::string errors;
    if (!tinyobj::LoadObj(&attributes_, &shapes_, &materials_, &warnings, &errors, &stream, &files, true, false)) {
      return make_error(ErrorCode::BadFormat, first_line(errors.empty() ? "the file cannot be parsed" : errors));
    }
    warn_of(warnings);
    take_positions();
    take_materials();
    for (const tinyobj::shape_t& shape : shapes_) {
      if (Status done = take(shape.mesh); !done) return done.error();
      has_others_ |= !shape.lines.indices.empty() || !shape.points.indices.empty();
    }
    if (has_others_) loaded_.warnings.emplace_back("left out points and lines");
    if (!has_textures_) loaded_.mesh.texture_places.clear();
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
      // What is missing is said by who looked for it, with the reason.
      if (line.empty() || line.find("Failed to load material file") != std::string::npos) continue;
      if (++count <= kMost) loaded_.warnings.push_back(std::move(line));
    }
    if (count > kMost) loaded_.warnings.push_back("and " + std::to_string(count - kMost) + " lines more like these");
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
      loaded_.mesh.materials.push_back(std::move(material));
    }
    // What names no material, or one that is not there.
    no_material_ = loaded_.mesh.materials.size();
    MeshMaterial plain;
    const float grey = loaded_.mesh.colours.empty() ? channel_of(200.0 / 255.0) : 1.0F;
    plain.colour = {grey, grey, grey, 1.0F};
    loaded_.mesh.materials.push_back(std::move(plain));
  }
  void take_texture(const tinyobj::material_t& from, MeshMaterial& material) {
    const std::string& name = from.diffuse_texname;
    const auto [known, is_new] = textures_.try_emplace(name);
    if (is_new) {
      const auto bytes = beside_.read(name);
      if (!bytes) loaded_.warnings.push_back("left out the texture " + name + ": " + bytes.error().message);
      if (bytes) known->second = add_texture(*bytes, name, loaded_);
    }
    material.texture = known->second;
    if (!material.texture) return;
    has_textures_ = true;
    MeshTexture& texture = loaded_.mesh.textures[*material.texture];
    if (from.diffuse_texopt.clamp) texture.wrap_u = texture.wrap_v = TextureWrap::Clamp;
    // The picture takes the place of Kd, as in most programs; d stays.
    material.colour = {1.0F, 1.0F, 1.0F, material.colour.a};
    const auto& pixels = texture.image.rgba;
    bool has_holes = false;
    for (std::size_t i = 3; i < pixels.size(); i += 4) has_holes |= pixels[i] < 128;
    if (has_holes && material.alpha_mode == AlphaMode::Opaque) material.alpha_mode = AlphaMode::Mask;
  }
  Status take(const tinyobj::mesh_t& from) {
    for (std::size_t i = 0; 3 * i + 2 < from.indices.size(); ++i) {
      const tinyobj::index_t* const corner = from.indices.data() + 3 * i;
      const auto index = [&](int k) {
        return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(corner[k].vertex_index));
      };
      const auto added = builder_.add(index(0), index(1), index(2));
      if (!added) return added.error();
      if (!*added) continue;
      for (int k = 0; k < 3; ++k) loaded_.mesh.texture_places.push_back(place_of(corner[k].texcoord_index));
      const int material = i < from.material_ids.size() ? from.material_ids[i] : -1;
      const bool is_there = material >= 0 && static_cast<std::size_t>(material) < no_material_;
      loaded_.mesh.material_of.push_back(static_cast<std::uint32_t>(is_there ? material : no_material_));
    }
    return {};
  }
  /// Of OBJ (0, 0) is the picture's bottom left corner.
  [[nodiscard]] glm::vec2 place_of(int index) const {
    const auto at = 2 * static_cast<std::size_t>(std::max(index, 0));
    const auto& t = attributes_.texcoords;
    if (index < 0 || at + 1 >= t.size()) return {0.0F, 1.0F};
    return {static_cast<float>(t[at]), static_cast<float>(1.0 - t[at + 1])};
  }

  Beside& beside_;
  LoadedMesh loaded_;
  MeshBuilder builder_{loaded_};
  tinyobj::attrib_t attributes_;
  std::vector<tinyobj::shape_t> shapes_;
  std::vector<tinyobj::material_t> materials_;
  std::map<std::string, std::optional<std::size_t>> textures_;
  std::size_t no_material_ = 0;
  bool has_textures_ = false;
  bool has_others_ = false;
};

}  // namespace

Result<LoadedMesh> read_obj(std::span<const std::byte> bytes, Beside& beside) {
  return ObjReader(beside).read(bytes);
}

#else

bool has_obj() {
  return false;
}

Result<LoadedMesh> read_obj(std::span<const std::byte>, Beside&) {
  return make_error(ErrorCode::Unsupported, "Quoin was built without tinyobjloader, which reads OBJ");
}

#endif

}  // namespace quoin::triangles
