/**
 * The live page in a cell of a notebook: a frame of its own, closed off, and a port in place of its websocket.
 */

/** @typedef {{view: string, page?: string, text?: string}} Content */
/** @typedef {(content: Content, buffers: DataView<ArrayBuffer>[]) => void} Take */
/** @typedef {{get: (name: string) => string, send: (content: object, callbacks?: undefined, buffers?: ArrayBuffer[]) => void,
 *   on: (event: string, listener: Take | (() => void)) => void,
 *   off: (event: string, listener: Take | (() => void)) => void}} Model */

/** A name that no other frame has. @returns {string} */
const named = () => Math.random().toString(36).slice(2);

/** Show the page until what comes back is called. @param {{model: Model, el: HTMLElement}} where @returns {() => void} */
function render({ model, el }) {
  const box = document.createElement('div'),
    frame = document.createElement('iframe');
  box.style.cssText = 'width: 100%; min-height: 160px; overflow: hidden; resize: vertical;';
  frame.setAttribute('sandbox', 'allow-scripts allow-downloads');
  frame.allow = 'clipboard-write *';
  frame.title = model.get('title');
  frame.style.cssText = 'display: block; width: 100%; height: 100%; border: 0;';
  el.append(box);
  let view = named(),
    open = false;
  /** @type {MessagePort | null} */
  let port = null;

  /** Say that the frame has gone, if it had come. */
  function leave() {
    if (open) model.send({ view, open: false });
    if (port) port.close();
    open = false;
  }

  // a notebook takes cells out of its page while they are far away, and when they come back their frames load anew
  frame.onload = () => {
    leave();
    const channel = new MessageChannel();
    [view, open, port] = [named(), true, channel.port1];
    const { port1, port2 } = channel,
      own = view;
    port1.onmessage = ({ data }) => {
      if (typeof data === 'string') model.send({ view: own, text: data });
      else model.send({ view: own }, undefined, [data.buffer]);
    };
    if (frame.contentWindow) frame.contentWindow.postMessage('', '*', [port2]);
    model.send({ view, open });
  };

  /** @type {Take} */
  const take = (content, buffers) => {
    if (content.view !== view) return;
    if (content.page !== undefined) {
      frame.srcdoc = content.page;
      box.append(frame);
    } else if (port && content.text !== undefined) port.postMessage(content.text);
    else {
      for (const { buffer, byteOffset, byteLength } of buffers) {
        if (port) port.postMessage(buffer.slice(byteOffset, byteOffset + byteLength));
      }
    }
  };
  const size = () => {
    box.style.height = `${model.get('height')}px`;
  };
  size();
  model.on('msg:custom', take);
  model.on('change:height', size);
  model.send({ view, page: true });
  return () => {
    model.off('msg:custom', take);
    model.off('change:height', size);
    leave();
    box.remove();
  };
}

export default { render };
