// SPDX-License-Identifier: MIT
// Draws by WebGL 2. What it returns, gpu.js returns too; viewer.js calls either.
"use strict";

// constants  that all shaders have, by name
// failed     is called with a sentence when nothing can be drawn any more
function webgl(canvas, sources, constants, failed) {
const gl = canvas.getContext("webgl2", { antialias: false });
if (!gl || !gl.getExtension("EXT_color_buffer_float")) {
  throw new Error("This page needs WebGL 2 with textures of floats, which this browser does not offer.");
}
canvas.addEventListener("webglcontextlost", () => failed("The browser took the graphics away. Load the page again."));
// Of textures with a texel for each vertex, corner or influence.
const SHIFT = 10, WIDTH = 1 << SHIFT;
const programs = new Map();

// Of name.vert, or of the one that covers the target, and of name.frag.
function program(name, own = {}) {
  const all = Object.entries({ SHIFT, WIDTH, ...constants, ...own });
  const lines = all.map(([key, value]) => `#define ${key} ${value}\n`).join(""), key = name + lines;
  if (programs.has(key)) return programs.get(key);
  const made = gl.createProgram(), vertex = sources[name + ".vert"] ? name + ".vert" : "screen.vert";
  for (const [file, type] of [[vertex, gl.VERTEX_SHADER], [name + ".frag", gl.FRAGMENT_SHADER]]) {
    const shader = gl.createShader(type);
    const text = sources[file].replace('#include "sinew.glsl"', () => sources["sinew.glsl"]);
    gl.shaderSource(shader, text.replace("\n", "\n" + lines));
    gl.compileShader(shader);
    gl.attachShader(made, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(file + ": " + gl.getShaderInfoLog(shader));
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++i) {
    const { name } = gl.getActiveUniform(made, i);
    places[name] = gl.getUniformLocation(made, name);
  }
  programs.set(key, { made, places });
  return programs.get(key);
}

// Sets uniforms: arrays are objects with `texture`, the rest goes by its length.
function use(its, values) {
  gl.useProgram(its.made);
  let unit = 0;
  for (const [name, value] of Object.entries(values)) {
    const place = its.places[name];
    if (place === undefined) continue;
    if (value.texture) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, value.texture);
      gl.uniform1i(place, unit++);
    } else if (value.length === 16) gl.uniformMatrix4fv(place, false, value);
    else if (value.length === 3) gl.uniform3fv(place, value);
    else if (value.length === 2) gl.uniform2fv(place, value);
    else gl.uniform1f(place, value);
  }
}

const FORMATS = {
  float4: [gl.RGBA32F, gl.RGBA, gl.FLOAT, 4, Float32Array],
  float2: [gl.RG32F, gl.RG, gl.FLOAT, 2, Float32Array],
  whole4: [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, 4, Uint32Array],
  whole2: [gl.RG32UI, gl.RG_INTEGER, gl.UNSIGNED_INT, 2, Uint32Array],
  whole1: [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, 1, Uint32Array],
};

// `count` of a format for shaders to read, in rows of `width` texels; without `values`, for run() to write.
function array(format, values, count, width = WIDTH) {
  const [inside, outside, type, components, Kind] = FORMATS[format];
  const height = Math.max(Math.ceil(count / width), 1), texture = gl.createTexture();
  const made = { texture, width, height, write };
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, inside, width, height);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  // As many values as the array has.
  function write(values) {
    const full = new Kind(width * height * components);
    full.set(values);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, outside, type, full);
  }
  if (values) write(values);
  else {
    made.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, made.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, made.texture, 0);
  }
  return made;
}

function triangles(values) {
  const vertices = gl.createVertexArray();
  gl.bindVertexArray(vertices);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, values, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return { vertices, count: values.length };
}

// Computes all of the array `target`.
function run(name, target, values, own) {
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
  gl.viewport(0, 0, target.width, target.height);
  gl.disable(gl.DEPTH_TEST);
  gl.disable(gl.SCISSOR_TEST);
  use(program(name, own), values);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
}

// Float32Array [4 * count] of an array that run() wrote, from `first` on.
async function read({ frame }, first, count) {
  const row = first >> SHIFT, rows = ((first + count - 1) >> SHIFT) - row + 1;
  const found = new Float32Array(4 * WIDTH * rows);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.readPixels(0, row, WIDTH, rows, gl.RGBA, gl.FLOAT, found);
  const start = first - WIDTH * row;
  return found.subarray(4 * start, 4 * (start + count));
}

// Four samples a pixel, where they are wanted: in software they take longer than all else.
const smooth = { frame: gl.createFramebuffer(), size: "" };
for (const name of ["colour", "depth"]) smooth[name] = gl.createRenderbuffer();

function bindSmooth(width, height) {
  gl.bindFramebuffer(gl.FRAMEBUFFER, smooth.frame);
  if (smooth.size === `${width} ${height}`) return;
  smooth.size = `${width} ${height}`;
  const kinds = [["colour", gl.RGBA8, gl.COLOR_ATTACHMENT0], ["depth", gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]];
  for (const [name, format, place] of kinds) {
    gl.bindRenderbuffer(gl.RENDERBUFFER, smooth[name]);
    gl.renderbufferStorageMultisample(gl.RENDERBUFFER, 4, format, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, smooth[name]);
  }
}

// Draws a list: each by its program in its port, as far as it is seen, triangles or the ends of so many lines.
function draw(list, isSmooth) {
  const { height } = canvas;
  if (isSmooth) bindSmooth(canvas.width, height);
  else gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.disable(gl.SCISSOR_TEST);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.SCISSOR_TEST);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  for (const { name, port, seen, values, constants: own, triangles, ends } of list) {
    gl.viewport(port[0], 0, port[1], height);
    gl.scissor(seen[0], 0, seen[1], height);
    use(program(name, own), values);
    if (triangles) {
      gl.bindVertexArray(triangles.vertices);
      gl.drawElements(gl.TRIANGLES, triangles.count, gl.UNSIGNED_INT, 0);
      gl.bindVertexArray(null);
    } else {
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      gl.drawArrays(gl.LINES, 0, ends);
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    }
  }
  if (!isSmooth) return;
  gl.disable(gl.SCISSOR_TEST);
  gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
  gl.blitFramebuffer(0, 0, canvas.width, height, 0, 0, canvas.width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
}

// Waits for what was drawn.
async function finish() {
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
}

return { name: "WebGL 2", array, triangles, run, read, draw, finish, error: () => gl.getError() };
}
