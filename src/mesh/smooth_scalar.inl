// What the kernels share. Included within a namespace.

// Room that the stores of the vector kernels may overrun.
constexpr std::size_t kSlack = 32;

enum class Axis : std::uint8_t { X, Y, Z };

struct Slice {
  int z = 0;
  std::uint32_t first_vertex = 0;          // of this slice
  std::uint32_t first_vertex_of_last = 0;  // of the one before
};

// A place's column and row, from -1.
int column_of(int place) {
  return (place & (kPlaceStride - 1)) - 1;
}
int row_of(int place) {
  return (place >> kPlaceShift) - 1;
}

SmoothCell cell_code(int x, int y, int z, int n) {
  const auto mask = static_cast<std::uint32_t>(n - 1);
  const auto part = [&](int c, int shift, int axis) {
    return (static_cast<std::uint32_t>(c) & mask) << shift | static_cast<std::uint32_t>(c < 0)
                                                                 << (SmoothCell::kPreviousShift + axis);
  };
  return {part(x, 0, 0) | part(y, 6, 1) | part(z, 12, 2)};
}

constexpr int kPlaceMask = 0x3FFF;
constexpr int kStartsSolid = 0x8000;
constexpr std::uint32_t kVertexMask = (1U << kVertexBits) - 1;

// The four cells around an edge that starts at a place, counter-clockwise as seen from the end of its axis; (u, v) are
// the next two axes. Corners 0 to 3: before in both, in v, in none, in u.
template <Axis kAxis>
struct Around {
  // How many places a cell lies back in its slice, and whether that is the slice before.
  static constexpr int kX = 1;
  static constexpr int kY = kPlaceStride;
  static constexpr std::array<int, 4> back = kAxis == Axis::X   ? std::array{kY, 0, 0, kY}
                                             : kAxis == Axis::Y ? std::array{kX, kX, 0, 0}
                                                                : std::array{kX + kY, kY, 0, kX};
  static constexpr std::array<bool, 4> is_last = kAxis == Axis::X   ? std::array{true, true, false, false}
                                                 : kAxis == Axis::Y ? std::array{true, false, false, true}
                                                                    : std::array{false, false, false, false};
  static constexpr int u = (static_cast<int>(kAxis) + 1) % 3;
  static constexpr int v = (static_cast<int>(kAxis) + 2) % 3;
};

// From corner 0 to corner 2, and from corner 3 to corner 1, in whole cells: (1, 1) and (1, -1) along (u, v).
template <Axis kAxis>
constexpr std::array<int, 3> along_diagonal(int v_sign) {
  std::array<int, 3> along{};
  along[Around<kAxis>::u] = 1;
  along[Around<kAxis>::v] = v_sign;
  return along;
}
