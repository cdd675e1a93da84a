// The canvas and its graphics context, without three.js, so that they can be made before it is there.

export interface Surface {
  canvas: HTMLCanvasElement;
  context: WebGL2RenderingContext;
  /** Whether the processor draws, without a graphics card. */
  software: boolean;
}

function contextOf(canvas: HTMLCanvasElement, antialias: boolean): WebGL2RenderingContext | null {
  return canvas.getContext('webgl2', { alpha: false, antialias, stencil: false, powerPreference: 'high-performance' });
}

/**
 * A context on the canvas, with smooth edges where a graphics card draws them; null where there is no WebGL 2. What a context has
 * cannot be changed, and software takes long to make one: so a graphics card gets a second one, on a canvas that takes the place of the first.
 */
export function surfaceOn(canvas: HTMLCanvasElement): Surface | null {
  const plain = contextOf(canvas, false);
  if (!plain) return null;
  const info = plain.getExtension('WEBGL_debug_renderer_info');
  const software = /swiftshader|llvmpipe|software/i.test(String(info ? plain.getParameter(info.UNMASKED_RENDERER_WEBGL) : ''));
  if (software) return { canvas, context: plain, software };
  plain.getExtension('WEBGL_lose_context')?.loseContext();
  const smooth = canvas.cloneNode() as HTMLCanvasElement;
  canvas.replaceWith(smooth);
  const context = contextOf(smooth, true);
  return context && { canvas: smooth, context, software };
}
