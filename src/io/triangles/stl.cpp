// STL as text and as bytes. Source: 3D Systems, "StereoLithography Interface Specification" (1989); colours as VisCAM
// and Magics put them into the two bytes that the format leaves unused.
//
// STL, binary. Source: 3D Systems, "StereoLithography Interface Specification" (1989).

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <quoin/version.h>

#include "core/bytes/bytes.h"
#include "core/srgb.h"
#include "io/format_driver.h"
#include "io/mesh_parts.h"
#include "io/triangles/triangles.h"

namespace quoin::triangles {

namespace {

constexpr std::size_t kHeader = 80;
constexpr std::size_t kRecord = 50;

/// A colour of 5 bits per channel, in linear light.
glm::vec4 colour_of(unsigned r, unsigned g, unsigned b) {
  const auto channel = [](unsigned five) { return linear_from_srgb(static_cast<float>(five & 31U) / 31.0F); };
  return {channel(r), channel(g), channel(b), 1.0F};
}

/// Returns the colour in the two bytes after a triangle; nullopt if there is none.
std::optional<glm::vec4> colour_of(std::uint16_t bits, const std::optional<glm::vec4>& of_all) {
  const bool is_set = (bits & 0x8000U) != 0;
  // Magics: the header has a colour for the whole model, and the highest bit selects it.
  if (of_all) return is_set ? *of_all : colour_of(bits, bits >> 5U, bits >> 10U);
  if (is_set) return colour_of(bits >> 10U, bits >> 5U, bits);
  return std::nullopt;
}

std::optional<glm::vec4> colour_of_header(std::string_view header) {
  constexpr std::string_view kKey = "COLOR=";
  const std::size_t at = header.find(kKey);
  if (at == std::string_view::npos || at + kKey.size() + 4 > header.size()) return std::nullopt;
  const auto channel = [&](std::size_t i) {
    return linear_from_srgb(static_cast<std::uint8_t>(header[at + kKey.size() + i]));
  };
  return glm::vec4{channel(0), channel(1), channel(2), 1.0F};
}

Result<LoadedMesh> read_bytes(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  const auto of_all = colour_of_header(reader.text(kHeader));
  const std::uint32_t count = reader.u32();
  if (reader.failed()) return bad_at(bytes.size(), "the file ends within the STL header");
  const std::uint64_t promised = kHeader + 4 + std::uint64_t{count} * kRecord;
  if (promised > bytes.size()) {
    return bad_at(kHeader, "the header promises " + std::to_string(count) + " triangles, which need " +
                               std::to_string(promised) + " bytes, but the file has " + std::to_string(bytes.size()));
  }
  LoadedMesh loaded;
  if (promised < bytes.size()) {
    loaded.warnings.push_back("left out: the last " + std::to_string(bytes.size() - promised) +
                              " bytes, which follow the triangles");
  }
  MeshBuilder builder(loaded);
  std::vector<glm::vec4> colours;
  bool has_colours = of_all.has_value();
  constexpr float kGrey = 0.577580F;
  for (std::uint32_t i = 0; i < count; ++i) {
    (void)reader.take(12);  // the normal, which the corners define too
    const std::size_t first = loaded.mesh.positions.size();
    for (int corner = 0; corner < 3; ++corner) {
      const float x = reader.f32();
      const float y = reader.f32();
      const float z = reader.f32();
      loaded.mesh.positions.emplace_back(x, y, z);
    }
    const auto colour = colour_of(reader.u16(), of_all);
    has_colours |= colour.has_value();
    colours.insert(colours.end(), 3, colour.value_or(glm::vec4(kGrey, kGrey, kGrey, 1.0F)));
    if (const auto added = builder.add(first, first + 1, first + 2); !added) return added.error();
  }
  if (has_colours) loaded.mesh.colours = std::move(colours);
  builder.finish();
  return loaded;
}

Result<LoadedMesh> read_text(std::span<const std::byte> bytes) {
  LoadedMesh loaded;
  MeshBuilder builder(loaded);
  Words words(text_of(bytes));
  std::size_t corners = 0;
  while (const auto word = words.next()) {
    if (*word == "facet" || *word == "endfacet") {
      if (*word == "endfacet" && corners != 3) return bad_at(words.position(), "a facet does not have three corners");
      corners = 0;
    }
    if (*word != "vertex") continue;
    std::array<double, 3> at{};
    for (double& number : at) {
      const auto value = words.next_number();
      if (!value) return bad_at(words.position(), "a vertex does not have three numbers");
      number = *value;
    }
    loaded.mesh.positions.emplace_back(at[0], at[1], at[2]);
    const std::size_t end = loaded.mesh.positions.size();
    if (++corners != 3) continue;
    if (const auto added = builder.add(end - 3, end - 2, end - 1); !added) return added.error();
  }
  if (corners != 0 && corners != 3) return bad_at(bytes.size(), "the file ends within a facet");
  builder.finish();
  return loaded;
}

bool is_stl_text(std::span<const std::byte> beginning) {
  const std::string_view text = text_of(beginning);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || !text.substr(first).starts_with("solid")) return false;
  return text.find("facet") != std::string_view::npos || text.find("endsolid") != std::string_view::npos;
}

bool is_stl(std::span<const std::byte> whole) {
  if (whole.size() < kHeader + 4) return false;
  ByteReader reader(whole);
  (void)reader.take(kHeader);
  const std::uint64_t count = reader.u32();
  return count > 0 && whole.size() == kHeader + 4 + count * kRecord;
}

/// Detects a truncated binary file, or one with trailing bytes.
bool is_named_stl(const std::filesystem::path& path, std::span<const std::byte> beginning) {
  return lower_case_extension(path) == ".stl" && beginning.size() >= kHeader + 4;
}

Result<LoadedMesh> read_stl(std::span<const std::byte> bytes, SidecarReader&) {
  // Some programs also begin binary files with "solid".
  return is_stl(bytes) || !is_stl_text(bytes) ? read_bytes(bytes) : read_text(bytes);
}

}  // namespace

}  // namespace quoin::triangles

namespace quoin {

namespace {

/// Surfaces for printers are separated by a hundredth of a voxel.
constexpr double kMostStlSteps = 1 << 16;
static_assert(std::endian::native == std::endian::little, "the format written is little-endian");

constexpr std::size_t kHeader = 80;
constexpr std::size_t kRecord = 50;

void put_triangle(const std::array<Vec3, 3>& corners, BlockWriter& out) {
  const DVec3 across = glm::cross(DVec3(corners[1]) - DVec3(corners[0]), DVec3(corners[2]) - DVec3(corners[0]));
  const double length = glm::length(across);
  const Vec3 normal = length > 0.0 ? Vec3(across / length) : Vec3(0.0F);
  char* at = out.room(kRecord);
  std::memcpy(at, &normal, sizeof(normal));
  std::memcpy(at + sizeof(normal), corners.data(), sizeof(corners));
  std::memset(at + sizeof(normal) + sizeof(corners), 0, 2);
  out.advance(at + kRecord);
}

/// Returns ", offset 20000000 64 0" with whole numbers, as far as the header has space.
std::string offset_text(const DVec3& offset) {
  std::array<char, kHeader> text{};
  std::snprintf(text.data(), text.size(), ", offset %.0f %.0f %.0f", offset.x + 0.0, offset.y + 0.0, offset.z + 0.0);
  return text.data();
}

void write_content(const SceneMeshes& meshes, std::uint32_t triangles, BlockWriter& out) {
  const DVec3 origin = file_origin(meshes, kMostStlSteps);
  std::string header = "Quoin ";
  header.append(version()).append(", millimetres");
  if (origin != DVec3(0.0)) header += offset_text(origin);
  header.resize(kHeader, ' ');
  out.put_text(header);
  out.put(triangles);
  for (const MeshPlacement* placement : placements_by_part(meshes)) {
    const MeshPart& part = meshes.parts[placement->part];
    const VertexTransform transform = VertexTransform(placement->matrix(), part.pivot).relative_to(origin);
    for (const MeshView& view : part.surfaces) {
      for (std::size_t i = 0; i < view.indices.size() && !out.failed(); i += 3) {
        std::array<Vec3, 3> corners{};
        const auto indices = corners_of(view, i, transform.mirrors());
        for (std::size_t k = 0; k < 3; ++k) corners[k] = Vec3(transform.position(view.positions[indices[k]]));
        put_triangle(corners, out);
      }
    }
  }
}

Result<std::vector<MeshFile>> plan_stl(const SceneMeshes& meshes, const std::filesystem::path& path,
                                       const MeshFileOptions& /*options*/) {
  std::uint64_t triangles = 0;
  for (const MeshPlacement* placement : placements_by_part(meshes)) {
    for (const MeshView& view : meshes.parts[placement->part].surfaces) triangles += view.indices.size() / 3;
  }
  if (triangles > 0xFFFF'FFFFU) {
    return make_error(ErrorCode::LimitExceeded, "the meshes have " + std::to_string(triangles) +
                                                    " triangles, more than the 4294967295 of an STL file");
  }
  return std::vector<MeshFile>{{path, kHeader + 4 + triangles * kRecord, [&meshes, triangles](BlockWriter& out) {
                                  write_content(meshes, static_cast<std::uint32_t>(triangles), out);
                                }}};
}

}  // namespace

extern constinit const FormatDriver kStlFormat = {
    .info = {FileFormat::Stl, ".stl", "STL, for printing",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Meshes | FormatCapability::Printing,
             "", UpAxis::Z},
    .detect = triangles::is_stl_text,
    .detect_whole = triangles::is_stl,
    .detect_name = triangles::is_named_stl,
    .read_mesh = triangles::read_stl,
    .plan_mesh = plan_stl,
    .most_steps = kMostStlSteps,
};

}  // namespace quoin
