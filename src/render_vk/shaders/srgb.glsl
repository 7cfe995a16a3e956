// Returns the linear light of a displayed value, 0 to 1.
vec3 linear_from_srgb(vec3 value) {
  return mix(pow((value + 0.055) / 1.055, vec3(2.4)), value / 12.92, lessThanEqual(value, vec3(0.04045)));
}
