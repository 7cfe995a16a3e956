// 3MF. Source: 3MF Consortium, "3D Manufacturing Format" core specification 1.3, its materials extension 1.2.1 (colour
// groups) and its production extension 1.1.2 (objects in other parts).
//
// 3MF. Source: 3MF Consortium, "3D Manufacturing Format" core specification 1.3, and its materials extension 1.2.1.

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/core/thousands.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/version.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/srgb.h"
#include "io/format_driver.h"
#include "io/mesh_parts.h"
#include "io/triangles/triangles.h"
#include "io/zip.h"

#ifdef QUOIN_HAVE_EXPAT
#include <expat.h>
#endif

namespace quoin::triangles {

namespace {

bool is_three_mf(std::span<const std::byte> beginning) {
  const std::string_view text = text_of(beginning);
  return text.starts_with("PK\3\4") && text.find("3D/") != std::string_view::npos &&
         text.find(".model") != std::string_view::npos;
}

/// Detects a zip file whose names are not at its beginning.
bool is_named_three_mf(const std::filesystem::path& path, std::span<const std::byte> beginning) {
  return lower_case_extension(path) == ".3mf" && text_of(beginning).starts_with("PK");
}

#ifdef QUOIN_HAVE_EXPAT

constexpr FormatCapability kReading = FormatCapability::Read;

constexpr std::int64_t kNone = -1;

struct Triangle {
  std::array<std::uint32_t, 3> corners{};
  std::int64_t group = kNone;  // colour group; kNone: the object's group
  std::array<std::int64_t, 3> colours{kNone, kNone, kNone};
};

/// An object within an object, or one of the build items.
struct Placed {
  std::string path;  // its part; empty: the same part
  std::int64_t object = kNone;
  glm::dmat4 transform{1.0};
};

struct Object {
  std::vector<DVec3> vertices;
  std::vector<Triangle> triangles;
  std::vector<Placed> components;
  std::int64_t group = kNone;
  std::int64_t colour = kNone;
};

/// A file of objects in the package.
struct Part {
  double millimetres = 1.0;  // per unit
  std::map<std::int64_t, Object> objects;
  std::map<std::int64_t, std::vector<Rgba8>> colours;  // by group
  std::vector<Placed> build;
  std::map<std::string, std::size_t, std::less<>> left_out;  // elements by name
  std::string target;                                        // the root part, from relationships
};

/// The attributes of an element. Lifetime: the call.
class Attributes {
 public:
  explicit Attributes(const char** pairs) : pairs_(pairs) {}
  /// The value of that name in any namespace; empty without one.
  [[nodiscard]] std::string_view operator[](std::string_view name) const {
    for (const char** pair = pairs_; *pair != nullptr; pair += 2) {
      const std::string_view key = *pair;
      if (key.substr(key.rfind('|') + 1) == name) return pair[1];
    }
    return {};
  }
  [[nodiscard]] std::optional<double> number(std::string_view name) const { return number_in((*this)[name]); }
  /// Returns a whole number of at least 0, else kNone.
  [[nodiscard]] std::int64_t index(std::string_view name) const {
    const auto value = number(name);
    const bool is_index = value && *value >= 0.0 && *value <= 4294967295.0 && *value == std::floor(*value);
    return is_index ? static_cast<std::int64_t>(*value) : kNone;
  }

 private:
  const char** pairs_;
};

/// Parses "#RRGGBB" or "#RRGGBBAA".
std::optional<Rgba8> colour_in(std::string_view text) {
  if (!text.starts_with('#') || (text.size() != 7 && text.size() != 9)) return std::nullopt;
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (text.size() == 7) value = value << 8 | 255U;
  const auto byte = [value](unsigned shift) { return static_cast<std::uint8_t>(value >> shift); };
  return Rgba8{byte(24), byte(16), byte(8), byte(0)};
}

/// Parses twelve numbers: the images of the axes, and of the origin.
std::optional<glm::dmat4> transform_in(std::string_view text) {
  glm::dmat4 matrix(1.0);
  if (text.empty()) return matrix;
  Words words(text);
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) {
      const auto number = words.next_number();
      if (!number || !std::isfinite(*number)) return std::nullopt;
      matrix[column][row] = *number;
    }
  }
  return matrix;
}

double millimetres_of(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 6> kUnits = {{{"micron", 0.001},
                                                                          {"millimeter", 1.0},
                                                                          {"centimeter", 10.0},
                                                                          {"inch", 25.4},
                                                                          {"foot", 304.8},
                                                                          {"meter", 1000.0}}};
  for (const auto& [name, size] : kUnits) {
    if (name == unit) return size;
  }
  return 1.0;
}

/// Parses a part from its XML.
class PartReader {
 public:
  explicit PartReader(std::string name)
      : name_(std::move(name)), parser_(XML_ParserCreateNS(nullptr, '|'), &XML_ParserFree) {
    if (!parser_) throw std::bad_alloc();
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), &PartReader::on_start, &PartReader::on_end);
    // Packages have no entities, and each could expand to any number of bytes.
    XML_SetEntityDeclHandler(parser_.get(), &PartReader::on_entity);
  }

  Result<Part> read(std::span<const std::byte> xml) {
    constexpr std::size_t kAtOnce = std::size_t{1} << 24;
    for (std::size_t at = 0; at < xml.size() || at == 0; at += kAtOnce) {
      const auto piece = xml.subspan(at, std::min(kAtOnce, xml.size() - at));
      const bool is_last = at + piece.size() >= xml.size();
      const auto outcome = XML_Parse(parser_.get(), reinterpret_cast<const char*>(piece.data()),
                                     static_cast<int>(piece.size()), is_last ? 1 : 0);
      if (outcome != XML_STATUS_OK) return error();
      if (is_last) break;
    }
    return std::move(part_);
  }

 private:
  [[nodiscard]] Error error() const {
    const std::string why =
        fault_.empty() ? std::string("invalid XML: ") + XML_ErrorString(XML_GetErrorCode(parser_.get())) : fault_;
    const auto byte = static_cast<std::int64_t>(XML_GetCurrentByteIndex(parser_.get()));
    return make_error(ErrorCode::BadFormat, printable(name_) + ", byte " + std::to_string(byte) + ": " + why);
  }
  void fail(std::string why) {
    if (fault_.empty()) fault_ = std::move(why);
    XML_StopParser(parser_.get(), XML_FALSE);
  }
  static void on_entity(void* self, const char*, int, const char*, int, const char*, const char*, const char*,
                        const char*) {
    static_cast<PartReader*>(self)->fail("entity declarations are not allowed in 3MF");
  }
  static void on_start(void* self, const char* name, const char** attributes) {
    const std::string_view whole = name;
    static_cast<PartReader*>(self)->start(whole.substr(whole.rfind('|') + 1), Attributes(attributes));
  }
  static void on_end(void* self, const char* name) {
    const std::string_view whole = name;
    static_cast<PartReader*>(self)->end(whole.substr(whole.rfind('|') + 1));
  }

  void start(std::string_view element, const Attributes& attributes) {
    if (element == "vertex") return add_vertex(attributes);
    if (element == "triangle") return add_triangle(attributes);
    if (element == "component") return add_placed(attributes, object_ != nullptr ? &object_->components : nullptr);
    if (element == "item") return add_placed(attributes, &part_.build);
    if (element == "object") return begin_object(attributes);
    if (element == "basematerials" || element == "colorgroup") group_ = attributes.index("id");
    if (element == "base") return add_colour(attributes["displaycolor"]);
    if (element == "color") return add_colour(attributes["color"]);
    if (element == "model") part_.millimetres = millimetres_of(attributes["unit"]);
    constexpr std::string_view kRoot = "/3dmodel";
    if (element == "Relationship" && attributes["Type"].ends_with(kRoot)) part_.target = attributes["Target"];
    constexpr std::array<std::string_view, 5> kLeftOut = {"texture2dgroup", "compositematerials", "multiproperties",
                                                          "beamlattice", "slicestack"};
    if (std::ranges::find(kLeftOut, element) != kLeftOut.end()) ++part_.left_out[std::string(element)];
  }
  void end(std::string_view element) {
    if (element == "object") object_ = nullptr;
    if (element == "basematerials" || element == "colorgroup") group_ = kNone;
  }

  void begin_object(const Attributes& attributes) {
    const std::int64_t id = attributes.index("id");
    if (id == kNone) return fail("an object has no id");
    object_ = &part_.objects[id];
    *object_ = {};
    object_->group = attributes.index("pid");
    object_->colour = attributes.index("pindex");
  }
  void add_vertex(const Attributes& attributes) {
    const auto x = attributes.number("x");
    const auto y = attributes.number("y");
    const auto z = attributes.number("z");
    if (object_ == nullptr || !x || !y || !z) return fail("a vertex is outside an object or lacks a coordinate");
    object_->vertices.emplace_back(*x, *y, *z);
  }
  void add_triangle(const Attributes& attributes) {
    Triangle triangle;
    constexpr std::array<std::string_view, 3> kCorners = {"v1", "v2", "v3"};
    constexpr std::array<std::string_view, 3> kColours = {"p1", "p2", "p3"};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t corner = attributes.index(kCorners[i]);
      if (object_ == nullptr || corner == kNone) return fail("a triangle is outside an object or lacks a corner");
      triangle.corners[i] = static_cast<std::uint32_t>(corner);
      triangle.colours[i] = attributes.index(kColours[i]);
      if (triangle.colours[i] == kNone) triangle.colours[i] = triangle.colours[0];
    }
    triangle.group = attributes.index("pid");
    object_->triangles.push_back(triangle);
  }
  void add_placed(const Attributes& attributes, std::vector<Placed>* list) {
    const auto transform = transform_in(attributes["transform"]);
    const std::int64_t object = attributes.index("objectid");
    if (list == nullptr || object == kNone) return fail("a component or item has no object");
    if (!transform) return fail("a transform does not have 12 numbers");
    list->push_back({std::string(attributes["path"]), object, *transform});
  }
  void add_colour(std::string_view text) {
    if (group_ == kNone) return;
    const auto colour = colour_in(text);
    if (!colour) return fail("invalid colour \"" + printable(text.substr(0, 20)) + "\"");
    part_.colours[group_].push_back(*colour);
  }

  std::string name_;
  std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser_;
  Part part_;
  Object* object_ = nullptr;
  std::int64_t group_ = kNone;
  std::string fault_;
};

/// Collects all items to build in one mesh, in millimetres.
class Package {
 public:
  explicit Package(ZipParts zip) : zip_(std::move(zip)) {}

  Result<LoadedMesh> read() {
    const auto root = root_name();
    if (!root) return root.error();
    const auto part = part_named(*root);
    if (!part) return part.error();
    const glm::dmat4 scale(glm::dmat3((*part)->millimetres));
    for (const Placed& item : (*part)->build) {
      if (auto done = add(item, *root, scale, 0); !done) return done.error();
    }
    builder_.finish();
    finish();
    return std::move(loaded_);
  }

 private:
  Result<std::string> root_name() {
    constexpr const char* kRelations = "_rels/.rels";
    if (zip_.has(kRelations)) {
      const auto relations = part_named(kRelations);
      if (!relations) return relations.error();
      if (const std::string& target = (*relations)->target; !target.empty()) return without_slash(target);
    }
    for (const std::string& name : zip_.names()) {
      if (name.starts_with("3D/") && name.ends_with(".model")) return name;
    }
    return make_error(ErrorCode::BadFormat, "the 3MF has no model (3D/3dmodel.model)");
  }
  static std::string without_slash(std::string_view name) {
    return std::string(name.starts_with('/') ? name.substr(1) : name);
  }
  /// Reads each part once.
  Result<const Part*> part_named(const std::string& name) {
    if (const auto known = parts_.find(name); known != parts_.end()) return &known->second;
    if (!zip_.has(name)) return make_error(ErrorCode::BadFormat, "the 3MF has no part " + printable(name));
    const auto xml = zip_.read(name);
    if (!xml) return xml.error();
    auto part = PartReader(name).read(*xml);
    if (!part) return part.error();
    for (const auto& [id, object] : part->objects) defined_ += object.triangles.size();
    for (const auto& [what, count] : part->left_out) left_out_[what] += count;
    return &parts_.emplace(name, std::move(*part)).first->second;
  }

  Status add(const Placed& placed, const std::string& from, const glm::dmat4& above, int depth) {
    constexpr int kDeepest = 32;
    if (depth > kDeepest) return make_error(ErrorCode::LimitExceeded, "components are nested more than 32 deep");
    const std::string name = placed.path.empty() ? from : without_slash(placed.path);
    const auto part = part_named(name);
    if (!part) return part.error();
    const auto found = (*part)->objects.find(placed.object);
    if (found == (*part)->objects.end()) {
      return make_error(ErrorCode::BadFormat,
                        "object " + std::to_string(placed.object) + " does not exist in " + printable(name));
    }
    const glm::dmat4 transform = above * placed.transform;
    if (auto done = add_mesh(found->second, **part, transform); !done) return done;
    for (const Placed& component : found->second.components) {
      if (auto done = count_component(); !done) return done;
      if (auto done = add(component, name, transform, depth + 1); !done) return done;
    }
    return {};
  }
  // Nested components could otherwise grow without bounds.
  Status count_component() {
    constexpr std::size_t kMost = std::size_t{1} << 20;
    if (++components_ <= kMost) return {};
    return make_error(ErrorCode::LimitExceeded, "more than 2^20 components are placed");
  }

  Status add_mesh(const Object& object, const Part& part, const glm::dmat4& transform) {
    constexpr std::size_t kFree = std::size_t{1} << 22;
    constexpr std::size_t kTimes = 64;
    placed_ += object.triangles.size() + object.vertices.size() / 8;
    if (placed_ > kFree + kTimes * defined_) {
      return make_error(ErrorCode::LimitExceeded, "the components place far more triangles than the file has");
    }
    const bool is_mirrored = glm::determinant(glm::dmat3(transform)) < 0.0;
    std::unordered_map<std::uint64_t, std::size_t> known;
    for (const Triangle& triangle : object.triangles) {
      std::array<std::size_t, 3> corners{};
      for (std::size_t i = 0; i < 3; ++i) {
        const Rgba8 colour = colour_of(object, part, triangle, i);
        const std::uint32_t vertex = triangle.corners[i];
        if (vertex >= object.vertices.size()) {
          corners[i] = std::string_view::npos;
          continue;
        }
        const std::uint64_t key = std::uint64_t{vertex} << 32 | std::uint64_t{colour.r} << 24 |
                                  std::uint64_t{colour.g} << 16 | std::uint64_t{colour.b} << 8 | colour.a;
        const auto [place, is_new] = known.try_emplace(key, loaded_.mesh.positions.size());
        if (is_new) add_corner(DVec3(transform * glm::dvec4(object.vertices[vertex], 1.0)), colour);
        corners[i] = place->second;
      }
      if (is_mirrored) std::swap(corners[1], corners[2]);
      if (const auto added = builder_.add(corners[0], corners[1], corners[2]); !added) return added.error();
    }
    return {};
  }
  void add_corner(const DVec3& position, Rgba8 colour) {
    loaded_.mesh.positions.push_back(position);
    const Vec3 light = linear_colour(colour);
    loaded_.mesh.colours.emplace_back(light.x, light.y, light.z, static_cast<float>(colour.a) / 255.0F);
    is_clear_ |= colour.a < 255;
  }
  Rgba8 colour_of(const Object& object, const Part& part, const Triangle& triangle, std::size_t corner) {
    QUOIN_ASSERT(corner < triangle.colours.size(), "corner < 3");
    constexpr Rgba8 kGrey{200, 200, 200, 255};
    const bool is_own = triangle.colours[0] != kNone;
    const std::int64_t group = triangle.group != kNone ? triangle.group : object.group;
    const std::int64_t index = is_own ? triangle.colours[corner] : object.colour;
    if (group == kNone || index == kNone) return kGrey;
    const auto found = part.colours.find(group);
    const bool is_there = found != part.colours.end() && static_cast<std::size_t>(index) < found->second.size();
    without_colour_ += is_there ? 0 : 1;
    return is_there ? found->second[static_cast<std::size_t>(index)] : kGrey;
  }

  void finish() {
    MeshMaterial plain;
    if (is_clear_) plain.alpha_mode = AlphaMode::Blend;
    loaded_.mesh.materials.push_back(std::move(plain));
    for (const auto& [what, count] : left_out_) {
      loaded_.warnings.push_back("left out: " + what + ": " + with_thousands(static_cast<std::int64_t>(count)));
    }
    if (without_colour_ > 0) {
      loaded_.warnings.push_back("colours of corners left out: " +
                                 with_thousands(static_cast<std::int64_t>(without_colour_)));
    }
  }

  ZipParts zip_;
  std::map<std::string, Part> parts_;
  LoadedMesh loaded_;
  MeshBuilder builder_{loaded_};
  std::map<std::string, std::size_t> left_out_;
  std::size_t defined_ = 0;  // number of triangles
  std::size_t placed_ = 0;
  std::size_t components_ = 0;
  std::size_t without_colour_ = 0;
  bool is_clear_ = false;
};

Result<LoadedMesh> read_three_mf(std::span<const std::byte> bytes, SidecarReader&) {
  auto zip = ZipParts::open(bytes);
  if (!zip) return zip.error();
  return Package(std::move(*zip)).read();
}

#else

constexpr FormatCapability kReading{};

Result<LoadedMesh> read_three_mf(std::span<const std::byte>, SidecarReader&) {
  return make_error(ErrorCode::Unsupported, "cannot read 3MF: Quoin was built without expat (Debian: libexpat1-dev)");
}

#endif

}  // namespace

}  // namespace quoin::triangles

namespace quoin {

namespace {

/// Surfaces for printers are separated by a hundredth of a voxel.
constexpr double kMostSteps = 1 << 16;
constexpr std::string_view kContentTypes =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
)";

constexpr std::string_view kRelations =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
)";

constexpr std::string_view kModel =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" )"
    R"(xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02">
)";

using Colour = std::array<std::uint8_t, 4>;

/// The colours of all meshes, numbered in order of occurrence.
class Colours {
 public:
  std::uint32_t number_of(const Colour& colour) {
    const auto key = std::bit_cast<std::uint32_t>(colour);
    const auto [known, is_new] = numbers_.try_emplace(key, static_cast<std::uint32_t>(all_.size()));
    if (is_new) all_.push_back(colour);
    return known->second;
  }
  [[nodiscard]] const std::vector<Colour>& all() const { return all_; }

 private:
  std::vector<Colour> all_;
  std::unordered_map<std::uint32_t, std::uint32_t> numbers_;
};

Colour colour_of(const MeshView& view, std::size_t vertex, const VoxelRegistry& types) {
  if (view.has_albedo()) {
    const auto [r, g, b] = srgb_colour(without_occlusion(view), vertex);
    return {r, g, b, 255};
  }
  QUOIN_ASSERT(vertex < view.types.size(), "a vertex with a type");
  const VoxelProperties& type = types[view.types[vertex]];
  const bool is_glass = type.visibility == Visibility::Transparent;
  return {type.colour.r, type.colour.g, type.colour.b, is_glass ? type.colour.a : std::uint8_t{255}};
}

void append(std::string& text, double value) {
  std::array<char, 32> room;
  // As exactly as floats.
  const auto end = std::to_chars(room.data(), room.data() + room.size(), static_cast<float>(value)).ptr;
  text.append(room.data(), end);
}

void append(std::string& text, std::uint64_t value) {
  std::array<char, 32> room;
  text.append(room.data(), std::to_chars(room.data(), room.data() + room.size(), value).ptr);
}

std::string escaped(std::string_view name) {
  std::string text;
  for (const char c : name) {
    if (c == '&') {
      text += "&amp;";
    } else if (c == '<') {
      text += "&lt;";
    } else if (c == '"') {
      text += "&quot;";
    } else if (static_cast<unsigned char>(c) >= ' ') {
      text += c;
    }
  }
  return text;
}

struct PositionHash {
  std::size_t operator()(const Vec3& v) const {
    const auto bits = [](float f) { return std::uint64_t{std::bit_cast<std::uint32_t>(f)}; };
    std::uint64_t hash = bits(v.x) * 0x9E37'79B9'7F4A'7C15U;
    hash = (hash ^ bits(v.y)) * 0x9E37'79B9'7F4A'7C15U;
    hash = (hash ^ bits(v.z)) * 0x9E37'79B9'7F4A'7C15U;
    return hash ^ hash >> 32;
  }
};

/// Writes the model piece by piece.
class ModelWriter {
 public:
  ModelWriter(const SceneMeshes& meshes, ZipFile& zip) : meshes_(meshes), zip_(zip) {}

  void write() {
    text_ = kModel;
    text_ += "<metadata name=\"Application\">Quoin ";
    text_.append(version()).append("</metadata>\n<resources>\n");
    write_colours();
    std::size_t object = kFirstObject;
    for (const MeshPlacement* placement : placements_by_part(meshes_)) {
      if (has_triangle(*placement)) write_object(*placement, object++);
    }
    text_ += "</resources>\n<build>\n";
    for (std::size_t i = kFirstObject; i < object; ++i) {
      text_ += "<item objectid=\"" + std::to_string(i) + "\"" + transform_text(origins_[i - kFirstObject]) + "/>\n";
    }
    text_ += "</build>\n</model>\n";
    zip_.put(text_);
  }

 private:
  static constexpr std::size_t kFirstObject = 2;  // after the colours

  [[nodiscard]] bool has_triangle(const MeshPlacement& placement) const {
    QUOIN_ASSERT(placement.part < meshes_.parts.size(), "a part of the meshes");
    for (const MeshView& view : meshes_.parts[placement.part].surfaces) {
      if (!view.indices.empty()) return true;
    }
    return false;
  }
  void flush() {
    constexpr std::size_t kPiece = std::size_t{1} << 20;
    if (text_.size() < kPiece) return;
    zip_.put(text_);
    text_.clear();
  }
  void write_colours() {
    for (const MeshPlacement* placement : placements_by_part(meshes_)) {
      for (const MeshView& view : meshes_.parts[placement->part].surfaces) {
        for (const std::uint32_t index : view.indices) (void)colours_.number_of(colour_of(view, index, meshes_.types));
      }
    }
    if (colours_.all().empty()) return;
    text_ += "<m:colorgroup id=\"1\">\n";
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    for (const Colour& colour : colours_.all()) {
      text_ += "<m:color color=\"#";
      for (const std::uint8_t channel : colour) {
        text_ += kDigits[channel >> 4];
        text_ += kDigits[channel & 15];
      }
      text_ += "\"/>\n";
      flush();
    }
    text_ += "</m:colorgroup>\n";
  }
  void write_object(const MeshPlacement& placement, std::size_t id) {
    const MeshPart& part = meshes_.parts[placement.part];
    const VertexTransform in_world(placement.matrix(), part.pivot);
    origins_.push_back(float_origin(bounds_of(part, in_world), kMostSteps * in_world.least_step()));
    const VertexTransform transform = in_world.relative_to(origins_.back());
    text_ += "<object id=\"" + std::to_string(id) + "\" type=\"model\" pid=\"1\" pindex=\"0\" name=\"" +
             escaped(name_of(meshes_, placement)) + "\">\n<mesh>\n<vertices>\n";
    // Vertices of equal position are merged, so that adjacent triangles share them.
    std::unordered_map<Vec3, std::uint32_t, PositionHash> numbers;
    for (const MeshView& view : part.surfaces) {
      for (const std::uint32_t index : view.indices) {
        // 0 and -0 are the same position.
        const Vec3 at = view.positions[index] + 0.0F;
        if (!numbers.try_emplace(at, static_cast<std::uint32_t>(numbers.size())).second) continue;
        const DVec3 p = transform.position(at);
        text_ += "<vertex x=\"";
        append(text_, p.x);
        text_ += "\" y=\"";
        append(text_, p.y);
        text_ += "\" z=\"";
        append(text_, p.z);
        text_ += "\"/>\n";
        flush();
      }
    }
    text_ += "</vertices>\n<triangles>\n";
    for (const MeshView& view : part.surfaces) write_triangles(view, transform.mirrors(), numbers);
    text_ += "</triangles>\n</mesh>\n</object>\n";
  }
  /// Returns the attribute that positions an object whose vertices are relative to `origin`.
  static std::string transform_text(const DVec3& origin) {
    if (origin == DVec3(0.0)) return {};
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), " transform=\"1 0 0 0 1 0 0 0 1 %.0f %.0f %.0f\"", origin.x + 0.0,
                  origin.y + 0.0, origin.z + 0.0);
    return text.data();
  }
  void write_triangles(const MeshView& view, bool turned,
                       const std::unordered_map<Vec3, std::uint32_t, PositionHash>& numbers) {
    constexpr std::array<std::string_view, 3> kVertex = {"<triangle v1=\"", "\" v2=\"", "\" v3=\""};
    constexpr std::array<std::string_view, 3> kColour = {"\" pid=\"1\" p1=\"", "\" p2=\"", "\" p3=\""};
    for (std::size_t i = 0; i < view.indices.size(); i += 3) {
      const auto corners = corners_of(view, i, turned);
      std::array<std::uint32_t, 3> colours{};
      for (std::size_t k = 0; k < 3; ++k) {
        text_ += kVertex[k];
        append(text_, std::uint64_t{numbers.at(view.positions[corners[k]] + 0.0F)});
        colours[k] = colours_.number_of(colour_of(view, corners[k], meshes_.types));
      }
      const bool is_plain = colours[0] == colours[1] && colours[0] == colours[2];
      for (std::size_t k = 0; k < (is_plain ? 1U : 3U); ++k) {
        text_ += kColour[k];
        append(text_, std::uint64_t{colours[k]});
      }
      text_ += "\"/>\n";
      flush();
    }
  }

  const SceneMeshes& meshes_;
  ZipFile& zip_;
  Colours colours_;
  std::string text_;
  std::vector<DVec3> origins_;  ///< origins of objects
};

Result<std::vector<MeshFile>> plan_three_mf(const SceneMeshes& meshes, const std::filesystem::path& path,
                                            const MeshFileOptions& /*options*/) {
  ZipFile zip;
  zip.begin("[Content_Types].xml");
  zip.put(kContentTypes);
  zip.begin("_rels/.rels");
  zip.put(kRelations);
  zip.begin("3D/3dmodel.model");
  ModelWriter(meshes, zip).write();
  auto bytes = zip.take();
  if (!bytes) return bytes.error();
  const std::uint64_t size = bytes->size();
  auto shared = std::make_shared<const std::vector<std::byte>>(std::move(*bytes));
  return std::vector<MeshFile>{{path, size, [shared](BlockWriter& out) {
                                  out.put_text({reinterpret_cast<const char*>(shared->data()), shared->size()});
                                }}};
}

}  // namespace

extern constinit const FormatDriver kThreeMfFormat = {
    .info = {FileFormat::ThreeMf, ".3mf", "3MF, for printing, with colours",
             triangles::kReading | FormatCapability::Write | FormatCapability::Meshes | FormatCapability::Printing, "",
             UpAxis::Z},
    .detect = triangles::is_three_mf,
    .detect_name = triangles::is_named_three_mf,
    .read_mesh = triangles::read_three_mf,
    .plan_mesh = plan_three_mf,
};

}  // namespace quoin
