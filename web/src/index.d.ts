// The types of the package. Options are the fields of maq_densepose_config (sdk/include/maquette/densepose.h).

/** Options of `DensePose.load`. Every one may be left out. */
export interface DensePoseOptions {
  /** "stream" (default): frames of a camera or clip, fast. "photo": single images, finer, two to three times the time. */
  preset?: 'stream' | 'photo';
  /** Images are scaled to this long side, 32 to 2048 pixels. Default: 288, and 480 as well where people are small. */
  longSide?: number;
  /** Minimum score of a person, up to 1. */
  scoreThreshold?: number;
  /** 1 to 255, best scores first. */
  maxPeople?: number;
  /** Boxes that reach the box head, 1 to 1000. Fewer are faster and may miss people in a crowd. */
  maxProposals?: number;
  /** Detect people in every N-th frame of a stream and follow them in between. Default 1. */
  keyFrameInterval?: number;
  /** People less tall than this may be missed; larger is faster. */
  minPersonHeight?: number;
  /** "surface" (default): part, U and V. "part": only the part, faster. */
  detail?: 'surface' | 'part';
  /** People who are mapped a second time in an upright crop. Default: "off" for streams, "all" for photos. */
  personCrops?: 'auto' | 'all' | 'off';
  /** Side of a crop, 64 to 512 pixels. */
  personCropSide?: number;
  /** Whether 33 keypoints of each person are found. Default false. */
  keypoints?: boolean;
  /** How much earlier frames of a stream count, up to 0.95; -1: not at all. Default 0.9. */
  steadiness?: number;
}

export interface RunOptions {
  /** Time of the frame in milliseconds; frames are a thirtieth of a second apart without it. */
  timeMs?: number;
  /** false: the image does not follow the one before, as with photos. Default true. */
  stream?: boolean;
}

export interface Keypoint {
  x: number;
  y: number;
  /** 0 to 1. */
  confidence: number;
}

export interface Person {
  /** From 1. In a stream, a person keeps the id while seen and for a second after. */
  id: number;
  /** 0 to 1. */
  score: number;
  /** Left, top, right, bottom in pixels of the image; right and bottom are exclusive. */
  box: [number, number, number, number];
  /** By number as in `KEYPOINT_NAMES`, with the option `keypoints`. */
  keypoints?: Keypoint[];
}

/** One byte for each pixel of the image, row by row. In node they are views that the next `run` overwrites. */
export interface Planes {
  /** Body part 1 to 24 as in `PART_NAMES`, 0 for background. */
  part: Uint8Array;
  /** U * 255, 0 on background. */
  u: Uint8Array;
  /** V * 255, 0 on background. */
  v: Uint8Array;
  /** Place of the person in `people`, plus 1; 0 for background. */
  person: Uint8Array;
}

/** Times of the stages in milliseconds. */
export interface Stats {
  preprocessMs: number;
  trunkMs: number;
  proposalsMs: number;
  boxHeadMs: number;
  denseHeadMs: number;
  cropsMs: number;
  decodeMs: number;
  keypointsMs: number;
  totalMs: number;
  networkWidth: number;
  networkHeight: number;
}

export interface DensePoseResult {
  width: number;
  height: number;
  /** Best score first. */
  people: Person[];
  planes: Planes;
  stats: Stats;
}

/** RGBA pixels, such as an ImageData. */
export interface Pixels {
  width: number;
  height: number;
  data: Uint8ClampedArray | Uint8Array;
}

/** An error of the SDK: a sentence, and as `code` the status of the C API ("MAQ_ERROR_IMAGE_SIZE"). */
export declare class MaquetteError extends Error {
  readonly name: 'MaquetteError';
  readonly code: string;
}

export declare class DensePose {
  private constructor();
  /** Loads the networks; in a browser, on a worker. Rejects with a MaquetteError. */
  static load(options?: DensePoseOptions): Promise<DensePose>;
  /**
   * Finds people and maps each of their pixels to a point of the body surface. Browsers also take canvases, images,
   * videos and VideoFrames; node takes `Pixels`. Rejects with a MaquetteError.
   */
  run(image: Pixels | CanvasImageSource, options?: RunOptions): Promise<DensePoseResult>;
  /** Frees the networks and ends the worker. Runs that wait are rejected. */
  close(): void;
}

/** Names of the parts 0 (background) to 24. */
export declare const PART_NAMES: readonly string[];
/** Red, green and blue of the parts 0 to 24. */
export declare const PART_COLOURS: readonly (readonly [number, number, number])[];
/** Names of the 33 keypoints, in MediaPipe Pose's order. */
export declare const KEYPOINT_NAMES: readonly string[];
