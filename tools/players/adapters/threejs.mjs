// SPDX-License-Identifier: GPL-3.0-or-later
// three.js in node, without a window: reads a .glb, plays a clip and has three.js compute the vertices as its
// shaders do. Standard output has them as JSON.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [modules, file, times, clip] = process.argv.slice(2);
globalThis.self = globalThis;
const { THREE, GLTFLoader } = await import(pathToFileURL(modules));
const bytes = readFileSync(file);
const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const { scene, animations } = await new GLTFLoader().parseAsync(data, "");
const meshes = [];
scene.traverse((each) => each.isSkinnedMesh && meshes.push(each));
const [mesh] = meshes, mixer = new THREE.AnimationMixer(scene);
mixer.clipAction(animations[Number(clip)]).play();
const positions = mesh.geometry.attributes.position, count = positions.count, point = new THREE.Vector3();
const rest = Array.from({ length: count }, (_, k) => point.fromBufferAttribute(positions, k).toArray());
const points = times.split(",").map((time) => {
  mixer.setTime(Number(time));
  scene.updateMatrixWorld(true);
  mesh.skeleton.update();
  return rest.map((_, k) => mesh.getVertexPosition(k, point).applyMatrix4(mesh.matrixWorld).toArray());
});
console.log(JSON.stringify({ version: `r${THREE.REVISION}`, rest, points }));
