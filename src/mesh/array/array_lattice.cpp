#include "mesh/array/array_lattice.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

namespace quoin::array {
namespace {

constexpr std::int64_t kMaxSize = (std::int64_t{1} << 31) - 2;
// Shorter rows waste most of their words. A longer axis is then used for the rows.
constexpr std::int64_t kShortRow = 40;

std::uint64_t magnitude(std::int64_t v) {
  return v < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(v) : static_cast<std::uint64_t>(v);
}

// Returns true if all samples are within the address space.
bool is_addressable(const ArrayView& array) {
  std::uint64_t below = 0;
  std::uint64_t above = size_of(array.type);
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::ptrdiff_t>::max());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t steps = static_cast<std::uint64_t>(array.size[axis]) - 1;
    const std::uint64_t stride = magnitude(array.strides[axis]);
    if (steps == 0) continue;
    if (stride > kMost / steps) return false;
    std::uint64_t& side = array.strides[axis] < 0 ? below : above;
    if (steps * stride > kMost - side) return false;
    side += steps * stride;
  }
  const auto at = reinterpret_cast<std::uintptr_t>(array.data);
  return below <= at && above <= std::numeric_limits<std::uintptr_t>::max() - at;
}

Status check(const ArrayView& array) {
  if (array.data == nullptr) return make_error(ErrorCode::InvalidArgument, "the array has no data");
  if (array.type > ScalarType::Float64) return make_error(ErrorCode::InvalidArgument, "the array's type is unknown");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name = "axis " + std::to_string(axis);
    const double spacing = array.spacing[static_cast<int>(axis)];
    if (array.size[axis] <= 0) return make_error(ErrorCode::InvalidArgument, name + " of the array has no samples");
    if (array.size[axis] > kMaxSize) {
      return make_error(ErrorCode::LimitExceeded, name + " of the array has more than 2^31 - 2 samples");
    }
    if (!std::isfinite(spacing) || spacing == 0.0 || !std::isfinite(array.origin[static_cast<int>(axis)])) {
      return make_error(ErrorCode::InvalidArgument, "spacing or origin of " + name + " is 0 or not finite");
    }
  }
  if (!is_addressable(array)) {
    return make_error(ErrorCode::InvalidArgument, "the array's strides leave the address space");
  }
  return {};
}

// Returns the axes from the smallest stride to the largest. Axes with one sample or with stride 0 come last.
std::array<int, 3> walking_order(const ArrayView& array) {
  const auto size = [&](int axis) { return array.size[static_cast<std::size_t>(axis)]; };
  const auto reach = [&](int axis) {
    const std::uint64_t stride = magnitude(array.strides[static_cast<std::size_t>(axis)]);
    return stride == 0 || size(axis) == 1 ? std::numeric_limits<std::uint64_t>::max() : stride;
  };
  // At equal strides the last axis comes first, as in a packed array.
  std::array<int, 3> order = {2, 1, 0};
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return reach(a) < reach(b); });
  if (size(order[0]) < kShortRow) {
    const auto longest = std::max_element(order.begin(), order.end(), [&](int a, int b) { return size(a) < size(b); });
    std::rotate(order.begin(), longest, longest + 1);
  }
  return order;
}

bool is_even(const std::array<int, 3>& order) {
  return (order[1] - order[0] + 3) % 3 == 1;
}

template <std::size_t kBytes>
void pack(const std::byte* from, std::ptrdiff_t stride, std::int64_t count, std::byte* to) {
  for (std::int64_t i = 0; i < count; ++i)
    std::memcpy(to + static_cast<std::size_t>(i) * kBytes, from + i * stride, kBytes);
}

}  // namespace

Result<Lattice> lattice_of(const ArrayView& array) {
  if (const Status status = check(array); !status) return status.error();
  Lattice lattice;
  lattice.data = static_cast<const std::byte*>(array.data);
  lattice.type = array.type;
  lattice.view_axis = walking_order(array);
  lattice.is_mirrored = !is_even(lattice.view_axis);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto from = static_cast<std::size_t>(lattice.view_axis[axis]);
    const int own = static_cast<int>(axis);
    lattice.size[axis] = array.size[from];
    lattice.stride[axis] = array.size[from] == 1 ? 0 : array.strides[from];
    lattice.spacing[own] = array.spacing[lattice.view_axis[axis]];
    lattice.origin[own] = array.origin[lattice.view_axis[axis]];
    if (lattice.spacing[own] < 0.0) lattice.is_mirrored = !lattice.is_mirrored;
  }
  if (lattice.stride[0] < 0) {
    // Starts at the other end of the row.
    const std::int64_t steps = lattice.size[0] - 1;
    lattice.data += steps * lattice.stride[0];
    lattice.stride[0] = -lattice.stride[0];
    lattice.origin.x += static_cast<double>(steps) * lattice.spacing.x;
    lattice.spacing.x = -lattice.spacing.x;
    lattice.is_mirrored = !lattice.is_mirrored;
  }
  lattice.words = static_cast<std::size_t>(lattice.size[0] / 64 + 1);
  return lattice;
}

void pack_row(const Lattice& lattice, std::int64_t y, std::int64_t z, std::byte* to) {
  const std::byte* from = lattice.row(y, z);
  switch (lattice.item_bytes()) {
    case 1:
      return pack<1>(from, lattice.stride[0], lattice.size[0], to);
    case 2:
      return pack<2>(from, lattice.stride[0], lattice.size[0], to);
    case 4:
      return pack<4>(from, lattice.stride[0], lattice.size[0], to);
    default:
      return pack<8>(from, lattice.stride[0], lattice.size[0], to);
  }
}

}  // namespace quoin::array
