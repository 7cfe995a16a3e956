// Path tracing arithmetic and random numbers; matches render/path/path_math.h on the CPU, series for series, so that
// paths are the same.

const float kPi = 3.14159265;
const float kAlmostOne = 0.99999994;

struct SineCosine {
  float sine;
  float cosine;
};

// Returns the sine and cosine of an angle in turns, 0 to 1.
SineCosine of_turns(float turns) {
  float quarters = turns * 4.0;
  int nearest = int(turns * 8.0 + 1.0) / 2;
  float x = (quarters - float(nearest)) * (kPi / 2.0);
  float xx = x * x;
  float sine =
      x * (1.0 + xx * (-1.0 / 6.0 + xx * (1.0 / 120.0 + xx * (-1.0 / 5040.0 + xx * (1.0 / 362880.0)))));
  float cosine =
      1.0 + xx * (-0.5 + xx * (1.0 / 24.0 + xx * (-1.0 / 720.0 + xx * (1.0 / 40320.0 - xx / 3628800.0))));
  int quarter = nearest & 3;
  if (quarter == 0) return SineCosine(sine, cosine);
  if (quarter == 1) return SineCosine(cosine, -sine);
  if (quarter == 2) return SineCosine(-sine, -cosine);
  return SineCosine(-cosine, sine);
}

float arc_tangent(float y, float x) {
  float larger = max(abs(x), abs(y));
  if (!(larger > 0.0)) return 0.0;
  float ratio = min(abs(x), abs(y)) / larger;
  float first = ratio / (1.0 + sqrt(1.0 + ratio * ratio));
  float t = first / (1.0 + sqrt(1.0 + first * first));
  float tt = t * t;
  float quarter =
      t * (1.0 + tt * (-1.0 / 3.0 + tt * (1.0 / 5.0 + tt * (-1.0 / 7.0 + tt * (1.0 / 9.0 - tt * (1.0 / 11.0))))));
  float angle = 4.0 * quarter;
  if (abs(y) > abs(x)) angle = kPi / 2.0 - angle;
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

float arc_cosine(float x) {
  float c = clamp(x, -1.0, 1.0);
  return arc_tangent(sqrt((1.0 - c) * (1.0 + c)), c);
}

float power_of_two(float x) {
  if (!(x > -126.0)) return 0.0;
  if (x >= 128.0) return uintBitsToFloat(0x7F7FFFFFu);
  float whole = floor(x);
  float y = (x - whole - 0.5) * 0.69314718;
  float part = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0 + y / 720.0)))));
  return part * 1.41421356 * uintBitsToFloat(uint(int(whole) + 127) << 23);
}
float exponential(float x) {
  return power_of_two(x * 1.44269504);
}
vec3 exponential(vec3 x) {
  return vec3(exponential(x.x), exponential(x.y), exponential(x.z));
}

float log_of_two(float x) {
  if (!(x >= 1.17549435e-38)) return -126.0;
  uint bits = floatBitsToUint(x);
  int exponent = int(bits >> 23) - 127;
  float mantissa = uintBitsToFloat((bits & 0x7FFFFFu) | 0x3F800000u);
  if (mantissa > 1.41421356) {
    mantissa *= 0.5;
    ++exponent;
  }
  float s = (mantissa - 1.0) / (mantissa + 1.0);
  float ss = s * s;
  float natural = 2.0 * s * (1.0 + ss * (1.0 / 3.0 + ss * (1.0 / 5.0 + ss * (1.0 / 7.0 + ss * (1.0 / 9.0)))));
  return float(exponent) + natural * 1.44269504;
}

float luminance(vec3 colour) {
  return 0.2126 * colour.x + 0.7152 * colour.y + 0.0722 * colour.z;
}
float largest(vec3 colour) {
  return max(max(colour.x, colour.y), colour.z);
}
bool is_black(vec3 colour) {
  return !(largest(colour) > 0.0);
}

struct Axes {
  vec3 x;
  vec3 y;
  vec3 z;
};

// Returns a right-handed frame whose third axis is a unit vector.
Axes axes_about(vec3 normal) {
  float sign = (floatBitsToUint(normal.z) & 0x80000000u) != 0 ? -1.0 : 1.0;
  float a = -1.0 / (sign + normal.z);
  float b = normal.x * normal.y * a;
  return Axes(vec3(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
              vec3(b, sign + normal.y * normal.y * a, -normal.y), normal);
}
vec3 to_world(Axes axes, vec3 v) {
  return axes.x * v.x + axes.y * v.y + axes.z * v.z;
}
vec3 to_local(Axes axes, vec3 v) {
  return vec3(dot(v, axes.x), dot(v, axes.y), dot(v, axes.z));
}

vec2 on_disc(vec2 u) {
  float a = 2.0 * u.x - 1.0;
  float b = 2.0 * u.y - 1.0;
  if (a == 0.0 && b == 0.0) return vec2(0.0);
  bool is_wide = abs(a) > abs(b);
  float radius = is_wide ? a : b;
  float turns = is_wide ? b / a * 0.125 : 0.25 - a / b * 0.125;
  if (turns < 0.0) turns += 1.0;
  SineCosine angle = of_turns(turns);
  return vec2(radius * angle.cosine, radius * angle.sine);
}
vec3 cosine_weighted(vec2 u) {
  vec2 disc = on_disc(u);
  return vec3(disc, sqrt(max(0.0, 1.0 - dot(disc, disc))));
}

// Returns the weight of a strategy against another: the balance heuristic.
float balance(float own, float other) {
  return own / (own + other);
}

// A position in a sorted list of sums from 0 to 1: the entry that contains `u`, and the fraction within it.
struct Found {
  uint index;
  float within;
};

// ---- random numbers ----

uint pascal(uint x) {
  x ^= x >> 1 & 0x55555555u;
  x ^= x >> 2 & 0x33333333u;
  x ^= x >> 4 & 0x0F0F0F0Fu;
  x ^= x >> 8 & 0x00FF00FFu;
  return x ^ (x >> 16 & 0x0000FFFFu);
}
uint scrambled(uint x, uint seed) {
  x ^= x * 0x3D20ADEAu;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526C56u;
  x ^= x * 0x53A22864u;
  return x;
}
float unit_of(uint bits) {
  return float(bits >> 8) * (1.0 / 16777216.0);
}

struct Random {
  uint pixel;
  uint index;
};

vec2 random_pair(Random random, uint dimension) {
  uint seed = mixed(random.pixel ^ dimension * 0x9E3779B9u);
  uint index = bitfieldReverse(scrambled(bitfieldReverse(random.index), seed));
  uint other = seed * 0x85EBCA6Bu ^ seed >> 13;
  return vec2(unit_of(bitfieldReverse(scrambled(index, other * 0xC2B2AE35u + 1u))),
              unit_of(bitfieldReverse(scrambled(pascal(index), other * 0x27D4EB2Fu + 0x165667B1u))));
}
float random_one(Random random, uint dimension) {
  uint seed = mixed(random.pixel ^ dimension * 0x9E3779B9u);
  uint index = bitfieldReverse(scrambled(bitfieldReverse(random.index), seed));
  return unit_of(bitfieldReverse(scrambled(index, seed * 0x85EBCA6Bu + 1u)));
}
