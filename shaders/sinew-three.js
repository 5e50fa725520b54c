// SPDX-License-Identifier: MIT
// Has three.js deform the skinned meshes of a glTF file as its extension SINEW_skinning says:
//
//   loader.register((parser) => new SinewSkinning(parser));
//
// loader is a GLTFLoader. sinew.glsl is to be beside this file; docs/engines.md has the rest.
import {
  DataTexture, FloatType, MathUtils, Matrix4, MeshDepthMaterial, MeshDistanceMaterial, Quaternion, RGBADepthPacking,
  RGBAFormat, Skeleton, Vector3,
} from "three";

const NAME = "SINEW_skinning", METHODS = { lbs: 0, dq: 1, cor: 2 }, HIERARCHY = 4;
// Vectors of a bone: a row of the texture.
const WIDTH = 8;

// --- The buffer of bones, as bone_buffer.py makes it

const column = (matrix, number) => new Vector3().setFromMatrixColumn(matrix, number);

// A vector by a matrix, without its translation.
const moved = (matrix, vector) => vector.clone().applyMatrix4(matrix).sub(column(matrix, 3));

// Axes of unit length, perpendicular to each other: Y as it is, X as near as it can be.
function perpendicular(matrix) {
  const y = column(matrix, 1).normalize(), x = column(matrix, 0);
  x.addScaledVector(y, -x.dot(y)).normalize();
  return new Matrix4().makeBasis(x, y, x.clone().cross(y));
}

// Two vectors of length 1, perpendicular to each other and to the given one.
function across(vector) {
  const first = new Vector3(...(Math.abs(vector.x) < 0.9 * vector.length() ? [1, 0, 0] : [0, 1, 0]));
  first.cross(vector).normalize();
  return [first, vector.clone().cross(first).normalize()];
}

const rotation = (matrix) => new Quaternion().setFromRotationMatrix(perpendicular(matrix));

// From 1 at 150 degrees to 0 at 180.
const fade = (angle) => 1 - MathUtils.smoothstep(Math.abs(MathUtils.radToDeg(angle)), 150, 180);

// Its texture begins with what three.js has there: other materials, such as a scene's overrideMaterial, skin linearly.
// The buffer of bones follows, from the last row upwards; that row has the motion from the file's space to the world.
class SinewSkeleton extends Skeleton {
  // own: the extension of the skin. amount: of Twist Spread
  static of({ bones, boneInverses }, own, amount) {
    return Object.assign(new SinewSkeleton(bones, boneInverses), { own, amount });
  }

  clone() {
    return SinewSkeleton.of(this, this.own, this.amount);
  }

  computeBoneTexture() {
    const height = Math.ceil(this.bones.length / 2) + 1 + this.bones.length;
    this.boneMatrices = new Float32Array(4 * WIDTH * height);
    this.boneTexture = new DataTexture(this.boneMatrices, WIDTH, height, RGBAFormat, FloatType);
    this.rest = this.boneInverses.map((inverse) => inverse.clone().invert());
    this.fromRest = this.rest.map((matrix) => rotation(matrix).conjugate());
    return this;
  }

  // Bone -1 is the whole file.
  write(bone, vector, ...values) {
    const start = this.boneMatrices.length - 4 * WIDTH * (bone + 2) + 4 * vector;
    for (let k = 0; k < values.length; ++k) this.boneMatrices[start + k] = values[k];
  }

  update() {
    if (this.boneTexture === null) this.computeBoneTexture();
    super.update();
    let file = this.bones[0];
    while (file.parent && !file.userData.isSpaceOfSinew) file = file.parent;
    const fromWorld = file.matrixWorld.clone().invert();
    const posed = this.bones.map((bone) => fromWorld.clone().multiply(bone.matrixWorld));
    const motions = posed.map((matrix, bone) => matrix.clone().multiply(this.boneInverses[bone]));
    [file.matrixWorld, ...motions].forEach(({ elements: e }, k) => {
      for (let row = 0; row < 3; ++row) this.write(k - 1, row, e[row], e[row + 4], e[row + 8], e[row + 12]);
    });
    this.writeRotations(posed, motions);
    this.own?.lengths.forEach((length, bone) => this.writeSegment(bone, length, motions[bone]));
    this.own?.twists.forEach((twist, k) => this.writeTwist(twist, k + 1, motions));
  }

  // Each with the sign that brings it nearest to its parent's; a bone that mirrors counts as its parent.
  writeRotations(posed, motions) {
    const nearby = new Map([[null, new Quaternion()]]), numbers = new Map(this.bones.map((bone, k) => [bone, k]));
    const visit = (bone) => {
      if (nearby.has(bone)) return nearby.get(bone);
      let found = visit(bone.parent);
      const k = numbers.get(bone);
      if (k !== undefined) {
        const q = rotation(posed[k]).multiply(this.fromRest[k]), sign = q.dot(found) < 0 ? -1 : 1;
        q.set(sign * q.x, sign * q.y, sign * q.z, sign * q.w);
        this.write(k, 3, q.x, q.y, q.z, q.w);
        if (motions[k].determinant() >= 0) found = q;
      }
      nearby.set(bone, found);
      return found;
    };
    this.bones.forEach(visit);
  }

  // The direction of a bone's limb at rest: along its Y axis, where the file does not say otherwise.
  limb(bone) {
    return moved(this.rest[bone], new Vector3(...(this.own.axes?.[bone] ?? [0, 1, 0])));
  }

  // From the head to the tail at rest, and how much the motion stretches what is across the limb, at most.
  writeSegment(bone, length, motion) {
    const rest = this.rest[bone], along = this.limb(bone).multiplyScalar(length), image = moved(motion, along);
    const axes = perpendicular(rest), images = [0, 1, 2].map((axis) => moved(motion, column(axes, axis)));
    let stretch = Math.hypot(...images.map((v) => v.length())) / Math.sqrt(3);
    if (length > 0) {
      const [a, b] = across(along).map((axis) => moved(motion, axis));
      for (const v of [a, b]) v.addScaledVector(image, -v.dot(image) / (image.lengthSq() || 1));
      // The larger singular value of the two columns.
      const [sum, difference] = [a.lengthSq() + b.lengthSq(), a.lengthSq() - b.lengthSq()];
      stretch = Math.sqrt(sum / 2 + Math.hypot(difference / 2, a.dot(b)));
    }
    this.write(bone, 4, ...column(rest, 3), stretch, ...along, 0, 0, 0, 0);
  }

  writeTwist({ bone, base, tip, from, amount, curve }, number, motions) {
    // A base without volume: its scale is not known.
    const ofBase = motions[base].determinant() === 0 ? new Matrix4() : motions[base].clone().invert();
    const q = rotation(ofBase.multiply(motions[tip]).multiply(this.rest[tip])).multiply(this.fromRest[tip]);
    const along = this.limb(bone).normalize().dot(q) * Math.sign(q.w || 1), w = Math.abs(q.w);
    const angle = 2 * Math.atan2(along, w), swing = 2 * Math.acos(Math.min(Math.hypot(along, w), 1));
    const spread = this.amount * amount * angle * fade(angle) * fade(swing);
    if (spread === 0) return;
    // From the last number of vector 5.
    this.write(bone, 5.75, curve, ...(from === "parent" ? [-spread, 0] : [0, spread]), number);
  }
}

// --- The materials

// What takes the place of pieces of three.js' vertex shaders, by their names.
// content: the extension of the mesh. attributes: of the geometry
function pieces(glsl, { method, mix = method, parameters = {}, stages = [] }, attributes) {
  const methods = [method, mix].map(
    (name) => METHODS[name] + (parameters[`${name}.signs`] === "hierarchy" ? HIERARCHY : 0),
  );
  const amount = (name, isOn, factor = 1) =>
    isOn ? `(float(${factor}) * ${name in attributes ? name : "1.0"})` : "0.0";
  const has = (stage) => stages.includes(stage);
  const share = amount("_sinew_mix", mix !== method);
  const twist = amount("_sinew_twist_spread", has("twist_spread"));
  const bulge = amount("_sinew_bulge_limit", has("bulge_limit"), parameters["bulge_limit.strength"]);
  const form = parameters["bulge_limit.form"] === "kim_han" ? "SINEW_KIM_HAN" : "SINEW_CONTINUOUS";
  const centre = "_sinew_centre" in attributes ? "_sinew_centre" : "position";
  const types = { joints_1: "vec4", weights_1: "vec4", _sinew_centre: "vec3" };
  const declared = Object.keys(attributes).filter((name) => name in types || name.startsWith("_sinew_"));
  const list = (name, after = "") => [..."xyzw"].map((axis) => `${name}.${axis}${after}`);
  const joints = list("int(skinIndex", ")"), weights = list("skinWeight");
  if ("joints_1" in attributes) {
    joints.push(...list("int(joints_1", ")"));
    // The loader has made the sum of the first four 1.
    weights.splice(0, 4, ...list("skinWeight", " * (1.0 - dot(weights_1, vec4(1.0)))"), ...list("weights_1"));
  }
  const direction = (name) => `${name} = sinew_to_mesh(vec4(sinew_twist_normal(
    sinew_normal(${methods[0]}, (bindMatrix * vec4(${name}, 0.0)).xyz, sinew_joints, sinew_weights),
    ${twist}, (bindMatrix * vec4(position, 1.0)).xyz, sinew_joints, sinew_weights), 0.0));`;
  return {
    skinning_pars_vertex: `
#include <skinning_pars_vertex>
#define SINEW_BONES_DECLARED
#define SINEW_BONE(bone, k) texelFetch(boneTexture, ivec2(k, textureSize(boneTexture, 0).y - 2 - (bone)), 0)
#define SINEW_INFLUENCES ${joints.length}
${declared.map((name) => `attribute ${types[name] ?? "float"} ${name};`).join("\n")}
${glsl}
vec3 sinew_to_mesh(vec4 v) { return (bindMatrixInverse * vec4(sinew_by_bone(-1, v), v.w)).xyz; }`,
    skinbase_vertex: `
int sinew_joints[SINEW_INFLUENCES] = int[](${joints});
float sinew_weights[SINEW_INFLUENCES] = float[](${weights});`,
    skinnormal_vertex: `
${direction("objectNormal")}
#ifdef USE_TANGENT
${direction("objectTangent")}
#endif`,
    skinning_vertex: `
vec3 sinew_rest = (bindMatrix * vec4(transformed, 1.0)).xyz;
vec3 sinew_centre = (bindMatrix * vec4(${centre}, 1.0)).xyz;
vec3 sinew_point = sinew_mix(${methods}, ${share}, sinew_rest, sinew_centre, sinew_joints, sinew_weights);
sinew_point = sinew_twist_spread(sinew_point, sinew_linear_share(${methods}, ${share}), ${twist}, sinew_rest,
  sinew_joints, sinew_weights);
sinew_point = sinew_bulge_limit(sinew_point, ${form}, ${bulge}, sinew_rest, sinew_joints, sinew_weights);
transformed = sinew_to_mesh(vec4(sinew_point, 1.0));`,
  };
}

function patched(material, found) {
  material.customProgramCacheKey = () => JSON.stringify(found);
  material.onBeforeCompile = (shader) => {
    for (const [name, text] of Object.entries(found)) {
      shader.vertexShader = shader.vertexShader.replace(`#include <${name}>`, () => text);
    }
  };
  return material;
}

// --- The plugin

export class SinewSkinning {
  constructor(parser) {
    [this.name, this.parser] = [NAME, parser];
  }

  async afterRoot({ scenes }) {
    const { json, associations } = this.parser, meshes = [], skeletons = new Map();
    for (const scene of scenes) {
      scene.userData.isSpaceOfSinew = true;
      scene.traverse((mesh) => mesh.isSkinnedMesh && meshes.push(mesh));
    }
    const answer = await fetch(new URL("./sinew.glsl", import.meta.url));
    if (!answer.ok) throw new Error(`${answer.url}: ${answer.status}`);
    const glsl = await answer.text();
    for (const mesh of meshes) {
      const content = json.meshes[associations.get(mesh).meshes].extensions?.[NAME];
      if (!content) continue;
      const { method, mix = method, parameters } = content, amount = parameters?.["twist_spread.amount"] ?? 1;
      const missing = [method, mix].find((name) => !(name in METHODS));
      if (missing) {
        console.warn(`${mesh.name}: skinned linearly, as sinew.glsl lacks ${missing}`);
        continue;
      }
      // A mesh of several primitives has a node above it.
      const node = associations.get(mesh).nodes ?? associations.get(mesh.parent).nodes;
      const own = json.skins[json.nodes[node].skin].extensions?.[NAME], key = `${mesh.skeleton.uuid} ${amount}`;
      if (!skeletons.has(key)) skeletons.set(key, SinewSkeleton.of(mesh.skeleton, own, amount));
      mesh.bind(skeletons.get(key), mesh.bindMatrix);
      const found = pieces(glsl, content, mesh.geometry.attributes);
      mesh.material = patched(mesh.material.clone(), found);
      mesh.customDepthMaterial = patched(new MeshDepthMaterial({ depthPacking: RGBADepthPacking }), found);
      mesh.customDistanceMaterial = patched(new MeshDistanceMaterial(), found);
    }
  }
}
