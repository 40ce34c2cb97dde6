/**
 * Saving: what is shown as a file of the browser's.
 */

import { Camera } from './camera.js';
import { Drawing } from './draw.js';

/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */

/** Have the browser save something. @param {Blob} blob @param {string} name */
export function download(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Save the whole picture as pixels, whatever part of it is seen. @param {Scene} scene @param {Look} look */
export function savePng(scene, look) {
  const canvas = document.createElement('canvas'),
    camera = new Camera(),
    { width, height, density } = scene;
  camera.size = [width, height];
  camera.window = [Math.round(width * density), Math.round(height * density)];
  [canvas.width, canvas.height] = camera.window;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false }));
  new Drawing(scene).draw(context, camera, look);
  canvas.toBlob((blob) => {
    if (blob) download(blob, `${scene.name}.png`);
  });
}
