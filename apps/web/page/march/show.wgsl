// Draws an image to the screen, which may have more pixels, with nearest sampling.

struct Shown {
  image: vec2u,
  screen: vec2u,
}
@group(0) @binding(0) var<storage, read> colours: array<u32>;
@group(0) @binding(1) var<uniform> shown: Shown;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
  return vec4f(f32(i32(i & 1u) * 4 - 1), f32(i32(i >> 1u) * 4 - 1), 0.0, 1.0);
}

@fragment
fn pixel_of(@builtin(position) at: vec4f) -> @location(0) vec4f {
  let place = min(vec2u(at.xy) * shown.image / shown.screen, shown.image - 1u);
  return vec4f(unpack4x8unorm(colours[place.y * shown.image.x + place.x]).xyz, 1.0);
}
