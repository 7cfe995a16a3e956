// The sun and the sky in path tracing; matches render/path/sky_light.h on the CPU.

// Light from infinitely far away.
struct SkySample {
  vec3 direction;
  vec3 radiance;
  float density;  // infinite for a sun without a disc
};

const int kSkyEdge = 256;

vec3 sky_pixel(uint i) {
  Floats pixels = Floats(path_frame().sky_pixels);
  return vec3(pixels.at[3 * i], pixels.at[3 * i + 1], pixels.at[3 * i + 2]);
}

vec3 octahedral_sky(vec3 direction) {
  float size = abs(direction.x) + abs(direction.y) + abs(direction.z);
  float u = direction.x / size;
  float v = direction.z / size;
  if (direction.y < 0.0) {
    float folded = (1.0 - abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    v = (1.0 - abs(u)) * (v < 0.0 ? -1.0 : 1.0);
    u = folded;
  }
  float x = clamp(u * 0.5 + 0.5, 0.0, 1.0) * float(kSkyEdge);
  float y = clamp(v * 0.5 + 0.5, 0.0, 1.0) * float(kSkyEdge);
  int i = min(int(x), kSkyEdge - 1);
  int j = min(int(y), kSkyEdge - 1);
  float fx = x - float(i);
  float fy = y - float(j);
  uint at = uint(j * (kSkyEdge + 1) + i);
  uint next = at + uint(kSkyEdge + 1);
  return (sky_pixel(at) * (1.0 - fx) + sky_pixel(at + 1) * fx) * (1.0 - fy) +
         (sky_pixel(next) * (1.0 - fx) + sky_pixel(next + 1) * fx) * fy;
}

// Rotates a vector about the vertical.
vec3 turned_about_up(vec3 v, float sine, float cosine) {
  return vec3(v.x * cosine - v.z * sine, v.y, v.x * sine + v.z * cosine);
}
vec3 in_environment(vec3 direction) {
  vec4 turn = path_frame().environment;
  return turned_about_up(direction, -turn.x, turn.y);
}

vec2 environment_place(vec3 direction) {
  float turns = arc_tangent(direction.x, -direction.z) / (2.0 * kPi) + 0.5;
  float down = arc_cosine(direction.y) / kPi;
  return vec2(turns * float(path_frame().sky_width), down * float(path_frame().sky_height));
}

// Returns the environment's radiance. `direction`: in the environment image.
vec3 environment_at(vec3 direction) {
  int width = path_frame().sky_width;
  int height = path_frame().sky_height;
  vec2 place = environment_place(direction);
  float x = place.x - 0.5;
  float y = clamp(place.y - 0.5, 0.0, float(height - 1));
  int left = int(floor(x));
  int top = int(y);
  float fx = x - float(left);
  float fy = y - float(top);
  int below = min(top + 1, height - 1);
  int a = (left + width) % width;
  int b = (left + 1 + width) % width;
  return (sky_pixel(uint(top * width + a)) * (1.0 - fx) + sky_pixel(uint(top * width + b)) * fx) * (1.0 - fy) +
         (sky_pixel(uint(below * width + a)) * (1.0 - fx) + sky_pixel(uint(below * width + b)) * fx) * fy;
}

float environment_density(int x, int y, float sine) {
  int width = path_frame().sky_width;
  int height = path_frame().sky_height;
  Floats rows = Floats(path_frame().sky_rows);
  Floats columns = Floats(path_frame().sky_columns);
  uint at = uint(y * (width + 1) + x);
  float share = (rows.at[y + 1] - rows.at[y]) * (columns.at[at + 1] - columns.at[at]);
  float angle = 2.0 * kPi * kPi * sine / (float(width) * float(height));
  return angle > 0.0 ? share / angle : 0.0;
}

// Finds `u` in a run of `count` + 1 sums.
Found find_sum(Floats sums, uint first, uint count, float u) {
  uint low = 0;
  uint high = count;
  while (high - low > 1) {
    uint middle = (low + high) / 2;
    if (sums.at[first + middle] <= u) {
      low = middle;
    } else {
      high = middle;
    }
  }
  float begin = sums.at[first + low];
  float width = sums.at[first + low + 1] - begin;
  return Found(low, width > 0.0 ? min((u - begin) / width, kAlmostOne) : 0.5);
}

// Returns the radiance of a ray that leaves the scene, without the sun. `direction`: unit, in the world.
vec3 sky_radiance(vec3 direction) {
  PathFrame f = path_frame();
  if (f.sky_model == kSkyUniform) return f.sky.xyz * f.sky.w;
  if (f.sky_model == kSkyGradient) return sky_colour(direction.y) * f.sky.w;
  if (f.sky_model == kSkyPhysical) return octahedral_sky(direction) * f.sky.w;
  return environment_at(in_environment(direction)) * f.sky.w;
}

float sun_density(vec3 direction) {
  vec4 to_sun = path_frame().to_sun;
  if (!(to_sun.w > 0.0) || !has_path(kPathSun)) return 0.0;
  // 1 - cos from a squared distance: in single precision a small angle's cosine is 1.
  vec3 difference = direction - to_sun.xyz;
  return 0.5 * dot(difference, difference) <= to_sun.w ? 1.0 / (2.0 * kPi * to_sun.w) : 0.0;
}

SkySample sample_sun(vec2 u) {
  vec4 to_sun = path_frame().to_sun;
  vec3 sunlight = path_frame().sunlight.xyz;
  if (!(to_sun.w > 0.0)) return SkySample(to_sun.xyz, sunlight, kInfinity);
  float down = u.x * to_sun.w;
  float across = sqrt(down * (2.0 - down));
  SineCosine turn = of_turns(u.y);
  vec3 direction =
      to_world(axes_about(to_sun.xyz), vec3(across * turn.cosine, across * turn.sine, 1.0 - down));
  float density = 1.0 / (2.0 * kPi * to_sun.w);
  return SkySample(normalize(direction), sunlight * density, density);
}

// Samples the sky's pixels or the environment.
SkySample sample_sky(vec2 u) {
  uint width = uint(path_frame().sky_width);
  uint height = uint(path_frame().sky_height);
  Found row = find_sum(Floats(path_frame().sky_rows), 0, height, u.y);
  Found column = find_sum(Floats(path_frame().sky_columns), row.index * (width + 1), width, u.x);
  float down = (float(row.index) + row.within) / float(height);
  float around = (float(column.index) + column.within) / float(width);
  SineCosine latitude = of_turns(0.5 * down);
  SineCosine longitude = of_turns(around);
  vec3 direction =
      vec3(-latitude.sine * longitude.sine, latitude.cosine, latitude.sine * longitude.cosine);
  vec4 turn = path_frame().environment;
  return SkySample(turned_about_up(direction, turn.x, turn.y), environment_at(direction) * path_frame().sky.w,
                   environment_density(int(column.index), int(row.index), latitude.sine));
}
float sky_density(vec3 direction) {
  vec3 inside = in_environment(direction);
  vec2 place = environment_place(inside);
  int x = clamp(int(place.x), 0, path_frame().sky_width - 1);
  int y = clamp(int(place.y), 0, path_frame().sky_height - 1);
  return environment_density(x, y, sqrt(max(0.0, 1.0 - inside.y * inside.y)));
}
