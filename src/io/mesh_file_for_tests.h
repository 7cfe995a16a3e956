#pragma once

#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/mesh_file.h>

#include "io/gltf/glb_for_tests.h"

namespace quoin {

/// An octahedron, stretched so that no reflection or turn looks the same, with a colour and occlusion a vertex.
inline SmoothMesh test_mesh() {
  SmoothMesh mesh;
  mesh.positions = {{5, 0, 0}, {-1, 0, 0}, {0, 3, 0}, {0, -1, 0}, {0, 0, 2}, {0, 0, -1}};
  mesh.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.occlusion = {0.0F, 0.5F, 0.75F, 1.0F, 0.0F, 0.0F};
  mesh.albedo = {{65535, 0, 0, 65535},     {20001, 65535, 0, 65535}, {30000, 100, 65535, 65535},
                 {65535, 65535, 1, 65535}, {13933, 13933, 1, 65535}, {0, 0, 0, 65535}};
  mesh.types = {1, 1, 2, 2, 1, 1};
  mesh.indices = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
  return mesh;
}

/// A mesh in world space, independent of its file format.
struct WorldMesh {
  std::vector<DVec3> positions;
  std::vector<DVec3> normals;
  std::vector<std::array<double, 3>> colours;  ///< as stored, 0 to 1
  std::vector<std::size_t> indices;

  [[nodiscard]] double volume() const {
    double sum = 0.0;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      sum += glm::dot(positions[indices[i]], glm::cross(positions[indices[i + 1]], positions[indices[i + 2]])) / 6.0;
    }
    return sum;
  }

  /// Returns the number of corners whose normal points to the inside of their triangle.
  [[nodiscard]] std::size_t inward_normals() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      const DVec3 a = positions[indices[i]];
      const DVec3 face = glm::cross(positions[indices[i + 1]] - a, positions[indices[i + 2]] - a);
      for (std::size_t k = 0; k < 3; ++k) count += glm::dot(face, normals[indices[i + k]]) > 0.0 ? 0 : 1;
    }
    return count;
  }
};

inline glm::dmat4 matrix_of(const nlohmann::json& node) {
  glm::dmat4 matrix(1.0);
  if (node.contains("translation")) {
    const auto& t = node["translation"];
    matrix = glm::translate(matrix, DVec3(t[0], t[1], t[2]));
  }
  if (node.contains("rotation")) {
    const auto& r = node["rotation"];
    matrix *= glm::mat4_cast(DQuat(r[3].get<double>(), r[0].get<double>(), r[1].get<double>(), r[2].get<double>()));
  }
  if (node.contains("scale")) {
    const auto& s = node["scale"];
    matrix = glm::scale(matrix, DVec3(s[0], s[1], s[2]));
  }
  return matrix;
}

/// Every node of a GLB, one after the other.
inline WorldMesh world_of(const ParsedGlb& glb) {
  WorldMesh world;
  for (const auto& node : glb.document.value("nodes", nlohmann::json::array())) {
    const glm::dmat4 matrix = matrix_of(node);
    const glm::dmat3 normal_matrix = glm::transpose(glm::inverse(glm::dmat3(matrix)));
    const auto& primitive = glb.document["meshes"][node["mesh"].get<std::size_t>()]["primitives"][0];
    const std::size_t first = world.positions.size();
    for (const Vec3& p : glb.vectors(primitive, "POSITION")) {
      world.positions.emplace_back(matrix * glm::dvec4(DVec3(p), 1.0));
    }
    for (const Vec3& n : glb.vectors(primitive, "NORMAL")) {
      world.normals.push_back(glm::normalize(normal_matrix * DVec3(n)));
    }
    for (const auto& c : glb.array<LinearRgba16>(primitive["attributes"]["COLOR_0"].get<std::size_t>())) {
      world.colours.push_back({c[0] / 65535.0, c[1] / 65535.0, c[2] / 65535.0});
    }
    for (const std::uint32_t index : glb.indices(primitive)) world.indices.push_back(first + index);
  }
  return world;
}

inline std::string bytes_as_text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A PLY file of the properties that Quoin writes; empty when its header or length is another.
inline WorldMesh world_of_ply(const std::vector<std::byte>& bytes) {
  const std::string text = bytes_as_text(bytes);
  const std::string end = "end_header\n";
  std::istringstream header(text.substr(0, text.find(end) + end.size()));
  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::string properties;
  for (std::string line; std::getline(header, line);) {
    if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
    if (line.starts_with("element face ")) faces = std::stoul(line.substr(13));
    if (line.starts_with("property ")) properties += line.substr(9) + ";";
  }
  const std::size_t data = text.find(end) + end.size();
  const bool is_known = text.starts_with("ply\nformat binary_little_endian 1.0\n") &&
                        properties ==
                            "float x;float y;float z;float nx;float ny;float nz;uchar red;uchar green;"
                            "uchar blue;list uchar int vertex_indices;";
  WorldMesh world;
  if (!is_known || text.size() != data + vertices * 27 + faces * 13) return world;
  for (std::size_t i = 0; i < vertices; ++i) {
    std::array<float, 6> f{};
    const char* at = text.data() + data + i * 27;
    std::memcpy(f.data(), at, 24);
    world.positions.emplace_back(f[0], f[1], f[2]);
    world.normals.emplace_back(f[3], f[4], f[5]);
    const auto* rgb = reinterpret_cast<const unsigned char*>(at) + 24;
    world.colours.push_back({rgb[0] / 255.0, rgb[1] / 255.0, rgb[2] / 255.0});
  }
  for (std::size_t i = 0; i < faces; ++i) {
    const char* at = text.data() + data + vertices * 27 + i * 13;
    std::array<std::int32_t, 3> corners{};
    std::memcpy(corners.data(), at + 1, 12);
    if (at[0] != 3) return {};
    for (const std::int32_t corner : corners) world.indices.push_back(static_cast<std::size_t>(corner));
  }
  return world;
}

inline WorldMesh world_of_obj(const std::vector<std::byte>& bytes) {
  WorldMesh world;
  std::istringstream lines(bytes_as_text(bytes));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream in(line);
    std::string keyword;
    in >> keyword;
    DVec3 v(0.0);
    std::array<double, 3> colour{};
    if (keyword == "v" && in >> v.x >> v.y >> v.z >> colour[0] >> colour[1] >> colour[2]) {
      world.positions.push_back(v);
      world.colours.push_back(colour);
    }
    if (keyword == "vn" && in >> v.x >> v.y >> v.z) world.normals.push_back(v);
    std::size_t position = 0;
    std::size_t normal = 0;
    char slash = ' ';
    while (keyword == "f" && in >> position >> slash >> slash >> normal) {
      if (position != normal) return {};
      world.indices.push_back(position - 1);
    }
  }
  return world;
}

}  // namespace quoin
