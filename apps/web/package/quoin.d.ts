/** Reads voxel files of any format, and makes meshes, GLB files and pictures of them. See docs/web.md.
 *
 * Axes: right-handed, +Y up. Colours: sRGB. All arrays that are returned are the caller's.
 * Errors: every function throws (or rejects with) a QuoinError. One of code "trap", "internal" or "out_of_memory" may
 * have ended the instance that all scenes lived in: these are gone then, their calls fail with "bad_handle", and the
 * next `load` starts a fresh one. Options of a name that is not declared here are "invalid_argument".
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
  /** Of the tight box around its voxels, or its field's solid. */
  min: Vec3;
  extent: Vec3;
  /** Densities: the surface of a volume. */
  hasField: boolean;
}

export interface VoxelType {
  name: string;
  /** sRGB; alpha below 255: transparent. */
  rgba: [number, number, number, number];
  emission: number;
  metalness: number;
  roughness: number;
}

export interface Mesh {
  /** Three a vertex. */
  positions: Float32Array;
  /** Three a vertex, of unit length. */
  normals: Float32Array;
  /** Four a vertex, sRGB, without occlusion; of grids. */
  colours: Uint8Array | null;
  /** One a vertex, 0 open to 1 dark; of grids. */
  occlusion: Float32Array | null;
  /** Three a triangle, counter-clockwise from outside. */
  indices: Uint32Array;
}

/** What long calls take. */
export interface Progress {
  /** Told how far the call has come, 0 to 1. Returning false ends it with a QuoinError of code "cancelled"; what it
   *  throws, the call throws. It is not waited for: the promise of an async function ends nothing, whatever it resolves
   *  to. It calls nothing of this package. */
  progress?: (fraction: number) => boolean | void;
}

export interface MeshOptions extends Progress {
  /** Smooth surfaces in place of blocks. Default: of grids that have a field. */
  smooth?: boolean;
  /** Of blocks: no corner of a face lies inside another's edge, where pixels of what is behind may be seen. Faces get
   *  more triangles. Smooth surfaces always are. Default: false. */
  watertight?: boolean;
}

export interface RenderOptions extends Progress {
  width?: number;
  height?: number;
  /** Samples a pixel, 1 to 4,096; default 4. */
  samples?: number;
  /** In place of a view of the whole scene. */
  camera?: { position: Vec3; lookAt: Vec3; fovDegrees?: number };
  /** From the scene towards the sun, of any length. Default: one that stands left of the view of the whole scene. */
  sun?: Vec3;
}

export interface Picture {
  width: number;
  height: number;
  /** Rows from the top, four bytes a pixel: an ImageData's. */
  rgba: Uint8ClampedArray<ArrayBuffer>;
}

/** What rays met, an entry a ray. */
export interface Hits {
  /** In lengths of the direction; Infinity: nothing was met. */
  t: Float64Array;
  /** Three a ray, in the world; 0 where nothing was met. */
  normal: Float64Array;
  /** Three a ray, in its grid. */
  voxel: Int32Array;
  /** 0 where nothing was met. */
  type: Uint16Array;
}

export class Scene {
  private constructor();
  /** Whether it is of the small module. */
  readonly isSmall: boolean;
  /** What reading left out, or chose where nothing was said; a line each. */
  readonly warnings: readonly string[];
  readonly grids: readonly GridInfo[];
  /** 0 is air. */
  readonly types: readonly VoxelType[];
  /** A glTF 2.0 binary, with its materials, instances and animation: the same bytes that `quoin convert` writes. */
  glb(options?: MeshOptions): Uint8Array<ArrayBuffer>;
  /** A file by its extension: .glb, .ply, .stl, .3mf, .vox. */
  file(extension: string, options?: MeshOptions): Uint8Array<ArrayBuffer>;
  /** The mesh of one grid, in its own space. */
  mesh(grid: number, options?: MeshOptions): Mesh;
  /** The types of a box of voxels, x slowest and z fastest. */
  read(grid: number, min: Vec3, shape: Vec3): Uint16Array;
  /** A picture by ray marching, on one thread. */
  render(options?: RenderOptions): Picture;
  /** The nearest voxel or surface along each ray: three numbers a ray, in the world. The first call builds a tree,
   *  which the scene keeps. maxT: how far they go, in lengths of their direction. */
  rays(origins: ArrayLike<number>, directions: ArrayLike<number>, options?: { maxT?: number }): Hits;
  /** For shaders of your own that march it. */
  forShaders(): ShaderScene;
  /** Gives its memory back. The scene is of no use then. */
  free(): void;
}

/** A scene as shaders march it: the tables that src/render_vk/shaders/data.glsl of Quoin's sources declares, whose
 *  addresses have 32 bits here. Quoin's page, apps/web/page/march.js, is the example. */
export class ShaderScene {
  private constructor();
  /** What is the same for all pictures. Addresses of trees, grids, types and lamps' lists count from its first byte. */
  readonly bytes: Uint8Array<ArrayBuffer>;
  /** 1: transparent voxels, 2: surfaces of densities, 4: transparent ones; added up. */
  readonly has: number;
  /** Of a picture: a Frame and the tables behind it, whose addresses count from its first byte. */
  frame(options?: RenderOptions): Uint8Array<ArrayBuffer>;
  /** What shaders are pushed for the sample of that number. */
  sample(number: number): Uint8Array<ArrayBuffer>;
  /** Gives its memory back; the garbage collector does too, later. */
  free(): void;
}

export interface Small {
  /** The small module, quoin-small.wasm, in place of the whole one. It reads .vox alone. Scenes of it have no `render`,
   *  `rays` and `forShaders`: they throw a QuoinError of code "unsupported". Less than half as much is fetched and
   *  compiled. */
  small?: boolean;
}

/** Starts a WebAssembly module. It is not needed: `load` and others do the same. `module`: its bytes, or where they
 *  are, in place of quoin.wasm, or quoin-small.wasm, beside quoin.js. */
export function start(module?: BufferSource | URL | string, options?: Small): Promise<void>;

/** The file holds values alone: a volume. */
export interface RawVolume {
  /** How many along each axis, of which the first is the fastest. */
  shape: Vec3;
  /** Default: 'uint8'. */
  type?: 'uint8' | 'int8' | 'uint16' | 'int16' | 'uint32' | 'int32' | 'uint64' | 'int64' | 'float32' | 'float64';
  /** Default: false. */
  bigEndian?: boolean;
}

/** The file is a picture (PNG) of the heights of a landscape. Lengths are 0.000001 to 1,000,000. */
export interface Heights {
  /** Levels, or terrain-RGB as Mapbox or Terrarium have it. */
  encoding: 'grey' | 'mapbox' | 'terrarium';
  /** Of levels, default 1. */
  metresPerLevel?: number;
  /** Between neighbouring heights. Default: 1, with a warning. */
  metresPerPixel?: number;
  /** Along a voxel's edge. Default: metresPerPixel. */
  metresPerVoxel?: number;
  /** Heights are multiplied by it, default 1. */
  exaggeration?: number;
  /** Voxels of ground below the lowest height: 1 to 4,096, default 8. */
  groundDepth?: number;
  /** Densities, whose surface is smooth, rather than voxels. */
  smooth?: boolean;
}

/** What files are read with. Of those that are of no use to a file it takes no notice. */
export interface LoadOptions extends Progress, Small {
  /** What is hidden becomes visible. */
  showHidden?: boolean;
  /** Of an animation, default 0. */
  frame?: number;
  /** Of a world that is read by chunks: how far around its spawn, in chunks of 64 voxels; default 4. */
  radius?: number;
  /** Of a volume: what is above is solid. Default: a value between its two groups. */
  iso?: number;
  /** Of a file of triangles: voxels along its longest side, default 128. */
  meshVoxels?: number;
  /** Or their size, in the file's unit. */
  voxelSize?: number;
  raw?: RawVolume;
  heights?: Heights;
}

/** Reads a file of any format, which its content decides, unless `raw` or `heights` does. With `small` the whole module
 *  reads, and is fetched for, what the small one does not. */
export function load(bytes: ArrayBuffer | ArrayBufferView, options?: LoadOptions): Promise<Scene>;

export interface ArrayOptions extends Progress {
  /** Of neighbours, default 1. */
  spacing?: Vec3;
  /** Where sample (0, 0, 0) lies, default 0. */
  origin?: Vec3;
}

export interface SurfaceOptions extends ArrayOptions {
  /** What is less than `iso` is solid, as of signed distances. Default: what is more. */
  solidBelow?: boolean;
}

export type Labels =
  | Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array | BigUint64Array | BigInt64Array;
export type Samples = Labels | Float32Array | Float64Array;

/** The surface where an array has the value `iso`. shape: samples along x, y and z, of which z is the fastest. */
export function surfaceNets(array: Samples, shape: Vec3, iso: number, options?: SurfaceOptions): Promise<Mesh>;

export interface LabelOptions<Label> extends ArrayOptions {
  /** The label of what is no object, and of all beyond the array; default 0. */
  background?: Label;
  /** How often vertices go towards their neighbours, which makes stairs smooth: 0 to 1,000, default 4. */
  relaxationSteps?: number;
}

/** The faces between two labels: a range of the indices. */
export interface LabelInterface<Label> {
  /** Behind the faces; never the background. */
  back: Label;
  /** In front of them: the background, or else the lesser of both. */
  front: Label;
  firstIndex: number;
  indexCount: number;
}

export interface LabelMesh<Label> {
  /** Three a vertex. Neighbours share theirs. */
  positions: Float32Array;
  /** Three a triangle, counter-clockwise seen from its front label. */
  indices: Uint32Array;
  /** By `back`, then `front`, the background first; they cover the indices. */
  interfaces: LabelInterface<Label>[];
}

/** The surfaces between the labels of a segmentation: one closed surface a label. shape: as of surfaceNets. Labels of
 *  arrays of 64 bits are bigints. */
export function meshLabels<Array extends Labels>(array: Array, shape: Vec3, options?: LabelOptions<Array[number]>):
  Promise<LabelMesh<Array[number]>>;

/** A three.js group of a scene, with its materials. `GLTFLoader`: that of three/addons/loaders/GLTFLoader.js. */
export function toThree<Group>(
  scene: Scene,
  GLTFLoader: new () => { parseAsync(data: ArrayBuffer, path: string): Promise<{ scene: Group }> },
  options?: MeshOptions,
): Promise<Group>;

/** The version of the library: "1.2.3". */
export function version(): Promise<string>;
