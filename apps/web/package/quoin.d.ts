/** Reads voxel files of any format, and makes meshes, GLB files and images. See docs/web.md.
 *
 * Axes: right-handed, +Y up. Colours: sRGB. The caller owns all returned arrays.
 * Errors: functions throw a QuoinError; functions that return a promise reject with it. Unknown option names give
 * "invalid_argument". An error "trap", "internal" or "out_of_memory" can end the WebAssembly instance. All its scenes
 * then fail with "bad_handle", and the next `load` starts a new instance.
 */
export type ErrorCode =
  | 'invalid_argument' | 'cannot_read' | 'cannot_write' | 'bad_format' | 'unsupported' | 'limit_exceeded' | 'cancelled'
  | 'device_lost' | 'bad_handle' | 'out_of_memory' | 'internal' | 'trap';

export class QuoinError extends Error {
  readonly code: ErrorCode;
}

export type Vec3 = [number, number, number];

export interface GridInfo {
  name: string;
  voxels: number;
  /** Minimum corner of the tight box around the grid's voxels or its field's solid. */
  min: Vec3;
  /** Size of that box, in voxels. */
  extent: Vec3;
  /** True if the grid has a density field: the surface of a volume. */
  hasField: boolean;
}

export interface VoxelType {
  name: string;
  /** sRGB, 0 to 255. A type with alpha below 255 is transparent. */
  rgba: [number, number, number, number];
  /** 0: none. */
  emission: number;
  /** 0 to 1. */
  metalness: number;
  /** 0 (a mirror) to 1. */
  roughness: number;
}

export interface Mesh {
  /** Three per vertex. */
  positions: Float32Array;
  /** Three per vertex, of unit length. */
  normals: Float32Array;
  /** Four per vertex, sRGB, without occlusion; only for grids. */
  colours: Uint8Array | null;
  /** One per vertex, 0 open to 1 dark; only for grids. */
  occlusion: Float32Array | null;
  /** Three per triangle, counter-clockwise seen from outside. */
  indices: Uint32Array;
}

/** Options of long calls. */
export interface Progress {
  /** Receives the finished fraction, 0 to 1. Return false to cancel the call, which then throws a QuoinError of code
   *  "cancelled". If the callback throws an error, the call throws the same error. An async callback cannot cancel,
   *  because its promise is not awaited. The callback must not call this package. */
  progress?: (fraction: number) => boolean | void;
}

export interface MeshOptions extends Progress {
  /** Makes smooth surfaces instead of blocks. Default: only for grids with a field. */
  smooth?: boolean;
  /** Blocks only: avoids T-junctions, where a corner of one face lies inside an edge of another. This prevents visible
   *  gaps but makes more triangles. Smooth surfaces are always watertight. Default: false. */
  watertight?: boolean;
}

export interface RenderOptions extends Progress {
  width?: number;
  height?: number;
  /** Samples per pixel, 1 to 4,096; default 4. */
  samples?: number;
  /** Default: a view of the whole scene. */
  camera?: { position: Vec3; lookAt: Vec3; fovDegrees?: number };
  /** Direction from the scene towards the sun, any non-zero length. Default: a sun to the left of the default view. */
  sun?: Vec3;
}

export interface RenderedImage {
  width: number;
  height: number;
  /** Rows from the top, four bytes per pixel, as in ImageData. */
  rgba: Uint8ClampedArray<ArrayBuffer>;
}

/** Ray hits, one entry per ray. */
export interface Hits {
  /** Distance in multiples of the direction's length; Infinity: no hit. */
  t: Float64Array;
  /** Three per ray, in world space; 0: no hit. */
  normal: Float64Array;
  /** Three per ray: the voxel, in its grid. */
  voxel: Int32Array;
  /** The voxel's type; 0: no hit. */
  type: Uint16Array;
}

export class Scene {
  private constructor();
  /** True if the small module loaded the scene. */
  readonly isSmall: boolean;
  /** Warnings from loading, one line each. */
  readonly warnings: readonly string[];
  readonly grids: readonly GridInfo[];
  /** Voxel types. Entry 0 is air. */
  readonly types: readonly VoxelType[];
  /** Returns a binary glTF 2.0 file with materials, instances and animation: the same bytes as `quoin convert`. */
  glb(options?: MeshOptions): Uint8Array<ArrayBuffer>;
  /** Returns a file in the format of the extension: .glb, .ply, .stl, .3mf, .vox. */
  file(extension: string, options?: MeshOptions): Uint8Array<ArrayBuffer>;
  /** Meshes a grid. Positions are in the grid's voxels. */
  mesh(grid: number, options?: MeshOptions): Mesh;
  /** Returns the voxel types of a box, x slowest and z fastest. */
  read(grid: number, min: Vec3, shape: Vec3): Uint16Array;
  /** Renders an image by ray marching, on one thread. */
  render(options?: RenderOptions): RenderedImage;
  /** Finds the nearest voxel or surface along each ray. origins, directions: three numbers per ray, in world space.
   *  maxT: maximum distance, in multiples of the direction's length. The first call builds a tree, which the scene
   *  keeps. */
  rays(origins: ArrayLike<number>, directions: ArrayLike<number>, options?: { maxT?: number }): Hits;
  /** Returns the scene's data for your own ray-marching shaders. */
  forShaders(): ShaderScene;
  /** Frees the memory. The scene cannot be used afterwards. */
  free(): void;
}

/** A scene for ray-marching shaders: the tables declared in src/render/shaders/data.glsl of Quoin's sources, with
 *  32-bit addresses. For an example see Quoin's page, apps/web/page/march.js. */
export class ShaderScene {
  private constructor();
  /** Data shared by all images. The addresses of trees, grids, types and lamp lists are offsets into it, in bytes. */
  readonly bytes: Uint8Array<ArrayBuffer>;
  /** Bit mask of the scene's contents. 1: transparent voxels, 2: fields, 4: transparent fields. */
  readonly has: number;
  /** Returns an image's data: a Frame followed by its tables. Their addresses are offsets into it, in bytes. */
  frame(options?: RenderOptions): Uint8Array<ArrayBuffer>;
  /** Returns the push constants of a sample. */
  sample(number: number): Uint8Array<ArrayBuffer>;
  /** Frees the memory now. Without this call, the garbage collector frees it later. */
  free(): void;
}

export interface Small {
  /** Uses the small module, quoin-small.wasm, instead of the whole one. It is less than half as large to download and
   *  compile, but reads only .vox. `render`, `rays` and `forShaders` of its scenes throw a QuoinError of code
   *  "unsupported". */
  small?: boolean;
}

/** Starts a WebAssembly module. This call is optional: `load` and other functions start the module when needed.
 *  `module`: its bytes or URL. Default: quoin.wasm or quoin-small.wasm next to quoin.js. */
export function start(module?: ArrayBuffer | ArrayBufferView | URL | string, options?: Small): Promise<void>;

/** Reads the file as a volume of raw values. */
export interface RawVolume {
  /** Number of values along each axis; the first axis varies fastest. */
  shape: Vec3;
  /** Default: 'uint8'. */
  type?: 'uint8' | 'int8' | 'uint16' | 'int16' | 'uint32' | 'int32' | 'uint64' | 'int64' | 'float32' | 'float64';
  /** Default: false. */
  bigEndian?: boolean;
}

/** Reads the file as a height map (PNG). Lengths are 0.000001 to 1,000,000. */
export interface Heights {
  /** The encoding of heights: grey levels, or the RGB encoding of Mapbox or Terrarium. */
  encoding: 'grey' | 'mapbox' | 'terrarium';
  /** For encoding 'grey': metres per grey level, default 1. */
  metresPerLevel?: number;
  /** Distance between neighbouring samples. Default: 1, with a warning. */
  metresPerPixel?: number;
  /** Edge length of a voxel. Default: metresPerPixel. */
  metresPerVoxel?: number;
  /** Factor on heights, default 1. */
  exaggeration?: number;
  /** Voxels of ground below the lowest height: 1 to 4,096, default 8. */
  groundDepth?: number;
  /** Makes a density field with a smooth surface instead of voxels. */
  smooth?: boolean;
}

/** Options of `load`. Options for other kinds of files are ignored. */
export interface LoadOptions extends Progress, Small {
  /** Shows hidden instances, groups and layers. */
  showHidden?: boolean;
  /** Animation frame, default 0. */
  frame?: number;
  /** Worlds read by chunks: chunks (64 voxels) to load on each side of the spawn point; default 4. */
  radius?: number;
  /** Volumes: values above `iso` are solid. Default: a threshold between the two groups of values. */
  iso?: number;
  /** Triangle files: voxels along the longest side, default 128. */
  meshVoxels?: number;
  /** Triangle files: voxel size in the file's unit, instead of meshVoxels. */
  voxelSize?: number;
  raw?: RawVolume;
  heights?: Heights;
  /** Blocks of Minecraft: resource packs for their shapes and textures, the lowest first: the bytes of zip files or
   *  client .jar files. 'builtin', at any place, is Quoin's own pack, which gives a look to blocks that the other packs
   *  lack. */
  packs?: (ArrayBuffer | ArrayBufferView | 'builtin')[];
}

/** Loads a file of any format. The content determines the format, unless `raw` or `heights` is given. With `small`,
 *  `load` still fetches the whole module if the small one cannot read the file. */
export function load(bytes: ArrayBuffer | ArrayBufferView, options?: LoadOptions): Promise<Scene>;

export interface ArrayOptions extends Progress {
  /** Distance between samples, default 1. */
  spacing?: Vec3;
  /** Position of sample (0, 0, 0), default 0. */
  origin?: Vec3;
}

export interface SurfaceOptions extends ArrayOptions {
  /** Values below `iso` are solid, as in signed distances. Default: values above. */
  solidBelow?: boolean;
}

export type Labels =
  | Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array | BigUint64Array | BigInt64Array;
export type Samples = Labels | Float32Array | Float64Array;

/** Meshes the surface where the array's values equal `iso`. shape: samples along x, y and z; z varies fastest. */
export function surfaceNets(array: Samples, shape: Vec3, iso: number, options?: SurfaceOptions): Promise<Mesh>;

export interface LabelOptions<Label> extends ArrayOptions {
  /** The label of empty space, also outside the array; default 0. */
  background?: Label;
  /** Number of smoothing steps, 0 to 1,000, default 4. */
  relaxationSteps?: number;
}

/** The faces between two labels: a range of the indices. */
export interface LabelInterface<Label> {
  /** Label behind the faces; never the background. */
  back: Label;
  /** Label in front of the faces: the background, or else the smaller label. */
  front: Label;
  firstIndex: number;
  indexCount: number;
}

export interface LabelMesh<Label> {
  /** Three per vertex. Neighbouring surfaces share vertices. */
  positions: Float32Array;
  /** Three per triangle, counter-clockwise seen from the front label. */
  indices: Uint32Array;
  /** Sorted by `back`, then `front`, with the background first. Together they cover all indices. */
  interfaces: LabelInterface<Label>[];
}

/** Meshes the surfaces between the labels of a segmentation: one closed surface per label. shape: as in surfaceNets.
 *  Labels of 64-bit arrays are bigints. */
export function meshLabels<Array extends Labels>(array: Array, shape: Vec3, options?: LabelOptions<Array[number]>):
  Promise<LabelMesh<Array[number]>>;

/** Converts a scene to a three.js group with materials. `GLTFLoader`: from three/addons/loaders/GLTFLoader.js. */
export function toThree<Group>(
  scene: Scene,
  GLTFLoader: new () => { parseAsync(data: ArrayBuffer, path: string): Promise<{ scene: Group }> },
  options?: MeshOptions,
): Promise<Group>;

/** Returns the library's version, such as "1.2.3". */
export function version(): Promise<string>;
