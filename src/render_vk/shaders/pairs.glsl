// Numbers as sums of two single-precision floats, about 48 bits in total, three at a time: for values that the CPU
// computes in double precision before rounding. So rays along voxel edges equal the CPU's bit for bit and take the same
// side.
//
// Source: T. J. Dekker, "A floating-point technique for extending the available precision" (1971).

struct Pair {
  vec3 high;
  vec3 low;
};

// Normalises a sum whose first part is the larger.
Pair renewed(vec3 high, vec3 low) {
  precise vec3 sum = high + low;
  precise vec3 rest = low - (sum - high);
  return Pair(sum, rest);
}

Pair exact_sum(vec3 a, vec3 b) {
  precise vec3 sum = a + b;
  precise vec3 of_b = sum - a;
  precise vec3 rest = (a - (sum - of_b)) + (b - of_b);
  return Pair(sum, rest);
}

Pair exact_product(vec3 a, vec3 b) {
  precise vec3 product = a * b;
  precise vec3 wide_a = 4097.0 * a;
  precise vec3 a1 = wide_a - (wide_a - a);
  precise vec3 a2 = a - a1;
  precise vec3 wide_b = 4097.0 * b;
  precise vec3 b1 = wide_b - (wide_b - b);
  precise vec3 b2 = b - b1;
  precise vec3 rest = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
  return Pair(product, rest);
}

Pair sum_of(Pair a, Pair b) {
  Pair sum = exact_sum(a.high, b.high);
  precise vec3 rest = sum.low + (a.low + b.low);
  return renewed(sum.high, rest);
}

Pair product_of(Pair a, Pair b) {
  Pair product = exact_product(a.high, b.high);
  precise vec3 rest = product.low + (a.high * b.low + a.low * b.high);
  return renewed(product.high, rest);
}

Pair quotient_of(Pair a, Pair b) {
  precise vec3 first = a.high / b.high;
  Pair back = product_of(Pair(first, vec3(0.0)), b);
  Pair left = sum_of(a, Pair(-back.high, -back.low));
  precise vec3 second = left.high / b.high;
  return renewed(first, second);
}

// Returns one component, in all three.
Pair component(Pair a, int axis) {
  return Pair(vec3(a.high[axis]), vec3(a.low[axis]));
}

Pair unit_of(Pair a) {
  Pair squares = product_of(a, a);
  Pair length_squared = sum_of(sum_of(component(squares, 0), component(squares, 1)), component(squares, 2));
  // One Newton step towards the inverse square root.
  precise vec3 rough = 1.0 / sqrt(length_squared.high);
  Pair root = Pair(rough, vec3(0.0));
  Pair off = product_of(length_squared, product_of(root, root));
  precise vec3 error = ((1.0 - off.high) - off.low) * 0.5 * rough;
  return product_of(a, renewed(rough, error));
}
