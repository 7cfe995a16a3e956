// The colour of a glass fragment: all transparent bodies from there to the opaque surface behind, as in marched images.
// The including shader draws the nearest such fragment of each pixel after the opaque surfaces, and defines the step
// (`kGlassStep`).
#include "see_through.glsl"
#include "looks.glsl"

// The ray that continues from the fragment. It starts within the fragment's body.
GridRay seen_ray;
ViewRay seen_in_view;
int seen_home;  // the instance

// Returns the ray in the space of an instance.
GridRay seen_ray_in(int instance, Placed placed) {
  GridRay ray = seen_ray;
  if (instance != seen_home) ray = grid_from_view(placed, seen_in_view);
  return ray;
}

// Returns the distance along the ray to the first opaque voxel or solid of a field; kInfinity if there is none.
float opaque_behind() {
  float nearest = kInfinity;
  start_visit(seen_in_view);
  for (;;) {
    int i = next_instance(nearest);
    if (i < 0) return nearest;
    Placed placed = placed_at(i);
    GridRay ray = seen_ray_in(i, placed);
    for (int content = 0; content < kContents; ++content) {
      float t;
      if (find_opaque(placed, content, ray, nearest, t)) nearest = min(nearest, t);
    }
  }
}

// Returns the square of the distance of the image's samples where the ray enters a body, in voxels of its grid.
float square_spacing_at(Body body, Placed placed) {
  float spacing = frame().down.w / placed.ref_inside.w;
  vec3 from_camera = seen_in_view.origin + frame().view_depth * frame().forward.xyz;
  if (has(kPerspective)) spacing *= length(from_camera) + body.lengths.x;
  return spacing * spacing;
}

// Shows the look of a face of voxels that the ray meets. `inside`: the position in the body's voxel.
void show_look(Body body, vec3 inside, Placed placed, inout Surface surface) {
  uint type = type_of(body);
  bool is_mean = placed.ref_view.w != 1.0;
  if (is_mean && show_mean_of_shapes(type, surface)) return;
  if (!kHasCells) return;
  uint side = is_face(body) ? body.what.y >> 3 : body.what.y;
  show_texture(type, side, inside, is_mean ? kMeanOfFace : square_spacing_at(body, placed), surface);
}

// Returns the surface of a body where the ray enters it. From inside, only its emission is visible.
Surface surface_entered(Body body, vec3 inside, Placed placed) {
  Surface surface = surface_of_body(body);
  bool is_inside = (body.what.z & kStartsInside) != 0;
  bool is_of_shape = kHasShapes && (body.what.z & kBeginsInShape) != 0;
  bool is_of_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0;
  if (has(kDetailColours)) {
    surface.colour = placed.detail_colour.xyz;
    surface.emitted = vec3(0.0);
  } else if (is_of_shape) {
    show_side(body.what.y, inside, square_spacing_at(body, placed), surface);
  } else if (!is_of_field && !is_inside) {
    show_look(body, inside, placed, surface);
  }
  if (is_inside) surface.colour = vec3(0.0);
  return surface;
}

// Returns the point of entry on a body's face, with the occlusion that a blocky mesh would store there. `normal`: unit,
// in the world; `diffuse`: of the sun.
LitPoint point_of_body(Body body, Placed placed, vec3 normal, float diffuse) {
  uint face = body.what.y & 7;
  GridRay ray = seen_ray_in(body.voxel.w, placed);
  vec3 inside = vec3(ray.base - body.voxel.xyz) + ray.origin + body.lengths.x * ray.direction;
  Surface surface = surface_entered(body, inside, placed);
  if (kHasShapes && (body.what.z & kBeginsInShape) != 0) {
    vec3 in_grid = side_normal(body.what.y);
    vec3 above = vec3(body.voxel.xyz & 63) + inside + frame().lift / placed.ref_view.w * in_grid;
    LevelPlace at = place_on_shape(body.voxel.xyz, inside, in_grid, side_of_voxel(body.what.y));
    return LitPoint(body.voxel, body.voxel.xyz & ~63, above, normal, diffuse, surface.colour, surface.emitted, 1.0, at);
  }
  if (kHasFieldGlass && (body.what.z & kBeginsInField) != 0) {
    vec3 above = inside + frame().lift / placed.ref_view.w * normal_of(body.what.y);
    vec3 from = vec3(body.voxel.xyz & 63) + above;
    LevelPlace at = LevelPlace(body.voxel.xyz, inside, normal_of(body.what.y), -1);
    return LitPoint(body.voxel, body.voxel.xyz & ~63, from, normal, diffuse, surface.colour, surface.emitted, 1.0, at);
  }
  inside = on_face(inside, face);
  float openness = 1.0;
  if (has_occlusion()) {
    Tree opaque = Grids(frame().grids).at[placed.ref_base.w].opaque;
    openness = 1.0 - occlusion_at(corner_occlusion(opaque, body.voxel.xyz, face), face, inside) / 3.0;
  }
  vec3 from = vec3(body.voxel.xyz & 63) + inside;
  from[axis_of(face)] += frame().lift / placed.ref_view.w * sign_of(face);
  LevelPlace at = LevelPlace(body.voxel.xyz, inside, face_normal(face), int(face));
  return LitPoint(body.voxel, body.voxel.xyz & ~63, from, normal, diffuse, surface.colour, surface.emitted, openness,
                  at);
}

// Returns the point for lighting a body; defined by the including file.
LitPoint point_of_body(Body body);

// Adds the body that begins at the fragment as the list's first; defined by the including file.
void enter_first(inout BodyList list);

// Returns true for a face of a cell that is drawn like an opaque surface: the image behind has it.
bool is_drawn_behind(Body body) {
  if (!is_face(body) || (body.what.z & kIsClosed) == 0) return false;
  uint face = face_of_cell(type_of(body), body.what.y >> 3);
  return alpha_of(TexturedFaces(frame().textured_faces).at[face].what.z) != kTranslucent;
}

// Returns the view from a point of instance `home`, in its tree's coordinates relative to `base`: the transmittance of
// each channel, or the light added to the image behind.
vec4 seen_from(int home, ivec3 base, vec3 from) {
  // The marched scene no longer has this instance.
  if (home < 0) discard;
  Placed placed = placed_at(home);
  seen_home = home;
  seen_ray = GridRay(base & ~63, vec3(base & 63) + from, turned(placed.grid_axes, seen_direction()), 0.0);
  seen_in_view = view_from_grid(placed, seen_ray);
  float opaque_t = opaque_behind();
  State state = State(vec4(1.0, 1.0, 1.0, -kNever), vec4(0.0));
  vec3 unused = vec3(1.0);
  for (bool is_first = true, is_last = false; !is_last; is_first = false) {
    BodyList list = BodyList(uvec2(0), 0, kHeldBodies, 0, kInfinity);
    find_bodies(home, seen_ray, seen_in_view, 1.0, opaque_t, state.weight.w, list, unused);
    if (is_first) enter_first(list);
    state.weight.w = list.dropped_t;
    Passage way = passage_through(list, !is_first);
    bool is_closed = false;
    while (!is_closed && enter_next(way, opaque_t, state)) {
      is_closed = is_drawn_behind(way.met);
      if (is_closed) break;
      vec3 weight = pass_body(way, state);
      if (kGlassStep != kGlassPassed) state.colour.xyz += weight * colour_of(point_of_body(way.met));
    }
    is_last = way.is_last || is_closed;
  }
  return kGlassStep == kGlassPassed ? vec4(state.weight.xyz, 1.0) : vec4(shown(state.colour.xyz), 0.0);
}
