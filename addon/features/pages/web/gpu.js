// SPDX-License-Identifier: MIT
// Draws by WebGPU, as gl.js does by WebGL 2, with buffers in place of textures.

// needsCard  refuse an adapter that computes on the processor
async function webgpu(canvas, sources, constants, failed, needsCard) {
const adapter = await navigator.gpu?.requestAdapter();
if (!adapter) throw new Error("This browser does not offer WebGPU.");
if (needsCard && (adapter.info ?? adapter).isFallbackAdapter) throw new Error("WebGPU has no graphics card.");
const device = await adapter.requestDevice(), { queue } = device;
const context = canvas.getContext("webgpu"), format = navigator.gpu.getPreferredCanvasFormat();
context.configure({ device, format, alphaMode: "premultiplied" });
const errors = [], programs = new Map(), uniforms = [];

function end(text) {
  if (errors.push(text) > 1) return;
  device.destroy();
  failed(`WebGPU: ${text}`);
}
device.lost.then(({ message }) => end(message));
device.addEventListener("uncapturederror", ({ error }) => end(error.message));

// A pipeline of name.wgsl; its bindings and the members of its uniforms are found by their names.
function program(name, own = {}, samples = 0) {
  const lines = Object.entries({ ...constants, ...own }).map(([key, value]) => `const ${key} = ${value}u;\n`).join("");
  const key = [name, samples, lines].join();
  if (programs.has(key)) return programs.get(key);
  const skinning = sources["sinew.wgsl"].replace(/const SINEW_INFLUENCES.*\n/, "");
  const code = lines + sources[name + ".wgsl"].replace('#include "sinew.wgsl"', () => skinning);
  const module = device.createShaderModule({ code }), layout = "auto", areLines = name === "ground";
  const pipeline = samples ? device.createRenderPipeline({
    layout, vertex: { module }, multisample: { count: samples },
    fragment: { module, targets: [{ format, ...(areLines && { blend: { color: OVER, alpha: OVER } }) }] },
    primitive: { topology: areLines ? "line-list" : "triangle-list" },
    depthStencil: { format: "depth24plus", depthWriteEnabled: !areLines, depthCompare: "less" },
  }) : device.createComputePipeline({ layout, compute: { module } });
  const bindings = [...code.matchAll(/@binding\((\d+)\) var<[^>]*> (\w+)/g)];
  const members = [...code.matchAll(/@align\(16\) (\w+)/g)];
  programs.set(key, { pipeline, bindings, members });
  return programs.get(key);
}
const OVER = { srcFactor: "one", dstFactor: "one-minus-src-alpha" };

// number  of the draw since the last submit(): each has uniforms of its own until then
function bind(pass, { pipeline, bindings, members }, values, number = 0) {
  uniforms[number] ??= device.createBuffer({ size: 256, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
  const numbers = [];
  for (const [, name] of members) {
    numbers.push(...[values[name]].flatMap((value) => (value.length ? [...value] : [value])));
    while (numbers.length % 4) numbers.push(0);
  }
  queue.writeBuffer(uniforms[number], 0, Float32Array.from(numbers));
  const entries = bindings.map(([, binding, name]) => {
    return { binding: Number(binding), resource: { buffer: name === "uniforms" ? uniforms[number] : values[name].buffer } };
  });
  pass.setPipeline(pipeline);
  pass.setBindGroup(0, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
}

function submit(record) {
  const encoder = device.createCommandEncoder();
  record(encoder);
  queue.submit([encoder.finish()]);
}

const WORDS = { float4: 4, float2: 2, whole4: 4, whole2: 2, whole1: 1 };
const { STORAGE, INDEX, COPY_SRC, COPY_DST, MAP_READ } = GPUBufferUsage;

function array(kind, values, count) {
  const size = Math.max(4 * WORDS[kind] * count, values ? values.byteLength : 0, 16);
  const buffer = device.createBuffer({ size, usage: STORAGE | INDEX | COPY_SRC | COPY_DST });
  const write = (own) => queue.writeBuffer(buffer, 0, own);
  if (values) write(values);
  return { buffer, count, write };
}

function triangles(values) {
  return array("whole1", values, values.length);
}

function run(name, target, values, own) {
  submit((encoder) => {
    const pass = encoder.beginComputePass();
    bind(pass, program(name, own), { ...values, result: target });
    pass.dispatchWorkgroups(Math.ceil(target.count / 64));
    pass.end();
  });
}

async function read({ buffer }, first, count) {
  const copy = device.createBuffer({ size: 16 * count, usage: MAP_READ | COPY_DST });
  submit((encoder) => encoder.copyBufferToBuffer(buffer, 16 * first, copy, 0, 16 * count));
  await copy.mapAsync(GPUMapMode.READ);
  const found = new Float32Array(copy.getMappedRange()).slice();
  copy.destroy();
  return found;
}

const targets = {};

// A texture of the canvas's size, made anew where that has changed.
function target(format, samples) {
  const { width, height } = canvas, key = format + samples, old = targets[key];
  if (old?.width === width && old.height === height) return old.createView();
  old?.destroy();
  const usage = GPUTextureUsage.RENDER_ATTACHMENT;
  targets[key] = device.createTexture({ size: [width, height], format, sampleCount: samples, usage });
  return targets[key].createView();
}

function draw(list, isSmooth) {
  const samples = isSmooth ? 4 : 1, { height } = canvas;
  const shown = context.getCurrentTexture().createView(), depth = target("depth24plus", samples);
  const colour = isSmooth
    ? { view: target(format, 4), resolveTarget: shown, storeOp: "discard" }
    : { view: shown, storeOp: "store" };
  submit((encoder) => {
    const pass = encoder.beginRenderPass({
      colorAttachments: [{ ...colour, loadOp: "clear" }],
      depthStencilAttachment: { view: depth, depthClearValue: 1, depthLoadOp: "clear", depthStoreOp: "discard" },
    });
    list.forEach(({ name, port, seen, values, constants: own, triangles, ends }, number) => {
      bind(pass, program(name, own, samples), values, number);
      pass.setViewport(port[0], 0, port[1], height, 0, 1);
      pass.setScissorRect(seen[0], 0, seen[1], height);
      if (triangles) {
        pass.setIndexBuffer(triangles.buffer, "uint32");
        pass.drawIndexed(triangles.count);
      } else pass.draw(ends);
    });
    pass.end();
  });
}

return {
  name: "WebGPU", array, triangles, run, read, draw, finish: () => queue.onSubmittedWorkDone(),
  error: () => errors.length, lose: () => device.destroy(),
};
}
