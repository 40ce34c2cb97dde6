/**
 * Saving: what is shown as a file of the browser's.
 */

import { Camera } from './camera.js';
import { Drawing } from './draw.js';

/** @typedef {import('./body.js').Body} Body */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */

/** How high the body is in a picture that is saved. */
const BELOW = 260;

/** Have the browser save something. @param {Blob} blob @param {string} name */
export function download(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** The whole picture as a PNG, whatever part of it is seen, with the body below it. @param {Scene} scene
 * @param {Look} look @param {Body} body @returns {Promise<Blob>} */
export function pixelsOf(scene, look, body) {
  const canvas = document.createElement('canvas'),
    camera = new Camera(),
    { width, height, density } = scene;
  camera.size = [width, height];
  camera.window = [Math.round(width * density), Math.round(height * density)];
  [canvas.width, canvas.height] = [camera.window[0], Math.round((height + (body.skeleton ? BELOW : 0)) * density)];
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false }));
  new Drawing(scene).draw(context, camera, look);
  context.setTransform(density, 0, 0, density, 0, camera.window[1]);
  body.paint(context, width, BELOW, look, scene);
  return new Promise((done, failed) => {
    canvas.toBlob((blob) => (blob ? done(blob) : failed(new Error('no picture'))));
  });
}
