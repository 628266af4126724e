/** Centimetres, 60 Hz, Y up; yaw 0 faces +Z; +X is the character's left. Quaternions w first. */
import type * as Three from "three";

/** The content of character.json: the network and the skeleton, and the body. */
export interface CharacterData { spec: object; body: object }

export interface Target {
  /** How far to go in this frame, [x, z] in cm: 2.5 walks, 7 jogs. */
  velocity?: [number, number];
  /** Where to look, [x, z], of any length; null: in the direction of the velocity. */
  facing?: [number, number] | null;
  /** One of `gaits`; null chooses by speed. */
  gait?: string | null;
  /** Height of the ground in cm at x, z. */
  ground?: (x: number, z: number) => number;
}

export interface Character {
  readonly joints: string[];
  readonly gaits: string[];
  /** By name of a channel: its columns, and their highest value. 0 has no effect. */
  readonly channels: Record<string, { columns: string[]; highest: number }>;
  /** By name for people ("left thigh"): the channel and its column. */
  readonly parts: Record<string, { channel: string; column: string }>;
  /** World positions of all joints, three numbers each. The next step overwrites them. */
  readonly places: Float64Array;
  /** World rotations of all joints, four numbers each. The next step overwrites them. */
  readonly turns: Float64Array;
  /** Left heel, left toe, right heel, right toe: 0 to 1. */
  readonly contacts: number[];
  readonly phase: number;
  readonly root: [number, number, number];
  /** Sets values of a channel, by column. Columns that are not named go back to their value at the start. Throws RangeError for an unknown name or a bad value. */
  setChannel(channel: string, values?: Record<string, number>): void;
  /** Runs one frame, a sixtieth of a second. */
  step(target?: Target): Character;
  /** Gives the memory to the next character that is made. This one must not be used any more. */
  release(): void;
}

export interface Start {
  /** Where the character starts, [x, z] in cm, and its yaw in radians. */
  place?: [number, number];
  heading?: number;
  /** How much steps differ from each other: 0 not at all, 1 as those of people do. The same seed gives the same walk. */
  variation?: number;
  seed?: number;
}

export interface Figure { mesh: Three.SkinnedMesh; pose(character: Character): void }

export function createCharacter(data: CharacterData, start?: Start): Character;
export function createFigure(THREE: typeof Three, data: CharacterData, material?: Three.Material): Figure;
