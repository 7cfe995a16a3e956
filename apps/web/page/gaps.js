// Where merged faces of several sizes meet, some have a corner inside the edge of another. Corners are rounded to parts
// of a pixel before triangles are filled, so such edges do not quite touch, and here and there a pixel shows what is
// behind. Each face is drawn a little beyond its edges: that takes no triangle more, as watertight ones do.

const wideningOfView = { value: 0 };  // as a part of half the view's height; a uniform of all materials

/** Says of how many pixels the renderer's picture is. */
export function setPictureHeight(renderer, pixels) {
  const gl = renderer.getContext();
  const parts = 2 ** gl.getParameter(gl.SUBPIXEL_BITS);  // of a pixel, to which corners are rounded
  wideningOfView.value = 2 * (1.5 / parts) / pixels;
}

/** Whether its triangles are faces as Quoin writes them: four vertices each, counter-clockwise along u and v, six
 *  indices. */
function isOfFaces({ index, attributes: { position, normal } }) {
  if (!index || !normal || index.count * 4 !== position.count * 6) return false;
  const { array } = index;
  for (let i = 0; i < array.length; i += 6) {
    const first = 4 * (i / 6);
    for (let k = 0; k < 6; ++k) if (array[i + k] - first >>> 0 > 3) return false;
  }
  return true;
}

// Along a face's u and v, whose product is its normal, which has one part that is not 0: quoin/core/direction.h. The
// numbers of an index are those of vertices.
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

/** Has a material of three.js, of faces alone, draw them so. */
export function closeGaps(material) {
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { wideningOfView });
    shader.vertexShader = `uniform float wideningOfView;\n${shader.vertexShader}`.replace(
      '#include <project_vertex>', (included) => included + wider);
  };
  material.customProgramCacheKey = () => 'gaps';
  material.userData.hasClosedGaps = true;
}

/** The same with all of a model's that can be. Clear glass would be blended twice where its faces overlap. */
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
