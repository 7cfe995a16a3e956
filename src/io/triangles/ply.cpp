// The Polygon File Format. Source: G. Turk, "The PLY Polygon File Format" (1994).

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <glm/vec4.hpp>

#include <quoin/core/assert.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/version.h>

#include "core/bytes/bytes.h"
#include "core/srgb.h"
#include "io/format_driver.h"
#include "io/mesh_parts.h"
#include "io/triangles/triangles.h"

namespace quoin::triangles {

namespace {

enum class Encoding : std::uint8_t { Text, LittleEndian, BigEndian };

enum class Scalar : std::uint8_t { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };

constexpr std::array<std::size_t, 8> kBytes = {1, 1, 2, 2, 4, 4, 4, 8};

std::optional<Scalar> scalar_of(std::string_view word) {
  constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames = {{{"char", Scalar::Int8},
                                                                           {"int8", Scalar::Int8},
                                                                           {"uchar", Scalar::UInt8},
                                                                           {"uint8", Scalar::UInt8},
                                                                           {"short", Scalar::Int16},
                                                                           {"int16", Scalar::Int16},
                                                                           {"ushort", Scalar::UInt16},
                                                                           {"uint16", Scalar::UInt16},
                                                                           {"int", Scalar::Int32},
                                                                           {"int32", Scalar::Int32},
                                                                           {"uint", Scalar::UInt32},
                                                                           {"uint32", Scalar::UInt32},
                                                                           {"float", Scalar::Float32},
                                                                           {"float32", Scalar::Float32},
                                                                           {"double", Scalar::Float64},
                                                                           {"float64", Scalar::Float64}}};
  for (const auto& [name, scalar] : kNames) {
    if (name == word) return scalar;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Scalar type = Scalar::Float32;
  std::optional<Scalar> count{};  // type of a list's length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::Text;
  std::vector<Element> elements;
  std::size_t end = 0;
};

/// Returns the character that ends header lines: old Macintosh programs wrote only a carriage return. The first line
/// decides, since a line feed after the last line may be the first byte of the values.
char line_end(std::string_view text) {
  return text.starts_with("ply\r") && !text.starts_with("ply\r\n") ? '\r' : '\n';
}

/// A line without its end, and the start of the next line.
std::string_view line_at(std::string_view text, char line_end, std::size_t& at) {
  const std::size_t first = at;
  const std::size_t end = std::min(text.find(line_end, first), text.size());
  at = std::min(end + 1, text.size());
  std::string_view line = text.substr(first, end - first);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

Result<Property> property_of(Words& words, std::size_t line) {
  Property property;
  auto word = words.next();
  if (word == "list") {
    const auto count_type = words.next();
    property.count = count_type ? scalar_of(*count_type) : std::nullopt;
    if (!property.count || *property.count >= Scalar::Float32)
      return bad_at(line, "a list property has no type for its length");
    word = words.next();
  }
  const auto type = word ? scalar_of(*word) : std::nullopt;
  const auto name = words.next();
  if (!type || !name) return bad_at(line, "a property has no type or no name");
  property.type = *type;
  property.name = *name;
  return property;
}

Result<Encoding> encoding_of(Words& words, std::size_t line) {
  const auto word = words.next();
  if (word == "ascii") return Encoding::Text;
  if (word == "binary_little_endian") return Encoding::LittleEndian;
  if (word == "binary_big_endian") return Encoding::BigEndian;
  return bad_at(line, "unknown PLY format");
}

Result<Header> read_header(std::string_view text) {
  Header header;
  bool has_format = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t line = at;
    Words words(line_at(text, line_end(text), at));
    const auto key = words.next();
    if (!key) continue;
    if (*key == "end_header") {
      header.end = at;
      if (!has_format) return bad_at(line, "the PLY header has no format");
      return header;
    }
    if (*key == "format") {
      const auto encoding = encoding_of(words, line);
      if (!encoding) return encoding.error();
      header.encoding = *encoding;
      has_format = true;
    } else if (*key == "element") {
      const auto name = words.next();
      const auto count = words.next_number();
      if (!name || !count || !(*count >= 0.0) || *count > 9e15)
        return bad_at(line, "an element has no name or no count");
      header.elements.push_back({std::string(*name), static_cast<std::uint64_t>(*count), {}});
    } else if (*key == "property") {
      if (header.elements.empty()) return bad_at(line, "a property comes before any element");
      auto property = property_of(words, line);
      if (!property) return property.error();
      header.elements.back().properties.push_back(std::move(*property));
    }
  }
  return bad_at(text.size(), "the file ends within the PLY header");
}

/// Reads the values of a body one after another.
class Values {
 public:
  Values(std::span<const std::byte> bytes, const Header& header)
      : bytes_(bytes), encoding_(header.encoding), words_(text_of(bytes), header.end), at_(header.end) {}

  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] std::size_t position() const { return encoding_ == Encoding::Text ? words_.position() : at_; }
  /// Returns the number of bytes left.
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - std::min(position(), bytes_.size()); }
  /// Returns the minimum size of values of a type.
  [[nodiscard]] std::size_t least_bytes(Scalar type) const {
    return encoding_ == Encoding::Text ? 1 : kBytes[static_cast<std::size_t>(type)];
  }
  [[nodiscard]] double next(Scalar type) {
    if (encoding_ == Encoding::Text) {
      const auto number = words_.next_number();
      failed_ |= !number;
      return number.value_or(0.0);
    }
    const std::size_t size = kBytes[static_cast<std::size_t>(type)];
    QUOIN_ASSERT(at_ <= bytes_.size(), "a position within the file");
    if (size > bytes_.size() - at_) {
      failed_ = true;
      return 0.0;
    }
    std::array<unsigned char, 8> own{};
    std::memcpy(own.data(), bytes_.data() + at_, size);
    at_ += size;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t place = encoding_ == Encoding::LittleEndian ? i : size - 1 - i;
      bits |= std::uint64_t{own[i]} << (8 * place);
    }
    return value_of(bits, type);
  }

 private:
  static double value_of(std::uint64_t bits, Scalar type) {
    switch (type) {
      case Scalar::Int8:
        return static_cast<std::int8_t>(bits);
      case Scalar::Int16:
        return static_cast<std::int16_t>(bits);
      case Scalar::Int32:
        return static_cast<std::int32_t>(bits);
      case Scalar::Float32:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      case Scalar::Float64:
        return std::bit_cast<double>(bits);
      default:
        return static_cast<double>(bits);
    }
  }

  std::span<const std::byte> bytes_;
  Encoding encoding_;
  Words words_;
  std::size_t at_;
  bool failed_ = false;
};

/// Returns the meaning of a vertex property: 0 to 2 are x to z, 3 to 6 are red to alpha.
std::optional<std::size_t> meaning_of(std::string_view name) {
  constexpr std::array<std::string_view, 7> kNames = {"x", "y", "z", "red", "green", "blue", "alpha"};
  if (name.starts_with("diffuse_")) name.remove_prefix(8);
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == name) return i;
  }
  return std::nullopt;
}

/// Returns a channel as 0 to 1; integers are divided by their type's maximum.
float share_of(double value, Scalar type) {
  if (type == Scalar::UInt8) value /= 255.0;
  if (type == Scalar::UInt16) value /= 65'535.0;
  return value >= 0.0 && value <= 1.0 ? static_cast<float>(value) : (value > 1.0 ? 1.0F : 0.0F);
}

Error ends_within(const Values& values, const Element& element) {
  return bad_at(values.position(), "the file ends, or a number is invalid, within its " +
                                       std::to_string(element.count) + " of " + element.name);
}

class PlyReader {
 public:
  PlyReader(std::span<const std::byte> bytes, const Header& header) : values_(bytes, header), header_(header) {}

  Result<LoadedMesh> read() {
    for (const Element& element : header_.elements) {
      if (Status done = read_element(element); !done) return done.error();
    }
    builder_.finish();
    if (!has_faces_ && loaded_.mesh.triangles.empty()) {
      loaded_.warnings.emplace_back("the file has points but no faces");
    }
    return std::move(loaded_);
  }

 private:
  Status read_element(const Element& element) {
    if (element.properties.empty()) return {};
    std::size_t least = 0;
    for (const Property& p : element.properties) least += values_.least_bytes(p.count.value_or(p.type));
    if (element.count > values_.remaining() / least) {
      return bad_at(values_.position(), "the file claims " + std::to_string(element.count) + " of " + element.name +
                                            " but has bytes for " + std::to_string(values_.remaining() / least));
    }
    if (element.name == "vertex") {
      // Their properties may differ, and indices do not say which element they refer to.
      if (std::exchange(has_vertices_, true))
        return bad_at(values_.position(), "more than one element is named vertex");
      return read_vertices(element);
    }
    const bool is_strips = element.name == "tristrips";
    const bool is_faces = element.name == "face" || is_strips;
    has_faces_ |= is_faces;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        const bool is_corners =
            is_faces && property.count && (property.name == "vertex_indices" || property.name == "vertex_index");
        if (Status done = read_list(property); !done) return done;
        if (values_.failed()) return ends_within(values_, element);
        if (!is_corners) continue;
        if (Status done = is_strips ? add_strip() : add_polygon(); !done) return done;
      }
    }
    return {};
  }
  /// Reads a list or a value.
  Status read_list(const Property& property) {
    list_.clear();
    if (!property.count) {
      (void)values_.next(property.type);
      return {};
    }
    const std::size_t at = values_.position();
    const double count = values_.next(*property.count);
    const std::size_t room = values_.remaining() / values_.least_bytes(property.type);
    if (!(count >= 0.0) || count > static_cast<double>(room + 1)) {
      return bad_at(at, "a list extends past the end of the file");
    }
    for (auto i = static_cast<std::size_t>(count); i > 0 && !values_.failed(); --i) {
      const double value = values_.next(property.type);
      // Invalid indices become kNowhere.
      list_.push_back(value >= -1.0 && value < 4294967295.0 ? static_cast<std::int64_t>(value) : kNowhere);
    }
    return {};
  }
  Status add(std::int64_t a, std::int64_t b, std::int64_t c) {
    const auto added =
        builder_.add(static_cast<std::size_t>(a), static_cast<std::size_t>(b), static_cast<std::size_t>(c));
    return added ? Status() : Status(added.error());
  }
  Status add_polygon() {
    corners_.clear();
    for (const std::int64_t corner : list_) corners_.push_back(static_cast<std::size_t>(corner));
    return builder_.add_polygon(corners_, [](const std::array<std::uint32_t, 3>&) {});
  }
  /// Strips end at -1. Every other triangle is reversed.
  Status add_strip() {
    std::size_t first = 0;
    for (std::size_t i = 0; i < list_.size(); ++i) {
      if (list_[i] == -1) {
        first = i + 1;
      } else if (i >= first + 2) {
        const bool is_odd = (i - first) % 2 != 0;
        if (Status done = add(list_[i - 2], list_[is_odd ? i : i - 1], list_[is_odd ? i - 1 : i]); !done) return done;
      }
    }
    return {};
  }
  Status read_vertices(const Element& element) {
    bool has_colours = false;
    for (const Property& p : element.properties) has_colours |= !p.count && meaning_of(p.name) == std::size_t{3};
    for (std::uint64_t i = 0; i < element.count; ++i) {
      DVec3 at(0.0);
      glm::vec4 colour(1.0F);
      for (const Property& property : element.properties) {
        if (property.count) {
          if (Status done = read_list(property); !done) return done;
          continue;
        }
        const double value = values_.next(property.type);
        const auto meaning = meaning_of(property.name);
        if (!meaning) continue;
        if (*meaning < 3) at[static_cast<int>(*meaning)] = value;
        if (*meaning >= 3) colour[static_cast<int>(*meaning) - 3] = share_of(value, property.type);
      }
      if (values_.failed()) return ends_within(values_, element);
      loaded_.mesh.positions.push_back(at);
      if (!has_colours) continue;
      for (int channel = 0; channel < 3; ++channel) colour[channel] = linear_from_srgb(colour[channel]);
      loaded_.mesh.colours.push_back(colour);
    }
    return {};
  }

  static constexpr std::int64_t kNowhere = std::numeric_limits<std::int64_t>::max();
  Values values_;
  const Header& header_;
  LoadedMesh loaded_;
  MeshBuilder builder_{loaded_};
  std::vector<std::int64_t> list_;
  std::vector<std::size_t> corners_;
  bool has_faces_ = false;
  bool has_vertices_ = false;
};

bool is_ply(std::span<const std::byte> beginning) {
  const std::string_view text = text_of(beginning);
  return text.starts_with("ply\n") || text.starts_with("ply\r");
}

Result<LoadedMesh> read_ply(std::span<const std::byte> bytes, SidecarReader&) {
  const auto header = read_header(text_of(bytes));
  if (!header) return header.error();
  return PlyReader(bytes, *header).read();
}

}  // namespace

}  // namespace quoin::triangles

namespace quoin {

namespace {

constexpr double kMostPlySteps = 1 << 20;
static_assert(std::endian::native == std::endian::little, "the format written is little-endian");

constexpr std::size_t kVertexBytes = 6 * 4 + 3;  // position and normal as floats, red, green and blue as bytes
constexpr std::size_t kFaceBytes = 1 + 3 * 4;    // a byte of 3, and three int
constexpr std::size_t kOcclusions = 4;

using Srgb = std::array<std::uint8_t, 3>;

struct Counts {
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
};

/// Formats whole numbers: "20000000 64 0".
std::string text_of(const DVec3& v) {
  std::array<char, 128> text{};
  return {text.data(), static_cast<std::size_t>(
                           std::snprintf(text.data(), text.size(), "%.0f %.0f %.0f", v.x + 0.0, v.y + 0.0, v.z + 0.0))};
}

std::string header_of(const Counts& counts, OcclusionIn occlusion, const DVec3& origin) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment Quoin ";
  text.append(version()).append("\n");
  if (origin != DVec3(0.0)) text += "comment offset " + text_of(origin) + " (add it to x y z)\n";
  text += "element vertex " + std::to_string(counts.vertices) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) text += "property float " + std::string(name) + "\n";
  for (const char* name : {"red", "green", "blue"}) text += "property uchar " + std::string(name) + "\n";
  if (occlusion == OcclusionIn::Attribute) text += "property float ao\n";
  text += "element face " + std::to_string(counts.faces) + "\n";
  return text + "property list uchar int vertex_indices\nend_header\n";
}

/// Appends a colour at every occlusion.
void append_colours(Rgba8 colour, std::vector<Srgb>& colours) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  // Rounded through 16 bits, like the colours of smooth meshes.
  const auto darkened = [&](std::uint8_t byte, std::uint8_t occlusion) {
    const auto linear = static_cast<std::uint16_t>(std::lround(linear_from_srgb(byte) * 65'535.0F));
    return encode(static_cast<float>(linear) / 65'535.0F * occlusion_brightness(occlusion));
  };
  for (std::uint8_t occlusion = 0; occlusion < kOcclusions; ++occlusion) {
    colours.push_back({darkened(colour.r, occlusion), darkened(colour.g, occlusion), darkened(colour.b, occlusion)});
  }
}

/// The colours of all types at every occlusion, [type * kOcclusions + occlusion].
std::vector<Srgb> colours_of(const VoxelRegistry& types) {
  std::vector<Srgb> colours;
  colours.reserve(types.size() * kOcclusions);
  for (std::size_t type = 0; type < types.size(); ++type) {
    append_colours(types[static_cast<VoxelType>(type)].colour, colours);
  }
  return colours;
}

void put_vertex(const Vec3& position, const Vec3& normal, const Srgb& colour, BlockWriter& out) {
  char* at = out.room(kVertexBytes);
  std::memcpy(at, &position, sizeof(position));
  std::memcpy(at + sizeof(position), &normal, sizeof(normal));
  std::memcpy(at + sizeof(position) + sizeof(normal), colour.data(), colour.size());
  out.advance(at + kVertexBytes);
}

void write_vertices(const MeshView& view, const VertexTransform& transform, const std::vector<Srgb>& colours,
                    OcclusionIn occlusion, BlockWriter& out) {
  const bool is_apart = occlusion == OcclusionIn::Attribute;
  const MeshView coloured = is_apart ? without_occlusion(view) : view;
  if (view.has_albedo()) {
    for (std::size_t i = 0; i < view.positions.size() && !out.failed(); ++i) {
      put_vertex(Vec3(transform.position(view.positions[i])), Vec3(transform.normal(view.normals[i])),
                 srgb_colour(coloured, i), out);
      if (is_apart) out.put(openness_at(view, i));
    }
    return;
  }
  const auto normals = transform.face_normals();
  const bool is_darkened = !coloured.block_occlusion.empty();
  std::vector<Srgb> tints;  // of faces of shapes without textures
  for (const VoxelFace& face : view.faces) append_colours(face.tint, tints);
  for (std::size_t i = 0; i < view.positions.size() && !out.failed(); ++i) {
    QUOIN_ASSERT((view.types[i] + std::size_t{1}) * kOcclusions <= colours.size() &&
                     static_cast<std::size_t>(view.directions[i]) < normals.size(),
                 "a type and a direction with a colour and a normal");
    const VertexLook look = view.looks.empty() ? VertexLook() : view.looks[i];
    const bool is_tinted = look.face != 0 && view.faces[look.face - 1].texture.is_null();
    const std::size_t colour = is_tinted ? look.face - std::size_t{1} : view.types[i];
    const Vec3 normal = look.normal == Vec3(0.0F) ? normals[static_cast<std::size_t>(view.directions[i])]
                                                  : Vec3(transform.normal(look.normal));
    put_vertex(Vec3(transform.position(view.positions[i])), normal,
               (is_tinted ? tints : colours)[colour * kOcclusions + (is_darkened ? view.block_occlusion[i] : 0)], out);
    if (is_apart) out.put(openness_at(view, i));
  }
}

void write_faces(const MeshView& view, bool turned, std::uint64_t first, BlockWriter& out) {
  for (std::size_t i = 0; i < view.indices.size() && !out.failed(); i += 3) {
    const auto [a, b, c] = corners_of(view, i, turned);
    QUOIN_ASSERT(first + std::max({a, b, c}) <= 0x7FFF'FFFF, "numbers of 31 bits");
    const std::array corners = {static_cast<std::int32_t>(first + a), static_cast<std::int32_t>(first + b),
                                static_cast<std::int32_t>(first + c)};
    char* at = out.room(kFaceBytes);
    *at = 3;
    std::memcpy(at + 1, corners.data(), sizeof(corners));
    out.advance(at + kFaceBytes);
  }
}

/// Calls `use(view, transform)` for every surface with a triangle, in each placement of its part, relative to `origin`.
template <class Use>
void for_each_surface(const SceneMeshes& meshes, const DVec3& origin, Use use) {
  for (const MeshPlacement* placement : placements_by_part(meshes)) {
    const MeshPart& part = meshes.parts[placement->part];
    const VertexTransform transform = VertexTransform(placement->matrix(), part.pivot).relative_to(origin);
    for (const MeshView& view : part.surfaces) {
      if (!view.indices.empty()) use(view, transform);
    }
  }
}

/// The content of a file except its meshes.
struct PlyPlan {
  std::string header;
  OcclusionIn occlusion{};
  DVec3 origin{0.0};
};

void write_content(const SceneMeshes& meshes, const PlyPlan& plan, BlockWriter& out) {
  const std::vector<Srgb> colours = colours_of(meshes.types);
  out.put_text(plan.header);
  for_each_surface(meshes, plan.origin, [&](const MeshView& view, const VertexTransform& transform) {
    write_vertices(view, transform, colours, plan.occlusion, out);
  });
  std::uint64_t first = 0;
  for_each_surface(meshes, plan.origin, [&](const MeshView& view, const VertexTransform& transform) {
    write_faces(view, transform.mirrors(), first, out);
    first += view.positions.size();
  });
}

Result<std::vector<MeshFile>> plan_ply(const SceneMeshes& meshes, const std::filesystem::path& path,
                                       const MeshFileOptions& options) {
  PlyPlan plan{{}, options.occlusion_in, file_origin(meshes, kMostPlySteps)};
  Counts counts;
  for_each_surface(meshes, plan.origin, [&](const MeshView& view, const VertexTransform&) {
    counts.vertices += view.positions.size();
    counts.faces += view.indices.size() / 3;
  });
  constexpr std::uint64_t kMost = 0x7FFF'FFFF;
  if (counts.vertices > kMost || counts.faces > kMost) {
    return make_error(ErrorCode::LimitExceeded, "the meshes have " + std::to_string(counts.vertices) +
                                                    " vertices and " + std::to_string(counts.faces) +
                                                    " triangles, more than the 2147483647 of each in a PLY file");
  }
  plan.header = header_of(counts, plan.occlusion, plan.origin);
  const std::size_t of_vertex = kVertexBytes + (plan.occlusion == OcclusionIn::Attribute ? sizeof(float) : 0);
  const std::uint64_t bytes = plan.header.size() + counts.vertices * of_vertex + counts.faces * kFaceBytes;
  return std::vector<MeshFile>{
      {path, bytes, [&meshes, plan = std::move(plan)](BlockWriter& out) { write_content(meshes, plan, out); }}};
}

}  // namespace

extern constinit const FormatDriver kPlyFormat = {
    .info = {FileFormat::Ply, ".ply", "Polygon File Format, binary (read as text too)",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Meshes |
                 FormatCapability::OcclusionAttribute,
             "", UpAxis::Z},
    .detect = triangles::is_ply,
    .read_mesh = triangles::read_ply,
    .plan_mesh = plan_ply,
    .most_steps = kMostPlySteps,
};

}  // namespace quoin
