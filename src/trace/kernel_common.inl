// What the kernels of single rays and of rays in lockstep share. Included once for each instruction set, within its
// namespace.

// Further than any crossing; adding a step to it changes nothing.
constexpr float kNever = 1e37F;
constexpr float kEndless = std::numeric_limits<float>::infinity();
// How far a lane goes, along its greatest component, before single precision would no longer do.
constexpr float kReach = 2048.0F;
// How far beyond the bounds a ray may start without being moved to them first.
constexpr float kNearby = 64.0F;
// More than rounding can move the end of a ray, in voxels.
constexpr float kSlack = 0.02F;
// More than rounding can move a short ray's crossing, in voxels along its axis: an origin below 64 by 2^-17 at most,
// its distance to a plane by 2^-18, and products by 2^-22 of 22 voxels.
constexpr float kDoubt = 4e-5F;

// A voxel of a cell as kernels count it: x + 4 y + 16 z, and 256 times x + 8 y + 64 z, whose bits 2, 5 and 8 tell that
// a step has left the cell.
constexpr int kCodeX = 1 + 256;
constexpr int kCodeY = 4 + 256 * 8;
constexpr int kCodeZ = 16 + 256 * 64;
constexpr int kLeft = 256 * (4 + 4 * 8 + 4 * 64);

// Four numbers side by side: x, y, z and one that means nothing.
using F4 = float __attribute__((vector_size(16)));
using I4 = std::int32_t __attribute__((vector_size(16)));
using D4 = double __attribute__((vector_size(32)));

// What is asked of a single ray.
enum class Ask : std::uint8_t { Where, Whether };

// Where a ray starts, in voxels from the tables' origin.
struct Move {
  double position[3];
  double max_t;
  int entered = -1;  // the axis of the bounds' plane to which it was moved
};

// Moves one ray that starts far away to where it enters the bounds; false when it misses them.
inline bool move_to_bounds(const TreeView& tree, const double direction[3], Move& ray) {
  double enter_t = -1.0;
  int enter_axis = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double p = ray.position[axis];
    const double d = direction[axis];
    if (std::isnan(p)) return false;
    const bool is_low = p < tree.box.min[axis];
    if (!is_low && p < tree.box.max[axis]) continue;
    if (is_low ? !(d > 0.0) : !(d < 0.0)) return false;
    const double t = ((is_low ? tree.box.min[axis] : tree.box.max[axis]) - p) * (1.0 / d);
    if (t >= enter_t) {
      enter_t = t;
      enter_axis = axis;
    }
  }
  if (enter_axis < 0) return true;
  // Not to the bit: the distance of the face decides in the end, and rounds otherwise.
  if (!(enter_t <= ray.max_t * 1.000001)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const double plane = direction[axis] > 0.0 ? tree.box.min[axis] : tree.box.max[axis];
    const double p = axis == enter_axis ? plane : ray.position[axis] + enter_t * direction[axis];
    // The others are inside by now, or never will be.
    if (!(p >= tree.box.min[axis] - 1e-3 && p <= tree.box.max[axis] + 1e-3)) return false;
    ray.position[axis] = p;
  }
  ray.max_t = std::max(ray.max_t - enter_t, 0.0);
  ray.entered = enter_axis;
  return true;
}
