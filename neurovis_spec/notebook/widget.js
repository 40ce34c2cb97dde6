/**
 * The live page in a cell of a notebook: a frame of its own, closed off, and a port in place of its websocket.
 */

/** @typedef {{view: string, page?: string, text?: string}} Content */
/** @typedef {{get: (name: string) => any, send: (content: object, callbacks?: undefined, buffers?: ArrayBuffer[]) => void,
 *   on: (event: string, listener: (...values: any[]) => void) => void,
 *   off: (event: string, listener: (...values: any[]) => void) => void}} Model */

/** Show the page until what comes back is called. @param {{model: Model, el: HTMLElement}} where @returns {() => void} */
function render({ model, el }) {
  const view = Math.random().toString(36).slice(2);
  const { port1: port, port2: end } = new MessageChannel();
  const frame = document.createElement('iframe');
  frame.setAttribute('sandbox', 'allow-scripts allow-downloads');
  frame.title = model.get('title');
  frame.style.cssText = 'display: block; width: 100%; height: 100%; border: 0;';
  const box = document.createElement('div');
  box.style.cssText = 'width: 100%; min-height: 160px; overflow: hidden; resize: vertical;';
  const size = () => { box.style.height = `${model.get('height')}px`; };
  size();
  box.append(frame);
  el.append(box);
  /** @param {Content} content @param {DataView[]} buffers */
  const take = (content, buffers) => {
    if (content.view !== view) return;
    if (content.page !== undefined) {
      frame.onload = () => {
        frame.onload = null;
        if (frame.contentWindow) frame.contentWindow.postMessage('', '*', [end]);
      };
      frame.srcdoc = content.page;
    } else if (content.text !== undefined) port.postMessage(content.text);
    else for (const { buffer, byteOffset, byteLength } of buffers) port.postMessage(buffer.slice(byteOffset, byteOffset + byteLength));
  };
  port.onmessage = ({ data }) => {
    if (typeof data === 'string') model.send({ view, text: data });
    else model.send({ view }, undefined, [data.buffer]);
  };
  model.on('msg:custom', take);
  model.on('change:height', size);
  model.send({ view, open: true });
  return () => {
    model.off('msg:custom', take);
    model.off('change:height', size);
    model.send({ view, open: false });
    port.close();
    box.remove();
  };
}

export default { render };
