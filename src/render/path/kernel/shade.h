#pragma once

#include <cstddef>
#include <cstdint>

#include "core/instruction_set.h"

// The path tracing code compiled for each instruction set: random numbers, the choice of a lamp, and the scattering of
// light by matte surfaces, for sixteen points at once. Every kernel gives the same bits as path_math.h, Scatter and
// SkyLight.

namespace quoin::path {

constexpr std::size_t kBlockPoints = 16;

template <class T>
using BlockLanes = T[kBlockPoints];

/// The measures of a light tree node that bound the light it may send; used by LightTree.
struct LampMeasures {
  float middle[3] = {0.0F, 0.0F, 0.0F};
  float power = 0.0F;
  float half[3] = {0.0F, 0.0F, 0.0F};  ///< of its box's size
  float squared = 1e-12F;              ///< squared length of `half`, at least 1e-12
  /// One-sided lamps have an axis; `beyond` is the extent of the box along it. Otherwise 0 and infinity.
  float axis[3] = {0.0F, 0.0F, 0.0F};
  float beyond = 0.0F;
};

/// An inner node: both of its children.
struct alignas(64) LampBranch {
  LampMeasures first;
  LampMeasures second;
  std::int32_t next[2] = {-1, -1};  ///< for each, an inner node or ~lamp
  std::int32_t top[2] = {0, 0};     ///< for each, its index in a table of shares; 0: none
};

/// Points that each choose a lamp from a tree.
struct alignas(64) LampBlock {
  BlockLanes<float> point[3] = {};   ///< from the tree's origin
  BlockLanes<float> normal[3] = {};  ///< unit; 0 in the air
  BlockLanes<float> u = {};
  BlockLanes<std::int32_t> table = {};  ///< start of its table in `shares`
  std::uint32_t active = 0;
  BlockLanes<std::int32_t> lamp = {};  ///< -1: none
  BlockLanes<float> probability = {};
};

/// Points where paths are scattered.
struct alignas(64) ShadeBlock {
  // Input.
  BlockLanes<std::uint32_t> pixel = {};  ///< Random's
  BlockLanes<std::uint32_t> sample = {};
  BlockLanes<std::uint32_t> dimension = {};  ///< of the vertex
  BlockLanes<float> direction[3] = {};       ///< unit, of the incoming path
  BlockLanes<float> colour[3] = {};          ///< of matte surfaces
  BlockLanes<float> throughput[3] = {};
  std::uint32_t in_air = 0;  ///< points without a normal

  /// Input and output: turned slightly if it points away from the path.
  BlockLanes<float> normal[3] = {};

  // Output.
  BlockLanes<float> sun[3] = {};        ///< direction to a point of the sun, unit
  BlockLanes<float> sun_light[3] = {};  ///< its light that matte surfaces scatter
  BlockLanes<float> pair[2] = {};       ///< random numbers for the next direction
  BlockLanes<float> lamp_pair[2] = {};
  BlockLanes<float> next[3] = {};       ///< scattered direction at matte surfaces, unit
  BlockLanes<float> next_density = {};  ///< density of `next`, by solid angle; 0: the path ends
  BlockLanes<std::int32_t> next_bin = {};

  LampBlock lamps;  ///< `u` and `normal` are set
};

/// The lighting data shared by all points of an image.
struct ShadeLight {
  const LampBranch* lamps = nullptr;  ///< null: there are none
  /// Tables of the learned share of each node; the first entry of each is 1.
  const float* shares = nullptr;
  std::uint32_t lamp_numbers = 0;  ///< bits of `pixel` flipped in the random numbers that choose lamps
  bool has_sun = false;
  float to_sun[3] = {0.0F, 1.0F, 0.0F};
  float sun_frame[3][3] = {};  ///< frame with the sun's direction as its third axis
  float one_less_cos = 0.0F;   ///< 1 minus the cosine of the sun disc's half angle; 0: no disc
  float sun_radiance[3] = {};  ///< without a disc: irradiance
  float sun_density = 0.0F;
};

/// The dimensions of a vertex.
namespace dimension {
constexpr std::uint32_t kSun = 0;
constexpr std::uint32_t kLampChoice = 1;
constexpr std::uint32_t kLampPoint = 2;
constexpr std::uint32_t kSky = 3;
constexpr std::uint32_t kDirection = 4;
constexpr std::uint32_t kLobe = 5;
constexpr std::uint32_t kRoulette = 6;
constexpr std::uint32_t kGlass = 7;
}  // namespace dimension

/// Rays of a bin have similar directions: bins are by the largest component, and four steps of the other two. The first
/// bin is the sun's.
constexpr std::uint32_t kBins = 1 + 6 * 16;

struct Kernel {
  void (*shade)(const ShadeLight& light, ShadeBlock& block);
  void (*choose_lamps)(const LampBranch* branches, const float* shares, LampBlock& block);
  /// Random::pair of one dimension.
  void (*pairs)(const BlockLanes<std::uint32_t>& pixel, std::uint32_t sample, std::uint32_t dimension,
                BlockLanes<float>& x, BlockLanes<float>& y);
};

// Kernels of wider instruction sets exist only where they are compiled; the tables list the compiled ones.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const KernelTable<Kernel> kKernels;

/// Returns the kernel with the widest instructions that this machine has.
[[nodiscard]] inline const Kernel& kernel() {
  return kKernels.widest();
}

}  // namespace quoin::path
