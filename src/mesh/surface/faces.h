#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/mesh/smooth_mesh.h>

#include "mesh/surface/material.h"

namespace quoin::smooth {

/// What a triangle is the face of.
struct TriangleFace {
  IVec3 sample{0};  ///< the solid one, in the field's coordinates; of coarse cells, near there
  VoxelType type = kAir;
  Direction direction = Direction::PosX;  ///< from it into the air
};

/// How triangles that share a vertex may need vertices of their own.
struct FaceLooks {
  const SurfaceMaterials* sharp = nullptr;  ///< where faces have the colours of their samples
  float smoothness = 1.0F;                ///< below 1, normals are drawn to those of the faces by as much as is missing
  std::span<const std::uint32_t> groups;  ///< by triangle; empty: all are one
};

/// Gives each vertex as many copies as its triangles' faces have looks, next to each other, in the order in which
/// triangles need them; positions and occlusion are the same in all. Returns the group of each vertex, if there are any.
/// `faces`: by triangle.
std::vector<std::uint32_t> split_by_faces(SmoothMesh& mesh, std::span<const TriangleFace> faces,
                                          const FaceLooks& looks);

}  // namespace quoin::smooth
