// Closes gaps between merged faces of different sizes. Where a face's corner lies inside another face's edge (a
// T-junction), rounding corners to subpixels leaves gaps, so single pixels show the background. Each face is therefore
// drawn slightly beyond its edges, without the additional triangles of watertight meshes.

const wideningOfView = { value: 0 };  // as a fraction of half the view's height; a uniform of all materials

/** Sets the height of the renderer's image, in pixels. */
export function setImageHeight(renderer, pixels) {
  const gl = renderer.getContext();
  const parts = 2 ** gl.getParameter(gl.SUBPIXEL_BITS);  // subpixels per pixel; corners are rounded to these
  wideningOfView.value = 2 * (1.5 / parts) / pixels;
}

/** Returns true if all triangles form faces as Quoin writes them: four vertices each, counter-clockwise along u and v,
 *  and six indices. */
function isOfFaces({ index, attributes: { position, normal } }) {
  if (!index || !normal || index.count * 4 !== position.count * 6) return false;
  const { array } = index;
  for (let i = 0; i < array.length; i += 6) {
    const first = 4 * (i / 6);
    for (let k = 0; k < 6; ++k) if (array[i + k] - first >>> 0 > 3) return false;
  }
  return true;
}

// Moves vertices along a face's u and v. Their cross product is the normal, which has one non-zero component:
// quoin/core/direction.h. The shader's vertex numbers are the indices.
const wider = /* glsl */`
  {
    bool isPositive = normal.x + normal.y + normal.z > 0.0;
    vec3 u = isPositive ? normal.zxy : -normal.yzx;
    vec3 v = isPositive ? normal.yzx : -normal.zxy;
    int corner = gl_VertexID & 3;
    vec3 outwards = (corner == 1 || corner == 2 ? u : -u) + (corner >= 2 ? v : -v);
    float by = wideningOfView * max(gl_Position.w, 0.0) / projectionMatrix[1][1];
    mvPosition.xyz += 1.414 * by * normalize(mat3(modelViewMatrix) * outwards);
    gl_Position = projectionMatrix * mvPosition;
  }`;

/** Makes a three.js material, used only for faces, draw them wider. */
export function closeGaps(material) {
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { wideningOfView });
    shader.vertexShader = `uniform float wideningOfView;\n${shader.vertexShader}`.replace(
      '#include <project_vertex>', (included) => included + wider);
  };
  material.customProgramCacheKey = () => 'gaps';
  material.userData.hasClosedGaps = true;
}

/** Applies this to all suitable materials of a model. Excludes glass, which would blend twice where faces overlap. */
export function closeGapsOf(model) {
  const materials = new Map();
  model.traverse(({ isMesh, material, geometry }) => {
    if (isMesh) materials.set(material, (materials.get(material) ?? true) && isOfFaces(geometry));
  });
  for (const [material, isFit] of materials) {
    const clearness = material.transparent ? material.transmission ?? 1 : 0;
    if (isFit && clearness < 0.25) closeGaps(material);
  }
}
