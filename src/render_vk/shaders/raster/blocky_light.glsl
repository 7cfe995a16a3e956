// The light at a fragment of a face of voxels.

vec3 light_of(uint face) {
  MeshFrame f = mesh_frame();
  float diffuse = diffuse_of(face, what.y);
  ivec4 home = f.instances[what.y].home;
  if (home.w < 0) return sunlight_of(diffuse);
  vec3 from = before_face(face, frame().lift / placed_at(home.w).ref_view.w);
  vec3 behind = from;
  behind[axis_of(face)] -= 0.5 * sign_of(face);
  ivec4 voxel = ivec4(base.xyz + ivec3(floor(behind)), home.w);
  vec4 normal = sign_of(face) * f.instances[what.y].axes[axis_of(face)];
  LevelPlace at = LevelPlace(voxel.xyz, before_face(face, 0.0) - floor(behind), face_normal(face), int(face));
  return traced_light(voxel, base.xyz & ~63, vec3(base.xyz & 63) + from, normal.xyz, diffuse, at);
}
