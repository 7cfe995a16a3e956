// 3MF. Source: 3MF Consortium, "3D Manufacturing Format" core specification 1.3, and its materials extension 1.2.1.

#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>

#include <quoin/core/hash.h>
#include <quoin/version.h>

#include "core/srgb.h"
#include "io/mesh_parts.h"
#include "io/print/zip_file.h"

namespace quoin {

namespace {

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
    origins_.push_back(float_origin(bounds_of(part, in_world), kMostStepsOfStl * in_world.least_step()));
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

}  // namespace

Result<std::vector<MeshFile>> plan_three_mf(const SceneMeshes& meshes, const std::filesystem::path& path) {
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

}  // namespace quoin
