// The page of block_icons.mjs: builds the meshes of blocks with deepslate and draws them with its renderer, without
// light, blending and mipmaps.
const { BlockColors, BlockDefinition, BlockModel, BlockState, Cull, Identifier, Mesh, Renderer, SpecialRenderers,
        Vector } = window.deepslate;

// SwiftShader rounds corners to sixteenths of a pixel, so icons are drawn larger. Odd, so that the middle of a pixel of
// the icon is the middle of a pixel that is drawn.
const scale = 5;
const tileSize = 16;
const attributes = { pos: true, color: true, texture: true, normal: true };
const up = new Vector(0, 1, 0);  // deepslate lights this normal with 1

/** The part of a texture that a face shows by default, as coordinates of a point from 0 to 1: by the direction. */
const worldCoordinates = {
  '+y': ([x, , z]) => [x, z], '-y': ([x, , z]) => [x, 1 - z],
  '-z': ([x, y]) => [1 - x, 1 - y], '+z': ([x, y]) => [x, 1 - y],
  '-x': ([, y, z]) => [z, 1 - y], '+x': ([, y, z]) => [1 - z, 1 - y],
};

function directionOf(quad) {
  const normal = quad.normal().components();
  const axis = [0, 1, 2].reduce((most, i) => (Math.abs(normal[i]) > Math.abs(normal[most]) ? i : most), 0);
  return (normal[axis] < 0 ? '-' : '+') + 'xyz'[axis];
}

/** Corrects an element where deepslate does not follow the published format (block_icons.json gives the reasons). */
function correct(element) {
  const { from: [x0, y0, z0], to: [x1, y1, z1], faces, rotation } = element;
  const parts = {
    up: [x0, z0, x1, z1], down: [x0, 16 - z1, x1, 16 - z0],
    north: [16 - x1, 16 - y1, 16 - x0, 16 - y0], south: [x0, 16 - y1, x1, 16 - y0],
    west: [z0, 16 - y1, z1, 16 - y0], east: [16 - z1, 16 - y1, 16 - z0, 16 - y0],
  };
  for (const [direction, face] of Object.entries(faces)) face.uv ??= parts[direction];
  if (!rotation?.rescale) return;
  const factor = 1 / Math.cos(Math.abs(rotation.angle) * Math.PI / 180);
  const scaled = (at, axis) => (rotation.axis === 'xyz'[axis] ? at
    : rotation.origin[axis] + (at - rotation.origin[axis]) * factor);
  element.from = element.from.map(scaled);
  element.to = element.to.map(scaled);
  rotation.rescale = false;
}

const quarter = ([u, v]) => [1 - v, u];
const turned = (point, quarters) => (quarters === 0 ? point : turned(quarter(point), quarters - 1));

class Icons {
  async open(size, cameras, states) {
    this.size = size;
    this.cameras = cameras;
    this.pack = await (await fetch('/pack.json')).json();
    this.makeRenderer();
    await this.makeAtlas();
    this.models = {};
    for (const [name, model] of Object.entries(this.pack.models)) {
      model.elements?.forEach(correct);
      this.models[name] = BlockModel.fromJson(model);
    }
    for (const model of Object.values(this.models)) model.flatten(this);
    this.distinct = [];
    const known = new Map();
    return states.map(([name, properties]) => {
      const definition = this.pack.states[name];
      if (!definition) throw new Error(`no block states of ${name}`);
      const variants = BlockDefinition.fromJson(definition).getModelVariants(properties);
      const path = name.replace('minecraft:', '');
      const isFluid = path === 'water' || path === 'lava';
      const tint = BlockColors[path]?.(properties);
      const key = JSON.stringify([variants, tint, isFluid ? [name, properties] : null]);
      if (!known.has(key)) {
        known.set(key, this.distinct.length);
        this.distinct.push({ path, name, properties, variants, tint, isFluid });
      }
      return known.get(key);
    });
  }

  getBlockModel(id) { return this.models[id.toString()] ?? null; }

  getTextureUV(id) {
    const found = this.tiles[id.toString()];
    if (!found) throw new Error(`no texture ${id}`);
    return found;
  }

  makeRenderer() {
    const canvas = document.createElement('canvas');
    const gl = canvas.getContext('webgl2', { antialias: false, alpha: true, premultipliedAlpha: false });
    this.gl = gl;
    this.renderer = new Renderer(gl);
    gl.disable(gl.BLEND);
    this.large = this.makeTarget(this.size * scale, this.size * scale, true);
    this.small = this.makeTarget(this.size, this.size, false);
  }

  makeTarget(width, height, hasDepth) {
    const gl = this.gl;
    const target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    const add = (attachment, format) => {
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, buffer);
    };
    add(gl.COLOR_ATTACHMENT0, gl.RGBA8);
    if (hasDepth) add(gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT32F);
    return target;
  }

  async makeAtlas() {
    const gl = this.gl;
    const names = Object.keys(this.pack.textures);
    const columns = 2 ** Math.ceil(Math.log2(Math.sqrt(names.length)));
    const edge = columns * tileSize;
    this.tiles = {};
    this.atlas = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.atlas);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, edge, edge);
    for (const parameter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, parameter, gl.NEAREST);
    }
    for (const [index, name] of names.entries()) {
      const blob = await (await fetch(`data:image/png;base64,${this.pack.textures[name]}`)).blob();
      const image = await createImageBitmap(blob, { premultiplyAlpha: 'none', colorSpaceConversion: 'none' });
      if (image.width !== tileSize || image.height !== tileSize) throw new Error(`${name} has another size`);
      const [x, y] = [index % columns, Math.floor(index / columns)];
      gl.texSubImage2D(gl.TEXTURE_2D, 0, x * tileSize, y * tileSize, gl.RGBA, gl.UNSIGNED_BYTE, image);
      this.tiles[name] = [x / columns, y / columns, (x + 1) / columns, (y + 1) / columns];
    }
    this.tilesPerUnit = columns;
  }

  /** The mesh of a state, with all its faces. */
  meshOf({ path, name, properties, variants, isFluid }) {
    const mesh = new Mesh();
    // Fluids are not models.
    for (const variant of isFluid ? [] : variants) {
      const made = (shown) => new BlockDefinition({ '': shown }).getMesh(Identifier.parse(name), properties, this, this,
                                                                         Cull.none());
      const shown = made(variant);
      if (variant.uvlock && (variant.x || variant.y)) this.lock(shown, made({ model: variant.model }));
      mesh.merge(shown);
    }
    const state = new BlockState(path, properties);
    if (isFluid) mesh.merge(SpecialRenderers.getBlockMesh(state, undefined, this, Cull.none()));
    return mesh;
  }

  /** Turns textures back: deepslate does not know `uvlock`. A face that showed the part at its place in the world does
   *  so again after the turn; any other part is turned by the same quarters about the middle of the texture. */
  lock(mesh, unturned) {
    mesh.quads.forEach((quad, index) => {
      const before = unturned.quads[index];
      const [from, to] = [before, quad].map((each) => {
        const coordinates = worldCoordinates[directionOf(each)];
        return each.vertices().map((vertex) => coordinates(vertex.pos.components()));
      });
      const fits = (quarters) => from.every((point, i) => {
        const at = turned(point, quarters);
        return Math.hypot(at[0] - to[i][0], at[1] - to[i][1]) < 1e-4;
      });
      const quarters = [0, 1, 2, 3].find(fits);
      if (quarters === undefined) throw new Error('an element with uvlock is not turned by quarters');
      const columns = this.tilesPerUnit;
      const limit = quad.v1.textureLimit;
      const corner = [Math.floor((limit[0] + limit[2]) / 2 * columns), Math.floor((limit[1] + limit[3]) / 2 * columns)];
      const parts = quad.vertices().map(({ texture }) => {
        const local = turned([texture[0] * columns - corner[0], texture[1] * columns - corner[1]], quarters);
        return [(local[0] + corner[0]) / columns, (local[1] + corner[1]) / columns];
      });
      const range = (pick, axis) => pick(...parts.map((part) => part[axis]));
      quad.setTexture(parts.flat(), [range(Math.min, 0), range(Math.min, 1), range(Math.max, 0), range(Math.max, 1)]);
    });
  }

  /** Draws distinct states, and returns them as base64: see block_icons.mjs. */
  draw(from, to) {
    const texels = this.size * this.size;
    const bytes = new Uint8Array((to - from) * (4 + this.cameras.length * texels * 5));
    let at = 0;
    for (const state of this.distinct.slice(from, to)) {
      bytes.set((state.tint ?? [1, 1, 1]).map((channel) => Math.round(channel * 255)), at);
      at += 4;
      const [plain, tinted] = this.meshesOf(state);
      for (const camera of this.cameras) {
        this.drawIcon(plain, camera, bytes.subarray(at, at + texels * 4));
        at += texels * 4;
        if (tinted) this.drawFlags(tinted, camera, bytes.subarray(at, at + texels));
        at += texels;
      }
      [plain, tinted].flat().forEach((mesh) => this.forget(mesh));
    }
    let text = '';
    for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
    return btoa(text);
  }

  /** The meshes of outer and inner sides in the colours of the textures, and the same with black in place of untinted
   *  surfaces; these only if something is tinted. Surfaces are seen from both sides, except where another one lies back
   *  to back with them. */
  meshesOf(state) {
    const placeOf = (quad) => quad.vertices().map(({ pos }) => pos.components().map((x) => x.toFixed(4)).join()).sort()
      .join(' ');
    const build = (colourOf) => {
      const outer = this.meshOf(state);
      const places = outer.quads.map(placeOf);
      const normals = outer.quads.map((quad) => quad.normal());
      const isAlone = (_, i) => places.every((place, k) => place !== places[i] || normals[k].dot(normals[i]) > 0);
      const inner = new Mesh(outer.quads.filter(isAlone));
      for (const quad of outer.quads) {
        quad.setColor(colourOf(quad.v1.color.some((channel) => channel !== 1)));
        quad.forEach((vertex) => { vertex.normal = up; });
      }
      return [outer, inner].map((mesh) => mesh.rebuild(this.gl, attributes));
    };
    let hasTint = false;
    const plain = build((isTinted) => {
      hasTint ||= isTinted;
      return [1, 1, 1];
    });
    return [plain, hasTint ? build((isTinted) => (isTinted ? [1, 1, 1] : [0, 0, 0])) : undefined];
  }

  forget(mesh) {
    for (const buffer of ['posBuffer', 'colorBuffer', 'textureBuffer', 'normalBuffer', 'textureLimitBuffer',
                          'indexBuffer']) {
      if (mesh?.[buffer]) this.gl.deleteBuffer(mesh[buffer]);
    }
  }

  drawIcon([outer, inner], camera, texels) {
    const { gl, renderer, size } = this;
    const wide = size * scale;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.large);
    gl.viewport(0, 0, wide, wide);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    renderer.projMatrix = camera;
    renderer.setShader(renderer.shaderProgram);
    // Deepslate leaves out the outer half of texels at the edges of parts: here, a hundredth of them.
    renderer.setTexture(this.atlas, 0.02 / (this.tilesPerUnit * tileSize));
    renderer.prepareDraw([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    gl.cullFace(gl.BACK);
    renderer.drawMesh(outer, attributes);
    // Inner sides are moved back a little, so that outer ones in the same place are seen.
    gl.cullFace(gl.FRONT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(0, 32);
    renderer.drawMesh(inner, attributes);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.large);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.small);
    gl.blitFramebuffer(0, 0, wide, wide, 0, size, size, 0, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.small);
    gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, texels);
  }

  drawFlags(meshes, camera, flags) {
    const texels = new Uint8Array(flags.length * 4);
    this.drawIcon(meshes, camera, texels);
    flags.forEach((_, i) => { flags[i] = texels[4 * i] + texels[4 * i + 1] + texels[4 * i + 2] > 0 ? 1 : 0; });
  }
}

window.icons = new Icons();
